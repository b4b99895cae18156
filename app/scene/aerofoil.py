"""Aerofoil sections by formula: the modified four-digit thickness form with the a = 1 mean line.

Thickness: J. Stack and A. E. von Doenhoff, NACA Report 492 (1934): leading edge and afterbody are two polynomials that
meet at the place of maximum thickness. Mean line: NACA Report 824 (1945), uniform chordwise load. Together they make a
family from 18 % to 40 % whose thickest place lies well forward of mid-chord, as that of the sections of turbine blades.
Lengths are fractions of the chord: 0 is the leading edge, 1 the trailing edge.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from app.scene.solids import Floats

THICKEST_AT: Final = 0.35
"""Chordwise place of the maximum thickness."""
_BASIC: Final = 0.20
"""The polynomials are given for a section of 20 %; others are scaled from it (Report 492)."""
_NOSE: Final = 0.296904
"""Leading-edge coefficient a0 of the usual nose radius (index 6)."""
_TAIL: Final = 0.01
"""Half thickness of the blunt trailing edge of the basic section (d0)."""
_TAIL_SLOPES: Final = ((0.2, 0.200), (0.3, 0.234), (0.4, 0.315), (0.5, 0.465), (0.6, 0.700))
"""Place of maximum thickness, and trailing-edge slope d1 (Report 492, table)."""
CIRCLE_GAP: Final = 0.01
"""Share of the circle that its closing edge takes, so that circle and section have the same corners."""


def section(thickness: float, lift: float, count: int) -> Floats:
    """A closed section of ``count`` points (count, 2): chordwise, and towards the suction side.

    It runs from the trailing edge over the suction side to the leading edge and back; the step from the last to the
    first point is the blunt trailing edge. ``thickness`` in chords, ``lift`` the design lift coefficient of the mean
    line; ``count`` is odd, so that one point is the leading edge.
    """
    share = np.linspace(0.0, 1.0, count)
    x = (1 + np.cos(2 * np.pi * share)) / 2
    x[count // 2] = 0.0
    half = half_thickness(x) * thickness / _BASIC
    camber = mean_line(x, lift)
    return np.stack([x, np.where(share <= 0.5, camber + half, camber - half)], axis=1)


def circle(count: int) -> Floats:
    """A circle of diameter 1 with the same order of points as ``section``."""
    angle = 2 * np.pi * (CIRCLE_GAP + (1 - 2 * CIRCLE_GAP) * np.linspace(0.0, 1.0, count))
    return np.stack([0.5 + 0.5 * np.cos(angle), 0.5 * np.sin(angle)], axis=1)


def half_thickness(x: Floats) -> Floats:
    """Half the thickness of the basic 20 % section at ``x``."""
    a, d = _forward(), _aft()
    root = np.sqrt(np.clip(x, 0.0, None))
    fore = a[0] * root + a[1] * x + a[2] * x**2 + a[3] * x**3
    rest = 1 - x
    aft = d[0] + d[1] * rest + d[2] * rest**2 + d[3] * rest**3
    half: Floats = np.where(x < THICKEST_AT, fore, aft)
    return half


def mean_line(x: Floats, lift: float) -> Floats:
    """Height of the a = 1 mean line for a design lift coefficient."""
    inside = np.clip(x, 1e-9, 1 - 1e-9)
    line: Floats = -lift / (4 * np.pi) * ((1 - inside) * np.log(1 - inside) + inside * np.log(inside))
    return line


def _aft() -> Floats:
    """d0..d3: full height and no slope at the thickest place, the given slope at the trailing edge."""
    rest = 1 - THICKEST_AT
    places, slopes = zip(*_TAIL_SLOPES, strict=True)
    slope = float(np.interp(THICKEST_AT, places, slopes))
    height = _BASIC / 2 - _TAIL - slope * rest
    d3 = (-slope - 2 * height / rest) / rest**2
    d2 = height / rest**2 - d3 * rest
    return np.array([_TAIL, slope, d2, d3])


def _forward() -> Floats:
    """a0..a3: full height and no slope at the thickest place, and the curvature of the afterbody there."""
    at = THICKEST_AT
    d = _aft()
    curvature = 2 * d[2] + 6 * d[3] * (1 - at)
    matrix = np.array([[at, at**2, at**3], [1.0, 2 * at, 3 * at**2], [0.0, 2.0, 6 * at]])
    known = [
        _BASIC / 2 - _NOSE * at**0.5,
        -0.5 * _NOSE * at**-0.5,
        curvature + 0.25 * _NOSE * at**-1.5,
    ]
    return np.concatenate([[_NOSE], np.linalg.solve(matrix, known)])
