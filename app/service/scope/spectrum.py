"""The spectrum of a stretch of one signal: what vibrates in it, at which frequency, how strongly.

Values of a bus are not equidistant. They are put on a uniform grid with as many points as there are values, each point
holding the last value seen; a line between two values would be invented. Where values come unevenly, that blurs high
frequencies, so ``unevenness`` is told. The mean is taken off, the window is Hann's, amplitudes are peak values in
the signal's unit: a sine of amplitude 1 gives 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from app.errors import ScopeSpectrumError
from app.service.scope.capture import Capture, Floats

LEAST: Final = 32
"""Fewer values make no spectrum."""
MAX_POINTS: Final = 4000
PEAKS: Final = 10
_SHARE: Final = 0.02
"""What is weaker than this part of the strongest is no peak."""
_CENTRED: Final = 1e-6
_FIRST_BIN: Final = 2
"""Hann's window spreads what is at zero over the bins below."""


@dataclass(frozen=True, slots=True)
class Peak:
    """A local maximum: Hz, and the amplitude in the signal's unit."""

    frequency_hz: float
    amplitude: float


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Amplitudes by frequency, the greatest of each of at most some thousand steps.

    ``values`` were used from ``from_s`` to ``to_s``, on a grid of ``rate_hz``. ``unevenness``: by how much of the step
    the distances of neighbours deviate (standard deviation); 0 is equidistant. ``mean`` was taken off.
    """

    signal: str
    unit: str
    from_s: float
    to_s: float
    values: int
    rate_hz: float
    resolution_hz: float
    unevenness: float
    mean: float
    frequency_hz: list[float]
    amplitude: list[float]
    peaks: list[Peak]


def spectrum_of(capture: Capture, signal: int, from_s: float, to_s: float) -> Spectrum:
    """The spectrum from ``from_s`` to ``to_s``, s since the trigger. Raises ScopeSpectrumError."""
    head = capture.head.signals[signal]
    t_s = capture.values[signal].t_s(capture.head.trigger_ns)
    inside = (t_s >= from_s) & (t_s <= to_s)
    t_s, numbers = t_s[inside], capture.values[signal].scaled(head.scale)[inside]
    if len(t_s) < LEAST or t_s[-1] <= t_s[0]:
        raise ScopeSpectrumError(reason_key="scope.spectrum.few", count=len(t_s), least=LEAST)
    if any(t_s[0] < one <= t_s[-1] for one in capture.breaks_s(signal)):
        raise ScopeSpectrumError(reason_key="scope.spectrum.gap", count=len(t_s), least=LEAST)
    step_s = (t_s[-1] - t_s[0]) / (len(t_s) - 1)
    amplitude, mean = amplitudes(resampled(t_s, numbers, step_s))
    frequency = np.arange(len(amplitude)) / (step_s * len(t_s))
    shown = _greatest(frequency, amplitude)
    return Spectrum(
        signal=head.name,
        unit=head.unit,
        from_s=float(t_s[0]),
        to_s=float(t_s[-1]),
        values=len(t_s),
        rate_hz=float(1 / step_s),
        resolution_hz=float(frequency[1]),
        unevenness=float(np.std(np.diff(t_s)) / step_s),
        mean=mean,
        frequency_hz=shown[0].tolist(),
        amplitude=shown[1].tolist(),
        peaks=peaks_of(frequency, amplitude),
    )


def resampled(t_s: Floats, numbers: Floats, step_s: float) -> Floats:
    """On a grid of ``step_s`` from the first value on, holding the last one seen."""
    grid = t_s[0] + np.arange(len(t_s)) * step_s
    # A tenth of a step: what is equidistant but for the rounding of its times falls on its own point.
    return np.asarray(numbers[np.maximum(0, np.searchsorted(t_s, grid + 0.1 * step_s, "right") - 1)])


def amplitudes(numbers: Floats) -> tuple[Floats, float]:
    """Peak amplitudes by bin, and the mean that was taken off."""
    mean = float(np.mean(numbers))
    window = np.hanning(len(numbers) + 1)[:-1]
    bins = np.abs(np.fft.rfft((numbers - mean) * window)) * 2 / window.sum()
    return bins, mean


def peaks_of(frequency: Floats, amplitude: Floats) -> list[Peak]:
    """The strongest local maxima, each where it lies between the bins."""
    if len(amplitude) <= _FIRST_BIN + 2:
        return []
    inner = np.arange(_FIRST_BIN, len(amplitude) - 1)
    least = _SHARE * float(amplitude[_FIRST_BIN:].max())
    higher = (amplitude[inner] > amplitude[inner - 1]) & (amplitude[inner] >= amplitude[inner + 1])
    found = inner[higher & (amplitude[inner] > max(least, 1e-12))]
    found = found[np.argsort(amplitude[found])[::-1]][:PEAKS]
    return [_between(frequency, amplitude, int(at)) for at in found]


def _between(frequency: Floats, amplitude: Floats, at: int) -> Peak:
    """Where between the bins a sine lies that gives these three, and its amplitude, by the main lobe of the window.

    Of Hann's window the lobe is sin(pi d) / (pi d (1 - d^2)) at a distance of d bins, so the ratio of two neighbours
    tells d.
    """
    left, top, right = (float(one) for one in amplitude[at - 1 : at + 2])
    ratio = max(left, right) / top
    shift = min(0.5, max(0.0, (2 * ratio - 1) / (ratio + 1)))
    lobe = 1.0 if shift < _CENTRED else math.sin(math.pi * shift) / (math.pi * shift * (1 - shift**2))
    signed = shift if right > left else -shift
    return Peak(float(frequency[at] + signed * frequency[1]), top / lobe)


def _greatest(frequency: Floats, amplitude: Floats) -> tuple[Floats, Floats]:
    every = -(-len(amplitude) // MAX_POINTS)
    if every == 1:
        return frequency, amplitude
    starts = np.arange(0, len(amplitude), every)
    return frequency[starts], np.maximum.reduceat(amplitude, starts)
