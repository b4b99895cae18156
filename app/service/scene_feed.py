"""From the axes of the live state to the 3D view: poses, and the loop that shows them."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator
from typing import Final

from app.scene.hub import BLADES, BladePose, BladeState, HubScene
from app.service.bench import Bench
from app.service.views import ENABLED, AxisLine, axis_lines

log = logging.getLogger(__name__)

PERIOD_S: Final = 1 / 30
_STOPPED: Final = "axis_state.quick_stop_active"
_FAULT: Final = ("axis_state.fault", "axis_state.fault_reaction_active")


def pose(line: AxisLine) -> BladePose:
    """How a blade looks: its last angle, coloured by its state; grey where that is unknown or old."""
    angle = "–" if line.position_deg is None else f"{line.position_deg:.2f}°"
    return BladePose(line.position_deg, _look(line), f"{line.blade}   {angle}")


def _look(line: AxisLine) -> BladeState:
    if line.position_deg is None:
        return BladeState.UNKNOWN
    if line.stale:
        return BladeState.STALE
    if line.state in _FAULT or line.fault_code:
        return BladeState.FAULT
    if line.state == _STOPPED:
        return BladeState.WARNING
    return BladeState.ENABLED if line.state == ENABLED else BladeState.IDLE


@contextlib.asynccontextmanager
async def run_scene(shown: Bench | None, scene: HubScene | None) -> AsyncIterator[None]:
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


async def follow(bench: Bench, scene: HubScene) -> None:
    """Show the axes for ever, thirty times a second, and only what changed. Ends by being cancelled."""
    before: dict[int, BladePose] = {}
    while True:
        try:
            poses = _poses(bench)
            changed = {blade: new for blade, new in poses.items() if before.get(blade) != new}
            if changed:
                scene.show(changed)
                before |= changed
        except Exception:  # a picture that stands still must not end the picture for good, nor pass unseen
            log.exception("the 3D view could not be updated")
            await asyncio.sleep(1.0)
        await asyncio.sleep(PERIOD_S)


def _poses(bench: Bench) -> dict[int, BladePose]:
    """All blades now; nothing is known of any where nothing is connected."""
    shown = bench.connection
    if shown is None:
        return {blade: BladePose(None, BladeState.UNKNOWN, f"{blade}   –") for blade in BLADES}
    targets = {target.slug: target for target in shown.targets}
    return {line.blade: pose(line) for line in axis_lines(shown.turbine, targets, shown.stamper())}
