"""The scenario of an incident, played on the twin: what a master sees of it, and when."""

from __future__ import annotations

from pathlib import Path

from app.twins.ed2.delivered import INCREMENTAL
from app.twins.ed2.device import Settings
from app.twins.ed2.faults import FaultPlan
from app.twins.ed2.scenario import load_scenario
from app.twins.ed2.states import State
from app.wire.profibus.telegrams import ERROR_CODE
from tests.twins.ed2.rig import MS, Rig, made

SCRIPT = Path(__file__).resolve().parents[3] / "recordings" / "scenarios-ed2" / "cylinder-sensor-wire.toml"
RUN, START, RESET = 0x7, 0x2000, 0x8
FOLLOWING_1 = 0x8230


def playing() -> Rig:
    """A twin with incremental sensors under the scenario, its master at work."""
    scenario = load_scenario(SCRIPT)
    rig = made(Settings(transducer=INCREMENTAL))
    plan = FaultPlan([rig.device], lambda fault: setattr(rig.line, "fault", fault), scenario.seed)
    for order in scenario.orders:
        plan.add(order)
    live = rig.line.on_time

    def pass_on(t_ns: int) -> None:
        plan.run_until(t_ns)
        live(t_ns)

    rig.line.on_time = pass_on
    rig.master.start(102)
    return rig


def until_s(rig: Rig, at_s: float) -> None:
    while rig.line.now_ns < at_s * 1_000 * MS:
        rig.master.advance(50, every=10)


def code(rig: Rig) -> int:
    return rig.master.seen[0][ERROR_CODE]


def test_a_wire_that_breaks_at_rest_shows_with_the_next_move_and_is_reset_once_it_is_whole() -> None:
    rig = playing()
    master = rig.master
    until_s(rig, 12.0)
    assert master.set(RUN) & 0xF == State.DEVICE_MODE_ACTIVE.value
    assert (code(rig), master.actual) == (0, 0), "it broke two seconds ago, and nothing shows it"

    master.set(RUN | START, 150_000)
    took_ms = master.until(lambda: bool(code(rig)), 5_000)
    assert code(rig) == FOLLOWING_1
    assert 500 < took_ms < 2_000, "50 mm at 100 mm/s, and a delay of 0.2 s"
    assert master.actual == 0, "cylinder 1 tells the same place all the while"
    master.until(lambda: master.status & 0xF == State.FAULT.value)
    first, second = rig.device.axes
    assert True in first.cylinder.limits, "without feedback its loop drove it into the switch"
    assert code(rig) == FOLLOWING_1, "the first error is told"
    assert second.state is State.FAULT
    assert second.position > 5.0, "cylinder 2 has gone, and is believed"

    until_s(rig, 46.0)
    master.set(0)
    master.until(lambda: all(axis.cylinder.still for axis in rig.device.axes))
    master.set(RESET)
    master.until(lambda: code(rig) == 0, 5_000)
    assert abs(master.actual) > 1_000, "the true place again"
