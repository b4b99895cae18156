"""Where the index of a recording lies, and whether it is still the one of that file.

Beside the recording; where its folder takes no files, or is that of the samples, which stays as it came, in a cache
folder, under a name that holds the recording's path.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import Final

from app.model.bundled import bundled_folder

SUFFIX: Final = ".index"
SCHEMA: Final = 3
"""Raised with every change of what an index holds or how."""
_ENDS_BYTES: Final = 1 << 16
_NAME_AT_MOST: Final = 50


def index_path(recording: Path, cache: Path | None = None) -> Path:
    """The index's file: beside the recording, or in ``cache`` where none is there and none can be written there."""
    beside = recording.with_name(recording.name + SUFFIX)
    sample = recording.resolve().is_relative_to(bundled_folder("recordings", "recordings"))
    if cache is None or _is_there(beside) or (os.access(recording.parent, os.W_OK) and not sample):
        return beside
    return in_cache(recording, cache)


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a name that is too long
        return False


def in_cache(recording: Path, cache: Path) -> Path:
    """The index's file in the cache folder."""
    path = hashlib.blake2b(str(recording.resolve()).encode("utf-8", "surrogateescape"), digest_size=8).hexdigest()
    return cache / f"{recording.stem[:_NAME_AT_MOST]}-{path}{SUFFIX}"


def fingerprint(recording: Path) -> str:
    """Size and a hash of both ends of a file: another one after every change that a recorder or a person makes.

    Raises OSError.
    """
    with recording.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(0)
        digest = hashlib.blake2b(file.read(_ENDS_BYTES), digest_size=16)
        file.seek(max(0, size - _ENDS_BYTES))
        digest.update(file.read(_ENDS_BYTES))
    return f"{size}-{digest.hexdigest()}"
