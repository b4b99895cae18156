"""What an index tells: gaps, signals, series for plots, bus load. Times in ns since 1970, values raw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from app.model.address import Address
from app.wire.records import Source

Times = npt.NDArray[np.uint64]
Numbers = npt.NDArray[np.int64] | npt.NDArray[np.uint64] | npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]
SignalKey = tuple[str, int, Address]
"""Bus, node, address."""

SOURCES: Final = tuple(Source)


class GapKind(Enum):
    """Why a recording does not hold everything, or why what was known no longer holds.

    SILENCE: no frame on a bus for longer than its traffic explains. LOSS: frames that were counted and not kept.
    CLOCK_STEP: the wall clock was set. BUS_LOST: no connection to the bus. RESTART: a node or the recorder began
    anew. DAMAGE: bytes of the file that cannot be read.
    """

    SILENCE = "silence"
    LOSS = "loss"
    CLOCK_STEP = "clock_step"
    BUS_LOST = "bus_lost"
    RESTART = "restart"
    DAMAGE = "damage"

    @property
    def text_key(self) -> str:
        """Text key of its name."""
        return f"gap_kind.{self.value}"


class Gap(NamedTuple):
    """A gap from ``from_ns`` to ``to_ns``, equal where it is an instant. ``bus`` is empty where it concerns all.

    ``details`` are plain JSON: LOSS ``count``, ``reason``; CLOCK_STEP ``step_ns``; RESTART ``node``, or ``part`` or
    ``reason`` of the recorder; DAMAGE ``offset``, ``length`` in bytes and ``detail``; BUS_LOST ``ended`` false where
    the bus did not come back before the end.
    """

    kind: GapKind
    bus: str
    from_ns: int
    to_ns: int
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class SignalInfo:
    """One object of a node of which values crossed the wire: how many, when, and how far they went.

    ``low`` and ``high`` are raw numbers, None where the object is no number (a text, bytes). ``changes`` counts the
    values that differ from the one before.
    """

    bus: str
    node: int
    address: Address
    count: int
    first_ns: int
    last_ns: int
    low: int | float | None
    high: int | float | None
    changes: int


class SeriesKind(Enum):
    """POINTS: every value as it came. BUCKETS: least and greatest of all values in stretches of equal length."""

    POINTS = "points"
    BUCKETS = "buckets"


@dataclass(frozen=True, slots=True)
class Series:
    """A signal over time, for a plot. All arrays have one item a point or a bucket; empty buckets are left out.

    A bucket holds the values from ``t_ns`` on and before ``t_ns + bucket_ns``; the outer ones may reach over the ends
    that were asked for. Of points ``low`` and ``high`` are the same, ``count`` is 1 and ``bucket_ns`` 0.

    At each time in ``breaks`` what was known before ceased to hold (the node restarted, a write of unknown end, frames
    are missing): no line may cross it.
    """

    kind: SeriesKind
    t_ns: Times
    low: Numbers
    high: Numbers
    count: Counts
    bucket_ns: int
    breaks: Times


class Load(NamedTuple):
    """Traffic of a bus in stretches of ``bucket_ns`` from each ``t_ns`` on; all stretches, silent ones too.

    ``share`` is the part of the bit time that frames took, 0 to 1, NaN where the bit rate is not known.
    """

    bus: str
    t_ns: Times
    bucket_ns: int
    share: npt.NDArray[np.float64]
    frames: Counts


class Change(NamedTuple):
    """RAM of an object from ``t_ns`` on; ``data`` None: unknown from here."""

    t_ns: int
    data: bytes | None
    source: Source | None


class IndexedError(Exception):
    """Base of what goes wrong with an index. Kept inside: a caller gets none, or a recording error."""


class CancelledError(IndexedError):
    """Whoever asked for the index no longer wants it. Nothing is left behind."""
