"""Rows of the library of parameter sets: contents, the occasions on which they were taken, tags and nameplates.

A content is kept once, under the SHA-256 of its canonical text. Nothing is deleted; of tags and nameplates the newest
row counts.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import sqlite3
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import Connection as Connection
from sqlalchemy import Row, Select, delete, func, insert, select

from app.errors import StoreError
from app.model.address import parse_address
from app.model.set_record import SetRecord, Source, Tag, TagEntry
from app.model.sets import Identity, Origin, ParameterSet, iso_time, parse_content
from app.store.fleet_rows import AHEAD_NS, keep_latest
from app.store.schema import nameplates, set_contents, set_evidence, set_records, set_tags
from app.store.schema import set_files as files

_SHORTEST_HASH = 8


@dataclass(frozen=True, slots=True)
class Filter:
    """Which records are listed; what is None does not count. ``tag`` is one that they bear now."""

    turbine: str | None = None
    device: str | None = None
    description_id: str | None = None
    tag: Tag | None = None
    limit: int = 5000


@dataclass(frozen=True, slots=True)
class Nameplate:
    """The serial number on a device's plate, as a person typed it."""

    device: str
    serial: str
    person: str
    t_ns: int


def put_set(connection: Connection, new_id: str, parameters: ParameterSet, source: Source, now_ns: int) -> SetRecord:
    """Keep a set; one that was taken on the same occasion already is not kept again. Gives its record."""
    origin, digest = parameters.origin, parameters.hash
    known = connection.execute(
        _records().where(
            set_records.c.hash == digest,
            set_records.c.device == origin.device,
            set_records.c.t_ns == origin.t_ns,
            set_records.c.turbine == origin.turbine,
            set_records.c.person == origin.person,
            set_records.c.reason == origin.reason,
            set_records.c.work_order == origin.work_order,
        )
    ).first()
    if known is not None:
        return _record(known)
    _put_content(connection, digest, parameters)
    connection.execute(
        insert(set_records),
        {
            "id": new_id,
            "hash": digest,
            "turbine": origin.turbine,
            "station": origin.device.rpartition("/")[0],
            "device": origin.device,
            "node": origin.node,
            "t_ns": origin.t_ns,
            "person": origin.person,
            "reason": origin.reason,
            "work_order": origin.work_order,
            "tool": origin.tool,
            "unread": _json({str(address): why for address, why in parameters.unread.items()}),
            "empty": _json([str(address) for address in parameters.empty]),
            "source": source.value,
        },
    )
    keep_latest(connection, new_id, parameters, now_ns)
    return _record(connection.execute(_records().where(set_records.c.id == new_id)).one())


def get_record(connection: Connection, key: str) -> SetRecord | None:
    """The record with that id, or the latest of the content whose hash begins so (8 digits at least), or None."""
    found = connection.execute(_records().where(set_records.c.id == key)).first()
    digits = key.removeprefix("sha256:").lower()
    if found is None and len(digits) >= _SHORTEST_HASH and set(digits) <= set("0123456789abcdef"):
        query = _records().where(set_records.c.hash.startswith(digits, autoescape=True))
        rows = connection.execute(query.order_by(set_records.c.t_ns.desc(), set_records.c.id.desc())).all()
        found = rows[0] if len({row.hash for row in rows}) == 1 else None
    return None if found is None else _record(found)


def get_set(connection: Connection, record: SetRecord) -> ParameterSet | None:
    """The set of a record; None where its content is not what its hash says."""
    text = connection.scalar(select(set_contents.c.content).where(set_contents.c.hash == record.hash))
    if text is None or hashlib.sha256(text.encode()).hexdigest() != record.hash:
        return None
    row = connection.execute(select(set_records).where(set_records.c.id == record.id)).one()
    whole = parse_content(text, record.origin)
    return ParameterSet(
        whole.description_id,
        whole.description_version,
        whole.identity,
        whole.origin,
        whole.values,
        {parse_address(address): why for address, why in json.loads(row.unread).items()},
        tuple(parse_address(address) for address in json.loads(row.empty)),
    )


def list_records(connection: Connection, wanted: Filter, now_ns: int) -> list[SetRecord]:
    """Records, latest first; those whose time is ahead (``AHEAD_NS``) stand last."""
    ahead = set_records.c.t_ns > now_ns + AHEAD_NS
    query = _records().order_by(ahead, set_records.c.t_ns.desc(), set_records.c.id.desc()).limit(wanted.limit)
    if wanted.turbine is not None:
        query = query.where(set_records.c.turbine == wanted.turbine)
    if wanted.device is not None:
        query = query.where(set_records.c.device == wanted.device)
    if wanted.description_id is not None:
        query = query.where(set_contents.c.description_id == wanted.description_id)
    if wanted.tag is not None:
        query = query.where(set_records.c.id.in_(select(present_tags(wanted.tag).c.record_id)))
    return [_record(row) for row in connection.execute(query)]


def put_evidence(connection: Connection, record_id: str, recording: str, seen: Mapping[str, object]) -> None:
    """Keep how the values of a set were seen in a recording; what is kept already stays."""
    if get_evidence(connection, record_id) is None:
        row = {"record_id": record_id, "recording": recording, "seen": _json(seen)}
        connection.execute(insert(set_evidence), row)


def get_evidence(connection: Connection, record_id: str) -> tuple[str, dict[str, Any]] | None:
    """The recording that a set comes from, and what was seen there by address; None where it comes from none."""
    row = connection.execute(select(set_evidence).where(set_evidence.c.record_id == record_id)).first()
    return None if row is None else (row.recording, json.loads(row.seen))


# -- tags -------------------------------------------------------------------------------


def put_tag(connection: Connection, entry: TagEntry) -> None:
    """Add a row to the history of a tag; ``record_id`` None takes it off."""
    connection.execute(
        insert(set_tags),
        {
            "tag": entry.tag.value,
            "scope": entry.scope,
            "visit_id": entry.visit_id,
            "record_id": entry.record_id,
            "person": entry.person,
            "t_ns": entry.t_ns,
        },
    )


def tags_now(connection: Connection, tag: Tag | None = None, scope: str | None = None) -> list[TagEntry]:
    """The tags that are on a record now, oldest first: of each tag, scope and visit the newest row."""
    query = present_tags(tag).select()
    found = [_tag(row) for row in connection.execute(query)]
    return [one for one in found if scope is None or one.scope == scope]


def tag_history(connection: Connection, scope: str) -> list[TagEntry]:
    """All that was ever done to the tags of a device or description, oldest first."""
    query = select(set_tags).where(set_tags.c.scope == scope).order_by(set_tags.c.seq)
    return [_tag(row) for row in connection.execute(query)]


def present_tags(tag: Tag | None = None) -> Any:
    """A subquery of the rows that count now."""
    newest = select(func.max(set_tags.c.seq)).group_by(set_tags.c.tag, set_tags.c.scope, set_tags.c.visit_id)
    query = select(set_tags).where(set_tags.c.seq.in_(newest), set_tags.c.record_id.is_not(None))
    if tag is not None:
        query = query.where(set_tags.c.tag == tag.value)
    return query.order_by(set_tags.c.seq).subquery()


# -- nameplates -------------------------------------------------------------------------


def put_nameplate(connection: Connection, plate: Nameplate) -> None:
    """Add a row to the history of a device's nameplate."""
    row = {"device": plate.device, "serial": plate.serial, "person": plate.person, "t_ns": plate.t_ns}
    connection.execute(insert(nameplates), row)


def nameplates_now(connection: Connection) -> dict[str, Nameplate]:
    """What is known of each device, by slug."""
    query = select(nameplates).order_by(nameplates.c.seq)
    return {row.device: Nameplate(row.device, row.serial, row.person, row.t_ns) for row in connection.execute(query)}


def peek_nameplates(path: Path) -> dict[str, Nameplate]:
    """As ``nameplates_now``, of a store that another process has: it is read and nothing else. Raises StoreError."""
    columns = "device, serial, person, t_ns"
    try:
        with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as file:
            if not file.execute("SELECT 1 FROM sqlite_schema WHERE name = 'nameplates'").fetchone():
                return {}  # a store of an earlier version knows none
            rows = file.execute(f"SELECT {columns} FROM nameplates ORDER BY seq").fetchall()
    except sqlite3.Error as error:
        raise StoreError(file=str(path), reason=str(error)) from error
    return {row[0]: Nameplate(*row) for row in rows}


# -- files ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SetFileRow:
    """A set file that was looked at: the record made of it, or line and reason why none was."""

    name: str
    size_bytes: int
    modified_ns: int
    record_id: str | None
    line: int | None = None
    reason: str | None = None

    @property
    def stat(self) -> tuple[int, int]:
        """By which a changed file is known."""
        return self.size_bytes, self.modified_ns


def set_files(connection: Connection) -> dict[str, SetFileRow]:
    """The files that were looked at, by name."""
    rows = connection.execute(select(files).order_by(files.c.name))
    return {row.name: SetFileRow(**row._mapping) for row in rows}


def put_file(connection: Connection, row: SetFileRow) -> None:
    """Keep what a look at a file gave, in the place of an earlier one."""
    forget_files(connection, [row.name])
    connection.execute(insert(files), asdict(row))


def forget_files(connection: Connection, names: Iterable[str]) -> None:
    """Files that are gone; the records that were made of them stay."""
    for name in names:
        connection.execute(delete(files).where(files.c.name == name))


# ---------------------------------------------------------------------------------------


def _put_content(connection: Connection, digest: str, parameters: ParameterSet) -> None:
    if connection.scalar(select(set_contents.c.hash).where(set_contents.c.hash == digest)) is not None:
        return
    connection.execute(
        insert(set_contents),
        {
            "hash": digest,
            "description_id": parameters.description_id,
            "description_version": parameters.description_version,
            "identity": _json(parameters.identity.as_json()),
            "size": len(parameters.values),
            "content": parameters.content,
        },
    )


def _records() -> Select[Any]:
    return select(
        set_records,
        set_contents.c.description_id,
        set_contents.c.description_version,
        set_contents.c.identity,
        set_contents.c.size,
    ).join(set_contents, set_contents.c.hash == set_records.c.hash)


def _record(row: Row[Any]) -> SetRecord:
    origin = Origin(
        row.turbine, row.device, row.node, iso_time(row.t_ns), row.person, row.reason, row.tool, row.work_order
    )
    unread: Mapping[str, str] = json.loads(row.unread)
    return SetRecord(
        id=row.id,
        hash=row.hash,
        description_id=row.description_id,
        description_version=row.description_version,
        identity=Identity(**json.loads(row.identity)),
        origin=origin,
        t_ns=row.t_ns,
        source=Source(row.source),
        values=row.size,
        unread=len(unread),
        empty=len(json.loads(row.empty)),
    )


def _tag(row: Any) -> TagEntry:
    return TagEntry(Tag(row.tag), row.scope, row.record_id, row.person, row.t_ns, row.visit_id)


def _json(content: object) -> str:
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
