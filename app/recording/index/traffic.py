"""Traffic of each bus over time, and where it was silent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

import numpy as np

from app.recording.index.arrays import pack_arrays, unpack_arrays
from app.recording.index.content import Counts, Gap, GapKind, Load, Times

LOAD_SHIFT: Final = 26
"""Binary logarithm of the length of a bucket in ns: 67 ms."""
LOAD_PAGE_SHIFT: Final = LOAD_SHIFT + 10
SILENT_NS: Final = 1_000_000_000
SILENT_FACTOR: Final = 5


class LoadPage(NamedTuple):
    """Bits and frames in 1,024 buckets of a bus."""

    bus: str
    number: int
    data: bytes


class BusTraffic:
    """Counts the frames of one bus, in order of time."""

    def __init__(self, bus: str, start_ns: int, write: Callable[[LoadPage], None]) -> None:
        self.bus = bus
        self.frames = 0
        self._write = write
        self._page = -1
        self._bits = np.zeros(1 << 10, np.int64)
        self._counts = np.zeros(1 << 10, np.int64)
        self._last_ns = start_ns
        self._distances: Counter[int] = Counter()
        self._pauses: list[tuple[int, int]] = []

    def add(self, times: Times, bits: Counts) -> None:
        """More frames, with their length in bits."""
        if not len(times):
            return
        self.frames += len(times)
        self._measure(times)
        pages = times >> np.uint64(LOAD_PAGE_SHIFT)
        while len(times):
            page = int(pages[0])
            if page != self._page:
                self._close()
                self._page = page
            end = int(np.searchsorted(pages, np.uint64(page), "right"))
            places = ((times[:end] >> np.uint64(LOAD_SHIFT)) & np.uint64(1023)).astype(np.int64)
            self._bits += np.bincount(places, bits[:end], 1 << 10).astype(np.int64)
            self._counts += np.bincount(places, minlength=1 << 10)
            times, bits, pages = times[end:], bits[end:], pages[end:]

    def _measure(self, times: Times) -> None:
        distances = np.diff(times, prepend=np.uint64(min(self._last_ns, int(times[0]))))
        kinds, counts = np.unique(np.frexp(distances.astype(np.float64))[1], return_counts=True)
        self._distances.update(dict(zip(kinds.tolist(), counts.tolist(), strict=True)))
        for place in np.flatnonzero(distances > SILENT_NS).tolist():
            end_ns = int(times[place])
            self._pauses.append((end_ns - int(distances[place]), end_ns))
        self._last_ns = int(times[-1])

    def _close(self) -> None:
        if self._page >= 0:
            self._write(LoadPage(self.bus, self._page, pack_arrays(self._bits, self._counts)))
            self._bits = np.zeros(1 << 10, np.int64)
            self._counts = np.zeros(1 << 10, np.int64)

    def silences(self, end_ns: int) -> list[Gap]:
        """No more frames come before ``end_ns``: where none came for longer than the traffic explains.

        That is more than a second, and more than five times the usual distance of two frames.
        """
        self._close()
        pauses = [*self._pauses]
        if end_ns - self._last_ns > SILENT_NS:
            pauses.append((self._last_ns, end_ns))
        limit_ns = max(SILENT_NS, SILENT_FACTOR * self._usual_ns())
        return [
            Gap(GapKind.SILENCE, self.bus, from_ns, to_ns, {})
            for from_ns, to_ns in pauses
            if to_ns - from_ns > limit_ns
        ]

    def _usual_ns(self) -> int:
        """The median distance of two frames, rounded up to a power of two."""
        seen, half = 0, self._distances.total() / 2
        for kind in sorted(self._distances):
            seen += self._distances[kind]
            if seen >= half:
                return 1 << max(kind, 0)
        return 0


def load_of(
    bus: str, pages: Mapping[int, bytes], bit_rate: int | None, start_ns: int, end_ns: int, buckets: int
) -> Load:
    """The load of a bus in about so many buckets, from its pages by number."""
    first = start_ns >> LOAD_SHIFT
    count = max(1, (max(end_ns - 1, start_ns) >> LOAD_SHIFT) - first + 1)
    each = -(-count // max(1, buckets))
    whole = -(-count // each)
    bits, frames = np.zeros(whole * each, np.int64), np.zeros(whole * each, np.int64)
    for number, data in pages.items():
        at = (number << 10) - first
        for target, part in zip((bits, frames), unpack_arrays(data), strict=True):
            begin, end = max(at, 0), min(at + len(part), len(target))
            if begin < end:
                target[begin:end] = part[begin - at : end - at]
    bucket_ns = each << LOAD_SHIFT
    possible = float("nan") if not bit_rate else bit_rate * bucket_ns / 1e9
    t_ns = ((np.arange(whole, dtype=np.uint64) * np.uint64(each)) + np.uint64(first)) << np.uint64(LOAD_SHIFT)
    return Load(bus, t_ns, bucket_ns, bits.reshape(whole, each).sum(1) / possible, frames.reshape(whole, each).sum(1))
