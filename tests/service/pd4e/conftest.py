"""A PD4-E twin in real time on Modbus TCP, in this process, and a connection to it by its site file."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description_file import load_builtin
from app.model.site import read_site
from app.service.backup import read_device
from app.service.connection import Connection
from app.service.devices import Target
from app.service.options import Options
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import BOOT_NS, Pd4e, Settings
from app.twins.pd4e.server import Pd4eServer

PD4E = load_builtin("nanotec-pd4e")
STATION = "bench-pd4e/bench"
SERVO = f"{STATION}/servo"


@dataclass
class Served:
    """A twin that is served."""

    device: Pd4e
    thread: PacedThread
    address: str

    def holds(self, address: str) -> Raw:
        """What its RAM holds."""
        return self.device.store.at(parse_address(address)).raw

    def stored(self, address: str) -> bytes | None:
        """What its memory holds; None where it holds the default."""
        return self.device.memory.memory.saved.get(parse_address(address))


@contextmanager
def served_twin(variant: str = "pd4-e591", serial: str = "TWIN-0001", state: Path | None = None) -> Iterator[Served]:
    """A twin that has booted."""
    device = Pd4e(PD4E, Settings(variant=variant, serial=serial, state=state))
    device.run_until(BOOT_NS)
    thread = PacedThread(device, time.monotonic_ns)
    with thread, Pd4eServer(thread, device, port=0) as server:
        yield Served(device, thread, f"127.0.0.1:{server.port}")
    assert thread.handler_errors == 0


def site_of(address: str) -> str:
    """A site with one servo."""
    port = address.rpartition(":")[2]
    return (
        'schema = 1\n[turbine.bench-pd4e.bus.lan]\nconnection = "modbus-tcp"\n'
        f'ranges = ["127.0.0.1:{port}"]\n'
        "[turbine.bench-pd4e.station.bench.device]\n"
        f'servo = {{ description = "nanotec-pd4e", node = 1, address = "{address}" }}\n'
    )


def connection_to(address: str, recordings: Path | None = None) -> Connection:
    """Not yet open."""
    (turbine,) = read_site(site_of(address), "bench.toml")
    return Connection(turbine, {PD4E.id: PD4E}, Options("tester", recordings))


async def read_one(connection: Connection, target: Target, address: Address) -> Raw:
    """Read over the wire."""
    report = await read_device(connection.driver(target), target, (address,))
    return report.values[address]


@pytest.fixture
def served() -> Iterator[Served]:
    """A PD4-E591."""
    with served_twin() as one:
        yield one


@pytest.fixture
async def connection(served: Served, tmp_path: Path) -> AsyncIterator[Connection]:
    """Connected, recording."""
    async with connection_to(served.address, tmp_path / "rec") as opened:
        yield opened
