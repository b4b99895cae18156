"""The PROFIBUS driver on a bad line: whatever is lost, doubled, cut off or damaged, nothing wrong is believed.

By the line's own clock, so that ten minutes of it pass as fast as they can be reckoned.
"""

from __future__ import annotations

import time

import pytest

from app.drivers.contract import LinkState
from app.errors import NoAnswerError, UnverifiedError
from app.twins.ed2.dp_line import LineNoise
from tests.drivers.profibus_rig import DEADLINE_S, NODE, RAMP_VELOCITY, connected, gone, ip, wire
from tests.drivers.profibus_soak import Findings, Soak, library_clock

LOWER_WINDOW = ip(12, 163)
NOISE = {"bit_errors": 2e-5, "lost": 0.01, "doubled": 0.01, "truncated": 0.005}


def run(seed: int, duration_s: float, restart_every_s: float | None, noise: dict[str, float]) -> Findings:
    soak = Soak(seed, LineNoise(seed, **noise) if noise else None, restart_every_s)
    with library_clock(soak.line):
        found = soak.run(duration_s)
    assert soak.bus.port is not None
    recoveries = ", ".join(f"{each:.2f}" for each in found.recoveries_s)
    print(f"\n{duration_s:g} s: {found.reads} reads, {found.writes} writes, {found.fresh} fresh process data,")
    print(f"{found.edges} edges, {found.timeouts} reads and {found.open_writes} writes without an answer")
    print(f"line: {vars(soak.bus.port.counters)}; recovery after power-on, s: {recoveries or 'none'}")
    return found


def test_a_good_line_loses_nothing() -> None:
    found = run(1, 5.0, None, {})
    assert found.wrong == []
    assert (found.timeouts, found.open_writes) == (0, 0)
    assert min(found.reads, found.writes, found.edges) > 20


@pytest.mark.parametrize("seed", [1, 2])
def test_a_bad_line_costs_time_and_tells_nothing_wrong(seed: int) -> None:
    found = run(seed, 20.0, 6.0, NOISE)
    assert found.wrong == []
    assert min(found.reads, found.writes, found.edges) > 20
    assert len(found.recoveries_s) >= 2
    assert max(found.recoveries_s) < 3


@pytest.mark.soak
@pytest.mark.parametrize("kind", ["bit_errors", "lost", "doubled", "truncated", "all"])
def test_ten_minutes_of_a_bad_line(kind: str) -> None:
    noise = NOISE if kind == "all" else {kind: 5 * NOISE[kind]}
    found = run(7, 600.0, 20.0, noise)
    assert found.wrong == []
    assert found.reads > 1000
    assert max(found.recoveries_s) < 5


@pytest.mark.alone
@pytest.mark.timeout(180)
async def test_a_minute_on_the_pseudo_terminal() -> None:
    """In real time, with a slave that is switched off and on: all values are those of the device, and it comes back."""
    rates = {RAMP_VELOCITY: 0, LOWER_WINDOW: 0}
    reads = refused = restarts = 0
    with wire() as line:
        async with connected(line.config(NODE)) as driver:
            end_s = time.monotonic() + 60
            while time.monotonic() < end_s:
                for address in rates:
                    rates[address] = 1 + (rates[address] + 37) % 9000
                    data = rates[address].to_bytes(4, "little")
                    try:
                        await driver.write(NODE, address, data, DEADLINE_S)
                        assert await driver.read(NODE, address, DEADLINE_S) == data
                        reads += 1
                    except (NoAnswerError, UnverifiedError):
                        refused += 1  # the host may stand still; what was written then nobody claims to know
                if reads // 400 > restarts:
                    restarts += 1
                    line.power_off()
                    await gone(driver, NODE)
                    line.power_on()
            assert driver.status.state is LinkState.CONNECTED
            counters = driver._line.port.counters if driver._line.port else None
    print(f"\n{reads} values, {refused} without an answer, {restarts} restarts; line: {vars(counters)}")
    assert reads > 100
    assert refused <= reads // 10
