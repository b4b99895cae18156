"""``hubside restore``: put sets into a station as one transaction; resume, roll back, list or prove what was begun."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import signal
import sys
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Final

from app.cli.arguments import seconds
from app.cli.connecting import connected, run_command
from app.cli.output import Output
from app.cli.restore_kept import give_up, list_restores
from app.cli.restore_record import check_target, earlier_record, try_record
from app.cli.restore_told import Told
from app.cli.targets import add_connection, is_connected
from app.errors import RestoreRefusedError, RestoreStateError, SetFileError, UsageError
from app.model.address import parse_address
from app.model.sets import ParameterSet, load_set
from app.model.station import Place
from app.service.connection import Connection
from app.service.gate import BARE_TURBINE
from app.service.office.office import Office
from app.service.restore.assign import assign
from app.service.restore.desk import Desk
from app.service.restore.motor_given import given_motor, is_motor
from app.service.restore.order import Given, Order
from app.service.restore.survey import targets_of
from app.service.restore.transaction import End
from app.store.restore_rows import RestoreState
from app.store.store import Store

CONFIRM_S: Final = 300.0
LEAST_CONFIRM_S: Final = 5.0
LOOK_S: Final = 0.1
BARE_STATION: Final = f"{BARE_TURBINE}/nodes"


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("restore", help="put parameter sets into a station: planned, written, saved, proven")
    add_connection(parser, required=False)
    parser.add_argument("set", nargs="*", help="set files, or ids or hashes of sets in the library; one a device")
    parser.add_argument("--station", help="TURBINE/STATION; that of the sets where not given")
    add_terms(parser)
    way = parser.add_mutually_exclusive_group()
    way.add_argument("--resume", nargs="?", const="", metavar="ID", help="go on with one that is incomplete")
    way.add_argument("--roll-back", nargs="?", const="", metavar="ID", help="take back one that is incomplete")
    way.add_argument("--give-up", metavar="ID", help="with --expert and --reason: close one whose device is gone")
    way.add_argument("--list", action="store_true", help="restores of the data folder, newest first")
    way.add_argument("--record-of", metavar="ID", help="write the record of one that has ended to --record-file")
    parser.set_defaults(run=restore)


def add_terms(parser: argparse.ArgumentParser) -> None:
    """What a person says of a restore besides the sets."""
    parser.add_argument("--plan", action="store_true", help="show what would be done, and do nothing")
    parser.add_argument("--select", metavar="ADDRESS,…", help="these objects only: 6065, pmm/3110:01")
    parser.add_argument("--restart", action="store_true", help="agree to restart the devices, which proves the result")
    parser.add_argument("--yes", action="store_true", help="confirmed in advance: save as soon as all is written")
    parser.add_argument(
        "--confirm-within", type=seconds, default=CONFIRM_S, metavar="S", help="else all is rolled back after so long"
    )
    parser.add_argument("--reason", default="", help="why, kept in the record")
    parser.add_argument("--work-order", default="", help="kept in the record")
    parser.add_argument(
        "--record-file", type=Path, metavar="FILE", help="write the sealed record there: .html, .pdf or .json"
    )
    parser.add_argument(
        "--network", action="store_true", help="the network address goes along too; the device is elsewhere then"
    )
    parser.add_argument("--expert", action="store_true", help="also restore what only the maker sets")
    parser.add_argument(
        "--other-blades-confirmed", action="store_true", help="with --expert: the other blades need not be in feather"
    )
    parser.add_argument(
        "--accept", action="append", default=[], metavar="RULE", help="with --expert: this rule may stay broken"
    )


def restore(arguments: argparse.Namespace, output: Output) -> int:
    """Do what the arguments say; gives the exit code."""
    _check(arguments)
    if arguments.list:
        return run_command(list_restores(arguments, output))
    if arguments.record_of is not None:
        return run_command(earlier_record(arguments, output))
    if arguments.give_up is not None:
        return run_command(give_up(arguments, output))
    decided = arguments.resume is not None or arguments.roll_back is not None
    return run_command((_decide if decided else _restore)(arguments, output))


def _check(arguments: argparse.Namespace) -> None:
    """Raises UsageError where the arguments do not go together."""
    decided = arguments.resume is not None or arguments.roll_back is not None
    alone = arguments.list or arguments.record_of is not None or arguments.give_up is not None
    if alone or decided:
        if arguments.set:
            raise UsageError(
                reason="sets are for a new restore, not for --list, --record-of, --give-up, --resume or --roll-back"
            )
    elif not arguments.set:
        raise UsageError(reason="name the sets to restore: files, or ids of the library")
    if not alone and not is_connected(arguments):
        raise UsageError(
            reason="name the bus: --site FILE, --can INTERFACE:CHANNEL, --modbus HOST:PORT or --profibus PORT@BITRATE"
        )
    _check_terms(arguments)


def _check_terms(arguments: argparse.Namespace) -> None:
    """What a person says of a restore besides the sets."""
    if arguments.confirm_within < LEAST_CONFIRM_S:
        raise UsageError(reason=f"--confirm-within: nobody decides in less than {LEAST_CONFIRM_S:g} s")
    if (arguments.other_blades_confirmed or arguments.accept) and not arguments.expert:
        raise UsageError(reason="--other-blades-confirmed and --accept are for experts: add --expert")
    if arguments.record_file is not None:
        if arguments.plan or arguments.list:
            raise UsageError(reason="--record-file: --plan and --list make no record")
        check_target(arguments.record_file)
    elif arguments.record_of is not None:
        raise UsageError(reason="--record-of: name the file with --record-file FILE")
    if arguments.give_up is not None and not (arguments.expert and arguments.reason.strip()):
        raise UsageError(reason="--give-up leaves a station as it is, half old and half new: add --expert and --reason")


# -- restore -------------------------------------------------------------------------


@asynccontextmanager
async def _desk(arguments: argparse.Namespace, output: Output) -> AsyncIterator[tuple[Desk, Connection, Office]]:
    """The store first: nothing is sent where another process has it. What is done is recorded."""
    store = Store.open(arguments.settings.data)
    try:
        async with connected(arguments, output, True) as connection:
            person = arguments.settings.person
            office = Office(store, connection.journal, connection.stamper, person)
            for entry in connection.journal.latest():
                office.audit.take(entry)
            desk = Desk(office, connection.journal, connection.stamper, data=arguments.settings.data)
            connection.gate.blocks = desk.blocks
            try:
                yield desk, connection, office
            finally:
                await desk.close()
                await office.close()
    finally:
        store.close()


async def _restore(arguments: argparse.Namespace, output: Output) -> int:
    with Told(output) as told:
        async with _desk(arguments, output) as (desk, connection, office):
            order = await _order(arguments, connection, office)
            prepared = await desk.prepare(
                connection,
                order,
                lambda done, total: output.progress("cli.reading", device=order.station, done=done, total=total),
            )
            told.plan(prepared)
            if arguments.plan:
                return RestoreRefusedError.exit_code if prepared.refusals else 0
            restore_id = await desk.begin(connection, prepared, prepared.hash)
            return await _follow(arguments, told, desk, restore_id, End.NEW)


async def _decide(arguments: argparse.Namespace, output: Output) -> int:
    with Told(output) as told:
        async with _desk(arguments, output) as (desk, connection, _office):
            onward = arguments.resume is not None
            restore_id = _open_one(desk, connection, arguments.resume or arguments.roll_back or "")
            way = desk.resume if onward else desk.roll_back
            await way(connection, restore_id, arguments.settings.person)
            return await _follow(arguments, told, desk, restore_id, End.NEW if onward else End.OLD)


def _open_one(desk: Desk, connection: Connection, named: str) -> str:
    """The id that is meant; without one the only restore that is open here. Raises UsageError."""
    if named:
        return named
    found = [row for row in desk.open if row.turbine == connection.turbine.slug]
    if len(found) != 1:
        known = ", ".join(f"{row.id} ({row.station})" for row in found) or "none"
        raise UsageError(reason=f"name the restore; incomplete here: {known}")
    return found[0].id


async def _order(arguments: argparse.Namespace, connection: Connection, office: Office) -> Order:
    sets = [await _given(arguments, connection, office, name) for name in arguments.set]
    station = _station(arguments, connection, sets)
    given, homeless = assign(targets_of(connection, station), sets)
    return Order(
        station=station,
        given=given,
        person=arguments.settings.person,
        selected=_selected(arguments.select, station, given),
        restart=arguments.restart,
        expert=arguments.expert,
        network=arguments.network,
        reason=arguments.reason,
        work_order=arguments.work_order,
        confirm_s=None if arguments.yes else arguments.confirm_within,
        others_confirmed=arguments.other_blades_confirmed,
        accepted=frozenset(arguments.accept),
        homeless=homeless,
    )


async def _given(arguments: argparse.Namespace, connection: Connection, office: Office, name: str) -> Given:
    """A motor, a set file, else a set of the library. Raises SetFileError, SetUnknownError, MotorUnknownError."""
    if is_motor(name):
        return await given_motor(office.motors, connection, name, arguments.settings.person)
    file = _file(name)
    if file is not None:
        return Given(file)
    record = await office.library.record(name)
    return Given(await office.library.set_of(record), record.id)


def _file(name: str) -> ParameterSet | None:
    """The set of a file; None where ``name`` is none. Raises SetFileError, OSError."""
    path = Path(name)
    if not path.is_file() and path.suffix != ".json" and "/" not in name:
        return None
    try:
        return load_set(path.read_bytes().decode("utf-8"), name)
    except UnicodeDecodeError as error:
        raise SetFileError(file=name, line=1, reason="no text in UTF-8") from error


def _station(arguments: argparse.Namespace, connection: Connection, sets: list[Given]) -> str:
    """Raises UsageError where it is not clear which is meant."""
    turbine = connection.turbine
    if turbine.slug == BARE_TURBINE:
        return BARE_STATION
    known = [station.slug for station in turbine.stations]
    if arguments.station is not None:
        for slug in known:
            if arguments.station in (slug, slug.partition("/")[2]):
                return slug
        raise UsageError(reason=f"--station: there are {', '.join(known)}")
    own = {given.parameters.origin.device.rpartition("/")[0] for given in sets}
    if len(own) == 1 and own <= set(known):
        return own.pop()
    raise UsageError(reason=f"--station names one of: {', '.join(known)}")


def _selected(text: str | None, station: str, given: dict[str, Given]) -> frozenset[Place] | None:
    """``6065`` means that object of every device that has it in its set, ``pmm/3110:01`` that of one."""
    if text is None:
        return None
    found: set[Place] = set()
    for part in text.split(","):
        device, _, address = part.strip().rpartition("/")
        at = parse_address(address)
        slugs = [f"{station}/{device}"] if device else list(given)
        places = {Place(slug, at) for slug in slugs if slug in given and at in given[slug].parameters.values}
        if not places:
            raise UsageError(reason=f"--select: {part.strip()} is in none of the sets")
        found |= places
    return frozenset(found)


# -- what is told --------------------------------------------------------------------


async def _follow(arguments: argparse.Namespace, told: Told, desk: Desk, restore_id: str, wanted: End) -> int:
    """Until it has ended; Ctrl-C rolls back, and the person confirms by typing."""
    output, person = told.output, arguments.settings.person
    loop = asyncio.get_running_loop()
    with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C ends the command, which leaves it incomplete
        loop.add_signal_handler(signal.SIGINT, lambda: _turn_back(desk, restore_id, person, output))
    asked = False
    told_of: str | None = None
    while (transaction := desk.at_work(restore_id)) is not None:
        if transaction.state is RestoreState.AWAITING_CONFIRMATION and not asked:
            asked = True
            output.say("cli.restore_confirm", within_s=f"{transaction.left_s or 0:.0f}", word=_word(output))
            _read_line(loop, lambda line: _typed(desk, restore_id, person, output, line))
        elif (slug := transaction.switching) is not None and slug != told_of:
            told_of = slug
            output.say("cli.restore_switch", device=slug, within_s=f"{transaction.switch_left_s or 0:.0f}")
            if sys.stdin.isatty():
                _read_line(loop, lambda _line: _without(desk, restore_id, person))
        elif transaction.state is not RestoreState.AWAITING_CONFIRMATION:
            state = output.texts(transaction.state.text_key)
            output.progress("cli.restore_at", state=state, done=transaction.done, total=transaction.total)
        await asyncio.sleep(LOOK_S)
    end = await desk.wait(restore_id)
    return await _tell_end(arguments, told, desk, restore_id, end, wanted)


def _word(output: Output) -> str:
    return output.texts("cli.restore_word")


def _turn_back(desk: Desk, restore_id: str, person: str, output: Output) -> None:
    transaction = desk.at_work(restore_id)
    if transaction is not None:
        output.say("cli.restore_turning_back")
        transaction.turn_back(person)


def _typed(desk: Desk, restore_id: str, person: str, output: Output, line: str) -> None:
    """What was typed, or nothing at the end of the input: anything but the word means the old values."""
    if line.strip().lower() in (_word(output).lower(), "confirm"):
        task = asyncio.ensure_future(desk.confirm(restore_id, person))
        task.add_done_callback(lambda done: done.exception())  # too late: it is told by how the restore ends
    else:
        _turn_back(desk, restore_id, person, output)


def _without(desk: Desk, restore_id: str, person: str) -> None:
    """Enter was pressed: nobody switches the device off and on."""
    task = asyncio.ensure_future(desk.go_on_unproven(restore_id, person))
    task.add_done_callback(lambda done: done.exception())  # too late: it is told by how the restore ends


def _read_line(loop: asyncio.AbstractEventLoop, typed: Callable[[str], None]) -> None:
    """Wait for a line without holding up anything; the thread ends with the process, should nobody type."""

    def read() -> None:
        line = sys.stdin.readline() if sys.stdin is not None else ""
        with contextlib.suppress(RuntimeError):  # the command has ended meanwhile
            loop.call_soon_threadsafe(typed, line)

    threading.Thread(target=read, name="confirmation", daemon=True).start()


async def _tell_end(
    arguments: argparse.Namespace, told: Told, desk: Desk, restore_id: str, end: End, wanted: End
) -> int:
    output, file = told.output, arguments.record_file
    kept = await desk.get(restore_id)
    failed = await try_record(desk, restore_id, file, arguments.settings.language)
    proven = bool(kept.outcome.get("proven"))
    details = {"restore": restore_id, "station": kept.row.station, "end": end.value, "proven": proven}
    key = f"cli.restore_{end.value}" + ("" if end is not End.NEW or proven else "_unproven")
    written = None if file is None or failed is not None else str(file)
    told.result({**details, "record_file": written}, output.texts(key, **details))
    if failed is not None:
        output.error(failed)
    elif written is not None:
        output.say("cli.restore_record", restore=restore_id, file=written)
    if end is wanted:
        return 0 if failed is None else failed.exit_code
    broken = desk.why(restore_id)
    if broken is None:
        raise RestoreStateError(restore=restore_id, station=kept.row.station, state_key=kept.row.state.text_key)
    error = broken.as_error(kept.row.station)
    output.error(error)
    return RestoreRefusedError.exit_code if broken.cause.is_decision else error.exit_code
