"""Parameter sets as the page gets them."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.service.views import RawJson


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


class SetIdentity(BaseModel):
    """What the device said of itself; null where it did not answer."""

    model_config = ConfigDict(from_attributes=True)

    device_type: int | None
    device_name: str | None
    hardware: str | None
    software: str | None
    vendor_id: int | None
    product_code: int | None
    revision: int | None
    serial: int | None


class SetHead(BaseModel):
    """What a set says of itself: who it is of, and how many objects were read, not read, and empty."""

    model_config = ConfigDict(from_attributes=True)

    origin: SetOrigin
    identity: SetIdentity
    description_id: str
    description_version: str
    hash: str
    values: int
    unread: int
    empty: int


class SetRef(BaseModel):
    """One file. ``head`` null: not read yet, or not usable, then ``reason`` says why."""

    name: str
    size_bytes: int
    modified_ns: int
    head: SetHead | None
    reason: str | None


class SetList(BaseModel):
    """The set files of the data folder."""

    folder: str
    files: list[SetRef]


class SetDoc(BaseModel):
    """One set: raw values by address, and the objects that were not read, each with the reason."""

    name: str
    path: str
    head: SetHead
    values: dict[str, RawJson]
    unread: dict[str, str]
    empty: list[str]


class BackupRequest(BaseModel):
    """``reason`` is kept in the sets."""

    model_config = ConfigDict(extra="forbid")

    reason: Annotated[str, Field(max_length=500)] = ""
