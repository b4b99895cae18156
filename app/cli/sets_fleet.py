"""``hubside sets fleet``: golden sets against the latest set of every device; ``sets parity``: blades side by side."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import replace
from pathlib import Path
from typing import Final

from app.cli.compared import compared_json, matters, tell_text
from app.cli.connecting import connected, run_command
from app.cli.output import Output
from app.cli.sets_diff import DIFFERENT, kept, read_whole, sites_of
from app.cli.targets import add_connection, site_turbine
from app.cli.users import opened
from app.errors import UsageError
from app.model.set_record import Tag
from app.model.sets import iso_time
from app.model.site import Turbine
from app.service.compare.fleet import compare_fleet
from app.service.compare.fleet_report import ParameterCount, Report, Standing, fleet_csv, fleet_json, report_of
from app.service.compare.ground import Ground
from app.service.compare.parity import Part, compare_blades
from app.service.compare.sources import Columns
from app.service.compare.spec import ColumnKind, ColumnSpec
from app.service.compare.wording import Words
from app.service.library.folder import SetFolder
from app.service.library.library import Library
from app.service.office.visits import Visits
from app.store.set_rows import Filter

MOST: Final = 20
LOOK_S: Final = 60.0
"""So long the set files of the data folder may be looked through."""
Table = tuple[Sequence[str], Sequence[Sequence[str]]]
_KINDS: Final = (ColumnKind.LIVE, ColumnKind.STORED, ColumnKind.FOUND, ColumnKind.LEFT, ColumnKind.DELIVERED)
_OF_BUS: Final = (ColumnKind.LIVE, ColumnKind.STORED)


def add_actions(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the actions."""
    fleet = actions.add_parser(
        "fleet",
        help="a golden set against the latest set of every device: who stands out",
        description=(
            "GOLDEN is a kind of device (oat-pmc: its golden set), a set of the library, or any COLUMN of 'sets diff' "
            "that needs no connection; every golden set where none is named."
        ),
    )
    fleet.add_argument("golden", nargs="?", metavar="GOLDEN")
    fleet.add_argument("--format", choices=("text", "csv", "json"), default="text")
    fleet.add_argument("--limit", type=_count, default=MOST, metavar="N", help=f"rows of each table ({MOST}); 0: all")
    fleet.set_defaults(run=lambda arguments, output: run_command(_fleet(arguments, output)))
    parity = actions.add_parser(
        "parity",
        help="the blades of a turbine side by side",
        description=(
            "Each kind of device by itself, a column a blade. Exit code 0 where nothing differs but what is bound to "
            "the unit, 1 where something does. Blades are known from the site file."
        ),
    )
    parity.add_argument("of", nargs="?", metavar="TURBINE", help="which turbine of the site file")
    parity.add_argument("--kind", choices=[one.value for one in _KINDS], default="live", help="what is compared")
    parity.add_argument("--same", action="store_true", help="the rows that match, too")
    parity.add_argument("--all", action="store_true", help="process values, too")
    add_connection(parity, required=False)
    parity.set_defaults(run=lambda arguments, output: run_command(_parity(arguments, output)))


def _count(text: str) -> int:
    if not text.isascii() or not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is no number of rows")
    return int(text)


# -- the fleet -----------------------------------------------------------------------


async def _fleet(arguments: argparse.Namespace, output: Output) -> int:
    async with opened(arguments) as (store, audit):
        library = Library(store, audit, time.time_ns)
        await SetFolder(arguments.settings.sets, store, library).look(LOOK_S)
        visits = Visits(store, audit, time.time_ns, library)
        columns = Columns(Ground(time.time_ns, library=library, visits=visits, files=True))
        specs = [_golden(arguments.golden)] if arguments.golden else await _all_golden(library)
        reports = [report_of(await compare_fleet(columns, store, str(spec))) for spec in specs]
    if output.as_json or arguments.format == "json":
        output.raw(json.dumps([fleet_json(one) for one in reports], ensure_ascii=False, indent=1) + "\n")
    elif arguments.format == "csv":
        output.raw(fleet_csv(reports))
    else:
        for report in reports:
            _tell_fleet(report, arguments.limit or None, output)
    return 0


def _golden(text: str) -> ColumnSpec:
    """What the others are held against; a kind of device is known by what a set's id never is."""
    kind, colon, of = text.partition(":")
    known = next((one for one in ColumnKind if one.value == kind), None)
    if known in (*_OF_BUS, ColumnKind.EDITOR):
        raise UsageError(reason=f"'{text}': a fleet is held against a set that is kept, or a file")
    if colon and known is not None:
        return ColumnSpec(known, of)
    if Path(text).is_file():
        return ColumnSpec(ColumnKind.FILE, text)
    digits = text.removeprefix("sha256:").replace("-", "").lower()
    return ColumnSpec(ColumnKind.SET if set(digits) <= set("0123456789abcdef") else ColumnKind.GOLDEN, text)


async def _all_golden(library: Library) -> list[ColumnSpec]:
    """One of each kind of device. Raises UsageError where there is none."""
    records = await library.records(Filter(tag=Tag.GOLDEN))
    kinds = sorted({one.description_id for one in records})
    if not kinds:
        raise UsageError(reason="no set is golden: name a set, or 'hubside sets tag SET golden'")
    return [ColumnSpec(ColumnKind.GOLDEN, kind) for kind in kinds]


def _tell_fleet(report: Report, limit: int | None, output: Output) -> None:
    words, golden = Words(output.texts), report.fleet.golden
    output.line(f"{words.title(golden)}: {', '.join(words.circumstances(golden))}")
    counts = {"total": len(report.standings), "equal": report.equal, "foreign": len(report.fleet.foreign)}
    output.line(output.texts("cli.fleet.sum", turbines=len(report.turbines), **counts))
    tables = _tables(report, words, output)
    for head, rows in tables:
        output.line("")
        output.table(head, rows[:limit])
    most = max((len(rows) for _head, rows in tables), default=0)
    if limit is not None and most > limit:
        output.say("cli.fleet.more", limit=limit, most=most)
    for one in report.fleet.foreign[:limit]:
        output.say("cli.fleet.foreign", device=one.device, version=one.version)


def _tables(report: Report, words: Words, output: Output) -> list[Table]:
    """Devices, turbines and parameters that stand out; none where all are as the golden set."""
    turbines = [
        (one.turbine, str(one.devices), str(one.unlike), str(one.different), str(one.missing))
        for one in report.turbines
        if one.unlike
    ]
    parameters = [_parameter(one, output) for one in report.parameters if one.different or one.missing]
    tables: list[Table] = [
        (
            ("RANK", "DEVICE", "TIME", "DIFFERENT", "MISSING", "UNIT", "MOST IN"),
            [_standing(one, words) for one in report.standings if not one.equal],
        ),
        (("TURBINE", "DEVICES", "UNLIKE", "DIFFERENT", "MISSING"), turbines),
        (("ADDRESS", "NAME", "DIFFERENT", "MISSING"), parameters),
    ]
    return [(head, rows) for head, rows in tables if rows]


def _standing(one: Standing, words: Words) -> Sequence[str]:
    most = sorted((count, name) for name, count in one.by_group.items() if count)[::-1][:3]
    groups = ", ".join(f"{words.group_name(name)} {count}" for count, name in most)
    counts = (str(one.different), str(one.missing), str(one.unit))
    return (str(one.rank), one.member.device, iso_time(one.member.t_ns)[:10], *counts, groups or "–")


def _parameter(one: ParameterCount, output: Output) -> Sequence[str]:
    entry = one.entry
    return entry.address.short, output.texts.name(entry.title), str(one.different), str(one.missing)


# -- the blades ----------------------------------------------------------------------


async def _parity(arguments: argparse.Namespace, output: Output) -> int:
    if arguments.site is None:
        raise UsageError(reason="parity needs to know which device is at which blade: name the site file with --site")
    arguments.turbine = arguments.of or arguments.turbine
    kind = ColumnKind(arguments.kind)
    async with AsyncExitStack() as stack:
        turbine, ground = await stack.enter_async_context(_ground(arguments, output, kind))
        parts = await compare_blades(Columns(ground), turbine, kind, arguments.all)
    if not parts:
        raise UsageError(reason=f"{turbine.slug}: fewer than two blades have such columns ({kind.value})")
    words = Words(output.texts)
    if output.as_json:
        output.result({"turbine": turbine.slug, "parts": [_part(one, words, arguments.same) for one in parts]}, "")
    else:
        for one in parts:
            output.line(f"{turbine.slug}: {one.name}")
            tell_text(output, one.compared, words, arguments.same)
            for blade in one.without:
                output.say("cli.parity_without", blade=blade, name=one.name)
    return DIFFERENT if any(matters(one.compared) for one in parts) else 0


@asynccontextmanager
async def _ground(
    arguments: argparse.Namespace, output: Output, kind: ColumnKind
) -> AsyncIterator[tuple[Turbine, Ground]]:
    """The turbine, and what its columns need."""
    ground = Ground(time.time_ns, sites=sites_of(arguments, output))
    if kind not in _OF_BUS:
        turbine = site_turbine(arguments)
        assert turbine is not None  # the site file is named
        async with kept(arguments) as (library, visits):
            yield turbine, replace(ground, library=library, visits=visits)
        return
    async with connected(arguments, output) as connection:
        wanted = {target.slug for target in connection.targets}
        read = await read_whole(arguments, output, connection, wanted)
        yield connection.turbine, replace(ground, targets=tuple(connection.targets), read=read)


def _part(part: Part, words: Words, same: bool) -> dict[str, object]:
    return {
        "description": part.description_id,
        "blades": list(part.blades),
        "without": list(part.without),
        **compared_json(part.compared, words, same),
    }
