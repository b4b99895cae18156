"""Which recording an incident is about, told by its bytes and not by its name.

A fingerprint names the size of a file, and a hash of its head and of its tail: quick for any size. A recording that
went on after it was taken still has it, for recordings only grow.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import BinaryIO, Final

from app.errors import RecordingError
from app.service.recording_list import Recordings

_END_BYTES: Final = 1 << 16
_PIECE: Final = 1 << 20


class RecordingState(Enum):
    """How the recording of an incident stands.

    ``GROWN``: it went on after the incident was marked. ``MOVED``: it bears another name. ``OTHER``: another file has
    its name. ``GONE``: there is none of that name, nor any other that is it.
    """

    THERE = "there"
    GROWN = "grown"
    MOVED = "moved"
    OTHER = "other"
    GONE = "gone"

    @property
    def usable(self) -> bool:
        """True where the recording can be read."""
        return self in (RecordingState.THERE, RecordingState.GROWN, RecordingState.MOVED)

    @property
    def text_key(self) -> str:
        """Key of what is told of it."""
        return f"incident.recording.{self.value}"


@dataclass(frozen=True, slots=True)
class Standing:
    """How a recording stands; ``path`` is where it is, None where it is not."""

    state: RecordingState
    path: Path | None = None


def fingerprint(path: Path) -> str:
    """Of a file as it is now. Raises RecordingError."""
    try:
        with path.open("rb") as file:
            return _at(file, file.seek(0, os.SEEK_END))
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error


def size_of(mark: str) -> int:
    """The size in bytes that a fingerprint tells; -1 where it tells none."""
    text = mark.partition("-")[0]
    return int(text) if text.isdecimal() and len(text) < 20 else -1


def standing(recordings: Recordings, name: str, mark: str) -> Standing:
    """Where the recording is that was named ``name`` and had the fingerprint ``mark``. Reads files."""
    path = recordings.path(name)
    if path is not None:
        state = _state(path, mark)
        if state is not None:
            return Standing(state, path)
    moved = _first_that_is(recordings.of_size(size_of(mark)), mark)
    if moved is not None:
        return Standing(RecordingState.MOVED, moved)
    return Standing(RecordingState.GONE if path is None else RecordingState.OTHER)


def sha256_of(path: Path) -> str:
    """Hash of the whole file. Raises RecordingError."""
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while piece := file.read(_PIECE):
                digest.update(piece)
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error
    return digest.hexdigest()


def _state(path: Path, mark: str) -> RecordingState | None:
    """None where the file is another one, or cannot be read."""
    size = size_of(mark)
    try:
        with path.open("rb") as file:
            now = file.seek(0, os.SEEK_END)
            if not 0 <= size <= now or _at(file, size) != mark:
                return None
            return RecordingState.THERE if now == size else RecordingState.GROWN
    except OSError:
        return None


def _first_that_is(paths: Iterable[Path], mark: str) -> Path | None:
    return next((path for path in paths if _state(path, mark) is RecordingState.THERE), None)


def _at(file: BinaryIO, size: int) -> str:
    """The fingerprint of the first ``size`` bytes."""
    file.seek(0)
    digest = hashlib.blake2b(file.read(min(_END_BYTES, size)), digest_size=16)
    begin = max(0, size - _END_BYTES)
    file.seek(begin)
    digest.update(file.read(size - begin))
    return f"{size}-{digest.hexdigest()}"
