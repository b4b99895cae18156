"""The columns of a comparison: the connected devices, descriptions, visits, the library, files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from app.drivers.contract import TWIN_NAME
from app.errors import MomentError, RecordingError, SetUnknownError
from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.diff.column import Column
from app.model.set_head import Taking
from app.model.set_import import read_set_file
from app.model.set_record import SetRecord, Tag
from app.model.sets import Origin, ParameterSet, iso_time
from app.model.variant import as_identified
from app.service.compare.ground import Ground
from app.service.compare.known import Known, defaults_of, ram_of, stored_of
from app.service.compare.spec import ColumnKind, ColumnSpec, Unresolved, parse_moment, parse_spec
from app.service.devices import Target, who_is
from app.service.library.library import Library
from app.service.library.recovered import Seen
from app.service.office.visits import known_empty
from app.service.views import RawJson, raw_from_json
from app.store.set_rows import Filter
from app.store.visit_rows import Phase

DAY_NS: Final = 24 * 3600 * 1_000_000_000
YEAR_NS: Final = 365 * DAY_NS
LEAST_NS: Final = 180 * DAY_NS
"""What is younger is no set of the year before."""
LOOKED_BACK: Final = 50
"""Visits that are searched for values of a device."""
_NAME: Final = Address(0x1008)
_TAGS: Final = {
    ColumnKind.DELIVERED: (Tag.AS_DELIVERED, Unresolved.NO_DELIVERED),
    ColumnKind.GOLDEN: (Tag.GOLDEN, Unresolved.NO_GOLDEN),
    ColumnKind.FOUND: (Tag.AS_FOUND, Unresolved.NO_VISIT),
    ColumnKind.LEFT: (Tag.AS_LEFT, Unresolved.NO_VISIT),
}

Pending = Mapping[str, Mapping[Address, Raw]]
"""Changes that are not written yet, by device."""


@dataclass(frozen=True, slots=True)
class Shown:
    """A column and what stands above it. ``t_ns`` None: of no time, as defaults are. ``hash`` only of a kept set.

    ``record`` is its id in the library; ``twin`` None: nothing says what it is of. ``seen`` tells of values out of a
    recording how they came to be known.
    """

    spec: ColumnSpec
    column: Column
    t_ns: int | None = None
    person: str = ""
    reason: str = ""
    hash: str | None = None
    record: str | None = None
    twin: bool | None = None
    recording: str = ""
    seen: Mapping[Address, Seen] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        """True where nothing was left unread."""
        return not self.column.unread


class Columns:
    """Makes columns of what ``ground`` has at this moment. Lives in the event loop."""

    def __init__(self, ground: Ground) -> None:
        self.ground = ground

    async def resolve(self, text: str, pending: Pending | None = None) -> Shown:
        """The column that ``text`` names. Raises ColumnError, StoreError, SetFileError."""
        spec = parse_spec(text)
        match spec.kind:
            case ColumnKind.LIVE | ColumnKind.EDITOR:
                changes = (pending or {}).get(spec.of, {}) if spec.kind is ColumnKind.EDITOR else {}
                return self._ram(spec, changes)
            case ColumnKind.STORED:
                target = self._target(spec)
                return self._of_target(spec, target, stored_of(target))
            case ColumnKind.DEFAULT:
                return self._default(spec)
            case ColumnKind.FILE:
                return self._file(spec)
            case ColumnKind.SET:
                return await self._kept(spec)
            case ColumnKind.YEAR:
                return await self._year(spec)
            case ColumnKind.MOMENT:
                return await self._moment(spec)
            case ColumnKind.LATEST:
                return await self._latest(spec)
            case ColumnKind.GOLDEN | ColumnKind.DELIVERED | ColumnKind.FOUND | ColumnKind.LEFT:
                return await self._tagged(spec)

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
        found = self.ground.target(spec.of)
        if found is None:
            raise Unresolved.NOT_CONNECTED.error(str(spec))
        return found

    def _ram(self, spec: ColumnSpec, changes: Mapping[Address, Raw]) -> Shown:
        target = self._target(spec)
        read = self.ground.read.get(spec.of)
        if read is not None:
            return self.of_set(spec, read)
        values, unread = ram_of(target)
        found = None if self.ground.visits is None else self.ground.visits.found.get(spec.of)
        empty = known_empty(found, values, unread) - changes.keys()
        known = {address: why for address, why in unread.items() if address not in changes and address not in empty}
        return self._of_target(spec, target, ({**values, **changes}, known), empty)

    def _of_target(
        self, spec: ColumnSpec, target: Target, known: Known, empty: frozenset[Address] = frozenset()
    ) -> Shown:
        description = target.description
        column = Column(target.slug, description, description.version, *known, empty=empty)
        return Shown(spec, column, self.ground.stamp(), twin=_is_twin(target.lookup(_NAME)))

    def _default(self, spec: ColumnSpec) -> Shown:
        found = self.ground.device(spec.of)
        if found is None:
            raise Unresolved.NO_DEVICE.error(str(spec))
        device, description = found
        values = defaults_of(self._as_connected(description, spec), device.node)
        return Shown(spec, Column(device.slug, description, description.version, values))

    def _as_connected(self, description: Description, spec: ColumnSpec) -> Description:
        """With the defaults of the variant that is connected there; what rests on the variant is open else."""
        target = self.ground.target(spec.of)
        identity = None if target is None else who_is(target)
        if identity is None:
            return description
        return as_identified(description, identity.device_name, identity.product_code)

    # -- sets -----------------------------------------------------------------------

    def of_set(self, spec: ColumnSpec, parameters: ParameterSet, record: str | None = None) -> Shown:
        """The column of a set. Raises ColumnError where nothing here describes it."""
        description = self.ground.description(parameters.description_id)
        if description is None:
            raise Unresolved.NO_DESCRIPTION.error(str(spec))
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

    async def _moment(self, spec: ColumnSpec) -> Shown:
        recording, t_ns, device = parse_moment(spec)
        if self.ground.moments is None:
            raise Unresolved.NOT_HERE.error(str(spec))
        try:
            moment = await self.ground.moments.at(recording, t_ns)
            shown = self.of_set(spec, moment.parameters(device, "", recording))
        except (MomentError, RecordingError) as error:
            raise Unresolved.NO_MOMENT.error(str(spec)) from error
        return replace(shown, hash=None, t_ns=moment.t_ns, recording=recording)

    def _file(self, spec: ColumnSpec) -> Shown:
        """A file of this computer. Raises ColumnError, SetFileError, OSError."""
        if not self.ground.files:
            raise Unresolved.NOT_HERE.error(str(spec))
        path = Path(spec.of)
        # What says nothing of itself, as a DCF of another tool, is named by its file and is of the file's time.
        taken = iso_time(path.stat().st_mtime_ns)
        origin = Origin(turbine="", device=path.name, node=0, time=taken, person="", reason="", tool="")
        known = {one.id: one for one in reversed(list(self.ground.descriptions()))}
        taking = Taking(known, origin)
        return self.of_set(spec, read_set_file(path.read_bytes(), path.name, taking).parameters)

    def _library(self, spec: ColumnSpec) -> Library:
        if self.ground.library is None:
            raise Unresolved.NOT_HERE.error(str(spec))
        return self.ground.library

    async def _of_record(self, spec: ColumnSpec, record: SetRecord) -> Shown:
        library = self._library(spec)
        shown = self.of_set(spec, await library.set_of(record), record.id)
        recording, seen = await library.seen(record)
        return replace(shown, recording=recording, seen=seen)

    async def _kept(self, spec: ColumnSpec) -> Shown:
        try:
            return await self._of_record(spec, await self._library(spec).record(spec.of))
        except SetUnknownError as error:
            raise Unresolved.NO_SET.error(str(spec)) from error

    async def _tagged(self, spec: ColumnSpec) -> Shown:
        tag, why = _TAGS[spec.kind]
        scope = spec.of if tag is not Tag.GOLDEN else self._kind_of(spec)
        record = await self._library(spec).tagged(tag, scope)
        if record is not None:
            return await self._of_record(spec, record)
        earlier = await self._visit(spec) if why is Unresolved.NO_VISIT else None
        if earlier is None:
            raise why.error(str(spec))
        return self.of_set(spec, earlier)

    def _kind_of(self, spec: ColumnSpec) -> str:
        """The id of a device's description, or that id itself: golden sets are of kinds of devices."""
        if "/" not in spec.of:
            return spec.of
        found = self.ground.device(spec.of)
        if found is None:
            raise Unresolved.NO_DEVICE.error(str(spec))
        return found[1].id

    async def _visit(self, spec: ColumnSpec) -> ParameterSet | None:
        """Of visits that were made before there was a library."""
        visits = self.ground.visits
        phase = Phase.FOUND if spec.kind is ColumnKind.FOUND else Phase.LEFT
        for visit in [] if visits is None else await visits.latest(spec.of.partition("/")[0], LOOKED_BACK):
            found = (await visits.sets(visit, phase)).get(spec.of) if visits is not None else None
            if found is not None:
                return found
        return None

    async def _year(self, spec: ColumnSpec) -> Shown:
        """The record that is nearest to one year ago, and old enough; a fragment only where no other is."""
        now_ns = self.ground.stamp()
        records = await self._library(spec).records(Filter(device=spec.of))
        old = [one for one in records if now_ns - one.t_ns >= LEAST_NS]
        if not old:
            raise Unresolved.NO_YEAR.error(str(spec))
        best = min(old, key=lambda one: (not one.complete, abs(now_ns - one.t_ns - YEAR_NS)))
        return await self._of_record(spec, best)

    async def _latest(self, spec: ColumnSpec) -> Shown:
        """The newest record; a fragment only where no set is complete."""
        records = await self._library(spec).records(Filter(device=spec.of))
        if not records:
            raise Unresolved.NO_LATEST.error(str(spec))
        return await self._of_record(spec, max(records, key=lambda one: (one.complete, one.t_ns)))


def _is_twin(name: Raw | None) -> bool | None:
    return name.startswith(TWIN_NAME) if isinstance(name, str) else None
