"""A bench with the twin of a drive on Modbus TCP: a bus without PDOs, heartbeats and NMT states."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from pyModbusTCP.client import ModbusClient

from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.service.connection import Connection
from app.service.options import Options
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import BOOT_NS, Pd4e, Settings
from app.twins.pd4e.server import Pd4eServer
from app.wire.modbus.answers import ObjectRead, decode_answer
from app.wire.modbus.requests import ReadObject
from tests.drivers.modbus_server import PD4E

PATIENCE_S = 10.0
AXIS = "bench-pd4e/bench/servo"
SITE = """schema = 1
[turbine.bench-pd4e.bus.lan]
connection = "modbus-tcp"
ranges = ["127.0.0.1:{port}"]
[turbine.bench-pd4e.station.bench.device.servo]
description = "nanotec-pd4e"
node = 1
address = "127.0.0.1:{port}"
{more}
"""


@dataclass
class Bench:
    """A served twin. ``witness`` is a client of somebody else's: it asks the drive itself."""

    device: Pd4e
    thread: PacedThread
    server: Pd4eServer

    def on_thread(self, work: Callable[[], None]) -> None:
        """Have ``work`` done on the twin's own thread, and wait for it."""
        done = Event()

        def run() -> None:
            work()
            done.set()

        self.thread.call_soon(run)
        assert done.wait(PATIENCE_S)

    def cut(self) -> None:
        """End every connection; the twin goes on with what it does."""
        self.on_thread(self.server._end_all)

    def witness(self, address: int, sub: int = 0, size: int = 4, signed: bool = True) -> int:
        """What an object holds, by a library that knows nothing of this project."""
        client = ModbusClient("127.0.0.1", self.server.port, unit_id=0, timeout=PATIENCE_S)
        try:
            pdu = client.custom_request(ReadObject(Address(address, sub), size).pdu())
        finally:
            client.close()
        assert pdu is not None
        answer = decode_answer(bytes(pdu))
        assert isinstance(answer, ObjectRead), answer
        return int.from_bytes(answer.data, "little", signed=signed)


@contextmanager
def served(real: bool = False) -> Iterator[Bench]:
    """A twin in real time that has booted. ``real``: it does not say that it is one."""
    device = Pd4e(PD4E, Settings())
    if real:
        name = device.store.find(0x1008)
        assert name is not None
        name.source = lambda: "PD4-E591L42-E-65-4"
    device.run_until(BOOT_NS)
    thread = PacedThread(device, time.monotonic_ns)
    with thread, Pd4eServer(thread, device, port=0) as server:
        yield Bench(device, thread, server)
    assert thread.handler_errors == 0


@asynccontextmanager
async def bench_connection(bench: Bench, folder: Path, more: str = "") -> AsyncIterator[Connection]:
    """Connected to it, recording."""
    (turbine,) = read_site(SITE.format(port=bench.server.port, more=more), "site.toml")
    async with Connection(turbine, {"nanotec-pd4e": load_builtin("nanotec-pd4e")}, Options("tester", folder)) as one:
        yield one
