"""What a hydraulic axis can be told at the desk: manual control, a move to a place, to be held, to reset its fault.

Places and speeds are in the unit that parameter 1/84 chooses. The device tells no speed, and takes that of a move from
12/61: it is set for the move, never above what was commissioned, and put back after it.
"""

from __future__ import annotations

import logging
from math import inf
from typing import Final, NamedTuple

from app.errors import HubsideError, LimitError
from app.model.values import quantity_of
from app.service.devices import decode
from app.service.journal import Journal, Kind
from app.service.motion.bounds import MOST_DPS
from app.service.motion.desk import MotionDesk
from app.service.motion.hydraulic import (
    ACKNOWLEDGED,
    ACTUAL,
    CREEP_VELOCITY,
    HIGHEST,
    LIMITED,
    LOWEST,
    RAMP_VELOCITY,
    RAPID_VELOCITY,
    SETPOINT,
    TARGET_REACHED,
    HydraulicControl,
    HydraulicMode,
    HydraulicWord,
    hydraulic,
)
from app.service.motion.interlocks import turns_blade
from app.service.motion.left import Changed
from app.service.motion.running import STOPPING, Doing, Ended, Running
from app.service.motion.steps import raw_of, set_object, wait
from app.service.write import write_raw

log = logging.getLogger(__name__)

_MARGIN_S: Final = 0.25
"""Manual control ends so long before the limits of travel: what the ramp and the last look take."""
_THERE: Final = 1000
"""Thousandths of the unit around the target beyond which bit 12 is that of another one."""


class Way(NamedTuple):
    """Manual control: to the positive or the negative side, at the speed of 12/216 (rapid) or of 12/217 (creep)."""

    positive: bool
    rapid: bool

    @property
    def word(self) -> HydraulicWord:
        """Its controlword."""
        if self.rapid:
            return HydraulicWord.RAPID_POSITIVE if self.positive else HydraulicWord.RAPID_NEGATIVE
        return HydraulicWord.POSITIVE if self.positive else HydraulicWord.NEGATIVE


async def drive_by_hand(desk: MotionDesk, slug: str, fence: int, way: Way) -> None:
    """Manual control (mode -2) as long as it is held, up to the limits of travel.

    Raises LimitError (a blade would turn too fast), and what ``MotionDesk.move`` raises.
    """

    async def work(running: Running) -> None:
        control = hydraulic(running.control)
        speed = await control.scaled(RAPID_VELOCITY if way.rapid else CREEP_VELOCITY)
        _require_by_hand(desk, control, speed)
        await control.set_mode(HydraulicMode.MANUAL)
        if running.over.is_set():
            return
        try:
            await control.activate()
            if not running.over.is_set():
                running.turning = True
                await control.say(way.word)
                await _until_limit(running, control, speed if way.positive else -speed)
        finally:
            await come_to_rest(running)

    await desk.move(slug, fence, Doing.JOG, work)


async def move_to(desk: MotionDesk, slug: str, fence: int, position: float, speed: float, journal: Journal) -> None:
    """Move the axis to a place by a profile (mode -1) while it is held; let go, it comes to rest on its way.

    By the handshake of 4.3.1.3: nothing is acknowledged any more, the new setpoint by an edge, and that is taken back
    once the drive has it. Raises LimitError, and what ``MotionDesk.move`` raises.
    """

    async def work(running: Running) -> None:
        control = hydraulic(running.control)
        await require_within(control, position)
        raw = await raw_of(control, SETPOINT, position)
        await control.set_mode(HydraulicMode.PROFILE)
        await _set_speed(desk, control, speed, journal)
        if running.over.is_set():
            return
        try:
            await control.activate()
            if not running.over.is_set():
                running.turning = True
                await control.until_bits(ACKNOWLEDGED, False)
                await set_object(control, SETPOINT, raw, journal)
                await _hand_over(running, control)
                await _until_reached(running, control, int(raw))
        finally:
            await come_to_rest(running)
            await _speed_back(desk, control, journal)

    await desk.move(slug, fence, Doing.MOVE, work)


async def hold(desk: MotionDesk, slug: str, fence: int) -> None:
    """Have the axis in HOLD, its loop closed where it stands, while it is held.

    Raises what ``MotionDesk.move`` raises.
    """

    async def work(running: Running) -> None:
        control = hydraulic(running.control)
        await control.set_mode(HydraulicMode.PROFILE)
        if running.over.is_set():
            return
        try:
            running.turning = True
            await control.enable()
            while not running.over.is_set():
                await _go_on(running, control, "hold")
        finally:
            await come_to_rest(running)

    await desk.move(slug, fence, Doing.HOLD, work)


async def reset_fault(desk: MotionDesk, slug: str, fence: int, journal: Journal) -> None:
    """Reset the fault of an axis, prepared or not. Nothing moves by it, and nothing is held afterwards."""

    async def work(running: Running) -> None:
        state = await hydraulic(running.control).reset_fault()
        journal.note(Kind.FAULT_RESET, slug, state=state.name)

    await desk.without_proof(slug, fence, Doing.RESET, work)


# -- steps ------------------------------------------------------------------------------------


async def come_to_rest(running: Running) -> None:
    """HOLD brings it to rest by its ramp; then no current to the valves.

    Where it is stopped already, or somebody else has commanded it, it is left to that. An axis that has left its
    operation by itself is not to find the word that stands when it could run again.
    """
    control = hydraulic(running.control)
    if running.why in STOPPING or control.overtaken:
        return
    if running.turning and running.why is not Ended.STOPPED:
        if (await control.state()).powered:
            await control.say(HydraulicWord.HOLD)
        await control.until_still()
    running.turning = False
    await control.switch_off()


async def _hand_over(running: Running, control: HydraulicControl) -> None:
    """The edge of new_setpoint, until the drive has acknowledged it and taken that back."""
    if running.over.is_set():
        return
    await control.say(HydraulicWord.NEW_SETPOINT)
    if not running.over.is_set():
        await control.until_bits(ACKNOWLEDGED, True)
    if not running.over.is_set():
        await control.say(HydraulicWord.ACTIVE)
        await control.until_bits(ACKNOWLEDGED, False)


async def _go_on(running: Running, control: HydraulicControl, state: str) -> None:
    """One look at an axis that is to stay in ``state``."""
    if control.overtaken or (await control.state()).name != state:
        running.end(Ended.STOPPED)
    else:
        await wait(running)


async def _until_limit(running: Running, control: HydraulicControl, speed: float) -> None:
    low, high = await _ends(control)
    margin = speed * _MARGIN_S
    while not running.over.is_set():
        ahead = await control.scaled(ACTUAL) + margin
        if (speed < 0 and ahead <= low) or (speed > 0 and ahead >= high):
            running.end(Ended.LIMIT)
            return
        await _go_on(running, control, "device_mode_active")


async def _until_reached(running: Running, control: HydraulicControl, target: int) -> None:
    while not running.over.is_set():
        status = await control.status()
        if control.overtaken or not control.machine.runs(status):
            running.end(Ended.STOPPED)
        elif status & TARGET_REACHED and abs(await control.number(ACTUAL) - target) <= _THERE:
            running.end(Ended.DONE)
        else:
            await wait(running)


# -- bounds -----------------------------------------------------------------------------------


async def _ends(control: HydraulicControl) -> tuple[float, float]:
    """The limits of travel, infinite where none are in force."""
    if not await control.number(LIMITED):
        return -inf, inf
    return await control.scaled(LOWEST), await control.scaled(HIGHEST)


async def require_within(control: HydraulicControl, position: float) -> None:
    """Raises LimitError: the device would hold a place outside of its limits of travel back, and go to the limit."""
    low, high = await _ends(control)
    if not low <= position <= high:
        entry = control.target.entry(SETPOINT)
        raise LimitError(
            address=SETPOINT.short, name=entry.title, value=f"{position:g}", minimum=f"{low:g}", maximum=f"{high:g}",
            unit=quantity_of(entry, control.target.lookup).unit,
        )  # fmt: skip


def _require_by_hand(desk: MotionDesk, control: HydraulicControl, speed: float) -> None:
    """Raises LimitError for no speed at all, and where a blade would turn faster than by hand."""
    entry = control.target.entry(RAMP_VELOCITY)
    unit, most = quantity_of(entry, control.target.lookup).unit, inf
    if turns_blade(desk.connection, control.target):
        most = MOST_DPS if unit == "°/s" else 0.0
    _require_speed(control, speed, most)


def _require_speed(control: HydraulicControl, speed: float, most: float) -> None:
    if not 0 < speed <= most:
        entry = control.target.entry(RAMP_VELOCITY)
        raise LimitError(
            address=RAMP_VELOCITY.short, name=entry.title, value=f"{speed:g}", minimum="0", maximum=f"{most:g}",
            unit=quantity_of(entry, control.target.lookup).unit,
        )  # fmt: skip


async def _set_speed(desk: MotionDesk, control: HydraulicControl, speed: float, journal: Journal) -> None:
    """12/61 for this move; kept what stood there. Raises LimitError, StoreError, and what a write raises."""
    _require_by_hand(desk, control, speed)
    raw = await raw_of(control, RAMP_VELOCITY, speed)
    target, size = control.target, 4
    was = await control.driver.read(target.node, RAMP_VELOCITY)
    noted = desk.left.of(target.slug).get(RAMP_VELOCITY)
    commissioned = int.from_bytes(was if noted is None else noted.was, "little")
    scale = float(quantity_of(target.entry(RAMP_VELOCITY), target.lookup).scale)
    _require_speed(control, speed, commissioned * scale)
    now = int(raw).to_bytes(size, "little")
    if now != was:
        await desk.left.note(target.slug, RAMP_VELOCITY, Changed(was, now))
        await write_raw(control.driver, target, RAMP_VELOCITY, raw, journal)


async def _speed_back(desk: MotionDesk, control: HydraulicControl, journal: Journal) -> None:
    """What was commissioned stands again; where it cannot be now, it does once the preparation ends."""
    target = control.target
    changed = desk.left.of(target.slug).get(RAMP_VELOCITY)
    if changed is None:
        return
    try:
        if await control.driver.read(target.node, RAMP_VELOCITY) == changed.now:
            raw = decode(target.entry(RAMP_VELOCITY), changed.was)
            await write_raw(control.driver, target, RAMP_VELOCITY, raw, journal)
    except HubsideError as error:
        log.warning("%s: its speed is not put back yet: %s", target.slug, error.code)
        return
    await desk.left.forget(target.slug, RAMP_VELOCITY)
