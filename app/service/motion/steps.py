"""Steps that motions of any axis are made of."""

from __future__ import annotations

import asyncio
from typing import Final

from app.model.address import Address
from app.model.checks import Allow
from app.model.datatypes import Raw
from app.model.values import parse
from app.service.journal import Journal
from app.service.motion.commanding import Commanding
from app.service.motion.running import Running
from app.service.write import know_what_it_rests_on, write_raw

_LOOK_S: Final = 0.02


async def wait(running: Running) -> None:
    """Until the next look, or until it is over."""
    try:
        await asyncio.wait_for(running.over.wait(), _LOOK_S)
    except TimeoutError:
        return


async def set_object(control: Commanding, address: Address, raw: Raw, journal: Journal) -> None:
    """Write an object that moves an axis. Raises what ``write_raw`` raises."""
    await write_raw(control.driver, control.target, address, raw, journal, allow=Allow.MOTION)


async def raw_of(control: Commanding, address: Address, number: float) -> Raw:
    """What an object holds for a scaled number. Raises LimitError and what reading raises."""
    target = control.target
    entry = target.entry(address)
    await know_what_it_rests_on(control.driver, target, entry)
    return parse(target.description, entry, f"{number:.3f}".rstrip("0").rstrip("."), target.lookup)
