"""The recorded scenarios: each is whole, small, and shows what the README beside it says; they can be made again."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

from app.cli.record_scenario import record_scenario
from app.model.address import Address, parse_address
from app.model.description_file import load_builtin
from app.recording.content import EventKind
from app.recording.reader import open_recording
from app.twins.plant_kernel import run_plain
from app.twins.scenario import load_scenario
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction
from app.wire.live import LiveState
from app.wire.nmt import NmtState
from app.wire.records import (
    BootUpSeen,
    EmcySeen,
    EnvironmentSeen,
    MalformedSeen,
    Outcome,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    StateSeen,
    ValueSeen,
)

FOLDER = Path(__file__).resolve().parents[2] / "recordings" / "scenarios"
SCRIPTS = sorted(FOLDER.glob("*.toml"))
MOST_BYTES = 3_000_000
PMMS, PMCS = (1, 2, 3), (11, 12, 13)
OWN_SERVICES = (0x180, 0x280, 0x380, 0x480, 0x700)
FEATHER = 9000
NS = 1_000_000_000


class Course:
    """What a recording tells, decoded: values over time, messages, transfers. Times in s from its first frame."""

    def __init__(self, path: Path) -> None:
        pmm, pmc = load_builtin("oat-pmm"), load_builtin("oat-pmc")
        self.signed = {
            node: {entry.address: entry.type.is_signed for entry in device}
            for nodes, device in ((PMMS, pmm), (PMCS, pmc))
            for node in nodes
        }
        self.values: dict[tuple[int, Address], tuple[list[float], list[int]]] = defaultdict(lambda: ([], []))
        self.emergencies: list[tuple[float, int, int]] = []
        self.boots: list[tuple[float, int]] = []
        self.transfers: list[tuple[float, SdoSeen]] = []
        self.saves: list[tuple[float, int]] = []
        self.states: list[tuple[float, int, NmtState]] = []
        self.wind: list[tuple[float, float]] = []
        self.malformed = 0
        decoder = CanOpenDecoder("can0", dict.fromkeys(PMMS, pmm) | dict.fromkeys(PMCS, pmc))
        with open_recording(path, strict=True) as recording:
            self.frames = list(recording.frames())
            self.events = list(recording.events())
            self.keyframes = list(recording.keyframes())
        self.first_ns = self.frames[0].t_ns
        for record in decoder.feed_all(self.frames):
            self._take(record, (record.t_ns - self.first_ns) / NS)

    def _take(self, record: object, at_s: float) -> None:
        if isinstance(record, ValueSeen) and record.node in self.signed:
            times, numbers = self.values[record.node, record.address]
            signed = self.signed[record.node].get(record.address, False)
            times.append(at_s)
            numbers.append(int.from_bytes(record.data, "little", signed=signed))
        elif isinstance(record, EmcySeen):
            self.emergencies.append((at_s, record.node, record.code))
        elif isinstance(record, BootUpSeen) and record.node in self.signed:
            self.boots.append((at_s, record.node))
        elif isinstance(record, SdoSeen):
            self.transfers.append((at_s, record))
        elif isinstance(record, SaveSeen) and record.done:
            self.saves.append((at_s, record.node))
        elif isinstance(record, StateSeen):
            self.states.append((at_s, record.node, record.state))
        elif isinstance(record, EnvironmentSeen):
            self.wind.append((at_s, record.environment.rotor_rpm))
        elif isinstance(record, MalformedSeen):
            self.malformed += 1

    def at(self, node: int, where: str, at_s: float) -> int:
        """What an object showed at that time."""
        times, numbers = self.values[node, parse_address(where)]
        place = bisect_right(times, at_s)
        assert place, f"nobody has seen {where} of node {node} before {at_s} s"
        return numbers[place - 1]

    def all(self, nodes: tuple[int, ...], where: str, at_s: float) -> list[int]:
        return [self.at(node, where, at_s) for node in nodes]

    def between(self, node: int, where: str, from_s: float, to_s: float) -> list[int]:
        times, numbers = self.values[node, parse_address(where)]
        return numbers[bisect_right(times, from_s) : bisect_right(times, to_s)]

    def rpm(self, at_s: float) -> float:
        return next(rpm for t_s, rpm in reversed(self.wind) if t_s <= at_s)

    def senders(self, from_s: float, to_s: float) -> set[int]:
        """Nodes that sent PDOs or heartbeats meanwhile."""
        first_ns, last_ns = (self.first_ns + round(at_s * NS) for at_s in (from_s, to_s))
        sent = [frame.payload for frame in self.frames if first_ns < frame.t_ns < last_ns]
        found = [can for can in sent if isinstance(can, Can) and not can.extended]
        return {can.can_id & 0x7F for can in found if can.can_id & 0x780 in OWN_SERVICES}

    def codes(self, node: int | None = None) -> list[int]:
        """Errors that were told by emergency messages."""
        return [code for _, sender, code in self.emergencies if code and node in (None, sender)]

    def first(self, node: int, code: int) -> float:
        return next(at_s for at_s, sender, told in self.emergencies if (sender, told) == (node, code))

    def feathered(self, at_s: float) -> list[bool]:
        return [abs(angle - FEATHER) < 30 for angle in self.all(PMCS, "6064", at_s)]


@cache
def course(number: int) -> Course:
    return Course(next(FOLDER.glob(f"{number}-*.mcap")))


def test_there_are_eight_and_each_has_its_recording_and_its_chapter() -> None:
    assert [path.name[0] for path in SCRIPTS] == list("12345678")
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    for path in SCRIPTS:
        assert path.with_suffix(".mcap").is_file()
        assert f"\n## {path.stem}\n" in text


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_each_is_small_whole_and_of_its_script(script: Path) -> None:
    scenario = load_scenario(script)
    path = script.with_suffix(".mcap")
    assert path.stat().st_size < MOST_BYTES
    with open_recording(path, strict=True) as recording:
        assert recording.finished
        assert recording.damages == []
        assert recording.totals is not None
        assert recording.totals.lost == 0
        attached = {one.name: one.data for one in recording.attachments()}
        assert attached[script.name] == script.read_bytes(), "make recordings"
        assert {"descriptions/oat-pmm.json", "descriptions/oat-pmc.json"} <= attached.keys()
        assert recording.info.nodes["can0/12"] == "wtg-07/blade-2/pmc oat-pmc"
        assert recording.info.bit_rates == {"can0": 500_000}
        span = recording.span_ns
        assert span is not None
        assert (span[1] - span[0]) / NS == pytest.approx(scenario.duration_s, abs=0.5)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_reader_can_begin_anywhere_with_the_keyframe_before(script: Path) -> None:
    """From a keyframe in the middle on, the decoder reads the same as one that has read everything."""
    with open_recording(script.with_suffix(".mcap")) as recording:
        keyframes = list(recording.keyframes())
        assert len(keyframes) >= load_scenario(script).duration_s / 5 - 1
        middle = keyframes[len(keyframes) // 2]
        frames = list(recording.frames(middle.t_ns + 1, middle.t_ns + 3 * NS))
    devices = dict.fromkeys(PMMS, load_builtin("oat-pmm")) | dict.fromkeys(PMCS, load_builtin("oat-pmc"))
    decoder, live = CanOpenDecoder("can0", devices), LiveState()
    decoder.restore(middle.state["decoders"]["can0"])
    live.restore(middle.state["live"])
    assert decoder.feed_all(frames)
    whole = course(int(script.name[0]))
    for node in PMCS:
        seen = live.value("can0", node, parse_address("6064"))
        assert seen is not None
        assert seen.reading is not None
        at_s = (middle.t_ns - whole.first_ns) / NS
        assert int.from_bytes(seen.reading.data, "little", signed=True) == whole.at(node, "6064", at_s)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_every_frame_makes_sense_and_what_was_done_is_noted(script: Path) -> None:
    found, scenario = course(int(script.name[0])), load_scenario(script)
    assert found.malformed == 0
    keys = [event.details["text_key"] for event in found.events]
    assert keys[0] == "journal.scenario_started"
    orders = [event for event in scenario.events if "Control" in type(event.action).__name__]
    assert keys.count("journal.controller_order") == len(orders)


def test_normal_operation_follows_the_wind_and_stops() -> None:
    seen = course(1)
    assert seen.codes() == []
    assert all(seen.rpm(at_s) == pytest.approx(18.0, abs=1.0) for at_s in range(20, 45, 5))
    gust = max(seen.between(11, "6064", 45, 55))
    assert gust > seen.at(11, "6064", 45) + 700
    for at_s in range(2, 95):
        angles = seen.all(PMCS, "6064", at_s)
        assert max(angles) - min(angles) < 30
    assert max(max(seen.between(node, "6079", 45, 60)) for node in PMCS) > 640_000
    assert max(map(abs, seen.between(12, "60F4", 5, 95))) < 40
    assert all(abs(angle - 8500) < 60 for angle in seen.all(PMCS, "6064", 99))
    assert {word & 0x6F for word in seen.all(PMCS, "6041", 99)} == {0x21}
    assert seen.rpm(99) < 2


def test_a_mains_failure_is_held_feathered_on_battery_and_shut_down() -> None:
    seen = course(2)
    assert seen.codes() == []  # a warning is no emergency
    assert seen.all(PMMS, "603F", 16) == [0x3120] * 3
    assert seen.all(PMMS, "3000", 16) == [0x32] * 3
    counting = seen.between(1, "30B2", 15.2, 18.2)
    assert counting == sorted(counting, reverse=True)
    assert counting[0] > 2500
    assert counting[-1] == 0
    assert len(counting) >= 12
    seconds = seen.between(1, "30B3", 16, 44)
    assert seconds == sorted(seconds, reverse=True)
    assert set(seconds) > set(range(2, 29))
    assert all(status & 0x02 for status in seen.all(PMMS, "3002", 20))  # booster
    assert all(590 < volts < 680 for node in PMMS for volts in seen.between(node, "3063", 17, 44))
    assert max(seen.between(1, "3070", 16, 44)) > 1000  # the battery gives
    before = seen.all(PMCS, "6041", 17.5)
    assert all(word >> 9 & 1 for word in before)
    assert not any(word >> 9 & 1 for word in seen.all(PMCS, "6041", 18.5))
    assert not any(word >> 18 & 1 for word in seen.all(PMCS, "60FD", 18.5))
    assert seen.feathered(18) == [False] * 3
    assert seen.feathered(31) == [True] * 3
    heard = seen.senders(47, 69)
    assert heard == {100}  # nobody but the controller
    assert sorted(node for at_s, node in seen.boots if 70 < at_s < 71) == [*PMMS, *PMCS]
    assert {word & 0x6F for word in seen.all(PMCS, "6041", 95)} == {0x27}


def test_a_following_error_trips_blade_2_in_the_gust_and_no_other() -> None:
    seen = course(3)
    assert seen.codes() == [0x8611]
    trip_s = seen.first(12, 0x8611)
    assert 25 < trip_s < 29
    assert abs(seen.at(12, "60F4", trip_s)) > 90
    assert max(abs(error) for node in (11, 13) for error in seen.between(node, "60F4", 2, 59)) < 30
    assert max(map(abs, seen.between(12, "60F4", 2, 25))) < 100
    assert any(word >> 13 & 1 for word in seen.between(12, "6041", trip_s, 40))
    assert not any(word >> 9 & 1 for word in seen.all(PMCS, "6041", trip_s + 1))
    assert seen.feathered(55) == [True] * 3


def test_a_blade_encoder_that_slips_raises_8620h_beyond_its_window_only() -> None:
    seen = course(4)
    assert seen.codes() == [0x8620]
    assert seen.first(13, 0x8620) == pytest.approx(25.2, abs=0.1)
    assert seen.at(13, "68F4", 20) == pytest.approx(-200, abs=10) or seen.at(13, "68F4", 20) == pytest.approx(
        200, abs=10
    )
    assert abs(seen.at(13, "6064", 20) - seen.at(13, "6864", 20)) == pytest.approx(200, abs=40)
    assert abs(seen.at(12, "68F4", 50)) < 20
    assert abs(seen.at(13, "68F4", 50)) == pytest.approx(500, abs=10)
    assert seen.feathered(45) == [True] * 3


def test_an_aged_battery_fails_its_test_and_later_does_not_bring_the_blade_to_feather() -> None:
    seen = course(5)
    assert seen.all(PMMS, "3005", 8) == [0x12, 0x08, 0x08]
    assert seen.all(PMMS, "3005", 19) == [0x12, 0x03, 0x03]
    lowest = seen.all(PMMS, "3068", 19)
    assert lowest[0] < 180 < 225 < min(lowest[1:])
    assert seen.codes(1)[:1] == [0x3280]
    assert 0x3220 in seen.codes(1)
    assert 60 < seen.first(1, 0x3280) < 63
    assert seen.codes(2) == seen.codes(3) == []
    assert set(seen.codes(11)) == {0x8611, 0x3220}
    assert min(seen.between(1, "3063", 65, 80)) < 250
    assert min(seen.between(2, "3063", 62, 88)) > 590
    assert seen.feathered(80) == [False, True, True]
    assert seen.feathered(104) == [False, True, True]


def test_a_node_drops_out_and_returns() -> None:
    seen = course(6)
    assert 13 in seen.senders(10, 15)
    assert 13 not in seen.senders(15.01, 34.99)
    assert 13 in seen.senders(35, 36)
    assert seen.first(3, 0x3221) == pytest.approx(16.0, abs=0.2)
    assert seen.feathered(30)[:2] == [True, True]
    assert not seen.feathered(30)[2]  # what was heard last
    assert seen.feathered(36) == [True] * 3
    assert seen.at(13, "603F", 37) == 0x8130
    assert (3, 0) in {(node, code) for at_s, node, code in seen.emergencies if at_s > 45}
    assert {word & 0x6F for word in seen.all(PMCS, "6041", 60)} == {0x27}
    assert max(seen.all(PMCS, "6064", 75)) < 3000


def test_a_service_visit_reads_writes_saves_and_restarts() -> None:
    seen = course(7)
    ours = [(at_s, one) for at_s, one in seen.transfers if one.client is Direction.TX]
    written = [
        (one.node, str(one.address)) for _, one in ours if one.access is SdoAccess.WRITE and one.outcome is Outcome.DONE
    ]
    assert {(12, "60FB:01"), (12, "6065:00"), (12, "6083:00"), (2, "30E3:00"), (2, "30E0:00")} <= set(written)
    refused = {(one.node, str(one.address)): one.abort_code for _, one in ours if one.outcome is Outcome.ABORTED}
    assert refused == {(2, "30E3:00"): 0x06090032, (12, "6041:00"): 0x06010002}
    assert [node for _, node in seen.saves] == [12, 2]
    assert sorted(node for at_s, node in seen.boots if at_s > 50) == [2, 12]
    after = {
        where: seen.at(node, where, 71) for node, where in ((12, "60FB:01"), (12, "6065"), (2, "30E3"), (2, "30E0"))
    }
    assert after == {"60FB:01": 20, "6065": 80, "30E3": 10080, "30E0": 3500}
    others = [one for at_s, one in seen.transfers if one.client is Direction.RX and 6 < at_s < 52]
    assert others == []  # the controller reads nothing meanwhile
    kinds = [event.kind for event in seen.events]
    assert kinds.count(EventKind.WRITE) == 7
    first = next(event for event in seen.events if event.kind is EventKind.WRITE)
    assert first.details["text_key"] == "journal.written"
    assert (first.details["was"], first.details["now"]) == ("17", "20")
    assert first.details["device"] == "wtg-07/blade-2/pmc"


def test_a_foreign_master_writes_and_takes_a_node_out_of_operation() -> None:
    seen = course(8)
    assert not [one for _, one in seen.transfers if one.client is Direction.TX]
    writes = [(at_s, one) for at_s, one in seen.transfers if at_s > 5 and one.access is SdoAccess.WRITE]
    velocity = [at_s for at_s, one in writes if (one.node, str(one.address)) == (12, "6081:00")]
    assert len(velocity) >= 9
    assert 15 <= velocity[0] < velocity[-1] < 25
    assert set(seen.between(12, "6081", 15, 26)) == {400, 1000}
    assert seen.at(12, "6065", 44) == 2000
    refused = [at_s for at_s, one in writes if one.outcome is Outcome.ABORTED]
    assert len(refused) == 3
    assert 34 <= refused[0] < refused[-1] < 39
    assert (NmtState.PRE_OPERATIONAL, 13) in {(state, node) for at_s, node, state in seen.states if 45 < at_s < 47}
    assert not seen.between(13, "606C", 45.2, 60)
    assert seen.feathered(62)[:2] == [True, True]


def test_the_same_script_makes_the_same_recording(tmp_path: Path) -> None:
    """Here in plain cycles, where the recordings are made by compiled ones: to the last bit the same frames."""
    short = tmp_path / "3-short.toml"
    text = next(FOLDER.glob("3-*.toml")).read_text(encoding="utf-8").replace("duration_s = 60.0", "duration_s = 28.0")
    short.write_text(text, encoding="utf-8")
    made = record_scenario(short, tmp_path / "again.mcap", run_plain)
    with open_recording(made.file) as again, open_recording(next(FOLDER.glob("3-*.mcap"))) as kept:
        frames = list(again.frames())
        span = again.span_ns
        assert span is not None
        assert len(frames) == made.frames > 15_000
        assert frames == list(kept.frames(end_ns=span[1] + 1)), "make recordings"
