"""Whether the holding brake of one axis lifts and holds (OAT manual 5.16.1.2: output bit 0; 60F9h/4: its time).

The contact of the brake says what the drive asks for, not what the disc does. So the blade shows it: with the brake
lifted it must turn by half a degree, and with the brake engaged and no power it must stay where it is. How much it
would hold is not known by that: nothing pulls at the blade but its own weight and the wind.
"""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from app.model.address import Address
from app.model.axis_state import ENERGISED, AxisState
from app.service.journal import Journal
from app.service.motion.bounds import HIGHEST, LOWEST, TARGET_VELOCITY
from app.service.motion.control import AxisMode, Control, Word, cia402
from app.service.motion.desk import MotionDesk
from app.service.motion.interlocks import POSITION
from app.service.motion.moves import come_to_rest
from app.service.motion.running import Doing, Ended, Running
from app.service.motion.steps import raw_of, set_object, wait

OUTPUTS: Final = Address(0x60FE, 3)
BRAKE: Final = 1 << 0
SPEED_DPS: Final = 0.5
TURN_DEG: Final = 0.5
TURN_TIMEOUT_S: Final = 4.0
CONTACT_TIMEOUT_S: Final = 2.0
WATCH_S: Final = 3.0
LEAST_DEG: Final = 0.2
"""A blade that has turned less than this has not turned: play and give of the gear."""
DRIFT_DEG: Final = 0.1
"""More than this is no play."""


ERROR_CODE: Final = Address(0x603F)
_FAULTY: Final = (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE)
HELD_FAST: Final = frozenset({0x8611})
"""Following error: what an axis tells that has power and does not turn (OAT manual, table 48)."""


class BrakeVerdict(Enum):
    """The value is the end of its text key ``brake_verdict.…``."""

    HOLDS = "holds"
    SLIPS = "slips"
    NOT_LIFTED = "not_lifted"
    STUCK = "stuck"
    NOT_ENGAGED = "not_engaged"


@dataclass(frozen=True, slots=True)
class BrakeTest:
    """What was seen; None for what the test did not come to. ``lifted_s``, ``engaged_s``: until the contact said so."""

    verdict: BrakeVerdict | None = None
    lifted_s: float | None = None
    turned_deg: float | None = None
    engaged_s: float | None = None
    drift_deg: float | None = None


async def try_brake(desk: MotionDesk, slug: str, fence: int, journal: Journal) -> BrakeTest:
    """Try the brake of one axis while it is held; no verdict where it was let go. Raises what ``move`` raises."""
    found = [BrakeTest()]

    async def work(running: Running) -> None:
        control = cia402(running.control)
        await control.set_mode(AxisMode.PROFILE_VELOCITY)
        speed = await raw_of(control, TARGET_VELOCITY, await _away_from_limits(control))
        await set_object(control, TARGET_VELOCITY, speed, journal)
        if running.over.is_set():
            return
        try:
            found[0] = await _turn(running)
        finally:
            await come_to_rest(running)
        if found[0].verdict in (None, BrakeVerdict.STUCK) and running.why is None:
            found[0] = await _rest(running, found[0])

    await desk.move(slug, fence, Doing.BRAKE_TEST, work)
    return found[0]


async def _away_from_limits(control: Control) -> float:
    """The speed towards the middle of the range, in degrees per second."""
    middle_deg = (await control.scaled(LOWEST) + await control.scaled(HIGHEST)) / 2
    return SPEED_DPS if await control.scaled(POSITION) < middle_deg else -SPEED_DPS


async def _turn(running: Running) -> BrakeTest:
    """Enable the axis, wait for the contact, turn the blade by half a degree and halt it."""
    control, loop = cia402(running.control), asyncio.get_running_loop()
    began_s = loop.time()
    await control.enable()
    running.turning = True
    lifted_s = await _contact(running, True, began_s)
    if lifted_s is None:
        return BrakeTest(None if running.over.is_set() else BrakeVerdict.NOT_LIFTED)
    start_deg, end_s = await control.scaled(POSITION), loop.time() + TURN_TIMEOUT_S
    if not running.over.is_set():
        await control.say(Word.RUN)
    turned_deg = 0.0
    while not running.over.is_set() and loop.time() < end_s and turned_deg < TURN_DEG:
        if control.overtaken:
            running.end(Ended.STOPPED)
        elif await control.state() is not AxisState.OPERATION_ENABLED:
            if not await _held_fast(control):
                running.end(Ended.STOPPED)
            break
        await wait(running)
        turned_deg = abs(await control.scaled(POSITION) - start_deg)
    stuck = turned_deg < LEAST_DEG and not running.over.is_set()
    return BrakeTest(BrakeVerdict.STUCK if stuck else None, lifted_s, turned_deg)


async def _held_fast(control: Control) -> bool:
    """The axis has a fault because it did not turn; any other one, or none, says nothing of the brake."""
    return await control.state() in _FAULTY and await control.number(ERROR_CODE) in HELD_FAST


async def _rest(running: Running, so_far: BrakeTest) -> BrakeTest:
    """The axis has no power now: wait for the contact, then see whether the blade stays."""
    control, loop = cia402(running.control), asyncio.get_running_loop()
    engaged_s = await _contact(running, False, loop.time())
    if engaged_s is None:
        verdict = so_far.verdict if running.over.is_set() else BrakeVerdict.NOT_ENGAGED
        return replace(so_far, verdict=verdict)
    start_deg, drift_deg = await control.scaled(POSITION), 0.0
    end_s = loop.time() + WATCH_S
    while not running.over.is_set() and loop.time() < end_s:
        if control.overtaken or await control.state() in ENERGISED:
            running.end(Ended.STOPPED)
        await wait(running)
        drift_deg = max(drift_deg, abs(await control.scaled(POSITION) - start_deg))
    seen = replace(so_far, engaged_s=engaged_s, drift_deg=drift_deg)
    if running.over.is_set() or so_far.verdict is not None:
        return seen
    return replace(seen, verdict=BrakeVerdict.SLIPS if drift_deg > DRIFT_DEG else BrakeVerdict.HOLDS)


async def _contact(running: Running, lifted: bool, began_s: float) -> float | None:
    """How long it took until the contact said so; None where it did not, or was let go."""
    loop = asyncio.get_running_loop()
    while not running.over.is_set():
        if bool(await running.control.number(OUTPUTS) & BRAKE) == lifted:
            return loop.time() - began_s
        if loop.time() - began_s > CONTACT_TIMEOUT_S:
            return None
        await wait(running)
    return None
