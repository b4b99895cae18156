"""What is seen of the turbine besides its blades: hub casting, nose, bearings, drives, cabinets, nacelle, tower.

Rotor axes: x downwind along the shaft, z up at azimuth 0, origin where the blades' axes meet. What belongs to a blade
is made for blade 1, whose axis is z. Plain shapes of usual proportions; positions are no maker's.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from app.scene.blade import ROOT_M, root_radius_m
from app.scene.solids import AROUND, Floats, Mesh, Vector, box, cylinder, lofted, merged, revolved, torus, tube

NOSE_RADIUS_M: Final = 1.95
NOSE_TIP_M: Final = -2.7
NACELLE_AT_M: Final = 1.75
_ALONG_SHAFT: Final[Vector] = (0.0, 1.0, 0.0)
"""Turning by 90 degrees about y brings z to x: bodies of revolution are made about z."""
_CASTING_M: Final = 1.0
_BETWEEN_DEG: Final = 60.0
"""From one blade half-way to the next."""
_DRIVE_X_M: Final = -1.28
"""Of a pitch drive: upwind of its blade's root, where it is seen with the nose off."""


def nose() -> Mesh:
    """The spinner: an ellipsoid upwind, a cylinder to the nacelle."""
    front = np.linspace(0.03, np.pi / 2, 18)
    run = [(NOSE_TIP_M * np.cos(turn), NOSE_RADIUS_M * np.sin(turn)) for turn in front]
    body = [(0.0, NOSE_RADIUS_M), (1.0, NOSE_RADIUS_M), (1.45, 1.8)]
    return revolved([run, body]).turned(_ALONG_SHAFT, 90)


def casting() -> Mesh:
    """The hub's cast body with its three flanges."""
    rounded = np.linspace(0.25, np.pi / 2, 10)
    run = [(-_CASTING_M * 0.95 * np.cos(turn), _CASTING_M * 1.12 * np.sin(turn)) for turn in rounded]
    body = revolved([run, [(0.0, _CASTING_M * 1.12), (1.3, _CASTING_M * 1.05)]]).turned(_ALONG_SHAFT, 90)
    return merged([body, *(cylinder(root_radius_m() * 1.04, 0.2, 1.2).turned((1, 0, 0), 120.0 * n) for n in range(3))])


def bearing() -> Mesh:
    """The fixed ring of a pitch bearing, on the flange."""
    radius = root_radius_m()
    return tube(radius * 0.80, radius * 1.17, 1.2, 1.47)


def bolts() -> Mesh:
    """The bolted ring of a blade's root, which turns with it."""
    radius = root_radius_m()
    heads = [cylinder(0.035, 1.58, 1.66, 6).moved((radius * 1.06, 0, 0)).turned((0, 0, 1), 10.0 * n) for n in range(36)]
    return merged([tube(radius * 0.85, radius * 1.12, 1.47, 1.58), *heads])


def drive() -> Mesh:
    """Gear box with its pinion at the bearing, and the flange of the motor."""
    gear = revolved([[(0.88, 0.17), (0.92, 0.24)], [(0.92, 0.24), (1.28, 0.24)], [(1.28, 0.24), (1.33, 0.12)]])
    pinion = cylinder(0.12, 1.3, 1.5)
    return merged([gear, pinion]).moved((_DRIVE_X_M, 0, 0))


def motor() -> Mesh:
    """The pitch motor: ribbed body, end shield, encoder and brake."""
    body = cylinder(0.19, 0.40, 0.88)
    ribs = [tube(0.18, 0.225, 0.44 + 0.06 * n, 0.465 + 0.06 * n) for n in range(7)]
    brake = cylinder(0.13, 0.30, 0.40)
    return merged([body, *ribs, brake]).moved((_DRIVE_X_M, 0, 0))


def battery() -> Mesh:
    """The battery box of an axis with its lid, between its blade and the next."""
    body = box((0.50, 1.05, 0.42), (-0.72, 0.0, 1.32))
    lid = box((0.54, 1.09, 0.06), (-0.72, 0.0, 1.56))
    handles = [box((0.05, 0.22, 0.06), (-0.99, side, 1.36)) for side in (-0.3, 0.3)]
    return merged([body, lid, *handles]).turned((1, 0, 0), _BETWEEN_DEG)


def cabinet() -> Mesh:
    """The cabinet of an axis (power and control unit), upwind of its battery box."""
    body = box((0.34, 0.78, 0.62), (-1.20, 0.0, 0.98))
    door = box((0.04, 0.70, 0.54), (-1.38, 0.0, 0.98))
    return merged([body, door]).turned((1, 0, 0), _BETWEEN_DEG)


def halo() -> Mesh:
    """What shines around the root of a blade with a fault."""
    radius = root_radius_m()
    return merged([torus(radius * 1.55, 0.20, ROOT_M + 1.45), torus(radius * 1.95, 0.13, ROOT_M + 1.45)])


def nacelle() -> Mesh:
    """Behind the hub: a rounded box, narrower at both ends."""
    stations = ((NACELLE_AT_M, 1.5), (2.1, 1.75), (3.0, 1.85), (7.6, 1.85), (8.6, 1.6), (8.8, 1.35))
    rings = np.array([_rounded(half, x) for x, half in stations])
    return lofted(rings).moved((0.0, 0.0, 0.15))


def tower(length_m: float) -> Mesh:
    """A tapered tube under the nacelle."""
    return revolved([[(-length_m, 1.35), (-1.6, 0.95)]]).moved((4.3, 0, 0))


def arrow() -> Mesh:
    """An arrow of length 1 along +x, for the wind."""
    shaft, head = [(0.0, 0.035), (0.62, 0.035)], [(0.62, 0.11), (1.0, 0.002)]
    body = revolved([shaft, [shaft[-1], head[0]], head], 24)
    return body.turned(_ALONG_SHAFT, 90)


def _rounded(half_m: float, x_m: float) -> Floats:
    """A square with rounded corners around the shaft, counter-clockwise seen from downwind."""
    angle = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    cos, sin = np.cos(angle), np.sin(angle)
    radius = half_m / (np.abs(cos) ** 5 + np.abs(sin) ** 5) ** 0.2
    return np.stack([np.full(AROUND, x_m), radius * cos, radius * sin], axis=1)
