"""The frames between two times that are not far apart, without looking at the rest of a long recording."""

from __future__ import annotations

from collections.abc import Iterator
from operator import itemgetter
from typing import Final

import numpy as np

from app.recording.cdr import can_dtype, decode_can, frame_id, make_can
from app.recording.chunks import ANY_CHANNEL, ChunkPlace
from app.recording.columns import can_columns
from app.recording.reader import Recording
from app.recording.schemas import FIXED_TOPICS
from app.wire.frame import Direction, Frame

_TIME: Final = itemgetter(0)


class NearFrames:
    """Finds frames in ``recording``. One thread."""

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        self._places = [] if recording.foreign else sorted(recording.can_chunks())
        self._starts = np.array([place.start_ns for place in self._places], np.uint64)
        ends = np.array([place.end_ns for place in self._places], np.uint64)
        self._ends = np.maximum.accumulate(ends) if len(ends) else ends
        known = [place.channel_id for place in self._places if place.channel_id != ANY_CHANNEL]
        buses = {recording.channels[number].topic for number in set(known)}
        others = {topic for topic, count in recording.topics.items() if count and topic not in FIXED_TOPICS} - buses
        self._plain = not recording.foreign and not others and len(known) == len(self._places)

    def all(self) -> Iterator[Frame]:
        """All frames. Those of a single bus need no merging."""
        if not self._plain or len({place.channel_id for place in self._places}) != 1:
            yield from self.recording.frames()
            return
        for columns in can_columns(self.recording, workers=1):
            data = columns.data.tobytes()
            rest = (columns.tx, columns.can_id, columns.extended, columns.remote, columns.error, columns.dlc)
            rows = zip(
                columns.t_ns.tolist(), *(column.tolist() for column in rest), range(0, len(data), 8), strict=True
            )
            for t_ns, sent, can_id, extended, remote, error, dlc, at in rows:
                can = make_can(can_id, data[at : at + 8], extended, remote, error, dlc)
                yield Frame(t_ns, columns.bus, Direction.TX if sent else Direction.RX, can)

    def between(self, start_ns: int, end_ns: int) -> Iterator[Frame]:
        """The frames from ``start_ns`` on and before ``end_ns``, as ``Recording.frames`` gives them."""
        first = int(np.searchsorted(self._ends, np.uint64(max(0, start_ns))))
        beyond = int(np.searchsorted(self._starts, np.uint64(max(0, end_ns))))
        found: list[Frame] = []
        if not self._plain:
            return self.recording.frames(start_ns, end_ns)
        for place in self._places[first:beyond]:
            frames = self._cut(place, start_ns, end_ns)
            if frames is None:  # something that is not of our form, or damaged
                return self.recording.frames(start_ns, end_ns)
            found += frames
        found.sort(key=_TIME)
        return iter(found)

    def _cut(self, place: ChunkPlace, start_ns: int, end_ns: int) -> list[Frame] | None:
        bus = self.recording.channels[place.channel_id].topic[1:]
        layout = can_dtype(bus)
        try:
            data = self.recording.unpacked(place)
        except ValueError:
            return None
        if len(data) % layout.itemsize:
            return None
        records = np.frombuffer(data, layout)
        known = [frame_id(bus, direction).encode() for direction in Direction]
        if not (records["length"] == layout.itemsize - 9).all() or not np.isin(records["frame_id"], known).all():
            return None
        times = records["log_time"]
        return list(decode_can(bus, records[(times >= np.uint64(start_ns)) & (times < np.uint64(end_ns))]))
