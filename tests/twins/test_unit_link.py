"""The link between PMM and PMC: its frames, what each makes of them, and what a broken link does."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.model.description_file import load_builtin
from app.twins.line import CanLine, Fault, drop
from app.twins.turbine import Settings, Turbine
from app.twins.unit_link import AxisFlag, AxisReport, SupplyFlag, SupplyReport
from app.wire.frame import Can
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import PMC, PMM, BladeRig

FROM_PMM, FROM_PMC = 0x681, 0x68B
LINK_BROKEN = 0x3221
RESET = 0x80
SAFETY_CHAIN = 1 << 16


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def lose(rig: BladeRig, can_id: int) -> None:
    """Every frame of one identifier is lost from now on."""
    rig.line.inject(Fault(lambda can: can.can_id == can_id, drop, times=None))


def test_each_unit_sends_every_100_ms_from_its_boot_on(rig: BladeRig) -> None:
    rig.master.run(SECOND)
    for node, can_id in ((PMM, FROM_PMM), (PMC, FROM_PMC)):
        boot = rig.master.all_of(0x700 + node)[0]
        frames = rig.master.all_of(can_id)
        assert 99 * MS < frames[0].t_ns - boot.t_ns < 101 * MS
        gaps = {round((after.t_ns - before.t_ns) / MS) for before, after in pairwise(frames)}
        assert (gaps, {len(frame.can.data) for frame in frames}) == ({100}, {8})


def test_six_units_take_little_of_the_bus() -> None:
    line = CanLine(500_000)
    Turbine(line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), Settings()).power_on(0)
    line.run_until(SECOND)
    before_ns = line.busy_ns
    line.run_until(11 * SECOND)
    assert 0.01 < (line.busy_ns - before_ns) / (10 * SECOND) < 0.016


def test_without_the_link_nothing_is_sent_and_nothing_is_missed() -> None:
    rig = BladeRig(unit_link=False)
    rig.master.run(3 * SECOND)
    assert not rig.master.all_of(FROM_PMM) + rig.master.all_of(FROM_PMC)
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (0, 1)


@pytest.mark.rule("H8")
@pytest.mark.rule("I11")
def test_the_pmc_tells_position_and_motor_temperature(rig: BladeRig) -> None:
    rig.enable()
    rig.go(7000)
    rig.master.run(500 * MS)
    data = rig.master.all_of(FROM_PMC)[-1].can.data
    assert 7000 < int.from_bytes(data[:4], "little", signed=True) < 7999
    assert data[6] & AxisFlag.MOVES
    rig.wait_bit(10)
    rig.master.run(SECOND)
    data = rig.master.all_of(FROM_PMC)[-1].can.data
    assert int.from_bytes(data[:4], "little", signed=True) == pytest.approx(rig.get("6064"), abs=1)
    assert int.from_bytes(data[4:6], "little", signed=True) == pytest.approx(rig.get("6410:09"), abs=1)
    axis = rig.pmm.axis
    assert axis is not None
    assert AxisFlag.POSITION_VALID in axis.flags
    assert axis.position_cdeg == pytest.approx(7000, abs=11)


@pytest.mark.rule("I11")
def test_the_position_is_in_hundredths_of_a_degree_whatever_the_unit_of_the_axis(rig: BladeRig) -> None:
    rig.put("6092:01", 3600)
    rig.master.run(150 * MS)
    assert rig.get("6064") == 511  # 83.21 degrees from the encoder's zero, and an offset of -321 units of 0.1 degrees
    assert rig.pmm.axis is not None
    assert rig.pmm.axis.position_cdeg == pytest.approx(5110, abs=9)


def test_a_position_by_a_bad_encoder_is_marked(rig: BladeRig) -> None:
    rig.pmc.errors.condition(0x7305, True)
    rig.master.run(150 * MS)
    assert rig.pmm.axis is not None
    assert AxisFlag.POSITION_VALID not in rig.pmm.axis.flags
    assert AxisFlag.FAULT in rig.pmm.axis.flags


def test_the_pmm_tells_its_state(rig: BladeRig) -> None:
    rig.blade.power.mains_present = False
    rig.pmm.errors.event(0x5112)
    rig.master.run(250 * MS)
    assert rig.master.all_of(FROM_PMM)[-1].can.data[1] == SupplyFlag.FAULT | SupplyFlag.MAINS_FAILED


@pytest.mark.rule("I13")
def test_the_manual_function_reaches_the_pmc(rig: BladeRig) -> None:
    rig.pmm.inputs.selector, rig.pmm.inputs.key = 3, True
    rig.master.run(150 * MS)
    assert rig.master.all_of(FROM_PMM)[-1].can.data[0] == 0x13
    assert rig.get("5041") == 0x13
    rig.put("5040", 0x25)
    assert rig.get("5041") == 0x05
    rig.put("5040", 0x05)
    assert rig.get("5041") == 0x13


def test_a_silent_pmc_is_an_error_after_1_s_that_goes_with_a_reset(rig: BladeRig) -> None:
    rig.master.run(200 * MS)
    lose(rig, FROM_PMC)
    last_ns = rig.master.all_of(FROM_PMC)[-1].t_ns
    message = rig.master.wait_id(0x80 + PMM)
    assert SECOND <= message.t_ns - last_ns <= 1100 * MS
    assert int.from_bytes(message.can.data[:2], "little") == LINK_BROKEN == rig.get("603F", PMM)
    assert rig.pmm.axis is None
    assert not rig.get("30FE:03", PMM) & SAFETY_CHAIN
    rig.put("3040", RESET, PMM)
    assert rig.get("603F", PMM) == LINK_BROKEN
    rig.line.clear_faults()
    rig.master.run(150 * MS)
    assert rig.get("603F", PMM) == LINK_BROKEN
    rig.put("3040", 0, PMM)
    rig.put("3040", RESET, PMM)
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (0, 1)
    assert rig.errors(PMM) == [LINK_BROKEN]


def test_a_silent_pmm_leaves_the_pmc_without_a_manual_function(rig: BladeRig) -> None:
    rig.pmm.inputs.selector = 4
    rig.master.run(150 * MS)
    lose(rig, FROM_PMM)
    rig.master.run(900 * MS)
    assert rig.get("5041") == 4
    rig.master.run(300 * MS)
    assert rig.get("5041") == 0
    rig.line.clear_faults()
    rig.master.run(150 * MS)
    assert rig.get("5041") == 4
    assert rig.errors(PMC) == []


def test_who_was_never_heard_is_not_missed() -> None:
    rig = BladeRig()
    lose(rig, FROM_PMC)
    rig.restart(PMM)
    rig.master.run(3 * SECOND)
    assert rig.errors(PMM) == []


@pytest.mark.parametrize("node", [PMM, PMC])
def test_one_unit_may_restart_alone(node: int) -> None:
    rig = BladeRig(boot_ns=600 * MS)
    rig.master.run(200 * MS)
    rig.restart(node)
    rig.master.run(2 * SECOND)
    assert rig.errors(PMM) == []
    assert rig.pmm.axis is not None


def test_a_stopped_unit_is_silent_and_misses_nobody(rig: BladeRig) -> None:
    rig.master.run(200 * MS)
    rig.master.nmt(NmtCommand.STOP, PMM)
    rig.master.run(50 * MS)
    place = len(rig.master.all_of(FROM_PMM))
    rig.master.run(2 * SECOND)
    assert len(rig.master.all_of(FROM_PMM)) == place
    assert rig.pmm.link is not None
    assert rig.pmm.link.data is None
    rig.master.nmt(NmtCommand.START, PMM)
    rig.master.run(250 * MS)
    assert rig.pmm.axis is not None
    assert rig.errors(PMM) == []
    rig.master.nmt(NmtCommand.STOP, PMC)
    rig.master.run(1300 * MS)
    assert rig.errors(PMM) == [LINK_BROKEN]


def test_frames_of_another_shape_say_nothing(rig: BladeRig) -> None:
    rig.master.run(200 * MS)
    lose(rig, FROM_PMC)
    before = rig.pmm.axis
    rig.master.send(FROM_PMC, b"\x01\x02")
    rig.master.send(FROM_PMC, remote=True, dlc=8)
    rig.master.run(50 * MS)
    assert rig.pmm.axis == before


def test_reports_survive_their_frames() -> None:
    axis = AxisReport(-12345, 873, AxisFlag.MOVES)
    assert AxisReport.from_bytes(axis.to_bytes()) == axis
    supply = SupplyReport(0x13, SupplyFlag.MAINS_FAILED)
    assert SupplyReport.from_bytes(supply.to_bytes()) == supply
    assert AxisReport.from_bytes(AxisReport(1 << 40, -(1 << 20)).to_bytes()) == AxisReport((1 << 31) - 1, -(1 << 15))
    for parse in (AxisReport.from_bytes, SupplyReport.from_bytes):
        with pytest.raises(ValueError, match="8 bytes"):
            parse(bytes(7))


def test_a_foreign_frame_of_the_link_counts_as_the_pmc(rig: BladeRig) -> None:
    """Nothing on the bus proves who sent a frame; a link that is imitated is believed, as on a real bus."""
    lose(rig, FROM_PMC)
    rig.line.clear_faults()
    rig.master.port.send(Can(FROM_PMC, AxisReport(100, 200, AxisFlag.POSITION_VALID).to_bytes()))
    rig.master.run(MS)
    assert rig.pmm.axis == AxisReport(100, 200, AxisFlag.POSITION_VALID)
