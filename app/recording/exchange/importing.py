"""Makes a recording of a file of others: candump, ASC, BLF, TRC, CSV, and MCAP that others wrote.

What cannot be taken is told: lines that were left out, objects that are no classic CAN frames, stamps that were moved
because they were not later than the one before, where the file ends in the middle.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum
from itertools import chain
from pathlib import Path
from typing import Final

from app import __version__
from app.errors import ForeignFileError, RecordingError, UsageError
from app.model.od_export import to_json
from app.recording.annotations import SUFFIX
from app.recording.cdr import MAX_T_NS, NS
from app.recording.content import METADATA_RECORDING, AttachedFile, Event, EventKind, RecordingInfo
from app.recording.exchange.asc import AscParser
from app.recording.exchange.blf import BlfReader
from app.recording.exchange.candump import CandumpParser
from app.recording.exchange.csv_lines import CsvParser
from app.recording.exchange.draft import drafted, free_name
from app.recording.exchange.formats import IMPORTED, Format, detect
from app.recording.exchange.lines import LineParser, Notes, read_lines
from app.recording.exchange.origin import OriginKind, Source, origin_table, source_of
from app.recording.exchange.tape import Subject, Tape, Taped
from app.recording.exchange.trc import TrcParser
from app.recording.node_table import described
from app.recording.reader import open_recording
from app.recording.writer import new_name
from app.wire.frame import Frame

_MAX_NAME: Final = 200  # a file system takes 255 bytes, and annotations make it longer
SMALLEST_STEP_NS: Final = 1
CLOCK_STEP_NS: Final = NS
"""A stamp that is so much older than the one before tells of a clock that was set back, not of frames out of order."""
_UNIX_FROM_NS: Final = 631_152_000 * NS
"""1990: what is earlier counts from the start of something and not from 1970."""
_PARSERS: Final[dict[Format, Callable[[Notes], LineParser]]] = {
    Format.CANDUMP: CandumpParser,
    Format.ASC: AscParser,
    Format.TRC: TrcParser,
    Format.CSV: CsvParser,
}


class Wall(Enum):
    """Whence the time of the recording: the file tells it, a person gave it, or it is when the file was changed."""

    FILE = "file"
    GIVEN = "given"
    ASSUMED = "assumed"


@dataclass(frozen=True)
class ImportOrder:
    """What is known beside the file. ``nodes`` maps ``can0/11`` to slug and description.

    ``buses`` renames buses of the file; ``start_ns`` is when the first frame came, where the file does not tell or is
    wrong; ``lenient``: bad lines are left out and counted.
    """

    turbine: str = "import"
    who: str = ""
    bit_rates: Mapping[str, int] = field(default_factory=dict)
    nodes: Mapping[str, str] = field(default_factory=dict)
    buses: Mapping[str, str] = field(default_factory=dict)
    form: Format | None = None
    start_ns: int | None = None
    lenient: bool = False


@dataclass
class Imported:
    """What came of a file. ``moved`` stamps were not later than the one before, by ``largest_move_ns`` at most.

    ``beyond`` frames had times later than a recording can hold.
    """

    source: Source
    modified_ns: int
    notes: Notes = field(default_factory=Notes)
    wall: Wall = Wall.FILE
    buses: Counter[str] = field(default_factory=Counter)
    beyond: int = 0
    moved: int = 0
    largest_move_ns: int = 0
    clock_steps: int = 0
    taped: Taped = field(default_factory=Taped)


def read_foreign(path: Path, form: Format, notes: Notes, lenient: bool = False) -> Iterator[Frame]:
    """The frames of a file as they stand in it. Raises ForeignFileError, RecordingError and OSError."""
    if form is Format.MCAP:
        with open_recording(path) as recording:
            yield from recording.frames()
            if recording.damages:
                notes.truncated = recording.damages[0].offset
    elif form is Format.BLF:
        yield from BlfReader(path, notes, lenient).frames()
    else:
        yield from read_lines(path, _PARSERS[form](notes), notes, lenient)


def import_file(
    path: Path,
    folder: Path,
    order: ImportOrder,
    on_frames: Callable[[int], None] | None = None,
    name: str | None = None,
) -> Imported:
    """Makes a recording of ``path`` in ``folder``, under a new name.

    ``name`` is what the file was called where it came from. A recording of this bench is copied as it is, under its
    name. Raises UsageError where the name is no plain one or the format is not known, ForeignFileError (file, line,
    what was expected) and RecordingError; nothing is left then.
    """
    name = plain_name(path.name if name is None else name)
    form = order.form or detect(path, name)
    if form not in IMPORTED:
        raise UsageError(reason=f"{name}: {form.value} is written here, and not read")
    try:
        found = Imported(source_of(path, form.value)._replace(file=name), path.stat().st_mtime_ns)
        folder.mkdir(parents=True, exist_ok=True)
        if form is Format.MCAP and _is_ours(path):
            _copy(path, folder, found)
            return found
        frames = _named(read_foreign(path, form, found.notes, order.lenient), order)
        _write(_Straight(found, order), frames, folder, order, on_frames)
    except OSError as error:
        raise RecordingError(file=name, offset=0, reason=error.strerror or str(error)) from error
    except (ForeignFileError, RecordingError) as error:
        if error.details.get("file") == path.name:
            error.details["file"] = name
        raise
    return found


def plain_name(name: str) -> str:
    """The name, if a recording can be called so; else raises UsageError."""
    reason = None
    if not name.strip(". ") or name.startswith("."):
        reason = "it is empty or begins with a dot"
    elif not name.isprintable() or any(sign in name for sign in '/\\:*?"<>|'):
        reason = 'a name has no line breaks, control characters or any of / \\ : * ? " < > |'
    elif len(name.encode(errors="replace")) > _MAX_NAME:
        reason = f"it is longer than {_MAX_NAME} bytes"
    elif f"{Path(name).stem}.mcap".lower().endswith(SUFFIX):
        reason = f"files that end in {SUFFIX} hold the notes to a recording"
    if reason is not None:
        raise UsageError(reason=f"the file cannot be imported under the name {name[:80]!r}: {reason}; rename it")
    return name


def _is_ours(path: Path) -> bool:
    with open_recording(path) as recording:
        return METADATA_RECORDING in recording.metadata


def _copy(path: Path, folder: Path, found: Imported) -> None:
    """The very bytes, under the name that they have."""
    target = folder / f"{Path(found.source.file).stem}.mcap"
    with drafted(target) as draft:
        shutil.copyfile(path, draft)
    with open_recording(target) as recording:
        found.taped.parts.append(target)
        found.taped.first_ns, found.taped.last_ns = recording.span_ns or (None, None)
        for bus, count in recording.topics.items():
            if not bus.startswith(("/clock", "/state", "/events")):
                found.buses[bus[1:]] += count
        found.taped.frames = found.buses.total()


def _named(frames: Iterator[Frame], order: ImportOrder) -> Iterator[Frame]:
    if not order.buses:
        return frames
    return (frame._replace(bus=order.buses.get(frame.bus, frame.bus)) for frame in frames)


class _Straight:
    """Gives every frame the time that it has in the recording: on the wall clock, strictly increasing."""

    def __init__(self, found: Imported, order: ImportOrder) -> None:
        self.found = found
        self.on_step: Callable[[Event], None] | None = None
        self._order = order
        self._last_ns = -1
        self._shift_ns = 0

    def __call__(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        buses = self.found.buses
        for frame in frames:
            if self._last_ns < 0:
                self._begin(frame.t_ns)
            t_ns = frame.t_ns + self._shift_ns
            if not t_ns < MAX_T_NS - NS:  # a second less: equal stamps are moved on from there
                self._beyond(buses.total() + 1)
                continue
            buses[frame.bus] += 1
            if t_ns <= self._last_ns:
                t_ns = self._moved(t_ns)
            self._last_ns = t_ns
            yield frame if t_ns == frame.t_ns else frame._replace(t_ns=t_ns)

    def _begin(self, first_ns: int) -> None:
        found, order = self.found, self._order
        if order.start_ns is not None:
            found.wall = Wall.GIVEN
            self._shift_ns = order.start_ns - first_ns
        elif not found.notes.wall_known or first_ns < _UNIX_FROM_NS:
            found.wall = Wall.ASSUMED
            self._shift_ns = found.modified_ns - first_ns

    def _beyond(self, number: int) -> None:
        """A time that no recording can hold; it tells nothing of those that follow."""
        if not self._order.lenient:
            reason = f"frame {number} has a time that no recording can hold"
            raise RecordingError(file=self.found.source.file, offset=0, reason=reason)
        self.found.beyond += 1

    def _moved(self, t_ns: int) -> int:
        found, earliest_ns = self.found, self._last_ns + SMALLEST_STEP_NS
        back_ns = self._last_ns - t_ns
        if back_ns >= CLOCK_STEP_NS:
            self._shift_ns += earliest_ns - t_ns
            found.clock_steps += 1
            if self.on_step is not None:
                details = {"step_ns": -back_ns, "wall_ns": t_ns}
                self.on_step(Event(earliest_ns, EventKind.WALL_CLOCK_STEP, "", details))
        else:
            found.moved += 1
            found.largest_move_ns = max(found.largest_move_ns, earliest_ns - t_ns)
        return earliest_ns


def _write(
    straight: _Straight,
    read: Iterator[Frame],
    folder: Path,
    order: ImportOrder,
    on_frames: Callable[[int], None] | None,
) -> None:
    found, frames = straight.found, straight(read)
    first = next(frames, None)
    if first is None:
        raise RecordingError(file=found.source.file, offset=0, reason="no CAN frame in it")
    head = found.notes.head
    rates = {**(head.bit_rates if head is not None else {}), **order.bit_rates}
    with free_name(folder, new_name(folder, first.t_ns, order.turbine)) as series:
        _tape(straight, first, frames, series, order, rates, on_frames)


def _tape(
    straight: _Straight,
    first: Frame,
    frames: Iterable[Frame],
    series: Path,
    order: ImportOrder,
    rates: Mapping[str, int],
    on_frames: Callable[[int], None] | None,
) -> None:
    """Writes the parts ``series-001.mcap`` and so on."""
    found = straight.found
    known = {one.id: one for one in described(order.nodes).values()}
    versions = {"hubside": __version__} | {one.id: one.version for one in known.values()}
    subject = Subject(
        recording=series.name,
        started_ns=first.t_ns,
        info=RecordingInfo(order.turbine, order.who, rates, dict(order.nodes), versions),
        origin=lambda: _origin(found),
        attachments=[
            AttachedFile(f"descriptions/{one.id}.json", "application/json", to_json(one).encode())
            for one in known.values()
        ],
    )
    tape = Tape(subject, lambda number: series.with_name(f"{series.name}-{number:03d}.mcap"), rotate=True)
    straight.on_step = tape.note
    found.taped = tape.write(chain((first,), frames), on_frames)


def _origin(found: Imported) -> dict[str, str]:
    """What is known so far: at the end of the file more than at its beginning."""
    notes = found.notes
    return origin_table(
        OriginKind.IMPORT,
        [found.source],
        wall=found.wall.value,
        beyond=found.beyond,
        moved=found.moved,
        clock_steps=found.clock_steps,
        skipped_lines=notes.skipped_lines,
        other={kind.value: count for kind, count in notes.other.items()},
        truncated=notes.truncated,
    )
