"""The axis on a bench, as meshes and as a viewer hears it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from app.scene import shaft
from app.scene.cameras import BENCH, CAMERAS
from app.scene.client import scene_facts
from app.scene.hub import BladeState, HubScene, ShaftPose
from app.scene.solids import Mesh, quaternion
from tests.scene.meshes import open_edges, volume_m3
from tests.scene.viewer import viewing

DEADLINE_S = 10.0
AXIS = (1.0, 0.0, 0.0)
OUTPUT, REAR, DISC = "/bench/shaft-1/output", "/bench/shaft-1/rear", "/bench/shaft-1/output/disc"
MESHES: dict[str, Callable[[], Mesh]] = {
    "motor": shaft.motor, "gear": shaft.gear, "plate": shaft.plate, "dial": shaft.dial, "ticks": shaft.ticks,
    "output": shaft.output, "mark": shaft.mark, "rear": shaft.rear, "rear_mark": shaft.rear_mark, "halo": shaft.halo,
    "arrow": lambda: shaft.arrow(True), "arrow back": lambda: shaft.arrow(False),
}  # fmt: skip


@pytest.fixture
def scene() -> Iterator[HubScene]:
    started = HubScene("a secret of this test")
    yield started
    started.close()


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.01)


@pytest.mark.parametrize("name", MESHES)
def test_every_part_is_closed_and_looks_outwards(name: str) -> None:
    mesh = MESHES[name]()
    assert open_edges(mesh) == 0
    assert volume_m3(mesh) > 0


def test_the_arrow_points_the_way_it_turns() -> None:
    """From its tail to its head a positive one goes counter-clockwise for who looks at the shaft's end."""
    for positive in (True, False):
        vertices = shaft.arrow(positive).vertices
        tail, head = vertices[0][1:], vertices[-1][1:]
        across = float(tail[0] * head[1] - tail[1] * head[0])
        assert (across > 0) is positive


def test_the_bench_stands_where_no_other_camera_looks_and_its_own_sees_it() -> None:
    assert BENCH in CAMERAS
    assert "shaft" in [camera["name"] for camera in scene_facts()["cameras"]]
    (place,) = [one for one in scene_facts()["places"] if one["id"] == "shaft-1"]
    assert place["fixed"] is True
    assert np.linalg.norm(np.subtract(place["position"], BENCH.look_at_m)) < 2.0
    for camera in (other for other in CAMERAS if other is not BENCH):
        assert np.linalg.norm(np.subtract(camera.look_at_m, shaft.PLACE_M)) > 60.0


async def test_an_axis_is_turned_coloured_and_haloed_and_shows_its_direction(scene: HubScene) -> None:
    async with viewing(scene) as viewer:
        scene.show_shafts([ShaftPose(45.0, 450.0, BladeState.ENABLED, 1)], has_rotor=False)
        await until(lambda: viewer.turns.get(OUTPUT) == pytest.approx(quaternion(AXIS, 45.0)))
        assert viewer.turns[REAR] == pytest.approx(quaternion(AXIS, 90.0)), "ten times as far, and round once"
        assert tuple(viewer.updates[DISC]["color"]) == BladeState.ENABLED.rgb
        assert [viewer.visible[f"/bench/shaft-1/turns{sign}"] for sign in ("+1", "-1")] == [True, False]
        assert [viewer.visible[name] for name in ("/rotor", "/nacelle", "/tower")] == [False] * 3
        scene.show_shafts([ShaftPose(45.0, 450.0, BladeState.FAULT, -1)], has_rotor=False)
        await until(lambda: viewer.visible.get("/bench/shaft-1/halo") is True)
        assert tuple(viewer.updates[DISC]["color"]) == BladeState.FAULT.rgb
        assert [viewer.visible[f"/bench/shaft-1/turns{sign}"] for sign in ("+1", "-1")] == [False, True]


async def test_what_is_old_is_seen_through_and_what_is_not_known_does_not_turn(scene: HubScene) -> None:
    async with viewing(scene) as viewer:
        scene.show_shafts([ShaftPose(30.0, None, BladeState.STALE)], has_rotor=True)
        await until(lambda: viewer.updates.get(DISC, {}).get("opacity") == BladeState.STALE.opacity)
        assert viewer.turns.get(REAR, (1.0, 0.0, 0.0, 0.0)) == pytest.approx((1.0, 0.0, 0.0, 0.0))
        scene.show_shafts([ShaftPose(None, None, BladeState.UNKNOWN)], has_rotor=True)
        await until(lambda: viewer.updates[DISC].get("opacity") == BladeState.UNKNOWN.opacity)
        assert viewer.turns[OUTPUT] == pytest.approx(quaternion(AXIS, 30.0)), "it stays where it was seen"


async def test_a_turbine_that_follows_has_its_rotor_back_and_no_bench(scene: HubScene) -> None:
    async with viewing(scene) as viewer:
        scene.show_shafts([ShaftPose(1.0, 1.0, BladeState.IDLE)], has_rotor=False)
        await until(lambda: viewer.visible.get("/rotor") is False)
        scene.forget()
        await until(lambda: viewer.visible.get("/bench/shaft-1") is False)
        assert viewer.visible["/rotor"] is True
        scene.show_shafts([ShaftPose(2.0, 2.0, BladeState.IDLE)], has_rotor=False)
        await until(lambda: viewer.visible["/bench/shaft-1"] is True)
        assert viewer.turns[OUTPUT] == pytest.approx(quaternion(AXIS, 2.0))
