"""What each use case needs to know of one device: its place, its description, and what the live state knows of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from app.drivers.contract import Driver
from app.errors import NoAnswerError
from app.model.address import Address
from app.model.datatypes import Raw, decode_raw
from app.model.description import Description, Entry
from app.model.sets import IDENTITY, Identity, identity_of
from app.model.site import Device
from app.model.variant import variant_of
from app.service.gate import OPEN, Gate
from app.wire.live import LiveState

_WHO: Final = tuple(IDENTITY[name] for name in ("vendor_id", "product_code", "serial", "drive_serial"))


@dataclass(frozen=True, slots=True)
class Target:
    """One device of the connected turbine. ``gate`` is asked before it is written, saved or restarted."""

    device: Device
    description: Description
    live: LiveState
    gate: Gate = OPEN

    @property
    def slug(self) -> str:
        """The device's path: turbine/station/device."""
        return self.device.slug

    @property
    def node(self) -> int:
        """Node number on its bus."""
        return self.device.node

    def lookup(self, address: Address) -> Raw | None:
        """Latest raw value that was seen on the wire since the last boot-up, or None."""
        view = self.live.value(self.device.bus, self.node, address)
        entry = self.description.entries.get(address)
        if view is None or view.reading is None or entry is None:
            return None
        return decode(entry, view.reading.data)

    @property
    def variant(self) -> str | None:
        """Which variant of its description the device is, by what the wire has shown; None where that is not clear."""
        if not self.description.variants:
            return None
        who = who_is(self)
        return variant_of(self.description, who.device_name, who.product_code)

    async def pass_gate(self, driver: Driver, address: Address | None = None) -> None:
        """Raises RestoreOpenError where a restore of the device is not finished, DeviceBusyError where it is in use.

        ``address`` is about to be written, 1010h of a save; None: the device is about to be restarted. Its identity is
        read for that where nobody has seen it yet. Raises NoAnswerError, BusLostError, ConsentError.
        """
        await self.gate.check(self.device, lambda: self._identity(driver), address)

    async def require_no_restore(self, driver: Driver) -> None:
        """As ``pass_gate``, for who has claimed the device."""
        await self.gate.check_restores(self.device, lambda: self._identity(driver))

    def past_gate(self) -> Target:
        """The same device for who has it for himself: nothing keeps him from ending what he began."""
        return replace(self, gate=OPEN)

    def past_claims(self) -> Target:
        """The same device for who moves it: only a restore that is not finished keeps him from it."""
        return replace(self, gate=self.gate.past_claims())

    async def _identity(self, driver: Driver) -> Identity:
        """What the device says of itself. Raises NoAnswerError."""
        wanted = [address for address in _WHO if address in self.description.entries]
        unknown = [address for address in wanted if self.lookup(address) is None]
        found = {address: raw for address in wanted if (raw := self.lookup(address)) is not None}
        for address, answer in (await driver.read_many(self.node, unknown)).items() if unknown else ():
            if isinstance(answer, bytes):
                found[address] = decode(self.entry(address), answer)
            elif isinstance(answer, NoAnswerError):  # one that only refuses has none to tell
                raise answer
        return identity_of(found)

    def entry(self, address: Address) -> Entry:
        """The entry at ``address``. Raises UnknownObjectError."""
        return self.description.entry(address)


def who_is(target: Target) -> Identity:
    """What the wire has shown of a device's identity."""
    found = {address: raw for address in IDENTITY.values() if (raw := target.lookup(address)) is not None}
    return identity_of(found)


def decode(entry: Entry, data: bytes) -> Raw:
    """Raw value of what came over the wire; bytes as they are where their length is not the type's.

    So are floats that are no number (infinite, NaN): sets and everything in JSON have no way to hold them.
    """
    try:
        raw = decode_raw(entry.type, data)
    except ValueError:
        return data
    return data if isinstance(raw, float) and not math.isfinite(raw) else raw
