"""``hubside store``: check, back up and restore the store. Works on the data folder while no server does."""

from __future__ import annotations

import argparse
import asyncio
from datetime import UTC, datetime
from pathlib import Path

from app.cli.output import Output
from app.cli.users import opened
from app.store import audit_rows, database, user_rows, visit_rows
from app.store.lock import FolderLock
from app.store.migrations import SCHEMA


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = commands.add_parser("store", help="the file that keeps users, visits and the audit log")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    check = actions.add_parser("check", help="look for damage; a file of an earlier version is brought up to date")
    check.set_defaults(run=lambda arguments, output: asyncio.run(_check(arguments, output)))
    backup = actions.add_parser("backup", help="write a whole copy")
    backup.add_argument("file", type=Path)
    backup.set_defaults(run=lambda arguments, output: asyncio.run(_backup(arguments, output)))
    restore = actions.add_parser("restore", help="put a copy in the store's place; what was there is kept")
    restore.add_argument("file", type=Path)
    restore.set_defaults(run=_restore)


async def _check(arguments: argparse.Namespace, output: Output) -> int:
    async with opened(arguments) as (store, _audit):
        details = {
            "file": store.file,
            "schema": SCHEMA,
            "users": len(await store.run(user_rows.all_users)),
            "visits": len(await store.run(lambda kept: visit_rows.list_visits(kept, None, 1_000_000))),
            "rows": (await store.run(audit_rows.head)).seq,
        }
        output.result(details, output.texts("cli.store_good", **details))
    return 0


async def _backup(arguments: argparse.Namespace, output: Output) -> int:
    async with opened(arguments) as (store, _audit):
        await store.back_up(arguments.file)
    output.result({"file": str(arguments.file)}, output.texts("cli.store_backed_up", file=arguments.file))
    return 0


def _restore(arguments: argparse.Namespace, output: Output) -> int:
    folder: Path = arguments.settings.data
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / database.FILE
    lock = FolderLock(folder / database.LOCK, path)
    try:
        aside = path.with_name(f"{path.stem}.before-{datetime.now(UTC):%Y%m%dT%H%M%S%f}{path.suffix}")
        kept = database.restore(path, arguments.file, aside)
    finally:
        lock.release()
    details = {"file": str(arguments.file), "aside": str(aside) if kept else "–"}
    output.result(details, output.texts("cli.store_restored", **details))
    return 0
