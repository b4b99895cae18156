"""The controlword of one axis in the hands of who moves it (CiA 402; OAT manual 5.8, tables 49 to 53).

Words go by RPDO1, past all queues; on a bus without PDOs each is written, and acknowledged before the next. Before each
one is asked whether anybody else has commanded the axis since, STOP and FEATHER first of all: then nothing is sent any
more (OvertakenError). What ends a motion goes ahead of all that waits.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Collection
from decimal import Decimal
from enum import IntEnum
from typing import Any, Final

from app.errors import AxisStateError, NotHeldError, OvertakenError, UnverifiedError
from app.model.address import Address
from app.model.axis_state import ENERGISED, AxisState
from app.model.description import Verify
from app.model.values import quantity_of, to_scaled
from app.service.devices import Target, decode
from app.service.motion.interlocks import POSITION
from app.service.motion.left import ModeChanged
from app.service.stop import CONTROLWORD, EFC_TARGET, STATUSWORD
from app.service.write import know_what_it_rests_on

log = logging.getLogger(__name__)

MODE: Final = Address(0x6060)
MODE_SHOWN: Final = Address(0x6061)
VELOCITY: Final = Address(0x606C)
MANUAL: Final = Address(0x5040)
_EFC: Final = 1 << 11
_AT_TARGET_DEG: Final = 0.5
_LOOK_S: Final = 0.01
STATE_TIMEOUT_S: Final = 3.0
STAND_TIMEOUT_S: Final = 10.0
RESET_TIMEOUT_S: Final = 1.0
_MODE_TIMEOUT_S: Final = 0.2
_ANSWER_S: Final = 0.5
"""So long a device on a bus of its own connection may take for an answer while it is commanded."""
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
_RUNS: Final = frozenset({Word.RUN, Word.NEW_SET_POINT, Word.FEATHER})
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


class Control:
    """Commands to one axis. ``send`` puts the controlword into RPDO1; False: no such PDO is in force.

    ``send`` None: the bus has no PDOs, and words are written. ``before_mode`` hears of every mode before it is set.

    ``own`` begins a command; what else commands the axis after it ends the command.
    """

    def __init__(
        self,
        driver: Any,
        target: Target,
        send: Callable[[bytes], bool] | None,
        before_mode: Callable[[int], Awaitable[None]],
    ) -> None:
        self.driver = driver
        self.target = target
        self._send = send
        self._before_mode = before_mode
        self._answer_s = None if send is not None else _ANSWER_S
        self._known = 0
        self._sent = self._ended = self._released = self._let_go = False

    def own(self) -> None:
        """Command the axis from now on: another order begins."""
        self._known = self._count()
        self._sent = self._ended = self._released = self._let_go = False

    def _count(self) -> int:
        return int(self.driver.commanded(self.target.node, CONTROLWORD))

    @property
    def overtaken(self) -> bool:
        """Somebody else has commanded the axis since, STOP and FEATHER first of all."""
        return self._count() != self._known

    def require_own(self) -> None:
        """Raises OvertakenError where somebody else has commanded the axis since, or ``stop`` has ended it."""
        if self.overtaken or self._ended:
            raise OvertakenError(address=CONTROLWORD.short, node=self.target.node)

    async def say(self, word: Word) -> None:
        """Send a controlword; where it is written, until the axis has acknowledged it.

        Nothing is sent that would run an axis that was let go. Raises OvertakenError, AxisStateError (no PDO takes it
        at once), BusLostError, and where it is written what a write raises.
        """
        if self._send is not None:
            self._by_pdo(word)
            return
        self.require_own()
        if self._let_go and word in _RUNS:
            return
        self._sent = True
        try:
            await self._write(word, known=self._known)
        except OvertakenError:
            if self.overtaken or self._ended:
                raise
            await self.say(word)  # what let it go went ahead of it: does it still count?

    def _by_pdo(self, word: Word) -> None:
        self.require_own()
        self._sent = True
        if not self._send_counted(word):
            raise AxisStateError(
                device=self.target.slug, state_key="axis_found.not_by_pdo", wanted_key="axis_needed.operational"
            )

    def let_go(self, word: Word) -> bool:
        """Nobody holds a running axis any more: ``word`` at once. False where it must be written: ``let_go_by_write``.

        Raises OvertakenError, AxisStateError, BusLostError.
        """
        if self._send is not None:
            self._by_pdo(word)
            return True
        self.require_own()
        self._let_go = True
        return False

    async def let_go_by_write(self, word: Word) -> None:
        """``word`` ahead of all that waits, which of this order is not sent any more. Raises what a write raises."""
        if not self._ended:
            await self._write_ahead(word)

    async def halt(self) -> None:
        """Halt an axis that is enabled; any other one would be enabled by that word. Raises AxisStateError too."""
        state = await self.state()
        if state is not AxisState.OPERATION_ENABLED:
            raise AxisStateError(
                device=self.target.slug, state_key=state.text_key, wanted_key=AxisState.OPERATION_ENABLED.text_key
            )
        await self.say(Word.HALT)

    def stop(self) -> bool:
        """Quick stop at once. False where it could not be sent as a PDO and has to be written: ``stop_by_write``.

        What this order had the axis do ends by it. Where it has sent nothing yet, or somebody else has commanded the
        axis since, nothing is sent: it would end a FEATHER. Raises BusLostError.
        """
        self._ended = True
        if self.overtaken or not self._sent:
            return True
        return self._send_counted(Word.QUICK_STOP)

    def _send_counted(self, word: Word) -> bool:
        """A frame that the adapter did not take is counted too: it is ours, not a command of somebody else."""
        if self._send is None:
            return False
        try:
            return self._send(word.to_bytes(2, "little"))
        finally:
            self._known = self._count()

    def release(self) -> None:
        """Nobody holds it any more: ``enable`` goes no step further."""
        self._released = True

    def _require_held(self) -> None:
        if self._released:
            raise NotHeldError(device=self.target.slug)

    async def stop_by_write(self) -> None:
        """Quick stop where no PDO carries it: ahead of all that waits. Raises NoAnswerError, DeviceError."""
        await self._write_ahead(Word.QUICK_STOP)

    async def _write_ahead(self, word: Word) -> None:
        if self.overtaken or not self._sent:
            return
        self._known += 1  # an urgent write counts itself, before anything else can
        try:
            await self._write(word)
        except OvertakenError:
            log.debug("%s: %s gave way to what came after it", self.target.slug, word.name)

    async def _write(self, word: Word, known: int | None = None) -> None:
        """Urgent unless ``known`` tells of what it knows."""
        data = word.to_bytes(2, "little")
        await self.driver.write(
            self.target.node, CONTROLWORD, data, verify=Verify.ACK, urgent=known is None, known=known
        )

    # -- what the axis says --------------------------------------------------------

    async def number(self, address: Address) -> int:
        """An object of the axis. Raises NoAnswerError, DeviceError, AxisStateError (no number came)."""
        data = await self.driver.read(self.target.node, address, self._answer_s)
        raw = decode(self.target.entry(address), data)
        if not isinstance(raw, int):
            raise AxisStateError(
                device=self.target.slug, state=data.hex(" "), wanted_key="axis_needed.number", address=address.short
            )
        return raw

    async def status(self) -> int:
        """The statusword."""
        return await self.number(STATUSWORD)

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
            await asyncio.sleep(_LOOK_S)
        return state

    async def until_bits(self, bits: int, are_set: bool, timeout_s: float = STATE_TIMEOUT_S) -> int:
        """Wait until all ``bits`` of the statusword are set, or none of them. Raises AxisStateError."""
        end_s = asyncio.get_running_loop().time() + timeout_s
        while (status := await self.status()) & bits != (bits if are_set else 0):
            if asyncio.get_running_loop().time() >= end_s:
                key = f"axis_needed.bits_{'set' if are_set else 'clear'}"
                raise AxisStateError(
                    device=self.target.slug, state=f"{status:04X}h", wanted_key=key, bits=f"{bits:04X}h"
                )
            await asyncio.sleep(_LOOK_S)
        return status

    async def is_feathering(self) -> bool:
        """An EFC is commanded, and the axis has power and is not there yet."""
        if EFC_TARGET not in self.target.description.entries:
            return False
        if not await self.number(CONTROLWORD) & _EFC or await self.state() not in ENERGISED:
            return False
        far = abs(await self.scaled(POSITION) - await self.scaled(EFC_TARGET)) > _AT_TARGET_DEG
        return far or not await self.until_still(timeout_s=0.0)

    async def scaled(self, address: Address) -> float:
        """An object in the unit that its description gives it: degrees and degrees a second at a blade.

        Raises AxisStateError where its scale is not known.
        """
        entry = self.target.entry(address)
        await know_what_it_rests_on(self.driver, self.target, entry)
        found = to_scaled(entry, await self.number(address), self.target.lookup)
        if found is None:
            raise AxisStateError(
                device=self.target.slug,
                state_key="axis_found.unknown",
                wanted_key="axis_needed.scale",
                address=address.short,
            )
        return float(found.number)

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
            await asyncio.sleep(_LOOK_S)

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

    async def until_off(self, timeout_s: float) -> bool:
        """Wait until the axis has no power; whether it has none. Raises what reading raises."""
        end_s = asyncio.get_running_loop().time() + timeout_s
        while await self.state() in ENERGISED:
            if asyncio.get_running_loop().time() >= end_s:
                return False
            await asyncio.sleep(_LOOK_S)
        return True

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
            await asyncio.sleep(_LOOK_S)
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
            await asyncio.sleep(_LOOK_S)

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
            await asyncio.sleep(_LOOK_S)
