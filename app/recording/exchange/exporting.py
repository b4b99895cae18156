"""Writes the frames of a recording in a format of others, and tells before what that format cannot hold.

pcapng takes ADUs of Modbus TCP and telegrams of PROFIBUS, all others take CAN frames.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

from app.errors import RecordingError, UsageError
from app.model.description import Bus
from app.recording.content import METADATA_BIT_RATES
from app.recording.exchange.asc import asc_lines
from app.recording.exchange.blf import write_blf
from app.recording.exchange.candump import candump_lines
from app.recording.exchange.csv_lines import csv_lines
from app.recording.exchange.draft import drafted
from app.recording.exchange.formats import Format, Head, Loss, Lost, Style, held, lost_parts
from app.recording.exchange.pcapng import write_pcapng
from app.recording.exchange.trc import trc_lines
from app.recording.reader import Recording
from app.recording.schemas import CAN_FRAME, CLOCK_TOPIC, EVENTS_TOPIC, STATE_TOPIC, TELEGRAM, MessageType
from app.wire.frame import Frame

_TOLD_EVERY: Final = 10_000
_HOLDS: Final = {
    False: ("telegrams of Modbus TCP and PROFIBUS", "pcapng"),
    True: ("CAN frames", "candump, asc, blf, trc or csv"),
}
"""What a format cannot hold, and which one can; True: of pcapng."""
_LINES: Final[dict[Format, Callable[[Head, Iterable[Frame], Style], Iterator[str]]]] = {
    Format.CANDUMP: candump_lines,
    Format.ASC: asc_lines,
    Format.TRC: trc_lines,
    Format.CSV: csv_lines,
}


@dataclass(frozen=True, slots=True)
class Choice:
    """What of a recording is exported: buses (None: all) and a time range in ns, the end not included."""

    into: Format
    style: Style = Style.COMMON
    buses: Collection[str] | None = None
    start_ns: int | None = None
    end_ns: int | None = None


class Exported(NamedTuple):
    """What was written."""

    frames: int
    size_bytes: int
    channels: tuple[str, ...]


def chosen_frames(recording: Recording, choice: Choice) -> Iterator[Frame]:
    """The frames of a choice by time."""
    for frame in recording.frames(choice.start_ns, choice.end_ns):
        if choice.buses is None or frame.bus in choice.buses:
            yield frame


def losses(recording: Recording, choice: Choice) -> tuple[Loss, ...]:
    """What the format cannot hold of what is chosen, counted: every frame is looked at."""
    counts: Counter[Lost] = Counter()
    if choice.into is not Format.MCAP:
        for frame in chosen_frames(recording, choice):
            counts.update(lost_parts(frame, held(frame, choice.into, choice.style)))
        topics = recording.topics
        for what, topic in ((Lost.EVENTS, EVENTS_TOPIC), (Lost.CLOCKS, CLOCK_TOPIC), (Lost.STATES, STATE_TOPIC)):
            counts[what] = topics.get(topic, 0)
        counts[Lost.ATTACHMENTS] = sum(1 for _ in recording.attachment_records())
        counts[Lost.NODES] = len(recording.metadata.get("nodes", {}))
    return tuple(Loss(what, counts[what]) for what in Lost if counts[what])


def can_buses(recording: Recording) -> tuple[str, ...]:
    """The CAN buses of which there are messages, in the order of their topics."""
    return _buses_of(recording, CAN_FRAME)


def telegram_buses(recording: Recording) -> tuple[str, ...]:
    """The buses of Modbus TCP and the PROFIBUS lines of which there are messages."""
    with_servers = {bus for bus, _ in recording.servers}
    return tuple(bus for bus in _buses_of(recording, TELEGRAM) if bus in with_servers or bus in _lines(recording))


def _lines(recording: Recording) -> set[str]:
    """Those that are PROFIBUS."""
    return {bus for bus, kind in recording.kinds.items() if kind is Bus.PROFIBUS_DP}


def _buses_of(recording: Recording, message: MessageType) -> tuple[str, ...]:
    counts = recording.topics
    names = [
        channel.topic[1:]
        for channel in recording.channels.values()
        if channel.schema_id in recording.schemas
        and recording.schemas[channel.schema_id].name == message.name
        and counts.get(channel.topic)
    ]
    return tuple(dict.fromkeys(names))


def export(
    recording: Recording, path: Path, choice: Choice, on_frames: Callable[[int], None] | None = None
) -> Exported:
    """Writes ``path``, which must not exist; it appears only when it is complete.

    Raises UsageError where there is no bus of that name or the format is MCAP, RecordingError where a file cannot be
    read or written.
    """
    if choice.into is Format.MCAP:
        raise UsageError(reason="MCAP is cut, not exported")
    buses = _buses(recording, choice)
    try:
        with drafted(path) as draft:
            count = _write(recording, draft, choice, buses, on_frames)
        return Exported(count, path.stat().st_size, buses)
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error


def _buses(recording: Recording, choice: Choice) -> tuple[str, ...]:
    there, others = can_buses(recording), telegram_buses(recording)
    if choice.into is Format.PCAPNG:
        there, others = others, there
    if others and not there:
        holds, better = _HOLDS[choice.into is Format.PCAPNG]
        raise UsageError(reason=f"{choice.into.value} cannot hold {holds}, and there is nothing else: take {better}")
    if choice.buses is None:
        return there
    for bus in choice.buses:
        if bus not in there:
            known = ", ".join(there) or "none"
            raise UsageError(reason=f"no bus '{bus}' in it that {choice.into.value} can hold (there are: {known})")
    return tuple(bus for bus in there if bus in choice.buses)


def _write(
    recording: Recording,
    path: Path,
    choice: Choice,
    buses: tuple[str, ...],
    on_frames: Callable[[int], None] | None,
) -> int:
    first_ns = next((frame.t_ns for frame in chosen_frames(recording, choice)), 0)
    table = recording.metadata.get(METADATA_BIT_RATES, {})
    head = Head(first_ns, buses, {bus: int(table[bus]) for bus in buses if table.get(bus, "").isdecimal()})
    counter = _Counter(on_frames)
    frames = counter(chosen_frames(recording, choice), choice)
    if choice.into is Format.PCAPNG:
        write_pcapng(path, head, frames, _lines(recording))
    elif choice.into is Format.BLF:
        write_blf(path, head, frames)
    else:
        with path.open("x", encoding="utf-8", newline="") as file:
            file.writelines(_LINES[choice.into](head, frames, choice.style))
    return counter.count


class _Counter:
    """Counts the frames that a format takes, as far as it holds them, and tells now and then."""

    def __init__(self, on_frames: Callable[[int], None] | None) -> None:
        self.count = 0
        self._on_frames = on_frames

    def __call__(self, frames: Iterator[Frame], choice: Choice) -> Iterator[Frame]:
        for frame in frames:
            left = held(frame, choice.into, choice.style)
            if left is None:
                continue
            self.count += 1
            if self._on_frames is not None and self.count % _TOLD_EVERY == 0:
                self._on_frames(self.count)
            yield left
