"""Bytes of a file for who holds it for long."""

from __future__ import annotations

from pathlib import Path
from threading import Lock


class FileBytes:
    """The bytes of an open file, read where they are wanted, for who holds a file for long.

    A mapped file that is cut by somebody else ends the process that looks behind its new end; here bytes are missing,
    and what they belong to is damaged. Raises ``OSError``.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("rb")
        self._lock = Lock()
        self._size = path.stat().st_size

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, part: slice) -> bytes:
        start, stop, _ = part.indices(self._size)
        with self._lock:
            self._file.seek(start)
            return self._file.read(max(0, stop - start))

    def close(self) -> None:
        """Close the file. May be called twice."""
        self._file.close()
