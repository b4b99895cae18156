"""STOP and FEATHER as pages send them, by a request or over their socket: always live, for every role."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

from app.service.bench import Bench
from app.service.connection import Connection
from app.service.journal import Journal
from app.service.stop import AxisOutcome, Command, command_all
from app.web.models import AxisDone, StopDone, Urgent
from app.web.routes.jobs import failure

Commanding = Callable[[], Awaitable[StopDone]]
Commands = Callable[[Urgent], Commanding | None]
_COMMANDS = {"stop": Command.STOP, "feather": Command.FEATHER}


async def command(connection: Connection, journal: Journal, what: Command, device: str | None = None) -> StopDone:
    """The command to every axis, or to that of ``device``; one that is no axis is none of those told."""
    axes = [axis for axis in connection.axes() if device is None or axis.target.slug == device]
    return _done(await command_all(axes, what, journal, connection.stamper))


def commands_of(bench: Bench, person: str) -> Commands:
    """What a page of ``person`` may send over its socket; None where nothing is connected."""

    def take(wanted: Urgent) -> Commanding | None:
        connection = bench.connection
        if connection is None:
            return None
        return lambda: command(connection, bench.journal.by(person), _COMMANDS[wanted.command], wanted.device)

    return take


def _done(outcomes: list[AxisOutcome]) -> StopDone:
    return StopDone(
        axes=[
            AxisDone(
                device=one.device,
                sent_t_ns=one.sent_t_ns,
                confirmed_t_ns=one.confirmed_t_ns,
                how=one.how.value,
                error=None if one.error is None else failure("", one.error),
            )
            for one in outcomes
        ]
    )
