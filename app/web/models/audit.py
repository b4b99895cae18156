"""Types of the audit log."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel

from app.service.office.audit import Verified, text_key_of
from app.store.audit_chain import AuditRow
from app.store.audit_rows import details_of


class AuditLine(BaseModel):
    """One row. ``text_key`` with ``details`` is its text; ``device`` is a slug, ``address`` that of a parameter."""

    seq: int
    id: str
    t_ns: int
    person: str
    kind: str
    text_key: str
    device: str | None
    address: str | None
    details: dict[str, Any]
    hash: str

    @classmethod
    def of(cls, row: AuditRow) -> AuditLine:
        """As the page gets it."""
        return cls(
            seq=row.seq,
            id=row.id,
            t_ns=row.t_ns,
            person=row.person,
            kind=row.kind,
            text_key=text_key_of(row.kind),
            device=row.device,
            address=row.address,
            details=details_of(row),
            hash=row.hash,
        )


class AuditPage(BaseModel):
    """Rows, newest first. ``before`` asks for the page behind this one; null: there is none."""

    rows: list[AuditLine]
    before: int | None


class AuditHead(BaseModel):
    """The end of the chain; seq 0: nothing is written yet.

    ``verified_t_ns`` is when the whole chain was last found good. ``waiting`` rows are not on the disk yet;
    ``failing``: the store cannot be written.
    """

    seq: int
    hash: str
    verified_t_ns: int | None
    waiting: int
    failing: bool


class AuditVerified(BaseModel):
    """A walk over the chain. ``broken_seq`` is the first row that is wrong, ``breach_key`` the text that says how."""

    good: bool
    rows: int
    head_seq: int
    head_hash: str
    t_ns: int
    broken_seq: int | None
    breach: Literal["missing", "previous", "changed", "end"] | None
    breach_key: str | None

    @classmethod
    def of(cls, done: Verified) -> AuditVerified:
        """As the page gets it."""
        broken = done.broken
        return cls(
            good=broken is None,
            rows=done.rows,
            head_seq=done.head.seq,
            head_hash=done.head.hash,
            t_ns=done.t_ns,
            broken_seq=None if broken is None else broken.seq,
            breach=None if broken is None else broken.breach.value,
            breach_key=None if broken is None else broken.breach.text_key,
        )
