"""The whole dictionary of a PD4-E by FC 101, against one FC 43 for each object, with 1 ms added to each transaction.

Both by our own driver, over the same connection to the same twin in a process of its own, in turns. The peer knows the
size of every object, so that it never asks twice.
"""

from __future__ import annotations

import asyncio
import time
from typing import Final, NamedTuple

from app.drivers.modbus import ModbusDriver
from app.drivers.modbus_config import ModbusConfig, ModbusPeer
from app.model.address import Address
from app.model.description_file import load_builtin
from app.wire.frame import Direction, Frame, Stamper
from bench._pd4e import LATENCY_S
from bench._process import Child
from bench._result import Result

TARGET: Final = 20.0
NODE: Final = 1
VOLATILE: Final = frozenset({0x1003, 0x230F, 0x2039, 0x4014})
"""Error stack, uptime, measured currents, temperatures and voltages: these may differ between two readings."""


class Run(NamedTuple):
    """One reading of all objects."""

    elapsed_s: float
    requests: int
    values: dict[Address, bytes]


def run(full: bool) -> Result:
    """Compare; ``full`` takes more rounds."""
    return measure(rounds=15 if full else 5)


def measure(rounds: int) -> Result:
    """Compare ``rounds`` readings of each."""
    with Child("bench._pd4e") as child:
        peers, ours = asyncio.run(_take_turns(int(child.hear()["port"]), rounds))
    peer, median = _median(peers), _median(ours)
    shortfalls = []
    if any(_steady(each.values) != _steady(peer.values) for each in (*peers, *ours)):
        shortfalls.append("the values read differ")
    return Result(
        peer.elapsed_s / median.elapsed_s,
        TARGET,
        (
            f"{len(median.values)} objects, {LATENCY_S * 1e3:g} ms added to each transaction; median of {rounds} each",
            f"one FC 43 for each object: {peer.elapsed_s * 1e3:.0f} ms in {peer.requests} requests",
            f"FC 101: {median.elapsed_s * 1e3:.1f} ms in {median.requests} requests",
        ),
        tuple(shortfalls),
    )


def _median(runs: list[Run]) -> Run:
    return sorted(runs, key=lambda each: each.elapsed_s)[len(runs) // 2]


async def _take_turns(port: int, rounds: int) -> tuple[list[Run], list[Run]]:
    config = ModbusConfig((ModbusPeer(NODE, "127.0.0.1", port),))
    stamper = Stamper(time.time_ns(), time.monotonic_ns)
    driver = ModbusDriver(config, stamper, descriptions=(load_builtin("nanotec-pd4e"),))
    await driver.connect()
    try:
        wanted = list(await driver.backup(NODE))
        peers, ours = [], []
        for _ in range(rounds):
            peers.append(await _one_by_one(driver, wanted))
            ours.append(await _at_once(driver))
        return peers, ours
    finally:
        await driver.close()


async def _one_by_one(driver: ModbusDriver, wanted: list[Address]) -> Run:
    sent: list[Frame] = []
    end = driver.subscribe(sent.extend)
    start = time.perf_counter()
    values = {address: await driver.read(NODE, address) for address in wanted}
    elapsed_s = time.perf_counter() - start
    end()
    return Run(elapsed_s, _requests(sent), values)


async def _at_once(driver: ModbusDriver) -> Run:
    sent: list[Frame] = []
    end = driver.subscribe(sent.extend)
    start = time.perf_counter()
    values = await driver.backup(NODE)
    elapsed_s = time.perf_counter() - start
    end()
    return Run(elapsed_s, _requests(sent), values)


def _requests(frames: list[Frame]) -> int:
    return sum(frame.direction is Direction.TX for frame in frames)


def _steady(values: dict[Address, bytes]) -> dict[Address, bytes]:
    return {address: data for address, data in values.items() if address.major not in VOLATILE}
