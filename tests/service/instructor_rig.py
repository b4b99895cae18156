"""Twins of this process under control, as ``hubside demo`` has those of another: the real server, the real client."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event

from app.cli.control_client import ControlClient
from app.model.fault import FaultOrder
from app.twins.control_server import ControlServer
from app.twins.faults import Instructor
from tests.service.conftest import Served

TOKEN = "secret of these twins"
SHORT = 'title = "Short"\nduration_s = 0.3\n[[event]]\nat_s = 0.0\nfault = "brake_stuck"\nblade = 3\n'
LONG = 'title = "Long"\nduration_s = 600.0\nseed = 7\nnote = "Watch the brake."\n'
DEADLINE_S = 20.0


@dataclass
class Control:
    """Running twins: how they are told from here, and from elsewhere."""

    served: Served
    instructor: Instructor
    server: ControlServer
    client: ControlClient

    def from_elsewhere(self, order: FaultOrder) -> None:
        """Somebody else, on the command line say, puts a fault in."""
        done = Event()

        def put_in() -> None:
            self.instructor.inject(order)
            done.set()

        self.served.thread.call_soon(put_in)
        assert done.wait(DEADLINE_S)


@asynccontextmanager
async def controlled(served: Served, folder: Path) -> AsyncIterator[Control]:
    """``served`` under control, with two scenarios."""
    scenarios = folder / "scenarios"
    scenarios.mkdir()
    (scenarios / "short.toml").write_text(SHORT, encoding="utf-8")
    (scenarios / "long.toml").write_text(LONG, encoding="utf-8")
    instructor = Instructor(served.turbine, served.line, None, 1)
    with ControlServer(served.thread, instructor, TOKEN, scenarios) as server:
        assert server.problems == []
        client = ControlClient(server.address, TOKEN, served.address, answer_s=2.0)
        try:
            yield Control(served, instructor, server, client)
        finally:
            await client.close()
