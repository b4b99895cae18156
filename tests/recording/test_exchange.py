"""Recordings to the formats of others and back: what a format can hold comes back equal, what it cannot is told."""

from __future__ import annotations

import json
import shutil
import struct
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import can
import can.io
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap_ros2.writer import Writer

from app.errors import ForeignFileError, RecordingError, UsageError
from app.recording.content import EventKind
from app.recording.exchange.exporting import Choice, export, losses
from app.recording.exchange.formats import IMPORTED, SUFFIXES, Format, Head, Lost, Style, detect, held, lost_parts
from app.recording.exchange.importing import Imported, ImportOrder, Wall, import_file, read_foreign
from app.recording.exchange.lines import Notes, Other
from app.recording.reader import open_recording
from app.recording.schemas import CAN_FRAME
from app.wire.frame import Adu, Can, Direction, Frame
from tests.recording.rig import MS, START_NS, S, frames_of, record

FOREIGN = [form for form in IMPORTED if form is not Format.MCAP]
WAYS = [(form, style) for form in FOREIGN for style in Style]
VISIT = Path(__file__).resolve().parents[2] / "recordings" / "scenarios" / "7-service-visit.mcap"


def dlc_of(size: int, raw: int) -> int:
    return raw if size == 8 and raw > 8 else -1


@st.composite
def cans(draw: st.DrawFn) -> Can:
    extended = draw(st.booleans())
    can_id = draw(st.integers(0, 0x1FFFFFFF if extended else 0x7FF))
    kind = draw(st.sampled_from(["data", "data", "remote", "error"]))
    if kind == "remote":
        return Can(can_id, b"", extended, True, False, draw(st.integers(0, 15)))
    data = draw(st.binary(max_size=8))
    return Can(can_id, data, extended, False, kind == "error", dlc_of(len(data), draw(st.integers(0, 15))))


@st.composite
def traffic(draw: st.DrawFn) -> list[Frame]:
    """Frames of all kinds on two buses, with strictly increasing times of any number of ns."""
    steps = draw(st.lists(st.integers(1, 3 * MS), min_size=1, max_size=25))
    t_ns, frames = START_NS + draw(st.integers(0, 999)), []
    for step in steps:
        t_ns += step
        bus = draw(st.sampled_from(["can0", "can0", "pitch 2"]))
        frames.append(Frame(t_ns, bus, draw(st.sampled_from(Direction)), draw(cans())))
    return frames


def straight(frames: Sequence[Frame]) -> list[Frame]:
    """As an import makes times strictly increasing."""
    last, result = -1, []
    for frame in frames:
        t_ns = max(frame.t_ns, last + 1)
        last = t_ns
        result.append(frame._replace(t_ns=t_ns))
    return result


def exported(source: Path, target: Path, form: Format, style: Style = Style.COMMON) -> dict[Lost, int]:
    """The file, and what was told to be lost."""
    with open_recording(source, strict=True) as recording:
        choice = Choice(form, style)
        told = {loss.what: loss.things for loss in losses(recording, choice)}
        export(recording, target, choice)
    return told


def imported(path: Path, folder: Path, **order: Any) -> tuple[Imported, list[Frame]]:
    found = import_file(path, folder, ImportOrder(**order))
    return found, [frame for part in found.taped.parts for frame in frames_of(part)]


@pytest.mark.parametrize(("form", "style"), WAYS, ids=lambda one: one.value)
@given(frames=traffic())
@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_what_a_format_holds_comes_back_equal_and_all_else_was_told(
    form: Format, style: Style, frames: list[Frame], tmp_path: Path
) -> None:
    folder = tmp_path / "turn"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    told = exported(record(folder, frames), folder / f"out{SUFFIXES[form]}", form, style)
    found, back = imported(folder / f"out{SUFFIXES[form]}", folder / "in")
    left = [one for frame in frames if (one := held(frame, form, style)) is not None]
    assert back == straight(left)
    assert found.wall is Wall.FILE
    assert found.notes.skipped_lines == 0
    lost = Counter(part for frame in frames for part in lost_parts(frame, held(frame, form, style)))
    assert {part: count for part, count in told.items() if part in lost} == lost
    assert set(told) - set(lost) <= {Lost.EVENTS, Lost.CLOCKS, Lost.STATES, Lost.ATTACHMENTS, Lost.NODES}


@pytest.mark.parametrize("form", [Format.CANDUMP, Format.CSV])
@given(frames=traffic())
@settings(max_examples=10, deadline=None)
def test_the_exact_style_loses_nothing_but_what_an_identifier_has_no_room_for(
    form: Format, frames: list[Frame]
) -> None:
    for frame in frames:
        lost = lost_parts(frame, held(frame, form, Style.EXACT))
        allowed = {Lost.ERROR_DETAILS, Lost.BUS} if form is Format.CANDUMP else set()
        assert set(lost) <= allowed, (frame, lost)


def messages(frames: Sequence[Frame], form: Format) -> Iterator[tuple[Any, ...]]:
    """What python-can's reader has to say of frames."""
    buses = list(dict.fromkeys(frame.bus for frame in frames))
    for frame in frames:
        payload = frame.payload
        assert isinstance(payload, Can)
        channel: Any = None if form is Format.CSV else frame.bus if form is Format.CANDUMP else buses.index(frame.bus)
        if form is Format.TRC:
            channel += 1
        if payload.error:
            yield channel, True
            continue
        yield (
            channel,
            payload.can_id,
            payload.extended,
            payload.remote,
            frame.direction is Direction.RX,
            bytes(payload.data),
            payload.length,
        )


def as_seen(message: can.Message) -> tuple[Any, ...]:
    if message.is_error_frame:
        return message.channel, True
    return (
        message.channel,
        message.arbitration_id,
        message.is_extended_id,
        message.is_remote_frame,
        message.is_rx,
        bytes(message.data),
        message.dlc,
    )


READERS = {
    Format.CANDUMP: can.io.CanutilsLogReader,
    Format.ASC: can.io.ASCReader,
    Format.BLF: can.io.BLFReader,
    Format.TRC: can.io.TRCReader,
    Format.CSV: can.io.CSVReader,
}
WRITERS = {
    Format.CANDUMP: can.io.CanutilsLogWriter,
    Format.ASC: can.io.ASCWriter,
    Format.BLF: can.io.BLFWriter,
    Format.TRC: can.io.TRCWriter,
    Format.CSV: can.io.CSVWriter,
}
PLAIN = [
    Frame(START_NS, "can0", Direction.RX, Can(0x181, bytes(range(8)))),
    Frame(START_NS + 1_234_000, "can0", Direction.TX, Can(0x60B, b"\x40\x41\x60\x00\x00\x00\x00\x00")),
    Frame(START_NS + 2 * MS, "can1", Direction.RX, Can(0x1ABCDEF, b"\x01", True)),
    Frame(START_NS + 3 * S, "can1", Direction.RX, Can(0x80, b"")),
    Frame(START_NS + 3 * S + 1000, "can0", Direction.RX, Can(0x123, b"", False, True, False, 0)),
]


@pytest.mark.parametrize("form", FOREIGN, ids=lambda one: one.value)
def test_python_can_reads_what_we_write(form: Format, tmp_path: Path) -> None:
    target = tmp_path / f"out{SUFFIXES[form]}"
    exported(record(tmp_path, PLAIN), target, form)
    left = [one for frame in PLAIN if (one := held(frame, form)) is not None]
    with READERS[form](str(target)) as reader:
        seen = list(reader)
    assert [as_seen(one) for one in seen] == list(messages(left, form))
    first = seen[0].timestamp
    for message, frame in zip(seen, left, strict=True):
        assert message.timestamp - first == pytest.approx((frame.t_ns - left[0].t_ns) / S, abs=2e-6)


@pytest.mark.parametrize("form", FOREIGN, ids=lambda one: one.value)
def test_what_python_can_writes_is_read(form: Format, tmp_path: Path) -> None:
    path = tmp_path / f"theirs{SUFFIXES[form]}"
    sent = [frame for frame in PLAIN if form is not Format.TRC or not frame.payload.remote]  # type: ignore[union-attr]
    with WRITERS[form](str(path)) as writer:
        for frame in sent:
            payload = frame.payload
            assert isinstance(payload, Can)
            channel: Any = int(frame.bus[-1])
            message = can.Message(
                timestamp=frame.t_ns / S,
                arbitration_id=payload.can_id,
                is_extended_id=payload.extended,
                is_remote_frame=payload.remote,
                is_rx=frame.direction is Direction.RX,
                dlc=payload.length,
                data=payload.data,
                channel=channel,
            )
            writer.on_message_received(message)
    found, back = imported(path, tmp_path / "in")
    whole = form is not Format.CSV  # whose columns have neither bus nor direction
    assert [frame.payload for frame in back] == [frame.payload for frame in sent]
    assert [(f.bus, f.direction) for f in back if whole] == [(f.bus, f.direction) for f in sent if whole]
    assert all(abs(a.t_ns - b.t_ns) < 2_000 for a, b in zip(back, sent, strict=True))
    assert found.wall is Wall.FILE
    assert found.source.format == form.value


def test_several_buses_become_channels_and_come_back_by_name(tmp_path: Path) -> None:
    names = ["pitch", "hub bus", "can7"]
    frames = [Frame(START_NS + n * 1000, names[n % 3], Direction.RX, Can(0x181, bytes([n]))) for n in range(30)]
    source = record(tmp_path, frames)
    for form in (Format.ASC, Format.BLF, Format.TRC):
        target = tmp_path / f"many{SUFFIXES[form]}"
        assert Lost.BUS not in exported(source, target, form)
        _, back = imported(target, tmp_path / form.value)
        assert back == frames


def test_one_bus_alone_can_be_exported(tmp_path: Path) -> None:
    source = record(tmp_path, PLAIN)
    with open_recording(source) as recording:
        done = export(recording, tmp_path / "one.log", Choice(Format.CANDUMP, buses=["can1"]))
        with pytest.raises(UsageError, match="no bus 'can9'"):
            export(recording, tmp_path / "none.log", Choice(Format.CANDUMP, buses=["can9"]))
    assert (done.frames, done.channels) == (2, ("can1",))
    assert (tmp_path / "one.log").read_text().count(" can1 ") == 2
    assert not (tmp_path / "none.log").exists()


def test_telegrams_of_other_buses_are_told_and_left_out(tmp_path: Path) -> None:
    frames = [*PLAIN, Frame(START_NS + 4 * S, "modbus", Direction.RX, Adu(b"\0\1\0\0\0\2\1\3", "a"))]
    told = exported(record(tmp_path, frames), tmp_path / "out.blf", Format.BLF)
    assert told[Lost.FRAME] == 1
    assert len(imported(tmp_path / "out.blf", tmp_path / "in")[1]) == len(PLAIN)


def test_a_target_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "out.log").write_text("mine")
    with open_recording(record(tmp_path, PLAIN)) as recording, pytest.raises(RecordingError, match="exists already"):
        export(recording, tmp_path / "out.log", Choice(Format.CANDUMP))
    assert (tmp_path / "out.log").read_text() == "mine"


# -- what is wrong with files -------------------------------------------------------------


LINES = {
    Format.CANDUMP: "(1750000000.000100) can0 181#0102",
    Format.ASC: "0.000100 1  181  Rx  d 2 01 02",
    Format.TRC: "1 0.100 DT 1 0181 Rx - 2 01 02",
    Format.CSV: "1750000000.0001,0x181,0,0,0,2,AQI=",
}
HEADS = {
    Format.CANDUMP: "",
    Format.ASC: "date Sun Jun 15 15:06:40.000 2025\nbase hex  timestamps absolute\nno internal events logged\n",
    Format.TRC: ";$FILEVERSION=2.1\n;$STARTTIME=45823.5\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n",
    Format.CSV: "timestamp,arbitration_id,extended,remote,error,dlc,data\n",
}
BAD = {
    Format.CANDUMP: [
        "(1750000000.1) can0 181#010",
        "(x) can0 181#",
        "(1.0) can0 1810#",
        "(1.0) can0 181#112233445566778899",
    ],
    Format.ASC: ["0.1 1 181 Rx d 3 01 02", "0.1 1 18G Rx d 0", "0.1 1 800 Rx d 0", "nothing at all"],
    Format.TRC: ["1 0.1 DT 1 0181 Rx - 3 01 02", "1 x DT 1 0181 Rx - 0", "1 0.1 DT 1 0181 Zz - 0", "1"],
    Format.CSV: ["1.0,0x181,0,0,0,3,AQI=", "1.0,0x181,0,0,0", "nan,0x181,0,0,0,2,AQI=", "1.0,0x3fffffff,2,0,0,2,AQI="],
}


@pytest.mark.parametrize(("form", "bad"), [(form, bad) for form, lines in BAD.items() for bad in lines])
def test_a_bad_line_is_named_or_left_out_and_listed(form: Format, bad: str, tmp_path: Path) -> None:
    path = tmp_path / f"bad{SUFFIXES[form]}"
    path.write_text(f"{HEADS[form]}{LINES[form]}\n{bad}\n{LINES[form]}\n")
    number = HEADS[form].count("\n") + 2
    with pytest.raises(ForeignFileError) as caught:
        import_file(path, tmp_path / "in", ImportOrder(form=form))
    details = caught.value.details
    assert (details["file"], details["line"], details["found"]) == (path.name, number, bad)
    assert details["expected_key"] == f"exchange.expects.{form.value}"
    assert not list((tmp_path / "in").iterdir())  # nothing half made is left
    found, back = imported(path, tmp_path / "in", form=form, lenient=True)
    assert len(back) == 2
    assert found.notes.skipped_lines == 1
    assert found.notes.skipped[0] == (number, bad)
    assert found.moved == 1  # both good lines have one stamp


@pytest.mark.parametrize("form", [Format.CANDUMP, Format.ASC, Format.TRC, Format.CSV, Format.BLF])
def test_a_file_that_ends_in_the_middle_gives_what_was_read_and_says_so(form: Format, tmp_path: Path) -> None:
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, Can(0x181, n.to_bytes(8, "big"))) for n in range(5_000)]
    target = tmp_path / f"whole{SUFFIXES[form]}"
    exported(record(tmp_path, frames), target, form)
    data = target.read_bytes()
    short = tmp_path / f"short{SUFFIXES[form]}"
    at = len(data) * 2 // 3 if form is Format.BLF else data.rindex(b"\n", 0, len(data) * 2 // 3) + 13
    short.write_bytes(data[:at])
    notes = Notes()
    back = list(read_foreign(short, form, notes))
    assert notes.truncated is not None
    assert len(frames) // 3 < len(back) < len(frames)
    assert back == frames[: len(back)]


def test_damage_in_the_middle_of_a_blf_file_is_named_or_stepped_over(tmp_path: Path) -> None:
    frames = [Frame(START_NS + n * MS, "can0", Direction.RX, Can(0x181, n.to_bytes(8, "big"))) for n in range(5_000)]
    target = tmp_path / "whole.blf"
    exported(record(tmp_path, frames), target, Format.BLF)
    data = bytearray(target.read_bytes())
    at = len(data) // 2
    data[at : at + 40] = bytes(40)
    target.write_bytes(data)
    with pytest.raises(RecordingError) as caught:
        list(read_foreign(target, Format.BLF, Notes()))
    assert 144 <= caught.value.details["offset"] < at
    notes = Notes()
    back = list(read_foreign(target, Format.BLF, notes, lenient=True))
    assert notes.skipped_lines
    assert set(back) < set(frames)
    assert back[-1] == frames[-1]


def test_what_is_no_classic_frame_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "mixed.log"
    path.write_text("(1750000000.000001) can0 181##10102\n(1750000000.000002) can0 181#0102 T\n")
    found, back = imported(path, tmp_path / "a")
    assert found.notes.other == {Other.CAN_FD: 1}
    assert back[0].direction is Direction.TX
    path = tmp_path / "mixed.asc"
    path.write_text(
        HEADS[Format.ASC] + "   0.1 CANFD 1 Rx 123 1 0 2 2 01 02 0 0 0 0\n   0.2 1  Statistic: D 0 R 0\n"
        "   0.25 1  181  TxRq d 1 01\n   0.3 2  181x  Tx d 1 FF  Length = 228000 BitCount = 118\n   0.4 1  ErrorFrame\n"
    )
    found, back = imported(path, tmp_path / "b")
    assert found.notes.other == {Other.CAN_FD: 1, Other.STATUS: 1, Other.REQUEST: 1}
    assert [(f.bus, f.direction, f.payload) for f in back] == [
        ("can1", Direction.TX, Can(0x181, b"\xff", True)),
        ("can0", Direction.RX, Can(0, b"", error=True)),
    ]


def test_asc_dates_bases_and_relative_times(tmp_path: Path) -> None:
    cases = {
        "date Sun Jun 15 03:06:40.500 pm 2025": 500,
        "date Son Jun 15 15:06:40.500 2025": 500,
        "date Sun Jun 15 15:06:40.5 2025": 5,  # as python-can writes 5 ms
        "date Sun Jun 15 15:06:40 2025": 0,
    }
    for number, (date, ms) in enumerate(cases.items()):
        path = tmp_path / f"{number}.asc"
        path.write_text(f"{date}\nbase dec timestamps relative\nno internal events logged\n"
                        "0.5 1 385 Rx d 2 1 255\n0.25 1 386 Rx d 1 16\n")  # fmt: skip
        found, back = imported(path, tmp_path / str(number))
        assert found.wall is Wall.FILE
        local_ns = back[0].t_ns - S // 2
        assert local_ns % S == ms * MS
        assert back[1].t_ns - back[0].t_ns == S // 4
        assert [frame.payload for frame in back] == [Can(385, b"\x01\xff"), Can(386, b"\x10")]


def test_old_versions_of_trc(tmp_path: Path) -> None:
    lines = {
        "1.0": "     1)     1.5 0181  2  01 02",
        "1.1": "     1)         1.5  Tx     0181  2  01 02",
        "1.3": "      1)      1.500 1  Tx        0181 -  2    01 02",
        "2.0": "      1      1.500 DT     0181 Tx 2  01 02",
    }
    for version, line in lines.items():
        start = "" if version == "1.0" else ";$STARTTIME=45823.5\n"
        columns = ";$COLUMNS=N,O,T,I,d,l,D\n" if version == "2.0" else ""
        path = tmp_path / f"{version}.trc"
        path.write_text(f";$FILEVERSION={version}\n{start}{columns};---\n{line}\n")
        found, back = imported(path, tmp_path / version)
        assert found.wall is (Wall.ASSUMED if version == "1.0" else Wall.FILE)
        way = Direction.RX if version == "1.0" else Direction.TX
        assert [(f.direction, f.payload) for f in back] == [(way, Can(0x181, b"\x01\x02"))]
        if version != "1.0":
            assert back[0].t_ns == (45823 - 25569) * 86400 * S + 43200 * S + 1_500_000


def test_an_old_error_object_and_ten_microsecond_stamps_of_blf(tmp_path: Path) -> None:
    def item(kind: int, flags: int, at: int, data: bytes) -> bytes:
        size = 32 + len(data)
        return struct.pack("<4sHHLL", b"LOBJ", 32, 1, size, kind) + struct.pack("<LHHQ", flags, 0, 0, at) + data

    plain = item(1, 1, 5, struct.pack("<HBBL8s", 2, 1, 2, 0x181, b"\x01\x02")) + item(2, 2, 60_000, bytes([1, 0, 0, 0]))
    packed = zlib.compress(plain)
    head = struct.pack("<4sLBBBBBBBBQQLL8H8H", b"LOGG", 144, 0, 0, 0, 0, 2, 6, 8, 1, 0, 0, 0, 0,
                       2025, 6, 0, 15, 15, 6, 40, 0, *[0] * 8).ljust(144, b"\0")  # fmt: skip
    container = struct.pack("<4sHHLL", b"LOBJ", 16, 1, 32 + len(packed), 10) + struct.pack("<H6xL4x", 2, len(plain))
    path = tmp_path / "old.blf"
    path.write_bytes(head + container + packed)
    _, back = imported(path, tmp_path / "in")
    assert back == [
        Frame(START_NS + 50_000, "can1", Direction.TX, Can(0x181, b"\x01\x02")),
        Frame(START_NS + 60_000, "can0", Direction.RX, Can(0, b"", error=True)),
    ]


def test_a_time_that_no_recording_can_hold_does_not_drag_the_others_along(tmp_path: Path) -> None:
    path = tmp_path / "far.log"
    path.write_text("".join(f"({time}) can0 181#01\n" for time in ("99999999999.0", "1750000000.0", "1750000001.0")))
    with pytest.raises(RecordingError, match="no recording can hold"):
        import_file(path, tmp_path / "in", ImportOrder())
    found, back = imported(path, tmp_path / "in", lenient=True)
    assert found.beyond == 1
    assert [frame.t_ns for frame in back] == [START_NS, START_NS + S]


@given(head=st.dictionaries(st.text(max_size=12), st.integers() | st.floats() | st.text(), max_size=3) | st.none())
@settings(max_examples=50)
def test_a_head_that_makes_no_sense_is_none(head: dict[str, Any] | None) -> None:
    whole = {"started_ns": START_NS, "buses": ["can0"], "bit_rates": {"can0": 500_000}}
    assert Head.from_json(json.dumps(whole)) == Head(START_NS, ("can0",), {"can0": 500_000})
    for key in ("started_ns", "buses"):
        assert Head.from_json(json.dumps({**whole, key: head})) is None
    for rate in (0, -1, 1_000_001, 0.5, "1", None, True):
        assert Head.from_json(json.dumps({**whole, "bit_rates": {"can0": rate}})) is None
    for text in ("", "{", "[" * 5000, json.dumps(head), json.dumps({**whole, "started_ns": float("inf")})):
        assert Head.from_json(text) is None


def test_a_clock_that_was_set_back_is_an_event_and_not_a_heap_of_equal_times(tmp_path: Path) -> None:
    path = tmp_path / "step.log"
    times = ["1750000000.0", "1750000010.0", "1750000005.0", "1750000006.0", "1750000005.999999"]
    path.write_text("".join(f"({time}) can0 181#{n:02X}\n" for n, time in enumerate(times)))
    found, back = imported(path, tmp_path / "in")
    assert (found.clock_steps, found.moved, found.largest_move_ns) == (1, 1, 1001)
    assert [frame.t_ns - START_NS for frame in back] == [0, 10 * S, 10 * S + 1, 11 * S + 1, 11 * S + 2]
    with open_recording(found.taped.parts[0]) as recording:
        events = list(recording.events())
        assert recording.metadata["origin"]["moved"] == "1"
    assert [(event.kind, event.details["step_ns"]) for event in events] == [(EventKind.WALL_CLOCK_STEP, -5 * S)]


def test_an_import_is_a_recording_as_any_other(tmp_path: Path) -> None:
    exported(VISIT, tmp_path / "visit.blf", Format.BLF)
    order = ImportOrder(
        turbine="wtg-07", who="ada", nodes={"can0/11": "wtg-07/blade-1/pmc oat-pmc"}, bit_rates={"can0": 250_000}
    )
    found = import_file(tmp_path / "visit.blf", tmp_path / "in", order)
    (part,) = found.taped.parts
    assert part.name == "20260302T130000Z-wtg-07-001.mcap"
    with open_recording(VISIT) as source, open_recording(part, strict=True) as recording:
        assert list(recording.frames()) == list(source.frames())
        assert recording.info.nodes == order.nodes
        assert recording.info.bit_rates == {"can0": 250_000}
        assert recording.totals is not None
        assert recording.totals.frames == found.taped.frames
        keyframes = list(recording.keyframes())
        span = recording.span_ns
        assert span is not None
        assert len(keyframes) == pytest.approx((span[1] - span[0]) / (5 * S), abs=2)
        assert {one.name for one in recording.attachments()} == {"descriptions/oat-pmc.json"}
        origin = recording.metadata["origin"]
    assert origin["kind"] == "import"
    assert '"file": "visit.blf"' in origin["sources"]
    assert found.source.sha256 in origin["sources"]
    copied = import_file(part, tmp_path / "again", ImportOrder())  # one of ours: the very bytes
    assert copied.taped.parts[0].read_bytes() == part.read_bytes()


def test_mcap_of_others_is_taken_as_far_as_it_holds_frames(tmp_path: Path) -> None:
    path = tmp_path / "robot.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        frame_type = writer.register_msgdef("can_msgs/msg/Frame", CAN_FRAME.text)
        text_type = writer.register_msgdef("std_msgs/msg/String", "string data")
        for n in range(50):
            t_ns = START_NS + n * 1_000_003
            stamp = {"sec": t_ns // S, "nanosec": t_ns % S}
            message = {"header": {"stamp": stamp, "frame_id": "base_link"}, "id": 0x181, "is_rtr": False,
                       "is_extended": False, "is_error": False, "dlc": 3, "data": [n, 2, 3, 0, 0, 0, 0, 0]}  # fmt: skip
            writer.write_message("/vehicle/from_can", frame_type, message, t_ns)
            writer.write_message("/chatter", text_type, {"data": "hello"}, t_ns)
        writer.finish()  # type: ignore[no-untyped-call]
    _, back = imported(path, tmp_path / "in", buses={"vehicle/from_can": "can0"})
    assert back == [
        Frame(START_NS + n * 1_000_003, "can0", Direction.RX, Can(0x181, bytes([n, 2, 3]))) for n in range(50)
    ]


def test_what_no_format_is_known_for(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("dear diary")
    with pytest.raises(UsageError, match="no format that is known"):
        detect(path)
    (tmp_path / "empty.log").write_text("\n\n")
    with pytest.raises(RecordingError, match="no CAN frame"):
        import_file(tmp_path / "empty.log", tmp_path / "in", ImportOrder())


BAD_NAMES = ("", ".", "..", " ", ".hidden.mcap", "a\0.mcap", "a\n.mcap", "a/b.mcap", "a\\b.mcap", "a.annotations.mcap",
             "a.ANNOTATIONS.mcap", "a.annotations.log", f"{'a' * 250}.mcap")  # fmt: skip


@pytest.mark.parametrize("name", BAD_NAMES)
def test_a_name_that_no_recording_can_have_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be imported under the name"):
        import_file(VISIT, tmp_path / "to", ImportOrder(), name=name)
    assert list(tmp_path.iterdir()) == []


def test_a_recording_keeps_its_plain_name(tmp_path: Path) -> None:
    found = import_file(VISIT, tmp_path, ImportOrder(), name="Prüfstand, 2. Lauf.mcap")
    assert [path.name for path in found.taped.parts] == ["Prüfstand, 2. Lauf.mcap"]
    with pytest.raises(RecordingError, match="exists already"):
        import_file(VISIT, tmp_path, ImportOrder(), name="Prüfstand, 2. Lauf.mcap")
