"""Cylinders and the blade they turn, as meshes and as a viewer hears them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from app.scene import actuator, cylinders
from app.scene.actuator import cylinder_node, rod_at, turn_of
from app.scene.cameras import CAMERAS
from app.scene.client import scene_facts
from app.scene.hub import ActuatorPose, BladeState, CylinderPose, HubScene
from app.scene.solids import Mesh, quaternion
from tests.scene.meshes import open_edges, volume_m3
from tests.scene.viewer import Viewer, viewing

DEADLINE_S = 10.0
AXIS = (1.0, 0.0, 0.0)
BLADE = f"{actuator.actuator_node(1)}/blade"
FIRST, SECOND = cylinder_node(1, 1), cylinder_node(1, 2)
MESHES: dict[str, Callable[[], Mesh]] = {
    "barrel": cylinders.barrel, "foot": cylinders.foot, "valve": cylinders.valve, "rod": cylinders.rod,
    "ghost": cylinders.ghost, "pointer": cylinders.pointer, "rail": cylinders.rail, "ticks": cylinders.ticks,
    "low": lambda: cylinders.limit(False), "high": lambda: cylinders.limit(True), "halo": cylinders.halo,
    "frame": lambda: cylinders.frame(2), "disc": cylinders.disc, "mark": cylinders.mark, "crank": cylinders.crank,
    "blade": cylinders.blade,
}  # fmt: skip
Changes = dict[str, Any]


def pose(*poses: CylinderPose, angle_deg: float | None = 40.0, coupled: bool = False) -> ActuatorPose:
    return ActuatorPose(poses, angle_deg, poses[0].state, coupled)


ENABLED, UNTOLD = BladeState.ENABLED, CylinderPose(None, BladeState.UNKNOWN)


@pytest.fixture
def scene() -> Iterator[HubScene]:
    started = HubScene("a secret of this test")
    yield started
    started.close()


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.01)


def rod_of(viewer: Viewer, cylinder: str) -> float | None:
    """How far the eye of the rod is from the foot of its cylinder, m."""
    place = viewer.places.get(f"{cylinder}/rod")
    return None if place is None else place[0]


@pytest.mark.parametrize("name", MESHES)
def test_every_part_is_closed_and_looks_outwards(name: str) -> None:
    mesh = MESHES[name]()
    assert open_edges(mesh) == 0
    assert volume_m3(mesh) > 0


def test_a_rod_is_held_by_its_tube_wherever_it_is() -> None:
    """Its inner end never leaves the tube, and never reaches the foot."""
    inner = float(cylinders.rod().vertices[:, 0].min())
    tube = cylinders.barrel().vertices[:, 0]
    assert rod_at(1.0)[0] + inner < tube.max()
    assert rod_at(0.0)[0] + inner > tube.min()


def test_a_cylinder_is_turned_into_the_plane_across_the_axis() -> None:
    """Made along +x; at 0 it points to +y, at 90 degrees up; its scale stays in that plane."""
    assert turn_of(0.0) == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5))
    w, x, y, z = turn_of(90.0)
    along = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    upwards = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    assert along == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    assert upwards == pytest.approx([0.0, -1.0, 0.0], abs=1e-9)


def test_cameras_and_labels_are_there_for_each_and_see_no_other_scene() -> None:
    facts = scene_facts()
    names = [camera.name for camera in CAMERAS]
    assert names[-3:] == ["cylinders-1", "cylinders-2", "cylinders-3"]
    assert {"cylinder-1-1", "cylinder-1-2", "turned-1", "cylinder-3-2"} <= {place["id"] for place in facts["places"]}
    assert actuator.setpoint_node(1, 2) in facts["ghosts"]
    for camera in CAMERAS[-3:]:
        others = [other for other in CAMERAS if other is not camera]
        assert all(np.linalg.norm(np.subtract(camera.look_at_m, other.look_at_m)) > 30.0 for other in others)


async def test_rods_cylinders_and_blade_are_where_the_linkage_has_them(scene: HubScene) -> None:
    """Half out: the foot 1.6 m below, 2.070197 strokes of 0.8 m to the pin, the blade at 40.102 degrees."""
    async with viewing(scene) as viewer:
        half = CylinderPose(0.5, ENABLED)
        scene.show_actuators([pose(half, CylinderPose(0.25, BladeState.FAULT), angle_deg=40.102)])
        await until(lambda: rod_of(viewer, SECOND) == pytest.approx(1.820197 * 0.8, abs=1e-5))
        assert rod_of(viewer, FIRST) == pytest.approx(2.070197 * 0.8, abs=1e-5)
        assert viewer.places[FIRST] == pytest.approx((cylinders.PLANE_M, 0.0, -1.6))
        # Pin at -90 + 45 + 40.102 degrees: across 0.729251, up -0.062502; from the foot up 1.937498, so 69.374 degrees.
        assert viewer.turns[FIRST] == pytest.approx(turn_of(69.374), abs=1e-4)
        assert viewer.turns[BLADE] == pytest.approx(quaternion(AXIS, 40.102))
        crank = viewer.turns[f"{actuator.actuator_node(1)}/crank-1"]
        assert crank == pytest.approx(quaternion(AXIS, -4.898), abs=1e-4)
        colours = [tuple(viewer.updates[f"{one}/barrel"]["color"]) for one in (FIRST, SECOND)]
        assert colours == [ENABLED.rgb, BladeState.FAULT.rgb]
        assert [viewer.visible[f"{one}/halo"] for one in (FIRST, SECOND)] == [False, True]


async def test_setpoint_and_limits_are_shown_while_they_count(scene: HubScene) -> None:
    ghost = f"{actuator.setpoint_node(1, 1)}/rod"
    async with viewing(scene) as viewer:
        scene.show_actuators([pose(CylinderPose(0.5, ENABLED, 0.75, (0.1, 0.9)), UNTOLD)])
        await until(lambda: viewer.visible.get(f"{FIRST}/limit-high") is True)
        assert viewer.visible[ghost] is True
        assert viewer.places[ghost][0] == pytest.approx(rod_at(0.75)[0])
        assert viewer.places[f"{FIRST}/limit-low"][0] == pytest.approx(rod_at(0.1)[0])
        assert viewer.places[f"{FIRST}/limit-high"][0] == pytest.approx(rod_at(0.9)[0])
        scene.show_actuators([pose(CylinderPose(0.749, ENABLED, 0.75), UNTOLD)])
        await until(lambda: viewer.visible[f"{FIRST}/limit-high"] is False)
        assert viewer.visible[ghost] is False, "it is there"


async def test_what_nobody_tells_is_seen_through_and_stands_where_the_blade_has_it(scene: HubScene) -> None:
    async with viewing(scene) as viewer:
        scene.show_actuators([pose(CylinderPose(0.5, ENABLED), UNTOLD, angle_deg=40.102, coupled=True)])
        await until(lambda: rod_of(viewer, SECOND) == pytest.approx(rod_at(0.5)[0], abs=1e-4))
        assert viewer.updates[f"{SECOND}/rod/body"]["opacity"] == BladeState.UNKNOWN.opacity
        assert viewer.updates[f"{SECOND}/barrel"]["opacity"] == BladeState.UNKNOWN.opacity
        scene.show_actuators([pose(CylinderPose(0.9, BladeState.STALE), UNTOLD, angle_deg=77.0)])
        await until(lambda: viewer.updates.get(f"{FIRST}/rod/body", {}).get("opacity") == BladeState.STALE.opacity)
        assert rod_of(viewer, SECOND) == pytest.approx(rod_at(0.5)[0], abs=1e-4), "single: it is not moved by the other"


async def test_one_with_a_single_cylinder_follows_one_with_two_and_all_is_taken_away(scene: HubScene) -> None:
    async with viewing(scene) as viewer:
        scene.show_actuators([pose(CylinderPose(0.5, ENABLED), UNTOLD)])
        await until(lambda: rod_of(viewer, FIRST) == pytest.approx(rod_at(0.5)[0]))
        scene.show_actuators([pose(CylinderPose(0.2, ENABLED))])
        await until(lambda: rod_of(viewer, FIRST) == pytest.approx(rod_at(0.2)[0]))
        assert SECOND in viewer.removed
        scene.forget()
        await until(lambda: viewer.visible.get(actuator.actuator_node(1)) is False)
