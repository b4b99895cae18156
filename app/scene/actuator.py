"""The nodes of hydraulic cylinders and of the blades that they turn: rods, setpoints, limits, states."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import viser

from app.scene import cylinders as parts
from app.scene import linkage
from app.scene.look import ActuatorPose, BladeState, CylinderPose, Rgb
from app.scene.solids import Mesh, Vector, quaternion

ROOT: Final = "/cylinders"
PLACE_M: Final[Vector] = (0.0, 0.0, -180.0)
"""Where they stand: far below the rotor and its benches, so that none is in another's picture."""
MOST: Final = 3
"""Blades of one rotor."""
APART_M: Final = 40.0
"""So far that a camera before one sees no other."""
LABELS_M: Final[tuple[Vector, ...]] = ((0.6, 1.2, -1.8), (0.6, -0.95, 1.45))
"""Places of the cylinders' labels."""
BLADE_LABEL_M: Final[Vector] = (0.3, 0.95, 1.95)
_STEEL: Final[Rgb] = (188, 196, 205)
_CAST: Final[Rgb] = (112, 122, 133)
_FRAME: Final[Rgb] = (86, 97, 109)
_RAIL: Final[Rgb] = (60, 70, 81)
_VALVE: Final[Rgb] = (58, 110, 165)
_SCALE: Final[Rgb] = (245, 247, 250)
_MARK: Final[Rgb] = (255, 120, 60)
_LIMIT: Final[Rgb] = (255, 205, 70)
_GHOST: Final[Rgb] = (150, 205, 255)
_GHOST_OPACITY: Final = 0.45
_HALO_OPACITY: Final = 0.75
_AXIS: Final = parts.AXIS
_FLAT: Final[Vector] = (0.0, 0.0, 1.0)


def actuator_node(number: int) -> str:
    """The node of what turns one blade, from 1."""
    return f"{ROOT}/actuator-{number}"


def cylinder_node(number: int, cylinder: int) -> str:
    """The node of one of its cylinders (1 or 2): where the foot is, turned to the pin of the crank."""
    return f"{actuator_node(number)}/cylinder-{cylinder}"


def setpoint_node(number: int, cylinder: int) -> str:
    """What holds the ghost of a rod; each view shows or hides it."""
    return f"{cylinder_node(number, cylinder)}/setpoint"


def place_of(number: int) -> Vector:
    """Where the actuator ``number`` stands."""
    x, y, z = PLACE_M
    return (x, y + APART_M * (number - 1), z)


def turn_of(points_deg: float) -> tuple[float, float, float, float]:
    """How a cylinder made along +x is turned so that it points so far round +x, 0 to the right (+y)."""
    return _product(quaternion(_AXIS, points_deg), quaternion(_FLAT, 90.0))


def rod_at(extension: float) -> Vector:
    """Where the eye of a rod is, from the foot of its cylinder."""
    return (parts.SHORTEST_M + extension * parts.STROKE_M, 0.0, 0.0)


class _Cylinder:
    """The nodes of one cylinder."""

    def __init__(self, scene: viser.SceneApi, number: int, cylinder: int) -> None:
        self._cylinder = cylinder
        root = cylinder_node(number, cylinder)
        self.frame = scene.add_frame(root, show_axes=False)
        self.barrel = _add(scene, f"{root}/barrel", parts.barrel(), BladeState.UNKNOWN.rgb)
        for name, mesh, colour in (
            ("foot", parts.foot(), _CAST), ("valve", parts.valve(), _VALVE), ("rail", parts.rail(), _RAIL),
            ("ticks", parts.ticks(), _SCALE),
        ):  # fmt: skip
            _add(scene, f"{root}/{name}", mesh, colour)
        self.rod = scene.add_frame(f"{root}/rod", show_axes=False)
        self._rod = [_add(scene, f"{root}/rod/body", parts.rod(), _STEEL)]
        self._rod.append(_add(scene, f"{root}/rod/pointer", parts.pointer(), _MARK))
        scene.add_frame(setpoint_node(number, cylinder), show_axes=False)
        self.ghost = scene.add_frame(f"{setpoint_node(number, cylinder)}/rod", show_axes=False, visible=False)
        _add(scene, f"{setpoint_node(number, cylinder)}/rod/ghost", parts.ghost(), _GHOST, _GHOST_OPACITY)
        self.limits = [
            _add(scene, f"{root}/limit-{name}", parts.limit(upper), _LIMIT)
            for name, upper in (("low", False), ("high", True))
        ]
        self.halo = _add(scene, f"{root}/halo", parts.halo(), BladeState.FAULT.rgb, _HALO_OPACITY)
        for one in (*self.limits, self.halo):
            one.visible = False
        self.crank = scene.add_frame(f"{actuator_node(number)}/crank-{cylinder}", show_axes=False)
        _add(scene, f"{actuator_node(number)}/crank-{cylinder}/arm", parts.crank(), _CAST)
        self.stand(0.0)

    def stand(self, extension: float) -> None:
        """Put rod, cylinder and crank where they are with the rod so far out."""
        place = linkage.place_of(self._cylinder, extension)
        y, z = (one * parts.STROKE_M for one in place.foot)
        self.frame.position = (parts.PLANE_M, y, z)
        self.frame.wxyz = turn_of(place.points_deg)
        self.rod.position = rod_at(extension)
        pin_deg = linkage.FOOT_AT_DEG[self._cylinder - 1] + linkage.FIRST_DEG + linkage.angle_deg(extension)
        self.crank.wxyz = quaternion(_AXIS, pin_deg)

    def show(self, pose: CylinderPose, before: CylinderPose | None) -> None:
        """Change all but the place, where it is different from ``before``."""
        if before is None or (before.state, before.extension is None) != (pose.state, pose.extension is None):
            self.barrel.color = pose.state.rgb
            self.barrel.opacity = _opacity(pose.state)
            rod = BladeState.UNKNOWN if pose.extension is None else pose.state
            for one in self._rod:
                one.opacity = _opacity(rod)
            self.halo.visible = pose.state is BladeState.FAULT
        if pose.setpoint is not None and (before is None or before.setpoint != pose.setpoint):
            self.ghost.position = rod_at(pose.setpoint)
        if before is None or before.shows_setpoint is not pose.shows_setpoint:
            self.ghost.visible = pose.shows_setpoint
        if before is None or before.limits != pose.limits:
            for at, one in enumerate(self.limits):
                one.visible = pose.limits is not None
                if pose.limits is not None:
                    one.position = rod_at(pose.limits[at])


class _Actuator:
    """The nodes of one or two cylinders and their blade."""

    def __init__(self, scene: viser.SceneApi, number: int, count: int) -> None:
        root = actuator_node(number)
        self.count = count
        self.frame = scene.add_frame(root, position=place_of(number), show_axes=False)
        _add(scene, f"{root}/frame", parts.frame(count), _FRAME)
        self.blade = scene.add_frame(f"{root}/blade", show_axes=False)
        _add(scene, f"{root}/blade/disc", parts.disc(), _STEEL)
        _add(scene, f"{root}/blade/mark", parts.mark(), _MARK)
        self._body = _add(scene, f"{root}/blade/body", parts.blade(), BladeState.UNKNOWN.rgb)
        self._cylinders = [_Cylinder(scene, number, cylinder) for cylinder in range(1, count + 1)]
        self._stood: list[float] = [0.0] * count

    def show(self, pose: ActuatorPose, before: ActuatorPose | None) -> None:
        """Change what is different from ``before``."""
        if pose.angle_deg is not None and (before is None or before.angle_deg != pose.angle_deg):
            self.blade.wxyz = quaternion(_AXIS, pose.angle_deg)
        if before is None or before.state is not pose.state:
            self._body.color = pose.state.rgb
            self._body.opacity = _opacity(pose.state)
        for at, (nodes, one) in enumerate(zip(self._cylinders, pose.cylinders, strict=True)):
            extension = one.extension
            if extension is None and pose.coupled and pose.angle_deg is not None:
                extension = linkage.extension_at(pose.angle_deg)  # the blade has it there
            if extension is not None and extension != self._stood[at]:
                nodes.stand(extension)
                self._stood[at] = extension
            nodes.show(one, None if before is None else before.cylinders[at])

    def remove(self) -> None:
        """Take all nodes away."""
        self.frame.remove()


class Actuators:
    """All that turns blades by cylinders; nodes are made for what is there."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._made: list[_Actuator] = []
        self._shown: list[ActuatorPose | None] = []
        scene.add_frame(ROOT, show_axes=False)

    def show(self, poses: Sequence[ActuatorPose]) -> None:
        """Show these, the first ``MOST`` of them, and no others."""
        poses = poses[:MOST]
        for at in range(max(len(poses), len(self._made))):
            pose = poses[at] if at < len(poses) else None
            if pose is not None:
                self._make(at, len(pose.cylinders))
            before = self._shown[at]
            if pose == before:
                continue
            if (pose is None) is not (before is None):
                self._made[at].frame.visible = pose is not None
            if pose is not None:
                self._made[at].show(pose, before)
            self._shown[at] = pose

    def _make(self, at: int, count: int) -> None:
        """Nodes for so many cylinders; those of another turbine may have had another number."""
        if at < len(self._made) and self._made[at].count == count:
            return
        if at < len(self._made):
            self._made[at].remove()
            self._made[at], self._shown[at] = _Actuator(self._scene, at + 1, count), None
        else:
            self._made.append(_Actuator(self._scene, at + 1, count))
            self._shown.append(None)


def _opacity(state: BladeState) -> float | None:
    return None if state.opacity == 1.0 else state.opacity


def _product(
    left: tuple[float, float, float, float], right: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """The turn ``right``, then ``left`` (quaternions w, x, y, z)."""
    a, b, c, d = left
    e, f, g, h = right
    return (
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    )


def _add(scene: viser.SceneApi, name: str, mesh: Mesh, colour: Rgb, opacity: float | None = None) -> Any:
    return scene.add_mesh_simple(
        name, mesh.vertices, mesh.faces, color=colour, opacity=opacity, cast_shadow=False, receive_shadow=False
    )
