"""Recordings as the page gets them."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict


class RecordingSummary(BaseModel):
    """What a file says of itself. ``frames`` and ``events`` are its own; ``lost`` is of its recording so far."""

    model_config = ConfigDict(from_attributes=True)

    turbine: str
    person: str
    part: int
    started_ns: int | None
    first_ns: int | None
    last_ns: int | None
    frames: int
    lost: int | None
    events: int


FileStateName = Literal["live", "finished", "unfinished", "unreadable", "unread"]


class RecordingRef(BaseModel):
    """One file. ``unread``: it was not looked into yet, ask again; ``reason`` says why it cannot be read.

    ``sample``: it came with the program.
    """

    name: str
    size_bytes: int
    modified_ns: int
    state: FileStateName
    summary: RecordingSummary | None
    reason: str | None
    sample: bool = False


class RecordingList(BaseModel):
    """The recordings of the data folder. ``free_bytes`` null: the folder does not exist yet."""

    folder: str
    free_bytes: int | None
    files: list[RecordingRef]


class AttachmentRef(BaseModel):
    """A file inside a recording."""

    name: str
    media_type: str
    size_bytes: int


class DamageRef(BaseModel):
    """A stretch of a file that cannot be used."""

    offset: int
    length: int
    reason: str
    detail: str


class LossRef(BaseModel):
    """An event that tells of frames that are missing; ``text_key`` with ``details`` is its text."""

    t_ns: int
    text_key: str
    details: dict[str, Any]


class RecordingDoc(BaseModel):
    """What one file holds beside its frames."""

    name: str
    path: str
    state: FileStateName
    summary: RecordingSummary | None
    metadata: dict[str, dict[str, str]]
    topics: dict[str, int]
    attachments: list[AttachmentRef]
    damages: list[DamageRef]
    losses: list[LossRef]
