"""Plots as SVG: what is known is drawn as it was seen, held until the next value; gaps stay gaps. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from statistics import median
from typing import Final

COLOURS: Final = ("#1f5fa8", "#c4411a", "#2f7d32", "#7a3fa0", "#8a6d00", "#00798c", "#a8275b", "#4a4a4a")
DASHES: Final = ("", "6 2", "2 2", "8 2 2 2")
"""Told apart on paper without colours too."""
WIDTH: Final = 760
HEIGHT: Final = 200
LEFT: Final = 66
RIGHT: Final = 14
TOP: Final = 10
BOTTOM: Final = 26
STALE_S: Final = 1.0
CYCLIC_S: Final = 0.2
"""A signal that usually comes as often, or oftener, is sent by itself."""
CYCLIC_STEPS: Final = 5
_STEPS: Final = (1.0, 2.0, 2.5, 5.0, 10.0)


@dataclass(frozen=True, slots=True)
class Track:
    """A signal over time in seconds. None: nothing is known from there.

    ``bucket_s`` 0: every value; else the least and greatest of each bucket that begins at its time.
    """

    label: str
    t_s: Sequence[float]
    low: Sequence[float | None]
    high: Sequence[float | None]
    bucket_s: float


@dataclass(frozen=True, slots=True)
class Stretch:
    """A gap, in seconds; ``label`` says why."""

    from_s: float
    to_s: float
    label: str


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot of one unit between two times, in seconds; ``cursor_s`` is the moment, from which the axis counts."""

    unit: str
    from_s: float
    to_s: float
    cursor_s: float
    tracks: Sequence[Track]
    gaps: Sequence[Stretch]
    title: str


class _Scale:
    def __init__(self, panel: Panel) -> None:
        known = [one for track in panel.tracks for one in (*track.low, *track.high) if one is not None]
        low, high = (min(known), max(known)) if known else (0.0, 1.0)
        margin = (high - low) * 0.06 or abs(high) * 0.05 or 1.0
        self.low, self.high = low - margin, high + margin
        self._from_s = panel.from_s
        self._per_s = (WIDTH - LEFT - RIGHT) / max(panel.to_s - panel.from_s, 1e-9)
        self._per_unit = (HEIGHT - TOP - BOTTOM) / (self.high - self.low)

    def x(self, t_s: float) -> float:
        """Of a time; not outside the plot."""
        return min(max(LEFT + (t_s - self._from_s) * self._per_s, LEFT), WIDTH - RIGHT)

    def y(self, number: float) -> float:
        """Of a value."""
        return HEIGHT - BOTTOM - (number - self.low) * self._per_unit


def panel_svg(panel: Panel, decimal: str) -> str:
    """The whole figure; ``decimal`` is the sign before decimals."""
    scale = _Scale(panel)
    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(panel.title)}">',
        *_gaps(panel, scale),
        *_axes(panel, scale, decimal),
    ]
    for number, track in enumerate(panel.tracks):
        parts.append(_track(track, panel, scale, number))
    x = scale.x(panel.cursor_s)
    parts.append(f'<path class="cursor" d="M{x:.1f} {TOP}V{HEIGHT - BOTTOM}"/>')
    parts.append("</svg>")
    return "\n".join(parts)


def ticks(low: float, high: float, wanted: int) -> list[float]:
    """Round numbers between two, about ``wanted`` of them."""
    width = (high - low) / max(wanted, 1)
    power = 10.0 ** math.floor(math.log10(width))
    step = next(one * power for one in _STEPS if one * power >= width * 0.999)
    first = math.ceil(low / step)
    return [number * step for number in range(first, math.floor(high / step) + 1)]


def number_text(number: float, decimal: str) -> str:
    """Short: six digits count."""
    text = f"{number:.6g}"
    return "0" if text in ("-0", "0") else text.replace(".", decimal).replace("-", "−")


def _gaps(panel: Panel, scale: _Scale) -> Iterator[str]:
    for gap in panel.gaps:
        left, right = scale.x(gap.from_s), scale.x(gap.to_s)
        width = max(right - left, 1.0)
        yield (
            f'<rect class="gap" x="{left:.1f}" y="{TOP}" width="{width:.1f}" height="{HEIGHT - TOP - BOTTOM}">'
            f"<title>{escape(gap.label)}</title></rect>"
        )


def _axes(panel: Panel, scale: _Scale, decimal: str) -> Iterator[str]:
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    for tick in ticks(scale.low, scale.high, 4):
        y = scale.y(tick)
        yield f'<path class="grid" d="M{LEFT} {y:.1f}H{right}"/>'
        yield f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{number_text(tick, decimal)}</text>'
    for tick in ticks(panel.from_s - panel.cursor_s, panel.to_s - panel.cursor_s, 8):
        x = scale.x(panel.cursor_s + tick)
        yield f'<path class="grid" d="M{x:.1f} {TOP}V{bottom}"/>'
        sign = "+" if tick > 0 else ""
        label = f"{sign}{number_text(tick, decimal)} s"
        yield f'<text x="{x:.1f}" y="{HEIGHT - 8}" text-anchor="middle">{label}</text>'
    yield f'<path class="frame" d="M{LEFT} {TOP}V{bottom}H{right}"/>'
    yield f'<text class="unit" x="4" y="{TOP + 10}">{escape(panel.unit)}</text>'


def _track(track: Track, panel: Panel, scale: _Scale, number: int) -> str:
    colour, dash = COLOURS[number % len(COLOURS)], DASHES[number // 2 % len(DASHES)]
    if track.bucket_s:
        path = "".join(_bands(track, scale))
        return f'<path class="band" style="fill:{colour};stroke:{colour}" d="{path}"/>'
    path = "".join(_steps(track, panel, scale))
    return f'<path class="line" style="stroke:{colour};stroke-dasharray:{dash or "none"}" d="{path}"/>'


def _steps(track: Track, panel: Panel, scale: _Scale) -> Iterator[str]:
    """Each value is held until the next, or until nothing is known any more."""
    ends = sorted(gap.from_s for gap in panel.gaps if gap.to_s > gap.from_s)
    held_s = _held_s(track)
    down = False
    before_s = -math.inf
    for t_s, low in zip(track.t_s, track.low, strict=True):
        silent = (before_s + held_s,) if t_s - before_s > held_s else ()
        lost_s = min((end for end in (*ends, *silent) if before_s < end < t_s), default=None) if down else None
        if lost_s is not None:
            yield f"H{scale.x(lost_s):.1f}"
            down = False
        if low is None:
            if down:
                yield f"H{scale.x(t_s):.1f}"
            down = False
        elif down:
            yield f"H{scale.x(t_s):.1f}V{scale.y(low):.1f}"
        else:
            yield f"M{scale.x(t_s):.1f} {scale.y(low):.1f}h0.1"
            down = True
        before_s = t_s


def _held_s(track: Track) -> float:
    """How long a value stands for the present: what comes many times a second is stale after one without it."""
    known = [t_s for t_s, low in zip(track.t_s, track.low, strict=True) if low is not None]
    steps = [after - before for before, after in pairwise(known)]
    return STALE_S if len(steps) >= CYCLIC_STEPS and median(steps) <= CYCLIC_S else math.inf


def _bands(track: Track, scale: _Scale) -> Iterator[str]:
    """The area between least and greatest of buckets that follow one another."""
    run: list[tuple[float, float, float]] = []
    for t_s, low, high in zip(track.t_s, track.low, track.high, strict=True):
        follows = bool(run) and t_s - run[-1][0] < 1.5 * track.bucket_s
        if run and (low is None or not follows):
            yield _band(run, track.bucket_s, scale)
            run = []
        if low is not None and high is not None:
            run.append((t_s, low, high))
    if run:
        yield _band(run, track.bucket_s, scale)


def _band(run: Sequence[tuple[float, float, float]], bucket_s: float, scale: _Scale) -> str:
    top = "".join(f"L{scale.x(t):.1f} {scale.y(hi):.1f}H{scale.x(t + bucket_s):.1f}" for t, _, hi in run)
    back = "".join(f"L{scale.x(t + bucket_s):.1f} {scale.y(lo):.1f}H{scale.x(t):.1f}" for t, lo, _ in reversed(run))
    first_s, _, first = run[0]
    return f"M{scale.x(first_s):.1f} {scale.y(first):.1f}{top}{back}Z"
