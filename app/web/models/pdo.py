"""Types of the PDO mapping editor."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field
from pydantic.config import JsonDict

from app.model.address import Address, parse_address
from app.model.pdo.findings import Finding
from app.model.pdo.load import PdoLoad
from app.model.pdo.objects import PdoParameters
from app.model.pdo.setup import Direction, Mapped, PdoId, PdoSetup
from app.model.pdo.writes import PdoWrite
from app.service.pdo.desk import Edit, UndoStand
from app.service.pdo.kept import PdoChange
from app.service.pdo.look import Cost
from app.web.models.motion import Page

_STATUS: Final[JsonDict] = {
    "cob_id": 0x40000180,
    "transmission_type": 255,
    "inhibit_100us": 0,
    "event_ms": 0,
    "sync_start": 0,
    "mapped": [{"object": "6041", "bits": 16}],
}
_EDIT: Final[JsonDict] = {"direction": "tpdo", "number": 1, "base": _STATUS, "wanted": {**_STATUS, "event_ms": 100}}
U8 = Annotated[int, Field(ge=0, le=0xFF)]
U16 = Annotated[int, Field(ge=0, le=0xFFFF)]
U32 = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]


class PdoMapped(BaseModel):
    """One mapped object; up to 001F a data type that only fills bits."""

    model_config = ConfigDict(extra="forbid")

    object: Annotated[str, Field(max_length=7)]
    bits: U8

    @classmethod
    def of(cls, mapped: Mapped) -> PdoMapped:
        """As the page gets it."""
        return cls(object=mapped.address.short, bits=mapped.bits)

    def mapped(self) -> Mapped:
        """As it stands in the mapping. Raises UsageError."""
        address: Address = parse_address(self.object)
        return Mapped(address.major << 16 | address.minor << 8 | self.bits)


class PdoSetupDoc(BaseModel):
    """How a PDO is set up; ``cob_id`` with its bits 29 to 31. Parameters that the device does not have are 0."""

    model_config = ConfigDict(extra="forbid")

    cob_id: U32
    transmission_type: U8
    inhibit_100us: U16
    event_ms: U16
    sync_start: U8
    mapped: Annotated[list[PdoMapped], Field(max_length=64)]

    @classmethod
    def of(cls, setup: PdoSetup) -> PdoSetupDoc:
        """As the page gets it."""
        return cls(**setup.parameters._asdict(), mapped=[PdoMapped.of(one) for one in setup.mapped])

    def setup(self, pdo: PdoId) -> PdoSetup:
        """As the model has it. Raises UsageError."""
        parameters = PdoParameters(
            self.cob_id, self.transmission_type, self.inhibit_100us, self.event_ms, self.sync_start
        )
        return PdoSetup(pdo, parameters, tuple(one.mapped() for one in self.mapped))


class PdoLoadDoc(BaseModel):
    """What a PDO costs: frames a second, bits of its longest frame, share of the bit rate (0..1).

    ``basis`` ends the text key that says what the rate rests on; ``certain`` false: it is a bound or a guess.
    """

    per_second: float
    bits: int
    share: float
    basis: str
    certain: bool

    @classmethod
    def of(cls, load: PdoLoad) -> PdoLoadDoc:
        """As the page gets it."""
        return cls(
            per_second=round(load.per_second, 2),
            bits=load.bits,
            share=round(load.share, 6),
            basis=load.basis.value,
            certain=load.basis.certain,
        )


class PdoDoc(BaseModel):
    """A PDO of a device: ``subs`` are the communication parameters that it has, ``room`` is for so many objects.

    ``setup`` None: not read since the device started. ``seen_t_ns`` and ``per_second`` are of its frame on the bus.
    """

    direction: Literal["rpdo", "tpdo"]
    number: int
    subs: list[int]
    room: int
    setup: PdoSetupDoc | None
    load: PdoLoadDoc | None
    seen_t_ns: int | None
    per_second: int | None
    stop_path: bool


class PdoMappable(BaseModel):
    """An object that may be mapped, and into which PDOs."""

    object: str
    bits: int
    rpdo: bool
    tpdo: bool


class PdoUndo(BaseModel):
    """The last change of the device; ``stand`` says whether it can be put back."""

    person: str
    t_ns: int
    pdos: list[str]
    stand: Literal["ready", "open", "gone", "unknown"]

    @classmethod
    def of(cls, change: PdoChange, stand: UndoStand) -> PdoUndo:
        """As the page gets it."""
        return cls(person=change.person, t_ns=change.t_ns, pdos=[str(pdo) for pdo in change.before], stand=stand.value)


class PdosDoc(BaseModel):
    """All PDOs of a device as the wire has told them.

    ``operational`` None: not known; else whether PDOs are sent and taken now. ``unread``: objects that must be read.
    ``keeps``: the device keeps PDOs over a restart once they are saved.
    """

    device: str
    operational: bool | None
    keeps: bool
    unread: list[str]
    pdos: list[PdoDoc]
    mappable: list[PdoMappable]
    sync_per_second: float | None
    bitrate: int
    bus_load: float
    undo: PdoUndo | None


class PdoEdit(BaseModel):
    """A PDO as a person wants it; ``base`` is how it was set up when the edit began."""

    model_config = ConfigDict(extra="forbid")

    direction: Literal["rpdo", "tpdo"]
    number: Annotated[int, Field(ge=1, le=512)]
    base: PdoSetupDoc
    wanted: PdoSetupDoc

    def edit(self) -> Edit:
        """As the desk takes it. Raises UsageError."""
        pdo = PdoId(Direction(self.direction), self.number)
        return Edit(self.base.setup(pdo), self.wanted.setup(pdo))


class PdoEdits(BaseModel):
    """What is to be changed in one device."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"edits": [_EDIT]}]})

    edits: Annotated[list[PdoEdit], Field(max_length=1024)]


class PdoApply(PdoEdits):
    """As ``PdoEdits``; ``page`` is the name of the page that asks, as for the lease."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"page": "5f2c1d", "edits": [_EDIT]}]})

    page: Page


class PdoUndoRequest(BaseModel):
    """The page that asks."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"page": "5f2c1d"}]})

    page: Page


class PdoFinding(BaseModel):
    """What is wrong, or worth a thought. ``code`` ends its text key; ``entry`` counts mapped objects from 1."""

    severity: Literal["error", "warning", "note"]
    code: str
    direction: Literal["rpdo", "tpdo"]
    number: int
    part: Literal["cob_id", "type", "inhibit", "event", "sync_start", "mapping"]
    entry: int | None
    details: dict[str, str | int]

    @classmethod
    def of(cls, finding: Finding) -> PdoFinding:
        """As the page gets it."""
        return cls(
            severity=finding.severity.value,
            code=finding.code.value,
            direction=finding.pdo.direction.value,
            number=finding.pdo.number,
            part=finding.part.value,
            entry=finding.entry,
            details=dict(finding.details),
        )


class PdoWriteDoc(BaseModel):
    """One write, in its order. ``step`` ends a text key; ``was_raw`` None: what stands there is not known."""

    pdo: str
    step: str
    address: str
    was_raw: int | None
    raw: int

    @classmethod
    def of(cls, write: PdoWrite) -> PdoWriteDoc:
        """As the page gets it."""
        return cls(
            pdo=str(write.pdo), step=write.step.value, address=write.address.short, was_raw=write.was, raw=write.raw
        )


class PdoCostRow(BaseModel):
    """What one PDO of the bus costs now, and would after the change; None where it is not known."""

    device: str
    direction: Literal["rpdo", "tpdo"]
    number: int
    now: PdoLoadDoc
    after: PdoLoadDoc


class PdoCost(BaseModel):
    """Shares of the bit rate, 0..1. ``bus_now`` is measured, all traffic; the rest are estimates for operational nodes.

    ``over``: the bus would be busier than the poller may make it ("cap"), or than is sound ("share"); None: neither.
    """

    bus_now: float
    bus_after: float
    pdos_now: float
    pdos_after: float
    cap: float
    over: Literal["cap", "share"] | None
    rows: list[PdoCostRow]

    @classmethod
    def of(cls, cost: Cost, cap: float, sound: float) -> PdoCost:
        """As the page gets it."""
        rows = [
            PdoCostRow(
                device=device,
                direction=pdo.direction.value,
                number=pdo.number,
                now=PdoLoadDoc.of(cost.now[device, pdo]),
                after=PdoLoadDoc.of(cost.after[device, pdo]),
            )
            for device, pdo in cost.now
        ]
        worse = cost.bus_after > cost.bus_now
        over: Literal["cap", "share"] | None = None
        if worse and cost.bus_after > sound:
            over = "share"
        elif worse and cost.bus_after > cap:
            over = "cap"
        return cls(
            bus_now=round(cost.bus_now, 5),
            bus_after=round(cost.bus_after, 5),
            pdos_now=round(cost.pdos_now, 5),
            pdos_after=round(cost.pdos_after, 5),
            cap=cap,
            over=over,
            rows=rows,
        )


class PdoPreview(BaseModel):
    """What an edit would do: nothing was sent."""

    findings: list[PdoFinding]
    writes: list[PdoWriteDoc]
    cost: PdoCost
