"""Full backup of six nodes at 500 kbit/s and 2 ms turnaround, against a loop over ``canopen``'s SDO client.

Both read every readable object of the same twins, in one process of theirs, over the same server.
"""

from __future__ import annotations

import asyncio
import sys
import time
from typing import NamedTuple

import canopen
from canopen.objectdictionary import ObjectDictionary

from app.drivers.can_config import parse_can
from app.drivers.canopen import CanOpenDriver
from app.errors import HubsideError, SdoAbortError
from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.wire.can_bits import frame_bits
from app.wire.frame import Can, Frame, Stamper
from bench._priority import real_time
from bench._result import Result
from bench._twins import twins

BITRATE = 500_000
TURNAROUND_MS = 2.0
TARGET = 4.0
BUSY_TARGET = 0.90
BOOT_TIMEOUT_S = 10.0
SWITCH_INTERVAL_S = 0.0005


class Run(NamedTuple):
    """One backup: how long it took, how many objects gave a value, and the share of time that the bus was busy."""

    elapsed_s: float
    values: int
    busy: float = 0.0


def run(full: bool) -> Result:
    """Compare; ``full`` takes more rounds."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    pmm, pmc = load_builtin("oat-pmm"), load_builtin("oat-pmc")
    plan = {node: _readable(pmm) for node in (1, 2, 3)} | {node: _readable(pmc) for node in (11, 12, 13)}
    with real_time() as scheduling, twins(BITRATE, TURNAROUND_MS) as address:
        host, _, port = address.partition(":")
        asyncio.run(wait_for(address, set(plan)))
        peers = [backup_with_canopen(host, int(port), plan) for _ in range(5 if full else 3)]
        ours = [asyncio.run(backup(address, plan)) for _ in range(21 if full else 7)]
    peer, median = sorted(peers)[len(peers) // 2], sorted(ours)[len(ours) // 2]
    shortfalls = []
    if median.busy < BUSY_TARGET:
        shortfalls.append(f"bus busy {median.busy:.1%}, wanted {BUSY_TARGET:.0%}")
    if any(each.values != peer.values for each in ours):
        shortfalls.append(f"values read: {[each.values for each in ours]}, by the peer {peer.values}")
    objects = sum(len(addresses) for addresses in plan.values())
    return Result(
        peer.elapsed_s / median.elapsed_s,
        TARGET,
        (
            f"{objects} objects of {len(plan)} nodes at {BITRATE} bit/s, {TURNAROUND_MS:g} ms turnaround; "
            f"scheduling: {scheduling}; median run of each",
            f"canopen, one object after another: {peer.elapsed_s:.2f} s ({_times(peers)})",
            f"ours, all nodes at a time: {median.elapsed_s:.3f} s ({_times(ours)})",
            f"bus busy (bit time / elapsed): {median.busy:.1%}",
        ),
        tuple(shortfalls),
    )


def _times(runs: list[Run]) -> str:
    return " ".join(f"{each.elapsed_s:.2f}" for each in runs)


def _readable(description: Description) -> list[Address]:
    return [entry.address for entry in description if entry.access.readable]


def backup_with_canopen(host: str, port: int, plan: dict[int, list[Address]]) -> Run:
    """The peer: ``RemoteNode.sdo.upload`` for each object in turn."""
    network = canopen.Network()
    network.connect(interface="socketcand", host=host, port=port, channel="can0")
    values = 0
    try:
        empty = ObjectDictionary()  # type: ignore[no-untyped-call]
        nodes = {node: network.add_node(node, empty) for node in plan}
        start = time.perf_counter()
        for node, addresses in plan.items():
            for address in addresses:
                try:
                    nodes[node].sdo.upload(address.major, address.minor)
                    values += 1
                except canopen.SdoAbortedError:
                    continue
        elapsed_s = time.perf_counter() - start
    finally:
        network.disconnect()
    return Run(elapsed_s, values)


async def wait_for(address: str, nodes: set[int]) -> None:
    """Wait until the twins have booted. Raises TimeoutError."""
    driver = CanOpenDriver(parse_can(f"socketcand:{address}"), Stamper(time.time_ns(), time.monotonic_ns), listen_s=0.0)
    await driver.connect()
    try:
        async with asyncio.timeout(BOOT_TIMEOUT_S):
            while {each.node for each in await driver.scan(sorted(nodes))} != nodes:
                continue
    finally:
        await driver.close()


async def backup(address: str, plan: dict[int, list[Address]]) -> Run:
    """Ours: the driver, all nodes at a time."""
    config = parse_can(f"socketcand:{address}@{BITRATE}")
    driver = CanOpenDriver(config, Stamper(time.time_ns(), time.monotonic_ns), listen_s=0.1)
    frames: list[Frame] = []
    await driver.connect()
    try:
        driver.subscribe(frames.extend)
        start = time.perf_counter()
        results = await asyncio.gather(*(driver.read_many(node, addresses) for node, addresses in plan.items()))
        elapsed_s = time.perf_counter() - start
    finally:
        await driver.close()
    bits = sum(frame_bits(frame.payload) for frame in frames if isinstance(frame.payload, Can))
    read = [result for each in results for result in each.values()]
    _check(read)
    return Run(elapsed_s, sum(1 for result in read if isinstance(result, bytes)), bits / BITRATE / elapsed_s)


def _check(read: list[bytes | HubsideError]) -> None:
    """A refusal by the device is a result, anything else is a failure of the benchmark."""
    for result in read:
        if isinstance(result, HubsideError) and not isinstance(result, SdoAbortError):
            raise result
