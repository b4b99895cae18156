"""``hubside backup``: read devices completely, and keep what was read: as set files, and in the library."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from app.cli.bus import exit_code, say_unread, target_of
from app.cli.connecting import connected, run_command
from app.cli.output import Output
from app.cli.targets import add_connection, find_device, site_turbine
from app.errors import StoreError, StoreInUseError, UsageError
from app.model.sets import ParameterSet
from app.service.backup import ReadReport, read_devices, whole_sets, write_set
from app.service.devices import Target


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("backup", help="read devices completely and write set files")
    add_connection(parser)
    parser.add_argument("target", nargs="*", help="devices; all of them where none is named")
    parser.add_argument("--reason", default="", help="why, kept in the set")
    parser.add_argument("--work-order", default="", help="kept in the set")
    parser.add_argument(
        "--nameplate",
        action="append",
        default=[],
        metavar="DEVICE=SERIAL",
        help="the serial number on the plate of a device that tells none; a terminal asks for it once more, "
        "elsewhere give the option twice",
    )
    parser.set_defaults(run=lambda arguments, output: run_command(_backup(arguments, output)))


async def _backup(arguments: argparse.Namespace, output: Output) -> int:
    settings = arguments.settings
    plated = await _keep_plates(arguments, output)
    async with connected(arguments, output) as connection:
        targets = [target_of(connection, one) for one in arguments.target] or list(connection.targets)
        if not targets:
            raise UsageError(reason="no device with a known description was found")
        started = time.monotonic()
        reports = await read_devices(
            [(connection.driver(target), target) for target in targets],
            lambda one, done, total: output.progress("cli.reading", device=one.slug, done=done, total=total),
        )
        took = f"{time.monotonic() - started:.2f}"
    slug, now_ns = connection.turbine.slug, time.time_ns()
    sets = whole_sets(reports, slug, settings.person, arguments.reason, now_ns, arguments.work_order)
    kept, code = await _keep(arguments, output, sets)
    by_device = {one.origin.device: one for one in kept}
    for report in reports:
        found = by_device.get(report.target.slug)
        code = max(code, exit_code(report.errors))
        _tell(output, report, found, settings.sets / slug, took)
    if arguments.site is not None:
        _tell_plates(output, kept, plated)
    return code


# -- nameplates ----------------------------------------------------------------------


async def _keep_plates(arguments: argparse.Namespace, output: Output) -> set[str]:
    """Keep what was typed, before anything is sent; gives the devices.

    Raises UsageError, NameplateError, StoreError.
    """
    if not arguments.nameplate:
        return set()
    turbine = site_turbine(arguments)
    if turbine is None:
        raise UsageError(reason="--nameplate is kept by the device's name: name it by a site file (--site)")
    typed: dict[str, list[str]] = {}
    for text in arguments.nameplate:
        name, equals, serial = text.partition("=")
        if not equals:
            raise UsageError(reason=f"--nameplate: '{text}' is not DEVICE=SERIAL")
        typed.setdefault(find_device(turbine, name.strip()).slug, []).append(serial)
    pairs = {slug: _twice(slug, entries, output) for slug, entries in typed.items()}
    # Late: a backup without plates sends first, and need not wait for the store's libraries.
    from app.cli.users import opened
    from app.service.library.library import Library

    async with opened(arguments) as (store, audit):
        library = Library(store, audit, time.time_ns)
        for slug, (first, second) in pairs.items():
            await library.set_nameplate(slug, first, second, arguments.settings.person)
    return set(pairs)


def _twice(slug: str, entries: list[str], output: Output) -> tuple[str, str]:
    """The two entries of one plate; the second is asked for at a terminal. Raises UsageError."""
    if len(entries) == 1 and sys.stdin is not None and sys.stdin.isatty():
        output.say("cli.backup.plate_again", device=slug)
        entries = [*entries, sys.stdin.readline().rstrip("\r\n")]
    if len(entries) != 2:
        raise UsageError(reason=f"--nameplate: type the serial number of {slug} twice, by giving the option twice")
    return entries[0], entries[1]


def _tell_plates(output: Output, sets: Iterable[ParameterSet], plated: set[str]) -> None:
    """Devices that nothing identifies, and plates that were typed although the device tells its number."""
    for one in sets:
        slug, identity = one.origin.device, one.identity
        if identity.mark is not None and slug in plated:
            output.say("cli.backup.plate_needless", device=slug, serial=identity.mark)
    nameless = [one.origin.device for one in sets if one.identity.mark is None and one.identity.nameplate is None]
    if nameless:
        output.say("cli.backup.no_serial", devices=", ".join(nameless), first=nameless[0])


# -- keeping -------------------------------------------------------------------------


async def _keep(
    arguments: argparse.Namespace, output: Output, sets: list[ParameterSet]
) -> tuple[list[ParameterSet], int]:
    """The sets with their nameplates, kept in the library; the exit code. A store that fails loses no reading."""
    from app.cli.users import opened
    from app.model.set_record import Source
    from app.service.library.library import Library, with_plate
    from app.store.database import FILE
    from app.store.set_rows import peek_nameplates

    folder: Path = arguments.settings.data
    try:
        try:
            async with opened(arguments) as (store, audit):
                library = Library(store, audit, time.time_ns)
                found = [library.identified(one) for one in sets]
                await library.put(found, Source.BACKUP)
                return found, 0
        except StoreInUseError:  # a server has it, and takes the files into its library as they appear
            plates = peek_nameplates(folder / FILE)
            return [with_plate(one, plates.get(one.origin.device)) for one in sets], 0
    except StoreError as error:
        output.error(error)
        return sets, error.exit_code


def _tell(output: Output, report: ReadReport, found: ParameterSet | None, folder: Path, took: str) -> None:
    """Write the set of one device, and say so; or why there is none."""
    target = report.target
    if found is None:
        output.error(report.lost or next(iter(report.failed.values())))
        output.say("cli.no_set", device=target.slug)
        return
    path = write_set(folder, found)
    say_unread(report, output)
    details = _details(target, path, report, found)
    output.result(details, output.texts("cli.set_written", **{**details, "hash": found.hash[:12]}))
    output.say("cli.read_done", device=target.slug, count=len(report.values), took_s=took)


def _details(target: Target, path: Path, report: ReadReport, found: ParameterSet) -> Mapping[str, Any]:
    return {
        "device": target.slug,
        "file": str(path),
        "count": len(report.values),
        "unread": len(report.errors),
        "hash": found.hash,
        "serial": found.identity.serial,
        "drive_serial": found.identity.drive_serial,
        "nameplate": found.identity.nameplate,
        "work_order": found.origin.work_order,
    }
