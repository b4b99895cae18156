"""Types of visits, of what changed since the last one, of last changes, and of favourites."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.service.office.last_change import Change
from app.service.office.leaving import Leaving
from app.service.office.visit_changes import DeviceChanges, VisitChanges
from app.service.views import RawJson, raw_to_json
from app.store.visit_rows import Visit

Remark = Annotated[str, Field(max_length=2_000)]
WorkOrder = Annotated[str, Field(max_length=100, examples=["WO-20417"])]
Side = Literal["then", "now"]


class VisitDoc(BaseModel):
    """A visit; ``ended_ns`` null: it is open. ``left_open``: nobody ended it, a later one did."""

    id: str
    turbine: str
    person: str
    started_ns: int
    ended_ns: int | None
    left_open: bool
    reason: str
    work_order: str

    @classmethod
    def of(cls, visit: Visit) -> VisitDoc:
        """As the page gets it."""
        return cls(
            id=visit.id,
            turbine=visit.turbine,
            person=visit.person,
            started_ns=visit.started_ns,
            ended_ns=visit.ended_ns,
            left_open=visit.left_open,
            reason=visit.reason,
            work_order=visit.work_order,
        )


class PresentVisit(BaseModel):
    """The visit that is open, or null."""

    visit: VisitDoc | None


class VisitEnd(BaseModel):
    """Why the visit was made."""

    model_config = ConfigDict(extra="forbid")

    reason: Remark = ""
    work_order: WorkOrder = ""


class VisitChange(BaseModel):
    """What is to change; null stays as it is."""

    model_config = ConfigDict(extra="forbid")

    reason: Remark | None = None
    work_order: WorkOrder | None = None


class ChangedValue(BaseModel):
    """A parameter that was ``was`` and is ``now``; the keys where an enumeration names that.

    ``person`` and ``t_ns`` are null where nobody saw the write. ``person`` is empty where another master wrote it.
    """

    address: str
    name: str
    was_raw: RawJson
    now_raw: RawJson
    was_shown: str
    now_shown: str
    was_key: str | None
    now_key: str | None
    person: str | None
    t_ns: int | None


class UnknownValue(BaseModel):
    """A parameter that is not known on one side: it may have changed."""

    address: str
    name: str
    side: Side


class ChangedDevice(BaseModel):
    """One device; ``missing`` is the side on which nothing is known of it, ``replaced`` that another one answers."""

    device: str
    rows: list[ChangedValue]
    unknown: list[UnknownValue]
    missing: Side | None
    replaced: bool

    @classmethod
    def of(cls, changes: DeviceChanges) -> ChangedDevice:
        """As the page gets it."""
        return cls(
            device=changes.device,
            rows=[
                ChangedValue(
                    address=row.address.short,
                    name=row.name,
                    was_raw=raw_to_json(row.was),
                    now_raw=raw_to_json(row.now),
                    was_shown=row.was_shown,
                    now_shown=row.now_shown,
                    was_key=row.was_key,
                    now_key=row.now_key,
                    person=row.person,
                    t_ns=row.t_ns,
                )
                for row in changes.rows
            ],
            unknown=[
                UnknownValue(address=address.short, name=name, side=side.value)
                for address, name, side in changes.unknown
            ],
            missing=None if changes.missing is None else changes.missing.value,
            replaced=changes.replaced,
        )


class ChangesSinceLastVisit(BaseModel):
    """The values as found now beside those that the last visit left."""

    state: Literal["no-earlier-visit", "reading", "ready"]
    visit: VisitDoc | None
    devices: list[ChangedDevice]

    @classmethod
    def of(cls, changes: VisitChanges) -> ChangesSinceLastVisit:
        """As the page gets it."""
        return cls(
            state=changes.state.value,
            visit=None if changes.visit is None else VisitDoc.of(changes.visit),
            devices=[ChangedDevice.of(one) for one in changes.devices],
        )


class ParameterChange(BaseModel):
    """One acknowledged write, by us or by another master; ``count`` of it were folded into one."""

    t_ns: int
    person: str
    was: str
    now: str
    source: Literal["ours", "other-master"]
    count: int

    @classmethod
    def of(cls, change: Change) -> ParameterChange:
        """As the page gets it."""
        return cls(
            t_ns=change.t_ns,
            person=change.person,
            was=change.was,
            now=change.now,
            source=change.source.value,
            count=change.count,
        )


class ParameterChanges(BaseModel):
    """``last``: the last write of each parameter by address. ``history``: the writes of the one that was asked for."""

    last: dict[str, ParameterChange]
    history: list[ParameterChange]


class Favourites(BaseModel):
    """Addresses of one description in the person's own order."""

    model_config = ConfigDict(extra="forbid")

    addresses: Annotated[list[Annotated[str, Field(max_length=20)]], Field(max_length=500)]


class LeftNow(BaseModel):
    """How much of a device's parameters is known now: what was not read, or is stale, would not be kept as left.

    ``read_ns``: since when the device has been known completely; null where it was not in this visit. ``writes``: so
    many were seen since.
    """

    device: str
    parameters: int
    unread: int
    stale: int
    read_ns: int | None
    writes: int

    @classmethod
    def of(cls, leaving: Leaving) -> LeftNow:
        """As the page gets it."""
        return cls(
            device=leaving.device,
            parameters=leaving.parameters,
            unread=leaving.unread,
            stale=leaving.stale,
            read_ns=leaving.read_ns,
            writes=leaving.writes,
        )
