"""The words, modes and states of a hydraulic axis of the profile DSP-408 (ED2 manual, 4.2 and 4.3).

Each word is process data, held until the station has taken it. A word of 0 takes the current from the valves from
wherever the axis is; it is the same in any order of bytes, so it can be sent always. HOLD brings an axis that runs to
rest by its ramp and keeps its place in the closed loop.
"""

from __future__ import annotations

import asyncio
from enum import IntEnum
from typing import Final

from app.errors import AxisStateError, InterlockError, UnverifiedError, UsageError
from app.model.address import Address, Addressing
from app.model.axis_machine import MachineState
from app.service.motion.commanding import LOOK_S, STATE_TIMEOUT_S, Commanding
from app.service.motion.left import ModeChanged


def _pkw(ind: int, pnu: int) -> Address:
    return Address(ind, pnu, Addressing.PKW)


DEVICE_MODE: Final = _pkw(0, 39)
CONTROL_MODE: Final = _pkw(0, 40)
LOCAL: Final = _pkw(0, 41)
AXIS_OPERATION: Final = _pkw(0, 53)
LOWEST: Final = _pkw(1, 100)
HIGHEST: Final = _pkw(1, 101)
LIMITED: Final = _pkw(1, 106)
SETPOINT: Final = _pkw(12, 21)
RAMP_VELOCITY: Final = _pkw(12, 61)
ACTUAL: Final = _pkw(12, 100)
RAPID_VELOCITY: Final = _pkw(12, 216)
CREEP_VELOCITY: Final = _pkw(12, 217)

LOCAL_CONTROL: Final = 1 << 4
TARGET_REACHED: Final = 1 << 12
ACKNOWLEDGED: Final = 1 << 13
STAND_TIMEOUT_S: Final = 10.0
RESET_TIMEOUT_S: Final = 1.0
_STANDS: Final = 20
"""Thousandths of the unit by which an axis that stands may have moved within ``_STANDS_S``."""
_STANDS_S: Final = 0.06


class HydraulicWord(IntEnum):
    """Controlwords (4.8.2). The mode decides what bits 9, 10 and 13 say, so one number may stand for two commands."""

    OFF = 0x0000
    DISABLED = 0x0001
    HOLD = 0x0003
    ACTIVE = 0x0007
    RESET = 0x0008
    """With bits 0 to 2 clear: a fault ends in DISABLED, never held."""
    POSITIVE = 0x0207
    NEGATIVE = 0x0407
    RAPID_POSITIVE = 0x2207
    RAPID_NEGATIVE = 0x2407
    NEW_SETPOINT = 0x2007
    START = 0x2007
    FORCED_SETPOINT = 0x2407
    FORCE = 0x0407


class HydraulicMode(IntEnum):
    """0/40, as far as the bus can drive them: open loop (6) takes its setpoint from a joystick alone."""

    POSITION = 9
    PROFILE = -1
    MANUAL = -2


class DeviceMode(IntEnum):
    """0/39: where setpoints come from."""

    BUS = 1
    LOCAL = 2


class HydraulicControl(Commanding):
    """Commands to an axis of DSP-408."""

    stop_word = HydraulicWord.OFF
    halt_word = HydraulicWord.HOLD
    running_words = frozenset(word for word in HydraulicWord if word & 0x0007 == HydraulicWord.ACTIVE)

    # -- states ------------------------------------------------------------------------

    async def state(self) -> MachineState:
        """The state. Raises AxisStateError where the statusword tells none."""
        status = await self.status()
        found = self.machine.state_of(status)
        if found is None:
            raise AxisStateError(device=self.target.slug, state=f"{status:04X}h", wanted_key="axis_needed.known")
        return found

    async def is_enabled(self) -> bool:
        """See Commanding: held counts too, the loop is closed then."""
        state = await self.state()
        return state.powered and not state.fault

    async def has_power(self) -> bool:
        """See Commanding."""
        return (await self.state()).powered

    async def is_feathering(self) -> bool:
        """No such axis has an emergency drive of its own."""
        return False

    async def halt(self) -> None:
        """See Commanding."""
        state = await self.state()
        if not state.runs:
            raise self._otherwise(state, "device_mode_active")
        await self.say(HydraulicWord.HOLD)

    async def until(self, *wanted: str, timeout_s: float = STATE_TIMEOUT_S) -> MachineState:
        """Wait for one of these states. Raises AxisStateError when another one stays, or a fault comes."""
        end_s = asyncio.get_running_loop().time() + timeout_s
        while (state := await self.state()).name not in wanted:
            late = asyncio.get_running_loop().time() >= end_s
            if late or (state.fault and state.name != "fault_reaction"):
                raise self._otherwise(state, *wanted)
            await asyncio.sleep(LOOK_S)
        return state

    def _otherwise(self, state: MachineState, *wanted: str) -> AxisStateError:
        keys = [one.text_key for one in self.machine.states if one.name in wanted]
        return AxisStateError(device=self.target.slug, state_key=state.text_key, wanted_keys=keys)

    async def until_still(self, timeout_s: float = STAND_TIMEOUT_S) -> bool:
        """Wait until the axis stands; whether it does. The device tells no speed: its place is looked at twice."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + timeout_s
        before = await self.number(ACTUAL)
        while True:
            await asyncio.sleep(_STANDS_S)
            now = await self.number(ACTUAL)
            if abs(now - before) <= _STANDS:
                return True
            if loop.time() >= end_s:
                return False
            before = now

    async def require_adjustable(self) -> None:
        """Raises AxisStateError where modes cannot be changed: the axis has power, is locally driven, or moves."""
        status, state = await self.status(), await self.state()
        if state.name not in ("init", "disabled"):
            raise self._otherwise(state, "init", "disabled")
        if status & LOCAL_CONTROL:
            raise AxisStateError(
                device=self.target.slug, state_key="hydraulic.found.local", wanted_key="hydraulic.needed.bus"
            )
        await self.require_still()

    async def require_still(self) -> None:
        """Raises AxisStateError where the axis moves."""
        if not await self.until_still(timeout_s=0.0):
            raise AxisStateError(
                device=self.target.slug, state_key="axis_found.moving", wanted_key="axis_needed.standstill"
            )

    # -- sequences -----------------------------------------------------------------------

    async def enable(self) -> None:
        """HOLD: the loop is closed where the axis stands.

        Raises AxisStateError, InterlockError (limits of travel that leave it no way), OvertakenError, NotHeldError.
        """
        await self.require_window()
        await self.require_adjustable()
        for word, name in ((HydraulicWord.DISABLED, "disabled"), (HydraulicWord.HOLD, "hold")):
            self._require_held()
            await self.say(word)
            await self.until(name)
        self._require_held()

    async def activate(self) -> None:
        """DEVICE_MODE_ACTIVE: the mode is in force, and nothing is commanded yet."""
        await self.enable()
        await self.say(HydraulicWord.ACTIVE)
        await self.until("device_mode_active")

    async def require_window(self) -> None:
        """Limits in force that leave no way would set the axis off to the only place left (ED2 manual, 4.8.16).

        Raises InterlockError.
        """
        if not await self.number(LIMITED):
            return
        low, high = await self.number(LOWEST), await self.number(HIGHEST)
        if low >= high:
            raise InterlockError(
                device=self.target.slug, interlock="travel_window", reason_key="hydraulic.no_window",
                low=f"{low / 10:g}", high=f"{high / 10:g}",
            )  # fmt: skip

    async def switch_off(self) -> None:
        """No current to the valves: INIT. A fault stays one. Raises AxisStateError, OvertakenError."""
        await self.say(HydraulicWord.OFF)
        end_s = asyncio.get_running_loop().time() + STATE_TIMEOUT_S
        while (state := await self.state()).powered or not (state.fault or state.name in ("init", "not_ready")):
            if asyncio.get_running_loop().time() >= end_s:
                raise self._otherwise(state, "init")
            await asyncio.sleep(LOOK_S)

    async def reset_fault(self) -> MachineState:
        """Reset the fault by an edge; the state that came of it, which is the fault where its cause still stands.

        The axis is not held afterwards, whatever it was before. Raises OvertakenError, AxisStateError.
        """
        state = await self.state()
        if not state.fault:
            return state
        await self.say(HydraulicWord.OFF)
        await self.say(HydraulicWord.RESET)
        end_s = asyncio.get_running_loop().time() + RESET_TIMEOUT_S
        while (await self.state()).fault:
            if asyncio.get_running_loop().time() >= end_s:
                break
            await asyncio.sleep(LOOK_S)
        await self.say(HydraulicWord.OFF)
        return await self.state()

    # -- modes ---------------------------------------------------------------------------

    async def mode(self) -> int:
        """Control mode in the low byte, device mode above it: one goes with the other."""
        return await self.number(DEVICE_MODE) << 8 | await self.number(CONTROL_MODE) & 0xFF

    async def set_mode(self, mode: HydraulicMode) -> None:
        """Setpoints from the bus in this control mode; changed in INIT or DISABLED alone, and at rest (5.2).

        Raises AxisStateError, UnverifiedError, and what a write raises.
        """
        wanted = DeviceMode.BUS << 8 | mode & 0xFF
        if await self.mode() == wanted:
            return
        await self.require_adjustable()
        await self._before_mode(wanted)
        await self._put_mode(wanted)

    async def _put_mode(self, wanted: int) -> None:
        """The control mode first: the device mode of the bus is refused with mode 6, the local one without mode 9."""
        control, device = wanted & 0xFF, wanted >> 8
        for address, data in ((CONTROL_MODE, control), (DEVICE_MODE, device)):
            if await self.number(address) & 0xFF != data:
                self.require_own()
                await self.driver.write(self.target.node, address, bytes((data,)))
        if (found := await self.mode()) != wanted:
            raise UnverifiedError(
                address=CONTROL_MODE.short, name="mode", sent=f"{wanted:04X}h", found=f"{found:04X}h",
                reason_key="unverified.mode",
            )  # fmt: skip

    async def mode_back(self, changed: ModeChanged) -> bool:
        """See Commanding. One that is not in the mode that was set last is left as it is: somebody else has it."""
        self.own()
        shown = await self.mode()
        if shown == changed.was or shown != changed.now:
            return True
        status, state = await self.status(), await self.state()
        if state.name not in ("init", "disabled") or status & LOCAL_CONTROL:
            return False
        await self._put_mode(changed.was)
        return True


def hydraulic(control: Commanding) -> HydraulicControl:
    """``control`` as one of DSP-408. Raises UsageError where the axis has another state machine."""
    if not isinstance(control, HydraulicControl):
        raise UsageError(reason=f"{control.target.slug} has no such command: it is no hydraulic axis")
    return control
