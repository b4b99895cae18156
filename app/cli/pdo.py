"""``hubside pdo``: how the PDOs of a device are set up; changing them by a file, and putting the last change back."""

from __future__ import annotations

import argparse
import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Final

from app.cli.audited import audited_in
from app.cli.bus import target_of
from app.cli.connecting import connected, run_command
from app.cli.output import Output
from app.cli.pdo_told import tell_done, tell_preview, tell_setups
from app.cli.targets import add_connection
from app.errors import HubsideError, PdoChangedError, PdoNoUndoError, PdoRefusedError, UsageError
from app.model.pdo.findings import Severity
from app.model.pdo.pdo_file import read_pdo_file, write_pdo_file
from app.model.pdo.setup import PdoId, PdoSetup, objects_of, places_of
from app.model.texts import error_text
from app.service.connection import Connection
from app.service.devices import Target
from app.service.jobs import Job, Jobs, JobState
from app.service.motion.desk import MotionDesk
from app.service.pdo.change import read_setups
from app.service.pdo.desk import Edit, PdoDesk, Worker, preview
from app.service.pdo.kept import Stand
from app.service.pdo.look import cost
from app.store.store import Store

MEASURE_S: Final = 2.0
"""The load is that of the last full second: within two there is one."""
LOOK_S: Final = 0.02
MOST_BYTES: Final = 1 << 20


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("pdo", help="PDO mapping of a device: show, change by a file, put back")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")

    def action(name: str, run: Callable[..., Coroutine[Any, Any, int]], text: str) -> argparse.ArgumentParser:
        one = actions.add_parser(name, help=text, description=text)
        one.add_argument("device", metavar="TARGET", help="TURBINE/STATION/DEVICE or a node number")
        add_connection(one)
        one.set_defaults(run=lambda arguments, output: run_command(run(arguments, output)))
        return one

    show = action("show", _show, "what every PDO carries, when it goes, and what it costs of the bus")
    show.add_argument("--toml", action="store_true", help="as a file for 'pdo set'")
    change = action("set", _set, "set PDOs up as a TOML file says; all of it, or what stood before is put back")
    change.add_argument("file", type=Path, metavar="FILE.toml")
    undo = action("undo", _undo, "put the last change of the device back")
    for one in (change, undo):
        one.add_argument("--dry-run", action="store_true", help="show writes, order and load; write nothing")


# -- show -----------------------------------------------------------------------------


async def _show(arguments: argparse.Namespace, output: Output) -> int:
    async with connected(arguments, output) as connection:
        target = target_of(connection, arguments.device)
        setups = await _look(connection, target, output)
        if arguments.toml:
            title = f"PDOs of {target.slug} ({target.description.id}), node {target.node}"
            places = places_of(target.description)
            output.raw(write_pdo_file(title, places, setups, target.description, target.node))
        else:
            tell_setups(output, connection, target, setups, cost(connection, target, setups, setups))
    return 0


async def _look(connection: Connection, target: Target, output: Output) -> dict[PdoId, PdoSetup]:
    """The PDOs of the device, read now; and those of its neighbours, whose identifiers and load count too.

    Raises what reading raises, PdoUnknownError, UsageError where it has no PDO.
    """
    if not places_of(target.description):
        raise UsageError(reason=f"{target.slug} has no PDOs")
    measured = asyncio.create_task(asyncio.sleep(MEASURE_S))
    setups = await read_setups(connection.driver(target), target)
    for other in connection.targets:
        if other.device.bus == target.device.bus and other.slug != target.slug:
            output.progress("cli.pdo_neighbours", device=other.slug)
            await _look_at_neighbour(connection, other, output)
    await measured
    return setups


async def _look_at_neighbour(connection: Connection, other: Target, output: Output) -> None:
    """What it answers is decoded from the wire; what it does not is said."""
    objects = [address for place in places_of(other.description) for address in objects_of(place)]
    if not objects:
        return
    try:
        answers = await connection.driver(other).read_many(other.node, objects)
        failed = [answer for answer in answers.values() if isinstance(answer, HubsideError)]
        if failed:
            raise failed[0]
    except HubsideError as error:
        output.say("cli.pdo_neighbour_unread", device=other.slug, reason=error.code)


# -- change ---------------------------------------------------------------------------


async def _set(arguments: argparse.Namespace, output: Output) -> int:
    text = _text(arguments.file)

    async def edits(_desk: PdoDesk | None, target: Target, before: dict[PdoId, PdoSetup]) -> list[Edit]:
        wanted = read_pdo_file(text, str(arguments.file), target.description, target.node, before)
        return [Edit(before[pdo], setup) for pdo, setup in wanted.items() if before[pdo] != setup]

    async def begin(desk: PdoDesk, worker: Worker, target: Target, edits: Sequence[Edit]) -> Job:
        return await desk.apply(worker, target, edits)

    return await _change(arguments, output, edits, begin)


async def _undo(arguments: argparse.Namespace, output: Output) -> int:
    async def edits(desk: PdoDesk | None, target: Target, before: dict[PdoId, PdoSetup]) -> list[Edit]:
        change = None if desk is None else desk.kept.of(target.slug)
        if change is None:
            raise PdoNoUndoError(device=target.slug)
        changed = [pdo for pdo, setup in change.after.items() if before[pdo] != setup]
        if change.stand is Stand.APPLIED and changed:
            raise PdoChangedError(device=target.slug, pdo=str(changed[0]))
        return [Edit(before[pdo], setup) for pdo, setup in change.before.items() if before[pdo] != setup]

    async def begin(desk: PdoDesk, worker: Worker, target: Target, _edits: Sequence[Edit]) -> Job:
        return await desk.undo(worker, target)

    return await _change(arguments, output, edits, begin)


def _text(path: Path) -> str:
    """Raises UsageError, OSError."""
    if path.stat().st_size > MOST_BYTES:
        raise UsageError(reason=f"{path}: too large for a file of PDOs")
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise UsageError(reason=f"{path}: no text in UTF-8") from error


async def _change(
    arguments: argparse.Namespace,
    output: Output,
    edits_of: Callable[[PdoDesk | None, Target, dict[PdoId, PdoSetup]], Awaitable[list[Edit]]],
    begin: Callable[[PdoDesk, Worker, Target, Sequence[Edit]], Awaitable[Job]],
) -> int:
    """Tell what would be done; then do it, unless it is a dry run."""
    needs_store = not arguments.dry_run or arguments.action == "undo"
    async with _desk(arguments, output, needs_store) as (desk, connection):
        target = target_of(connection, arguments.device)
        before = await _look(connection, target, output)
        edits = await edits_of(desk, target, before)
        found = preview(connection, target, edits, before)
        if arguments.dry_run or desk is None:
            tell_preview(output, target, found, as_result=True)
            refused = any(one.severity is Severity.ERROR for one in found.findings)
            return PdoRefusedError.exit_code if refused else 0
        tell_preview(output, target, found, as_result=False)
        person, journal = arguments.settings.person, connection.journal
        jobs = Jobs()
        worker = Worker(person, "", connection, MotionDesk(connection, journal), journal, jobs)
        job = await begin(desk, worker, target, edits)
        await _follow(job, jobs, output)
    for row in job.rows:
        if row.error is not None:
            output.say("cli.pdo_write_failed", address=row.address, reason=error_text(output.texts, row.error))
    if job.error is not None:
        raise job.error
    tell_done(output, target, job, arguments.action == "undo")
    return 0


@asynccontextmanager
async def _desk(
    arguments: argparse.Namespace, output: Output, needs_store: bool
) -> AsyncIterator[tuple[PdoDesk | None, Connection]]:
    """The store first: nothing is sent where another process, which may be at work on PDOs, has it."""
    if not needs_store:
        async with connected(arguments, output) as connection:
            yield None, connection
        return
    store = Store.open(arguments.settings.data)
    try:
        async with connected(arguments, output) as connection, audited_in(store, connection):
            yield PdoDesk(store, connection.stamper), connection
    finally:
        store.close()


async def _follow(job: Job, jobs: Jobs, output: Output) -> None:
    """To its end. Who ends the command has what was written put back first: it never stops half-way."""
    try:
        while job.state is JobState.RUNNING:
            output.progress("cli.pdo_writing", done=job.done, total=job.total)
            await asyncio.sleep(LOOK_S)
    except asyncio.CancelledError:
        jobs.cancel(job.id)
        output.say("cli.pdo_interrupted")
        while job.state is JobState.RUNNING:
            with suppress(asyncio.CancelledError):  # however often it is ended
                await asyncio.sleep(LOOK_S)
        if job.error is not None:
            raise job.error from None
        raise
