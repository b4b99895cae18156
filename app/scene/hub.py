"""The hub with its blades as a scene: the latest angles of the live state, coloured by state.

Only what was seen on the wire moves a blade; a value that is stale or unknown is shown as such (grey), never guessed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

import numpy as np
import viser

from app.scene import geometry
from app.scene.client import CAMERA_M, FOV_RAD, LOOK_AT_M
from app.scene.server import start_server


class BladeState(Enum):
    """How a blade looks. The value is its colour (red, green, blue)."""

    UNKNOWN = (120, 124, 130)
    STALE = (90, 94, 100)
    IDLE = (222, 226, 230)
    ENABLED = (96, 178, 255)
    WARNING = (245, 176, 65)
    FAULT = (231, 76, 60)


@dataclass(frozen=True, slots=True)
class BladePose:
    """What is shown of one blade: ``angle_deg`` None where no angle was ever seen."""

    angle_deg: float | None
    state: BladeState
    label: str


BLADES: Final = (1, 2, 3)
_LABEL_SCALE: Final = 1.3
_HUB_COLOUR: Final = (176, 184, 192)
_BEARING_COLOUR: Final = (88, 98, 110)
_MARK_COLOUR: Final = (255, 200, 60)


class HubScene:
    """A rotor of three blades in its own 3D server. ``show`` may be called from any thread."""

    def __init__(self, secret: str) -> None:
        self.secret = secret
        """What a request must carry in ``app.scene.server.SECRET_HEADER``."""
        self._server = start_server(secret)
        self._pitch: dict[int, Any] = {}
        self._mesh: dict[int, Any] = {}
        self._label: dict[int, Any] = {}
        self._shown: dict[int, BladePose] = {}
        self._build(self._server)

    @property
    def port(self) -> int:
        """The loopback port of the 3D server."""
        return int(self._server.get_port())

    def show(self, poses: Mapping[int, BladePose]) -> None:
        """Move and colour the blades; what did not change is not sent."""
        with self._server.atomic():
            for blade, pose in poses.items():
                if self._shown.get(blade) != pose and blade in self._pitch:
                    self._show(blade, pose)

    def close(self) -> None:
        """Stop the server."""
        self._server.stop()

    def _show(self, blade: int, pose: BladePose) -> None:
        before = self._shown.get(blade)
        self._shown[blade] = pose
        if pose.angle_deg is not None and (before is None or before.angle_deg != pose.angle_deg):
            self._pitch[blade].wxyz = geometry.quaternion((0.0, 0.0, 1.0), pose.angle_deg)
        if before is None or before.state is not pose.state:
            self._mesh[blade].color = pose.state.value
        if before is None or before.label != pose.label:
            self._label[blade].text = pose.label

    def _build(self, server: viser.ViserServer) -> None:
        scene = server.scene
        scene.set_up_direction("+z")
        scene.world_axes.visible = False
        scene.configure_default_lights(True)
        server.initial_camera.fov = FOV_RAD
        server.initial_camera.position = CAMERA_M
        server.initial_camera.look_at = LOOK_AT_M
        spinner = geometry.spinner()
        scene.add_mesh_simple("/hub", spinner.vertices, spinner.faces, color=_HUB_COLOUR)
        for blade in BLADES:
            self._build_blade(server, blade)

    def _build_blade(self, server: viser.ViserServer, blade: int) -> None:
        scene = server.scene
        root = f"/rotor/blade-{blade}"
        azimuth = geometry.quaternion((1.0, 0.0, 0.0), 120.0 * (blade - 1))
        scene.add_frame(root, wxyz=azimuth, show_axes=False)
        bearing = geometry.ring(geometry.ROOT_RADIUS_M * 1.05, 0.35, geometry.HUB_RADIUS_M - 0.1)
        scene.add_mesh_simple(f"{root}/bearing", bearing.vertices, bearing.faces, color=_BEARING_COLOUR)
        marks, _degrees = geometry.scale_marks(geometry.ROOT_RADIUS_M * 1.35, geometry.HUB_RADIUS_M + 0.3)
        scene.add_line_segments(f"{root}/scale", marks, colors=_MARK_COLOUR, thickness=2.0, thickness_units="screen")
        self._pitch[blade] = scene.add_frame(f"{root}/pitch", show_axes=False)
        mesh = geometry.blade()
        self._mesh[blade] = scene.add_mesh_simple(
            f"{root}/pitch/blade", mesh.vertices, mesh.faces, color=BladeState.UNKNOWN.value, side="double"
        )
        pointer = geometry.box((0.12, 0.75, 0.12), (0.0, -geometry.ROOT_RADIUS_M * 1.35 - 0.3, 0.0))
        lifted = pointer.vertices + np.array([0.0, 0.0, geometry.HUB_RADIUS_M + 0.3], dtype=np.float32)
        scene.add_mesh_simple(f"{root}/pitch/pointer", lifted, pointer.faces, color=_MARK_COLOUR)
        place = (0.0, 0.0, geometry.HUB_RADIUS_M + geometry.SPAN_M * 0.62)
        self._label[blade] = scene.add_label(
            f"{root}/label", f"{blade}", position=place, font_screen_scale=_LABEL_SCALE, anchor="center-center"
        )
