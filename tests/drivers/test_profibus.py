"""The PROFIBUS driver: the contract against a twin on a pseudo-terminal."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from tests.drivers.contract_suite import Bench, DriverContract
from tests.drivers.profibus_rig import ABSENT, ED2, NODE, RAMP_VELOCITY, STATUSWORD, connected, gone, ip, wire


class TestContract(DriverContract):
    @pytest.fixture
    async def bench(self) -> AsyncIterator[Bench]:
        with wire() as line:
            async with connected(line.config(NODE)) as driver:

                async def switch() -> None:
                    starts = driver._line.stations[NODE].starts
                    line.power_off()
                    await gone(driver, NODE)
                    line.power_on()
                    assert driver._line.stations[NODE].starts == starts

                yield Bench(
                    driver=driver,
                    node=NODE,
                    absent_node=ABSENT,
                    readable=tuple(entry.address for entry in ED2 if entry.access.readable)[:20],
                    writable=RAMP_VELOCITY,
                    first=(100).to_bytes(4, "little"),
                    second=(200).to_bytes(4, "little"),
                    read_only=STATUSWORD,
                    read_only_data=bytes(2),
                    unknown=ip(0, 250),
                    switch=switch,
                )
