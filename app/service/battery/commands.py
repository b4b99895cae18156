"""Edges of the controlword 3040h: a function starts when its bit rises, so the bit must be 0 before (manual 4.1.2).

A command bit is proven by its effect, never by reading it back. What a lost answer leaves open, the effect tells.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, Final

from app.errors import BatteryCommandError, UnverifiedError
from app.service.battery.objects import CONTROLWORD, USED, Command, read_number
from app.service.devices import Target
from app.service.journal import Journal
from app.service.write import write_raw

EFFECT_S: Final = 3.0
"""A unit that shows no effect so long after the command has not taken it."""
LOOK_S: Final = 0.05


class Edges:
    """Raises and drops bits of one device's controlword; the bits that others use stay as they are."""

    def __init__(self, driver: Any, target: Target, journal: Journal) -> None:
        self._driver = driver
        self._target = target
        self._journal = journal
        self.sent = False
        """A bit was told to rise, whether the unit has heard it or not."""

    async def is_set(self, bit: Command) -> bool:
        """Whether the bit is 1 now. Raises NoAnswerError, DeviceError."""
        return bool(await self._word() & bit)

    async def rise(self, bit: Command, effect: Callable[[], Awaitable[bool]]) -> None:
        """Let a bit rise, and wait for ``effect``. One that is 1 already is written 0 first.

        Raises BatteryCommandError where no effect is seen, and what a write raises.
        """
        if await self.is_set(bit):
            await self._write(bit, False)
        await self._write(bit, True)
        await self.require(bit, effect)

    async def fall(self, bit: Command, effect: Callable[[], Awaitable[bool]] | None = None) -> None:
        """Let a bit fall; one that is 0 already stays. Raises as ``rise`` does."""
        if await self.is_set(bit):
            await self._write(bit, False)
        if effect is not None:
            await self.require(bit, effect)

    async def require(self, bit: Command, effect: Callable[[], Awaitable[bool]]) -> None:
        """Wait for ``effect``. Raises BatteryCommandError, and what reading raises."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + EFFECT_S
        while not await effect():
            if loop.time() >= end_s:
                raise BatteryCommandError(
                    device=self._target.slug, command=bit.name, word=f"{await self._word():04X}h", seconds=EFFECT_S
                )
            await asyncio.sleep(LOOK_S)

    async def _word(self) -> int:
        return await read_number(self._driver, self._target, CONTROLWORD)

    async def _write(self, bit: Command, on: bool) -> None:
        was = await self._word()
        word = (was & USED) | bit if on else was & USED & ~bit
        self.sent = self.sent or on
        try:
            await write_raw(self._driver, self._target, CONTROLWORD, int(word), self._journal, expected=was)
        except UnverifiedError:  # its answer is lost; whether it was taken, the effect tells
            return
