"""A lock on a recording that is being written. The system drops it when its process ends, in whatever way."""

from __future__ import annotations

import os
import sys
from typing import IO

if sys.platform == "win32":
    import msvcrt

    _FAR = 1 << 62  # a byte that no recording reaches: on Windows a locked byte cannot be read by others

    def lock_file(file: IO[bytes]) -> None:
        """Locks an open file. Raises ``OSError`` where another process holds the lock."""
        position = file.tell()
        file.seek(_FAR)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        finally:
            file.seek(position, os.SEEK_SET)

else:
    import fcntl

    def lock_file(file: IO[bytes]) -> None:
        """Locks an open file. Raises ``OSError`` where another process or open file holds the lock."""
        fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
