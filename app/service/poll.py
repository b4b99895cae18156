"""Polling: what a screen needs and no active PDO carries is read by SDO, under a cap, and only while we are alone.

Nothing of an answer is used here: the answers cross the wire, and the decoder sees them there.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from typing import Final

from app.errors import HubsideError, SdoAbortError
from app.model.address import Address
from app.model.description import Description
from app.service.connection import Connection
from app.service.devices import Target
from app.service.link import DEVICE_NAME
from app.service.polling import USUAL, PollPlan, Rate
from app.wire.nmt import NmtState
from app.wire.records import Source
from app.wire.sdo import Abort

log = logging.getLogger(__name__)

OTHER_CLIENT_NS: Final = 3_000_000_000
"""So long after another SDO client's last transfer with a node nothing is polled there."""
BACK_OFF_S: Final = 3.0
"""A node that does not answer is left alone for so long, or until it starts anew."""
LOOK_S: Final = 0.1
"""While a node is left alone it is looked that often whether it has started anew."""
PDO_QUIET_NS: Final = 800_000_000
"""A PDO that brought nothing for so long is not active: what it carries is polled before it counts as old."""

_LASTING: Final = frozenset({Abort.NO_OBJECT, Abort.NO_SUB_INDEX, Abort.WRITE_ONLY})


class Poller:
    """Reads on behalf of the screens until ``close``; ``plan`` is asked in every round, so a change counts at once.

    ``targets`` None: all devices of the connection.
    """

    def __init__(
        self,
        connection: Connection,
        plan: Callable[[], PollPlan] = lambda: USUAL,
        targets: Sequence[Target] | None = None,
    ) -> None:
        self._connection = connection
        self._plan = plan
        self._targets = tuple(connection.targets if targets is None else targets)
        self._tasks = [asyncio.create_task(self._poll(target)) for target in self._targets]

    def halt(self) -> None:
        """End polling soon; ``close`` waits for it."""
        for task in self._tasks:
            task.cancel()

    async def close(self) -> None:
        """End polling."""
        self.halt()
        ends = await asyncio.gather(*self._tasks, return_exceptions=True)
        for target, end in zip(self._targets, ends, strict=True):
            if isinstance(end, Exception):
                log.error("polling %s had ended by a defect", target.slug, exc_info=end)

    async def _poll(self, target: Target) -> None:
        """What the device refused once is not asked again before it starts anew: each refusal is an event."""
        loop = asyncio.get_running_loop()
        refused: set[Address] = set()
        era = self._era(target)
        turn = 0
        due = loop.time()
        rounds = _Rounds(self._plan(), target.description)
        while True:
            plan = self._plan()
            if plan is not rounds.plan:
                rounds = _Rounds(plan, target.description)
            if self._allowed(target, plan.load_cap):
                wanted = self._not_in_pdos(target, rounds.due_in(turn))
                if self._must_be_named(target):
                    wanted.insert(0, DEVICE_NAME)
                if era != self._era(target):
                    era = self._era(target)
                    refused.clear()
                answers = await self._read(target, [address for address in wanted if address not in refused])
                refused.update(address for address, answer in answers.items() if is_lasting(address, answer))
            turn += 1
            due = max(due + plan.period_s, loop.time())
            await asyncio.sleep(due - loop.time())

    async def _read(self, target: Target, wanted: list[Address]) -> dict[Address, bytes | HubsideError]:
        """The answers; where there is none, only after a while."""
        if not wanted:
            return {}
        era = self._era(target)
        answers: dict[Address, bytes | HubsideError] = {}
        try:
            answers = await self._connection.driver(target).read_many(target.node, wanted)
        except HubsideError as error:
            log.debug("polling %s: %s", target.slug, error.code)
        if all(isinstance(answer, HubsideError) for answer in answers.values()):
            await self._back_off(target, era)
        return answers

    async def _back_off(self, target: Target, era: tuple[int, int]) -> None:
        """Leave the node alone, but not longer than until it starts anew or the link is back."""
        loop = asyncio.get_running_loop()
        until = loop.time() + BACK_OFF_S
        while loop.time() < until and self._era(target) == era:  # noqa: ASYNC110  the live state has no event for it
            await asyncio.sleep(LOOK_S)

    def _era(self, target: Target) -> tuple[int, int]:
        """Changes where another device may stand at the node: with each boot-up and each connection."""
        link = self._connection.buses[target.device.bus]
        view = self._connection.live.node(link.name, target.node)
        return (0 if view is None else view.boots), link.status.reconnects

    def _allowed(self, target: Target, load_cap: float) -> bool:
        """True while the bus has room and nobody else talks to the device."""
        link = self._connection.buses[target.device.bus]
        now_ns = self._connection.stamper()
        view = self._connection.live.node(link.name, target.node)
        other_ns = None if view is None else view.other_client_ns
        alone = other_ns is None or now_ns - other_ns > OTHER_CLIENT_NS
        return alone and link.bus_load(now_ns) < load_cap

    def _not_in_pdos(self, target: Target, wanted: list[Address]) -> list[Address]:
        """A new list, without what a PDO brings by itself while the node is operational."""
        view = self._connection.live.node(target.device.bus, target.node)
        if view is None or view.state is not NmtState.OPERATIONAL:
            return list(wanted)
        routes = self._connection.buses[target.device.bus].pdos(target.node)
        carried = {
            address for route in routes if route.source is Source.PDO_TX for address, _bits in route.mapping.entries
        }
        return [address for address in wanted if address not in carried or not self._came_by_pdo(target, address)]

    def _must_be_named(self, target: Target) -> bool:
        """Nobody has read the device's name since it started, or frames were lost since: another may stand there."""
        if DEVICE_NAME not in target.description.entries:
            return False
        value = self._connection.live.value(target.device.bus, target.node, DEVICE_NAME)
        return value is None or value.reading is None or value.stale

    def _came_by_pdo(self, target: Target, address: Address) -> bool:
        value = self._connection.live.value(target.device.bus, target.node, address)
        if value is None or value.reading is None or value.reading.source is not Source.PDO_TX:
            return False
        return self._connection.stamper() - value.reading.t_ns < PDO_QUIET_NS


def is_lasting(address: Address, answer: bytes | HubsideError) -> bool:
    """True for a refusal that the next request would meet as well; a name that is refused once is refused always."""
    return isinstance(answer, SdoAbortError) and (address == DEVICE_NAME or answer.abort_code in _LASTING)


class _Rounds:
    """What a plan reads of one device, round by round."""

    def __init__(self, plan: PollPlan, description: Description) -> None:
        self.plan = plan
        items = [(address, rate) for address, rate in plan.of(description).items() if address in description.entries]
        self._at = {rate: [address for address, at in items if at is rate] for rate in Rate}

    def due_in(self, turn: int) -> list[Address]:
        """The objects of round ``turn``, a new list."""
        wanted = list(self._at[Rate.FAST])
        if turn % self.plan.slow_every == 0:
            wanted += self._at[Rate.SLOW]
        if turn % self.plan.rare_every == self.plan.rare_every - 1:
            wanted += self._at[Rate.RARE]
        return wanted
