"""All devices of a turbine are read, or the bus was lost: then one error tells it, for however many devices."""

from __future__ import annotations

import asyncio

import pytest

from app.errors import BusLostError
from app.service.backup import read_devices
from app.service.connection import Connection


async def test_a_connection_that_is_closed_meanwhile_is_one_lost_bus(connection: Connection) -> None:
    pairs = [(connection.driver(target), target) for target in connection.targets]
    begun = asyncio.Event()
    reading = asyncio.create_task(read_devices(pairs, lambda *_progress: begun.set()))
    async with asyncio.timeout(10):
        await begun.wait()
    await asyncio.gather(*(link.driver.close() for link in connection.buses.values()))
    with pytest.raises(BusLostError):
        await asyncio.wait_for(reading, 10)
