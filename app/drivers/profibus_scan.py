"""Who stands at an address of a PROFIBUS line that is running, and what can be said of it."""

from __future__ import annotations

import asyncio
import contextlib
from typing import Final

from app.drivers.contract import TWIN_NAME, FoundNode, Identity, LinkState
from app.drivers.profibus_bus import ProfibusBus
from app.drivers.profibus_probe import Probed, probe
from app.drivers.profibus_station import StationState
from app.errors import BusLostError, HubsideError
from app.model.description import Description

TWIN_IDENT: Final = 0x0ED2
"""The ident number of our twins: an example that nobody has given out. That of the ED2 is not printed."""


def is_twin(probed: Probed) -> bool:
    """True where it says by its ident number that it is simulated."""
    return probed.diagnosis is not None and probed.diagnosis.ident == TWIN_IDENT


def found_node(node: int, probed: Probed, description: Description | None) -> FoundNode:
    """What a scan tells of it."""
    ident = None if probed.diagnosis is None else probed.diagnosis.ident
    name = f"{TWIN_NAME} ED2" if is_twin(probed) else None
    description_id = None if description is None else description.id
    return FoundNode(node, None, name, None, None, Identity(product=ident), description_id)


async def look(line: ProfibusBus, node: int) -> Probed | None:
    """Probe an address between two turns of the line. Raises BusLostError.

    A station that is run was probed when it began, and is not asked again: that would cut into its counting.
    """
    loop = asyncio.get_running_loop()
    done: asyncio.Future[Probed | None] = loop.create_future()

    def ask(bus: ProfibusBus) -> None:
        station = bus.stations.get(node)
        known = None if station is None or station.state is StationState.ABSENT else station.probed
        result: Probed | None = None
        error: HubsideError | None = BusLostError(bus=bus.bus, reason=bus.reason or LinkState.CLOSED.value)
        try:
            if bus.port is not None:
                result = known or probe(bus.port, node)
                error = None
        finally:  # where the line is lost meanwhile, the bus is told so by what is raised
            with contextlib.suppress(RuntimeError):  # the loop has ended
                loop.call_soon_threadsafe(_settle, done, result, error)

    line.post(ask)
    return await done


def _settle(done: asyncio.Future[Probed | None], result: Probed | None, error: HubsideError | None) -> None:
    if done.done():
        return
    if error is None:
        done.set_result(result)
    else:
        done.set_exception(error)
