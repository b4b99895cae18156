"""A recording that is replayed: its file, its index, and whose frames they are."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from threading import Lock
from typing import Final

from app.errors import RecordingError
from app.model.description import Bus
from app.model.servers import MODBUS
from app.model.site import BusConfig, Device, Station, Turbine
from app.model.slaves import PROFIBUS
from app.recording.content import Event, Keyframe
from app.recording.index import Mark, NearFrames, RecordingIndex, marks_of, open_index
from app.recording.node_table import read_nodes
from app.recording.reader import Recording, open_recording
from app.recording.schemas import FIXED_TOPICS
from app.wire.frame import Frame

FIRST_WINDOW_NS: Final = 1_000_000_000
WINDOW_NS: Final = 16_000_000_000
"""Frames are fetched by so much: a chunk of an archive holds minutes, of which a seek wants a second."""
KEYFRAME_EVERY_NS: Final = 6_000_000_000
"""A recording of ours has a keyframe at least as often."""
_USUAL_BITRATE: Final = 500_000
_LOOK_BACK: Final = (KEYFRAME_EVERY_NS, 60_000_000_000, None)


class Source:
    """An open recording. Frames and keyframes are for one thread; all else is fixed.

    ``known`` are turbines of which names are known, by slug; ``cache`` is where an index may lie whose recording is in
    a folder that cannot be written. Raises RecordingError where the file cannot be read or holds no frames.
    """

    def __init__(self, path: Path, known: Mapping[str, Turbine], cache: Path | None = None) -> None:
        self.path = path
        self.cache = cache
        self._lock = Lock()
        self._closed = False
        stat = path.stat()
        self.made_of = stat.st_size, stat.st_mtime_ns
        """Of the file that was opened: another one may take its name."""
        self._recording = open_recording(path)
        try:
            span = self._recording.span_ns
            if span is None:
                raise RecordingError(file=path.name, offset=0, reason="no frames in it")
            self.from_ns, self.to_ns = span
            self._near = NearFrames(self._recording)
            self.turbine = turbine_of(self._recording, known)
            self.descriptions = self._recording.descriptions
            self.kinds = self._recording.kinds
            self.orders = self._recording.orders
            self.events = tuple(self._recording.events())
            first = next(self._recording.keyframes(), None)
            self._recording.keep()
            self.marks: Sequence[Mark] = marks_of(self.events, first, self.from_ns, self.to_ns)
        except BaseException:
            self._recording.close()
            raise
        self.index: RecordingIndex | None = None
        self._take(open_index(path, cache))

    @property
    def name(self) -> str:
        """The file's name without its ending: names the replay."""
        return self.path.name.removesuffix(".mcap")

    @property
    def damages(self) -> int:
        """Places of the file that could not be read, as far as they were met."""
        return len(self._recording.damages)

    def look_for_index(self) -> None:
        """Take the index that has been made meanwhile."""
        with self._lock:
            if self.index is None and not self._closed:
                self._take(open_index(self.path, self.cache))

    def _take(self, index: RecordingIndex | None) -> None:
        if index is not None:
            self.marks = index.marks()  # it also knows what is damaged in the middle of the file
            self.index = index

    def close(self) -> None:
        """Close file and index."""
        self._recording.close()
        with self._lock:
            self._closed = True
            if self.index is not None:
                self.index.close()

    def keyframe(self, t_ns: int) -> Keyframe | None:
        """The last one at or before ``t_ns``; None where everything from the beginning has to be read."""
        if self.index is not None:
            return self.index.keyframe(t_ns)
        for back_ns in _LOOK_BACK:
            kept = self._recording.keyframes(None if back_ns is None else t_ns - back_ns, t_ns + 1)
            found = next(iter(deque(kept, maxlen=1)), None)
            if found is not None or (back_ns is not None and t_ns - back_ns <= self.from_ns):
                return found
        return None

    def frames(self, start_ns: int, end_ns: int | None = None) -> Iterator[Frame]:
        """The frames of all buses by time, from ``start_ns`` on and before ``end_ns``."""
        if self._recording.foreign:
            yield from self._recording.frames(start_ns, end_ns)
            return
        begin, end, window_ns = start_ns, self.to_ns + 1 if end_ns is None else end_ns, FIRST_WINDOW_NS
        while begin < end:
            until = min(begin + window_ns, end)
            yield from self._near.between(begin, until)
            begin, window_ns = until, min(2 * window_ns, WINDOW_NS)

    def events_from(self, start_ns: int) -> tuple[Event, ...]:
        """What the recorder noted, from ``start_ns`` on."""
        return self.events[bisect_left(self.events, start_ns, key=attrgetter("t_ns")) :]


def turbine_of(recording: Recording, known: Mapping[str, Turbine]) -> Turbine:
    """The turbine as the recording tells it; names and places of blades by what is known of it."""
    info = recording.info
    named = known.get(info.turbine)
    stations: dict[str, list[Device]] = {}
    for (bus, node), (slug, description_id) in read_nodes(info.nodes).items():
        if slug.count("/") != 2:
            continue
        other = None if named is None else named.device(slug)
        name = slug.rpartition("/")[2].upper() if other is None else other.name
        at = info.servers.get(f"{bus}/{node}", "")
        stations.setdefault(slug.rpartition("/")[0], []).append(Device(slug, name, description_id, bus, node, at))
    buses = [topic[1:] for topic in recording.topics if topic not in FIXED_TOPICS]
    configs = tuple(_config(bus, recording.kinds.get(bus), info.bit_rates.get(bus, _USUAL_BITRATE)) for bus in buses)
    slug = info.turbine or recording.path.stem
    name = slug.upper() if named is None else named.name
    return Turbine(slug, name, configs, tuple(_station(one, devices, named) for one, devices in stations.items()))


def _config(bus: str, kind: Bus | None, bitrate: int) -> BusConfig:
    if kind is Bus.MODBUS_TCP:
        return BusConfig(bus, MODBUS, 0)
    # Of a recorded line no port is known.
    return BusConfig(bus, PROFIBUS if kind is Bus.PROFIBUS_DP else "", bitrate)


def _station(slug: str, devices: list[Device], named: Turbine | None) -> Station:
    other = None if named is None else next((one for one in named.stations if one.slug == slug), None)
    if other is not None:
        return Station(slug, other.name, other.blade, tuple(devices))
    last = slug.rpartition("/")[2]
    kind, _, number = last.rpartition("-")
    blade = int(number) if kind == "blade" and number in ("1", "2", "3") else None
    return Station(slug, last.replace("-", " ").capitalize(), blade, tuple(devices))
