"""Connections that record, each in a process of its own: ``python -m tests.soak.recorder_process``.

Each line of standard input, ``{"folder": F, "ports": [...]}``, begins one and is answered with its ``{"pid": ...}``: a
copy of this process, which has loaded all there is to load, so that hundreds begin in little time. It records the buses
of these ports into F until it is killed. ``{"recover": F}`` begins one that recovers what is in F, as a restart does.

``python -m tests.soak.recorder_process FOLDER PORT...`` records in this process until all buses are gone, and prints
what the recorder counted.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app.cli.connecting import SWITCH_INTERVAL_S
from app.cli.runtime import spare_collector
from app.drivers.contract import LinkState
from app.model.description_file import load_builtin
from app.model.site import BusConfig, Device, Station, Turbine
from app.recording.recover import recover_all
from app.service.connection import Connection
from app.service.options import Options
from tests.soak.numbered import NODES

BITRATE = 1_000_000


def turbine(ports: Sequence[int]) -> Turbine:
    """Three axes on each bus."""
    buses = tuple(BusConfig(f"can{n}", f"socketcand:127.0.0.1:{port}", BITRATE) for n, port in enumerate(ports))
    stations = []
    for blade, node in enumerate(NODES, 1):
        devices = tuple(
            Device(f"wtg-07/blade-{blade}/pmc-{n}", f"PMC {n}", "oat-pmc", bus.name, node)
            for n, bus in enumerate(buses)
        )
        stations.append(Station(f"wtg-07/blade-{blade}", f"Blade {blade}", blade, devices))
    return Turbine("wtg-07", "WTG-07", buses, tuple(stations))


def connection_of(folder: Path, ports: Sequence[int]) -> Connection:
    """As ``hubside serve`` makes it."""
    descriptions = {"oat-pmc": load_builtin("oat-pmc")}
    return Connection(turbine(ports), descriptions, Options("soak", folder, listen_s=0.0))


async def record_for_ever(folder: Path, ports: Sequence[int]) -> None:
    async with connection_of(folder, ports):
        await asyncio.Event().wait()


async def record_to_the_end(folder: Path, ports: Sequence[int]) -> dict[str, int]:
    """Until no bus is there any more; what was counted."""
    connection = connection_of(folder, ports)
    async with connection:
        while any(link.status.state is not LinkState.LOST for link in connection.buses.values()):  # noqa: ASYNC110
            await asyncio.sleep(0.1)
    status = connection.recorded
    heard = sum(link.frames for link in connection.buses.values())
    return {"frames": status.frames, "lost": status.lost, "heard": heard, "cpu_ms": time.process_time_ns() // 1_000_000}


def _begin(request: dict[str, Any]) -> int:
    """A copy of this process that records; its number. The copy itself never comes back from here."""
    number = os.fork()
    if number:
        return number
    try:
        if "recover" in request:
            recover_all(Path(request["recover"]), time.time_ns())
        else:
            asyncio.run(record_for_ever(Path(request["folder"]), request["ports"]))
    finally:
        os._exit(1)


def main() -> None:
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    if len(sys.argv) > 1:
        spare_collector()
        ports = [int(port) for port in sys.argv[2:]]
        print(json.dumps(asyncio.run(record_to_the_end(Path(sys.argv[1]), ports))), flush=True)
        return
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # those that were killed leave no zombies
    load_builtin("oat-pmc")
    spare_collector()
    print(json.dumps({"ready": True}), flush=True)
    for line in sys.stdin:
        print(json.dumps({"pid": _begin(json.loads(line))}), flush=True)


if __name__ == "__main__":
    main()
