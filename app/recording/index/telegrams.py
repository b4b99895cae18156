"""The traffic of buses whose messages are telegrams: when each came, and how long it was on the wire."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from app.recording.index.content import Counts, Times
from app.recording.reader import Recording
from app.wire.frame import Adu, Can, Fdl, Frame
from app.wire.modbus.adu import wire_bits
from app.wire.profibus import fdl


class TelegramTraffic(NamedTuple):
    """Telegrams of one bus by time, with their length in bits; 0 where that is not known."""

    bus: str
    t_ns: Times
    bits: Counts


def telegram_traffic(recording: Recording) -> Iterator[TelegramTraffic]:
    """All telegrams, some at a time; those of each bus in the order of time. What is damaged is noted and left out."""
    if recording.foreign:
        yield from _traffic(frame for frame in recording.frames() if not isinstance(frame.payload, Can))
        return
    for place in recording.telegram_chunks():
        try:
            found = recording.telegrams(place)
        except ValueError as error:
            recording.leave_out(place, str(error))
            continue
        yield from _traffic(found)


def _traffic(frames: Iterable[Frame]) -> Iterator[TelegramTraffic]:
    buses: defaultdict[str, list[Frame]] = defaultdict(list)
    for frame in frames:
        buses[frame.bus].append(frame)
    for bus, found in buses.items():
        times = np.fromiter((frame.t_ns for frame in found), np.uint64, len(found))
        yield TelegramTraffic(bus, times, np.fromiter(map(_bits, found), np.int64, len(found)))


def _bits(frame: Frame) -> int:
    payload = frame.payload
    if isinstance(payload, Adu):
        return wire_bits(len(payload.data))
    return fdl.wire_bits(len(payload.data)) if isinstance(payload, Fdl) else 0
