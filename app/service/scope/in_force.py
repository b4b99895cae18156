"""The parameter values that are in force: what is known of the RAM of devices at this moment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.sets import IDENTITY, identity_of
from app.model.values import quantity_of, show
from app.service.devices import Target, decode
from app.service.scope.capture import InForce, KeptDevice
from app.wire.live import ValueView


@dataclass(frozen=True, slots=True)
class Frozen:
    """What was known of a device at one moment."""

    target: Target
    views: Mapping[Address, ValueView]

    @classmethod
    def of(cls, target: Target) -> Frozen:
        """As it is known now; cheap."""
        return cls(target, target.live.values(target.device.bus, target.node))

    def lookup(self, address: Address) -> Raw | None:
        """The raw value that was known then."""
        view, entry = self.views.get(address), self.target.description.entries.get(address)
        return None if view is None or view.reading is None or entry is None else decode(entry, view.reading.data)


def in_force(devices: Iterable[Frozen]) -> list[InForce]:
    """Every value of these devices that was known, device by device."""
    return [row for device in devices for row in _of(device)]


def _of(device: Frozen) -> Iterable[InForce]:
    target = device.target
    for entry in target.description:
        view = device.views.get(entry.address)
        raw = device.lookup(entry.address)
        if view is None or raw is None:
            continue
        yield InForce(
            device=target.slug,
            address=entry.address.short,
            title=entry.title,
            raw=raw_text(raw),
            shown=show(entry, raw, device.lookup),
            unit="" if isinstance(raw, str | bytes) else quantity_of(entry, device.lookup).unit,
            name_key=target.description.name_key(entry, raw) if isinstance(raw, int) else None,
            stale=view.stale,
            stored=None if view.stored is None else view.stored.state.value,
            parameter=entry.is_parameter,
        )


def raw_text(raw: Raw) -> str:
    """A raw value as text, exactly."""
    return raw.hex() if isinstance(raw, bytes) else str(raw)


def who(device: Frozen) -> KeptDevice:
    """Who a device is, and how much was known of it."""
    target = device.target
    found = {address: raw for address in IDENTITY.values() if (raw := device.lookup(address)) is not None}
    identity = identity_of(found)
    readable = [entry.address for entry in target.description if entry.access.readable]
    unknown = sum(1 for address in readable if device.lookup(address) is None)
    return KeptDevice(
        device=target.slug,
        description_id=target.description.id,
        description_version=target.description.version,
        device_name=identity.device_name,
        serial=identity.serial,
        software=identity.software,
        values=len(readable) - unknown,
        unknown=unknown,
    )
