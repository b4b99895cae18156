"""The words, modes and states of an axis of CiA 402 in the hands of who moves it (OAT manual 5.8, tables 49 to 53)."""

from __future__ import annotations

import asyncio
from collections.abc import Collection
from decimal import Decimal
from enum import IntEnum
from typing import Final

from app.errors import AxisStateError, UnverifiedError, UsageError
from app.model.address import Address
from app.model.axis_state import ENERGISED, AxisState
from app.model.description import Verify
from app.model.values import quantity_of, to_scaled
from app.service.motion.commanding import LOOK_S, STATE_TIMEOUT_S, Commanding
from app.service.motion.interlocks import POSITION
from app.service.motion.left import ModeChanged
from app.service.stop import CONTROLWORD, EFC_TARGET

MODE: Final = Address(0x6060)
MODE_SHOWN: Final = Address(0x6061)
VELOCITY: Final = Address(0x606C)
MANUAL: Final = Address(0x5040)
_EFC: Final = 1 << 11
_AT_TARGET_DEG: Final = 0.5
STAND_TIMEOUT_S: Final = 10.0
RESET_TIMEOUT_S: Final = 1.0
_MODE_TIMEOUT_S: Final = 0.2
_STANDS_DPS: Final = Decimal("0.1")


class Word(IntEnum):
    """Controlwords (table 52)."""

    SHUTDOWN = 0x0106
    SWITCH_ON = 0x0107
    HALT = 0x010F
    RUN = 0x000F
    NEW_SET_POINT = 0x001F
    QUICK_STOP = 0x010B
    DISABLE_VOLTAGE = 0x010C
    NO_POWER = 0x0104
    """As the one before, with bit 3 clear: the mode can be changed then (manual 5.9)."""
    HOME = 0x0116
    FAULT_RESET = 0x0186
    FEATHER = 0x080F


_ENABLE_OPERATION: Final = 1 << 3
_RUNS: Final[frozenset[IntEnum]] = frozenset({Word.RUN, Word.NEW_SET_POINT, Word.FEATHER})
_OFF: Final = frozenset({AxisState.SWITCH_ON_DISABLED, AxisState.READY})
TARGET_REACHED: Final = 1 << 10
ACKNOWLEDGED: Final = 1 << 12
REMOTE: Final = 1 << 9
"""The axis listens to its controlword; 0 while its EFC input controls it."""


class AxisMode(IntEnum):
    """Modes of operation (6060h) that this tool uses."""

    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    HOMING = 6
    CYCLIC_POSITION = 8


class Control(Commanding):
    """Commands to an axis of CiA 402."""

    stop_word = Word.QUICK_STOP
    halt_word = Word.HALT
    running_words = _RUNS

    async def is_enabled(self) -> bool:
        """See Commanding."""
        return await self.state() is AxisState.OPERATION_ENABLED

    async def has_power(self) -> bool:
        """See Commanding."""
        return await self.state() in ENERGISED

    async def mode(self) -> int:
        """See Commanding."""
        return await self.number(MODE_SHOWN)

    async def halt(self) -> None:
        """Halt an axis that is enabled; any other one would be enabled by that word. Raises AxisStateError too."""
        state = await self.state()
        if state is not AxisState.OPERATION_ENABLED:
            raise AxisStateError(
                device=self.target.slug, state_key=state.text_key, wanted_key=AxisState.OPERATION_ENABLED.text_key
            )
        await self.say(Word.HALT)

    async def state(self) -> AxisState:
        """The state. Raises AxisStateError where the statusword tells none."""
        status = await self.status()
        found = AxisState.of(status)
        if found is None:
            raise AxisStateError(device=self.target.slug, state=f"{status:04X}h", wanted_key="axis_needed.known")
        return found

    async def until(
        self, wanted: Collection[AxisState], timeout_s: float = STATE_TIMEOUT_S, or_overtaken: bool = False
    ) -> AxisState:
        """Wait for one of these states. Raises AxisStateError when another one stays, or a fault comes.

        ``or_overtaken``: nor longer than until somebody else commands the axis, whose state is the answer then.
        """
        end_s = asyncio.get_running_loop().time() + timeout_s
        while (state := await self.state()) not in wanted:
            if or_overtaken and self.overtaken:
                return state
            late = asyncio.get_running_loop().time() >= end_s
            if late or (state is AxisState.FAULT and AxisState.FAULT not in wanted):
                keys = [one.text_key for one in AxisState if one in wanted]
                raise AxisStateError(device=self.target.slug, state_key=state.text_key, wanted_keys=keys)
            await asyncio.sleep(LOOK_S)
        return state

    async def is_feathering(self) -> bool:
        """An EFC is commanded, and the axis has power and is not there yet."""
        if EFC_TARGET not in self.target.description.entries:
            return False
        if not await self.number(CONTROLWORD) & _EFC or await self.state() not in ENERGISED:
            return False
        far = abs(await self.scaled(POSITION) - await self.scaled(EFC_TARGET)) > _AT_TARGET_DEG
        return far or not await self.until_still(timeout_s=0.0)

    async def until_still(self, timeout_s: float = STAND_TIMEOUT_S) -> bool:
        """Wait until the axis stands; whether it does."""
        end_s = asyncio.get_running_loop().time() + timeout_s
        entry = self.target.entry(VELOCITY)
        while True:
            speed = to_scaled(entry, await self.number(VELOCITY), self.target.lookup)
            # A drive that counts coarser than that may show one step at rest.
            step = quantity_of(entry, self.target.lookup).scale
            if speed is not None and abs(speed.number) <= max(_STANDS_DPS, step):
                return True
            if asyncio.get_running_loop().time() >= end_s:
                return False
            await asyncio.sleep(LOOK_S)

    async def require_at_rest(self) -> None:
        """Raises AxisStateError where the axis has power or does not stand."""
        state = await self.state()
        if state not in _OFF:
            keys = [one.text_key for one in AxisState if one in _OFF]
            raise AxisStateError(device=self.target.slug, state_key=state.text_key, wanted_keys=keys)
        if not await self.until_still(timeout_s=0.0):
            raise AxisStateError(
                device=self.target.slug, state_key="axis_found.moving", wanted_key="axis_needed.standstill"
            )

    # -- sequences -------------------------------------------------------------------

    async def switch_off(self) -> None:
        """Output stage off, brake engaged: ready, or switch-on disabled. Raises AxisStateError, OvertakenError."""
        state = await self.state()
        if state in (AxisState.OPERATION_ENABLED, AxisState.SWITCHED_ON):
            await self.say(Word.SHUTDOWN)
        if state is not AxisState.FAULT:
            await self.until({*_OFF, AxisState.FAULT})

    async def set_mode(self, mode: AxisMode) -> None:
        """Change the mode; the output stage is switched off for it (manual 5.9). Raises UnverifiedError too."""
        if await self.number(MODE_SHOWN) == mode:
            return
        await self.switch_off()
        await self.say(Word.SHUTDOWN)
        await self._until_heard()
        await self._before_mode(mode)
        self.require_own()
        await self.driver.write(self.target.node, MODE, mode.to_bytes(1, "little"), verify=Verify.ACK)
        end_s = asyncio.get_running_loop().time() + _MODE_TIMEOUT_S
        while (found := await self.number(MODE_SHOWN)) != mode:
            if asyncio.get_running_loop().time() >= end_s:
                break
            await asyncio.sleep(LOOK_S)
        if found != mode:
            raise UnverifiedError(
                address=MODE.short, name="mode", sent=str(int(mode)), found=str(found), reason_key="unverified.mode"
            )

    async def mode_back(self, changed: ModeChanged) -> bool:
        """Give an axis without power the mode that it had; one that had none gets one that goes nowhere by itself.

        One that is not in the mode that was set last is left as it is: somebody else has it. False where it must wait:
        an EFC is in force, or the axis does not listen. For a Control of its own: whoever else is about to command the
        axis is overtaken by what is sent here. Raises OvertakenError where somebody commands it meanwhile, and what a
        write raises.
        """
        self.own()  # before the look: a FEATHER that comes after it is not ended by what is sent here
        # A mode that is a saved setting has to be what it was, none too.
        mode = changed.was if self.target.entry(MODE).saved else changed.was or AxisMode.PROFILE_POSITION
        shown = await self.number(MODE_SHOWN)
        if shown == mode or not changed.stands(shown):
            return True
        word = await self.number(CONTROLWORD)
        if word & _EFC or not await self.status() & REMOTE or await self.state() in ENERGISED:
            return False
        if word & _ENABLE_OPERATION:
            await self.say(Word.NO_POWER)
            await self._until_heard()
        self.require_own()
        await self.driver.write(self.target.node, MODE, mode.to_bytes(1, "little", signed=True), verify=Verify.ACK)
        return await self.number(MODE_SHOWN) == mode

    async def _until_heard(self) -> None:
        """Wait until bit 3 of the word that stands in the device is 0 too: a PDO may be worked later than a request."""
        end_s = asyncio.get_running_loop().time() + STATE_TIMEOUT_S
        while await self.number(CONTROLWORD) & _ENABLE_OPERATION:
            if asyncio.get_running_loop().time() >= end_s:
                raise AxisStateError(
                    device=self.target.slug, state_key="axis_found.enabled", wanted_key="axis_needed.not_enabled"
                )
            await asyncio.sleep(LOOK_S)

    async def enable(self) -> None:
        """Operation enabled, halted: the axis holds where it is.

        Raises AxisStateError, OvertakenError, NotHeldError.
        """
        state = await self.state()
        if state in (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE):
            raise AxisStateError(
                device=self.target.slug, state_key=state.text_key, wanted_key=AxisState.OPERATION_ENABLED.text_key
            )
        if state is AxisState.OPERATION_ENABLED:
            await self.say(Word.HALT)
            return
        await self.say(Word.SHUTDOWN)
        await self.until({AxisState.READY})
        self._require_held()
        await self.say(Word.SWITCH_ON)
        await self.until({AxisState.SWITCHED_ON})
        self._require_held()
        await self.say(Word.HALT)
        await self.until({AxisState.OPERATION_ENABLED}, or_overtaken=True)

    async def reset_fault(self) -> AxisState:
        """Reset the fault; the state that came of it, which is the fault where its cause still stands.

        By an edge of bit 7, or by one of 5040h (manual 5.15, table 8) where an open safety chain keeps the axis from
        listening to its controlword, or where it hears no PDO. Raises OvertakenError, AxisStateError, and what a write
        raises.
        """
        status = await self.status()
        state = AxisState.of(status)
        if status & REMOTE and state is not None and state is not AxisState.FAULT:
            return state  # there is none: its words would end what is under way
        by_object = MANUAL in self.target.description.entries
        if (by_object and not status & REMOTE) or not await self._reset_by_word(by_object):
            self.require_own()
            for data in (b"\x80", b"\0"):
                await self.driver.write(self.target.node, MANUAL, data, verify=Verify.ACK)
        return await self._reset_done()

    async def _reset_by_word(self, may_fail: bool) -> bool:
        """The edge of bit 7; False where no PDO takes it and it may fail, and nothing was sent."""
        try:
            await self.say(Word.SHUTDOWN)
        except AxisStateError:
            if not may_fail:
                raise
            return False
        await self.say(Word.FAULT_RESET)
        await self.say(Word.SHUTDOWN)
        return True

    async def _reset_done(self) -> AxisState:
        """Wait until the axis listens again and has no fault, or until it is clear that it will not."""
        end_s = asyncio.get_running_loop().time() + RESET_TIMEOUT_S
        while True:
            state = await self.state()
            listens = await self.status() & REMOTE
            free = listens and state not in (AxisState.FAULT, AxisState.FAULT_REACTION_ACTIVE)
            if free or asyncio.get_running_loop().time() >= end_s:
                return state
            await asyncio.sleep(LOOK_S)


def cia402(control: Commanding) -> Control:
    """``control`` as one of CiA 402. Raises UsageError where the axis has another state machine."""
    if not isinstance(control, Control):
        raise UsageError(reason=f"{control.target.slug} has no such command: it is no axis of CiA 402")
    return control
