"""A real server on a free port, in front of a real connection whose bus is fed with frames by hand."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import httpx
import websockets
from websockets.asyncio.client import ClientConnection, connect

from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.site import load_site
from app.scene.hub import HubScene
from app.service.bench import Bench
from app.service.connection import Connection
from app.service.options import Options
from app.service.replay.replays import Replays
from app.service.sites import Sites
from app.store.store import Store
from app.web.access import Access
from app.web.app import create_app
from app.web.serve import launch_url, open_port, port_of, serve
from app.wire.frame import Can, Direction, Frame
from tests.wire import traffic

ROOT = Path(__file__).resolve().parent.parent.parent
BUS = "can0"
DEADLINE_S = 30.0


def make_connection() -> Connection:
    """The turbine of the example site; its bus is not opened, frames come from ``Feeder``."""
    (turbine,) = load_site(ROOT / "docs" / "sites" / "example.toml")
    return Connection(turbine, _descriptions(), Options(person="tester", recordings=None))


def bench_with(connection: Connection, store: Store | None = None, data: Path | None = None) -> Bench:
    """A bench that serves ``connection``."""
    sites = Sites((connection.turbine,), lambda _turbine: _descriptions())
    options = Options("tester", None, data=data)
    bench = Bench(sites, options, store=store, stamper=connection.stamper, journal=connection.journal)
    bench.show(connection)
    return bench


@cache
def _descriptions() -> dict[str, Description]:
    return {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}


@dataclass
class Feeder:
    """Puts frames on the bus of a bench, as its driver's thread does."""

    connection: Connection

    def can(self, can_id: int, data: bytes) -> None:
        """One frame, now."""
        frame = Frame(self.connection.stamper(), BUS, Direction.RX, Can(can_id, data))
        self.connection.buses[BUS].on_frames([frame])

    def read(self, node: int, address: Address, data: bytes) -> None:
        """Somebody reads an object."""
        for frame in traffic.frames(node, traffic.read(address, data)):
            self.can(frame.payload.can_id, frame.payload.data)  # type: ignore[union-attr]

    def write(self, node: int, address: Address, data: bytes) -> None:
        """Somebody writes an object, and the device acknowledges."""
        for frame in traffic.frames(node, traffic.write(address, data)):
            self.can(frame.payload.can_id, frame.payload.data)  # type: ignore[union-attr]

    def heartbeat(self, node: int, state: int) -> None:
        """A heartbeat, or with state 0 the boot-up message."""
        self.can(0x700 + node, bytes((state,)))


@dataclass
class Server:
    """A running server; ``client`` has a session, ``stranger`` has none."""

    port: int
    token: str
    access: Access
    bench: Bench
    connection: Connection
    feeder: Feeder
    client: httpx.AsyncClient
    stranger: httpx.AsyncClient
    replays: Replays

    @property
    def origin(self) -> str:
        """Of pages that this server serves."""
        return f"http://127.0.0.1:{self.port}"

    @property
    def cookie(self) -> str:
        """The session's cookie as a header field."""
        return "; ".join(f"{name}={text}" for name, text in self.client.cookies.items())

    def socket(self, path: str = "/api/ws", called: str | None = None, **options: Any) -> connect:
        """A WebSocket as our own page opens it; ``called`` is the Host that it names."""
        usual = {
            "origin": self.origin,
            "additional_headers": {"Cookie": self.cookie},
            "proxy": None,
            "max_size": None,
            "close_timeout": 1,
            "host": "127.0.0.1",
            "port": self.port,
        }
        return connect(f"ws://{called or f'127.0.0.1:{self.port}'}{path}", **{**usual, **options})


@asynccontextmanager
async def running(
    connection: Connection | None = None,
    scene: HubScene | None = None,
    page: Path | None = None,
    signed_in: bool = True,
    store: Store | None = None,
    data: Path | None = None,
) -> AsyncIterator[Server]:
    """Start a server; stop it at the end."""
    connection = connection or make_connection()
    bench = bench_with(connection, store, data)
    listener = open_port(0)
    port = port_of(listener)
    access = Access(bench.office.sessions, port)
    token = access.issue_token()
    guard = create_app(bench, access, port, scene, "en", page)
    replays: Replays = guard.app.state.replays  # type: ignore[attr-defined]
    async with serve(guard, listener):
        base = f"http://127.0.0.1:{port}"
        async with (
            httpx.AsyncClient(base_url=base, trust_env=False) as client,
            httpx.AsyncClient(base_url=base, trust_env=False) as stranger,
        ):
            if signed_in:
                answer = await client.get(launch_url(port, token))
                assert answer.status_code == 303
            try:
                yield Server(port, token, access, bench, connection, Feeder(connection), client, stranger, replays)
            finally:
                await bench.office.close()


async def denied(opening: connect) -> int:
    """The HTTP status with which a WebSocket is denied; 101 where it opens."""
    try:
        async with opening:
            return 101
    except websockets.InvalidStatus as refused:
        return refused.response.status_code


async def wait_until(holds: Callable[[], bool]) -> None:
    """Until a condition holds, within the deadline."""
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.01)


class Page:
    """What a page hears: messages are kept, and can be waited for."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.heard: list[dict[str, Any]] = []

    async def subscribe(self, *topics: str) -> None:
        """Ask for topics."""
        await self.socket.send(json.dumps({"type": "subscribe", "topics": topics}))

    async def say(self, message: dict[str, Any]) -> None:
        """Send any message."""
        await self.socket.send(json.dumps(message))

    async def next(self) -> dict[str, Any]:
        """The next message."""
        message: dict[str, Any] = json.loads(await asyncio.wait_for(self.socket.recv(), DEADLINE_S))
        self.heard.append(message)
        return message

    async def until(self, kind: str, fits: Callable[[Any], bool] = lambda _data: True) -> dict[str, Any]:
        """The next message of a kind whose data fits."""
        async with asyncio.timeout(DEADLINE_S):
            while True:
                message = await self.next()
                if message["type"] == kind and fits(message["data"]):
                    return message
