"""What a library says of a parameter set: where it comes from, and the tags that people and visits give it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from app.model.sets import Identity, Origin


class Source(Enum):
    """How a set came into the library."""

    BACKUP = "backup"
    VISIT = "visit"
    """As found or as left."""
    FILE = "file"
    RECORDING = "recording"
    UNDO = "undo"
    """What stood in the devices before a restore."""


class Tag(Enum):
    """What a set stands for. The first two are given by people, the others by visits."""

    AS_DELIVERED = "as-delivered"
    GOLDEN = "golden"
    AS_FOUND = "as-found"
    AS_LEFT = "as-left"

    @property
    def by_hand(self) -> bool:
        """True where people give it and take it off."""
        return self in (Tag.AS_DELIVERED, Tag.GOLDEN)

    @property
    def text_key(self) -> str:
        """Key of its text."""
        return f"set.tag.{self.value.replace('-', '_')}"


@dataclass(frozen=True, slots=True)
class SetRecord:
    """One occasion on which a content was taken. ``unread`` and ``empty`` count objects, ``values`` those with one."""

    id: str
    hash: str
    description_id: str
    description_version: str
    identity: Identity
    origin: Origin
    t_ns: int
    source: Source
    values: int
    unread: int
    empty: int

    @property
    def complete(self) -> bool:
        """True where every readable object was read."""
        return self.unread == 0

    def scope_of(self, tag: Tag) -> str:
        """What a tag is about: one golden set a kind of device, the others one a device."""
        return self.description_id if tag is Tag.GOLDEN else self.origin.device


@dataclass(frozen=True, slots=True)
class TagEntry:
    """One row in the history of a tag; ``record_id`` None: it was taken off. ``visit_id`` of as-found and as-left."""

    tag: Tag
    scope: str
    record_id: str | None
    person: str
    t_ns: int
    visit_id: str | None = None
