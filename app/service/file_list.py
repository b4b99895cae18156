"""A folder of files as a list: each file is read once and again only when it changed, newest first, a while at a time.

What was not read yet is listed without its content, so that a large folder is shown at once and filled by the next
looks.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Final, Generic, TypeVar

BUDGET_S: Final = 0.25
"""So long one look may read files."""

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Listed(Generic[_T]):
    """One file. ``name`` is its path below the folder, with slashes; ``content`` None: not read yet."""

    name: str
    size_bytes: int
    modified_ns: int
    content: _T | None


class FileList(Generic[_T]):
    """The files of ``folder`` that fit ``pattern``, as ``read`` understands them. Safe from any thread.

    Names that end with ``but`` are left out.
    """

    def __init__(self, folder: Path, pattern: str, read: Callable[[Path], _T], but: str | None = None) -> None:
        self.folder = folder
        self._pattern = pattern
        self._but = but
        self._read = read
        self._lock = Lock()
        self._known: dict[str, tuple[int, int, _T]] = {}

    def look(self, budget_s: float = BUDGET_S) -> list[Listed[_T]]:
        """All files, the latest change first. At least one that is not known is read, more while the budget lasts."""
        with self._lock:
            until_s = time.monotonic() + budget_s
            found = sorted(self._stats(), key=lambda item: item[2], reverse=True)
            self._known = {name: self._known[name] for name, _, _ in found if name in self._known}
            read_one = False
            listed: list[Listed[_T]] = []
            for name, size, modified_ns in found:
                known = self._known.get(name)
                if known is None or known[:2] != (size, modified_ns):
                    if read_one and time.monotonic() >= until_s:
                        listed.append(Listed(name, size, modified_ns, None))
                        continue
                    read_one = True
                    known = self._known[name] = size, modified_ns, self._read(self.folder / name)
                listed.append(Listed(name, size, modified_ns, known[2]))
            return listed

    def path(self, name: str) -> Path | None:
        """The file of that name, or None where the list has none: names lead nowhere else."""
        return next((self.folder / known for known, _, _ in self._stats() if known == name), None)

    def of_size(self, size_bytes: int) -> list[Path]:
        """The files of exactly that size."""
        return [self.folder / name for name, size, _ in self._stats() if size == size_bytes]

    def _stats(self) -> list[tuple[str, int, int]]:
        found = []
        for path in self.folder.glob(self._pattern):
            if self._but is not None and path.name.endswith(self._but):
                continue
            try:
                stat = path.stat()
            except OSError:  # gone since
                continue
            if path.is_file() and not path.is_symlink():
                found.append((path.relative_to(self.folder).as_posix(), stat.st_size, stat.st_mtime_ns))
        return found
