"""Polling: what a screen needs and no active PDO carries is read by SDO, under a cap, and only while we are alone.

Nothing of an answer is used here: the answers cross the wire, and the decoder sees them there.
"""

from __future__ import annotations

import asyncio
import logging
from typing import Final

from app.errors import BusLostError, ConsentError, HubsideError, NoAnswerError
from app.model.address import Address, parse_address
from app.service.connection import Connection
from app.service.devices import Target
from app.wire.nmt import NmtState
from app.wire.records import Source

log = logging.getLogger(__name__)

PERIOD_S: Final = 0.1
SLOW_EVERY: Final = 10
"""Slow objects are read in every tenth round."""
LOAD_CAP: Final = 0.6
"""Above this bus load nothing is polled."""
OTHER_CLIENT_NS: Final = 3_000_000_000
"""So long after another SDO client's last transfer with a node nothing is polled there."""
BACK_OFF_S: Final = 3.0
"""A node that does not answer is left alone for so long."""

FAST: Final = tuple(map(parse_address, ("6041", "6064", "606C", "3000", "3060")))
SLOW: Final = tuple(
    map(
        parse_address,
        ("603F", "607A", "6061", "6078", "6079", "6510:03", "6410:09", "3063", "3080", "3010", "3011", "3062", "3070"),
    )
)


class Poller:
    """Reads on behalf of the screens until ``close``."""

    def __init__(self, connection: Connection, period_s: float = PERIOD_S) -> None:
        self._connection = connection
        self._period_s = period_s
        self._tasks = [asyncio.create_task(self._poll(target)) for target in connection.targets]

    async def close(self) -> None:
        """End polling."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _poll(self, target: Target) -> None:
        fast = [address for address in FAST if address in target.description.entries]
        slow = [address for address in SLOW if address in target.description.entries]
        loop = asyncio.get_running_loop()
        turn = 0
        due = loop.time()
        while True:
            wanted = [*fast, *slow] if turn % SLOW_EVERY == 0 else fast
            if self._allowed(target):
                await self._read(target, self._not_in_pdos(target, wanted))
            turn += 1
            due = max(due + self._period_s, loop.time())
            await asyncio.sleep(due - loop.time())

    async def _read(self, target: Target, wanted: list[Address]) -> None:
        if not wanted:
            return
        try:
            answers = await self._connection.driver(target).read_many(target.node, wanted)
        except (BusLostError, ConsentError, NoAnswerError) as error:
            log.debug("polling %s: %s", target.slug, error.code)
            await asyncio.sleep(BACK_OFF_S)
            return
        if all(isinstance(answer, HubsideError) for answer in answers.values()):
            await asyncio.sleep(BACK_OFF_S)

    def _allowed(self, target: Target) -> bool:
        """True while the bus has room and nobody else talks to the device."""
        link = self._connection.buses[target.device.bus]
        now_ns = self._connection.stamper()
        view = self._connection.live.node(link.name, target.node)
        other_ns = None if view is None else view.other_client_ns
        alone = other_ns is None or now_ns - other_ns > OTHER_CLIENT_NS
        return alone and link.bus_load(now_ns) < LOAD_CAP

    def _not_in_pdos(self, target: Target, wanted: list[Address]) -> list[Address]:
        """Without what a PDO brings by itself while the node is operational."""
        view = self._connection.live.node(target.device.bus, target.node)
        if view is None or view.state is not NmtState.OPERATIONAL:
            return wanted
        routes = self._connection.buses[target.device.bus].pdos(target.node)
        carried = {
            address for route in routes if route.source is Source.PDO_TX for address, _bits in route.mapping.entries
        }
        return [address for address in wanted if address not in carried]
