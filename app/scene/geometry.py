"""Meshes of the rotor: a blade with aerofoil sections, twist and taper, the hub, the bearings. Metres; pure NumPy.

Blade axes: z along the span from the root, x downwind, y in the rotor plane. At pitch 0 the chord lies in the rotor
plane. The shape is generic: a blade of the 2 MW class, shortened to a third so that hub and blades are seen together.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]
Faces = npt.NDArray[np.int32]

SPAN_M: Final = 13.0
ROOT_RADIUS_M: Final = 0.9
HUB_RADIUS_M: Final = 1.6
MAX_CHORD_M: Final = 2.4
TIP_CHORD_M: Final = 0.5
ROOT_TWIST_DEG: Final = 13.0
_AROUND: Final = 48
_ALONG: Final = 40


class Mesh(NamedTuple):
    """Triangles: ``vertices`` (n, 3) in metres, ``faces`` (m, 3) as indices."""

    vertices: Floats
    faces: Faces


def aerofoil(thickness: float, camber: float, count: int) -> Floats:
    """A closed NACA four-digit section, ``count`` points (count, 2): chordwise 0..1, thickness direction.

    ``thickness`` and ``camber`` as fractions of the chord; the camber's place is 40 % (NACA report 460).
    """
    half = count // 2
    x = (1 - np.cos(np.linspace(0, np.pi, half, endpoint=False))) / 2
    yt = 5 * thickness * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    place = 0.4
    yc = np.where(
        x < place,
        camber / place**2 * (2 * place * x - x**2),
        camber / (1 - place) ** 2 * (1 - 2 * place + 2 * place * x - x**2),
    )
    upper = np.stack([x, yc + yt], axis=1)
    lower = np.stack([1 - x, np.interp(1 - x, x, yc) - np.interp(1 - x, x, yt)], axis=1)
    return np.concatenate([upper, lower]).astype(np.float32)


def blade() -> Mesh:
    """A blade: a circle at the root, a thick section at the largest chord, a thin and untwisted one at the tip."""
    circle_angle = np.linspace(np.pi, -np.pi, _AROUND, endpoint=False)
    circle = np.stack([np.cos(circle_angle), np.sin(circle_angle)], axis=1) * ROOT_RADIUS_M
    rings = []
    for fraction in np.linspace(0, 1, _ALONG):
        grown = _smooth(np.clip(fraction / 0.22, 0, 1))
        past = np.clip((fraction - 0.22) / 0.78, 0, 1)
        chord = MAX_CHORD_M + (TIP_CHORD_M - MAX_CHORD_M) * past**0.8
        chord *= 1 - 0.75 * np.clip((fraction - 0.97) / 0.03, 0, 1) ** 2
        section = aerofoil(0.34 - 0.20 * past, 0.03, _AROUND)
        section = (section - np.array([0.3, 0.0])) * chord * np.array([-1.0, 1.0])
        ring = circle * (1 - grown) + section * grown
        twist = np.radians(ROOT_TWIST_DEG * (1 - past) ** 1.5 * grown)
        cos, sin = np.cos(twist), np.sin(twist)
        in_plane, downwind = ring[:, 0] * cos - ring[:, 1] * sin, ring[:, 0] * sin + ring[:, 1] * cos
        height = np.full(_AROUND, HUB_RADIUS_M + fraction * SPAN_M)
        rings.append(np.stack([downwind, in_plane, height], axis=1))
    return _loft(np.array(rings), close_end=True)


def ring(radius_m: float, width_m: float, height_m: float) -> Mesh:
    """A bearing: a ring around z from ``height_m``, ``width_m`` high."""
    angle = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    levels = [(radius_m, 0.0), (radius_m * 1.12, 0.0), (radius_m * 1.12, width_m), (radius_m, width_m)]
    rows = [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(_AROUND, height_m + h)], axis=1) for r, h in levels]
    return _loft(np.array(rows), close_end=False)


def spinner() -> Mesh:
    """The hub: half an ellipsoid upwind (-x), a cylinder with a flat back downwind."""
    rows = []
    angle = np.linspace(0, 2 * np.pi, _AROUND, endpoint=False)
    profile = [(-2.6 * np.cos(t), 1.75 * np.sin(t)) for t in np.linspace(0.02, np.pi / 2, 14)]
    profile += [(1.4, 1.75), (1.7, 1.5), (1.7, 0.02)]
    for x, radius in profile:
        rows.append(np.stack([np.full(_AROUND, x), radius * np.cos(angle), radius * np.sin(angle)], axis=1))
    return _loft(np.array(rows), close_end=True)


def box(size: tuple[float, float, float], centre: tuple[float, float, float]) -> Mesh:
    """A box with edges ``size`` around ``centre``."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], dtype=np.float32)
    faces = np.array(
        [
            [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
            [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
        ],
        dtype=np.int32,
    )  # fmt: skip
    return Mesh(corners * np.array(size, dtype=np.float32) + np.array(centre, dtype=np.float32), faces)


def scale_marks(radius_m: float, height_m: float) -> tuple[Floats, Floats]:
    """Lines of the pitch scale around z every 5 degrees from -5 to 95: points (n, 2, 3), and the labelled degrees."""
    degrees = np.arange(-5, 96, 5, dtype=np.float32)
    lines = []
    for degree in degrees:
        length = 0.5 if degree % 45 == 0 or degree == 95 else 0.2
        direction = _pitch_direction(float(degree))
        lines.append(np.stack([direction * radius_m, direction * (radius_m + length)]))
    points = np.array(lines, dtype=np.float32)
    points[:, :, 2] = height_m
    return points, degrees


def _pitch_direction(degree: float) -> Floats:
    """Where the trailing edge points at this pitch angle: in the rotor plane at 0, downwind at 90."""
    angle = np.radians(degree)
    return np.array([np.sin(angle), -np.cos(angle), 0.0], dtype=np.float32)


def quaternion(axis: tuple[float, float, float], angle_deg: float) -> tuple[float, float, float, float]:
    """Rotation by ``angle_deg`` around the unit vector ``axis`` as (w, x, y, z)."""
    half = np.radians(angle_deg) / 2
    w, s = float(np.cos(half)), float(np.sin(half))
    return (w, axis[0] * s, axis[1] * s, axis[2] * s)


def _smooth(fraction: float) -> float:
    return float(fraction * fraction * (3 - 2 * fraction))


def _loft(rings: npt.NDArray[np.floating], close_end: bool) -> Mesh:
    """Skin over rings (rows, around, 3) of equal length; ``close_end`` closes the last ring by its centre."""
    rows, around = rings.shape[:2]
    vertices = rings.reshape(-1, 3)
    first = np.arange(around)
    second = (first + 1) % around
    quads = [
        np.concatenate(
            [
                np.stack([first + r * around, second + r * around, second + (r + 1) * around], axis=1),
                np.stack([first + r * around, second + (r + 1) * around, first + (r + 1) * around], axis=1),
            ]
        )
        for r in range(rows - 1)
    ]
    if close_end:
        last = (rows - 1) * around
        vertices = np.concatenate([vertices, rings[-1].mean(axis=0, keepdims=True)])
        centre = np.full(around, rows * around)
        quads.append(np.stack([first + last, second + last, centre], axis=1))
    return Mesh(vertices.astype(np.float32), np.concatenate(quads).astype(np.int32))
