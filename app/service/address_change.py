"""Objects that decide at which address a device is found: what a person must know before one of them is written.

Such a write does nothing by itself. Once it is saved and the device was restarted, the connection through which it was
written is lost, and the site file names an address at which nobody answers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from ipaddress import IPv4Address
from typing import Final

from app.errors import AddressChangeError
from app.model.address import Address
from app.model.checks import Allow
from app.model.datatypes import Raw
from app.model.description import Entry, RestoreClass
from app.model.servers import Server
from app.service.devices import Target

CONFIGURATION: Final = Address(0x2010)
STATIC_ADDRESS: Final = Address(0x2011)
STATIC_MASK: Final = Address(0x2012)
STATIC_BIT: Final = 0
"""Of 2010h: the static address holds. Address and mask 0, or the bit not set, mean DHCP."""


@dataclass(frozen=True, slots=True)
class AddressChange:
    """What one device's pending writes would do. ``addresses``: the objects that decide.

    ``connected`` is where it is reached now. ``site_address`` is what the site file must say once the device was saved
    and restarted; None where nobody can tell beforehand (DHCP, or the bus itself is switched).
    """

    device: str
    addresses: tuple[Address, ...]
    connected: str
    site_address: str | None


def decides_address(entry: Entry) -> bool:
    """True where a write of the object can make the device be found elsewhere, or not at all."""
    return entry.restore is RestoreClass.NETWORK


def require_confirmed(target: Target, entry: Entry, allow: Allow) -> None:
    """Raises AddressChangeError, which tells where the device is reached now, unless ``allow`` has it confirmed."""
    if decides_address(entry) and Allow.ADDRESS not in allow:
        raise AddressChangeError(address=entry.address.short, name=entry.title, connected=_connected(target))


def address_changes(wanted: Iterable[tuple[Target, Address, Raw]]) -> tuple[AddressChange, ...]:
    """Of a batch, device by device, what has to be confirmed before it is written."""
    found: dict[str, tuple[Target, dict[Address, Raw]]] = {}
    for target, address, raw in wanted:
        entry = target.description.entries.get(address)
        if entry is not None and decides_address(entry):
            found.setdefault(target.slug, (target, {}))[1][address] = raw
    return tuple(
        AddressChange(target.slug, tuple(own), _connected(target), _site_address(target, own))
        for target, own in found.values()
    )


def _connected(target: Target) -> str:
    return target.device.server.text if target.device.address else "–"


def _site_address(target: Target, own: Mapping[Address, Raw]) -> str | None:
    """The static address with the port of now, where it will be in force; the port is none of the device's objects."""

    def after(address: Address) -> int:
        raw = own[address] if address in own else target.lookup(address)
        return raw if isinstance(raw, int) else 0

    is_ip = any(address in own for address in (CONFIGURATION, STATIC_ADDRESS, STATIC_MASK))
    is_other = any(not CONFIGURATION.major <= address.major <= 0x2013 for address in own)
    static = after(CONFIGURATION) >> STATIC_BIT & 1 and after(STATIC_ADDRESS) and after(STATIC_MASK)
    if not is_ip or is_other or not static or not target.device.address:
        return None
    server = target.device.server
    return Server(str(IPv4Address(after(STATIC_ADDRESS))), server.port, server.unit).text
