"""The scene as a viewer of it hears it."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from app.scene.blade import PITCH_AXIS
from app.scene.cameras import CAMERAS, FRONT, fov_rad
from app.scene.client import bare_page, scene_facts
from app.scene.hub import BLADES, BladePose, BladeState, HubScene, RotorPose, demand_node, selected_node
from app.scene.solids import quaternion
from tests.scene.viewer import viewing

DEADLINE_S = 10.0
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def scene() -> Iterator[HubScene]:
    started = HubScene("a secret of this test")
    yield started
    started.close()


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.01)


async def test_it_knows_whether_anybody_looks(scene: HubScene) -> None:
    assert not scene.watched
    async with viewing(scene):
        await until(lambda: scene.watched)
    await until(lambda: not scene.watched)


async def test_blades_are_turned_coloured_and_haloed(scene: HubScene) -> None:
    async with viewing(scene) as viewer:
        scene.show({1: BladePose(45.0, BladeState.ENABLED), 2: BladePose(1.0, BladeState.FAULT)})
        blade = "/rotor/blade-{}/pitch"
        await until(lambda: viewer.turns.get(blade.format(2)) == pytest.approx(quaternion(PITCH_AXIS, 1.0)))
        await until(lambda: viewer.visible.get("/rotor/blade-2/halo") is True)
        assert viewer.turns[blade.format(1)] == pytest.approx(quaternion(PITCH_AXIS, 45.0))
        assert viewer.visible["/rotor/blade-1/halo"] is False
        colours = [tuple(viewer.updates[f"/rotor/blade-{n}/pitch/blade"]["color"]) for n in (1, 2)]
        assert colours == [BladeState.ENABLED.rgb, BladeState.FAULT.rgb]


async def test_what_is_old_is_seen_through_and_what_is_fresh_again_is_not(scene: HubScene) -> None:
    name = "/rotor/blade-1/pitch/blade"
    async with viewing(scene) as viewer:
        scene.show({1: BladePose(45.0, BladeState.STALE, 10.0)})
        await until(lambda: viewer.updates.get(name, {}).get("opacity") == BladeState.STALE.opacity)
        scene.show({1: BladePose(45.0, BladeState.IDLE)})
        await until(lambda: viewer.updates[name]["opacity"] is None)


async def test_the_ghost_is_at_the_demand_until_it_is_reached(scene: HubScene) -> None:
    ghost = f"{demand_node(3)}/pitch"
    async with viewing(scene) as viewer:
        scene.show({3: BladePose(80.0, BladeState.ENABLED, 10.0)})
        await until(lambda: viewer.visible.get(ghost) is True)
        assert viewer.turns[ghost] == pytest.approx(quaternion(PITCH_AXIS, 10.0))
        scene.show({3: BladePose(10.1, BladeState.ENABLED, 10.0)})
        await until(lambda: viewer.visible[ghost] is False)


async def test_rotor_and_wind_are_shown_and_forgotten(scene: HubScene) -> None:
    async with viewing(scene) as viewer:
        scene.show_rotor(RotorPose(30.0, 8.0, 10.0))
        await until(lambda: viewer.visible.get("/wind") is True)
        assert viewer.turns["/rotor"] == pytest.approx(quaternion((1.0, 0.0, 0.0), 30.0))
        scene.forget()
        await until(lambda: viewer.visible["/wind"] is False)
        assert viewer.turns["/rotor"] == pytest.approx((1.0, 0.0, 0.0, 0.0))
        await until(lambda: viewer.updates["/rotor/blade-1/pitch/blade"]["opacity"] == BladeState.UNKNOWN.opacity)


def test_the_legend_of_the_page_has_the_colours_of_the_scene() -> None:
    css = (ROOT / "frontend/src/frame/SceneDock.module.css").read_text(encoding="utf-8")
    found = dict(re.findall(r'\.sign\[data-look="(\w+)"\] \{\s*--look: rgb\(([\d ]+)\);', css))
    assert found == {state.value: " ".join(map(str, state.rgb)) for state in BladeState}


def test_every_camera_holds_what_it_is_for_in_narrow_and_wide_frames() -> None:
    for camera in CAMERAS:
        distance = float(np.linalg.norm(np.subtract(camera.position_m, camera.look_at_m)))
        for aspect in (0.4, 1.0, 2.5):
            half_height = np.tan(fov_rad(camera, aspect) / 2) * distance
            assert half_height >= camera.half_m[1] - 1e-9
            assert half_height * aspect >= camera.half_m[0] - 1e-9
    assert fov_rad(FRONT, 0.5) > fov_rad(FRONT, 1.0)


def test_the_page_gets_script_and_style_first_and_the_facts_in_it() -> None:
    page = bare_page(b"<html><head><script>theirs()</script></head></html>").decode()
    assert page.index("window.Worker") < page.index("theirs()")
    facts = scene_facts()
    assert json.dumps(facts) in page
    assert "/*SCENE*/" not in page
    assert [blade["selected"] for blade in facts["blades"]] == [selected_node(blade) for blade in BLADES]
    assert {place["id"] for place in facts["places"]} >= {"blade-1", "root-2", "mark-3-90"}
