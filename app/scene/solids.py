"""Triangle meshes and the few ways in which the scene makes them. Metres; pure NumPy.

Where two smooth surfaces meet at an edge, each has vertices of its own there: the 3D client averages normals over
shared vertices, so that shared means smooth and doubled means sharp. All faces look outwards (counter-clockwise).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int32]
Vector = tuple[float, float, float]

AROUND: Final = 48
"""Corners of what is drawn round."""


class Mesh(NamedTuple):
    """Triangles: ``vertices`` (n, 3) in metres, ``faces`` (m, 3) as indices."""

    vertices: Floats
    faces: Faces

    def moved(self, offset: Vector) -> Mesh:
        """The same, shifted."""
        return Mesh(self.vertices + np.array(offset), self.faces)

    def turned(self, axis: Vector, angle_deg: float) -> Mesh:
        """The same, turned right-handed about the unit vector ``axis`` through the origin."""
        return Mesh(self.vertices @ rotation(axis, angle_deg).T, self.faces)


def merged(meshes: Iterable[Mesh]) -> Mesh:
    """Several meshes as one."""
    vertices: list[Floats] = []
    faces: list[Faces] = []
    count = 0
    for mesh in meshes:
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + count)
        count += len(mesh.vertices)
    return Mesh(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))


def rotation(axis: Vector, angle_deg: float) -> Floats:
    """The matrix (3, 3) that turns right-handed by ``angle_deg`` about the unit vector ``axis`` (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.radians(angle_deg)
    matrix: Floats = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)
    return matrix


def quaternion(axis: Vector, angle_deg: float) -> tuple[float, float, float, float]:
    """Rotation by ``angle_deg`` about the unit vector ``axis`` as (w, x, y, z)."""
    half = np.radians(angle_deg) / 2
    w, s = float(np.cos(half)), float(np.sin(half))
    return (w, axis[0] * s, axis[1] * s, axis[2] * s)


def lofted(rings: Floats, *, caps: bool = True) -> Mesh:
    """Skin over closed rings (rows, around, 3); ``caps`` closes the first and the last by flat faces of their own.

    The rings run counter-clockwise seen from where the rows lead to.
    """
    rows, around = rings.shape[:2]
    first = np.arange(around)
    second = (first + 1) % around
    strips = []
    for row in range(rows - 1):
        low, high = row * around, (row + 1) * around
        strips.append(np.stack([first + low, second + low, second + high], axis=1))
        strips.append(np.stack([first + low, second + high, first + high], axis=1))
    side = Mesh(rings.reshape(-1, 3).astype(np.float64), np.concatenate(strips).astype(np.int32))
    if not caps:
        return side
    return merged([side, _cap(rings[0], upwards=False), _cap(rings[-1], upwards=True)])


def revolved(runs: Sequence[Sequence[tuple[float, float]]], around: int = AROUND) -> Mesh:
    """A body of revolution about z from runs of (height, radius), smooth within a run and sharp between runs.

    The first run begins where the body begins and the last ends where it ends; an end with a radius is closed flat.
    """
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    bodies = []
    for run in runs:
        rings = np.array([np.column_stack([circle * radius, np.full(around, height)]) for height, radius in run])
        bodies.append(lofted(rings, caps=False))
    (start, start_radius), (end, end_radius) = runs[0][0], runs[-1][-1]
    bodies.append(_cap(np.column_stack([circle * start_radius, np.full(around, start)]), upwards=False))
    bodies.append(_cap(np.column_stack([circle * end_radius, np.full(around, end)]), upwards=True))
    return merged(bodies)


def cylinder(radius_m: float, low_m: float, high_m: float, around: int = AROUND) -> Mesh:
    """A cylinder about z."""
    return revolved([[(low_m, radius_m), (high_m, radius_m)]], around)


def tube(inner_m: float, outer_m: float, low_m: float, high_m: float, around: int = AROUND) -> Mesh:
    """A ring of rectangular section about z."""
    corners = [(low_m, inner_m), (low_m, outer_m), (high_m, outer_m), (high_m, inner_m), (low_m, inner_m)]
    return _ring_of(list(pairwise(corners)), around)


def torus(radius_m: float, thickness_m: float, height_m: float, around: int = AROUND) -> Mesh:
    """A round ring about z; ``thickness_m`` is the diameter of its section."""
    corners = 12
    turns = np.linspace(0, 2 * np.pi, corners, endpoint=False) - np.pi / 2
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    rings = np.array(
        [
            np.column_stack(
                [
                    np.cos(angle) * (radius_m + np.cos(turn) * thickness_m / 2),
                    np.sin(angle) * (radius_m + np.cos(turn) * thickness_m / 2),
                    np.full(around, height_m + np.sin(turn) * thickness_m / 2),
                ]
            )
            for turn in turns
        ]
    )
    closed = lofted(np.concatenate([rings, rings[:1]]), caps=False)
    return Mesh(closed.vertices[: corners * around], closed.faces % (corners * around))


def box(size: Vector, centre: Vector) -> Mesh:
    """A box with edges ``size`` around ``centre``."""
    x, y, z = size[0] / 2, size[1] / 2, size[2] / 2
    low = np.array([[-x, -y, -z], [x, -y, -z], [x, y, -z], [-x, y, -z]])
    sides = [low, low * (1, 1, -1)]
    faces = []
    for corner in range(4):
        after = (corner + 1) % 4
        quad = np.array([sides[0][corner], sides[0][after], sides[1][after], sides[1][corner]])
        faces.append(Mesh(quad, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)))
    body = merged([*faces, _cap(sides[0], upwards=False), _cap(sides[1], upwards=True)])
    return body.moved(centre)


def _ring_of(edges: Sequence[tuple[tuple[float, float], tuple[float, float]]], around: int) -> Mesh:
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    parts = []
    for edge in edges:
        rings = np.array([np.column_stack([circle * radius, np.full(around, height)]) for height, radius in edge])
        parts.append(lofted(rings, caps=False))
    return merged(parts)


def _cap(ring: Floats, *, upwards: bool) -> Mesh:
    """A closed ring (around, 3) filled from its middle; seen from the end of the rows where ``upwards``."""
    around = len(ring)
    vertices = np.concatenate([ring, ring.mean(axis=0, keepdims=True)])
    first = np.arange(around)
    second = (first + 1) % around
    centre = np.full(around, around)
    columns = [first, second, centre] if upwards else [second, first, centre]
    return Mesh(vertices.astype(np.float64), np.stack(columns, axis=1).astype(np.int32))
