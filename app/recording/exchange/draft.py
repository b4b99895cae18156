"""A file that is being made: hidden, under a name of its own, until it is complete; and names that are spoken for."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from threading import Lock
from typing import Final
from uuid import uuid4

from app.recording.file_lock import lock_file

DRAFT_PREFIX: Final = ".making-"
DRAFT_SUFFIX: Final = ".part"
_spoken_for: set[Path] = set()
_lock = Lock()


class Draft:
    """The draft of ``target``: ``path`` is written, then published or discarded. No other draft has that path."""

    def __init__(self, target: Path) -> None:
        """Raises FileExistsError where there is a file of that name."""
        if target.exists():
            raise FileExistsError(errno.EEXIST, "the file exists already", str(target))
        self.target = target
        self.path = target.with_name(f"{DRAFT_PREFIX}{uuid4().hex}{DRAFT_SUFFIX}")
        self._published = False

    def publish(self) -> None:
        """Gives the file its name. Raises FileExistsError where another took it meanwhile: that one stays."""
        try:
            _rename(self.path, self.target)
        except FileExistsError as error:
            raise FileExistsError(errno.EEXIST, "the file exists already", str(self.target)) from error
        self._published = True

    def withdraw(self) -> None:
        """Takes away what was made, published or not; never a file of another."""
        with suppress(OSError):
            self.path.unlink(missing_ok=True)
            if self._published:
                self.target.unlink(missing_ok=True)


@contextmanager
def drafted(target: Path) -> Iterator[Path]:
    """The path to write to; what is there at the end is published, and nothing is left where anything raises.

    Raises FileExistsError where there is a file of that name, at the beginning or at the end.
    """
    draft = Draft(target)
    try:
        yield draft.path
        draft.publish()
    except BaseException:
        draft.withdraw()
        raise


def _rename(path: Path, target: Path) -> None:
    """Another name, but never that of a file that is there. Raises OSError."""
    if os.name == "nt":
        path.rename(target)  # refuses by itself
        return
    try:
        os.link(path, target)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links, such as that of a memory stick
        target.open("xb").close()
        path.replace(target)
    else:
        path.unlink()


def sweep(folder: Path) -> None:
    """Takes away what a process left that was killed; drafts at work in another process are locked and stay."""
    for path in folder.glob(f"{DRAFT_PREFIX}*{DRAFT_SUFFIX}"):
        with suppress(OSError):
            with path.open("r+b") as file:
                lock_file(file)
            path.unlink()


@contextmanager
def free_name(folder: Path, name: str) -> Iterator[Path]:
    """A file of that name in ``folder``, with a number where it is there or being made; nobody else gets it meanwhile.

    Makes the folder. Raises OSError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    wanted = folder.resolve() / name
    with _lock:
        path = wanted
        for number in count(2):
            if path not in _spoken_for and not path.exists():
                break
            path = wanted.with_name(f"{wanted.stem}-{number}{wanted.suffix}")
        _spoken_for.add(path)
    try:
        yield folder / path.name
    finally:
        with _lock:
            _spoken_for.discard(path)
