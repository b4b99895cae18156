"""The hash chain of the audit log. Pure.

``hash`` of a row is SHA-256 over the previous row's hash (64 hexadecimal digits, zeros before the first row) followed
by the row as canonical JSON (keys sorted, no blanks, UTF-8). Whoever changes, removes or inserts a row breaks the chain
from there on; whoever has noted the head knows that nothing before it was rewritten.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

BEGINNING: Final = "0" * 64
"""Stands for the hash before the first row."""


@dataclass(frozen=True, slots=True)
class AuditRow:
    """One row. ``details`` is canonical JSON of an object; ``device`` is a slug, ``address`` in its short form."""

    seq: int
    id: str
    t_ns: int
    person: str
    kind: str
    device: str | None
    address: str | None
    details: str
    previous: str
    hash: str

    @property
    def content(self) -> dict[str, Any]:
        """What the hash covers, besides the previous hash."""
        return {
            "seq": self.seq,
            "id": self.id,
            "t_ns": self.t_ns,
            "person": self.person,
            "kind": self.kind,
            "device": self.device,
            "address": self.address,
            "details": self.details,
        }


@dataclass(frozen=True, slots=True)
class Head:
    """The end of the chain; seq 0 is the beginning, where nothing is written yet."""

    seq: int = 0
    hash: str = BEGINNING


class Breach(Enum):
    """What is wrong with a row."""

    MISSING = "missing"
    """The rows before it are not there."""
    PREVIOUS = "previous"
    """It does not follow the row before it."""
    CHANGED = "changed"
    """Its content is not what its hash was made of."""
    END = "end"
    """Rows at the end are missing, or were added past the log."""

    @property
    def text_key(self) -> str:
        """Text key of the explanation."""
        return f"audit_breach.{self.value}"


@dataclass(frozen=True, slots=True)
class Broken:
    """The first row that is wrong, and how."""

    seq: int
    breach: Breach


def canonical(data: Any) -> str:
    """Canonical JSON."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def plain(detail: Any) -> Any:
    """A detail as JSON carries it; what it does not know becomes text."""
    if detail is None or isinstance(detail, bool | int | str):
        return detail
    if isinstance(detail, float):
        return detail if math.isfinite(detail) else str(detail)
    if isinstance(detail, bytes):
        return detail.hex()
    if isinstance(detail, Enum):
        return plain(detail.value)
    if isinstance(detail, Mapping):
        return {str(key): plain(item) for key, item in detail.items()}
    if isinstance(detail, list | tuple | set | frozenset):
        return [plain(item) for item in detail]
    return str(detail)


def row_hash(previous: str, content: Mapping[str, Any]) -> str:
    """The hash of a row with this content behind the row whose hash is ``previous``."""
    return hashlib.sha256(f"{previous}{canonical(content)}".encode("utf-8", "surrogatepass")).hexdigest()


def check_row(before: Head, row: AuditRow) -> Breach | None:
    """What is wrong with ``row`` behind ``before``, or None."""
    if row.seq != before.seq + 1:
        return Breach.MISSING
    if row.previous != before.hash:
        return Breach.PREVIOUS
    if row_hash(row.previous, row.content) != row.hash:
        return Breach.CHANGED
    return None
