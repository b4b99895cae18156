"""Bus load of one CAN bus: share of the bit time that frames take, over a sliding second and second by second.

Not thread-safe: the thread that feeds it reads it, or the caller locks.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

SECOND_NS: Final = 1_000_000_000
_SLOT_NS: Final = 50_000_000
_SLOTS: Final = SECOND_NS // _SLOT_NS
EXTENDED_KEY: Final = 1 << 29
"""Added to a 29-bit identifier, to tell it from an 11-bit one."""


class LoadSecond(NamedTuple):
    """One full second of the past: ``second`` since the epoch of ``t_ns``, ``load`` 0..1, number of frames."""

    second: int
    load: float
    frames: int


class ShareSecond(NamedTuple):
    """Bits by CAN identifier in one full second; 29-bit identifiers have 2^29 added."""

    second: int
    bits: dict[int, int]


class BusLoad:
    """Load of a bus of ``bitrate`` bit/s; keeps ``history_s`` seconds, the shares of identifiers for ``shares_s``.

    Raises ValueError where the bit rate is not positive.
    """

    def __init__(self, bitrate: int, history_s: int = 3600, shares_s: int = 300) -> None:
        if bitrate <= 0:
            raise ValueError(f"bit rate {bitrate} is not positive")
        self.bitrate = bitrate
        self.history: deque[LoadSecond] = deque(maxlen=history_s)
        """Full seconds, oldest first; silent seconds between frames are in it with load 0."""
        self.share_history: deque[ShareSecond] = deque(maxlen=shares_s)
        """Full seconds in which there was traffic, oldest first."""
        self._second_ids: dict[int, int] = {}
        self._slots: deque[tuple[int, dict[int, int]]] = deque(maxlen=_SLOTS)
        self._slot = -1
        self._ids: dict[int, int] = {}
        self._second = -1
        self._second_bits = 0
        self._second_frames = 0

    def feed(self, t_ns: int, bits: int, can_id: int, extended: bool = False) -> None:
        """Count a frame of ``bits`` (see ``can_bits.frame_bits``) at ``t_ns``. Times must not run backwards."""
        slot = t_ns // _SLOT_NS
        if slot > self._slot:
            self._roll(slot, t_ns // SECOND_NS)
        key = can_id | EXTENDED_KEY if extended else can_id
        ids = self._ids
        ids[key] = ids.get(key, 0) + bits
        self._second_bits += bits
        self._second_frames += 1

    def load(self, now_ns: int) -> float:
        """Load of the last second before ``now_ns``, in steps of 50 ms; 1.0 is a full bus."""
        return sum(self._window(now_ns).values()) / self.bitrate

    def shares(self, now_ns: int) -> dict[int, float]:
        """The load by CAN identifier, greatest first; 29-bit identifiers have 2^29 added."""
        return self._share_of(self._window(now_ns))

    def shares_by(self, group: Callable[[int], int], now_ns: int) -> dict[int, float]:
        """The load by what ``group`` makes of an identifier (its node, say), greatest first."""
        return self._share_of(_grouped(self._window(now_ns), group))

    def history_by(self, group: Callable[[int], int]) -> list[tuple[int, dict[int, float]]]:
        """Full seconds with their load by ``group``, oldest first; seconds of silence are left out."""
        return [(second, self._share_of(_grouped(bits, group))) for second, bits in self.share_history]

    def _share_of(self, window: Mapping[int, int]) -> dict[int, float]:
        return {key: window[key] / self.bitrate for key in sorted(window, key=lambda k: -window[k])}

    def _window(self, now_ns: int) -> dict[int, int]:
        """Bits by identifier of the last full slots; the running one would read too low."""
        slot = now_ns // _SLOT_NS
        total: dict[int, int] = {}
        for number, ids in (*self._slots, (self._slot, self._ids)):
            if slot - _SLOTS <= number < slot:
                for key, bits in ids.items():
                    total[key] = total.get(key, 0) + bits
        return total

    def _roll(self, slot: int, second: int) -> None:
        if self._ids:
            self._slots.append((self._slot, self._ids))
            for key, bits in self._ids.items():
                self._second_ids[key] = self._second_ids.get(key, 0) + bits
            self._ids = {}
        self._slot = slot
        if second == self._second:
            return
        if self._second >= 0:
            load = self._second_bits / self.bitrate
            self.history.append(LoadSecond(self._second, load, self._second_frames))
            self.share_history.append(ShareSecond(self._second, self._second_ids))
            self._second_ids = {}
            first_silent = max(self._second + 1, second - (self.history.maxlen or 0))
            self.history.extend(LoadSecond(silent, 0.0, 0) for silent in range(first_silent, second))
        self._second, self._second_bits, self._second_frames = second, 0, 0


def _grouped(window: Mapping[int, int], group: Callable[[int], int]) -> dict[int, int]:
    total: dict[int, int] = {}
    for key, bits in window.items():
        name = group(key)
        total[name] = total.get(name, 0) + bits
    return total
