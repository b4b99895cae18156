"""Set files of the data folder, taken into the library as they appear; a bad one is listed with line and reason."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.errors import SetFileError
from app.model.set_record import Source
from app.model.sets import ParameterSet, load_set
from app.service.library.library import Library
from app.store import set_rows
from app.store.set_rows import SetFileRow
from app.store.store import Store

BUDGET_S: Final = 0.5
"""So long one look may read files."""
LARGEST: Final = 8 * 1024 * 1024
PATTERN: Final = "*/*.json"


@dataclass(frozen=True, slots=True)
class Looked:
    """What a look found: files that are no sets, and how many are still to be read by the next look."""

    bad: tuple[SetFileRow, ...]
    waiting: int


class SetFolder:
    """The set files below ``folder``, one folder a turbine."""

    def __init__(self, folder: Path, store: Store, library: Library) -> None:
        self.folder = folder
        self._store = store
        self._library = library
        self._looking = asyncio.Lock()

    async def look(self, budget_s: float = BUDGET_S) -> Looked:
        """Take new and changed files into the library, at least one, more while the budget lasts. Raises StoreError."""
        async with self._looking:
            known = await self._store.run(set_rows.set_files)
            there = await asyncio.to_thread(lambda: dict(self._stats()))
            new = [name for name, stat in there.items() if name not in known or known[name].stat != stat]
            until_s = time.monotonic() + budget_s
            taken = 0
            for name in new:
                if taken and time.monotonic() >= until_s:
                    break
                await self._take(name, there[name])
                taken += 1
            gone = [name for name in known if name not in there]
            await self._store.run(lambda kept: set_rows.forget_files(kept, gone))
            rows = await self._store.run(set_rows.set_files)
            bad = tuple(row for row in rows.values() if row.reason is not None)
            return Looked(bad, len(new) - taken)

    async def _take(self, name: str, stat: tuple[int, int]) -> None:
        try:
            parameters = await asyncio.to_thread(open_set, self.folder / name)
        except SetFileError as error:
            bad = SetFileRow(name, *stat, None, int(error.details["line"]), str(error.details["reason"]))
            await self._store.run(lambda kept: set_rows.put_file(kept, bad))
            return

        def keep(kept: set_rows.Connection) -> None:
            record = self._library.put_in(kept, parameters, Source.FILE)
            set_rows.put_file(kept, SetFileRow(name, *stat, record.id))

        await self._store.run(keep)

    def _stats(self) -> Iterator[tuple[str, tuple[int, int]]]:
        for path in sorted(self.folder.glob(PATTERN)):
            try:
                stat = path.stat()
            except OSError:  # gone since
                continue
            if path.is_file() and not path.is_symlink():
                yield path.relative_to(self.folder).as_posix(), (stat.st_size, stat.st_mtime_ns)


def open_set(path: Path) -> ParameterSet:
    """One set file. Raises SetFileError."""
    try:
        if path.stat().st_size > LARGEST:
            raise SetFileError(file=path.name, line=1, reason=f"is larger than {LARGEST >> 20} MiB")
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise SetFileError(file=path.name, line=line, reason="bytes that are no UTF-8") from error
    except OSError as error:
        raise SetFileError(file=path.name, line=1, reason=error.strerror or str(error)) from error
    return load_set(text, path.name)
