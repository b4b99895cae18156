"""Cylinders of a twin that moves, by its wire and a real 3D server; and the same of what was recorded of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from app.drivers.profibus_driver import ProfibusDriver
from app.model.description import Verify
from app.model.description_file import load_builtin
from app.scene import actuator, linkage
from app.scene.actuator import cylinder_node, rod_at
from app.scene.hub import BladeState, HubScene
from app.scene.solids import quaternion
from app.service.connection import Connection
from app.service.cylinder_view import CylindersLine, cylinder_lines
from app.service.poll import Poller
from app.service.replay.source import Source
from app.service.replay.stage import ReplayStage
from app.service.scene_feed import SceneFeed
from app.service.shown import LiveShown
from tests.drivers.profibus_rig import ACTUAL, CONTROLWORD, NODE, SETPOINT, Wire, wire
from tests.scene.viewer import Viewer, viewing
from tests.service.profibus_rig import CYLINDERS, connected
from tests.web.rig import bench_with

pytestmark = [pytest.mark.alone, pytest.mark.timeout(180)]  # a serial line in its own time
DEADLINE_S = 60.0
FIRST, SECOND = cylinder_node(1, 1), cylinder_node(1, 2)
BLADE = f"{actuator.actuator_node(1)}/blade"
STROKE_MM = 500.0
START_MM, TARGET_MM = 250.0, 325.0
RUN = 0x2007
"""States up to ACTIVE, and start."""


@pytest.fixture
def scene() -> Iterator[HubScene]:
    started = HubScene("a secret of this test")
    yield started
    started.close()


async def until(feed: SceneFeed, holds: Callable[[], bool]) -> None:
    """Step the picture until something holds."""
    loop = asyncio.get_running_loop()
    async with asyncio.timeout(DEADLINE_S):
        while not (feed.step(loop.time()) and holds()):  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.03)


def rod_mm(viewer: Viewer, cylinder: str) -> float:
    """Where a rod is in the picture, in mm of the twin's own stroke; -1 where it has not been seen yet."""
    place = viewer.places.get(f"{cylinder}/rod")
    low, high = rod_at(0.0)[0], rod_at(1.0)[0]
    return -1.0 if place is None else (place[0] - low) / (high - low) * STROKE_MM


async def order(connection: Connection, controlword: int, target_mm: float) -> None:
    """A setpoint, and a controlword that follows it."""
    target = connection.target(CYLINDERS)
    driver: ProfibusDriver = connection.driver(target)
    await driver.write(NODE, SETPOINT, round(target_mm * 1000).to_bytes(4, "little"), verify=Verify.EFFECT)
    await driver.write(NODE, CONTROLWORD, controlword.to_bytes(2, "little"), verify=Verify.EFFECT)


def true_mm(line: Wire) -> float:
    return line.device.axes[0].cylinder.position_mm


async def test_the_picture_follows_a_twin_that_moves_and_shows_its_fault(scene: HubScene, tmp_path: Path) -> None:
    with wire() as line:
        async with connected(line, tmp_path) as connection, viewing(scene) as viewer:
            poller = Poller(connection)
            feed = SceneFeed(LiveShown(bench_with(connection)), scene)
            await until(feed, lambda: rod_mm(viewer, FIRST) == pytest.approx(START_MM, abs=1.0))
            await until(feed, lambda: viewer.visible.get("/rotor") is False)
            turned = quaternion((1.0, 0.0, 0.0), 40.10)
            assert viewer.turns[BLADE] == pytest.approx(turned, abs=2e-3)

            await order(connection, RUN, TARGET_MM)
            await until(feed, lambda: rod_mm(viewer, FIRST) == pytest.approx(TARGET_MM, abs=1.0))
            assert true_mm(line) == pytest.approx(TARGET_MM, abs=1.0), "so does the twin's own cylinder"
            share = TARGET_MM / STROKE_MM
            turned = quaternion((1.0, 0.0, 0.0), linkage.angle_deg(share))
            await until(feed, lambda: viewer.turns[BLADE] == pytest.approx(turned, abs=2e-3))
            await until(feed, lambda: tuple(viewer.updates[f"{FIRST}/barrel"]["color"]) == BladeState.ENABLED.rgb)
            assert viewer.updates[f"{SECOND}/rod/body"]["opacity"] == BladeState.UNKNOWN.opacity
            await until(feed, lambda: rod_mm(viewer, SECOND) == pytest.approx(TARGET_MM, abs=1.5))  # synchronous

            line.do(lambda: setattr(line.device.axes[0].transducer.wire, "broken", True))
            await until(feed, lambda: viewer.visible.get(f"{FIRST}/halo") is True)
            assert tuple(viewer.updates[f"{FIRST}/barrel"]["color"]) == BladeState.FAULT.rgb
            targets = {target.slug: target for target in connection.targets}

            def shown_live() -> CylindersLine:
                (found,) = cylinder_lines(connection.turbine, targets, connection.stamper())
                return found

            await until(feed, lambda: shown_live().cylinders[0].fault_text_key is not None)
            await poller.close()
            live = shown_live()
            (file,) = connection.recorded_files()
    assert live.cylinders[0].fault_text_key == "error_code.ed2_transducer_wire_1"
    source = Source(file, {})
    try:
        stage = ReplayStage(source, None, lambda: 0)
        stage.advance(source.to_ns, lambda: False)
        (again,) = cylinder_lines(stage.turbine, {target.slug: target for target in stage.targets}, source.to_ns)
        assert (again.angle_deg, again.synchronous) == (live.angle_deg, live.synchronous)
        shown = [(one.position, one.unit, one.state, one.fault_text_key) for one in again.cylinders]
        assert shown == [(one.position, one.unit, one.state, one.fault_text_key) for one in live.cylinders]
    finally:
        source.close()


def test_the_objects_are_those_of_the_description() -> None:
    roles = load_builtin("wandfluh-ed2").cylinders
    assert roles is not None
    assert (roles.position, roles.setpoint) == (ACTUAL, SETPOINT)
