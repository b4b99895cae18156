"""The form of a bundle: one zip file of an incident with all that is needed to look into it elsewhere.

``manifest.json`` names every other member with its size and hash; ``docs/incidents.md`` tells the rest. A reader takes
what it knows by name and kind, and trusts nothing else: neither sizes nor names of the zip itself.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from app.errors import BundleError

SUFFIX: Final = ".hubside-incident"
FORMAT: Final = "hubside-incident"
SCHEMA: Final = 1
MANIFEST: Final = "manifest.json"
INCIDENT: Final = "incident.json"
NOTES: Final = "notes.md"
MAX_BUNDLE_BYTES: Final = 512 << 20
"""Of the file."""
MAX_UNPACKED_BYTES: Final = 1 << 30
MAX_MEMBERS: Final = 400
MAX_TEXT_BYTES: Final = 16 << 20
"""Of any member but recording and annotations."""
MAX_RATIO: Final = 200
"""Deflated JSON shrinks to a tenth; what claims to shrink to a two-hundredth is no text of ours."""
RATIO_FROM_BYTES: Final = 1 << 20
MEMBER_NAME: Final = re.compile(
    r"(manifest\.json|incident\.json|notes\.md|(recording|annotations|descriptions|sets)/[A-Za-z0-9][A-Za-z0-9._+-]{0,199})"
)
_HASH: Final = re.compile(r"[0-9a-f]{64}")


class Kind(Enum):
    """What a member is."""

    INCIDENT = "incident"
    NOTES = "notes"
    RECORDING = "recording"
    ANNOTATIONS = "annotations"
    DESCRIPTION = "description"
    SET = "set"


class SetRole(Enum):
    """Why a set goes along: as of the moment, the device's golden one, its latest one."""

    MOMENT = "moment"
    GOLDEN = "golden"
    LATEST = "latest"


@dataclass(frozen=True, slots=True)
class Member:
    """One file of a bundle; ``role`` only of sets."""

    name: str
    kind: Kind
    sha256: str
    size_bytes: int
    role: SetRole | None = None


@dataclass(frozen=True, slots=True)
class CutOf:
    """The recording of a bundle: ``name`` of its file, and of what it is a cut."""

    name: str
    source: str
    source_sha256: str
    from_ns: int
    to_ns: int


@dataclass(frozen=True, slots=True)
class Manifest:
    """What a bundle says of itself. ``lacking``: text keys of what could not be put in."""

    tool: str
    made_ns: int
    person: str
    code: str
    title: str
    recording: CutOf | None
    lacking: tuple[str, ...]
    members: tuple[Member, ...]


def dump_manifest(manifest: Manifest) -> bytes:
    """The member ``manifest.json``."""
    cut = manifest.recording
    content = {
        "format": FORMAT,
        "schema": SCHEMA,
        "tool": manifest.tool,
        "made_ns": manifest.made_ns,
        "person": manifest.person,
        "code": manifest.code,
        "title": manifest.title,
        "recording": None
        if cut is None
        else {
            "name": cut.name,
            "source": cut.source,
            "source_sha256": cut.source_sha256,
            "from_ns": cut.from_ns,
            "to_ns": cut.to_ns,
        },
        "lacking": list(manifest.lacking),
        "members": [_member_json(one) for one in manifest.members],
    }
    return (json.dumps(content, ensure_ascii=False, indent=2, sort_keys=True) + "\n").encode()


def load_manifest(data: bytes, file: str) -> Manifest:
    """As ``dump_manifest`` gave it. Raises BundleError for another format or schema, or what makes no sense."""
    try:
        content = json.loads(data)
        if content["format"] != FORMAT:
            raise BundleError(file=file, reason_key="incident.bundle.format")
        if content["schema"] != SCHEMA:
            raise BundleError(file=file, reason_key="incident.bundle.schema", found=content["schema"], known=SCHEMA)
        cut = content["recording"]
        members = tuple(_member(one) for one in content["members"][: MAX_MEMBERS + 1])
        if len(members) > MAX_MEMBERS or len({one.name for one in members}) < len(members):
            raise BundleError(file=file, reason_key="incident.bundle.swells")
        return Manifest(
            tool=str(content["tool"]),
            made_ns=int(content["made_ns"]),
            person=str(content["person"]),
            code=str(content["code"]),
            title=str(content["title"]),
            recording=None if cut is None else _cut(cut),
            lacking=tuple(str(one) for one in content["lacking"]),
            members=members,
        )
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise BundleError(file=file, reason_key="incident.bundle.manifest", detail=repr(error)) from error


def _member_json(one: Member) -> dict[str, Any]:
    told: dict[str, Any] = {
        "name": one.name,
        "kind": one.kind.value,
        "sha256": one.sha256,
        "size_bytes": one.size_bytes,
    }
    return told if one.role is None else {**told, "role": one.role.value}


def _member(found: Mapping[str, Any]) -> Member:
    name, digest, size = found["name"], found["sha256"], found["size_bytes"]
    if not isinstance(name, str) or not MEMBER_NAME.fullmatch(name) or name == MANIFEST:
        raise ValueError(f"{name!r} is no name of a member")
    if not isinstance(digest, str) or not _HASH.fullmatch(digest):
        raise ValueError(f"{name}: no hash")
    if isinstance(size, bool) or not isinstance(size, int) or not 0 <= size <= MAX_UNPACKED_BYTES:
        raise ValueError(f"{name}: no size")
    role = found.get("role")
    return Member(name, Kind(found["kind"]), digest, size, None if role is None else SetRole(role))


def _cut(found: Mapping[str, Any]) -> CutOf:
    return CutOf(
        name=str(found["name"]),
        source=str(found["source"]),
        source_sha256=str(found["source_sha256"]),
        from_ns=int(found["from_ns"]),
        to_ns=int(found["to_ns"]),
    )


def plain_name(text: str) -> str:
    """A name that any file system takes: letters, digits, dot, dash, underscore."""
    plain = "".join(one if one.isascii() and (one.isalnum() or one in "._-") else "-" for one in text)
    return plain.lstrip("._-")[:150] or "file"
