"""A motor with its gear on a bench: what is seen of an axis that turns no blade.

Drawn several times its size, so that the marks are seen; proportions are usual ones, no maker's. The output shaft
points along +x, towards who looks; positive is counter-clockwise for him (right-handed about +x), the mark is up at 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import viser

from app.scene.look import BladeState, Rgb, ShaftPose
from app.scene.solids import Mesh, Vector, box, cylinder, lofted, merged, quaternion, torus, tube

BENCH: Final = "/bench"
PLACE_M: Final[Vector] = (0.0, 0.0, -90.0)
"""Where benches stand: far below the rotor, so that neither is in the other's picture."""
MOST: Final = 4
"""So many axes stand side by side; a bench has seldom two."""
APART_M: Final = 1.5
LABEL_M: Final[Vector] = (0.9, 0.0, 0.98)
_AXIS: Final[Vector] = (1.0, 0.0, 0.0)
_ALONG: Final[Vector] = (0.0, 1.0, 0.0)
"""Turning by 90 degrees about y brings z to x: bodies of revolution are made about z."""
_DISC_M: Final = 0.44
_ARROW_FROM_DEG: Final = 35.0
_ARROW_TO_DEG: Final = 118.0
_HEAD_DEG: Final = 16.0
_ARROW_M: Final = 0.68
_STEEL: Final[Rgb] = (128, 138, 148)
_GEAR: Final[Rgb] = (90, 100, 112)
_MOTOR: Final[Rgb] = (40, 78, 120)
_PLATE: Final[Rgb] = (150, 160, 170)
_MARK: Final[Rgb] = (255, 120, 60)
_SCALE: Final[Rgb] = (245, 247, 250)
_DARK: Final[Rgb] = (44, 52, 61)
_ARROW: Final[Rgb] = (88, 214, 141)
_HALO_OPACITY: Final = 0.75


def shaft_node(number: int) -> str:
    """The node of the axis ``number``, from 1."""
    return f"{BENCH}/shaft-{number}"


def place_of(number: int) -> Vector:
    """Where the axis ``number`` stands."""
    x, y, z = PLACE_M
    return (x, y + APART_M * (number - 1), z)


def motor() -> Mesh:
    """The motor: a square body with end shields, and the connector."""
    body = box((1.0, 0.80, 0.80), (-1.0, 0.0, 0.0))
    shields = [box((0.10, 0.86, 0.86), (x, 0.0, 0.0)) for x in (-1.52, -0.48)]
    return merged([body, *shields, box((0.24, 0.34, 0.16), (-1.25, 0.0, 0.48))])


def gear() -> Mesh:
    """The gear between motor and output shaft, with its flange."""
    body = cylinder(0.36, -0.43, 0.28).turned(_ALONG, 90)
    return merged([body, tube(0.10, 0.45, 0.20, 0.30).turned(_ALONG, 90)])


def plate() -> Mesh:
    """What all of it is bolted to."""
    return merged([box((2.6, 1.05, 0.10), (-0.45, 0.0, -0.62)), box((0.5, 0.5, 0.16), (-1.0, 0.0, -0.49))])


def dial() -> Mesh:
    """The ring that stands still behind the disc."""
    return tube(_DISC_M * 1.02, _DISC_M * 1.30, 0.55, 0.60).turned(_ALONG, 90)


def ticks() -> Mesh:
    """Marks of the dial every 30 degrees, long ones every 90."""
    return merged(_tick(degrees, 0.11 if degrees % 90 == 0 else 0.06) for degrees in range(0, 360, 30))


def output() -> Mesh:
    """The output shaft with the disc on its end, as it stands at 0."""
    return merged([cylinder(0.12, 0.28, 0.60).turned(_ALONG, 90), cylinder(_DISC_M, 0.58, 0.68).turned(_ALONG, 90)])


def mark() -> Mesh:
    """The mark on the disc: a bar from its middle to its edge, and over the edge."""
    bar = box((0.05, 0.07, _DISC_M * 0.98), (0.70, 0.0, _DISC_M * 0.49))
    return merged(
        [bar, box((0.12, 0.07, 0.05), (0.64, 0.0, _DISC_M + 0.02)), cylinder(0.09, 0.68, 0.73).turned(_ALONG, 90)]
    )


def rear() -> Mesh:
    """The rear end of the motor's shaft."""
    return cylinder(0.26, -1.66, -1.58).turned(_ALONG, 90)


def rear_mark() -> Mesh:
    """The mark on it, seen from the side as well."""
    return box((0.14, 0.06, 0.20), (-1.63, 0.0, 0.20))


def arrow(positive: bool) -> Mesh:
    """A bent arrow round the disc, in the direction of turning."""
    profile = [(angle, 0.028) for angle in np.linspace(_ARROW_FROM_DEG, _ARROW_TO_DEG, 16)]
    profile += [(_ARROW_TO_DEG, 0.085), (_ARROW_TO_DEG + _HEAD_DEG, 0.004)]
    bent = lofted(np.array([_section(angle, radius) for angle, radius in profile]))
    # Half a turn about the vertical axis has it point the other way round.
    return (bent if positive else bent.turned((0.0, 0.0, 1.0), 180.0)).moved((0.62, 0.0, 0.0))


def halo() -> Mesh:
    """What shines around an axis with a fault."""
    return merged([torus(_DISC_M * 1.8, 0.07, 0.56), torus(_DISC_M * 2.1, 0.04, 0.56)]).turned(_ALONG, 90)


def _tick(degrees: float, length_m: float) -> Mesh:
    middle = _DISC_M * 1.30 - length_m / 2
    return box((0.03, 0.04, length_m), (0.61, 0.0, middle)).turned(_AXIS, float(degrees))


def _section(angle_deg: float, radius_m: float) -> Any:
    """A circle across the arrow's bend at ``angle_deg`` from up, counter-clockwise seen from where it leads to."""
    angle = np.radians(angle_deg + 90.0)
    outwards = np.array([0.0, np.cos(angle), np.sin(angle)])
    turns = np.linspace(0, 2 * np.pi, 10, endpoint=False)[:, None]
    across = np.cos(turns) * np.array(_AXIS) + np.sin(turns) * outwards
    return outwards * _ARROW_M + across * radius_m


class Shaft:
    """The nodes of one axis; ``number`` from 1."""

    def __init__(self, scene: viser.SceneApi, number: int) -> None:
        self._scene = scene
        root = shaft_node(number)
        self.frame = scene.add_frame(root, position=place_of(number), show_axes=False)
        for name, mesh, colour in (
            ("motor", motor(), _MOTOR), ("gear", gear(), _GEAR), ("plate", plate(), _PLATE),
            ("dial", dial(), _DARK), ("ticks", ticks(), _SCALE),
        ):  # fmt: skip
            self._mesh(f"{root}/{name}", mesh, colour)
        self.turning = scene.add_frame(f"{root}/output", show_axes=False)
        self.disc = self._mesh(f"{root}/output/disc", output(), BladeState.UNKNOWN.rgb)
        self._mesh(f"{root}/output/mark", mark(), _MARK)
        self.rear = scene.add_frame(f"{root}/rear", show_axes=False)
        self._mesh(f"{root}/rear/end", rear(), _STEEL)
        self._mesh(f"{root}/rear/mark", rear_mark(), _MARK)
        self.arrows = {sign: self._mesh(f"{root}/turns{sign:+}", arrow(sign > 0), _ARROW) for sign in (1, -1)}
        self.halo = self._mesh(f"{root}/halo", halo(), BladeState.FAULT.rgb, _HALO_OPACITY)
        self.halo.visible = False
        for one in self.arrows.values():
            one.visible = False

    def _mesh(self, name: str, mesh: Mesh, colour: Rgb, opacity: float | None = None) -> Any:
        return self._scene.add_mesh_simple(
            name, mesh.vertices, mesh.faces, color=colour, opacity=opacity, cast_shadow=False, receive_shadow=False
        )

    def show(self, pose: ShaftPose, before: ShaftPose | None) -> None:
        """Change what is different from ``before``."""
        if pose.shaft_deg is not None and (before is None or before.shaft_deg != pose.shaft_deg):
            self.turning.wxyz = quaternion(_AXIS, pose.shaft_deg % 360.0)
        if pose.motor_deg is not None and (before is None or before.motor_deg != pose.motor_deg):
            self.rear.wxyz = quaternion(_AXIS, pose.motor_deg % 360.0)
        if before is None or before.state is not pose.state:
            self.disc.color = pose.state.rgb
            self.disc.opacity = None if pose.state.opacity == 1.0 else pose.state.opacity
            self.halo.visible = pose.state is BladeState.FAULT
        if before is None or before.turns != pose.turns:
            for sign, one in self.arrows.items():
                one.visible = pose.turns == sign


class Shafts:
    """All axes on the bench; nodes are made for those that are there."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._made: list[Shaft] = []
        self._shown: list[ShaftPose | None] = []
        scene.add_frame(BENCH, show_axes=False)

    def show(self, poses: Sequence[ShaftPose]) -> None:
        """Show these, the first ``MOST`` of them, and no others."""
        poses = poses[:MOST]
        while len(self._made) < len(poses):
            self._made.append(Shaft(self._scene, len(self._made) + 1))
            self._shown.append(None)
        for at, shaft in enumerate(self._made):
            pose, before = poses[at] if at < len(poses) else None, self._shown[at]
            if pose == before:
                continue
            if (pose is None) is not (before is None):
                shaft.frame.visible = pose is not None
            if pose is not None:
                shaft.show(pose, before)
            self._shown[at] = pose
