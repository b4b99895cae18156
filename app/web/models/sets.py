"""Parameter sets as the page gets them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.model.set_head import Unknown
from app.model.set_record import SetRecord, TagEntry
from app.service.views import RawJson
from app.store.set_rows import Nameplate, SetFileRow

SourceName = Literal["backup", "visit", "file", "recording", "undo"]
TagName = Literal["as-delivered", "golden", "as-found", "as-left"]
FormatName = Literal["json", "dcf", "csv"]
Slug = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^[^/\s]+/[^/\s]+/[^/\s]+$")]


class SetOrigin(BaseModel):
    """Where, when and by whom a set was made; ``time`` is ISO 8601, UTC."""

    model_config = ConfigDict(from_attributes=True)

    turbine: str
    device: str
    node: int
    time: str
    person: str
    reason: str
    tool: str
    work_order: str


class SetIdentity(BaseModel):
    """What the device said of itself, null where it did not answer; ``nameplate`` is what a person typed."""

    model_config = ConfigDict(from_attributes=True)

    device_type: int | None
    device_name: str | None
    hardware: str | None
    software: str | None
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    serial: int | None
    nameplate: str | None
    drive_serial: str | None


class SetTag(BaseModel):
    """A tag that a set bears now: who gave it, and when. ``visit_id`` of as-found and as-left."""

    tag: TagName
    scope: str
    person: str
    t_ns: int
    visit_id: str | None

    @classmethod
    def of(cls, entry: TagEntry) -> SetTag:
        """From the library."""
        return cls.model_validate(
            {
                "tag": entry.tag.value,
                "scope": entry.scope,
                "person": entry.person,
                "t_ns": entry.t_ns,
                "visit_id": entry.visit_id,
            }
        )


class SetRecordDoc(BaseModel):
    """One occasion on which a set was taken: whose, when, how many objects were read, not read, and empty."""

    id: str
    hash: str
    description_id: str
    description_version: str
    identity: SetIdentity
    origin: SetOrigin
    t_ns: int
    source: SourceName
    values: int
    unread: int
    empty: int
    tags: list[SetTag]

    @classmethod
    def of(cls, record: SetRecord, tags: list[TagEntry]) -> SetRecordDoc:
        """From the library."""
        return cls.model_validate(
            {
                "id": record.id,
                "hash": record.hash,
                "description_id": record.description_id,
                "description_version": record.description_version,
                "identity": SetIdentity.model_validate(record.identity),
                "origin": SetOrigin.model_validate(record.origin),
                "t_ns": record.t_ns,
                "source": record.source.value,
                "values": record.values,
                "unread": record.unread,
                "empty": record.empty,
                "tags": [SetTag.of(entry) for entry in tags],
            }
        )


class BadSetFile(BaseModel):
    """A file of the data folder that is no set, and why."""

    name: str
    line: int
    reason: str

    @classmethod
    def of(cls, row: SetFileRow) -> BadSetFile:
        """From the store."""
        return cls(name=row.name, line=row.line or 1, reason=row.reason or "")


class SetList(BaseModel):
    """The library. ``folder`` is looked through for set files; ``waiting`` of them are not read yet."""

    folder: str | None
    records: list[SetRecordDoc]
    bad: list[BadSetFile]
    waiting: int


class SeenDoc(BaseModel):
    """How a value was seen in a recording. ``doubt``: what happened since, so that it may be another one."""

    t_ns: int
    access: Literal["read", "write"]
    ours: bool
    doubt: Literal["boot-up", "gap"] | None


class SetDoc(BaseModel):
    """One set: raw values by address, and the objects that were not read, each with the reason.

    ``seen`` and ``recording`` are null where the set comes from no recording.
    """

    record: SetRecordDoc
    values: dict[str, RawJson]
    unread: dict[str, str]
    empty: list[str]
    recording: str | None
    seen: dict[str, SeenDoc] | None


class BackupRequest(BaseModel):
    """``reason`` is kept in the sets."""

    model_config = ConfigDict(extra="forbid")

    reason: Annotated[str, Field(max_length=500)] = ""


class TagChange(BaseModel):
    """Give a set a tag, or take it off."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"tag": "as-delivered", "on": True}]})

    tag: TagName
    on: bool


class SetImport(BaseModel):
    """A file as base64. ``device``: whose values they are where the file does not tell, or is not to (``as_values``).

    ``description_id`` null: found out by the objects.
    """

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [
                {
                    "name": "axis-2.dcf",
                    "data": "W0ZpbGVJbmZvXQo=",
                    "device": "wtg-07/blade-2/pmc",
                    "description_id": None,
                    "as_values": False,
                    "reason": "from the maker",
                }
            ]
        },
    )

    name: Annotated[str, Field(min_length=1, max_length=255)]
    data: str
    device: Slug | None = None
    description_id: Annotated[str, Field(max_length=64)] | None = None
    as_values: bool = False
    reason: Annotated[str, Field(max_length=500)] = ""


class UnknownObject(BaseModel):
    """An object of a file that is not in the set, the line in which it stands, and why (text key)."""

    address: str
    name: str
    line: int
    text_key: str

    @classmethod
    def of(cls, unknown: Unknown) -> UnknownObject:
        """From the reader of the file."""
        return cls(address=unknown.address.short, name=unknown.name, line=unknown.line, text_key=unknown.text_key)


class SetTaken(BaseModel):
    """The set that an import gave. ``foreign``: the file said nothing of itself."""

    record: SetRecordDoc
    unknown: list[UnknownObject]
    foreign: bool


class NamelessNode(BaseModel):
    """A node of a recording with values of which it is not told what it is."""

    bus: str
    node: int
    values: int


class RecoveredSet(BaseModel):
    """A set out of a recording: how many values were read and written, and how many something happened to since."""

    record: SetRecordDoc
    read: int
    written: int
    doubtful: int
    unknown: list[str]


class RecoveredSets(BaseModel):
    """What a recording gave; ``damages`` counts places in the file that could not be used."""

    sets: list[RecoveredSet]
    nameless: list[NamelessNode]
    damages: int


class NameplateDoc(BaseModel):
    """The serial number on the plate of a device, as a person typed it."""

    device: str
    serial: str
    person: str
    t_ns: int

    @classmethod
    def of(cls, plate: Nameplate) -> NameplateDoc:
        """From the library."""
        return cls(device=plate.device, serial=plate.serial, person=plate.person, t_ns=plate.t_ns)


class NameplateTyped(BaseModel):
    """The serial number, typed twice."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"device": "wtg-07/blade-2/pmc", "serial": "P-20417", "again": "P-20417"}]},
    )

    device: Slug
    serial: Annotated[str, Field(max_length=100)]
    again: Annotated[str, Field(max_length=100)]
