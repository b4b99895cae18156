"""Position sensors of four kinds: what they give for a place of the cylinder, and what is made of it. Pure.

Kind (1/22) and hardware agree, for the kind can only be chosen with the maker's tool. The signal (1/97), resolution and
offset are parameters, and may be wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final, NamedTuple

from app.twins.ed2.delivered import ANALOG, INCREMENTAL, SSI_GRAY

STEP_MM: Final = 0.005
"""Of digital sensors."""
CODE_ZERO: Final = 10_000
"""What an SSI sensor tells with the cylinder retracted: its zero lies before it."""
SENSOR_BITS: Final = 25
SPAN_MM: Final = 500.0
"""Range of analog sensors."""
_SSI_BITS: Final = {0: 13, 1: 24, 2: 25}
_JUMP_MM: Final = 20.0
"""No cylinder moves so far in a millisecond."""
_MM_PER_RESOLUTION: Final = 1e-6
_MM_PER_OFFSET: Final = 0.01


class Signal(Enum):
    """Analog signals: lowest and highest value, least and most that a sound wire gives, by 1/97."""

    VOLT_0_5 = (0.0, 5.0, -0.1, 5.25)
    VOLT_0_10 = (0.0, 10.0, -0.2, 10.5)
    MA_0_20 = (0.0, 20.0, -0.1, 21.0)
    MA_4_20 = (4.0, 20.0, 3.5, 21.0)
    VOLT_PM_5 = (-5.0, 5.0, -5.25, 5.25)
    VOLT_PM_10 = (-10.0, 10.0, -10.5, 10.5)


SIGNALS: Final = dict(enumerate(Signal))


class Trouble(Enum):
    """What is wrong with a sensor; the value is the family of its error codes in the description."""

    VALUES = "ed2_transducer_values"
    WIRE = "ed2_transducer_wire"
    RANGE = "ed2_transducer_range"


class Scaling(NamedTuple):
    """Parameters 1/97, 1/98 and 1/99."""

    signal: int
    offset: int
    resolution: int


class Reading(NamedTuple):
    """What was understood; with a trouble the place is the latest that was."""

    position_mm: float
    trouble: Trouble | None = None


@dataclass(slots=True)
class Wire:
    """What may happen to a sensor. ``slip_mm``: it has come loose by so much."""

    broken: bool = False
    disturbed: bool = False
    slip_mm: float = 0.0


class Transducer:
    """The sensor of one axis. Incremental ones count from where they are switched on."""

    def __init__(self, kind: int) -> None:
        self.kind = kind
        self.wire = Wire()
        self._start_mm = 0.0
        self._last: float | None = None
        self._flip = False

    def power_on(self, place_mm: float) -> None:
        """Counting begins here."""
        self._start_mm = place_mm
        self._last = None

    def read(self, place_mm: float, scaling: Scaling) -> Reading:
        """The position for a place of the cylinder."""
        found = self._understand(place_mm + self.wire.slip_mm, scaling)
        if isinstance(found, Trouble):
            return Reading(self._last or 0.0, found)
        if self.wire.disturbed:
            self._flip = not self._flip
            found += 2 * _JUMP_MM * self._flip
        if self._last is not None and abs(found - self._last) > _JUMP_MM:
            kept, self._last = self._last, found
            return Reading(kept, Trouble.VALUES)
        self._last = found
        return Reading(found)

    def _understand(self, place_mm: float, scaling: Scaling) -> float | Trouble:
        offset_mm = scaling.offset * _MM_PER_OFFSET
        if self.kind == ANALOG:
            return self._analog(place_mm, scaling, offset_mm)
        if self.kind == INCREMENTAL:
            # Nothing tells a broken wire from a cylinder that stands.
            place_mm = self._start_mm if self.wire.broken else place_mm
            counts = round((place_mm - self._start_mm) / STEP_MM)
            return counts * scaling.resolution * _MM_PER_RESOLUTION + offset_mm
        code = self._ssi(place_mm, _SSI_BITS.get(scaling.signal, SENSOR_BITS))
        return code if isinstance(code, Trouble) else code * scaling.resolution * _MM_PER_RESOLUTION + offset_mm

    def _ssi(self, place_mm: float, bits: int) -> int | Trouble:
        """The most significant ``bits`` of the code: a controller that asks for fewer gets no more."""
        code = round(place_mm / STEP_MM) + CODE_ZERO
        if not 0 <= code < 1 << SENSOR_BITS:
            return Trouble.RANGE
        sent = code ^ code >> 1 if self.kind == SSI_GRAY else code
        sent >>= SENSOR_BITS - bits
        if self.wire.broken:
            sent = (1 << bits) - 1
        if sent == (1 << bits) - 1:
            return Trouble.WIRE  # an idle line reads as ones
        return from_gray(sent) if self.kind == SSI_GRAY else sent

    def _analog(self, place_mm: float, scaling: Scaling, offset_mm: float) -> float | Trouble:
        own, wanted = Signal.MA_4_20, SIGNALS.get(scaling.signal, Signal.MA_4_20)
        low, high, _, _ = own.value
        value = 0.0 if self.wire.broken else low + (high - low) * place_mm / SPAN_MM
        low, high, least, most = wanted.value
        if value < least:
            return Trouble.WIRE
        if value > most:
            return Trouble.RANGE
        return (value - low) / (high - low) * scaling.resolution * _MM_PER_RESOLUTION + offset_mm


def from_gray(code: int) -> int:
    """The number of a Gray code."""
    number = code
    while code:
        code >>= 1
        number ^= code
    return number
