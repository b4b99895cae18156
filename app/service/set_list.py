"""The set files in the data folder: a list that stays fast, and one of them in full."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from app.errors import SetFileError
from app.model.sets import Identity, Origin, ParameterSet, load_set
from app.service.file_list import FileList


@dataclass(frozen=True, slots=True)
class SetLook:
    """What one set file says of itself; ``reason``: why it cannot be used, then nothing else is told."""

    origin: Origin | None
    identity: Identity | None
    description_id: str
    description_version: str
    hash: str
    values: int
    unread: int
    empty: int
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class SetFile:
    """One file of the list. ``look`` None: not read yet."""

    name: str
    size_bytes: int
    modified_ns: int
    look: SetLook | None


class SetFiles:
    """The sets of one folder and of the folders in it, one a turbine."""

    def __init__(self, folder: Path) -> None:
        self._list = FileList(folder, "*/*.json", look_at)

    @property
    def folder(self) -> Path:
        """Where they lie."""
        return self._list.folder

    def files(self) -> list[SetFile]:
        """The files, latest first. Reads files: not for the event loop."""
        return [SetFile(one.name, one.size_bytes, one.modified_ns, one.content) for one in self._list.look()]

    def path(self, name: str) -> Path | None:
        """The file of that name, or None."""
        return self._list.path(name)


def open_set(path: Path) -> ParameterSet:
    """One set. Raises SetFileError."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SetFileError(file=path.name, line=1, reason=str(error)) from error
    return load_set(text, path.name)


def look_at(path: Path) -> SetLook:
    """What a set file says of itself; a wrong hash makes it unusable."""
    try:
        return look_of(open_set(path))
    except SetFileError as error:
        return SetLook(None, None, "", "", "", 0, 0, 0, str(error.details["reason"]))


def look_of(parameters: ParameterSet) -> SetLook:
    """The head of a set."""
    return SetLook(
        origin=parameters.origin,
        identity=parameters.identity,
        description_id=parameters.description_id,
        description_version=parameters.description_version,
        hash=parameters.hash,
        values=len(parameters.values),
        unread=len(parameters.unread),
        empty=len(parameters.empty),
    )
