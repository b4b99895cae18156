"""The pitch scale around a blade's root: a collar with ticks that stands still, and a pointer on the blade.

The pointer is at the leading edge, so that 0, 90 and 95 degrees lie between the direction of rotation and upwind.
Made for blade 1 (axes of ``app.scene.blade``).
"""

from __future__ import annotations

from typing import Final

import numpy as np

from app.scene.blade import PITCH_AXIS, root_radius_m
from app.scene.solids import Mesh, Vector, box, merged, rotation, tube

LOWEST_DEG: Final = -5
HIGHEST_DEG: Final = 95
STEP_DEG: Final = 10
NAMED_DEG: Final = (0, 90, 95)
"""Angles with a switch of their own, named on the scale."""
FEATHER_DEG: Final = 90
COLLAR_M: Final = (2.02, 2.62)
"""Lower and upper edge of the collar, above the nose."""
_RADIUS_M: Final = root_radius_m() * 1.17
_LEADING_EDGE: Final = np.array([0.0, -1.0, 0.0])
"""At pitch 0."""
_LIFTED_M: Final = 0.012
"""By so much marks stand out of the collar."""


def direction(angle_deg: float) -> Vector:
    """Where the leading edge points at this pitch angle, across the blade's axis."""
    x, y, z = rotation(PITCH_AXIS, angle_deg) @ _LEADING_EDGE
    return (float(x), float(y), float(z))


def collar() -> Mesh:
    """The ring that carries the scale."""
    low, high = COLLAR_M
    return tube(_RADIUS_M * 0.93, _RADIUS_M, low, high)


def ticks() -> Mesh:
    """Marks every 10 degrees and at both ends, without those that are named."""
    degrees = [*range(0, HIGHEST_DEG, STEP_DEG), LOWEST_DEG]
    return merged(_tick(degree, 0.045, 0.26) for degree in degrees if degree not in NAMED_DEG)


def named_ticks() -> Mesh:
    """The long marks of the switches, but for feather."""
    return merged(_tick(degree, 0.075, 0.46) for degree in NAMED_DEG if degree != FEATHER_DEG)


def feather_tick() -> Mesh:
    """The mark of the feather position: the longest, with a bar across."""
    return merged([_tick(FEATHER_DEG, 0.10, 0.56), _tick(FEATHER_DEG, 0.24, 0.10)])


def pointer() -> Mesh:
    """The pointer on the blade at pitch 0: a wedge above the collar whose edge points down to the scale."""
    low = COLLAR_M[1]
    foot = _bar(0.05, 0.20, low - 0.12, 0.06)
    body = _bar(0.20, 0.30, low + 0.06, 0.10)
    return merged([foot, body])


def label_place(angle_deg: float) -> Vector:
    """Where the name of a mark belongs."""
    x, y, _ = direction(angle_deg)
    reach = _RADIUS_M + 0.1
    # 90 and 95 degrees are too close for two names in a row.
    height = COLLAR_M[1] + 0.75 if angle_deg > FEATHER_DEG else COLLAR_M[0] - 0.2
    return (x * reach, y * reach, height)


def _tick(angle_deg: float, width_m: float, length_m: float) -> Mesh:
    mark = _bar(width_m, length_m, COLLAR_M[1] - length_m, _LIFTED_M)
    return mark.turned(PITCH_AXIS, angle_deg)


def _bar(width_m: float, length_m: float, low_m: float, out_m: float) -> Mesh:
    """A bar along z on the collar's surface where the leading edge is at pitch 0; ``out_m`` is what stands out."""
    depth = out_m + 0.05
    y = -(_RADIUS_M + out_m - depth / 2)
    return box((width_m, depth, length_m), (0.0, y, low_m + length_m / 2))
