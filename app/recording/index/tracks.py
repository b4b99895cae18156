"""What the records of a recording say of each object: its values as numbers for plots, and when its RAM changed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

import numpy as np

from app.model.address import Address
from app.model.datatypes import DataType
from app.recording.index.arrays import finite, numbers_of, pack_arrays, to_numbers, unpack_arrays
from app.recording.index.bodies import IndexedObject
from app.recording.index.content import SOURCES, Change, SignalInfo, SignalKey
from app.recording.index.course import Descriptions
from app.recording.index.pages import Page, Pager, points
from app.wire.memory import Reading
from app.wire.records import (
    BootUpSeen,
    GapSeen,
    Outcome,
    Record,
    RestartSeen,
    SdoAccess,
    SdoSeen,
    Side,
    Source,
    ValueSeen,
)
from app.wire.sdo_follower import LOAD_INDEX, SAVE_INDEX

KEPT_CHANGES: Final = 1024
"""Of an object that changes more often than this, the index keeps no history: it is read from the frames."""
_NO_SOURCE: Final = 255


class Track:
    """One object of one node."""

    __slots__ = (
        "_broken_after", "_limit", "_pager", "_type", "breaks", "changes", "count", "datas", "dtype", "first_ns",
        "high", "history", "known", "last", "last_ns", "low", "number", "times",
    )  # fmt: skip

    def __init__(self, number: int, data_type: DataType | None, write: Callable[[Page], None], limit: int) -> None:
        self._type = data_type
        self._limit = limit
        self.number = number
        self.dtype = numbers_of(data_type)
        self._pager = None if self.dtype is None else Pager(number, write)
        self.times: list[int] = []
        self.datas: list[bytes] = []
        self.history: list[Change] = []
        self.breaks: list[int] = []
        self.last: bytes | None = None
        self.known: bytes | None = None
        self._broken_after = self.count = self.changes = self.first_ns = self.last_ns = 0
        self.low: int | float | None = None
        self.high: int | float | None = None

    def changed(self, t_ns: int, data: bytes, source: Source) -> None:
        """RAM holds something else than was known until now."""
        self.known = data
        if len(self.history) <= self._limit:
            self.history.append(Change(t_ns, data, source))

    def unknown(self, t_ns: int) -> None:
        """RAM is unknown from here."""
        if self.known is not None:
            self.known = None
            if len(self.history) <= self._limit:
                self.history.append(Change(t_ns, None, None))
        self.broken(t_ns)

    def broken(self, t_ns: int) -> None:
        """No line may cross this time."""
        values = self.count + len(self.times)
        if values > self._broken_after:
            self._broken_after = values
            self.breaks.append(t_ns)

    def flush(self) -> None:
        """Turn what came into numbers."""
        times, datas = self.times, self.datas
        if not times:
            return
        self.times, self.datas = [], []
        if not self.count:
            self.first_ns = times[0]
        self.count += len(times)
        self.last_ns = times[-1]
        if self._pager is None:
            return
        numbers, good = to_numbers(self._type, datas)
        moments, numbers = finite(np.array(times, np.uint64)[good], numbers)
        if len(numbers):
            low, high = numbers.min().item(), numbers.max().item()
            self.low = low if self.low is None else min(low, self.low)
            self.high = high if self.high is None else max(high, self.high)
            self._pager.add(points(moments, numbers))

    def indexed(self, key: SignalKey) -> IndexedObject:
        """What is known of the object."""
        info = SignalInfo(*key, self.count, self.first_ns, self.last_ns, self.low, self.high, self.changes)
        kept = len(self.history) <= self._limit
        return IndexedObject(self.number, key, info if self.count else None, self.dtype, kept)

    def finish(self) -> None:
        """No more values come."""
        self.flush()
        if self._pager is not None:
            self._pager.finish()


class Tracks:
    """All objects of a recording, each with at most ``limit`` changes. ``flush`` now and then, or memory grows."""

    def __init__(self, descriptions: Descriptions, write: Callable[[Page], None], limit: int = KEPT_CHANGES) -> None:
        self._limit = limit
        self._descriptions = descriptions
        self._write = write
        self.by_key: dict[SignalKey, Track] = {}

    def take(self, records: Iterable[Record]) -> None:
        """More records, in their order."""
        tracks = self.by_key
        for record in records:
            if isinstance(record, ValueSeen):
                t_ns, bus, node, address, data, source = record
                track = tracks.get((bus, node, address)) or self._track(bus, node, address)
                track.times.append(t_ns)
                track.datas.append(data)
                if data != track.last:
                    track.last = data
                    track.changes += 1
                if data != track.known and not _command(address, source):
                    track.changed(t_ns, data, source)
            elif isinstance(record, BootUpSeen | RestartSeen):
                self._all(record, Track.unknown)
            elif isinstance(record, GapSeen):
                self._all(record, Track.broken)
            elif isinstance(record, SdoSeen) and _unsure(record):
                key = record.bus, record.node, record.address
                if key in tracks:
                    tracks[key].unknown(record.t_ns)

    def _track(self, bus: str, node: int, address: Address) -> Track:
        description = self._descriptions.get((bus, node))
        entry = None if description is None else description.entries.get(address)
        track = Track(len(self.by_key), None if entry is None else entry.type, self._write, self._limit)
        self.by_key[bus, node, address] = track
        return track

    def _all(self, record: Record, act: Callable[[Track, int], None]) -> None:
        for (bus, node, _), track in self.by_key.items():
            if bus == record.bus and record.node in (0, node):
                act(track, record.t_ns)

    def told(self, key: SignalKey, t_ns: int, reading: Reading) -> None:
        """A keyframe of the recorder says what RAM holds."""
        track = self.by_key.get(key) or self._track(*key)
        if track.known != reading.data:
            track.changed(t_ns, reading.data, reading.source)

    def flush(self) -> None:
        """Turn what came into numbers."""
        for track in self.by_key.values():
            track.flush()

    def finish(self) -> None:
        """No more records come."""
        for track in self.by_key.values():
            track.finish()


def _command(address: Address, source: Source) -> bool:
    """A save or load command: the object does not hold what was written."""
    return address.major in (SAVE_INDEX, LOAD_INDEX) and source in (Source.SDO_WRITE, Source.PDO_RX)


def _unsure(seen: SdoSeen) -> bool:
    """A write of which nobody saw the end: the object may hold anything."""
    if seen.access is not SdoAccess.WRITE or seen.address.major in (SAVE_INDEX, LOAD_INDEX):
        return False
    return seen.outcome in (Outcome.LOST, Outcome.BROKEN) or seen.aborted_by is Side.CLIENT


def pack_history(history: list[Change]) -> bytes:
    """The changes of an object as bytes."""
    lengths = np.array([-1 if change.data is None else len(change.data) for change in history], np.int64)
    data = np.frombuffer(b"".join(change.data or b"" for change in history), np.uint8)
    sources = np.array(
        [_NO_SOURCE if change.source is None else SOURCES.index(change.source) for change in history], np.uint8
    )
    times = np.array([change.t_ns for change in history], np.uint64)
    return pack_arrays(np.diff(times, prepend=np.uint64(0)), lengths, sources, data)


def unpack_history(packed: bytes) -> list[Change]:
    """What ``pack_history`` got."""
    distances, lengths, sources, data = unpack_arrays(packed)
    times = np.cumsum(distances, dtype=np.uint64)
    whole, at, history = data.tobytes(), 0, []
    for t_ns, length, source in zip(times.tolist(), lengths.tolist(), sources.tolist(), strict=True):
        if length < 0:
            history.append(Change(t_ns, None, None))
        else:
            history.append(Change(t_ns, whole[at : at + length], SOURCES[source]))
            at += length
    return history
