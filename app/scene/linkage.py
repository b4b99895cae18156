"""How two cylinders turn a blade: a crank on the blade's root, and a cylinder that stands on the hub beside it.

The geometry is one of our own choosing; no maker's, and no object of a drive tells one. All lengths are in strokes of
the cylinder. The foot of a cylinder is ``FOOT`` away from the pitch axis, the pin of its crank ``CRANK``; the angle
between both, seen from the axis, follows from the distance L of foot and pin by the law of cosines::

    L^2 = FOOT^2 + CRANK^2 - 2 FOOT CRANK cos(angle)

CRANK is chosen so that one stroke takes the angle from 45 to 135 degrees, where the rod always has a good lever: the
blade turns from 0 to 90 degrees. With L1 = L0 + 1 and FOOT = 2 this gives 7 CRANK^2 = 3.75. The second cylinder is the
first one turned by half a turn, so that both push round the axis and not across it.
"""

from __future__ import annotations

from math import acos, cos, degrees, radians, sin, sqrt
from typing import Final, NamedTuple

FOOT: Final = 2.0
CRANK: Final = sqrt(3.75 / 7.0)
FIRST_DEG: Final = 45.0
"""Between foot and pin with the rod in."""
RANGE_DEG: Final = 90.0
"""That one stroke turns the blade."""
_SUM: Final = FOOT**2 + CRANK**2
_PRODUCT: Final = 2.0 * FOOT * CRANK
SHORTEST: Final = sqrt(_SUM - _PRODUCT * cos(radians(FIRST_DEG)))
"""From foot to pin with the rod in."""
FOOT_AT_DEG: Final = (-90.0, 90.0)
"""Where the feet of both cylinders stand round the axis: below it and above it (0 is to the right)."""


class Place(NamedTuple):
    """A cylinder in the plane across the pitch axis: its foot, where it points to, and how long it is (strokes)."""

    foot: tuple[float, float]
    points_deg: float
    length: float


def angle_deg(extension: float) -> float:
    """How far a rod that is out by a share of its stroke has turned the blade; 0 at 0, 90 at 1."""
    length = SHORTEST + extension
    cosine = (_SUM - length**2) / _PRODUCT
    return degrees(acos(min(1.0, max(-1.0, cosine)))) - FIRST_DEG


def extension_at(turned_deg: float) -> float:
    """The share of its stroke by which a rod is out where the blade has turned so far; the other way round."""
    return sqrt(_SUM - _PRODUCT * cos(radians(FIRST_DEG + turned_deg))) - SHORTEST


def place_of(cylinder: int, extension: float) -> Place:
    """How the cylinder (1 or 2) stands with its rod out by a share of the stroke."""
    foot_at = radians(FOOT_AT_DEG[cylinder - 1])
    pin_at = foot_at + radians(FIRST_DEG + angle_deg(extension))
    foot = (FOOT * cos(foot_at), FOOT * sin(foot_at))
    across, up = CRANK * cos(pin_at) - foot[0], CRANK * sin(pin_at) - foot[1]
    length = sqrt(across**2 + up**2)
    turn = degrees(acos(max(-1.0, min(1.0, across / length))))
    return Place(foot, turn if up >= 0.0 else -turn, length)
