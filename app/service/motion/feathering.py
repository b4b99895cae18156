"""The emergency feather drive of one axis, by bit 11 of its controlword (OAT manual 5.8.2.1, 5.15.1).

The drive goes by its own EFC objects: target 567Ah, velocity 5681h, ramps 5683h and 5684h. Unlike FEATHER, which goes
to all axes and asks nobody, this is a trial: it is held, and let go the axis stops by its quick stop.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Final

from app.errors import AxisStateError
from app.model.axis_state import ENERGISED, AxisState
from app.service.motion.control import Word, cia402
from app.service.motion.desk import MotionDesk
from app.service.motion.interlocks import POSITION
from app.service.motion.moves import come_to_rest
from app.service.motion.running import Doing, Ended, Running
from app.service.motion.steps import wait
from app.service.stop import EFC_TARGET

BEGIN_TIMEOUT_S: Final = 2.0
_REACHED_DEG: Final = 0.5
_FAILED: Final = (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE)


@dataclass(frozen=True, slots=True)
class Feathered:
    """What the drive did: from where to where, its target, and how long it took.

    A blade that stands at its target has nothing to do; at the 90 degree switch the drive does not even begin (5.8.1).
    """

    from_deg: float
    to_deg: float
    target_deg: float
    took_s: float


async def feather(desk: MotionDesk, slug: str, fence: int) -> Feathered:
    """Have one axis drive to feather while it is held.

    Raises what ``MotionDesk.move`` raises; AxisStateError where the axis does not drive, falls into a fault or stands
    elsewhere than at its target.
    """
    found: list[Feathered] = []

    async def work(running: Running) -> None:
        found.append(await _drive(running))

    await desk.move(slug, fence, Doing.FEATHER, work)
    return found[0]


async def _drive(running: Running) -> Feathered:
    control, loop = cia402(running.control), asyncio.get_running_loop()
    running.let_go = Word.QUICK_STOP
    target_deg, from_deg = await control.scaled(EFC_TARGET), await control.scaled(POSITION)
    began_s = loop.time()
    if abs(from_deg - target_deg) <= _REACHED_DEG:
        return Feathered(from_deg, from_deg, target_deg, 0.0)
    try:
        if not running.over.is_set():
            running.turning = True
            await control.say(Word.FEATHER)
            await control.until({*ENERGISED, *_FAILED}, BEGIN_TIMEOUT_S)
        await _until_there(running, target_deg)
        took_s = loop.time() - began_s
    finally:
        await come_to_rest(running, halt=False)
    to_deg = await control.scaled(POSITION)
    if running.why is Ended.DONE and abs(to_deg - target_deg) > _REACHED_DEG:
        raise AxisStateError(device=running.slug, state=f"{to_deg:.2f}°", wanted=f"{target_deg:.2f}°")
    return Feathered(from_deg, to_deg, target_deg, took_s)


async def _until_there(running: Running, target_deg: float) -> None:
    """Until the blade stands at its target, or the 90 degree switch has ended the drive (transition 5)."""
    control = cia402(running.control)
    while not running.over.is_set():
        state = await control.state()
        if state in _FAILED:
            raise AxisStateError(
                device=running.slug, state_key=state.text_key, wanted_key=AxisState.OPERATION_ENABLED.text_key
            )
        near = abs(await control.scaled(POSITION) - target_deg) <= _REACHED_DEG
        if control.overtaken:
            running.end(Ended.STOPPED)
        elif near and await control.until_still(timeout_s=0.0):
            running.end(Ended.DONE)
        elif state not in ENERGISED or state is AxisState.SWITCHED_ON:
            running.end(Ended.LIMIT)
        else:
            await wait(running)
