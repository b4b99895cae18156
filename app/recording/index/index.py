"""An open index: what it tells of a recording without reading its frames. Any thread."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
import zstandard

from app.errors import RecordingError
from app.model.description import Bus
from app.recording.content import Event as Noted
from app.recording.content import Keyframe
from app.recording.index.arrays import unpack_arrays
from app.recording.index.bodies import load_event, load_gap, load_mark, load_noted, load_object, load_sign
from app.recording.index.content import Change, Gap, Load, Series, SignalInfo, SignalKey, Times
from app.recording.index.course import Descriptions, Mark
from app.recording.index.file import connect, whole
from app.recording.index.frames import history_of, values_of
from app.recording.index.keyframes import unpack_keyframe
from app.recording.index.near import NearFrames
from app.recording.index.pages import Column, Page
from app.recording.index.place import SCHEMA, fingerprint, in_cache, index_path
from app.recording.index.series import SeriesReader
from app.recording.index.tracks import unpack_history
from app.recording.index.traffic import LOAD_PAGE_SHIFT, load_of
from app.recording.node_table import (
    OrderTable,
    ServerTable,
    described,
    read_orders,
    read_protocols,
    read_servers,
)
from app.recording.reader import Recording
from app.wire.events import Event
from app.wire.signs import Sign

_FIRST, _LAST = 0, (1 << 63) - 1


class RecordingIndex:
    """The index of ``recording``, read only. Use as a context manager, or call ``close``.

    Its methods raise ``RecordingError`` where the file has been taken away or damaged since it was opened.
    """

    def __init__(self, recording: Path, path: Path) -> None:
        self.recording = recording
        self.path = path
        self._lock = Lock()
        self._near: NearFrames | None = None
        self._database = connect(path)
        try:
            self._meta = dict(self._rows("SELECT key, value FROM meta"))
            self.span_ns = int(self._meta["start_ns"]), int(self._meta["end_ns"])
            self.frames = int(self._meta["frames"])
            self.keyframes = int(self._rows("SELECT count(*) FROM keyframes")[0][0])
            self._read_objects()
        except BaseException:
            self.close()
            raise

    def _read_objects(self) -> None:
        rows = self._rows("SELECT n, body FROM objects ORDER BY n")
        self._objects = {one.key: one for one in (load_object(number, text) for number, text in rows)}

    def __enter__(self) -> RecordingIndex:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file. May be called twice."""
        with self._lock:
            self._database.close()

    @property
    def descriptions(self) -> Descriptions:
        """What the devices were taken for, as far as it is one of our own descriptions."""
        return described(json.loads(self._meta["described"]))

    @property
    def servers(self) -> ServerTable:
        """Where the nodes of Modbus TCP buses listened, by bus and node."""
        return read_servers(json.loads(self._meta.get("servers", "{}")))

    @property
    def orders(self) -> OrderTable:
        """What a site says of the process data of nodes on PROFIBUS, by bus and node."""
        return read_orders(json.loads(self._meta.get("orders", "{}")))

    @property
    def kinds(self) -> Mapping[str, Bus]:
        """What is spoken on each bus."""
        return read_protocols(json.loads(self._meta.get("kinds", "{}")))

    def made_of(self) -> str:
        """Fingerprint of the recording that it was made of."""
        return str(self._meta["made_of"])

    def events(self, start_ns: int | None = None, end_ns: int | None = None) -> Sequence[Event]:
        """All that the live state would have told, from ``start_ns`` on and before ``end_ns``."""
        return [load_event(text) for text in self._between("events", start_ns, end_ns)]

    def noted(self, start_ns: int | None = None, end_ns: int | None = None) -> Sequence[Noted]:
        """What the recorder noted."""
        return [load_noted(text) for text in self._between("noted", start_ns, end_ns)]

    def signs(self, start_ns: int | None = None, end_ns: int | None = None) -> Sequence[Sign]:
        """What tells of a trip, by time."""
        return [load_sign(text) for text in self._between("signs", start_ns, end_ns)]

    def marks(self, start_ns: int | None = None, end_ns: int | None = None) -> Sequence[Mark]:
        """What acts on the state beside frames (see ``course``)."""
        return [load_mark(text) for text in self._between("marks", start_ns, end_ns)]

    def gaps(self) -> Sequence[Gap]:
        """All gaps by time."""
        return [load_gap(text) for (text,) in self._rows("SELECT body FROM gaps ORDER BY n")]

    def signals(self) -> Sequence[SignalInfo]:
        """Every object of which values crossed the wire."""
        return [one.info for one in self._objects.values() if one.info is not None]

    def series(self, signal: SignalKey, start_ns: int, end_ns: int, max_points: int = 2000) -> Series:
        """A signal from ``start_ns`` on and before ``end_ns``, in at most ``max_points`` points or buckets (and one).

        Empty where the object was not seen or is no number.
        """
        one = self._objects.get((signal[0], signal[1], signal[2]))
        number, dtype = (-1, "<i8") if one is None or one.dtype is None else (one.number, one.dtype)

        def pages(level: int, first: int, last: int) -> list[Page]:
            query = "SELECT * FROM pages WHERE signal = ? AND level = ? AND number BETWEEN ? AND ? ORDER BY number"
            return [Page(*row) for row in self._rows(query, number, level, first, last)]

        def counts(first: int, last: int) -> int:
            query = "SELECT total(count) FROM pages WHERE signal = ? AND level = 0 AND number BETWEEN ? AND ?"
            return int(self._rows(query, number, first, last)[0][0])

        def from_frames(first_ns: int, beyond_ns: int) -> Column:
            return values_of(self, signal, first_ns, beyond_ns)

        values = 0 if one is None or one.info is None else one.info.count
        reader = SeriesReader(pages, counts, from_frames, dtype, values)
        try:
            return reader.read(start_ns, max(end_ns, start_ns + 1), max(1, max_points), self.breaks(*signal))
        except (zstandard.ZstdError, ValueError) as error:
            raise RecordingError(file=self.path.name, offset=0, reason=str(error)) from error

    def history(self, bus: str, node: int, address: Any) -> Sequence[Change]:
        """When RAM of an object changed, by time."""
        one = self._objects.get((bus, node, address))
        if one is None:
            return []
        if not one.kept:
            return history_of(self, one.key)
        ((history,),) = self._rows("SELECT history FROM objects WHERE n = ?", one.number)
        return list(self._unpacked(unpack_history, history))

    def load(self, start_ns: int | None = None, end_ns: int | None = None, buckets: int = 1000) -> Sequence[Load]:
        """Traffic of every bus in at most ``buckets`` stretches, none shorter than 67 ms."""
        begin = self.span_ns[0] if start_ns is None else start_ns
        end = self.span_ns[1] + 1 if end_ns is None else max(end_ns, begin + 1)
        found = []
        for bus in sorted(key.removeprefix("bit_rate/") for key in self._meta if key.startswith("bit_rate/")):
            limits = begin >> LOAD_PAGE_SHIFT, end >> LOAD_PAGE_SHIFT
            query = "SELECT number, data FROM load WHERE bus = ? AND number BETWEEN ? AND ?"
            rate = int(self._meta[f"bit_rate/{bus}"])
            found.append(load_of(bus, dict(self._rows(query, bus, *limits)), rate, begin, end, buckets))
        return found

    def keyframe(self, t_ns: int) -> Keyframe | None:
        """The last state at or before ``t_ns``."""
        query = """SELECT k.t_ns, k.data, b.data FROM keyframes k LEFT JOIN keyframes b
                   ON b.t_ns = k.base_ns AND k.base_ns != k.t_ns WHERE k.t_ns <= ? ORDER BY k.t_ns DESC LIMIT 1"""
        for at_ns, data, base in self._rows(query, t_ns):
            return Keyframe(at_ns, self._unpacked(partial(unpack_keyframe, whole=base), data))
        return None

    def near(self, recording: Recording) -> NearFrames:
        """Frames of ``recording``, which is the one of this index, open. For one thread at a time."""
        if self._near is None or self._near.recording is not recording:
            self._near = NearFrames(recording)
        return self._near

    def breaks(self, bus: str, node: int, address: Any) -> Times:
        """When what was known of an object ceased to hold."""
        one = self._objects.get((bus, node, address))
        if one is None:
            return np.zeros(0, np.uint64)
        ((packed,),) = self._rows("SELECT breaks FROM objects WHERE n = ?", one.number)
        times: Times = self._unpacked(unpack_arrays, packed)[0].astype(np.uint64)
        return times

    def _between(self, table: str, start_ns: int | None, end_ns: int | None) -> Iterator[str]:
        query = f"SELECT body FROM {table} WHERE t_ns >= ? AND t_ns < ? ORDER BY t_ns, n"
        limits = (_FIRST if start_ns is None else start_ns, _LAST if end_ns is None else end_ns)
        return (text for (text,) in self._rows(query, *limits))

    def _rows(self, query: str, *values: Any) -> list[tuple[Any, ...]]:
        try:
            with self._lock:
                return self._database.execute(query, values).fetchall()
        except sqlite3.Error as error:
            raise RecordingError(file=self.path.name, offset=0, reason=str(error)) from error

    def _unpacked(self, unpack: Any, packed: bytes) -> Any:
        try:
            return unpack(packed)
        except (zstandard.ZstdError, ValueError) as error:
            raise RecordingError(file=self.path.name, offset=0, reason=str(error)) from error


def open_index(recording: Path, cache: Path | None = None) -> RecordingIndex | None:
    """The index of a recording; None where there is none, or one that is damaged, stale or of another schema."""
    places = [index_path(recording, cache)]
    if cache is not None:
        places.append(in_cache(recording, cache))
    for place in dict.fromkeys(places):
        opened = _opened(recording, place)
        if opened is not None:
            return opened
    return None


def _opened(recording: Path, place: Path) -> RecordingIndex | None:
    if not whole(place):
        return None
    try:
        index = RecordingIndex(recording, place)
    except (sqlite3.Error, RecordingError, KeyError, ValueError, TypeError):
        return None
    try:
        if index._meta.get("schema") == str(SCHEMA) and index.made_of() == fingerprint(recording):
            return index
    except OSError:
        pass
    index.close()
    return None
