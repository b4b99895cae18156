"""``hubside sets diff``: any columns side by side, as text, CSV, HTML or JSON."""

from __future__ import annotations

import argparse
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from app.cli.compared import compared_json, matters, tell_text
from app.cli.connecting import connected, run_command, sheets_of
from app.cli.output import Output
from app.cli.targets import add_connection, descriptions_for, is_connected
from app.cli.users import opened
from app.errors import UsageError
from app.model.sets import ParameterSet
from app.model.site import load_site
from app.service.backup import read_devices, to_set
from app.service.compare.comparison import Compared, compare_columns
from app.service.compare.export import to_csv, to_html
from app.service.compare.ground import Ground
from app.service.compare.sources import Columns
from app.service.compare.spec import ColumnKind, ColumnSpec, Unresolved, parse_spec
from app.service.compare.wording import Words
from app.service.connection import Connection
from app.service.library.library import Library
from app.service.office.visits import Visits
from app.service.sites import Sites

DIFFERENT: Final = 1
"""Exit code where a value differs that must not, is missing, or cannot be compared; as ``diff`` has it."""
MOST: Final = 12
_BUS: Final = (ColumnKind.LIVE, ColumnKind.STORED)
_STORE: Final = (
    ColumnKind.SET,
    ColumnKind.GOLDEN,
    ColumnKind.DELIVERED,
    ColumnKind.FOUND,
    ColumnKind.LEFT,
    ColumnKind.YEAR,
)


def add_actions(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the action."""
    diff = actions.add_parser(
        "diff",
        help="what differs between devices, sets and files",
        description=(
            "A COLUMN is a set file, or one of file:PATH, set:ID, live:TARGET, stored:TARGET, default:DEVICE, "
            "golden:DEVICE, delivered:DEVICE, found:DEVICE, left:DEVICE, year:DEVICE. TARGET is TURBINE/STATION/DEVICE "
            "or a node number, and needs --site, --can, --modbus or --profibus. Exit code 0 where nothing differs "
            "but what is bound to the unit, 1 where something does."
        ),
    )
    diff.add_argument("columns", nargs="+", metavar="COLUMN")
    form = diff.add_mutually_exclusive_group()
    form.add_argument("--csv", action="store_true", help="CSV on stdout")
    form.add_argument("--html", type=Path, metavar="FILE", help="write HTML, to read and print; - is stdout")
    diff.add_argument("--same", action="store_true", help="the rows that match, too")
    diff.add_argument("--all", action="store_true", help="process values, too")
    add_connection(diff, required=False)
    diff.set_defaults(run=lambda arguments, output: run_command(_diff(arguments, output)))


async def _diff(arguments: argparse.Namespace, output: Output) -> int:
    specs = [_spec(text) for text in arguments.columns]
    if not 2 <= len(specs) <= MOST:
        raise UsageError(reason=f"name 2 to {MOST} columns")
    async with AsyncExitStack() as stack:
        ground, specs = await _ground(arguments, output, specs, stack)
        compared = await compare_columns(Columns(ground), [str(one) for one in specs], everything=arguments.all)
    _tell(arguments, output, compared)
    return DIFFERENT if matters(compared) else 0


def _spec(text: str) -> ColumnSpec:
    """A column; the plain name of a file is one too. Raises ColumnError."""
    kinds = {kind.value for kind in ColumnKind}
    if text.partition(":")[0] not in kinds and Path(text).is_file():
        return ColumnSpec(ColumnKind.FILE, text)
    spec = parse_spec(text)
    if spec.kind is ColumnKind.EDITOR:  # it would be plain RAM: what is typed there is in somebody's browser
        raise Unresolved.NO_EDITOR.error(text)
    return spec


async def _ground(
    arguments: argparse.Namespace, output: Output, specs: Sequence[ColumnSpec], stack: AsyncExitStack
) -> tuple[Ground, list[ColumnSpec]]:
    """What the columns need is opened, and nothing else; the specs name devices by their slugs then."""
    ground = Ground(time.time_ns, sites=sites_of(arguments, output), files=True)
    if any(one.kind in _STORE for one in specs):
        library, visits = await stack.enter_async_context(kept(arguments))
        ground = replace(ground, library=library, visits=visits)
    if any(one.kind in _BUS for one in specs):
        if not is_connected(arguments):
            raise UsageError(reason="live and stored columns need a connection (--site, --can, --modbus or --profibus)")
        arguments.target = [one.of for one in specs if one.kind in _BUS]
        connection = await stack.enter_async_context(connected(arguments, output))
        specs = [_by_slug(one, connection) for one in specs]
        wanted = {one.of for one in specs if one.kind in _BUS}
        read = await read_whole(arguments, output, connection, wanted)
        ground = replace(ground, targets=tuple(connection.targets), read=read)
    return ground, list(specs)


def sites_of(arguments: argparse.Namespace, output: Output) -> Sites | None:
    """The turbines of the site file, where one is named. Raises SiteError, DescriptionError."""
    if arguments.site is None:
        return None
    sheets = sheets_of(arguments, output)
    return Sites(load_site(arguments.site), lambda one: descriptions_for(sheets, one, arguments.site), arguments.site)


@asynccontextmanager
async def kept(arguments: argparse.Namespace) -> AsyncIterator[tuple[Library, Visits]]:
    """The library of the data folder. Raises StoreInUseError while a server has it, StoreError."""
    async with opened(arguments) as (store, audit):
        library = Library(store, audit, time.time_ns)
        yield library, Visits(store, audit, time.time_ns, library)


def _by_slug(spec: ColumnSpec, connection: Connection) -> ColumnSpec:
    """Devices may be named by their node's number."""
    device = connection.turbine.device(spec.of) if spec.kind.of_device else None
    return spec if device is None else ColumnSpec(spec.kind, device.slug)


async def read_whole(
    arguments: argparse.Namespace, output: Output, connection: Connection, wanted: set[str]
) -> dict[str, ParameterSet]:
    """Read the devices completely, as a backup does. Raises BusLostError, NoAnswerError."""
    pairs = [(connection.driver(target), target) for target in connection.targets if target.slug in wanted]
    reports = await read_devices(
        pairs, lambda one, done, total: output.progress("cli.reading", device=one.slug, done=done, total=total)
    )
    turbine, person = connection.turbine.slug, arguments.settings.person
    for report in reports:
        if not report.values and report.failed:
            raise next(iter(report.failed.values()))
    return {one.target.slug: to_set(one, turbine, person, "", time.time_ns()) for one in reports}


# -- what is told ---------------------------------------------------------------------


def _tell(arguments: argparse.Namespace, output: Output, compared: Compared) -> None:
    words = Words(output.texts)
    if output.as_json:
        output.result(compared_json(compared, words, arguments.same), "")
    elif arguments.csv:
        output.raw(to_csv(compared, output.texts, arguments.same))
    elif arguments.html is not None and str(arguments.html) == "-":
        output.raw(to_html(compared, output.texts, arguments.same))
    elif arguments.html is not None:
        arguments.html.write_text(to_html(compared, output.texts, arguments.same), encoding="utf-8")
        output.line(words.sentence(compared.comparison.summary))
    else:
        tell_text(output, compared, words, arguments.same)
