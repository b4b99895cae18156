"""One process a data folder: a lock beside the store, which the system drops when its process ends in whatever way.

The lock has a file of its own because closing any handle of the database would drop SQLite's own locks on it.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import IO

from app.errors import StoreInUseError

if sys.platform == "win32":
    import msvcrt

    def _lock(file: IO[bytes]) -> None:
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(file: IO[bytes]) -> None:
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)


class FolderLock:
    """Held from its making until ``release``. Raises StoreInUseError where another process holds it."""

    def __init__(self, path: Path, store: Path) -> None:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        self._file = os.fdopen(descriptor, "r+b")
        try:
            _lock(self._file)
        except OSError as error:
            self._file.close()
            raise StoreInUseError(file=str(store)) from error

    def release(self) -> None:
        """Let another process have the folder."""
        self._file.close()
