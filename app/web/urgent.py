"""STOP and FEATHER as pages send them, by a request or over their socket: always live, for every role.

A page that does not hear at once that its command was taken sends it the other way as well. So that the second one
never undoes what was commanded since, pages count: what came already is done once, and what comes after a later one not
at all.
"""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from typing import Final

from app.service.bench import Bench
from app.service.connection import Connection
from app.service.journal import Journal
from app.service.stop import AxisOutcome, Command, Path, command_all
from app.web.models import AxisDone, Press, StopDone, Urgent
from app.web.problem import failure

Commanding = Callable[[], Awaitable[StopDone]]
Commands = Callable[[Urgent], Commanding | None]
_COMMANDS: Final = {"stop": Command.STOP, "feather": Command.FEATHER}
_PAGES: Final = 256
"""Of so many pages the latest press is known; a late one of a page that was forgotten is done."""


class Presses:
    """What the pages of one server have commanded last. For the event loop."""

    def __init__(self) -> None:
        self._latest: OrderedDict[tuple[str, str], tuple[int, asyncio.Task[StopDone]]] = OrderedDict()

    async def command(
        self, connection: Connection, journal: Journal, what: Command, press: Press, device: str | None = None
    ) -> StopDone:
        """The command to every axis, or to that of ``device``; one that is no axis is none of those told.

        One that came already is only waited for; one after which the page has sent another is replaced by that.
        """
        axes = [axis for axis in connection.axes() if device is None or axis.target.slug == device]
        work = command_all(axes, what, journal, connection.stamper)
        if press.page is None or press.number is None:
            return _done(await work)
        key = journal.person, press.page
        number, task = self._latest.get(key, (0, None))
        if press.number < number:
            work.close()
            now_ns = connection.stamper()
            return _done([AxisOutcome(one.target.slug, Path.REPLACED, now_ns, None) for one in axes])
        if press.number > number or task is None or _failed(task):
            task = asyncio.ensure_future(_told(work))
            self._latest[key] = press.number, task
            self._latest.move_to_end(key)
            while len(self._latest) > _PAGES:
                self._latest.popitem(last=False)
        else:
            work.close()
        return await asyncio.shield(task)

    def of(self, bench: Bench, person: str) -> Commands:
        """What a page of ``person`` may send over its socket; None where nothing is connected."""

        def take(wanted: Urgent) -> Commanding | None:
            connection, press = bench.connection, Press(page=wanted.page, number=wanted.number)
            if connection is None:
                return None
            journal, what = bench.journal.by(person), _COMMANDS[wanted.command]
            return lambda: self.command(connection, journal, what, press, wanted.device)

        return take


def _failed(task: asyncio.Task[StopDone]) -> bool:
    """By a defect of ours: then it is worth another try."""
    return task.done() and (task.cancelled() or task.exception() is not None)


async def _told(work: Awaitable[list[AxisOutcome]]) -> StopDone:
    return _done(await work)


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
