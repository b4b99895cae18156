"""What an axis can be told to do at the desk: jog, move to a position, be held enabled, home, reset its fault.

Positions and speeds are in the units of 607Ah and 60FFh: degrees and degrees a second at a blade.
"""

from __future__ import annotations

from math import inf
from typing import Final

from app.errors import UnverifiedError, UsageError
from app.model.address import Address
from app.model.axis_state import AxisState
from app.service.journal import Journal, Kind
from app.service.motion.bounds import (
    TARGET_POSITION,
    TARGET_VELOCITY,
    ends_of,
    require_by_hand,
    require_speed,
    require_within,
    way_per_s,
)
from app.service.motion.control import (
    ACKNOWLEDGED,
    TARGET_REACHED,
    AxisMode,
    Control,
    Word,
    cia402,
)
from app.service.motion.desk import MotionDesk
from app.service.motion.home_methods import searches
from app.service.motion.interlocks import POSITION
from app.service.motion.running import STOPPING, Doing, Ended, Running
from app.service.motion.steps import raw_of, set_object, wait

PROFILE_VELOCITY: Final = Address(0x6081)
WINDOW: Final = Address(0x6067)
_HOME_TOLERANCE_DEG: Final = 0.1
_MARGIN_S: Final = 0.25
"""A jog ends so long before the software limit: what the ramp and the last look take."""


async def jog(desk: MotionDesk, slug: str, fence: int, speed: float, journal: Journal) -> None:
    """Turn the axis at a constant speed (profile velocity) as long as it is held, up to the software limits.

    At a blade negative is towards 0. Raises LimitError, and what ``MotionDesk.move`` raises.
    """
    require_by_hand(desk.connection, desk.connection.target(slug), speed)

    async def work(running: Running) -> None:
        control = cia402(running.control)
        await require_speed(desk.connection, control, speed)
        raw = await raw_of(control, TARGET_VELOCITY, speed)
        await control.set_mode(AxisMode.PROFILE_VELOCITY)
        await set_object(control, TARGET_VELOCITY, raw, journal)
        if running.over.is_set():
            return
        try:
            await control.enable()
            if not running.over.is_set():
                running.turning = True
                await control.say(Word.RUN)
                await _until_limit(running, speed)
        finally:
            await come_to_rest(running)

    await desk.move(slug, fence, Doing.JOG, work)


async def move_to(desk: MotionDesk, slug: str, fence: int, position: float, speed: float, journal: Journal) -> None:
    """Move the axis to a position (profile position) while it is held; let go, it halts on its way.

    Raises LimitError, and what ``MotionDesk.move`` raises.
    """
    require_by_hand(desk.connection, desk.connection.target(slug), speed)

    async def work(running: Running) -> None:
        control = cia402(running.control)
        await require_speed(desk.connection, control, speed)
        await require_within(control, position)
        await control.set_mode(AxisMode.PROFILE_POSITION)
        await set_object(control, PROFILE_VELOCITY, await raw_of(control, PROFILE_VELOCITY, abs(speed)), journal)
        await set_object(control, TARGET_POSITION, await raw_of(control, TARGET_POSITION, position), journal)
        if running.over.is_set():
            return
        try:
            await control.enable()
            if not running.over.is_set():
                running.turning = True
                await control.say(Word.RUN)
                await control.say(Word.NEW_SET_POINT)
                if not running.over.is_set():
                    await control.until_bits(ACKNOWLEDGED, True)
                if not running.over.is_set():
                    await control.say(Word.RUN)
                    await _until_reached(running)
        finally:
            await come_to_rest(running)

    await desk.move(slug, fence, Doing.MOVE, work)


async def reset_fault(desk: MotionDesk, slug: str, fence: int, journal: Journal) -> AxisState:
    """Reset the fault of an axis, prepared or not; the state that came of it. Nothing moves by it."""
    found: list[AxisState] = []

    async def work(running: Running) -> None:
        found.append(await cia402(running.control).reset_fault())
        journal.note(Kind.FAULT_RESET, slug, state=found[0].name.lower())

    await desk.without_proof(slug, fence, Doing.RESET, work)
    return found[0]


async def hold(desk: MotionDesk, slug: str, fence: int) -> None:
    """Have the axis enabled and standing, brake lifted, while it is held. Raises what ``MotionDesk.move`` raises."""

    async def work(running: Running) -> None:
        control = cia402(running.control)
        await control.set_mode(AxisMode.PROFILE_VELOCITY)
        if running.over.is_set():
            return
        try:
            await control.enable()
            running.turning = True
            await until_over(running)
        finally:
            await come_to_rest(running)

    await desk.move(slug, fence, Doing.HOLD, work)


async def home(desk: MotionDesk, slug: str, fence: int, position: float, journal: Journal) -> None:
    """Take the present position of an axis without power for ``position`` (homing method 35, OAT manual 5.14).

    Raises what ``MotionDesk.move`` raises, AxisStateError where the axis has power, moves or does not confirm it,
    UnverifiedError where it stands elsewhere by its own word: the bits that confirm may be those of an earlier time.
    UsageError where the drive looks for its home by itself (``homing.search_home``).
    """
    if searches(desk.connection.target(slug)):
        raise UsageError(reason=f"{slug} is homed by a method of 6098h")

    async def work(running: Running) -> None:
        control = cia402(running.control)
        await control.require_at_rest()
        await control.set_mode(AxisMode.HOMING)
        await set_object(control, TARGET_POSITION, await raw_of(control, TARGET_POSITION, position), journal)
        await control.say(Word.SHUTDOWN)
        await control.until({AxisState.READY})
        await control.say(Word.HOME)
        await control.until_bits(ACKNOWLEDGED | TARGET_REACHED, True)
        await control.say(Word.SHUTDOWN)
        await _require_at(control, position)
        journal.note(Kind.HOMED, slug, angle_deg=position)

    await desk.move(slug, fence, Doing.HOMING, work, held=False)


# -- steps ------------------------------------------------------------------------------------


async def until_over(running: Running) -> None:
    """Wait until it is let go, or somebody else or the axis itself ends it."""
    while not running.over.is_set():
        await _go_on(running)


async def _go_on(running: Running) -> None:
    """One look at an axis that is to stay enabled."""
    control = cia402(running.control)
    if control.overtaken or await control.state() is not AxisState.OPERATION_ENABLED:
        running.end(Ended.STOPPED)
    else:
        await wait(running)


async def _until_limit(running: Running, speed: float) -> None:
    """Wait until it is let go, or until the axis comes near the limit towards which it turns."""
    control = cia402(running.control)
    low, high = await ends_of(control)
    margin = way_per_s(control.target, speed) * _MARGIN_S if (low, high) != (-inf, inf) else 0.0
    while not running.over.is_set():
        ahead = await control.scaled(POSITION) + margin
        if (speed < 0 and ahead <= low) or (speed > 0 and ahead >= high):
            running.end(Ended.LIMIT)
            return
        await _go_on(running)


async def _until_reached(running: Running) -> None:
    while not running.over.is_set():
        status = await running.control.status()
        if running.control.overtaken or AxisState.of(status) is not AxisState.OPERATION_ENABLED:
            running.end(Ended.STOPPED)
        elif status & TARGET_REACHED and not status & ACKNOWLEDGED and await _is_there(cia402(running.control)):
            running.end(Ended.DONE)
        else:
            await wait(running)


async def _is_there(control: Control) -> bool:
    """Within the position window (6067h): bit 10 may still be that of the target before."""
    if WINDOW not in control.target.description.entries:
        return True
    far = abs(await control.number(POSITION) - await control.number(TARGET_POSITION))
    return far <= await control.number(WINDOW)


async def come_to_rest(running: Running, halt: bool = True) -> None:
    """Halt, wait until the blade stands, then no power and the brake engaged.

    Where a quick stop is under way, or somebody else has commanded the axis, it is left to that. Halt is only for an
    axis that was told to run: its word enables any other. One that has left its operation by itself is not to find the
    word that stands when it could run again. Without ``halt`` the axis stops by what was sent already.
    """
    control = cia402(running.control)
    if running.why in STOPPING or control.overtaken:
        return
    if running.why is Ended.STOPPED:
        if await control.state() is AxisState.SWITCHED_ON:
            await control.say(Word.SHUTDOWN)
    elif halt:
        await control.say(Word.HALT if running.turning else Word.SHUTDOWN)
    await control.until_still()
    running.turning = False
    await control.switch_off()


async def _require_at(control: Control, angle_deg: float) -> None:
    found_deg = await control.scaled(POSITION)
    if abs(found_deg - angle_deg) > _HOME_TOLERANCE_DEG:
        raise UnverifiedError(
            address=POSITION.short,
            name=control.target.entry(POSITION).title,
            sent=f"{angle_deg:g}",
            found=f"{found_deg:g}",
            reason_key="unverified.elsewhere",
        )
