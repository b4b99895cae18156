"""A connection to twins on a served line in this process, so that a test can spoil single frames on the wire."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path
from threading import Event

import pytest

from app.model.description_file import load_builtin
from app.model.site import load_site
from app.service.connection import Connection
from app.service.options import Options
from app.twins.line import CanLine, Fault
from app.twins.line_thread import LineThread
from app.twins.socketcand_server import SocketcandServer
from app.twins.turbine import Settings, Turbine
from tests.e2e.conftest import site_for

MS = 1_000_000


@dataclass
class Served:
    """A served line; ``spoil`` puts a fault on it from any thread."""

    line: CanLine
    thread: LineThread
    turbine: Turbine
    address: str
    server: SocketcandServer

    def cut(self) -> None:
        """End every client's connection, as a cable does that is pulled; it may connect again at once."""

        def close_all() -> None:
            for client in tuple(self.server._clients):
                client.close("cut")

        self.thread.call_soon(close_all)

    def spoil(self, fault: Fault) -> None:
        """Have one coming frame dropped, delayed or doubled; the fault waits for it when this returns."""
        ready = Event()

        def put() -> None:
            self.line.inject(fault)
            ready.set()

        self.thread.call_soon(put)
        assert ready.wait(10.0)


@pytest.fixture
def served() -> Iterator[Served]:
    """Six devices that boot and save quickly."""
    line = CanLine(500_000)
    turbine = Turbine(
        line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), Settings(boot_ns=50 * MS, save_ns=50 * MS)
    )
    turbine.power_on(line.now_ns)
    with LineThread(line) as thread, SocketcandServer(thread) as server:
        yield Served(line, thread, turbine, f"socketcand:127.0.0.1:{server.port}", server)
    assert thread.handler_errors == 0


@pytest.fixture
async def connection(served: Served, tmp_path: Path) -> AsyncIterator[Connection]:
    """Connected to all six, recording."""
    (turbine,) = load_site(site_for(served.address, tmp_path))
    descriptions = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}
    async with Connection(turbine, descriptions, Options("tester", tmp_path / "rec", listen_s=0.2)) as opened:
        yield opened
