"""The sealed record of a restore as a file: HTML, PDF or JSON, as its suffix says. Written whole or not at all."""

from __future__ import annotations

import argparse
import asyncio
import os
from pathlib import Path
from typing import Final

from app.cli.output import Output
from app.cli.restore_kept import desk_alone
from app.errors import HubsideError, RestoreRecordError, UsageError
from app.service.records.files import SealedRecord, html_file, pdf_file
from app.service.records.signing import SigningKey
from app.service.restore.desk import Desk

SUFFIXES: Final = (".html", ".pdf", ".json")


def check_target(path: Path) -> None:
    """Raises UsageError where no record can go there: seen before anything is done at the turbine."""
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(reason=f"--record-file: {path} ends with none of {', '.join(SUFFIXES)}")
    if not path.parent.is_dir():
        raise UsageError(reason=f"--record-file: there is no folder {path.parent}")
    if path.exists() or path.is_symlink():
        raise UsageError(reason=f"--record-file: {path} is there already, and is not written over")


async def write_record(desk: Desk, restore_id: str, path: Path, language: str) -> None:
    """Write the record of a restore that has ended. Raises RestoreUnknownError, RestoreRecordError, UsageError."""
    await desk.get(restore_id)
    sealed, key = await desk.record(restore_id), await asyncio.to_thread(desk.key)
    if sealed is None or key is None:
        raise RestoreRecordError(restore=restore_id)
    content = await asyncio.to_thread(_content, sealed, path.suffix.lower(), language, key)
    try:
        await asyncio.to_thread(_put, path, content)
    except OSError as error:
        again = f"the record is kept: hubside restore --record-of {restore_id} --record-file FILE"
        raise UsageError(reason=f"{path}: {error.strerror or error}; {again}") from error


async def try_record(desk: Desk, restore_id: str, path: Path | None, language: str) -> HubsideError | None:
    """As ``write_record``, where a file is named; gives what went wrong: the restore itself has ended as it has."""
    try:
        if path is not None:
            await write_record(desk, restore_id, path, language)
    except HubsideError as error:
        return error
    return None


async def earlier_record(arguments: argparse.Namespace, output: Output) -> int:
    """``--record-of ID``: of a restore that came to its end before. Needs no connection."""
    settings = arguments.settings
    async with desk_alone(settings) as desk:
        await write_record(desk, arguments.record_of, arguments.record_file, settings.language)
    details = {"restore": arguments.record_of, "file": str(arguments.record_file)}
    output.result(details, output.texts("cli.restore_record", **details))
    return 0


def _content(sealed: SealedRecord, suffix: str, language: str, key: SigningKey) -> bytes:
    if suffix == ".json":
        return sealed.json.encode()
    return (html_file if suffix == ".html" else pdf_file)(sealed, language, key)


def _put(path: Path, content: bytes) -> None:
    """Under another name first: whoever finds the file finds all of it."""
    part = path.with_name(f".{path.name}.part")
    try:
        with part.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            raise FileExistsError(0, "is there already, and is not written over", str(path))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
