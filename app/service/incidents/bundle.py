"""Writes a bundle: the cut of the recording around the incident, and all that explains it."""

from __future__ import annotations

import json
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from app import __version__
from app.errors import BundleError, RecordingError, UsageError
from app.model.description_file import BUILTIN, builtin_folder
from app.model.incident import Annotation, Incident, Span, dump_draft
from app.model.sets import ParameterSet, dump_set
from app.recording.annotations import SUFFIX as ANNOTATIONS
from app.recording.annotations import write_annotations
from app.recording.exchange.cut import CutOrder, cut
from app.service.incidents.form import (
    INCIDENT,
    MANIFEST,
    MAX_BUNDLE_BYTES,
    NOTES,
    CutOf,
    Kind,
    Manifest,
    Member,
    SetRole,
    dump_manifest,
    plain_name,
)
from app.service.incidents.identity import sha256_of

MARGIN_NS: Final = 10_000_000_000
"""So much of the recording before and after the incident goes along."""
TOOL: Final = f"hubside {__version__}"
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)
"""Of all members, so that the same incident makes the same bytes."""


@dataclass(frozen=True, slots=True)
class Bundle:
    """What goes into a bundle. ``recording`` None: it is not there, and ``lacking`` says so (text keys)."""

    incident: Incident
    recording: Path | None
    sha256: str
    annotations: Sequence[Annotation]
    sets: Sequence[tuple[SetRole, ParameterSet]]
    descriptions: Sequence[str]
    lacking: tuple[str, ...]
    person: str
    made_ns: int


@dataclass(frozen=True, slots=True)
class _Part:
    name: str
    kind: Kind
    path: Path
    role: SetRole | None = None


def write_bundle(target: Path, bundle: Bundle) -> Manifest:
    """Write the file, whole or not at all; what is there is replaced. Raises RecordingError, BundleError."""
    unfinished = target.with_name(target.name + ".part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="bundle-", dir=target.parent) as folder:
            cut_of = _cut(bundle, Path(folder))
            parts = list(_parts(bundle, Path(folder), cut_of))
            manifest = Manifest(
                TOOL, bundle.made_ns, bundle.person, bundle.incident.code, bundle.incident.draft.title,
                cut_of, bundle.lacking, tuple(_member(part) for part in parts),
            )  # fmt: skip
            _zip(unfinished, manifest, parts)
            if unfinished.stat().st_size > MAX_BUNDLE_BYTES:  # nobody could open it
                most = MAX_BUNDLE_BYTES >> 20
                raise BundleError(file=target.name, reason_key="incident.bundle.large", most=most)
        unfinished.replace(target)
        return manifest
    except OSError as error:
        detail = error.strerror or str(error)
        raise BundleError(file=target.name, reason_key="incident.bundle.disk", detail=detail) from error
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def reach_of(incident: Incident) -> Span:
    """What of the recording goes along: incident and loop, with a margin."""
    draft = incident.draft
    loop = draft.loop or draft.span
    begin, end = min(draft.span.from_ns, loop.from_ns), max(draft.span.to_ns, loop.to_ns)
    return Span(max(0, begin - MARGIN_NS), end + MARGIN_NS)


def _cut(bundle: Bundle, folder: Path) -> CutOf | None:
    """Raises RecordingError where the recording cannot be read, or nothing of it lies in the time of the incident."""
    if bundle.recording is None:
        return None
    reach = reach_of(bundle.incident)
    name = f"{plain_name(bundle.recording.stem)}-{bundle.incident.code}.mcap"
    try:
        cut(bundle.recording, folder / name, CutOrder(reach.from_ns, reach.to_ns + 1))
    except UsageError as error:
        raise RecordingError(file=bundle.recording.name, offset=0, reason=str(error.details["reason"])) from error
    return CutOf(name, bundle.recording.name, bundle.sha256, reach.from_ns, reach.to_ns)


def _parts(bundle: Bundle, folder: Path, cut_of: CutOf | None) -> Iterator[_Part]:
    incident = bundle.incident
    yield _text(folder, INCIDENT, Kind.INCIDENT, _json(incident_json(incident)))
    if incident.draft.notes:
        yield _text(folder, NOTES, Kind.NOTES, incident.draft.notes + "\n")
    if cut_of is not None:
        yield _Part(f"recording/{cut_of.name}", Kind.RECORDING, folder / cut_of.name)
    if bundle.annotations:
        stem = incident.draft.recording.removesuffix(".mcap") if cut_of is None else cut_of.name.removesuffix(".mcap")
        path = folder / f"{plain_name(stem)}{ANNOTATIONS}"
        write_annotations(path, bundle.annotations)
        yield _Part(f"annotations/{path.name}", Kind.ANNOTATIONS, path)
    for name in sorted(set(bundle.descriptions) & BUILTIN.keys()):
        file = builtin_folder() / BUILTIN[name]
        yield _Part(f"descriptions/{file.name}", Kind.DESCRIPTION, file)
    for role, one in bundle.sets:
        name = f"sets/{plain_name(one.origin.device)}.{role.value}.json"
        yield _text(folder, name, Kind.SET, dump_set(one), role)


def incident_json(incident: Incident) -> dict[str, Any]:
    """The member ``incident.json``."""
    return {
        "id": incident.id,
        "code": incident.code,
        "version": incident.version,
        "t_ns": incident.t_ns,
        "person": incident.person,
        "created_ns": incident.created_ns,
        "author": incident.author,
        "origin": None if incident.origin is None else asdict(incident.origin),
        "content": dump_draft(incident.draft),
    }


def _text(folder: Path, name: str, kind: Kind, text: str, role: SetRole | None = None) -> _Part:
    path = folder / name.replace("/", "_")
    path.write_bytes(text.encode())
    return _Part(name, kind, path, role)


def _json(content: Any) -> str:
    return json.dumps(content, ensure_ascii=False, indent=2, sort_keys=True) + "\n"


def _member(part: _Part) -> Member:
    return Member(part.name, part.kind, sha256_of(part.path), part.path.stat().st_size, part.role)


def _zip(path: Path, manifest: Manifest, parts: Iterable[_Part]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(_info(MANIFEST), dump_manifest(manifest))
        for part in parts:
            info = _info(part.name)
            if part.kind is Kind.RECORDING:  # it is compressed already
                info.compress_type = zipfile.ZIP_STORED
            with part.path.open("rb") as source, archive.open(info, "w", force_zip64=True) as target:
                while piece := source.read(1 << 20):
                    target.write(piece)


def _info(name: str) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name, _EPOCH)
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = 0o644 << 16
    return info
