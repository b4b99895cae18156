"""From the axes of what is shown, the bench or a recording, to the 3D view: poses, and the loop that shows them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator
from typing import Final

from app.scene.hub import (
    BLADES,
    ActuatorPose,
    BladePose,
    BladeState,
    CylinderPose,
    HubScene,
    RotorPose,
    ShaftPose,
)
from app.service.cylinder_view import CylinderLine, CylindersLine, cylinder_lines
from app.service.rotor_view import NOBODY, RotorLine, rotor_line
from app.service.shaft_view import ShaftLine, shaft_lines
from app.service.shown import Shown
from app.service.views import AxisLine, axis_lines

log = logging.getLogger(__name__)

PERIOD_S: Final = 1 / 30
UNWATCHED_S: Final = 0.2
"""How soon a view is noticed that somebody has opened."""
ROTOR_STEP_DEG: Final = 1.0
_WIND_STEP_MPS: Final = 1.0
_LOOK_AGAIN_S: Final = 0.25
"""What is old becomes stale without anything new on the bus."""


def pose(line: AxisLine) -> BladePose:
    """How a blade looks: its last angle, coloured by its state; grey where that is unknown or old."""
    return BladePose(line.position_deg, BladeState(line.look), line.demand_deg)


def shaft_pose(line: ShaftLine) -> ShaftPose:
    """How an axis without a blade looks: its last angle, coloured as a blade would be."""
    return ShaftPose(line.shaft_deg, line.motor_deg, BladeState(line.look), line.turns)


def actuator_pose(line: CylindersLine) -> ActuatorPose:
    """How the cylinders of a station look, and the blade that they turn."""
    return ActuatorPose(
        tuple(map(_cylinder_pose, line.cylinders)), line.angle_deg, BladeState(line.look), line.synchronous is True
    )


def _cylinder_pose(line: CylinderLine) -> CylinderPose:
    return CylinderPose(line.extension, BladeState(line.look), line.setpoint_at, line.limits_at)


def rotor_pose(line: RotorLine) -> RotorPose:
    """How the rotor stands: where it was seen last; a wind that is old is not shown as one that blows."""
    if line.stale:
        return RotorPose(line.azimuth_deg)
    return RotorPose(line.azimuth_deg, line.wind_mps, line.wind_deg)


@contextlib.asynccontextmanager
async def run_scene(shown: Shown | None, scene: HubScene | None) -> AsyncIterator[None]:
    """While the block runs, ``scene`` follows ``shown``; nothing where either is None."""
    if shown is None or scene is None:
        yield
        return
    task = asyncio.create_task(follow(shown, scene))
    try:
        yield
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def follow(shown: Shown, scene: HubScene) -> None:
    """Show the axes for ever, thirty times a second while anybody looks. Ends by being cancelled."""
    feed = SceneFeed(shown, scene)
    while True:
        try:
            watched = feed.step(asyncio.get_running_loop().time())
        except Exception:  # a picture that stands still must not end the picture for good, nor pass unseen
            log.exception("the 3D view could not be updated")
            watched = False
        await asyncio.sleep(PERIOD_S if watched else UNWATCHED_S)


class SceneFeed:
    """Brings the scene up to date, step by step. For one thread; the scene must be shown by nobody else."""

    def __init__(self, shown: Shown, scene: HubScene) -> None:
        self._source = shown
        self._scene = scene
        self._watched = False
        self._seen: tuple[int, int] | None = None
        self._looked_s = 0.0
        self._rotor = RotorPose()

    def step(self, now_s: float) -> bool:
        """Show what changed; ``now_s`` is a monotonic time in s. True while anybody looks.

        Nothing is computed for a scene that nobody sees, nor for a live state that did not change.
        """
        if not self._scene.watched:
            if self._watched:
                self._scene.forget()
                self._rotor = RotorPose()
            self._watched = False
            return False
        stage = self._source.stage
        seen = (self._source.epoch, -1 if stage is None else stage.live.version)
        if not self._watched or seen != self._seen or now_s - self._looked_s >= _LOOK_AGAIN_S:
            self._watched, self._seen, self._looked_s = True, seen, now_s
            self._show()
        return True

    def _show(self) -> None:
        """All now; nothing is known of what is not connected."""
        poses, rotor = dict.fromkeys(BLADES, BladePose(None, BladeState.UNKNOWN)), NOBODY
        shafts: list[ShaftPose] = []
        actuators: list[ActuatorPose] = []
        has_rotor = True
        stage = self._source.stage
        if stage is not None:
            now_ns = self._source.now_ns()
            targets = {target.slug: target for target in stage.targets}
            poses |= {line.blade: pose(line) for line in axis_lines(stage.turbine, targets, now_ns)}
            rotor = rotor_line(stage.live, now_ns)
            shafts = [shaft_pose(line) for line in shaft_lines(stage.turbine, targets, now_ns)]
            actuators = [actuator_pose(line) for line in cylinder_lines(stage.turbine, targets, now_ns)]
            has_rotor = not (shafts or actuators) or any(
                station.blade is not None for station in stage.turbine.stations
            )
        self._scene.show(poses)
        self._scene.show_shafts(shafts, has_rotor)
        self._scene.show_actuators(actuators)
        self._show_rotor(rotor_pose(rotor))

    def _show_rotor(self, pose: RotorPose) -> None:
        """Every step of the rotor makes all viewers draw everything anew: those that nobody could see are left out.

        Whatever is shown was received; nothing is made up between.
        """
        before = self._rotor
        if pose.azimuth_deg is not None and before.azimuth_deg is not None:
            turned = abs((pose.azimuth_deg - before.azimuth_deg + 180.0) % 360.0 - 180.0)
            windy = abs((pose.wind_mps or 0.0) - (before.wind_mps or 0.0))
            known = (pose.wind_mps is None) is (before.wind_mps is None)
            if known and turned < ROTOR_STEP_DEG and windy < _WIND_STEP_MPS:
                return
        self._rotor = pose
        self._scene.show_rotor(pose)
