"""``hubside audit``: read, verify and export the audit log. Works on the data folder while no server does."""

from __future__ import annotations

import argparse
import asyncio
import csv
import sys
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from app.cli.output import Output
from app.cli.users import opened
from app.errors import UsageError
from app.service.office.audit import AuditLog, text_key_of
from app.store.audit_chain import AuditRow, Head
from app.store.audit_rows import Filter, details_of

BROKEN: Final = 4
"""Exit code of a chain that is broken."""
Run = Callable[[argparse.Namespace, Output, AuditLog], Awaitable[int]]


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = commands.add_parser("audit", help="who did what, when, to which device")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")

    def action(name: str, run: Run, text: str) -> argparse.ArgumentParser:
        one = actions.add_parser(name, help=text)
        one.set_defaults(run=lambda arguments, output: asyncio.run(_with_audit(arguments, output, run)))
        return one

    def filtered(one: argparse.ArgumentParser) -> None:
        one.add_argument("--device", help="a device, or a station or turbine with all of its devices")
        one.add_argument("--kind", action="append", help="a kind of row; several may be named")
        one.add_argument("--person")
        one.add_argument("--text", help="looked for in all columns")

    shown = action("list", _list, "the latest rows, newest first")
    filtered(shown)
    shown.add_argument("--limit", type=int, default=50)
    shown.add_argument("--csv", action="store_true", help="as CSV")
    export = action("export", _export, "all rows as CSV, oldest first")
    filtered(export)
    export.add_argument("--csv", action="store_true", required=True, help="the form of the file")
    export.add_argument("--output", type=Path, help="the file to write; stdout where not given")
    action("head", _head, "the end of the chain: note it, and what came before cannot be rewritten unseen")
    verify = action("verify", _verify, "walk the whole chain and name the first row that is wrong")
    verify.add_argument("--head", metavar="SEQ:HASH", help="a head that was noted: the chain must hold it")


async def _with_audit(arguments: argparse.Namespace, output: Output, run: Run) -> int:
    async with opened(arguments) as (_store, audit):
        return await run(arguments, output, audit)


def _filter(arguments: argparse.Namespace) -> Filter:
    kinds = None if arguments.kind is None else tuple(arguments.kind)
    return Filter(device=arguments.device, kinds=kinds, person=arguments.person, text=arguments.text)


async def _list(arguments: argparse.Namespace, output: Output, audit: AuditLog) -> int:
    if not 1 <= arguments.limit <= 100_000:
        raise UsageError(reason="--limit is 1 to 100000")
    rows = await audit.latest(_filter(arguments), None, arguments.limit)
    if output.as_json:
        output.result([{**row.content, "details": details_of(row), "hash": row.hash} for row in rows], "")
    elif arguments.csv:
        writer = csv.writer(sys.stdout)
        writer.writerow(("seq", "time", "person", "device", "text"))
        writer.writerows(_line(row, output) for row in rows)
    else:
        output.table(("SEQ", "TIME", "PERSON", "DEVICE", "WHAT"), [_line(row, output) for row in rows])
    return 0


def _line(row: AuditRow, output: Output) -> tuple[str, ...]:
    time = datetime.fromtimestamp(row.t_ns / 1e9, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    text = output.texts(text_key_of(row.kind), address=row.address or "–", **details_of(row))
    return str(row.seq), time, row.person or "–", row.device or "–", text


async def _export(arguments: argparse.Namespace, output: Output, audit: AuditLog) -> int:
    if arguments.output is None:
        await audit.export(_filter(arguments), sys.stdout)
        return 0
    path: Path = arguments.output
    with path.open("x", encoding="utf-8", newline="") as file:
        count = await audit.export(_filter(arguments), file)
    output.result({"file": str(path), "rows": count}, output.texts("cli.audit_exported", file=path, count=count))
    return 0


async def _head(_arguments: argparse.Namespace, output: Output, audit: AuditLog) -> int:
    head, _verified = await audit.head()
    output.result({"seq": head.seq, "hash": head.hash}, output.texts("cli.audit_head", seq=head.seq, hash=head.hash))
    return 0


async def _verify(arguments: argparse.Namespace, output: Output, audit: AuditLog) -> int:
    done = await audit.verify(None if arguments.head is None else _noted(arguments.head))
    broken = done.broken
    data = {"good": broken is None, "rows": done.rows, "seq": done.head.seq, "hash": done.head.hash}
    if broken is None:
        output.result(data, output.texts("cli.audit_good", rows=done.rows, seq=done.head.seq, hash=done.head.hash))
        return 0
    breach = output.texts(broken.breach.text_key)
    text = output.texts("cli.audit_broken", seq=broken.seq, breach=breach, rows=done.rows)
    output.result(data | {"broken_seq": broken.seq, "breach": broken.breach.value}, text)
    return BROKEN


def _noted(text: str) -> Head:
    seq, _, digest = text.partition(":")
    if not (seq.isascii() and seq.isdecimal()) or len(digest) != 64:
        raise UsageError(reason=f"'{text}' is no head; 'hubside audit head' prints one")
    return Head(int(seq), digest.lower())
