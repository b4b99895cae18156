"""What is known of one station, its devices side by side: the ground that rules judge and restores are planned on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.sets import ParameterSet


@dataclass(frozen=True, slots=True)
class Place:
    """One object of one device. ``slug`` is the device's: turbine/station/device."""

    slug: str
    address: Address


@dataclass(frozen=True, slots=True)
class DeviceValues:
    """Raw values of one device; an object that is not in ``values`` is not known."""

    slug: str
    description: Description
    values: Mapping[Address, Raw]

    def number(self, address: Address) -> int | None:
        """The raw value where it is a known integer."""
        raw = self.values.get(address)
        return raw if isinstance(raw, int) else None

    def with_value(self, address: Address, raw: Raw) -> DeviceValues:
        """The same device with another value."""
        return replace(self, values={**self.values, address: raw})


@dataclass(frozen=True, slots=True)
class StationValues:
    """Devices that belong together, such as PMM and PMC of one blade; a partner that is missing is not there."""

    devices: tuple[DeviceValues, ...]

    def of_kind(self, description_id: str) -> DeviceValues | None:
        """The device of that description, or None."""
        return next((one for one in self.devices if one.description.id == description_id), None)

    def device(self, slug: str) -> DeviceValues | None:
        """The device with that slug, or None."""
        return next((one for one in self.devices if one.slug == slug), None)

    def raw(self, place: Place) -> Raw | None:
        """What is known of one object."""
        device = self.device(place.slug)
        return None if device is None else device.values.get(place.address)

    def with_value(self, place: Place, raw: Raw) -> StationValues:
        """The same station with another value. A device that is not there changes nothing."""
        devices = (one.with_value(place.address, raw) if one.slug == place.slug else one for one in self.devices)
        return StationValues(tuple(devices))


def station_of(sets: Iterable[tuple[ParameterSet, Description]]) -> StationValues:
    """The station that the sets of its devices describe."""
    return StationValues(tuple(DeviceValues(one.origin.device, description, one.values) for one, description in sets))


def station_slug(device_slug: str) -> str:
    """``wtg-07/blade-2`` of ``wtg-07/blade-2/pmc``."""
    return device_slug.rpartition("/")[0]
