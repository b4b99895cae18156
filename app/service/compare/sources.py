"""Where the columns of a comparison come from: the connected devices, the description, visits, the library."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from app.drivers.contract import TWIN_NAME
from app.errors import HubsideError
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.diff.column import Column
from app.model.sets import ParameterSet
from app.model.site import Device
from app.service.backup import readable
from app.service.bench import Bench
from app.service.compare.spec import ColumnKind, ColumnSpec, Unresolved, parse_spec
from app.service.devices import Target, decode
from app.service.office.visits import NOT_READ, STALE, Visits
from app.service.views import RawJson, raw_from_json
from app.store.visit_rows import Phase

STORED_UNKNOWN: Final = "not known"
"""What stands in non-volatile memory was never proven."""
LOOKED_BACK: Final = 50
"""Visits that are searched for values of a device."""
_NAME: Final = Address(0x1008)

Pending = Mapping[str, Mapping[Address, Raw]]
"""Changes that are not written yet, by device."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A column and what stands above it. ``t_ns`` None: of no time, as defaults are. ``hash`` only of a kept set.

    ``twin`` None: nothing says what it is of.
    """

    spec: ColumnSpec
    column: Column
    t_ns: int | None = None
    person: str = ""
    reason: str = ""
    hash: str | None = None
    record: str | None = None
    twin: bool | None = None

    @property
    def complete(self) -> bool:
        """True where nothing was left unread."""
        return not self.column.unread


class Columns:
    """Makes columns of what one bench knows at this moment. Lives in the event loop."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    async def resolve(self, text: str, pending: Pending | None = None) -> Shown:
        """The column that ``text`` names. Raises ColumnError, StoreError, SetFileError."""
        spec = parse_spec(text)
        match spec.kind:
            case ColumnKind.LIVE:
                return self._live(spec, {})
            case ColumnKind.EDITOR:
                return self._live(spec, (pending or {}).get(spec.of, {}))
            case ColumnKind.STORED:
                return self._stored(spec)
            case ColumnKind.DEFAULT:
                return self._default(spec)
            case ColumnKind.FOUND | ColumnKind.LEFT:
                return await self._visit(spec)
            case _:
                raise Unresolved.NOT_HERE.error(text)

    def read_pending(self, changes: Mapping[str, Mapping[str, RawJson]]) -> Pending:
        """Changes as JSON brings them. Raises ColumnError, UsageError, ValueTypeError."""
        read: dict[str, dict[Address, Raw]] = {}
        for slug, by_address in changes.items():
            spec = ColumnSpec(ColumnKind.EDITOR, slug)
            entries = self._target(spec).description.entries
            for text, raw in by_address.items():
                entry = entries.get(parse_address(text))
                if entry is None:
                    raise Unresolved.NO_OBJECT.error(str(spec))
                read.setdefault(slug, {})[entry.address] = raw_from_json(entry, raw)
        return read

    # -- the connected devices ----------------------------------------------------

    def _target(self, spec: ColumnSpec) -> Target:
        connection = self._bench.connection
        targets = () if connection is None else connection.targets
        found = next((one for one in targets if one.slug == spec.of), None)
        if found is None:
            raise Unresolved.NOT_CONNECTED.error(str(spec))
        return found

    def _live(self, spec: ColumnSpec, changes: Mapping[Address, Raw]) -> Shown:
        target = self._target(spec)
        values, unread = ram_of(target)
        for address, raw in changes.items():
            values[address] = raw
            unread.pop(address, None)
        return self._of_target(spec, target, values, unread)

    def _stored(self, spec: ColumnSpec) -> Shown:
        target = self._target(spec)
        values, unread = stored_of(target)
        return self._of_target(spec, target, values, unread)

    def _of_target(
        self, spec: ColumnSpec, target: Target, values: Mapping[Address, Raw], unread: Mapping[Address, str]
    ) -> Shown:
        description = target.description
        column = Column(target.slug, description, description.version, values, unread)
        return Shown(spec, column, self._bench.stamper(), twin=_is_twin(target.lookup(_NAME)))

    # -- what is known without a connection -----------------------------------------

    def _default(self, spec: ColumnSpec) -> Shown:
        device, description = self._device(spec)
        values = defaults_of(description, device.node)
        return Shown(spec, Column(device.slug, description, description.version, values))

    def _device(self, spec: ColumnSpec) -> tuple[Device, Description]:
        """A device of any turbine that is known."""
        connection = self._bench.connection
        for target in () if connection is None else connection.targets:
            if target.slug == spec.of:
                return target.device, target.description
        for turbine in self._bench.sites.turbines.values():
            for device in turbine.devices:
                if device.slug == spec.of:
                    return device, self._bench.sites.describe(turbine)[device.description_id]
        raise Unresolved.NO_DEVICE.error(str(spec))

    async def _visit(self, spec: ColumnSpec) -> Shown:
        phase = Phase.FOUND if spec.kind is ColumnKind.FOUND else Phase.LEFT
        found = await last_of(self._bench.office.visits, spec.of, phase)
        if found is None:
            raise Unresolved.NO_VISIT.error(str(spec))
        return self.of_set(spec, found)

    def of_set(self, spec: ColumnSpec, parameters: ParameterSet, record: str | None = None) -> Shown:
        """The column of a set. Raises ColumnError where nothing describes it."""
        description = self._description(parameters)
        if description is None:
            raise Unresolved.NO_DESCRIPTION.error(str(spec))
        return shown_set(spec, parameters, description, record)

    def _description(self, parameters: ParameterSet) -> Description | None:
        """What describes a set: the device's own description where it is known, else ours of that id."""
        connection = self._bench.connection
        for target in () if connection is None else connection.targets:
            if target.description.id == parameters.description_id:
                return target.description
        for turbine in self._bench.sites.turbines.values():
            try:
                described = self._bench.sites.describe(turbine)
            except HubsideError:
                continue  # an EDS file of another turbine is wrong or gone: not what is asked for here
            if parameters.description_id in described:
                return described[parameters.description_id]
        return None


def ram_of(target: Target) -> tuple[dict[Address, Raw], dict[Address, str]]:
    """What is known of a device's RAM now, and why the rest is not. Nothing is read for it."""
    views = target.live.values(target.device.bus, target.node)
    values: dict[Address, Raw] = {}
    unread: dict[Address, str] = {}
    for address in readable(target.description):
        view = views.get(address)
        if view is None or view.reading is None:
            unread[address] = NOT_READ
        elif view.stale:
            unread[address] = STALE
        else:
            values[address] = decode(target.entry(address), view.reading.data)
    return values, unread


def stored_of(target: Target) -> tuple[dict[Address, Raw], dict[Address, str]]:
    """What is known of a device's non-volatile memory; objects that are not saved are in neither part."""
    views = target.live.values(target.device.bus, target.node)
    values: dict[Address, Raw] = {}
    unread: dict[Address, str] = {}
    for entry in target.description:
        if entry.saved and entry.access.readable:
            view = views.get(entry.address)
            if view is None or view.stored is None:
                unread[entry.address] = STORED_UNKNOWN
            else:
                values[entry.address] = decode(entry, view.stored.data)
    return values, unread


def defaults_of(description: Description, node: int) -> dict[Address, Raw]:
    """The defaults of a description for a device with the number ``node``; objects without one are not in it."""
    values: dict[Address, Raw] = {}
    for entry in description:
        if entry.default is not None:
            shift = node if entry.node_id else 0
            values[entry.address] = entry.default + shift if isinstance(entry.default, int) else entry.default
    return values


def shown_set(spec: ColumnSpec, parameters: ParameterSet, description: Description, record: str | None = None) -> Shown:
    """The column of a set that ``description`` describes."""
    origin = parameters.origin
    column = Column(
        slug=origin.device,
        description=description,
        version=parameters.description_version,
        values=parameters.values,
        unread=parameters.unread,
        empty=frozenset(parameters.empty),
    )
    twin = _is_twin(parameters.identity.device_name)
    return Shown(spec, column, origin.t_ns, origin.person, origin.reason, parameters.hash, record, twin)


async def last_of(visits: Visits, slug: str, phase: Phase) -> ParameterSet | None:
    """What the last visit that has values of the device in that phase kept of it."""
    turbine = slug.partition("/")[0]
    for visit in await visits.latest(turbine, LOOKED_BACK):
        found = (await visits.sets(visit, phase)).get(slug)
        if found is not None:
            return found
    return None


def _is_twin(name: Raw | None) -> bool | None:
    return name.startswith(TWIN_NAME) if isinstance(name, str) else None
