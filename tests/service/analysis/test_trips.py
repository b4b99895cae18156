"""Trips of the scenarios against their scripts: what was done, when and where, must be what came first."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.recording.exchange.cut import CutOrder, cut
from app.recording.index import build_index
from app.recording.reader import open_recording
from app.service.analysis.because import Reason
from app.service.analysis.key_events import KeyKind, events_after, events_before, key_events
from app.service.analysis.look import Look
from app.service.analysis.trips import Role, Trip, find_trips
from app.service.analysis.words import tellers
from app.wire.signs import Sign, SignKind, folded
from tests.service.analysis.rig import BUS, PLACES, S, at_s, emcy, look, scenario, script, sign, the_trip

PMMS, PMCS = {(BUS, n) for n in (1, 2, 3)}, {(BUS, n) for n in (11, 12, 13)}


def headline(number: int, language: str = "en") -> str:
    return tellers(look(number).places)[language].headline(the_trip(number))


def kinds_of(trip: Trip, role: Role) -> list[SignKind]:
    return [one.step.kind for one in trip.steps if one.role is role]


def step_of(trip: Trip, kind: SignKind, node: int | None = None, subject: str = "") -> int:
    return next(
        place
        for place, one in enumerate(trip.steps)
        if one.step.kind is kind
        and (node is None or (BUS, node) in one.step.nodes)
        and one.step.sign.subject.startswith(subject)
    )


# -- the scenarios, one by one ---------------------------------------------------


def test_a_normal_stop_and_a_gust_are_no_trip() -> None:
    assert look(1).trips == []
    assert {one.kind for one in look(1).signs if not one.ends} <= {
        SignKind.BOOT_UP, SignKind.AXIS_ENABLED, SignKind.PARAMETER_WRITTEN,
    }  # fmt: skip


def test_mains_failure_opens_the_chain_when_the_hold_up_time_is_over() -> None:
    trip, done = the_trip(2), script(2, fault="mains_failure")
    first = trip.steps[trip.first].step
    assert (first.kind, set(first.nodes), trip.trigger) == (SignKind.MAINS_LOW, PMMS, trip.first)
    assert 0 <= at_s(2, first.t_ns) - done["at_s"] < 0.1
    assert trip.steps[trip.at].step.kind is SignKind.RELAY_OPEN
    assert at_s(2, trip.t0_ns) - done["at_s"] == pytest.approx(3.0, abs=0.05)
    because = trip.steps[trip.at].because
    assert because is not None
    assert (because.cause, because.reason) == (trip.first, Reason.HOLD_UP)
    assert headline(2) == "Safety chain opened, 3003 ms after mains failure"
    assert headline(2, "de") == "Sicherheitskette geöffnet, 3003 ms nach: Netzausfall"
    assert trip.ended_ns is not None
    assert at_s(2, trip.ended_ns) == pytest.approx(script(2, reset=True)["at_s"], abs=0.1)


def test_following_error_of_blade_2_trips_all_blades() -> None:
    trip = the_trip(3)
    trigger = trip.steps[trip.trigger].step
    assert (trigger.sign.details["code"], trigger.nodes) == (0x8611, ((BUS, 12),))
    assert trip.steps[trip.first].step.nodes == ((BUS, 12),)
    assert 0 < at_s(3, trip.t0_ns) - script(3, fault="gust")["at_s"] < 2
    assert headline(3).startswith("Blade 2 PMC: following error too large (8611h)")
    lost = step_of(trip, SignKind.EFC_INPUT)
    assert set(trip.steps[lost].step.nodes) == PMCS
    why = tellers(look(3).places)["en"].because_of(trip, lost)
    assert why is not None
    assert why.endswith("blade 2 PMC: following error too large (8611h)")


def test_a_slipping_blade_encoder_is_told_by_its_error_and_not_the_small_slip_before() -> None:
    trip, done = the_trip(4), script(4, fault="blade_encoder_slip", slip_deg=5.0)
    first = trip.steps[trip.first].step
    assert (first.sign.details["code"], first.nodes) == (0x8620, ((BUS, 10 + done["blade"]),))
    assert at_s(4, first.t_ns) - done["at_s"] == pytest.approx(0.2, abs=0.05)
    assert headline(4) == "Blade 3 PMC: motor encoder and blade encoder differ too much (8620h)"


def test_an_aged_battery_opens_the_chain_before_the_hold_up_time_is_over() -> None:
    trip, done, weak = the_trip(5), script(5, fault="mains_failure"), script(5, fault="bloc_weak")
    first, trigger = trip.steps[trip.first].step, trip.steps[trip.trigger].step
    assert first.kind is SignKind.MAINS_LOW
    assert at_s(5, first.t_ns) == pytest.approx(done["at_s"], abs=0.1)
    assert (trigger.sign.details["code"], trigger.nodes) == (0x3280, ((BUS, weak["blade"]),))
    assert headline(5) == "Blade 1 PMM: battery voltage too low (3280h), 943 ms after mains failure"
    assert trip.steps[trip.at].step.nodes == ((BUS, 1),), "its relay alone has opened"
    assert kinds_of(trip, Role.BEFORE) == [SignKind.BATTERY_TEST], "the failed test was known"
    late = trip.steps[step_of(trip, SignKind.EMCY, 11, "8611")]
    assert late.role is Role.CONSEQUENCE, "no voltage to drive"


def test_a_node_that_drops_out_is_found_by_its_silence_and_not_by_who_missed_it() -> None:
    trip, done = the_trip(6), script(6, fault="node_gone")
    first, trigger = trip.steps[trip.first].step, trip.steps[trip.trigger].step
    assert (first.kind, first.nodes) == (SignKind.SILENT, ((BUS, done["node"]),))
    assert -0.03 < at_s(6, first.t_ns) - done["at_s"] <= 0, "since its last frame"
    assert (trigger.sign.details["code"], trigger.nodes) == (0x3221, ((BUS, 3),))
    unseen = trip.steps[step_of(trip, SignKind.EFC_INPUT, 13)]
    assert unseen.role is Role.CONSEQUENCE, "it is read only when the cable is back, and came when the chain opened"
    assert at_s(6, unseen.step.sign.since_ns) < 15 < 35 < at_s(6, unseen.step.t_ns)


def test_restarts_of_a_service_visit_are_told_as_restarts() -> None:
    trip, done = the_trip(7), script(7, do="restart", node=12)
    first = trip.steps[trip.first].step
    assert (first.kind, first.nodes) == (SignKind.NMT_COMMAND, ((BUS, done["node"]),))
    assert at_s(7, first.t_ns) == pytest.approx(done["at_s"], abs=0.01)
    assert headline(7).endswith("blade 2 PMC: NMT command: Reset node")
    second = script(7, do="restart", node=2)
    command = trip.steps[step_of(trip, SignKind.NMT_COMMAND, 2)]
    assert (command.role, round(at_s(7, command.step.t_ns))) == (Role.OWN, second["at_s"])
    boot = trip.steps[step_of(trip, SignKind.BOOT_UP, 2)].because
    assert boot is not None
    assert (trip.steps[boot.cause].step, boot.reason) == (command.step, Reason.COMMAND)
    refused = [one for one in trip.steps if one.step.kind is SignKind.WRITE_ABORTED]
    assert [one.role for one in refused] == [Role.BEFORE] * 2


def test_a_foreign_master_that_stops_a_node_is_what_came_first() -> None:
    trip, done = the_trip(8), script(8, nmt=128)
    first = trip.steps[trip.first].step
    assert (first.kind, first.nodes) == (SignKind.NMT_COMMAND, ((BUS, done["node"]),))
    assert at_s(8, first.t_ns) == pytest.approx(done["at_s"], abs=0.01)
    changed = trip.steps[step_of(trip, SignKind.PARAMETER_WRITTEN)]
    assert (changed.role, changed.step.sign.details["raw"]) == (Role.BEFORE, script(8, index=0x6065)["raw"])


@pytest.mark.parametrize("number", range(2, 9))
def test_every_step_is_told_in_both_languages_without_a_hole(number: int) -> None:
    trip = the_trip(number)
    for language, teller in tellers(look(number).places).items():
        for place in range(len(trip.steps)):
            for text in (teller.step_of(trip, place), teller.because_of(trip, place) or ""):
                assert "–" not in text, (language, text)
                assert "sign." not in text, (language, text)
                assert "analysis." not in text, (language, text)
    english, german = (teller.headline(trip) for teller in tellers(look(number).places).values())
    assert english != german


@pytest.mark.parametrize("number", range(2, 9))
def test_nothing_is_explained_by_itself_and_steps_stand_in_their_order(number: int) -> None:
    trip = the_trip(number)
    times = [one.step.t_ns for one in trip.steps]
    assert times == sorted(times)
    for place in range(len(trip.steps)):
        seen, at = set(), place
        while (because := trip.steps[at].because) is not None:
            assert at not in seen
            seen.add(at)
            at = because.cause


# -- rules, by signs of their own ------------------------------------------------


def trips_of(*signs: Sign) -> list[Trip]:
    return find_trips(folded(signs), PLACES)


def test_a_chain_that_opens_with_nothing_before_it_is_told_as_unexplained() -> None:
    (trip,) = trips_of(
        sign(1000, 1, SignKind.CHAIN_OPEN, clamp="X13.10"), sign(1040, 11, SignKind.EFC_INPUT, clamp="X2.3")
    )
    assert (trip.known, trip.first, trip.at) == (False, 0, 0)
    assert "nothing on the bus tells why" in tellers(PLACES)["en"].headline(trip)
    assert trip.steps[1].role is Role.CONSEQUENCE


def test_what_was_so_before_anybody_looked_is_no_trip() -> None:
    assert trips_of(sign(0, 11, SignKind.EFC_INPUT, standing=True, subject="60FD.18")) == []


def test_a_unit_that_was_tripped_before_the_recording_hides_no_trip_of_others() -> None:
    scene, before = look(3), the_trip(3)
    was = sign(0, 13, SignKind.AXIS_FAULT, standing=True, subject="6041.3")
    was = was._replace(t_ns=scene.span_ns[0] + 10 * S)
    (trip,) = find_trips(folded([was, *scene.signs]), scene.places)
    assert (trip.t0_ns, trip.ended_ns) == (before.t0_ns, before.ended_ns)
    assert (before.already, trip.already) == ((), ((BUS, 13),))
    first, like = (one.steps[one.first].step for one in (trip, before))
    assert first == like
    for language, teller in tellers(scene.places).items():
        assert teller.headline(trip) == headline(3, language)
        assert teller.already(before.already) is None
    assert tellers(scene.places)["en"].already(trip.already) == "Tripped already before the recording: blade 3 PMC"
    assert tellers(scene.places)["de"].already(trip.already) == "Schon vor der Aufzeichnung ausgelöst: Blatt 3 PMC"


@pytest.mark.parametrize("gone", [SignKind.SILENT, SignKind.BOOT_UP])
def test_a_unit_that_drops_out_or_starts_anew_in_fault_hides_no_later_trip(gone: SignKind) -> None:
    first, second = trips_of(
        sign(1000, 12, SignKind.AXIS_FAULT, subject="6041.3"),
        sign(5000, 12, gone, subject="heartbeat"),
        sign(60_000, 11, SignKind.AXIS_FAULT, subject="6041.3"),
    )
    assert (first.t0_ns, first.ended_ns) == (1_000_000_000, 5_000_000_000)
    assert (second.t0_ns, second.ended_ns, second.already) == (60_000_000_000, None, ())


def test_another_unit_that_falls_silent_ends_no_trip() -> None:
    (trip,) = trips_of(
        sign(1000, 12, SignKind.AXIS_FAULT, subject="6041.3"),
        sign(2000, 11, SignKind.SILENT, subject="heartbeat"),
        sign(3000, 13, SignKind.AXIS_FAULT, subject="6041.3"),
    )
    assert trip.ended_ns is None


def test_a_unit_that_is_tripped_from_before_trips_only_after_it_was_well() -> None:
    (trip,) = trips_of(
        sign(0, 12, SignKind.EFC_INPUT, standing=True, subject="60FD.18"),
        sign(500, 12, SignKind.AXIS_FAULT, subject="6041.3"),
        sign(600, 12, SignKind.EFC_INPUT, subject="60FD.18", ends=True, began_ns=0),
        sign(700, 12, SignKind.AXIS_FAULT, subject="6041.3", ends=True, began_ns=500_000_000),
        sign(1000, 12, SignKind.AXIS_FAULT, subject="6041.3"),
    )
    assert (trip.t0_ns, trip.already) == (1_000_000_000, ())


def test_a_unit_that_got_well_before_the_trip_was_not_tripped_already() -> None:
    (trip,) = trips_of(
        sign(0, 11, SignKind.AXIS_FAULT, standing=True, subject="6041.3"),
        sign(0, 13, SignKind.EFC_INPUT, standing=True, subject="60FD.18"),
        sign(500, 11, SignKind.AXIS_FAULT, subject="6041.3", ends=True, began_ns=0),
        sign(1000, 12, SignKind.AXIS_FAULT, subject="6041.3"),
    )
    assert (trip.t0_ns, trip.already) == (1_000_000_000, ((BUS, 13),))


def test_a_trip_lasts_until_the_last_unit_is_well_again() -> None:
    def edge(t_ms: float, node: int, ends: bool) -> Sign:
        return sign(t_ms, node, SignKind.EFC_INPUT, subject="60FD.18", ends=ends, began_ns=0, clamp="X2.3")

    first, second = trips_of(
        edge(1000, 11, False), edge(1500, 12, False), edge(2000, 11, True), edge(3000, 11, False),
        edge(4000, 11, True), edge(5000, 12, True), edge(9000, 13, False),
    )  # fmt: skip
    assert (first.t0_ns, first.ended_ns) == (1_000_000_000, 5_000_000_000)
    assert (second.t0_ns, second.ended_ns) == (9_000_000_000, None)


def test_feather_by_the_controlword_is_a_trip_that_was_commanded() -> None:
    (trip,) = trips_of(sign(1000, 11, SignKind.EFC_COMMAND, subject="6040"))
    assert trip.known
    assert tellers(PLACES)["en"].headline(trip) == "Blade 1 PMC: feather commanded (6040h bit 11)"


def test_an_error_of_another_blade_does_not_explain_a_battery_fault() -> None:
    (trip,) = trips_of(
        emcy(900, 12, 0x8611), sign(1000, 1, SignKind.BATTERY_FAULT), sign(1001, 1, SignKind.RELAY_OPEN, clamp="X13.11")
    )
    fault = step_of(trip, SignKind.BATTERY_FAULT)
    assert (trip.steps[fault].because, trip.steps[fault].role) == (None, Role.BEFORE)


def test_an_old_fault_that_was_over_says_nothing() -> None:
    (trip,) = trips_of(
        sign(1000, 2, SignKind.MAINS_LOW, subject="3062", amount="0", unit="V"),
        sign(3000, 2, SignKind.MAINS_LOW, subject="3062", ends=True, began_ns=1_000_000_000),
        emcy(30_000, 12, 0x8620), sign(30_001, 12, SignKind.AXIS_FAULT, subject="6041"),
    )  # fmt: skip
    assert [one.step.kind for one in trip.steps] == [SignKind.EMCY, SignKind.AXIS_FAULT]


def trips_from(seconds: float, folder: Path) -> list[Trip]:
    """Those of what is left of scenario 3 from there on, by the index of the cut."""
    cut(scenario(3), folder / "cut.mcap", CutOrder(look(3).span_ns[0] + round(seconds * S), None, None))
    with open_recording(folder / "cut.mcap") as recording:
        descriptions = recording.descriptions
    build_index(folder / "cut.mcap", descriptions).close()
    with Look(folder / "cut.mcap") as left:
        return left.trips


def test_a_recording_that_begins_within_a_trip_knows_what_was_so_before(tmp_path: Path) -> None:
    """The state before its first frame tells: the axis is in fault; what it does on its way to feather is no trip."""
    (trip,) = trips_from(26.52, tmp_path)
    assert trip.already == ((BUS, 12),)
    assert trip.steps[trip.at].step.kind is SignKind.CHAIN_OPEN
    (tmp_path / "later").mkdir()
    assert trips_from(26.7, tmp_path / "later") == []


# -- jumping ----------------------------------------------------------------------


def test_the_next_and_the_one_before_from_any_time() -> None:
    trips = key_events(look(5), [KeyKind.TRIP])
    assert [one.t_ns for one in trips] == [the_trip(5).t0_ns]
    every = key_events(look(5))
    assert [one.t_ns for one in every] == sorted(one.t_ns for one in every)
    start, end = look(5).span_ns
    assert events_after(every, start, 1) == every[:1]
    assert events_before(every, end + 1, 2) == every[-2:][::-1]
    middle = trips[0].t_ns
    assert all(one.t_ns > middle for one in events_after(every, middle, 100))
    assert all(one.t_ns < middle for one in events_before(every, middle, 100))
    assert events_after(trips, middle, 1) == []
    errors = key_events(look(5), [KeyKind.ERROR])
    assert {one.kind for one in errors} == {KeyKind.ERROR}
    assert len(errors) < len(every)
