"""The turbine controller on a line with three blades: it sets, starts and pitches them, and stops where one fails."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import pytest

from app.errors import UsageError
from app.model.address import Address, parse_address
from app.model.description_file import load_builtin
from app.twins.controller import CONTROLLER_NODE, PMCS, PMMS, Phase, TurbineController
from app.twins.controller_devices import PARK_DEG
from app.twins.line import CanLine
from app.twins.pitch_law import PitchLaw
from app.twins.rotor import RATED_RPM, Rotor
from app.twins.surroundings import Surroundings
from app.twins.turbine import Settings, Turbine
from app.twins.wind import WindConstants
from app.twins.wire_faults import NodeGone
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtCommand
from app.wire.records import MalformedSeen, Outcome, Record, SdoSeen, Source, StateSeen, ValueSeen
from tests.twins.harness import SECOND, Master

DC_LINK_MOST = "6510:05"


class Rig:
    """A turbine, its rotor and its controller; a second master that hears everything and can write."""

    def __init__(self, angle_deg: float = 85.0, wind_mps: float = 14.0, unit_link: bool = True) -> None:
        self.line = CanLine(500_000)
        self.frames: list[Frame] = []
        self.line.tap(lambda _s, end_ns, can: self.frames.append(Frame(end_ns, "can0", Direction.RX, can)))
        pmm, pmc = load_builtin("oat-pmm"), load_builtin("oat-pmc")
        self.descriptions = dict.fromkeys(PMMS, pmm) | dict.fromkeys(PMCS, pmc)
        self.turbine = Turbine(self.line, pmm, pmc, Settings(angle_deg=angle_deg, unit_link=unit_link))
        self.rotor = Rotor(3, None, WindConstants(mean_mps=wind_mps, turbulence=0.02))
        self.surroundings = Surroundings(self.line, self.rotor, [blade.axis for blade in self.turbine.blades])
        self.contact: list[bool] = []
        self.controller = TurbineController(self.line, self.rotor, contact=self.contact.append)
        self.master = Master(self.line)
        self.turbine.power_on(0)
        self.surroundings.start(0)
        self.controller.start(0)

    def run(self, seconds: float) -> None:
        self.master.run(round(seconds * SECOND))

    def until(self, phase: Phase, timeout_s: float = 60.0) -> None:
        self.master.until(lambda: self.controller.phase is phase, round(timeout_s * SECOND), 20_000_000)

    def stands(self, phase: Phase) -> bool:
        return self.controller.phase is phase

    @property
    def angles(self) -> list[float]:
        return [blade.axis.angle_deg for blade in self.turbine.blades]

    def records(self) -> list[Record]:
        return CanOpenDecoder("can0", self.descriptions).feed_all(self.frames)

    def since(self, t_ns: int) -> Iterator[Can]:
        """Frames of the line from ``t_ns`` on."""
        return (frame.payload for frame in self.frames if frame.t_ns >= t_ns and isinstance(frame.payload, Can))

    def sent_to_axes(self, since_ns: int) -> int:
        return sum(can.can_id in {0x300 + node for node in PMCS} for can in self.since(since_ns))

    def break_axis(self, node: int = 12) -> None:
        """3210h: the DC link stands above its limit."""
        self.master.put(node, DC_LINK_MOST, 100, 2)
        self.until(Phase.TRIPPED, 2)

    def mend_axis(self, node: int = 12) -> None:
        self.master.put(node, DC_LINK_MOST, 750, 2)


@pytest.fixture(scope="module")
def working() -> Rig:
    """A turbine that has been started up and makes power."""
    rig = Rig()
    rig.run(40)
    return rig


def test_it_brings_the_turbine_from_power_on_to_rated_speed(working: Rig) -> None:
    assert working.stands(Phase.RUNNING)
    assert working.rotor.speed_rpm == pytest.approx(RATED_RPM, abs=0.6)
    assert working.rotor.generator_nm is not None
    assert working.rotor.generator_nm > 5e5
    assert max(working.angles) - min(working.angles) < 0.1
    assert 1.0 <= working.angles[0] < 12.0


def test_what_a_recording_must_show_is_on_the_wire_and_decoded(working: Rig) -> None:
    records = working.records()
    assert not [record for record in records if isinstance(record, MalformedSeen)]
    refused = [r for r in records if isinstance(r, SdoSeen) and r.outcome is not Outcome.DONE]
    assert not refused
    last_s = [r for r in records if isinstance(r, ValueSeen) and r.t_ns > 39 * SECOND]
    count: dict[tuple[int, Address, Source], int] = {}
    for seen in last_s:
        count[seen.node, seen.address, seen.source] = count.get((seen.node, seen.address, seen.source), 0) + 1
    for node, where, source, at_least in (
        (12, "6064", Source.PDO_TX, 49), (12, "606C", Source.PDO_TX, 49), (12, "60F4", Source.PDO_TX, 24),
        (12, "6079", Source.PDO_TX, 24), (12, "6864", Source.PDO_TX, 9), (12, "6041", Source.PDO_TX, 2),
        (12, "607A", Source.PDO_RX, 49), (12, "68F4", Source.SDO_READ, 1), (2, "30B2", Source.SDO_READ, 3),
        (2, "30B3", Source.SDO_READ, 1), (2, "3060", Source.PDO_TX, 4), (2, "3063", Source.PDO_TX, 9),
        (2, "3000", Source.PDO_TX, 1),
    ):  # fmt: skip
        assert count.get((node, parse_address(where), source), 0) >= at_least, (node, where)
    states = {r.node for r in records if isinstance(r, StateSeen) and r.t_ns > 39 * SECOND}
    assert states == {*PMMS, *PMCS, CONTROLLER_NODE}


def test_it_syncs_and_commands_every_20_ms_and_leaves_most_of_the_bus_free(working: Rig) -> None:
    syncs = [f.t_ns for f in working.frames if isinstance(f.payload, Can) and f.payload.can_id == 0x80][-500:]
    gaps = [after - before for before, after in pairwise(syncs)]
    assert sum(gaps) / len(gaps) == pytest.approx(20e6, rel=1e-3)
    assert max(gaps) < 22e6
    assert working.sent_to_axes(39 * SECOND) == pytest.approx(150, abs=3)
    assert working.line.busy_ns / working.line.now_ns < 0.3


def test_it_keeps_the_speed_in_a_gust_with_the_pitch() -> None:
    rig = Rig(angle_deg=8.0)
    rig.rotor.speed_rpm = RATED_RPM
    rig.run(15)
    before_deg = rig.angles[0]
    rig.surroundings.gust(6.0, rise_s=3.0, hold_s=3.0, fall_s=3.0)
    fastest_rpm, most_deg = 0.0, 0.0
    for _ in range(100):
        rig.run(0.1)
        fastest_rpm, most_deg = max(fastest_rpm, rig.rotor.speed_rpm), max(most_deg, rig.angles[0])
    assert most_deg > before_deg + 4
    assert fastest_rpm < 1.15 * RATED_RPM


def test_it_parks_and_starts_again_and_goes_to_an_angle_by_order() -> None:
    rig = Rig(angle_deg=20.0)
    rig.controller.command({"angle_deg": 30.0})
    rig.run(6)
    assert rig.stands(Phase.MANUAL)
    assert rig.angles == pytest.approx([30.0] * 3, abs=0.1)
    assert rig.rotor.generator_nm == 0.0
    rig.controller.command({"park": True})
    rig.until(Phase.STANDBY)
    rig.run(1)
    assert rig.angles == pytest.approx([PARK_DEG] * 3, abs=0.6)
    assert not any(blade.axis.brake_lifted for blade in rig.turbine.blades)
    rig.controller.command({"run": True})
    rig.run(5)
    assert rig.stands(Phase.RUNNING)
    assert max(rig.angles) < PARK_DEG - 10


def test_where_one_axis_fails_it_commands_nothing_more_until_it_is_reset() -> None:
    rig = Rig(angle_deg=8.0)
    rig.rotor.speed_rpm = RATED_RPM
    rig.run(5)
    assert rig.contact == [True]
    rig.break_axis()
    tripped_ns = rig.line.now_ns
    assert "12" in rig.controller.trip_reason
    assert rig.rotor.generator_nm == 0.0
    assert rig.contact == [True, False]
    rig.run(2)
    assert rig.sent_to_axes(tripped_ns + SECOND // 10) == 0
    rig.controller.command({"run": True})
    rig.run(1)
    assert rig.stands(Phase.TRIPPED)
    rig.mend_axis()
    rig.run(0.5)
    rig.controller.command({"reset": True})
    rig.run(3)
    assert rig.contact == [True, False, True]
    assert rig.stands(Phase.STANDBY)  # a person starts it again
    rig.controller.command({"run": True})
    rig.run(3)
    assert rig.stands(Phase.RUNNING)
    assert all(blade.axis.brake_lifted for blade in rig.turbine.blades)


def test_a_reset_while_the_fault_stands_starts_nothing() -> None:
    rig = Rig(angle_deg=8.0)
    rig.run(3)
    rig.break_axis()
    rig.controller.command({"reset": True})
    rig.controller.command({"run": True})
    rig.run(3)
    assert rig.stands(Phase.WAITING)


def test_a_device_that_nobody_hears_any_more_trips_it() -> None:
    rig = Rig(angle_deg=8.0, unit_link=False)
    rig.run(3)
    gone = NodeGone(rig.turbine.devices[13])
    rig.run(1)
    assert rig.stands(Phase.RUNNING)
    rig.until(Phase.TRIPPED, 1)
    assert rig.controller.trip_reason == "node 13 is silent"
    gone.end()
    rig.run(2)
    rig.controller.command({"reset": True})
    rig.controller.command({"run": True})
    rig.run(4)
    assert rig.stands(Phase.RUNNING)


@pytest.mark.parametrize("node", [13, 2])
def test_a_device_that_loses_its_power_trips_it_and_is_set_anew_when_it_is_back(node: int) -> None:
    rig = Rig(angle_deg=8.0)
    rig.run(3)
    rig.turbine.devices[node].power_off()
    rig.until(Phase.TRIPPED, 2)
    rig.run(1)
    back_ns = rig.line.now_ns
    rig.turbine.devices[node].power_on(back_ns)
    rig.run(2)
    starts = [can.data for can in rig.since(back_ns) if can.can_id == 0]
    assert starts == [bytes((NmtCommand.START, node))]
    period = 50 if node in PMCS else 5  # of its second PDO in a second
    assert sum(can.can_id == 0x280 + node for can in rig.since(rig.line.now_ns - SECOND)) == pytest.approx(
        period, abs=1
    )
    rig.controller.command({"reset": True})
    rig.controller.command({"run": True})
    rig.run(4)
    assert rig.stands(Phase.RUNNING)


def test_a_device_that_somebody_takes_out_of_operation_trips_it_and_is_started_by_the_reset() -> None:
    rig = Rig(angle_deg=8.0)
    rig.run(3)
    rig.master.nmt(NmtCommand.PRE_OPERATIONAL, 13)
    rig.until(Phase.TRIPPED, 2)
    assert rig.controller.trip_reason == "node 13 is not operational"
    rig.controller.command({"reset": True})
    rig.controller.command({"run": True})
    rig.run(6)
    assert rig.stands(Phase.RUNNING)


def test_a_device_that_restarts_under_way_trips_it() -> None:
    rig = Rig(angle_deg=8.0)
    rig.run(3)
    rig.master.nmt(NmtCommand.RESET_NODE, 11)
    rig.until(Phase.TRIPPED, 1)
    assert rig.controller.trip_reason


def test_where_an_input_drives_an_axis_to_feather_it_stops() -> None:
    rig = Rig(angle_deg=8.0)
    rig.run(3)
    rig.turbine.blades[2].pmc.inputs.efc = False
    rig.until(Phase.TRIPPED, 1)
    assert "13" in rig.controller.trip_reason


def test_silent_it_reads_nothing_and_the_rest_goes_on() -> None:
    rig = Rig(angle_deg=20.0)
    rig.run(3)
    rig.controller.command({"silent": True})
    rig.run(0.2)
    quiet_ns = rig.line.now_ns
    rig.run(3)
    assert not [can for can in rig.since(quiet_ns) if can.can_id & 0x780 == 0x600]
    assert rig.sent_to_axes(quiet_ns) > 400
    rig.controller.command({"silent": False})
    rig.run(1)
    assert [can for can in rig.since(quiet_ns) if can.can_id & 0x780 == 0x600]


def test_it_starts_the_battery_test_by_both_edges_of_its_bit() -> None:
    rig = Rig()
    rig.run(2)
    now_ns = rig.line.now_ns
    rig.controller.command({"battery_test": 2})
    rig.run(1)
    assert [can.data for can in rig.since(now_ns) if can.can_id == 0x202] == [b"\x02\x00", b"\x00\x00"]
    assert not [can for can in rig.since(now_ns) if can.can_id in (0x201, 0x203)]
    rig.controller.command({"battery_test": 0})
    rig.run(1)
    assert {can.can_id for can in rig.since(now_ns) if can.can_id & 0x780 == 0x200} >= {0x201, 0x202, 0x203}


def test_switched_off_it_is_silent_and_lets_go() -> None:
    rig = Rig(angle_deg=20.0)
    rig.run(2)
    rig.controller.stop()
    rig.run(0.1)
    now_ns = rig.line.now_ns
    rig.run(2)
    heard = {can.can_id for can in rig.since(now_ns) if not can.extended}
    assert not heard & {0x80, 0x700 + CONTROLLER_NODE, 0x30B, 0x60B}
    assert rig.contact == [True, False]
    assert rig.rotor.generator_nm is None


def test_another_one_takes_over_on_twins_that_have_run_for_long() -> None:
    rig = Rig(angle_deg=20.0)
    rig.run(2)
    rig.controller.stop()
    rig.run(5)
    following = TurbineController(rig.line, rig.rotor, contact=rig.contact.append)
    following.start(rig.line.now_ns)
    rig.run(3)
    following.command({"reset": True})  # the axes miss the heartbeat of the first one, and its contact was open
    following.command({"run": True})
    rig.run(4)
    assert following.phase is Phase.RUNNING
    assert rig.contact[-1] is True


@pytest.mark.parametrize(
    ("table", "field"),
    [
        ({}, "controller"), ({"run": True, "park": True}, "controller"), ({"run": False}, "run"),
        ({"fly": True}, "fly"),
        ({"angle_deg": 95.0}, "angle_deg"), ({"angle_deg": True}, "angle_deg"), ({"angle_deg": "45"}, "angle_deg"),
        ({"angle_deg": float("nan")}, "angle_deg"), ({"reset": 1}, "reset"), ({"silent": "yes"}, "silent"),
        ({"battery_test": 4}, "battery_test"), ({"battery_test": True}, "battery_test"),
    ],
)  # fmt: skip
def test_an_order_that_makes_no_sense_names_its_field(table: dict[str, object], field: str) -> None:
    line = CanLine(500_000)
    controller = TurbineController(line, Rotor(1))
    with pytest.raises(UsageError) as caught:
        controller.command(table)
    assert caught.value.details["field"] == field
    assert controller.phase is Phase.WAITING


# -- what it wants of pitch and generator ---------------------------------------------------


def closed_loop(mean_mps: float, seconds: float = 120.0) -> tuple[Rotor, PitchLaw]:
    rotor, law = Rotor(3, None, WindConstants(mean_mps=mean_mps, turbulence=0.05)), PitchLaw()
    law.start(85.0)
    for _ in range(round(seconds * 10)):
        law.step(0.1, rotor.speed_rpm)
        rotor.generator_nm = law.generator_nm
        rotor.step(0.1, (law.pitch_deg,) * 3)
    return rotor, law


def test_the_stronger_the_wind_the_more_pitch_at_rated_speed() -> None:
    pitches = []
    for mean_mps in (14.0, 17.0, 20.0, 24.0):
        rotor, law = closed_loop(mean_mps)
        assert rotor.speed_rpm == pytest.approx(RATED_RPM, rel=0.04)
        assert law.generator_nm > 0.8 * law.constants.rated_nm
        pitches.append(law.pitch_deg)
    assert pitches == sorted(pitches)
    assert pitches[-1] - pitches[0] > 10


def test_in_weak_wind_the_pitch_is_fine_and_the_generator_takes_what_is_best() -> None:
    rotor, law = closed_loop(7.5)
    assert law.pitch_deg == law.constants.fine_deg
    assert rotor.speed_rpm < 0.95 * RATED_RPM
    ratio = rotor.speed_rpm * 6.2832 / 60 * 35.0 / 7.5
    assert ratio == pytest.approx(7.5, rel=0.1)  # tip-speed ratio of the best power


def test_the_pitch_never_changes_faster_than_its_rate() -> None:
    law = PitchLaw()
    law.start(40.0)
    for rpm in (0.0, 40.0, 0.0, 18.0, 60.0):
        before_deg = law.pitch_deg
        law.step(0.1, rpm)
        assert abs(law.pitch_deg - before_deg) <= law.constants.rate_dps * 0.1 + 1e-9


def test_it_takes_no_torque_before_the_rotor_turns_and_waits_at_its_start_angle() -> None:
    law = PitchLaw()
    law.start(50.0)
    for _ in range(200):
        law.step(0.1, 3.0)
    assert law.generator_nm == 0.0
    assert law.pitch_deg == law.constants.start_deg
