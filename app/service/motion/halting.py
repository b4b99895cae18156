"""How what runs is brought to rest: let go, stopped, or lost; none of it waits for anybody.

Each sends what there is to send at once and sees to the rest by itself. A person's STOP or FEATHER stays in force.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Mapping
from time import monotonic
from typing import Final

from app.drivers.contract import LinkState
from app.errors import BusLostError, HubsideError, NoAnswerError, OvertakenError
from app.service.connection import Connection
from app.service.journal import Journal, Kind
from app.service.motion import preparation
from app.service.motion.commanding import Commanding
from app.service.motion.dead_man import DeadMan
from app.service.motion.heartbeat import Heartbeat
from app.service.motion.preparation import Prepared
from app.service.motion.running import Ended, Running

log = logging.getLogger(__name__)

LOOK_S: Final = 0.02
BACK_S: Final = 30.0
"""A device that cannot be reached for so long may have another master since."""
OBEY_S: Final = 0.25
"""An axis that is still enabled so long after a quick stop has not heard it."""


class Halting:
    """For the axes of one connection; what is ``prepared`` there is voided where it must prove itself anew."""

    def __init__(
        self,
        connection: Connection,
        journal: Journal,
        dead_man: DeadMan,
        heartbeats: Mapping[str, Heartbeat],
        prepared: Mapping[str, Prepared],
    ) -> None:
        self._connection = connection
        self._journal = journal
        self._dead_man = dead_man
        self._heartbeats = heartbeats
        self._prepared = prepared
        self._chores: set[asyncio.Task[None]] = set()

    async def close(self) -> None:
        """End what it still sees to."""
        for task in list(self._chores):
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)

    def lost(self, running: Running) -> None:
        """Nothing is heard of the axis any more; one that cannot stop by itself is stopped once it is back."""
        self.stop(running, Ended.LINK)
        if not self._heartbeats[running.control.target.device.bus].watched:
            if (axis := self._prepared.get(running.slug)) is not None:
                axis.void()
            self._journal.note(Kind.MOTION_LOST, running.slug)
            self.chore(self._stop_once_back(running.control))

    async def _stop_once_back(self, control: Commanding) -> None:
        """Quick stop as soon as the device can be reached again, unless somebody else has commanded it by then."""
        link = self._connection.buses[control.target.device.bus]
        end_s = monotonic() + BACK_S
        while monotonic() < end_s and not control.overtaken:
            if link.status.state is LinkState.CONNECTED:
                try:
                    await control.stop_by_write()
                except (BusLostError, NoAnswerError) as error:
                    log.warning("%s: not stopped yet: %s", control.target.slug, error.code)
                else:
                    return
            await asyncio.sleep(LOOK_S)

    def let_go(self, running: Running) -> None:
        """Let go: the axis halts by its ramp. One that does not run yet would be enabled by that word."""
        if not running.turning:
            running.control.release()
            running.end(Ended.RELEASED)
            return
        try:
            at_once = running.control.let_go(running.let_go or running.control.halt_word)
            running.end(Ended.RELEASED)
            if not at_once:
                self.chore(self._let_go_by_write(running))
        except OvertakenError:  # STOP or FEATHER has it now
            running.end(Ended.STOPPED)
        except HubsideError as error:
            log.warning("%s: halt was not sent: %s", running.slug, error.code)
            self.stop(running, Ended.RELEASED)

    async def _let_go_by_write(self, running: Running) -> None:
        try:
            await running.control.let_go_by_write(running.let_go or running.control.halt_word)
        except HubsideError as error:
            log.warning("%s: halt was not sent: %s", running.slug, error.code)
            self.stop(running, Ended.RELEASED)

    def stop(self, running: Running, why: Ended) -> None:
        """Nobody is there: quick stop, at once, by whatever way there is; a person's STOP or FEATHER stays in force."""
        running.end(why)
        self._dead_man.release()
        try:
            by_pdo = running.control.stop()
        except HubsideError as error:  # the link is lost, or the adapter is full: without us the drive stops by itself
            log.warning("%s: quick stop was not sent: %s", running.slug, error.code)
            self._heartbeats[running.control.target.device.bus].withhold(running.slug)
            by_pdo = False
        if not by_pdo:
            self.chore(running.control.stop_by_write())
        self.chore(self._see_off(running.control))
        self._journal.note(Kind.MOTION_STOPPED, running.slug, reason=why.value)

    async def _see_off(self, control: Commanding) -> None:
        """A quick stop that the axis does not obey is written, and our heartbeat ends until it has no power."""
        heartbeat = self._heartbeats[control.target.device.bus]
        slug = control.target.slug
        try:
            await asyncio.sleep(OBEY_S)
            if control.overtaken or not await control.is_enabled():
                heartbeat.go_on(slug)
                return
        except HubsideError as error:
            log.warning("%s: whether it stops is not known: %s", slug, error.code)
        if control.overtaken:  # meanwhile: a FEATHER must not end by our silence
            heartbeat.go_on(slug)
            return
        heartbeat.withhold(slug)
        await control.stop_by_write()
        if await control.until_off(preparation.OFF_TIMEOUT_S):
            heartbeat.go_on(slug)

    def chore(self, work: Awaitable[None]) -> None:
        """See to something that nobody waits for; where it fails, the log says so."""

        async def run() -> None:
            try:
                await work
            except HubsideError as error:
                log.warning("motion: %s: %s", error.code, error)

        task = asyncio.ensure_future(run())
        self._chores.add(task)
        task.add_done_callback(self._chores.discard)
