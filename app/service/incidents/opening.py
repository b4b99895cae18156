"""Opens a bundle of unknown hands: looks before it unpacks, believes no size and no name, and keeps what is whole.

What is hostile or makes no sense as a whole is refused: names that lead elsewhere, members that swell beyond all
measure, another schema. What is damaged in part is told, and the rest is taken.
"""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from app.errors import BundleError, HubsideError
from app.model.incident import CODE_LENGTH, CODE_LETTERS, Annotation, Incident, load_draft
from app.model.sets import ParameterSet, load_set
from app.recording.annotations import read_annotations
from app.service.incidents.form import (
    INCIDENT,
    MANIFEST,
    MAX_BUNDLE_BYTES,
    MAX_MEMBERS,
    MAX_RATIO,
    MAX_TEXT_BYTES,
    MAX_UNPACKED_BYTES,
    MEMBER_NAME,
    RATIO_FROM_BYTES,
    Kind,
    Manifest,
    Member,
    SetRole,
    load_manifest,
)

_PIECE: Final = 1 << 20
_LARGE: Final = (Kind.RECORDING, Kind.ANNOTATIONS)
_UNREADABLE: Final = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)
_ENCRYPTED: Final = 0x1
_ID: Final = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")


@dataclass(frozen=True, slots=True)
class Flaw:
    """What is wrong with one member; ``reason_key`` is a text key."""

    member: str
    reason_key: str
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Opened:
    """What of a bundle is whole. ``recording`` and ``folder`` are where it was unpacked."""

    manifest: Manifest
    incident: Incident | None
    recording: Path | None
    annotations: tuple[Annotation, ...]
    sets: tuple[tuple[SetRole, ParameterSet], ...]
    flaws: tuple[Flaw, ...]


def open_bundle(file: Path, folder: Path) -> Opened:
    """Unpack what is whole into ``folder``, which is empty. Raises BundleError, HubsideError of nothing else."""
    try:
        if file.stat().st_size > MAX_BUNDLE_BYTES:
            raise BundleError(file=file.name, reason_key="incident.bundle.large", most=MAX_BUNDLE_BYTES >> 20)
        with zipfile.ZipFile(file) as archive:
            infos = _looked_at(archive, file.name)
            manifest = _manifest(archive, infos, file.name)
            return _Unpacking(archive, infos, manifest, folder).run()
    except _UNREADABLE as error:
        raise BundleError(file=file.name, reason_key="incident.bundle.no_zip", detail=str(error)) from error
    except OSError as error:
        detail = error.strerror or str(error)
        raise BundleError(file=file.name, reason_key="incident.bundle.disk", detail=detail) from error


def _looked_at(archive: zipfile.ZipFile, file: str) -> Mapping[str, zipfile.ZipInfo]:
    """The members by name. Raises BundleError for what no bundle of ours holds."""
    infos = archive.infolist()
    if len(infos) > MAX_MEMBERS or sum(info.file_size for info in infos) > MAX_UNPACKED_BYTES:
        raise BundleError(file=file, reason_key="incident.bundle.swells")
    found: dict[str, zipfile.ZipInfo] = {}
    for info in infos:
        # What the zip's own directory calls it, before anything makes it look harmless.
        name = info.orig_filename
        if not MEMBER_NAME.fullmatch(name) or name in found:
            raise BundleError(file=file, reason_key="incident.bundle.name", found=ascii(name)[:200])
        if info.flag_bits & _ENCRYPTED or info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise BundleError(file=file, reason_key="incident.bundle.packed", found=name)
        if info.file_size > RATIO_FROM_BYTES and info.file_size > MAX_RATIO * max(1, info.compress_size):
            raise BundleError(file=file, reason_key="incident.bundle.swells")
        found[name] = info
    return found


def _manifest(archive: zipfile.ZipFile, infos: Mapping[str, zipfile.ZipInfo], file: str) -> Manifest:
    info = infos.get(MANIFEST)
    if info is None or info.file_size > MAX_TEXT_BYTES:
        raise BundleError(file=file, reason_key="incident.bundle.manifest", detail=MANIFEST)
    with archive.open(info) as source:
        return load_manifest(source.read(MAX_TEXT_BYTES), file)


class _Unpacking:
    def __init__(
        self, archive: zipfile.ZipFile, infos: Mapping[str, zipfile.ZipInfo], manifest: Manifest, folder: Path
    ) -> None:
        self._archive, self._infos, self._manifest, self._folder = archive, infos, manifest, folder
        self._flaws: list[Flaw] = []
        self._whole: dict[Kind, list[tuple[Member, Path]]] = {kind: [] for kind in Kind}

    def run(self) -> Opened:
        named = {member.name for member in self._manifest.members}
        for name in self._infos.keys() - named - {MANIFEST}:
            self._flaws.append(Flaw(name, "incident.flawed.unknown"))
        for number, member in enumerate(self._manifest.members):
            path = self._folder / f"{number}"
            if self._unpack(member, path):
                self._whole[member.kind].append((member, path))
        recording = next((path for _, path in self._whole[Kind.RECORDING]), None)
        return Opened(
            self._manifest,
            self._incident(),
            recording,
            tuple(self._annotations()),
            tuple(self._sets()),
            tuple(self._flaws),
        )

    def _unpack(self, member: Member, path: Path) -> bool:
        """True where the member is what the manifest says; no byte more than that is written."""
        info = self._infos.get(member.name)
        if info is None:
            return self._flaw(member, "incident.flawed.missing")
        if member.kind not in _LARGE and member.size_bytes > MAX_TEXT_BYTES:
            return self._flaw(member, "incident.flawed.large")
        digest, left = hashlib.sha256(), member.size_bytes
        try:
            with self._archive.open(info) as source, path.open("xb") as target:
                while left > 0 and (piece := source.read(min(_PIECE, left))):
                    digest.update(piece)
                    target.write(piece)
                    left -= len(piece)
                more = source.read(1)
        except _UNREADABLE as error:
            return self._flaw(member, "incident.flawed.damaged", str(error))
        if left or more or digest.hexdigest() != member.sha256:
            return self._flaw(member, "incident.flawed.changed")
        return True

    def _flaw(self, member: Member, reason_key: str, detail: str = "") -> bool:
        self._flaws.append(Flaw(member.name, reason_key, detail))
        return False

    def _incident(self) -> Incident | None:
        for member, path in self._whole[Kind.INCIDENT]:
            if member.name == INCIDENT:
                try:
                    return _incident(json.loads(path.read_bytes()))
                except (ValueError, KeyError, TypeError, RecursionError, HubsideError) as error:
                    self._flaw(member, "incident.flawed.senseless", str(error))
        return None

    def _annotations(self) -> Sequence[Annotation]:
        found: list[Annotation] = []
        for member, path in self._whole[Kind.ANNOTATIONS]:
            try:
                found += read_annotations(path, "")
            except HubsideError as error:
                self._flaw(member, "incident.flawed.senseless", str(error))
        return found

    def _sets(self) -> Sequence[tuple[SetRole, ParameterSet]]:
        found = []
        for member, path in self._whole[Kind.SET]:
            try:
                text = path.read_bytes().decode("utf-8")
                found.append((member.role or SetRole.LATEST, load_set(text, member.name)))
            except (UnicodeDecodeError, HubsideError) as error:
                self._flaw(member, "incident.flawed.senseless", str(error))
        return found


def _incident(found: Mapping[str, Any]) -> Incident:
    texts = [found[key] for key in ("id", "code", "person", "author")]
    numbers = [found[key] for key in ("version", "t_ns", "created_ns")]
    if not all(isinstance(one, str) and 0 < len(one) <= 200 for one in texts):
        raise ValueError("texts of the incident")
    if not all(isinstance(one, int) and not isinstance(one, bool) and 0 <= one < 1 << 63 for one in numbers):
        raise ValueError("numbers of the incident")
    key, code, person, author = texts
    if not _ID.fullmatch(key) or len(code) != CODE_LENGTH or not set(code) <= set(CODE_LETTERS):
        raise ValueError("id or code of the incident")
    version, t_ns, created_ns = numbers
    return Incident(key, code, version, load_draft(found["content"]), t_ns, person, created_ns, author)
