"""Values of objects on buses whose messages are telegrams: each is decoded, as they have no form of one size."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from itertools import groupby
from typing import Final

import numpy as np

from app.model.address import Address
from app.recording.columns.blocks import Span
from app.recording.columns.values import Gathered
from app.recording.reader import Recording
from app.wire.decoders import BusDecoder
from app.wire.frame import Frame
from app.wire.records import ValueSeen

_WORD: Final = 8


def telegram_values(
    recording: Recording, decoder: BusDecoder, wanted: Collection[tuple[int, Address]], span: Span
) -> dict[tuple[int, Address], Gathered]:
    """What ``decoder`` sees of the ``wanted`` objects (node, address) on its bus within ``span``."""
    found = {place: Gathered() for place in wanted}
    for frames in _telegrams(recording, decoder.bus, span):
        seen: defaultdict[tuple[int, Address], list[tuple[int, ValueSeen]]] = defaultdict(list)
        for row, record in enumerate(decoder.feed_all(frames)):
            if isinstance(record, ValueSeen) and (record.node, record.address) in found:
                seen[record.node, record.address].append((row, record))
        for place, values in seen.items():
            _gather(found[place], values)
    return found


def _telegrams(recording: Recording, bus: str, span: Span) -> Iterator[list[Frame]]:
    """Those of one bus, some at a time; what is damaged is noted and left out."""
    for place in recording.telegram_chunks((bus,)):
        if not span.touches(place):
            continue
        try:
            frames = recording.telegrams(place)
        except ValueError as error:
            recording.leave_out(place, str(error))
            continue
        yield [
            frame
            for frame in frames
            if (span.start_ns is None or frame.t_ns >= span.start_ns)
            and (span.end_ns is None or frame.t_ns < span.end_ns)
        ]


def _gather(gathered: Gathered, values: Sequence[tuple[int, ValueSeen]]) -> None:
    """Values of one object, with the rows that tell their order."""
    for row, value in values:
        if len(value.data) > _WORD:
            gathered.add_one(row, value.t_ns, value.data, value.source)
    short = [(row, value) for row, value in values if len(value.data) <= _WORD]
    by_source = sorted(short, key=lambda one: one[1].source.value)
    for source, group in groupby(by_source, key=lambda one: one[1].source):
        rows, seen = zip(*group, strict=True)
        gathered.add(
            np.array(rows, np.intp),
            np.array([one.t_ns for one in seen], np.uint64),
            np.array([int.from_bytes(one.data, "little") for one in seen], np.uint64),
            np.array([len(one.data) for one in seen], np.uint8),
            source,
        )
    gathered.next_block()
