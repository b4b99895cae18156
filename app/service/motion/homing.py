"""Homing by a method of 6098h, which the drive carries out by itself as long as it is held (CiA 402, homing mode).

For drives that have several methods. One that only takes the position where it stands is homed by ``moves.home``.
"""

from __future__ import annotations

from typing import Final

from app.errors import AxisStateError, UsageError
from app.model.axis_state import AxisState
from app.service.journal import Journal, Kind
from app.service.motion.borrowed import Borrowed
from app.service.motion.control import ACKNOWLEDGED, TARGET_REACHED, AxisMode, Word, cia402
from app.service.motion.desk import MotionDesk
from app.service.motion.home_methods import METHOD, methods_of, searches
from app.service.motion.interlocks import POSITION
from app.service.motion.moves import come_to_rest
from app.service.motion.running import Doing, Ended, Running
from app.service.motion.steps import wait

ATTAINED: Final = ACKNOWLEDGED
"""Bit 12 in homing mode."""
FAILED: Final = 1 << 13
"""Bit 13 in homing mode."""


async def search_home(desk: MotionDesk, slug: str, fence: int, method: int, journal: Journal) -> float:
    """Home by ``method`` while it is held; where it stands then, by its own word. 6098h is put back.

    Raises UsageError (no such method), AxisStateError where the drive finds no home, and what ``MotionDesk.move``
    raises.
    """
    target = desk.connection.target(slug)
    if not searches(target) or method not in methods_of(target):
        raise UsageError(reason=f"{slug} has no homing method {method}")
    found: list[float] = []

    async def work(running: Running) -> None:
        borrowed = Borrowed(cia402(running.control), desk.left, journal)
        try:
            await _search(running, borrowed, method)
        finally:
            await borrowed.put_back()
        found.append(await running.control.scaled(POSITION))
        if running.why is Ended.DONE:
            journal.note(Kind.HOME_FOUND, slug, position=found[0], method=method)

    await desk.move(slug, fence, Doing.HOMING, work)
    return found[0]


async def _search(running: Running, borrowed: Borrowed, method: int) -> None:
    control = cia402(running.control)
    await control.switch_off()
    await borrowed.number(METHOD, method)
    await control.set_mode(AxisMode.HOMING)
    if running.over.is_set():
        return
    try:
        await control.enable()
        if not running.over.is_set():
            running.turning = True
            await control.say(Word.RUN)
            await control.say(Word.NEW_SET_POINT)
            await _until_found(running)
    finally:
        await come_to_rest(running)


async def _until_found(running: Running) -> None:
    control = cia402(running.control)
    while not running.over.is_set():
        status = await control.status()
        if control.overtaken or AxisState.of(status) is not AxisState.OPERATION_ENABLED:
            running.end(Ended.STOPPED)
        elif status & FAILED:
            raise AxisStateError(
                device=running.slug, state_key="axis_found.homing_failed", wanted_key="axis_needed.home"
            )
        elif status & ATTAINED and status & TARGET_REACHED:
            running.end(Ended.DONE)
        else:
            await wait(running)
