"""A capture as it is kept: what was asked for, what came, who did it, and the parameter values that were in force."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from decimal import Decimal
from typing import Any

import numpy as np
import numpy.typing as npt

from app.recording.index.arrays import pack_arrays, unpack_arrays
from app.service.scope.order import ScopeOrder, TriggerOrder

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class KeptSignal:
    """A signal of a capture. ``count`` values, ``by_pdo`` of them by a PDO; ``scaled = raw x scale`` in ``unit``."""

    name: str
    device: str
    bus: str
    title: str
    bit: int | None
    bit_key: str | None
    unit: str
    scale: str
    count: int
    by_pdo: int


@dataclass(frozen=True, slots=True)
class KeptMark:
    """Something that happened. ``device`` None: it is about a whole bus. ``detail`` as in ``engine.Mark``."""

    t_ns: int
    what: str
    bus: str
    device: str | None
    detail: str


@dataclass(frozen=True, slots=True)
class KeptDevice:
    """Who a device was, as far as it had said; ``values`` parameters were known of it, ``unknown`` not."""

    device: str
    description_id: str
    description_version: str
    device_name: str | None
    serial: int | None
    software: str | None
    values: int
    unknown: int


@dataclass(frozen=True, slots=True)
class InForce:
    """A value that stood in RAM at the trigger. ``stored`` None: what non-volatile memory holds was not known.

    ``stale``: frames had been lost since it was seen. ``raw`` is the raw value as text.
    """

    device: str
    address: str
    title: str
    raw: str
    shown: str
    unit: str
    name_key: str | None
    stale: bool
    stored: str | None
    parameter: bool


@dataclass(frozen=True, slots=True)
class Head:
    """All of a capture but its values. Times are t_ns; ``known_ns``: from here on all was seen.

    ``recording`` is the file that was written at the trigger, None where nothing was recorded.
    """

    id: str
    name: str
    note: str
    person: str
    turbine: str
    turbine_name: str
    cause: str
    ended: str
    trigger_ns: int
    start_ns: int
    end_ns: int
    known_ns: int
    made_ns: int
    order: ScopeOrder
    signals: tuple[KeptSignal, ...]
    marks: tuple[KeptMark, ...]
    devices: tuple[KeptDevice, ...]
    recording: str | None
    twin: bool
    size_bytes: int

    def signal(self, name: str) -> int | None:
        """The place of a signal, or None."""
        return next((at for at, one in enumerate(self.signals) if one.name == name), None)


@dataclass(frozen=True, slots=True)
class CaptureLine:
    """A capture in the list of all. Not ``kept``: it goes with the next one, or with the server."""

    id: str
    name: str
    note: str
    person: str
    turbine: str
    turbine_name: str
    cause: str
    ended: str
    trigger_ns: int
    signals: int
    kept: bool


@dataclass(frozen=True, slots=True)
class Values:
    """The values of one signal by time, raw."""

    t_ns: npt.NDArray[np.int64]
    raw: npt.NDArray[Any]

    def t_s(self, zero_ns: int) -> Floats:
        """Seconds since ``zero_ns``."""
        return (self.t_ns - zero_ns) / 1e9

    def scaled(self, scale: str) -> Floats:
        """In the signal's unit; by division where the scale is one over an integer, which gives the nearest number."""
        step = Decimal(scale)
        if step and (1 / step) == (1 / step).to_integral_value():
            return np.asarray(self.raw.astype(np.float64) / float(1 / step))
        return np.asarray(self.raw.astype(np.float64) * float(step))


@dataclass(frozen=True, slots=True)
class Capture:
    """A whole capture."""

    head: Head
    values: tuple[Values, ...]

    def breaks_s(self, signal: int) -> list[float]:
        """Where the line of a signal is broken: at gaps, and where its device started anew; s since the trigger."""
        own = self.head.signals[signal]
        return sorted(
            (one.t_ns - self.head.trigger_ns) / 1e9
            for one in self.head.marks
            if (one.what == "gap" and one.bus == own.bus) or (one.what == "boot_up" and one.device == own.device)
        )


def pack_values(values: Sequence[Values]) -> bytes:
    """The values as bytes."""
    arrays: list[npt.NDArray[Any]] = []
    for one in values:
        arrays += [np.diff(one.t_ns, prepend=np.int64(0)), one.raw]
    return pack_arrays(*arrays)


def unpack_values(packed: bytes) -> tuple[Values, ...]:
    """What ``pack_values`` got. Raises ValueError or ``zstandard.ZstdError`` on damaged bytes."""
    arrays = unpack_arrays(packed)
    return tuple(
        Values(np.cumsum(dt_ns, dtype=np.int64), raw) for dt_ns, raw in zip(arrays[::2], arrays[1::2], strict=True)
    )


def dump_head(head: Head) -> str:
    """The head as JSON, without its marks: of those there may be thousands, and a list of captures shows none."""
    plain = asdict(replace(head, marks=()))
    del plain["marks"]
    return json.dumps(plain, ensure_ascii=False, separators=(",", ":"))


def dump_marks(head: Head) -> str:
    """The marks as JSON."""
    return json.dumps([asdict(one) for one in head.marks], ensure_ascii=False, separators=(",", ":"))


def load_line(text: str) -> CaptureLine:
    """The line in the list of what ``dump_head`` gave."""
    plain = json.loads(text)
    named = {one.name: plain[one.name] for one in fields(CaptureLine) if one.name not in ("signals", "kept")}
    return CaptureLine(**named, signals=len(plain["signals"]), kept=True)


def line_of(head: Head, kept: bool) -> CaptureLine:
    """The line of a capture in the list."""
    named = {one.name: getattr(head, one.name) for one in fields(CaptureLine) if one.name not in ("signals", "kept")}
    return CaptureLine(**named, signals=len(head.signals), kept=kept)


def load_head(text: str, marks: str) -> Head:
    """What ``dump_head`` and ``dump_marks`` gave."""
    plain = json.loads(text)
    order = plain["order"]
    asked = ScopeOrder(
        **{**order, "signals": tuple(order["signals"]), "trigger": TriggerOrder(**order["trigger"])},
    )
    return Head(
        **{
            **plain,
            "order": asked,
            "signals": tuple(KeptSignal(**one) for one in plain["signals"]),
            "marks": tuple(KeptMark(**one) for one in json.loads(marks)),
            "devices": tuple(KeptDevice(**one) for one in plain["devices"]),
        }
    )


def renamed(head: Head, name: str, note: str) -> Head:
    """The head with another name and note."""
    return replace(head, name=name, note=note)


def dump_in_force(rows: Sequence[InForce]) -> str:
    """The parameter values as JSON."""
    return json.dumps([asdict(one) for one in rows], ensure_ascii=False, separators=(",", ":"))


def load_in_force(text: str) -> tuple[InForce, ...]:
    """What ``dump_in_force`` gave."""
    rows: list[Mapping[str, Any]] = json.loads(text)
    return tuple(InForce(**one) for one in rows)
