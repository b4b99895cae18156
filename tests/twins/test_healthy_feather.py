"""A healthy turbine feathers on its mains without a fault: all three blades at once, from 80 degrees and from 0."""

from __future__ import annotations

import pytest

from app.model.address import Address
from app.model.description_file import load_builtin
from app.twins.line import CanLine
from app.twins.turbine import Settings, Turbine

S = 1_000_000_000
CONTROLWORD = Address(0x6040)


@pytest.mark.parametrize("start_deg", [80.0, 0.5])
def test_three_blades_feather_without_a_fault(start_deg: float) -> None:
    line = CanLine(500_000)
    turbine = Turbine(line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), Settings(angle_deg=start_deg))
    turbine.power_on(0)
    line.run_until(2 * S)
    for blade in turbine.blades:
        blade.pmc.device.store.write(CONTROLWORD, (0x080F).to_bytes(2, "little"))
    lowest_v = 1e9
    for _ in range(300):
        line.run_until(line.now_ns + S // 10)
        lowest_v = min(lowest_v, *(blade.power.dc_link_v for blade in turbine.blades))
    for blade in turbine.blades:
        assert blade.axis.angle_deg > 89.5
        for device in blade.devices:
            assert device.store.number(0x603F, 0) == 0, f"node {device.node_id}"
    assert lowest_v > 500, "the mains holds the DC link"
