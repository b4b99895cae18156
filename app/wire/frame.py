"""A frame: what crossed a wire, in which direction, on which bus, and when.

``t_ns`` orders everything: wall clock at the start plus the monotonic time since then, strictly increasing over all
buses (see ``Stamper``). Frames are named tuples: cheap enough to make by the ten thousand a second.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from threading import Lock
from typing import NamedTuple


class Direction(Enum):
    """``RX``: received by us; ``TX``: sent by us. The values have the same length on purpose."""

    RX = "rx"
    TX = "tx"


class Can(NamedTuple):
    """A classic CAN frame (ISO 11898-1). ``data`` has 0 to 8 bytes; a remote frame has a ``dlc`` and no data."""

    can_id: int
    data: bytes = b""
    extended: bool = False
    remote: bool = False
    error: bool = False
    dlc: int = -1

    @property
    def length(self) -> int:
        """The DLC: that of the frame where given, else the number of data bytes."""
        return len(self.data) if self.dlc < 0 else self.dlc


class Adu(NamedTuple):
    """A Modbus TCP application data unit, MBAP header included, on the connection ``link``."""

    data: bytes
    link: str = ""


class Fdl(NamedTuple):
    """A PROFIBUS FDL telegram, start to end delimiter."""

    data: bytes


Payload = Can | Adu | Fdl


class Frame(NamedTuple):
    """One frame on the bus ``bus``. Times in nanoseconds; ``t_adapter_ns`` is the adapter's own clock where known."""

    t_ns: int
    bus: str
    direction: Direction
    payload: Payload
    t_adapter_ns: int | None = None


STAMP_STEP_NS = 512
"""The step of ``t_ns``, a quarter of a bit at 500 kbit/s and finer than any host can stamp.

Being a power of two that divides a second, it leaves the low byte of a time stamp zero, in nanoseconds since the epoch
and in nanoseconds of the second alike, which takes two bytes a frame off a compressed recording.
"""


class Stamper:
    """Makes ``t_ns``: ``wall_ns`` at the start plus the monotonic time since, strictly increasing over all threads.

    Stamps are multiples of ``STAMP_STEP_NS``.

    ``monotonic_ns`` is the clock (passed in, never read here).
    """

    def __init__(self, wall_ns: int, monotonic_ns: Callable[[], int]) -> None:
        self._offset_ns = wall_ns - monotonic_ns()
        self._monotonic_ns = monotonic_ns
        self._last_ns = 0
        self._lock = Lock()

    def __call__(self) -> int:
        """The next time stamp in ns, later than any before."""
        with self._lock:
            now_ns = self._monotonic_ns() + self._offset_ns
            now_ns -= now_ns % STAMP_STEP_NS
            if now_ns <= self._last_ns:
                now_ns = self._last_ns + STAMP_STEP_NS
            self._last_ns = now_ns
            return now_ns

    def take_aged(self, ages_ns: Sequence[int]) -> list[int]:
        """Time stamps for what came so long before now each, in this order, each later than any before."""
        with self._lock:
            now_ns, last_ns, stamps = self._monotonic_ns() + self._offset_ns, self._last_ns, []
            for age_ns in ages_ns:
                t_ns = now_ns - age_ns
                t_ns -= t_ns % STAMP_STEP_NS
                last_ns = t_ns if t_ns > last_ns else last_ns + STAMP_STEP_NS
                stamps.append(last_ns)
            self._last_ns = last_ns
            return stamps
