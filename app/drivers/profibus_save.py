"""Saving by db_StoreParameter (ED2 manual, 4.8.7 and 5.5): all parameters at once, there is no save of a part."""

from __future__ import annotations

from typing import Final

from app.drivers.profibus_device import CONTROLWORD, ProfibusDevice
from app.drivers.profibus_image import ENABLING
from app.errors import PreconditionError
from app.model.description import Verify
from app.model.saving import command_of

SAVE_TIMEOUT_S: Final = 10.0
"""The least time-out: non-volatile memory is slow, and the manual names no time."""


async def save(device: ProfibusDevice, category: str | None) -> None:
    """Save while the axis is not enabled. Not proven before a restart.

    Raises PreconditionError (it is enabled, or would keep a zero of our own process data: nothing was saved),
    UsageError, and what writes raise.
    """
    command = command_of(() if device.description is None else device.description.save, category)
    station = device.station
    if station is not None and station.image.controlword & ENABLING:
        raise PreconditionError(
            address=CONTROLWORD.short,
            name=device.name(CONTROLWORD),
            needs="an output stage that is off",
            needs_key="saving.needs.stage_off",
            found=f"{station.image.controlword:04X}h",
        )
    if device.overridden:
        first = min(device.overridden)
        raise PreconditionError(
            address=first.short,
            name=device.name(first),
            needs="a value that was written",
            needs_key="saving.needs.written",
            found="0",
            found_key="profibus.overridden",
        )
    signature = command.signature.to_bytes(4, "little")
    await device.write(command.address, signature, max(command.timeout_s, SAVE_TIMEOUT_S), verify=Verify.ACK)
