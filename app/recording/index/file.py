"""The file of an index: an SQLite file, written whole under another name and sealed by a checksum over all of it.

Whatever does not open, is of another schema or another recording, or fails its checksum is no index: it is made anew.
"""

from __future__ import annotations

import errno
import os
import sqlite3
import sys
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, Final
from uuid import uuid4

from app.errors import RecordingError
from app.recording.file_lock import lock_file
from app.recording.index.place import SCHEMA

PART_SUFFIX: Final = ".part"
_MOST: Final = (1 << 63) - 1
_SEAL_AT: Final = 60  # where an SQLite file keeps its user_version, which is free for whoever owns the file
_SEAL_SIZE: Final = 4
_READ_BYTES: Final = 1 << 20
_TABLES: Final = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE events (n INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, body TEXT NOT NULL);
CREATE TABLE noted (n INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, body TEXT NOT NULL);
CREATE TABLE signs (n INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, body TEXT NOT NULL);
CREATE TABLE gaps (n INTEGER PRIMARY KEY, from_ns INTEGER NOT NULL, body TEXT NOT NULL);
CREATE TABLE marks (n INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, body TEXT NOT NULL);
CREATE TABLE objects (n INTEGER PRIMARY KEY, body TEXT NOT NULL, breaks BLOB NOT NULL, history BLOB);
CREATE TABLE pages (signal INTEGER, level INTEGER, number INTEGER, count INTEGER, exact INTEGER, data BLOB);
CREATE TABLE load (bus TEXT, number INTEGER, data BLOB);
CREATE TABLE keyframes (t_ns INTEGER PRIMARY KEY, base_ns INTEGER NOT NULL, data BLOB NOT NULL);
"""
_INDEXES: Final = """
CREATE INDEX events_at ON events (t_ns);
CREATE INDEX noted_at ON noted (t_ns);
CREATE INDEX signs_at ON signs (t_ns);
CREATE UNIQUE INDEX pages_of ON pages (signal, level, number);
CREATE UNIQUE INDEX load_of ON load (bus, number);
"""
_TRIES: Final = 5
_RENAMES_OPEN: Final = sys.platform != "win32"
"""Whether a file that is open can be renamed and removed."""


class IndexWriter:
    """Writes an index under a name of its own; ``publish`` gives it its place.

    As a context manager it leaves nothing behind where that was not called. Raises RecordingError where the disk
    refuses.
    """

    def __init__(self, place: Path) -> None:
        self._place = place
        with _translated(place):
            place.parent.mkdir(parents=True, exist_ok=True)
            _sweep(place)
            self.part, self._lock = _part_of(place)
            self._database = sqlite3.connect(self.part, isolation_level=None)
            self._database.executescript("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA page_size=8192;")
            self._database.executescript(_TABLES)
            self._database.execute("BEGIN")

    def __enter__(self) -> IndexWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._database.close()
        self._lock.close()
        with suppress(OSError):
            self.part.unlink(missing_ok=True)

    def insert(self, table: str, rows: Iterable[tuple[Any, ...]]) -> None:
        """Rows with all columns of ``table``."""
        with _translated(self._place):
            for row in rows:
                marks = ",".join("?" * len(row))
                try:
                    self._database.execute(f"INSERT INTO {table} VALUES ({marks})", row)
                except OverflowError:  # a time of a damaged file, beyond the year 2262
                    self._database.execute(f"INSERT INTO {table} VALUES ({marks})", tuple(map(_within, row)))

    def publish(self, meta: dict[str, str]) -> None:
        """Finish the file and put it in its place, over what was there."""
        self.insert("meta", [*meta.items(), ("schema", str(SCHEMA))])
        with _translated(self._place):
            self._database.execute("COMMIT")
            self._database.executescript(_INDEXES)
            self._database.close()
            _seal(self.part)
            if not _RENAMES_OPEN:
                self._lock.close()
            self.part.replace(self._place)  # still locked where it can be: else who sweeps just now takes it away
            self._lock.close()


@contextmanager
def _translated(place: Path) -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        raise RecordingError(file=place.name, offset=0, reason=str(error)) from error
    except OSError as error:
        raise RecordingError(file=place.name, offset=0, reason=error.strerror or str(error)) from error


def _sweep(place: Path) -> None:
    """Remove what killed processes have left of the same index; what somebody is at work on is locked."""
    for left in place.parent.glob(f"{place.name}.*{PART_SUFFIX}"):
        with suppress(OSError):
            with left.open("r+b") as file:
                lock_file(file)
                if _RENAMES_OPEN:
                    left.unlink()
            left.unlink(missing_ok=True)


def _part_of(place: Path) -> tuple[Path, IO[bytes]]:
    """A new file that is locked. Who sweeps between its making and its lock may have it: then another one is made."""
    for left in reversed(range(_TRIES)):
        part = place.with_name(f"{place.name}.{uuid4().hex[:12]}{PART_SUFFIX}")
        file = part.open("xb")
        try:
            lock_file(file)
            if part.exists() or not left:
                return part, file
        except OSError:
            if not left:
                raise
        file.close()
    raise AssertionError  # the last try gives or raises


def _within(one: Any) -> Any:
    """The nearest that SQLite can hold."""
    return max(-_MOST - 1, min(_MOST, one)) if isinstance(one, int) else one


def _seal(path: Path) -> None:
    checksum = _checksum(path)
    with path.open("r+b") as file:
        file.seek(_SEAL_AT)
        file.write(checksum.to_bytes(_SEAL_SIZE, "big"))
        file.flush()
        os.fsync(file.fileno())


def _checksum(path: Path) -> int:
    """Of the whole file but the seal."""
    with path.open("rb") as file:
        checksum = zlib.crc32(file.read(_SEAL_AT + _SEAL_SIZE)[:_SEAL_AT])
        while data := file.read(_READ_BYTES):
            checksum = zlib.crc32(data, checksum)
    return checksum


def whole(path: Path) -> bool:
    """Whether the file is an index that is as it was published."""
    try:
        with path.open("rb") as file:
            head = file.read(_SEAL_AT + _SEAL_SIZE)
        sealed = int.from_bytes(head[_SEAL_AT:], "big")
        return len(head) == _SEAL_AT + _SEAL_SIZE and _checksum(path) == sealed
    except (OSError, ValueError):
        return False


def connect(path: Path) -> sqlite3.Connection:
    """Open to read, for any thread. Raises ``sqlite3.Error``."""
    return sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True, check_same_thread=False)


def refuses_files(error: RecordingError) -> bool:
    """Whether the folder takes no files, which another folder may."""
    cause = error.__cause__
    return isinstance(cause, OSError) and cause.errno in (errno.EACCES, errno.EPERM, errno.EROFS, errno.ENAMETOOLONG)
