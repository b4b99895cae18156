"""Saving by categories (PD4-E manual, 7.3.8, pages 88 to 92 and 134 to 137; 1020h: page 142).

A save disturbs the control: the motor must stand still before it and must not be started meanwhile (page 91), so the
output stage may not follow anything, and until the save has ended no motion object is written but urgently. Date and
time go into 1020h before the save; after a restart they tell whether what is in force is what was saved then. The
sub-indices of the categories are not printed: the device is asked whether it has the one that is wanted, and whether it
can be saved now.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import ExitStack
from datetime import UTC, date, datetime, timedelta
from typing import Final, NamedTuple

from app.drivers.modbus_device import STATUSWORD, ModbusDevice, state_text_key
from app.drivers.modbus_link import InterruptedRequest, ModbusLink
from app.errors import BusLostError, DeviceError, NoAnswerError, PreconditionError, UnverifiedError
from app.model.address import Address
from app.model.axis_state import FOLLOWING, AxisState
from app.model.description import SaveCommand, Verify
from app.model.saving import command_of

STORE: Final = 0x1010
VELOCITY: Final = Address(0x6044)
"""Velocity actual value of the mode Velocity, INTEGER16; in user units, and 0 at standstill in any mode."""
SPEED: Final = Address(0x606C)
"""Velocity actual value, INTEGER32."""
SAVED_DATE: Final = Address(0x1020, 1)
SAVED_TIME: Final = Address(0x1020, 2)
READY: Final = 1
_EPOCH: Final = date(1984, 1, 1)
_POLL_S: Final = 0.05


class Stamp(NamedTuple):
    """What 1020h holds: ``days`` since 1 January 1984 and ``ms`` since midnight, UTC."""

    days: int
    ms: int

    @classmethod
    def of(cls, moment: datetime) -> Stamp:
        """The stamp of ``moment``, which has a time zone."""
        utc = moment.astimezone(UTC)
        midnight = utc.replace(hour=0, minute=0, second=0, microsecond=0)
        return cls((utc.date() - _EPOCH).days, (utc - midnight) // timedelta(milliseconds=1))


async def save(device: ModbusDevice, category: str | None, now: Callable[[], datetime]) -> Stamp:
    """Save one category, or all; returns the stamp that it bears. Not proven before a restart.

    Raises PreconditionError (the axis is live or moves, or the entry is not ready: nothing was saved), UsageError,
    UnverifiedError (it was ordered, but the device does not say that it has ended), and what reads and writes raise.
    """
    command = command_of(() if device.description is None else device.description.save, category)
    await _standstill(device)
    await _ready(device, command)
    stamp = Stamp.of(now())
    await device.write(SAVED_DATE, stamp.days.to_bytes(4, "little"))
    await device.write(SAVED_TIME, stamp.ms.to_bytes(4, "little"))
    signature = command.signature.to_bytes(4, "little")
    with ExitStack() as until_ended:

        async def last_look(link: ModbusLink) -> None:
            """It may have been started meanwhile. What waits for its turn behind the save comes too late."""
            await _standstill(device, link)
            if link.wanted_urgently:
                raise InterruptedRequest
            until_ended.enter_context(device.saving(command.address))

        await device.write(command.address, signature, command.timeout_s, verify=Verify.ACK, before=last_look)
        await _ended(device, command)
    return stamp


async def bears(device: ModbusDevice, stamp: tuple[int, int]) -> bool:
    """Whether 1020h holds ``stamp``: after a restart, whether that save is what is in force."""
    days, ms = await device.read(SAVED_DATE), await device.read(SAVED_TIME)
    return stamp == (int.from_bytes(days, "little"), int.from_bytes(ms, "little"))


async def _standstill(device: ModbusDevice, held: ModbusLink | None = None) -> None:
    """``held``: the connection whose turn the caller holds. Raises PreconditionError, and what reads raise."""
    state = AxisState.of(int.from_bytes(await device.read(STATUSWORD, held=held), "little"))
    if state is None or state in FOLLOWING:
        known = {} if state is None else {"found_key": state_text_key(state)}
        raise PreconditionError(
            address=STATUSWORD.short,
            name=device.name(STATUSWORD),
            needs="an output stage that is off",
            needs_key="saving.needs.stage_off",
            found="unknown" if state is None else state.name.lower(),
            **known,
        )
    for address in (VELOCITY, SPEED):
        try:
            speed = int.from_bytes(await device.read(address, held=held), "little", signed=True)
        except DeviceError:
            continue  # it has no such object
        if speed:
            raise PreconditionError(
                address=address.short,
                name=device.name(address),
                needs="0",
                needs_key="saving.needs.standstill",
                found=str(speed),
            )


async def _ready(device: ModbusDevice, command: SaveCommand) -> None:
    """The device has the sub-index, and says that its category can be saved now."""
    highest = int.from_bytes(await device.read(Address(STORE, 0)), "little")
    value = int.from_bytes(await device.read(command.address), "little") if command.address.minor <= highest else None
    if value != READY:
        found = f"{highest} categories" if value is None else f"{value:08X}h"
        raise PreconditionError(
            address=command.address.short, name=device.name(command.address), needs=str(READY), found=found
        )


async def _ended(device: ModbusDevice, command: SaveCommand) -> None:
    """The entry reads 1 again once the save has ended (page 137).

    The save was ordered: a device that answers otherwise meanwhile, or not, has not refused it.
    """
    value = None
    try:
        async with asyncio.timeout(command.timeout_s):
            while (value := await _entry(device, command.address)) != READY:  # noqa: ASYNC110  only the device knows
                await asyncio.sleep(_POLL_S)
    except TimeoutError:
        raise UnverifiedError(
            address=command.address.short,
            name=device.name(command.address),
            sent=f"{command.signature:08X}h",
            found=None if value is None else f"{value:08X}h",
            reason=f"the save has not ended within {command.timeout_s:g} s",
        ) from None


async def _entry(device: ModbusDevice, address: Address) -> int | None:
    """What it reads; None where the device does not say it now."""
    try:
        return int.from_bytes(await device.read(address), "little")
    except BusLostError:
        raise
    except (DeviceError, NoAnswerError):
        return None
