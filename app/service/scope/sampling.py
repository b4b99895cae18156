"""While a scope is armed: what nothing brings unasked of its signals is read, as fast as the cap on the load allows.

On CAN that is what no PDO carries. A drive on Modbus TCP sends nothing unasked: what it maps into its registers comes
in one message, the rest object by object.

Parameters that nobody knows, as after a restart, are read beside it, a few in each round: a capture keeps the values
that are in force.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection, Mapping
from itertools import islice
from typing import Final

from app.errors import HubsideError
from app.model.address import Address
from app.service.connection import Connection
from app.service.devices import Target
from app.service.poll import LOOK_S, Poller, is_lasting
from app.service.polling import PollPlan, read_bits

log = logging.getLogger(__name__)

LEAST_S: Final = 0.002
"""A round never takes less, so that others get their turn."""
BESIDE: Final = 4
"""So many parameters that nobody knows are read in a round of signals."""
ALONE: Final = 32
"""So many where the bus brings all signals by itself."""
LOOK_AGAIN_S: Final = 1.0
LEAST_ROOM: Final = 0.02
"""Share of the bus that is used at least while the load is under its cap."""


class Sampling(Poller):
    """Reads ``wanted`` of each device, by slug, round after round, and once what is unknown of its parameters.

    Obeys what all polling obeys.
    """

    def __init__(
        self, connection: Connection, wanted: Mapping[str, Collection[Address]], plan: Callable[[], PollPlan]
    ) -> None:
        self._wanted = wanted
        super().__init__(connection, plan, [one for one in connection.targets if one.slug in wanted])

    async def _poll(self, target: Target) -> None:
        refused: set[Address] = set()
        era = self._era(target)
        loop = asyncio.get_running_loop()
        unknown = _Unknown(self._connection, target)
        own = 0.0
        while True:
            plan = self._plan()
            if era != self._era(target):
                era = self._era(target)
                refused.clear()
                unknown = _Unknown(self._connection, target)
            wanted = []
            if self._allowed(target, plan.load_cap):
                mine = [one for one in self._wanted[target.slug] if one not in refused]
                wanted = self._not_in_pdos(target, mine)
                wanted += unknown.some(wanted, BESIDE if wanted else ALONE, loop.time())
            if not wanted:
                own = 0.0
                await asyncio.sleep(LOOK_S)
                continue
            begun_s = loop.time()
            answers = await self._read(target, wanted)
            refused.update(address for address, answer in answers.items() if is_lasting(address, answer))
            bits = sum(read_bits(target.description.entries[address]) for address in wanted)
            pause_s = self._round_s(target, plan.load_cap, bits, own) - (loop.time() - begun_s)
            await asyncio.sleep(max(LEAST_S, pause_s))
            own = bits / self._bitrate(target) / max(LEAST_S, loop.time() - begun_s)

    async def _read(self, target: Target, wanted: list[Address]) -> dict[Address, bytes | HubsideError]:
        mapped = await self._registers(target, wanted)
        rest = [address for address in wanted if address not in mapped]
        return {**mapped, **await super()._read(target, rest)}

    async def _registers(self, target: Target, wanted: Collection[Address]) -> dict[Address, bytes | HubsideError]:
        """What registers hold of ``wanted``; nothing where the bus has none, or they cannot be read just now."""
        process_data = getattr(self._connection.driver(target), "process_data", None)
        if process_data is None:
            return {}
        process = process_data(target.node)
        try:
            if (await process.images()).sent.places.keys().isdisjoint(wanted):
                return {}
            found = await process.exchange()
        except HubsideError as error:
            log.debug("registers of %s: %s", target.slug, error.code)
            return {}
        return {address: data for address, data in found.items() if address in wanted}

    def _round_s(self, target: Target, cap: float, bits: int, own: float) -> float:
        """How long a round should take so that the load stays under its cap. ``own``: the share we take now."""
        link = self._connection.buses[target.device.bus]
        sharing = sum(1 for one in self._targets if one.device.bus == target.device.bus)
        others = max(0.0, link.bus_load(self._connection.stamper()) - own * sharing)
        return bits / (self._bitrate(target) * max(LEAST_ROOM, (cap - others) / sharing))

    def _bitrate(self, target: Target) -> int:
        return self._connection.buses[target.device.bus].load.bitrate


class _Unknown:
    """The parameters of a device that nobody knows, or only from before frames were lost; each is asked for once."""

    def __init__(self, connection: Connection, target: Target) -> None:
        self._live = connection.live
        self._target = target
        self._asked: set[Address] = set()
        self._look_s = 0.0

    def some(self, but: Collection[Address], count: int, now_s: float) -> list[Address]:
        """The next of them, at most ``count``; where there is none, it is not looked again for a while."""
        if now_s < self._look_s:
            return []
        values = self._live.values(self._target.device.bus, self._target.node)

        def is_known(address: Address) -> bool:
            view = values.get(address)
            return view is not None and view.reading is not None and not view.stale

        done = self._asked.union(but)
        unknown = (
            entry.address
            for entry in self._target.description
            if entry.is_parameter and entry.access.readable and entry.address not in done
        )
        found = list(islice((address for address in unknown if not is_known(address)), count))
        self._asked.update(found)
        if not found:
            self._look_s = now_s + LOOK_AGAIN_S
        return found
