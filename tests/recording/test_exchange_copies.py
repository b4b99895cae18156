"""Cut, merged and anonymised copies: the same frames, a state to begin with, and nothing that tells whose it is."""

from __future__ import annotations

import errno
import json
import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from threading import Barrier
from threading import Event as Flag
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import RecordingError, UsageError
from app.model.address import Address, parse_address
from app.recording.content import AttachedFile, Event, EventKind, RecordingInfo
from app.recording.exchange.anonymise import FIXED_START_NS, AnonymiseOrder, anonymise, plain_bytes
from app.recording.exchange.cut import CutOrder, cut
from app.recording.exchange.draft import Draft
from app.recording.exchange.harmless import TEXT_KEYS
from app.recording.exchange.hiding import Hider, Pseudonyms
from app.recording.exchange.merge import MergeInput, merge
from app.recording.exchange.tape import Subject, Tape
from app.recording.index.course import Course
from app.recording.node_table import described
from app.recording.part import Batch, Identity, Part, event_entry
from app.recording.reader import open_recording
from app.service.exchange import anonymise_into
from app.service.journal import Kind
from app.wire import sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Direction, Frame
from app.wire.records import MalformedSeen, Outcome, SdoSeen
from tests.recording.rig import INFO, MS, START_NS, S, by_mcap, frames_of, record

ROOT = Path(__file__).resolve().parents[2]
VISIT = ROOT / "recordings" / "scenarios" / "7-service-visit.mcap"
TRIP = VISIT.with_name("3-following-error.mcap")
SERIAL = Address(0x1018, 4)


@cache
def frames_in(path: Path) -> list[Frame]:
    return frames_of(path)


def at(seconds: float, path: Path = VISIT) -> int:
    return frames_in(path)[0].t_ns + round(seconds * S)


def course_of(path: Path) -> Course:
    with open_recording(path) as recording:
        return Course((), described(recording.metadata["nodes"]))


# -- cut ----------------------------------------------------------------------------------


def test_a_cut_holds_the_very_messages_of_its_time(tmp_path: Path) -> None:
    target = tmp_path / "cut.mcap"
    done = cut(VISIT, target, CutOrder(at(20), at(27)))
    wanted = [frame for frame in frames_in(VISIT) if at(20) <= frame.t_ns < at(27)]
    assert frames_of(target) == wanted
    assert done.frames == len(wanted) > 2000
    with open_recording(VISIT) as source, open_recording(target, strict=True) as copy:
        assert list(copy.events()) == list(source.events(at(20), at(27)))
        assert list(copy.clocks()) == list(source.clocks(at(20), at(27)))
        assert copy.attachments() == source.attachments()
        assert copy.info == source.info
        assert copy.identity.recording == source.identity.recording
        assert copy.totals is not None
        assert copy.totals.frames == len(wanted)
        assert list(copy.keyframes())[1:] == list(source.keyframes(at(20), at(27)))
        origin = copy.metadata["origin"]
    assert (origin["kind"], origin["start_ns"], origin["end_ns"]) == ("cut", str(at(20)), str(at(27)))
    assert json.loads(origin["sources"])[0]["file"] == VISIT.name


def test_a_cut_begins_with_what_all_frames_before_have_told(tmp_path: Path) -> None:
    """Decoders and live state gone on from the cut are those that read the whole file."""
    target = tmp_path / "cut.mcap"
    cut(VISIT, target, CutOrder(at(41.3), at(43)))
    whole, part = course_of(VISIT), course_of(target)
    whole.decode([frame for frame in frames_in(VISIT) if frame.t_ns < at(43)])
    with open_recording(target) as copy:
        first = next(copy.keyframes())
        assert first.t_ns == at(41.3) - 1
        part.restore(first.state)
        part.decode(list(copy.frames()))
    for key in ((12, "60FB:01"), (12, "6065"), (11, "6064"), (2, "30E0"), (1, "3063")):
        node, address = key[0], parse_address(key[1])
        seen, wanted = part.live.value("can0", node, address), whole.live.value("can0", node, address)
        assert seen is not None
        assert wanted is not None
        assert seen.reading == wanted.reading
    assert part.decoders["can0"].snapshot() == whole.decoders["can0"].snapshot()


def test_a_cut_of_a_cut_and_of_one_bus(tmp_path: Path) -> None:
    frames = [Frame(START_NS + n * MS, f"can{n % 2}", Direction.RX, Can(0x181, bytes([n % 256]))) for n in range(4000)]
    source = record(tmp_path, frames)
    cut(source, tmp_path / "a.mcap", CutOrder(START_NS + S, None))
    cut(tmp_path / "a.mcap", tmp_path / "b.mcap", CutOrder(None, START_NS + 2 * S, ["can1"]))
    assert frames_of(tmp_path / "b.mcap") == [f for f in frames[1000:2000] if f.bus == "can1"]
    with open_recording(tmp_path / "b.mcap") as copy:
        assert set(copy.topics) == {"/clock", "/state", "/events", "/can1"}
        assert json.loads(copy.metadata["origin"]["history"])[0]["start_ns"] == str(START_NS + S)


def test_a_cut_of_nothing_is_refused(tmp_path: Path) -> None:
    for order in (CutOrder(at(900)), CutOrder(None, at(-5)), CutOrder(at(5), at(5)), CutOrder(None, None, ["can7"])):
        with pytest.raises(UsageError, match="nothing of"):
            cut(VISIT, tmp_path / "none.mcap", order)
    assert list(tmp_path.iterdir()) == []


def test_a_cut_from_before_the_first_frame_is_one_from_the_beginning(tmp_path: Path) -> None:
    cut(VISIT, tmp_path / "open.mcap", CutOrder(None, at(2)))
    for start_ns in (0, at(0)):
        cut(VISIT, tmp_path / f"{start_ns}.mcap", CutOrder(start_ns, at(2)))
        with open_recording(tmp_path / "open.mcap") as wanted, open_recording(tmp_path / f"{start_ns}.mcap") as copy:
            assert list(copy.frames()) == list(wanted.frames())
            assert list(copy.keyframes()) == list(wanted.keyframes())
            assert list(copy.events()) == list(wanted.events())
            assert copy.metadata["origin"] == wanted.metadata["origin"]


def killed(path: Path, lost: Sequence[int] = (), frames: int = 10, part: int = 1, begin_ns: int = START_NS) -> Path:
    """A part whose recorder was killed: no totals, no summary. Loses frames 1 ms apart from its beginning."""
    file = Part(path, Identity("killed", part, START_NS, begin_ns), INFO)
    events = [
        Event(begin_ns + n * MS, EventKind.FRAMES_LOST, "can0", {"count": count, "reason": "queue_full"})
        for n, count in enumerate(lost)
    ]
    sent = [Frame(begin_ns + n * MS, "can0", Direction.RX, Can(0x181, bytes([n]))) for n in range(frames)]
    file.append(Batch(sent, events=[event_entry(event) for event in events]))
    file.abandon()
    return path


def lost_in(path: Path) -> int:
    with open_recording(path, strict=True) as recording:
        assert recording.totals is not None
        return recording.totals.lost


def test_every_copy_of_a_killed_part_tells_what_was_lost(tmp_path: Path) -> None:
    source = killed(tmp_path / "killed-001.mcap", (3, 4))
    cut(source, tmp_path / "cut.mcap", CutOrder())
    cut(source, tmp_path / "first.mcap", CutOrder(None, START_NS + MS))
    anonymise(source, tmp_path / "public.mcap", AnonymiseOrder())
    second = killed(tmp_path / "killed-002.mcap", (5,), part=2, begin_ns=START_NS + S)
    merge([MergeInput(source), MergeInput(second)], tmp_path / "both.mcap")
    merge([MergeInput(tmp_path / "cut.mcap"), MergeInput(second)], tmp_path / "closed.mcap")
    names = ("cut", "first", "public", "both", "closed")
    assert [lost_in(tmp_path / f"{name}.mcap") for name in names] == [7, 3, 7, 12, 12]


def test_copies_count_by_the_totals_what_the_parts_before_have_lost(tmp_path: Path) -> None:
    """The totals of a part tell of the whole recording so far, its events of itself alone."""
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, Can(0x181, bytes([n]))) for n in range(10)]
    late = Event(START_NS + 5 * MS, EventKind.FRAMES_LOST, "can0", {"count": 2, "reason": "queue_full"})
    source = taped(tmp_path / "part-002.mcap", frames, events=[late], lost=9)
    cut(source, tmp_path / "whole.mcap", CutOrder())
    cut(source, tmp_path / "early.mcap", CutOrder(None, START_NS + 5 * MS))
    anonymise(source, tmp_path / "public.mcap", AnonymiseOrder())
    assert [lost_in(tmp_path / f"{name}.mcap") for name in ("whole", "early", "public")] == [9, 7, 9]
    cuts = [MergeInput(tmp_path / "early.mcap"), MergeInput(source)]
    merge(cuts, tmp_path / "merged.mcap")
    assert lost_in(tmp_path / "merged.mcap") == 9


def test_a_copy_without_frames_is_refused(tmp_path: Path) -> None:
    empty = killed(tmp_path / "empty-001.mcap", (1,), frames=0)
    with pytest.raises(UsageError, match=r"empty-001\.mcap holds no frame"):
        anonymise(empty, tmp_path / "public.mcap", AnonymiseOrder())
    with pytest.raises(UsageError, match="hold no frame"):
        merge([MergeInput(empty), MergeInput(empty)], tmp_path / "merged.mcap")
    assert list(tmp_path.iterdir()) == [empty]


def test_others_read_every_message_of_a_cut(tmp_path: Path) -> None:
    target = tmp_path / "cut.mcap"
    cut(TRIP, target, CutOrder(at(26, TRIP), at(28, TRIP)))
    wanted = iter([frame for frame in frames_in(TRIP) if at(26, TRIP) <= frame.t_ns < at(28, TRIP)])
    others = []
    for topic, t_ns, message in by_mcap(target):
        assert isinstance(message, object)
        seen: Any = message
        if topic != "/can0":
            others.append(topic)
            assert t_ns == seen.header.stamp.sec * S + seen.header.stamp.nanosec
            continue
        frame = next(wanted)
        can = frame.payload
        assert isinstance(can, Can)
        assert t_ns == frame.t_ns == seen.header.stamp.sec * S + seen.header.stamp.nanosec
        assert seen.header.frame_id == f"can0/{frame.direction.value}"
        assert (seen.id, seen.is_extended, seen.is_rtr, seen.is_error) == (can.can_id, can.extended, False, False)
        assert bytes(seen.data)[: seen.dlc] == can.data
    assert next(wanted, None) is None
    assert others.count("/state") >= 1
    assert others.count("/clock") > 10


# -- merge --------------------------------------------------------------------------------


def test_overlapping_cuts_of_a_recording_merge_to_it(tmp_path: Path) -> None:
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    cut(VISIT, first, CutOrder(None, at(12)))
    cut(VISIT, second, CutOrder(at(10), at(22)))
    merged = merge([MergeInput(second), MergeInput(first)], tmp_path / "merged.mcap")
    wanted = [frame for frame in frames_in(VISIT) if frame.t_ns < at(22)]
    assert frames_of(tmp_path / "merged.mcap") == wanted
    assert merged.duplicates == sum(at(10) <= frame.t_ns < at(12) for frame in wanted)
    assert merged.moved == 0
    with open_recording(VISIT) as source, open_recording(tmp_path / "merged.mcap", strict=True) as copy:
        assert list(copy.events()) == list(source.events(None, at(22)))
        assert list(copy.clocks()) == list(source.clocks(None, at(22)))
        assert copy.attachments() == source.attachments()
        assert copy.identity.recording == source.identity.recording
        assert len(list(copy.keyframes())) == pytest.approx(5, abs=1)
        assert len(json.loads(copy.metadata["origin"]["sources"])) == 2


def test_equal_frames_of_different_recordings_are_kept(tmp_path: Path) -> None:
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, Can(0x181, b"\x01")) for n in range(50)]
    one = record(tmp_path / "one", frames)
    two = taped(tmp_path / "two.mcap", [frame._replace(bus="can1") for frame in frames])
    merged = merge([MergeInput(one), MergeInput(two)], tmp_path / "both.mcap")
    back = frames_of(tmp_path / "both.mcap")
    assert (merged.duplicates, merged.moved, len(back)) == (0, 50, 100)
    assert [frame for frame in back if frame.bus == "can0"] == frames
    assert [frame.t_ns - 1 for frame in back if frame.bus == "can1"] == [frame.t_ns for frame in frames]


def test_two_buses_do_not_become_one_unless_an_offset_or_a_name_parts_them(tmp_path: Path) -> None:
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, Can(0x181, bytes([n]))) for n in range(50)]
    one, two = record(tmp_path / "one", frames), taped(tmp_path / "two.mcap", frames)
    with pytest.raises(UsageError, match="rename a bus"):
        merge([MergeInput(one), MergeInput(two)], tmp_path / "no.mcap")
    assert not (tmp_path / "no.mcap").exists()
    merge([MergeInput(one), MergeInput(two, 0, {"can0": "can5"})], tmp_path / "named.mcap")
    assert {frame.bus for frame in frames_of(tmp_path / "named.mcap")} == {"can0", "can5"}
    merge([MergeInput(one), MergeInput(two, 2 * S)], tmp_path / "later.mcap")
    assert frames_of(tmp_path / "later.mcap") == [*frames, *(f._replace(t_ns=f.t_ns + 2 * S) for f in frames)]


@pytest.mark.parametrize("offset_ns", [-START_NS, 2 * 10**18, -(2**70), 2**70])
def test_an_offset_out_of_all_times_is_refused_with_its_file(offset_ns: int, tmp_path: Path) -> None:
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, Can(0x181, bytes([n]))) for n in range(50)]
    one, two = record(tmp_path / "one", frames), taped(tmp_path / "two.mcap", frames)
    with pytest.raises(UsageError, match=r"two\.mcap: an offset of .* s leads out"):
        merge([MergeInput(one), MergeInput(two, offset_ns)], tmp_path / "no.mcap")
    assert not (tmp_path / "no.mcap").exists()


def taped(path: Path, frames: Sequence[Frame], info: RecordingInfo = INFO, **more: Any) -> Path:
    """A recording of another identity."""
    subject = Subject(path.stem, frames[0].t_ns, info, lambda: {"kind": "test"}, **more)
    Tape(subject, lambda _: path, rotate=False).write(frames)
    return path


# -- anonymise ----------------------------------------------------------------------------


def secret_traffic() -> Iterator[Can]:
    """A serial number read in every way there is, and read by LSS."""
    serial = (0xDEADBEEF).to_bytes(4, "little")
    yield Can(0x60B, sdo.upload_request(SERIAL))
    yield Can(0x58B, sdo.upload_response(SERIAL, serial))
    plate = Address(0x2105, 1)
    text = b"SN-4711-HANSEN-WINDPARK"
    yield Can(0x60B, sdo.upload_request(plate))
    yield Can(0x58B, sdo.upload_response(plate, text))
    for number, start in enumerate(range(0, len(text), 7)):
        piece = text[start : start + 7]
        yield Can(0x60B, sdo.upload_segment_request(bool(number % 2)))
        yield Can(0x58B, sdo.upload_segment_response(piece, bool(number % 2), start + 7 >= len(text)))
    yield Can(0x60B, sdo.block_upload_request(plate, 127))
    yield Can(0x58B, sdo.block_upload_response(plate, len(text)))
    yield Can(0x60B, sdo.block_upload_start())
    pieces = [text[start : start + 7] for start in range(0, len(text), 7)]
    for number, piece in enumerate(pieces, 1):
        yield Can(0x58B, sdo.block_segment(number, piece, number == len(pieces)))
    yield Can(0x60B, sdo.block_acknowledge(len(pieces), 127))
    yield Can(0x58B, sdo.block_end(7 * len(pieces) - len(text), sdo.crc(text)))
    yield Can(0x60B, sdo.block_end_response())
    yield Can(0x60B, sdo.download_request(SERIAL, serial))
    yield Can(0x58B, sdo.download_response(SERIAL))
    yield Can(0x7E5, b"\x43" + serial + bytes(3))
    yield Can(0x18B, bytes(8))


def told_transfers(frames: Sequence[Frame]) -> list[tuple[Any, ...]]:
    records = CanOpenDecoder("can0").feed_all(frames)
    assert not [record for record in records if isinstance(record, MalformedSeen)]
    return [(r.node, r.access, r.address, r.outcome, r.data) for r in records if isinstance(r, SdoSeen)]


def test_serial_numbers_and_plates_are_hidden_in_every_kind_of_transfer(tmp_path: Path) -> None:
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, one) for n, one in enumerate(secret_traffic())]
    before = told_transfers(frames)
    hidden = list(Hider({}, Pseudonyms(), [Address(0x2105, 1)])(iter(frames)))
    after = told_transfers(hidden)
    assert [one[:4] for one in after] == [one[:4] for one in before]
    assert [one[3] for one in after] == [Outcome.DONE] * 4
    assert [one[4] for one in before] == [(0xDEADBEEF).to_bytes(4, "little"), *[b"SN-4711-HANSEN-WINDPARK"] * 2,
                                          (0xDEADBEEF).to_bytes(4, "little")]  # fmt: skip
    assert [one[4] for one in after] == [b"\x01\0\0\0", *[b"X" * 23] * 2, b"\x01\0\0\0"]
    payload = hidden[-2].payload
    assert isinstance(payload, Can)
    assert payload.data == b"\x43\x01\0\0\0\0\0\0"
    assert hidden[-1] == frames[-1]
    assert len(hidden) == len(frames)


@given(frames=st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=60))
@settings(max_examples=60, deadline=None)
def test_any_traffic_is_hidden_without_a_stumble_and_keeps_its_lengths(frames: list[tuple[int, bytes]]) -> None:
    sent = [Frame(START_NS + n, "can0", Direction.RX, Can(*one)) for n, one in enumerate(frames)]
    back = list(Hider({}, Pseudonyms())(iter(sent)))
    assert [(f.t_ns, f.payload.can_id, len(f.payload.data)) for f in back if isinstance(f.payload, Can)] == [
        (n + START_NS, one[0], len(one[1])) for n, one in enumerate(frames)
    ]


SECRETS = (
    b"DE-north-17",
    b"Grace Hopper",
    b"WO-2219",
    b"SN-4711-HANSEN-WINDPARK",
    b"HANSEN",
    b"loose bolt",
    b"hub-left",
)


def secret_recording(path: Path) -> Path:
    info = RecordingInfo(
        "DE-north-17", "Grace Hopper", {"can0": 500_000}, {"can0/11": "DE-north-17/hub-left/pmc oat-pmc"},
        {"hubside": "0.1.0", "firmware": "DE-north-17"},
    )  # fmt: skip
    note = {
        "device": "DE-north-17/hub-left/pmc",
        "person": "Grace Hopper",
        "text_key": "journal.note",
        "text": "loose bolt",
    }
    write = {"address": "1018:04", "was": "3735928559", "now": "1", "work_order": "WO-2219", **note}
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, one) for n, one in enumerate(secret_traffic())]
    events = [
        Event(START_NS + MS, EventKind.NOTE, "can0", note),
        Event(START_NS + 2 * MS, EventKind.WRITE, "can0", write),
    ]
    attached = [AttachedFile("sets/DE-north-17.json", "application/json", b'{"work_order": "WO-2219"}')]
    return taped(path, frames, info, events=events, attachments=attached)


@pytest.mark.parametrize("hide_times", [False, True])
def test_nothing_that_identifies_is_left_in_any_byte(hide_times: bool, tmp_path: Path) -> None:
    source = secret_recording(tmp_path / "DE-north-17-001.mcap")
    with open_recording(source) as recording:
        there = b"".join(plain_bytes(recording))
    for secret in SECRETS[:3]:
        assert secret in there  # else the search proves nothing
    target = tmp_path / "public.mcap"
    order = AnonymiseOrder(hide_times, [Address(0x2105, 1)])
    done = anonymise(source, target, order)
    with open_recording(target, strict=True) as copy:
        left = b"".join([*plain_bytes(copy), *(one.data for one in copy.attachments())])
        events = list(copy.events())
        first = next(copy.frames())
        assert copy.info.nodes == {"can0/11": "turbine/place-1/pmc oat-pmc"}
    raw = target.read_bytes()
    for secret in (*SECRETS, (0xDEADBEEF).to_bytes(4, "little"), b"3735928559", b"DEADBEEF", b"deadbeef", b"efbeadde"):
        assert secret not in left
        assert secret not in raw
    assert [event.kind for event in events] == [EventKind.NOTE, EventKind.WRITE]
    assert events[1].details["address"] == "1018:04"
    assert "was" not in events[1].details
    assert first.t_ns == (pytest.approx(FIXED_START_NS, abs=512) if hide_times else START_NS)
    assert (done.serials, done.left_out_attachments) == (1, 1)
    if hide_times:
        assert str(START_NS)[:9].encode() not in left


def test_a_real_visit_keeps_its_values_and_loses_its_names(tmp_path: Path) -> None:
    part, target = tmp_path / "wtg-07-part.mcap", tmp_path / "public.mcap"
    cut(VISIT, part, CutOrder(at(39), at(49)))
    anonymise(part, target, AnonymiseOrder())
    with open_recording(part) as source, open_recording(target, strict=True) as copy:
        left = b"".join([*plain_bytes(copy), *(one.data for one in copy.attachments())])
        before, after = course_of(part), course_of(target)
        before.restore(next(source.keyframes()).state)
        after.restore(next(copy.keyframes()).state)
        before.decode(list(source.frames()))
        after.decode(list(copy.frames()))
        assert [event.kind for event in copy.events()] == [event.kind for event in source.events()]
    assert b"wtg-07" not in left
    serials = {node: before.live.value("can0", node, SERIAL) for node in (2, 12)}
    for node in (1, 2, 3, 11, 12, 13):
        values, others = before.live.values("can0", node), after.live.values("can0", node)
        assert values.keys() == others.keys()
        for address, value in values.items():
            if address != SERIAL:
                assert others[address].reading == value.reading
    for node, seen in serials.items():
        if seen is not None and seen.reading is not None and any(seen.reading.data):
            other = after.live.value("can0", node, SERIAL)
            assert other is not None
            assert other.reading is not None
            assert other.reading.data != seen.reading.data


def test_a_copy_in_which_a_word_is_found_is_not_left(tmp_path: Path) -> None:
    part = tmp_path / "part.mcap"
    cut(VISIT, part, CutOrder(at(1), at(2)))
    with pytest.raises(RecordingError, match="still in a table"):
        anonymise(part, tmp_path / "public.mcap", AnonymiseOrder(texts=["blade-2"]))
    assert not (tmp_path / "public.mcap").exists()


def test_a_copy_has_its_name_only_when_nothing_that_identifies_was_found(tmp_path: Path) -> None:
    source, target = secret_recording(tmp_path / "DE-north-17-001.mcap"), tmp_path / "public.mcap"
    told: list[tuple[int, bool]] = []

    def on_frames(count: int) -> None:
        told.append((count, target.exists()))
        if told.count((total, False)) == 3:
            raise InterruptedError

    total = len(frames_of(source))
    with pytest.raises(RecordingError):
        anonymise(source, target, AnonymiseOrder(), on_frames)  # stopped in the search
    assert told[-3:] == [(total, False)] * 3
    assert not any(there for _, there in told)
    assert list(tmp_path.iterdir()) == [source]


@pytest.mark.parametrize("name", ["state", "nodes", "live", "blade-2", "event", "written", "can0", "oat-pmc", "500000"])
def test_our_own_words_are_nobodys_name(name: str, tmp_path: Path) -> None:
    """A file or a turbine that is called as the format calls its parts."""
    info = RecordingInfo(
        name, name, {"can0": 500_000}, {"can0/11": f"{name}/blade-2/pmc oat-pmc"}, {"hubside": "0.1.0"}
    )
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, one) for n, one in enumerate(secret_traffic())]
    details = {"device": f"{name}/blade-2/pmc", "person": name, "text_key": "journal.written", "address": "6065"}
    source = taped(tmp_path / f"{name}.mcap", frames, info, events=[Event(START_NS, EventKind.WRITE, "can0", details)])
    anonymise(source, tmp_path / "public.mcap", AnonymiseOrder())
    with open_recording(tmp_path / "public.mcap") as copy:
        assert (copy.info.turbine, copy.info.who) == ("turbine", "person")
        assert copy.info.nodes == {"can0/11": "turbine/blade-2/pmc oat-pmc"}


def left_in(tmp_path: Path, word: str, bus: str = "can0", data: bytes = b"") -> str:
    """Why an anonymised copy is refused."""
    frames = [Frame(START_NS, bus, Direction.RX, Can(0x18B, data))]
    source = taped(tmp_path / "source.mcap", frames, RecordingInfo("DE-17", "ada", {bus: 500_000}, {}, {}))
    with pytest.raises(RecordingError) as refused:
        anonymise(source, tmp_path / "public.mcap", AnonymiseOrder(texts=[word]))
    assert [path.name for path in tmp_path.iterdir()] == ["source.mcap"]
    return str(refused.value.details["reason"])


def test_what_is_left_is_told_with_its_place_and_what_to_do(tmp_path: Path) -> None:
    for where, case in (("bus", ("north", "north")), ("frame", ("HANSEN", "can0", b" HANSEN"))):
        (tmp_path / where).mkdir()
        reason = left_in(tmp_path / where, *case)
        assert reason.startswith(f"{case[0]!r} is still in")
        assert {"bus": "rename the bus", "frame": "name the object"}[where] in reason


def test_words_of_people_do_not_stay_in_events(tmp_path: Path) -> None:
    """However much they look like numbers or words of ours."""
    typed = {"reason": "hansen", "kind": "hansen", "text_key": "hansen.petersen", "was": "4711", "now": "hansen"}
    known = {"device": "wtg-07/blade-1/pmc", "text_key": "journal.written", "person": "ada"}
    details = [
        {**typed, **known, "text_key": "hansen.petersen", "address": "6065"},
        {**known, "was": "1.00", "now": "0.80", "address": "6065", "reason": "06090032h"},
        {**known, "was": "4711", "now": "4712", "address": "1018:04"},
        {**known, "was": "4711", "now": "4712", "address": "5F00:07"},  # described nowhere
        {**known, "was": "4711", "now": "4712", "address": "6065", "device": "wtg-07/unknown"},
    ]
    frames = [Frame(START_NS, "can0", Direction.RX, Can(0x18B, bytes(8)))]
    events = [Event(START_NS + n, EventKind.WRITE, "can0", one) for n, one in enumerate(details)]
    lost = {"count": 3, "reason": "queue_full"}
    events.append(Event(START_NS + 9, EventKind.FRAMES_LOST, "can0", lost))
    source = taped(tmp_path / "source.mcap", frames, INFO, events=events)
    done = anonymise(source, tmp_path / "public.mcap", AnonymiseOrder())
    plain = {"device": "turbine/blade-1/pmc", "text_key": "journal.written", "person": "person"}
    with open_recording(tmp_path / "public.mcap") as copy:
        assert [event.details for event in copy.events()] == [
            {"device": "turbine/blade-1/pmc", "person": "person", "address": "6065", "was": "4711"},
            {**plain, "was": "1.00", "now": "0.80", "address": "6065", "reason": "06090032h"},
            {**plain, "address": "1018:04"},
            {**plain, "address": "5F00:07"},
            {**plain, "address": "6065", "device": "turbine/place-1"},
            lost,
        ]
    assert done.left_out_details == 4 + 6


def test_the_known_text_keys_are_those_of_the_journal() -> None:
    assert {f"journal.{kind.value}" for kind in Kind} <= TEXT_KEYS
    journal = tomllib.loads((ROOT / "app" / "locales" / "en.toml").read_text("utf-8"))["journal"]
    assert {key.removeprefix("journal.") for key in TEXT_KEYS} <= journal.keys()


def test_hidden_times_are_hidden_in_time_stamps_on_the_bus_too(tmp_path: Path) -> None:
    """CiA 301: ms since midnight and days since 1984; what cannot be moved is left out and counted."""
    midnight = datetime(2025, 6, 15, tzinfo=UTC)
    begin = round(midnight.timestamp()) * S + 7 * 3600 * S
    days = (midnight - datetime(1984, 1, 1, tzinfo=UTC)).days
    stamp = (7 * 3_600_000 + 500).to_bytes(4, "little") + days.to_bytes(2, "little")
    sent = [Can(0x100, stamp), Can(0x100, bytes(6)), Can(0x100, stamp[:5]), Can(0x100, stamp, extended=True)]
    frames = [Frame(begin + n * MS, "can0", Direction.RX, can) for n, can in enumerate(sent)]
    source = taped(tmp_path / "source.mcap", frames)
    done = anonymise(source, tmp_path / "public.mcap", AnonymiseOrder(hide_times=True))
    anonymise(source, tmp_path / "with-times.mcap", AnonymiseOrder())
    assert [frame.payload for frame in frames_of(tmp_path / "with-times.mcap")] == sent
    first, other = frames_of(tmp_path / "public.mcap")
    assert (done.left_out_times, other.payload) == (2, sent[3])
    assert isinstance(first.payload, Can)
    told = datetime(1984, 1, 1, tzinfo=UTC) + timedelta(
        days=int.from_bytes(first.payload.data[4:], "little"),
        milliseconds=int.from_bytes(first.payload.data[:4], "little"),
    )
    late_ms = told.timestamp() * 1000 - first.t_ns / MS
    assert late_ms == pytest.approx(500, abs=1.1)
    assert told.year == 2000


# -- two at once --------------------------------------------------------------------------


def test_of_two_copies_of_one_name_the_later_is_refused_and_takes_nothing(tmp_path: Path) -> None:
    """One begins while the other is at work, and is still at work when that one is complete."""
    target, begun, go_on = tmp_path / "cut.mcap", Flag(), Flag()

    def wait(_share: float) -> None:
        begun.set()
        assert go_on.wait(10)

    with ThreadPoolExecutor(1) as pool:
        later = pool.submit(cut, VISIT, target, CutOrder(at(30), at(31)), wait)
        assert begun.wait(10)
        done = cut(VISIT, target, CutOrder(at(1), at(2)))
        go_on.set()
        with pytest.raises(RecordingError, match="exists already"):
            later.result(10)
    assert [path.name for path in tmp_path.iterdir()] == ["cut.mcap"]
    kept = frames_of(target)
    assert (len(kept), kept[0].t_ns < at(2)) == (done.frames, True)


def test_two_anonymised_copies_at_once_get_two_names(tmp_path: Path) -> None:
    sources = [secret_recording(tmp_path / name) for name in ("DE-north-17-001.mcap", "DE-north-17-002.mcap")]
    both = Barrier(2)

    def on_frames(count: int) -> None:
        if count == 1:
            both.wait(10)

    with ThreadPoolExecutor(2) as pool:
        made = list(pool.map(lambda one: anonymise_into(tmp_path, one, AnonymiseOrder())(on_frames), sources))
    names = sorted(one.files[0] for one in made)
    assert names == ["anonymous-2.mcap", "anonymous.mcap"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*names, *(one.name for one in sources)])
    assert [len(frames_of(tmp_path / name)) for name in names] == [len(frames_of(sources[0]))] * 2


def test_a_file_without_links_is_named_without_replacing_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_paths: object) -> None:
        raise OSError(errno.EPERM, "no links on this disk")

    monkeypatch.setattr("os.link", refused)
    one, other = Draft(tmp_path / "a.mcap"), Draft(tmp_path / "a.mcap")
    one.path.write_bytes(b"one")
    other.path.write_bytes(b"other")
    one.publish()
    with pytest.raises(FileExistsError):
        other.publish()
    other.withdraw()
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("a.mcap", b"one")]
