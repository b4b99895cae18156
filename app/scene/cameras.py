"""Places from which the scene is looked at, and the angle of view that holds what is to be seen.

World axes: x downwind, z up, y to the left of who looks downwind; metres.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from app.scene import actuator
from app.scene.blade import TIP_M
from app.scene.marks import COLLAR_M
from app.scene.shaft import PLACE_M
from app.scene.solids import Vector


class Camera(NamedTuple):
    """One place. ``half_m``: half width and half height of what must be seen around the point looked at.

    ``blade`` None: it stands still in the world; else it goes round with that blade, and is given for azimuth 0.
    ``nose_off``: the nose would hide what is to be seen.
    """

    name: str
    position_m: Vector
    look_at_m: Vector
    half_m: tuple[float, float]
    nose_off: bool = False
    blade: int | None = None


FRONT: Final = Camera("front", (-56.0, -27.0, 8.0), (0.4, 0.0, 0.0), (TIP_M + 0.2, TIP_M + 0.6))
"""From upwind, aside and above, so far away that perspective shortens no blade much."""
HUB: Final = Camera("hub", (-11.5, -4.6, 3.4), (-0.3, 0.0, 0.0), (3.6, 3.6), nose_off=True)


def _blade_camera(blade: int) -> Camera:
    """Before the scale, between the leading edge's places at 0 and 90 degrees."""
    look_at, position = (-0.4, -0.2, COLLAR_M[1] - 0.15), (-6.2, -5.4, COLLAR_M[1] + 1.0)
    turn = math.radians(120.0 * (blade - 1))
    return Camera(f"blade-{blade}", _about_shaft(position, turn), _about_shaft(look_at, turn), (2.5, 2.5), True, blade)


def _about_shaft(point: Vector, turn_rad: float) -> Vector:
    x, y, z = point
    cos, sin = math.cos(turn_rad), math.sin(turn_rad)
    return (x, y * cos - z * sin, y * sin + z * cos)


_X, _Y, _Z = PLACE_M
BENCH: Final = Camera("shaft", (_X + 6.2, _Y - 3.6, _Z + 2.2), (_X - 0.3, _Y, _Z + 0.1), (1.45, 1.35))
"""The axis on a bench: from before its shaft, a little aside, so that gear and motor are seen behind it."""


def _cylinder_camera(number: int) -> Camera:
    """From before the blade's root, a little aside, so that the blade is seen behind it."""
    x, y, z = actuator.place_of(number)
    return Camera(f"cylinders-{number}", (x + 8.8, y - 4.8, z + 2.8), (x - 0.3, y - 0.2, z), (1.85, 2.15))


CAMERAS: Final = (
    FRONT,
    HUB,
    *(_blade_camera(blade) for blade in (1, 2, 3)),
    BENCH,
    *(_cylinder_camera(number) for number in range(1, actuator.MOST + 1)),
)


def fov_rad(camera: Camera, aspect: float) -> float:
    """Vertical angle of view in a frame ``aspect`` times as wide as high."""
    distance = math.dist(camera.position_m, camera.look_at_m)
    half_width, half_height = camera.half_m
    return 2 * math.atan(max(half_height, half_width / aspect) / distance)
