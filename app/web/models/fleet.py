"""Blades side by side, and a fleet beside its golden set, as the page gets them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.service.compare.fleet import Fleet, Mark, Member
from app.service.compare.parity import Part
from app.web.models.compare import ColumnDoc, ComparisonDoc, RestoreClassName

MAX_DEVICES = 5000
TOP = 8
"""Addresses that are named of each device."""

MarkName = Literal["same", "different", "unit", "missing"]


class ParityPart(BaseModel):
    """One kind of device, a column for each of ``blades``; ``without``: blades of which there is no such column.

    Rows whose state is "unit" are the differences that are allowed.
    """

    description_id: str
    name: str
    blades: list[int]
    without: list[int]
    comparison: ComparisonDoc

    @classmethod
    def of(cls, part: Part) -> ParityPart:
        """As the page gets it."""
        return cls(
            description_id=part.description_id,
            name=part.name,
            blades=list(part.blades),
            without=list(part.without),
            comparison=ComparisonDoc.of(part.compared),
        )


class ParityDoc(BaseModel):
    """The blades of one turbine; no part where fewer than two blades have such columns."""

    turbine: str
    parts: list[ParityPart]


class FleetRequest(BaseModel):
    """``golden``: a record or the beginning of its hash; null takes the set that is marked golden for the description.

    ``group`` asks for the marks of its parameters; ``limit`` for so many devices, those that differ most.
    """

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"description_id": "oat-pmc", "golden": None, "group": "position"}]},
    )

    description_id: Annotated[str, Field(max_length=100)]
    golden: Annotated[str, Field(max_length=100)] | None = None
    group: Annotated[str, Field(max_length=100)] | None = None
    limit: Annotated[int, Field(ge=1, le=MAX_DEVICES)] = 500


class FleetAddress(BaseModel):
    """One parameter of the golden set, and at how many devices it differs, differs as it may, or is missing."""

    address: str
    name: str
    group: str
    restore: RestoreClassName
    golden_shown: str
    golden_unit: str
    different: int
    unit: int
    missing: int


class FleetDevice(BaseModel):
    """The latest set of one device. ``by_group``: differences in each group; ``top``: addresses that differ.

    ``missing_by_group``: parameters of each group that the set lacks: nothing says whether they are equal.

    ``marks``: of each parameter of the group that was asked for.
    """

    device: str
    turbine: str
    record: str
    t_ns: int
    different: int
    unit: int
    missing: int
    by_group: list[int]
    missing_by_group: list[int]
    top: list[str]
    marks: list[MarkName]


class ForeignDevice(BaseModel):
    """A device that cannot be compared: its set was read by a description of another major version."""

    device: str
    record: str
    t_ns: int
    description_version: str

    @classmethod
    def of(cls, member: Member) -> ForeignDevice:
        """As the page gets it."""
        return cls(device=member.device, record=member.record, t_ns=member.t_ns, description_version=member.version)


class FleetDoc(BaseModel):
    """One golden set against the latest set of every device of its kind, those that differ most first.

    ``total`` devices were compared. ``equal`` of them have every parameter, and no difference that must not be;
    ``different`` have such a difference, ``incomplete`` lack a parameter, and a device may be of both. ``addresses``
    are those that differ or are missing somewhere, the most frequent first. ``marked``: those of the ``marks``.
    """

    golden: ColumnDoc
    parameters: int
    total: int
    equal: int
    different: int
    incomplete: int
    groups: list[str]
    addresses: list[FleetAddress]
    devices: list[FleetDevice]
    marked: list[str]
    foreign: list[ForeignDevice]

    @classmethod
    def of(cls, fleet: Fleet, group: str | None, limit: int) -> FleetDoc:
        """As the page gets it."""
        different, missing = fleet.count(Mark.DIFFERENT), fleet.count(Mark.MISSING)
        return cls(
            golden=ColumnDoc.of(fleet.golden),
            parameters=len(fleet.entries),
            total=len(fleet.members),
            equal=sum(not differs and not lacks for differs, lacks in zip(different, missing, strict=True)),
            different=sum(count > 0 for count in different),
            incomplete=sum(count > 0 for count in missing),
            groups=list(fleet.groups),
            addresses=_addresses(fleet),
            devices=_devices(fleet, group, limit),
            marked=[entry.address.short for entry in fleet.entries if entry.group == group],
            foreign=[ForeignDevice.of(member) for member in fleet.foreign],
        )


def _addresses(fleet: Fleet) -> list[FleetAddress]:
    counts = {mark: fleet.per_entry(mark) for mark in (Mark.DIFFERENT, Mark.UNIT, Mark.MISSING)}
    found = []
    for number, entry in enumerate(fleet.entries):
        different, unit, missing = (counts[mark][number] for mark in counts)
        if different or unit or missing:
            cell = fleet.golden.column.cell(entry.address)
            found.append(
                FleetAddress(
                    address=entry.address.short,
                    name=entry.title,
                    group=entry.group,
                    restore=entry.restore.value,
                    golden_shown=cell.shown,
                    golden_unit=cell.unit,
                    different=different,
                    unit=unit,
                    missing=missing,
                )
            )
    return sorted(found, key=lambda one: (-one.different, -one.missing, -one.unit))


def _devices(fleet: Fleet, group: str | None, limit: int) -> list[FleetDevice]:
    counts = {mark: fleet.count(mark) for mark in (Mark.DIFFERENT, Mark.UNIT, Mark.MISSING)}
    devices = []
    for row in fleet.ranking()[:limit]:
        member = fleet.members[row]
        marks = list(fleet.marks(row))
        paired = list(zip(fleet.entries, marks, strict=True))
        devices.append(
            FleetDevice(
                device=member.device,
                turbine=member.device.partition("/")[0],
                record=member.record,
                t_ns=member.t_ns,
                different=counts[Mark.DIFFERENT][row],
                unit=counts[Mark.UNIT][row],
                missing=counts[Mark.MISSING][row],
                by_group=fleet.by_group[row].tolist(),
                missing_by_group=fleet.missing_by_group[row].tolist(),
                top=[entry.address.short for entry, mark in paired if mark is Mark.DIFFERENT][:TOP],
                marks=[mark.value for entry, mark in paired if entry.group == group],
            )
        )
    return devices
