"""Where a recording comes from that was made of other files: the metadata table ``origin``."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, Final, NamedTuple

from app.recording.content import METADATA_ORIGIN

HASHED_AT_ONCE: Final = 1 << 20


class OriginKind(Enum):
    """How the recording was made."""

    IMPORT = "import"
    CUT = "cut"
    MERGE = "merge"
    ANONYMISED = "anonymised"


class Source(NamedTuple):
    """A file that went into it."""

    file: str
    format: str
    sha256: str
    size_bytes: int


def source_of(path: Path, form: str) -> Source:
    """Name, hash and size of a file. Raises OSError."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while piece := file.read(HASHED_AT_ONCE):
            digest.update(piece)
    return Source(path.name, form, digest.hexdigest(), path.stat().st_size)


def origin_table(
    kind: OriginKind,
    sources: Sequence[Source],
    before: Sequence[Mapping[str, Mapping[str, str]]] = (),
    **details: Any,
) -> dict[str, str]:
    """The table; ``before`` are the metadata of the sources, whose own origins are kept as ``history``."""
    history = [dict(tables[METADATA_ORIGIN]) for tables in before if METADATA_ORIGIN in tables]
    table = {"kind": kind.value, "sources": json.dumps([source._asdict() for source in sources], sort_keys=True)}
    table |= {key: value if isinstance(value, str) else json.dumps(value) for key, value in details.items()}
    if history:
        table["history"] = json.dumps(history, sort_keys=True)
    return table
