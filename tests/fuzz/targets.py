"""What is fuzzed: real seeds of each format, how they are damaged, and all that reads them."""

from __future__ import annotations

import random
import tempfile
import zlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Final

import can
from mcap.writer import CompressionType

from app.errors import HubsideError
from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.eds.file import read_eds
from app.model.eds_write import to_eds
from app.model.set_dcf import dump_dcf, load_dcf
from app.model.set_import import read_set_file
from app.model.sets import ParameterSet, dump_set, load_set
from app.model.texts import load_texts
from app.recording.columns import Signal, can_columns, samples
from app.recording.content import AttachedFile
from app.recording.exchange.formats import Format as Foreign
from app.recording.exchange.formats import detect
from app.recording.exchange.importing import ImportOrder, import_file, read_foreign
from app.recording.exchange.lines import Notes
from app.recording.index import build_index
from app.recording.pack import pack
from app.recording.reader import Recording, open_recording
from app.recording.recover import recover_all
from app.wire.frame import Can, Direction, Frame
from bench._traffic import traffic
from tests.fuzz import mutate, mutate_mcap
from tests.model.set_rig import DESCRIPTIONS, taking, whole_set
from tests.recording.foreign_files import Form, write
from tests.recording.rig import START_NS, record

ROOT: Final = Path(__file__).resolve().parents[2]
FEW: Final = 12
SHEETS: Final = {("can0", node): DESCRIPTIONS["oat-pmc"] for node in (11, 12)}
SIGNALS: Final = [Signal("can0", node, Address(index)) for _, node in SHEETS for index in (0x6041, 0x6064, 0x1001)]
DECODED: Final = 16
"""To decode a file and to make its index takes longer than all the rest: it is done with one file in so many."""
FORMS: Final = (
    Form(),
    Form(order=">", frame_id=None, chunked=False),
    Form(compression=CompressionType.LZ4, mixed=True, topic="/{bus}/{way}", frame_id=""),
    Form(compression=CompressionType.NONE, mixed=True, chunk_bytes=1000, crcs=False),
)
"""As other programs write."""
SELDOM: Final = 0.004
"""Share of the files that are made of a seed of full size, which takes a hundred times longer to read."""


class Name(Enum):
    """The formats."""

    MCAP = "mcap"
    CANDUMP = "candump"
    ASC = "asc"
    EDS = "eds"
    DCF = "dcf"
    SET = "set"


@dataclass(frozen=True)
class Target:
    """``read`` gets the bytes and a folder of its own; it may raise a ``HubsideError`` and nothing else."""

    seeds: tuple[bytes, ...]
    large: tuple[bytes, ...]
    change: mutate.Way
    read: Callable[[bytes, Path], None]

    def file(self, chance: random.Random) -> bytes:
        """A damaged file."""
        seeds = self.large if self.large and chance.random() < SELDOM else self.seeds
        data = chance.choice(seeds)
        if chance.random() < 0.05:
            data = mutate.spliced(chance, data, chance.choice(seeds))
        return self.change(chance, data)


def _exhaust(things: Iterable[object]) -> None:
    deque(things, maxlen=0)


@contextmanager
def _declared() -> Iterator[None]:
    """An error of ours, whose text can be made; the next way to read the file is tried all the same."""
    try:
        yield
    except HubsideError as error:
        load_texts("en")(error.text_key, **error.details)


# MCAP


def _mcap_seeds() -> tuple[bytes, ...]:
    golden = (ROOT / "recordings" / "golden.mcap").read_bytes()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        attached = [AttachedFile("sets/a.json", "application/json", b"{}" * 600)]
        path = record(folder / "small", traffic(60, start_ns=START_NS), attached)
        small = path.read_bytes()
        pack(path, folder / "packed.mcap")
        packed = (folder / "packed.mcap").read_bytes()
        frames = traffic(60, start_ns=START_NS)
        others = [write(folder / f"{n}.mcap", frames, form).read_bytes() for n, form in enumerate(FORMS)]
    return golden, golden, small, packed, golden[: len(golden) * 2 // 3], *others


def _all_of(recording: Recording) -> Iterator[Callable[[], object]]:
    yield lambda: _exhaust(recording.frames())
    yield lambda: _exhaust(recording.frames(START_NS + 1000, START_NS + 50_000))
    yield lambda: _exhaust(recording.clocks())
    yield lambda: _exhaust(recording.keyframes())
    yield lambda: _exhaust(recording.events())
    yield lambda: _exhaust(recording.attachments())
    yield lambda: _exhaust(recording.bodies())
    yield lambda: _same_frames(recording)
    yield lambda: (recording.topics, recording.span_ns, recording.library, dict(recording.metadata))
    yield lambda: recording.info
    yield lambda: recording.identity
    yield lambda: recording.totals


def _same_frames(recording: Recording) -> None:
    """Frame by frame and by columns there is the same, where nothing was left out: of what was, a part may be read."""
    by_columns = sum(len(block.t_ns) for block in can_columns(recording, workers=1))
    by_frames = sum(type(frame.payload) is Can for frame in recording.frames())
    if by_columns != by_frames and not recording.damages:
        raise ValueError(f"{by_columns} frames by columns, {by_frames} one by one")


def _read_mcap(data: bytes, folder: Path) -> None:
    path = folder / "d-001.mcap"
    path.write_bytes(data)
    for strict in (False, True):
        with _declared(), open_recording(path, strict) as recording:
            for look in _all_of(recording):
                with _declared():
                    look()
    if zlib.crc32(data) % DECODED == 0:
        with _declared():
            samples(path, SIGNALS, SHEETS, workers=1)
        with _declared(), build_index(path, SHEETS, cache=folder) as index:
            _exhaust(index.events())
            _exhaust(index.gaps())
    with _declared():
        recover_all(folder, START_NS)
        if path.exists():
            with open_recording(path) as recording:
                _exhaust(recording.frames())
    for left in folder.iterdir():
        left.unlink()


# Text logs


def _log_frames() -> list[can.Message]:
    """What python-can writes: data, remote, extended and error frames of two channels."""
    payloads = [frame.payload for frame in traffic(FEW, start_ns=START_NS)]
    cans = [payload for payload in payloads if isinstance(payload, Can)]
    cans += [
        Can(0x123, remote=True, dlc=4),
        Can(0x1ABCDEF0, b"\x01\x02", extended=True),
        Can(0x4, bytes(8), error=True),
    ]
    return [
        can.Message(
            timestamp=1_750_000_000 + n * 0.000_25,
            arbitration_id=each.can_id,
            is_extended_id=each.extended,
            is_remote_frame=each.remote,
            is_error_frame=each.error,
            dlc=each.length,
            data=None if each.remote else each.data,
            channel=n % 2,
            is_rx=n % 3 > 0,
        )
        for n, each in enumerate(cans)
    ]


def _log(suffix: str) -> bytes:
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / f"a{suffix}"
        with can.Logger(str(path)) as logger:
            for message in _log_frames():
                logger.on_message_received(message)
        return path.read_bytes()


def _candump_seeds() -> tuple[bytes, ...]:
    fd = b"(1750000000.000100) can0 18B##1112233\n(1750000000.000200) vcan1 0000018B#R8\n"
    screen = b" (000.000000)  can0  18B   [4]  37 16 40 1F\n  can0  1ABCDEF0   [2]  AA BB\n"
    screen += b"  can0  123   [0]  remote request\n"
    return _log(".log"), fd, screen


def _asc_seeds() -> tuple[bytes, ...]:
    own = b"""date Mon Jun 15 03:06:40.000 pm 2026
base hex  timestamps absolute
internal events logged
Begin Triggerblock Mon Jun 15 03:06:40.000 pm 2026
   0.000000 Start of measurement
   0.001000 1  18B             Rx   d 8 37 16 40 1F 00 00 00 00
   0.002000 2  1ABCDEF0x       Tx   d 2 AA BB  Length = 100 BitCount = 60 ID = 448585456x
   0.003000 1  ErrorFrame
   0.004000 1  Statistic: D 10 R 0 XD 0 XR 0 E 0 O 0 B 1.00%
   0.005000 CANFD   1 Rx        18B  1 0 8  8 01 02 03 04 05 06 07 08
End TriggerBlock
"""
    return _log(".asc"), own, own.replace(b"absolute", b"relative").replace(b"hex", b"dec")


def _log_reader(form: Foreign, suffix: str) -> Callable[[bytes, Path], None]:
    def read(data: bytes, folder: Path) -> None:
        path = folder / f"d{suffix}"
        path.write_bytes(data)
        with _declared():
            detect(path)
        for lenient in (False, True):
            with _declared():
                _exhaust(read_foreign(path, form, Notes(), lenient))
        made = folder / "made"
        with _declared():
            import_file(path, made, ImportOrder(form=form, lenient=True))
            for recording in made.glob("*.mcap"):
                _exhaust(open_and_read(recording))
        for left in (*made.glob("*"), path):
            left.unlink()

    return read


def open_and_read(path: Path) -> Iterator[Frame]:
    """The frames of a recording that must be whole."""
    with open_recording(path, strict=True) as recording:
        last_ns = -1
        for frame in recording.frames():
            if frame.t_ns <= last_ns or frame.direction not in Direction:
                raise ValueError(f"stamp {frame.t_ns} after {last_ns}")
            last_ns = frame.t_ns
            yield frame


# Sheets and sets


@cache
def _small(name: str) -> tuple[Description, ParameterSet]:
    """A description and a set of a few objects of every kind."""
    description, whole = DESCRIPTIONS[name], whole_set(name)
    some: list[Address] = list(description.entries)[:: max(1, len(description.entries) // FEW)]
    some += [address for address in description.entries if address.major in (0x1008, 0x1010, 0x1018, 0x1400, 0x1800)]
    entries = {address: entry for address, entry in description.entries.items() if address in some}
    values: Mapping[Address, Raw] = {address: raw for address, raw in whole.values.items() if address in some}
    kept = replace(whole, values=values, unread=dict(list(whole.unread.items())[:2]))
    return replace(description, entries=entries), kept


def _eds_seeds() -> tuple[bytes, ...]:
    fixtures = sorted((ROOT / "tests" / "model" / "fixtures" / "eds").glob("*.*"))
    return (*(path.read_bytes() for path in fixtures), *(to_eds(_small(n)[0], "x.eds").encode() for n in DESCRIPTIONS))


def _read_eds(data: bytes, _folder: Path) -> None:
    with _declared():
        loaded = read_eds(data, "d.eds", 11)
        texts = load_texts("en")
        for warning in loaded.warnings:
            texts(warning.text_key, **warning.details)
        again = read_eds(to_eds(loaded.description, "again.eds").encode(), "again.eds", 11)
        if set(again.description.entries) != set(loaded.description.entries):
            raise ValueError("what is written from it holds other objects")


def _dcf_seeds() -> tuple[bytes, ...]:
    small = (dump_dcf(_small(name)[1], _small(name)[0]).encode() for name in DESCRIPTIONS)
    compact = (ROOT / "tests" / "model" / "fixtures" / "eds" / "compact.dcf").read_bytes()
    return (*small, compact)


def _read_dcf(data: bytes, _folder: Path) -> None:
    for as_values in (False, True):
        with _declared():
            _same_again(load_dcf(data, "d.dcf", taking(as_values=as_values)).parameters)
    with _declared():
        read_set_file(data, "d.dcf", taking())


def _set_seeds() -> tuple[bytes, ...]:
    return tuple(dump_set(_small(name)[1]).encode() for name in DESCRIPTIONS)


def _read_set(data: bytes, _folder: Path) -> None:
    with _declared():
        _same_again(read_set_file(data, "d.json", taking()).parameters)


def _same_again(parameters: ParameterSet) -> None:
    """What was taken can be kept: it is written and read back the same."""
    text = dump_set(parameters)
    if dump_set(load_set(text, "again.json")) != text:
        raise ValueError("the set is another one when it is read back")


@cache
def target(name: Name) -> Target:
    """Make the seeds of a format."""
    if name is Name.MCAP:
        return Target(_mcap_seeds(), (), mutate_mcap.changed, _read_mcap)
    if name is Name.CANDUMP:
        return Target(_candump_seeds(), (), mutate.lines_changed, _log_reader(Foreign.CANDUMP, ".log"))
    if name is Name.ASC:
        return Target(_asc_seeds(), (), mutate.lines_changed, _log_reader(Foreign.ASC, ".asc"))
    if name is Name.EDS:
        large = tuple(path.read_bytes() for path in sorted((ROOT / "od" / "eds").glob("*.eds")))
        return Target(_eds_seeds(), large, mutate.lines_changed, _read_eds)
    if name is Name.DCF:
        large = tuple(dump_dcf(whole_set(n), DESCRIPTIONS[n]).encode() for n in DESCRIPTIONS)
        return Target(_dcf_seeds(), large, mutate.lines_changed, _read_dcf)
    large = tuple(dump_set(whole_set(n)).encode() for n in DESCRIPTIONS)
    return Target(_set_seeds(), large, mutate.json_changed, _read_set)


def clear(folder: Path) -> None:
    """Remove what a reader left because an error of its own ended it."""
    for path in sorted(folder.rglob("*"), reverse=True):
        with suppress(OSError):
            path.rmdir() if path.is_dir() else path.unlink()
