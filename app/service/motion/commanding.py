"""The controlword of one axis in the hands of who moves it, whatever its words mean.

Words go by RPDO1, past all queues; on a bus without PDOs each is written, and acknowledged before the next. Before each
one is asked whether anybody else has commanded the axis since, STOP and FEATHER first of all: then nothing is sent any
more (OvertakenError). What ends a motion goes ahead of all that waits.
"""

from __future__ import annotations

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from enum import IntEnum
from typing import Any, ClassVar, Final

from app.errors import AxisStateError, NotHeldError, OvertakenError
from app.model.address import Address
from app.model.description import Verify
from app.model.values import to_scaled
from app.service.devices import Target, decode
from app.service.motion.left import ModeChanged
from app.service.stop import machine_of
from app.service.write import know_what_it_rests_on

log = logging.getLogger(__name__)

LOOK_S: Final = 0.01
STATE_TIMEOUT_S: Final = 3.0
_ANSWER_S: Final = 0.5
"""So long a device on a bus of its own connection may take for an answer while it is commanded."""


class Commanding(ABC):
    """Commands to one axis, whatever its state machine.

    ``send`` puts the controlword into RPDO1; False: no such PDO is in force.

    ``send`` None: the bus has no PDOs, and words are written. ``before_mode`` hears of every mode before it is set.

    ``own`` begins a command; what else commands the axis after it ends the command.
    """

    stop_word: ClassVar[IntEnum]
    """Brings the axis to rest at once."""
    halt_word: ClassVar[IntEnum]
    """Brings an axis that runs to rest by its ramp."""
    running_words: ClassVar[frozenset[IntEnum]]
    """What an axis that was let go must not hear any more."""

    def __init__(
        self,
        driver: Any,
        target: Target,
        send: Callable[[bytes], bool] | None,
        before_mode: Callable[[int], Awaitable[None]],
    ) -> None:
        self.driver = driver
        self.target = target
        self.machine = machine_of(target)
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
        return int(self.driver.commanded(self.target.node, self.machine.controlword))

    @property
    def overtaken(self) -> bool:
        """Somebody else has commanded the axis since, STOP and FEATHER first of all."""
        return self._count() != self._known

    def require_own(self) -> None:
        """Raises OvertakenError where somebody else has commanded the axis since, or ``stop`` has ended it."""
        if self.overtaken or self._ended:
            raise OvertakenError(address=self.machine.controlword.short, node=self.target.node)

    async def say(self, word: IntEnum) -> None:
        """Send a controlword; where it is written, until the axis has acknowledged it.

        Nothing is sent that would run an axis that was let go. Raises OvertakenError, AxisStateError (no PDO takes it
        at once), BusLostError, and where it is written what a write raises.
        """
        if self._send is not None:
            self._by_pdo(word)
            return
        self.require_own()
        if self._let_go and word in self.running_words:
            return
        self._sent = True
        try:
            await self._write(word, known=self._known)
        except OvertakenError:
            if self.overtaken or self._ended:
                raise
            await self.say(word)  # what let it go went ahead of it: does it still count?

    def _by_pdo(self, word: IntEnum) -> None:
        self.require_own()
        self._sent = True
        if not self._send_counted(word):
            raise AxisStateError(
                device=self.target.slug, state_key="axis_found.not_by_pdo", wanted_key="axis_needed.operational"
            )

    def let_go(self, word: IntEnum) -> bool:
        """Nobody holds a running axis any more: ``word`` at once. False where it must be written: ``let_go_by_write``.

        Raises OvertakenError, AxisStateError, BusLostError.
        """
        if self._send is not None:
            self._by_pdo(word)
            return True
        self.require_own()
        self._let_go = True
        return False

    async def let_go_by_write(self, word: IntEnum) -> None:
        """``word`` ahead of all that waits, which of this order is not sent any more. Raises what a write raises."""
        if not self._ended:
            await self._write_ahead(word)

    def stop(self) -> bool:
        """Quick stop at once. False where it could not be sent as a PDO and has to be written: ``stop_by_write``.

        What this order had the axis do ends by it. Where it has sent nothing yet, or somebody else has commanded the
        axis since, nothing is sent: it would end a FEATHER. Raises BusLostError.
        """
        self._ended = True
        if self.overtaken or not self._sent:
            return True
        return self._send_counted(self.stop_word)

    def _send_counted(self, word: IntEnum) -> bool:
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
        await self._write_ahead(self.stop_word)

    async def _write_ahead(self, word: IntEnum) -> None:
        if self.overtaken or not self._sent:
            return
        self._known += 1  # an urgent write counts itself, before anything else can
        try:
            await self._write(word)
        except OvertakenError:
            log.debug("%s: %s gave way to what came after it", self.target.slug, word.name)

    async def _write(self, word: IntEnum, known: int | None = None) -> None:
        """Urgent unless ``known`` tells of what it knows."""
        data = word.to_bytes(2, "little")
        await self.driver.write(
            self.target.node, self.machine.controlword, data, verify=Verify.ACK, urgent=known is None, known=known
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
        return await self.number(self.machine.statusword)

    async def until_bits(self, bits: int, are_set: bool, timeout_s: float = STATE_TIMEOUT_S) -> int:
        """Wait until all ``bits`` of the statusword are set, or none of them. Raises AxisStateError."""
        end_s = asyncio.get_running_loop().time() + timeout_s
        while (status := await self.status()) & bits != (bits if are_set else 0):
            if asyncio.get_running_loop().time() >= end_s:
                key = f"axis_needed.bits_{'set' if are_set else 'clear'}"
                raise AxisStateError(
                    device=self.target.slug, state=f"{status:04X}h", wanted_key=key, bits=f"{bits:04X}h"
                )
            await asyncio.sleep(LOOK_S)
        return status

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

    # -- what its state machine makes of it --------------------------------------------

    @abstractmethod
    async def is_enabled(self) -> bool:
        """It follows what it is told. Raises AxisStateError where its statusword tells no state."""

    @abstractmethod
    async def has_power(self) -> bool:
        """Something could move it: its output stage is on, or its loop is closed. Raises AxisStateError."""

    @abstractmethod
    async def is_feathering(self) -> bool:
        """An emergency drive to feather is commanded, and under way."""

    @abstractmethod
    async def halt(self) -> None:
        """Halt an axis that is enabled; any other one would be enabled by that word. Raises AxisStateError too."""

    @abstractmethod
    async def mode(self) -> int:
        """The mode of operation that is in force."""

    @abstractmethod
    async def mode_back(self, changed: ModeChanged) -> bool:
        """Give an axis without power the mode that it had; False where it must wait."""

    async def until_off(self, timeout_s: float) -> bool:
        """Wait until the axis has no power; whether it has none. Raises what reading raises."""
        end_s = asyncio.get_running_loop().time() + timeout_s
        while await self.has_power():
            if asyncio.get_running_loop().time() >= end_s:
                return False
            await asyncio.sleep(LOOK_S)
        return True
