"""Rows of incidents and of annotations with their versions, and of the hashes of recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from sqlalchemy import Connection, delete, func, insert, select, update

from app.model.incident import Annotation, Incident, Note, Origin, Span, dump_draft, load_draft
from app.store.schema import (
    annotation_files,
    annotation_versions,
    incident_versions,
    incidents,
    recording_annotations,
    recording_hashes,
)

# -- incidents ---------------------------------------------------------------------


def put_version(connection: Connection, incident: Incident) -> None:
    """Add a version; an incident that was hidden is listed again."""
    if not connection.execute(update(incidents).where(incidents.c.id == incident.id).values(hidden_ns=None)).rowcount:
        origin = None if incident.origin is None else _json(asdict(incident.origin))
        row = {"id": incident.id, "code": incident.code, "hidden_ns": None, "origin": origin}
        connection.execute(insert(incidents), row)
    connection.execute(
        insert(incident_versions),
        {
            "incident_id": incident.id,
            "version": incident.version,
            "t_ns": incident.t_ns,
            "person": incident.person,
            "content": _json(dump_draft(incident.draft)),
        },
    )


def newest(connection: Connection, hidden: bool = False) -> list[Incident]:
    """The newest version of every incident, latest made first; ``hidden``: those that are hidden too."""
    query = _all().order_by(incident_versions.c.incident_id.desc(), incident_versions.c.version)
    if not hidden:
        query = query.where(incidents.c.hidden_ns.is_(None))
    rows: dict[str, list[Any]] = {}
    for row in connection.execute(query):
        rows.setdefault(row.incident_id, []).append(row)
    return [_incident(versions[-1], versions[0]) for versions in rows.values()]


def versions_of(connection: Connection, key: str) -> list[Incident]:
    """All versions of an incident, by its id or code, newest first; of a hidden one too."""
    query = _all().where((incidents.c.id == key) | (incidents.c.code == key)).order_by(incident_versions.c.version)
    rows = list(connection.execute(query))
    return [_incident(row, rows[0]) for row in reversed(rows)]


def has_code(connection: Connection, code: str) -> bool:
    """True where a short link bears it."""
    return connection.scalar(select(incidents.c.id).where(incidents.c.code == code)) is not None


def hide(connection: Connection, incident_id: str, t_ns: int) -> None:
    """List an incident no more."""
    connection.execute(update(incidents).where(incidents.c.id == incident_id).values(hidden_ns=t_ns))


def _all() -> Any:
    return select(incident_versions, incidents.c.code, incidents.c.hidden_ns, incidents.c.origin).join(
        incidents, incidents.c.id == incident_versions.c.incident_id
    )


def _incident(row: Any, first: Any) -> Incident:
    return Incident(
        id=row.incident_id,
        code=row.code,
        version=row.version,
        draft=load_draft(json.loads(row.content)),
        t_ns=row.t_ns,
        person=row.person,
        created_ns=first.t_ns,
        author=first.person,
        hidden=row.hidden_ns is not None,
        origin=None if row.origin is None else Origin(**json.loads(row.origin)),
    )


# -- annotations -------------------------------------------------------------------


def put_annotations(connection: Connection, changed: Sequence[Annotation]) -> None:
    """Add a version of each: all of them or none."""
    for one in changed:
        if connection.scalar(select(recording_annotations.c.id).where(recording_annotations.c.id == one.id)) is None:
            row = {"id": one.id, "recording": one.recording, "incident_id": one.incident}
            connection.execute(insert(recording_annotations), row)
        connection.execute(
            insert(annotation_versions),
            {
                "annotation_id": one.id,
                "t_ns": one.t_ns,
                "person": one.person,
                "deleted": int(one.deleted),
                "content": _json(_content(one)),
            },
        )


def annotations_of(connection: Connection, recording: str, deleted: bool = False) -> list[Annotation]:
    """The annotations of a recording by time; ``deleted``: those that were taken off too."""
    found = _annotations(connection, recording_annotations.c.recording == recording)
    return sorted((one for one in found if deleted or not one.deleted), key=lambda one: (one.span.from_ns, one.id))


def get_annotation(connection: Connection, annotation_id: str) -> Annotation | None:
    """The newest version of one, taken off or not."""
    return next(iter(_annotations(connection, recording_annotations.c.id == annotation_id)), None)


def _annotations(connection: Connection, which: Any) -> list[Annotation]:
    last = select(func.max(annotation_versions.c.seq)).group_by(annotation_versions.c.annotation_id)
    query = (
        select(annotation_versions, recording_annotations.c.recording, recording_annotations.c.incident_id)
        .join(recording_annotations, recording_annotations.c.id == annotation_versions.c.annotation_id)
        .where(annotation_versions.c.seq.in_(last), which)
    )
    return [_annotation(row) for row in connection.execute(query)]


def _content(one: Annotation) -> Mapping[str, Any]:
    return {
        "from_ns": one.span.from_ns,
        "to_ns": one.span.to_ns,
        "text": one.text,
        "severity": one.severity.value,
        "colour": one.colour,
        "foreign": one.foreign,
        "extra": dict(one.extra),
    }


def _annotation(row: Any) -> Annotation:
    content = json.loads(row.content)
    return Annotation(
        id=row.annotation_id,
        recording=row.recording,
        span=Span(content["from_ns"], content["to_ns"]),
        text=content["text"],
        severity=Note(content["severity"]),
        colour=content["colour"],
        person=row.person,
        t_ns=row.t_ns,
        incident=row.incident_id,
        deleted=bool(row.deleted),
        foreign=content["foreign"],
        extra=content["extra"],
    )


def put_file_hash(connection: Connection, recording: str, sha256: str, t_ns: int) -> None:
    """Keep the hash of what was written beside a recording."""
    connection.execute(delete(annotation_files).where(annotation_files.c.recording == recording))
    connection.execute(insert(annotation_files), {"recording": recording, "sha256": sha256, "t_ns": t_ns})


def file_hash(connection: Connection, recording: str) -> str | None:
    """The hash of what was last written beside a recording."""
    found: str | None = connection.scalar(
        select(annotation_files.c.sha256).where(annotation_files.c.recording == recording)
    )
    return found


# -- recordings --------------------------------------------------------------------


def put_recording_hash(connection: Connection, fingerprint: str, sha256: str, t_ns: int) -> None:
    """Keep the hash of a whole recording."""
    connection.execute(delete(recording_hashes).where(recording_hashes.c.fingerprint == fingerprint))
    connection.execute(insert(recording_hashes), {"fingerprint": fingerprint, "sha256": sha256, "t_ns": t_ns})


def recording_hash(connection: Connection, fingerprint: str) -> str | None:
    """The hash of the whole recording with that fingerprint, where it was ever taken."""
    found: str | None = connection.scalar(
        select(recording_hashes.c.sha256).where(recording_hashes.c.fingerprint == fingerprint)
    )
    return found


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, ensure_ascii=False, sort_keys=True, separators=(",", ":"))
