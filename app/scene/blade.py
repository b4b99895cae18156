"""The mesh of a blade: published distributions of chord, twist and thickness, skinned with aerofoil sections.

Blade axes: z along the span from the rotor's centre, x downwind, y so that the axes are right-handed. The rotor turns
clockwise seen from upwind, so that at pitch 0 the leading edge points to -y, with the chord nearly in the rotor plane.
Positive pitch turns the leading edge into the wind: right-handed about ``PITCH_AXIS``, from tip to root.

Distributions: J. Jonkman, S. Butterfield, W. Musial, G. Scott, "Definition of a 5-MW Reference Wind Turbine for
Offshore System Development", NREL/TP-500-38060 (2009), distributed blade aerodynamic properties. All lengths are scaled
to a rotor of 70 m (the 2 MW class), and the span alone is drawn shortened (``SPAN_DRAWN``), so that hub and blades are
seen together. The reference blade is straight; the prebend is a usual one.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from app.scene import aerofoil
from app.scene.solids import Floats, Mesh, Vector, lofted

SCALE: Final = 35.0 / 63.0
"""From the 126 m rotor of the reference to one of 70 m."""
SPAN_DRAWN: Final = 0.40
"""Share of its span at which the blade is drawn."""
PITCH_AXIS: Final[Vector] = (0.0, 0.0, -1.0)
ROOT_M: Final = 1.6
"""Drawn distance of the blade's root from the rotor's centre."""
PREBEND_M: Final = 0.9
"""Of the unloaded tip, upwind (usual for 34 m)."""
AROUND: Final = 45


class Station(NamedTuple):
    """One station of the reference: radius and chord in metres, twist in degrees, thickness in chords."""

    radius_m: float
    chord_m: float
    twist_deg: float
    thickness: float


TABLE: Final = (
    Station(2.8667, 3.542, 13.308, 1.0),
    Station(5.6000, 3.854, 13.308, 0.92),
    Station(8.3333, 4.167, 13.308, 0.66),
    Station(11.7500, 4.557, 13.308, 0.405),
    Station(15.8500, 4.652, 11.480, 0.3509),
    Station(19.9500, 4.458, 10.162, 0.3509),
    Station(24.0500, 4.249, 9.011, 0.30),
    Station(28.1500, 4.007, 7.795, 0.25),
    Station(32.2500, 3.748, 6.544, 0.25),
    Station(36.3500, 3.502, 5.361, 0.21),
    Station(40.4500, 3.256, 4.188, 0.21),
    Station(44.5500, 3.010, 3.125, 0.18),
    Station(48.6500, 2.764, 2.319, 0.18),
    Station(52.7500, 2.518, 1.526, 0.18),
    Station(56.1667, 2.313, 0.863, 0.18),
    Station(58.9000, 2.086, 0.370, 0.18),
    Station(61.6333, 1.419, 0.106, 0.18),
)
"""The report's nodes; thickness is that of the section it names there. At its second and third node the report has
cylinders: how they grow into the first aerofoil is not given, so these two thicknesses are ours."""
_ROOT_RADIUS_M: Final = 1.5
_TIP: Final = (Station(62.5, 0.95, 0.05, 0.18), Station(62.9, 0.5, 0.0, 0.18), Station(63.0, 0.16, 0.0, 0.18))
"""Closes the tip; beyond the report's last node."""
_THICKEST_SECTION: Final = 0.405
"""From here to 1 the section grows into a circle."""
_LIFT: Final = 0.5
"""Design lift of the outer sections."""
_AXIS_AT: Final = ((1.5, 0.5), (8.3333, 0.46), (15.85, 0.375), (63.0, 0.33))
"""Radius, and place of the pitch axis in chords behind the leading edge."""
_FINE: Final = 36


def root_radius_m() -> float:
    """Half the diameter of the root."""
    return TABLE[0].chord_m * SCALE / 2


def drawn_z(radius_m: float) -> float:
    """Height along the drawn blade of a radius of the reference."""
    return ROOT_M + (radius_m - _ROOT_RADIUS_M) * SCALE * SPAN_DRAWN


TIP_M: Final = drawn_z(_TIP[-1].radius_m)
"""Drawn distance of the tip from the rotor's centre."""


def blade_mesh() -> Mesh:
    """A blade at pitch 0: flat at the root, closed at the tip."""
    return lofted(np.array([ring(station)[::-1] for station in _stations()]))


def ring(station: Station) -> Floats:
    """The section at a station in blade axes (``AROUND``, 3); its first point is the trailing edge's suction side."""
    blend = np.clip((station.thickness - _THICKEST_SECTION) / (1 - _THICKEST_SECTION), 0.0, 1.0)
    thickness = min(station.thickness, _THICKEST_SECTION)
    # Thick sections carry less camber: they stall late, and must blend into a circle.
    lift = _LIFT * float(np.interp(thickness, [0.18, _THICKEST_SECTION], [1.0, 0.4]))
    outline = aerofoil.section(thickness, lift, AROUND) * (1 - blend) + aerofoil.circle(AROUND) * blend
    radii, places = zip(*_AXIS_AT, strict=True)
    outline[:, 0] -= np.interp(station.radius_m, radii, places)
    outline *= station.chord_m * SCALE
    twist = np.radians(station.twist_deg)
    y, x = outline[:, 0], outline[:, 1]  # leading edge to -y, suction side downwind
    turned = [x * np.cos(twist) + y * np.sin(twist), -x * np.sin(twist) + y * np.cos(twist)]
    share = (station.radius_m - _ROOT_RADIUS_M) / (_TIP[-1].radius_m - _ROOT_RADIUS_M)
    bend = -PREBEND_M * share**2
    return np.stack([turned[0] + bend, turned[1], np.full(AROUND, drawn_z(station.radius_m))], axis=1)


def _stations() -> list[Station]:
    """The table, its ends, and between its nodes as many more as smooth shading wants."""
    known = [TABLE[0]._replace(radius_m=_ROOT_RADIUS_M), *TABLE, *_TIP]
    columns = np.array(known).T
    radii = np.union1d(columns[0], np.linspace(_ROOT_RADIUS_M, TABLE[-1].radius_m, _FINE))
    chord, twist, thickness = (monotone(columns[0], column, radii) for column in columns[1:])
    rows = zip(radii, chord, twist, thickness, strict=True)
    return [Station(float(r), float(c), float(t), float(h)) for r, c, t, h in rows]


def monotone(x: Floats, y: Floats, at: Floats) -> Floats:
    """Piecewise cubic through the points, smooth and never beyond them (Fritsch and Carlson, harmonic mean)."""
    step, slope = np.diff(x), np.diff(y) / np.diff(x)
    tangent = np.zeros(len(x))
    tangent[0], tangent[-1] = slope[0], slope[-1]
    same = slope[:-1] * slope[1:] > 0
    both = np.where(same, slope[:-1] + slope[1:], 1.0)
    tangent[1:-1] = np.where(same, 2 * slope[:-1] * slope[1:] / both, 0.0)
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(step) - 1)
    t = (at - x[i]) / step[i]
    value: Floats = (
        y[i] * (1 + 2 * t) * (1 - t) ** 2
        + tangent[i] * step[i] * t * (1 - t) ** 2
        + y[i + 1] * t**2 * (3 - 2 * t)
        + tangent[i + 1] * step[i] * t**2 * (t - 1)
    )
    return value
