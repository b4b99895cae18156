"""The rotor as a scene: the latest angles of the live state, coloured by state, on a turning hub; or what a bench has.

Only what was seen on the wire moves anything; what is stale or unknown is shown as such (grey, seen through), never
guessed. The scene is one for all viewers; what differs between them (camera, selection, nose, ghosts) each view sets
for itself by the nodes named here (``app.scene.client``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import viser

from app.scene import machinery, marks
from app.scene.actuator import Actuators
from app.scene.blade import PITCH_AXIS, ROOT_M, TIP_M, blade_mesh, root_radius_m
from app.scene.cameras import FRONT, fov_rad
from app.scene.look import (
    UNKNOWN_BLADE,
    UNKNOWN_ROTOR,
    ActuatorPose,
    BladePose,
    BladeState,
    CylinderPose,
    Rgb,
    RotorPose,
    ShaftPose,
)
from app.scene.server import start_server
from app.scene.shaft import Shafts
from app.scene.solids import Mesh, quaternion, torus

__all__ = [
    "BLADES",
    "ActuatorPose",
    "BladePose",
    "BladeState",
    "CylinderPose",
    "HubScene",
    "RotorPose",
    "ShaftPose",
]

BLADES: Final = (1, 2, 3)
ROTOR: Final = "/rotor"
NOSE: Final = f"{ROTOR}/nose"
_SHAFT: Final = (1.0, 0.0, 0.0)
_UP: Final = (0.0, 0.0, 1.0)
_TOWER_M: Final = 26.0
_WIND_AT_M: Final = (-4.0, TIP_M * 0.62, -TIP_M * 0.62)
"""Beside the tower, where no blade hides it for long."""
_WIND_LENGTH_M: Final = 0.8
"""Of the arrow, for each m/s of wind."""
_WHITE: Final[Rgb] = (226, 231, 236)
_GROUND: Final[Rgb] = (138, 150, 162)
"""Nacelle and tower: there, but not what one looks for."""
_CAST: Final[Rgb] = (120, 130, 140)
_STEEL: Final[Rgb] = (78, 88, 99)
_DARK: Final[Rgb] = (44, 52, 61)
_DRIVE: Final[Rgb] = (58, 110, 165)
_MOTOR: Final[Rgb] = (40, 78, 120)
_BATTERY: Final[Rgb] = (196, 150, 60)
_CABINET: Final[Rgb] = (190, 197, 204)
_MARK: Final[Rgb] = (245, 247, 250)
_NAMED: Final[Rgb] = (255, 205, 70)
_FEATHER: Final[Rgb] = (88, 214, 141)
_POINTER: Final[Rgb] = (255, 120, 60)
_SELECTED: Final[Rgb] = (60, 150, 255)
_WIND: Final[Rgb] = (90, 190, 255)
_GHOST: Final[Rgb] = (150, 205, 255)
_GHOST_OPACITY: Final = 0.40
_HALO_OPACITY: Final = 0.75


def blade_node(blade: int) -> str:
    """The node of a blade's station: turns with the rotor, not with the pitch."""
    return f"{ROTOR}/blade-{blade}"


def selected_node(blade: int) -> str:
    """What marks the blade as selected; each view shows or hides it."""
    return f"{blade_node(blade)}/selected"


def demand_node(blade: int) -> str:
    """What holds the ghost at the demanded angle; each view shows or hides it."""
    return f"{blade_node(blade)}/demand"


class _Blade:
    """The nodes of one blade."""

    def __init__(self, scene: viser.SceneApi, blade: int) -> None:
        self._scene = scene
        root = blade_node(blade)
        scene.add_frame(root, wxyz=quaternion(_SHAFT, 120.0 * (blade - 1)), show_axes=False)
        self._add_machinery(root)
        self._add_scale(root)
        self.pitch = scene.add_frame(f"{root}/pitch", show_axes=False)
        self.mesh = self._mesh(f"{root}/pitch/blade", blade_mesh(), BladeState.UNKNOWN.rgb)
        # A node must have a callback to tell of clicks at all; the view takes it from there, for its own page alone.
        self.mesh.on_click(_only_select)
        self._mesh(f"{root}/pitch/bolts", machinery.bolts(), _STEEL)
        self._mesh(f"{root}/pitch/pointer", marks.pointer(), _POINTER)
        self.halo = self._mesh(f"{root}/halo", machinery.halo(), BladeState.FAULT.rgb, opacity=_HALO_OPACITY)
        self.halo.visible = False
        scene.add_frame(demand_node(blade), show_axes=False)
        self.ghost = scene.add_frame(f"{demand_node(blade)}/pitch", show_axes=False, visible=False)
        self._mesh(f"{demand_node(blade)}/pitch/ghost", blade_mesh(), _GHOST, opacity=_GHOST_OPACITY)
        scene.add_frame(selected_node(blade), show_axes=False, visible=False)
        ring = torus(root_radius_m() * 1.32, 0.13, ROOT_M + 0.25)
        self._mesh(f"{selected_node(blade)}/ring", ring, _SELECTED)

    def _add_machinery(self, root: str) -> None:
        self._mesh(f"{root}/bearing", machinery.bearing(), _STEEL)
        self._mesh(f"{root}/drive", machinery.drive(), _DRIVE)
        self._mesh(f"{root}/motor", machinery.motor(), _MOTOR)
        self._mesh(f"{root}/battery", machinery.battery(), _BATTERY)
        self._mesh(f"{root}/cabinet", machinery.cabinet(), _CABINET)

    def _add_scale(self, root: str) -> None:
        self._mesh(f"{root}/collar", marks.collar(), _DARK)
        self._mesh(f"{root}/ticks", marks.ticks(), _MARK)
        self._mesh(f"{root}/named", marks.named_ticks(), _NAMED)
        self._mesh(f"{root}/feather", marks.feather_tick(), _FEATHER)

    def _mesh(self, name: str, mesh: Mesh, colour: Rgb, opacity: float | None = None) -> Any:
        return _add(self._scene, name, mesh, colour, opacity)

    def show(self, pose: BladePose, before: BladePose | None) -> None:
        """Change what is different from ``before``."""
        if pose.angle_deg is not None and (before is None or before.angle_deg != pose.angle_deg):
            self.pitch.wxyz = quaternion(PITCH_AXIS, pose.angle_deg)
        if before is None or before.state is not pose.state:
            self.mesh.color = pose.state.rgb
            self.mesh.opacity = None if pose.state.opacity == 1.0 else pose.state.opacity
            self.halo.visible = pose.state is BladeState.FAULT
        if pose.demand_deg is not None and (before is None or before.demand_deg != pose.demand_deg):
            self.ghost.wxyz = quaternion(PITCH_AXIS, pose.demand_deg)
        if before is None or before.shows_demand is not pose.shows_demand:
            self.ghost.visible = pose.shows_demand


class HubScene:
    """A rotor of three blades in its own 3D server. Its methods may be called from any one thread at a time."""

    def __init__(self, secret: str) -> None:
        self.secret = secret
        """What a request must carry in ``app.scene.server.SECRET_HEADER``."""
        self._server = start_server(secret)
        self._shown: dict[int, BladePose] = {}
        self._rotor_shown = UNKNOWN_ROTOR
        scene = self._server.scene
        self._set_up(self._server)
        self._rotor = scene.add_frame(ROTOR, show_axes=False)
        _add(scene, f"{ROTOR}/casting", machinery.casting(), _CAST)
        _add(scene, NOSE, machinery.nose(), _WHITE)
        nacelle = _add(scene, "/nacelle", machinery.nacelle(), _GROUND)
        tower = _add(scene, "/tower", machinery.tower(_TOWER_M), _GROUND)
        self._turbine = (self._rotor, nacelle, tower)
        self._has_rotor = True
        self._shafts = Shafts(scene)
        self._actuators = Actuators(scene)
        self._wind = scene.add_frame("/wind", position=_WIND_AT_M, show_axes=False, visible=False)
        self._arrow = _add(scene, "/wind/arrow", machinery.arrow().moved((-1.0, 0.0, 0.0)), _WIND)
        self._blades = {blade: _Blade(scene, blade) for blade in BLADES}
        self.forget()

    @property
    def port(self) -> int:
        """The loopback port of the 3D server."""
        return int(self._server.get_port())

    @property
    def watched(self) -> bool:
        """Somebody looks at it."""
        return bool(self._server.get_clients())

    def show(self, poses: Mapping[int, BladePose]) -> None:
        """Move and colour the blades; what did not change is not sent."""
        with self._server.atomic():
            for blade, pose in poses.items():
                before = self._shown.get(blade)
                if before != pose and blade in self._blades:
                    self._shown[blade] = pose
                    self._blades[blade].show(pose, before)

    def show_shafts(self, poses: Sequence[ShaftPose], has_rotor: bool) -> None:
        """Turn and colour the axes that have no blade. Without ``has_rotor`` there is none: a bench is all there is."""
        with self._server.atomic():
            self._shafts.show(poses)
            if has_rotor is not self._has_rotor:
                self._has_rotor = has_rotor
                for one in self._turbine:
                    one.visible = has_rotor

    def show_actuators(self, poses: Sequence[ActuatorPose]) -> None:
        """Move and colour the cylinders and what they turn; what did not change is not sent."""
        with self._server.atomic():
            self._actuators.show(poses)

    def show_rotor(self, pose: RotorPose) -> None:
        """Turn the rotor and the wind's arrow; what did not change is not sent."""
        before, self._rotor_shown = self._rotor_shown, pose
        if pose == before:
            return
        with self._server.atomic():
            if pose.azimuth_deg != before.azimuth_deg:
                self._rotor.wxyz = quaternion(_SHAFT, pose.azimuth_deg or 0.0)
            known = pose.wind_mps is not None and pose.wind_deg is not None
            if pose.wind_mps is not None and pose.wind_deg is not None:
                self._arrow.scale = max(1.0, pose.wind_mps * _WIND_LENGTH_M)
                # Who stands on the nacelle and looks upwind has +y at the right, from where positive wind comes.
                self._wind.wxyz = quaternion(_UP, -pose.wind_deg)
            if self._wind.visible is not known:
                self._wind.visible = known

    def forget(self) -> None:
        """Show nothing as known, so that who looks next sees nothing that is over."""
        self.show(dict.fromkeys(BLADES, UNKNOWN_BLADE))
        self.show_rotor(UNKNOWN_ROTOR)
        self.show_shafts((), True)
        self.show_actuators(())

    def played(self, stills: Iterable[tuple[Mapping[int, BladePose], RotorPose, float]]) -> str:
        """A page that shows ``stills``, each so many seconds long, over and over; what this one shows is its beginning.

        It is one HTML document that loads nothing.
        """
        tape = self._server.get_scene_serializer()
        for blades, rotor, lasts_s in stills:
            self.show(blades)
            self.show_rotor(rotor)
            tape.insert_sleep(lasts_s)
        return tape.as_html()

    def close(self) -> None:
        """Stop the server."""
        self._server.stop()

    @staticmethod
    def _set_up(server: viser.ViserServer) -> None:
        scene = server.scene
        scene.set_up_direction("+z")
        scene.world_axes.visible = False
        # Shadows cost more than all the rest, and reach only 20 m from the camera.
        scene.configure_default_lights(True, cast_shadow=False)
        scene.add_light_directional("/upwind", color=(255, 250, 240), intensity=1.1, position=(-30.0, -18.0, 14.0))
        server.initial_camera.fov = fov_rad(FRONT, 1.0)
        server.initial_camera.position = FRONT.position_m
        server.initial_camera.look_at = FRONT.look_at_m


def _only_select(_event: object) -> None:
    """Nothing: a click in the 3D view can select an axis on its own page, and nothing else."""


def _add(scene: viser.SceneApi, name: str, mesh: Mesh, colour: Rgb, opacity: float | None = None) -> Any:
    return scene.add_mesh_simple(
        name, mesh.vertices, mesh.faces, color=colour, opacity=opacity, cast_shadow=False, receive_shadow=False
    )
