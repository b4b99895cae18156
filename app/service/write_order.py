"""The order in which a reviewed batch is written: what it rests on is read, then the planner of restores says it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from app.drivers.contract import Driver
from app.errors import HubsideError
from app.model.address import Address
from app.model.checks import Allow
from app.model.datatypes import Raw
from app.model.restore.batch import Batch, batch_order, looked_at
from app.model.station import DeviceValues, Place, StationValues, station_slug
from app.service.compare.known import ram_of
from app.service.devices import Target, decode

Device = tuple[Driver, Target]


class KnownDevices:
    """What is known of the devices of a turbine while a batch is written to them."""

    def __init__(self, targets: Iterable[Target], allow: Allow = Allow.NOTHING, accepted: bool = False) -> None:
        self._targets = {target.slug: target for target in targets}
        self._values: dict[str, dict[Address, Raw]] = {slug: ram_of(one)[0] for slug, one in self._targets.items()}
        self._allow = allow
        self._accepted = accepted

    def unknown(self, wanted: Mapping[Place, Raw]) -> tuple[Place, ...]:
        """The readable objects on which the order of these writes rests and of which nobody knows what they hold."""
        found: dict[Place, None] = {}
        for slug in dict.fromkeys(station_slug(place.slug) for place in wanted):
            station = StationValues(tuple(one for one in self._devices() if station_slug(one.slug) == slug))
            own = {place: raw for place, raw in wanted.items() if station_slug(place.slug) == slug}
            found.update(dict.fromkeys(place for place in looked_at(station, own) if self._can_be_read(place)))
        return tuple(found)

    async def look(self, driver: Driver, place: Place) -> Raw | None:
        """What the object holds, read now; None where the device does not tell: then nobody knows it."""
        target, address = self._targets[place.slug], place.address
        entry = target.entry(address)
        self._values[place.slug].pop(address, None)
        if not entry.access.readable:
            return None
        try:
            raw = decode(entry, await driver.read(target.node, address, entry.timeout_s))
        except HubsideError:
            return None
        self.put(place, raw)
        return raw

    async def read(self, places: Sequence[Place], drivers: Mapping[str, Driver]) -> None:
        """Read what is not known yet. What a device does not tell stays unknown; who writes to it meets the cause."""
        for slug in dict.fromkeys(place.slug for place in places):
            target = self._targets[slug]
            wanted = [one.address for one in places if one.slug == slug]
            try:
                answers = await drivers[slug].read_many(target.node, wanted)
            except HubsideError:
                continue
            for address, answer in answers.items():
                if isinstance(answer, bytes):
                    self._values[slug][address] = decode(target.entry(address), answer)

    def order(self, wanted: Mapping[Place, Raw]) -> Batch:
        """The order of these writes by what is known now."""
        return batch_order(self._devices(), wanted, allow=self._allow, accepted=self._accepted)

    def raw(self, place: Place) -> Raw | None:
        """What the object held when that was known last."""
        return self._values[place.slug].get(place.address)

    def put(self, place: Place, raw: Raw) -> None:
        """The object holds this value now."""
        self._values[place.slug][place.address] = raw

    def _devices(self) -> list[DeviceValues]:
        return [DeviceValues(slug, one.description, self._values[slug]) for slug, one in self._targets.items()]

    def _can_be_read(self, place: Place) -> bool:
        entry = self._targets[place.slug].description.entries.get(place.address)
        return entry is not None and entry.access.readable and place.address not in self._values[place.slug]
