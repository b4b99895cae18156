"""Whatever happens to page, network, server and bus, the axis stops: how soon it begins, and when it stands.

The server is a process of its own, the twin is in this one, between them a wire. The page is played by its socket and
requests, through a relay that can be cut. Times are taken at the twin itself, 0 is the event.
"""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from email.utils import parsedate_to_datetime
from pathlib import Path
from time import monotonic
from typing import Any, Final

import httpx
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Origin

from app.service.motion.dead_man import BEAT_S
from tests.e2e.conftest import site_for
from tests.e2e.processes import Process, running
from tests.service.conftest import Served
from tests.service.motion.rig import AXIS

pytestmark = [pytest.mark.alone, pytest.mark.timeout(180)]  # times are taken: it wants the machine for itself

BEGIN_S: Final = 0.5
"""The longest until the stop begins."""
SPEED_DPS: Final = -4.0
LOOK_S: Final = 0.002
NO_MORE: Final = 0.02
"""Slower than this, as a share of the speed, is standing."""
QUIET_S: Final = 2.0
"""An axis that stood for so long does not move any more."""
CLOCK: Final = """
import os, time

def moved(really, unit):
    return lambda: really() + (3600 * unit if os.path.exists(os.environ["CLOCK_MOVED"]) else 0)

time.time, time.time_ns = moved(time.time, 1), moved(time.time_ns, 1_000_000_000)
"""
"""Python runs it before anything else: the wall clock is an hour ahead as soon as the file is there."""
URL: Final = f"/api/live/devices/{AXIS}/motion"


@dataclass
class Relay:
    """A TCP connection between page and server that can fall silent as a pulled cable does: nothing is closed."""

    target: int
    port: int = 0
    cut: bool = False
    _server: asyncio.Server | None = None
    _tasks: set[asyncio.Task[None]] = field(default_factory=set)
    _writers: list[asyncio.StreamWriter] = field(default_factory=list)

    async def open(self) -> None:
        """Listen on a free port."""
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """End."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for writer in self._writers:
            writer.close()
            with suppress(OSError):
                await writer.wait_closed()
        if self._server is not None:
            self._server.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        there, away = await asyncio.open_connection("127.0.0.1", self.target)
        self._writers += [writer, away]
        for source, sink in ((reader, away), (there, writer)):
            task = asyncio.create_task(self._pass_on(source, sink))
            self._tasks.add(task)

    async def _pass_on(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            while data := await source.read(65536):
                if not self.cut:
                    sink.write(data)
                    await sink.drain()
            sink.close()


@dataclass
class Page:
    """A page of the server, signed in: its requests, its socket, its beats."""

    name: str
    client: httpx.AsyncClient
    socket: ClientConnection
    fence: int = 0
    holding: bool = False
    number: int = 0
    order: int = 0
    held_order: int = 0
    beating: asyncio.Task[None] | None = None

    async def post(self, path: str, **body: Any) -> httpx.Response:
        """A request; an order gets its number."""
        if path.startswith(URL) and "order" not in body:
            self.order += 1
            body["order"] = self.order
        return await self.client.post(path, json=body, timeout=60.0)

    async def take(self) -> None:
        """Take the lease and confirm."""
        answer = await self.post("/api/live/motion/lease", page=self.name)
        assert answer.status_code == 200, answer.text
        self.fence = answer.json()["fence"]
        self.beating = asyncio.create_task(self._beat_forever())
        await self.post("/api/live/motion/confirm", fence=self.fence, rotor_locked=True, people_out=True)

    async def hold(self, holding: bool) -> None:
        """Press, or let go."""
        self.holding = holding
        self.held_order = self.order + 1 if holding else 0
        await self._beat()

    async def freeze(self) -> None:
        """Not a beat any more, but all connections stay."""
        if self.beating is not None:
            self.beating.cancel()
            await asyncio.gather(self.beating, return_exceptions=True)

    async def die(self) -> None:
        """The process is gone: its sockets are closed by the system."""
        await self.freeze()
        self.socket.transport.abort()

    async def _beat(self) -> None:
        self.number += 1
        beat = {"type": "beat", "page": self.name, "fence": self.fence, "number": self.number, "holding": self.holding}
        beat |= {"order": self.held_order, "sent_ms": 1000 * monotonic()}
        await self.socket.send(json.dumps(beat))

    async def _beat_forever(self) -> None:
        with suppress(Exception):
            while True:
                await self._beat()
                await asyncio.sleep(BEAT_S)


@dataclass
class Stage:
    """Twin, server, the relay and a page whose axis turns."""

    served: Served
    process: Process
    relay: Relay
    page: Page
    motion: asyncio.Task[httpx.Response]
    open_page: Callable[[str], Awaitable[Page]]

    @property
    def speed(self) -> float:
        """Of the motor, as a share of what was ordered."""
        return abs(self.served.turbine.blades[0].pmc.drive.plant.speed_rad_s) / self.full

    full: float = 1.0


@asynccontextmanager
async def turning(served: Served, folder: Path, **environment: str) -> AsyncIterator[Stage]:
    """An axis that a page holds in motion."""
    site = site_for(served.address, folder)
    command = ("serve", "--site", str(site), "--port", "0", "--data", str(folder / "data"), "--json")
    with running(*command, **environment) as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        port = int(url.split(":")[2].split("/")[0])
        relay = Relay(port)
        await relay.open()
        pages: list[Page] = []
        async with httpx.AsyncClient(base_url=f"http://127.0.0.1:{port}", trust_env=False) as client:
            assert (await client.get(url)).status_code == 303

            async def open_page(name: str) -> Page:
                socket = await connect(
                    f"ws://127.0.0.1:{port}/api/ws",
                    host="127.0.0.1",
                    port=relay.port,
                    origin=Origin(f"http://127.0.0.1:{port}"),
                    additional_headers={"Cookie": "; ".join(f"{n}={v}" for n, v in client.cookies.items())},
                    proxy=None,
                    max_size=None,
                    close_timeout=1,
                )
                page = Page(name, client, socket)
                pages.append(page)
                return page

            page = await open_page("held")
            await page.take()
            stage = Stage(served, process, relay, page, asyncio.create_task(_nothing()), open_page)
            try:
                await _start(stage)
                yield stage
            finally:
                stage.motion.cancel()
                await asyncio.gather(stage.motion, return_exceptions=True)
                for each in pages:
                    await each.freeze()
                    with suppress(Exception):
                        await asyncio.wait_for(each.socket.close(), 1.0)
                    each.socket.transport.abort()
                await asyncio.sleep(0)  # what was aborted is closed a turn later
                await relay.close()


async def _nothing() -> httpx.Response:
    return httpx.Response(204)


async def _start(stage: Stage) -> None:
    page = stage.page
    async with asyncio.timeout(60.0):
        # The first look reads all devices; until then rules and blades are not known.
        while True:
            answer = await page.client.get(f"{URL}/interlocks")
            if answer.status_code == 200 and not any(one["holds_back"] for one in answer.json()):
                break
            await asyncio.sleep(0.2)
    await page.hold(True)
    answer = await page.post(f"{URL}/prepare", fence=page.fence)
    assert answer.status_code == 200, answer.text
    await page.hold(False)
    await page.hold(True)
    stage.motion = asyncio.create_task(page.post(f"{URL}/jog", fence=page.fence, speed=SPEED_DPS))
    pmc = stage.served.turbine.blades[0].pmc
    await _until(lambda: pmc.drive.velocity < 0.95 * SPEED_DPS * 100)
    stage.full = abs(pmc.drive.plant.speed_rad_s)


async def _until(holds: Callable[[], bool], timeout_s: float = 20.0) -> float:
    started_s = monotonic()
    async with asyncio.timeout(timeout_s):
        while not holds():  # noqa: ASYNC110  the twin has no event for it
            await asyncio.sleep(LOOK_S)
    return monotonic() - started_s


async def stopped(stage: Stage, what: str) -> None:
    """The stop begins soon enough, and the axis comes to stand for good; the times are printed."""
    event_s = monotonic()
    begin_s = await _until(lambda: stage.speed < 0.9)
    stand_s = begin_s + await _until(lambda: stage.speed < NO_MORE)
    last_s = await _rest(stage) - event_s
    print(
        f"STOP {what}: begins {1000 * begin_s:.0f} ms, stands {1000 * stand_s:.0f} ms, for good {1000 * last_s:.0f} ms"
    )
    assert begin_s <= BEGIN_S


async def _rest(stage: Stage) -> float:
    """When it was last seen to move, by the monotonic clock: a fault may have all blades drive to feather."""
    last_s = monotonic()
    async with asyncio.timeout(60.0):
        while monotonic() - last_s < QUIET_S:
            if stage.speed >= NO_MORE:
                last_s = monotonic()
            await asyncio.sleep(LOOK_S)
    return last_s


async def test_the_tab_is_killed(served: Served, tmp_path: Path) -> None:
    async with turning(served, tmp_path) as stage:
        await stage.page.die()
        await stopped(stage, "tab killed")


async def test_the_browser_freezes(served: Served, tmp_path: Path) -> None:
    async with turning(served, tmp_path) as stage:
        await stage.page.freeze()
        await stopped(stage, "browser frozen")


async def test_the_network_is_cut(served: Served, tmp_path: Path) -> None:
    async with turning(served, tmp_path) as stage:
        stage.relay.cut = True
        await stopped(stage, "network cut")


async def test_the_wall_clock_is_set(served: Served, tmp_path: Path) -> None:
    (tmp_path / "python").mkdir()
    (tmp_path / "python" / "sitecustomize.py").write_text(CLOCK)
    moved = tmp_path / "moved"
    async with turning(served, tmp_path, PYTHONPATH=str(tmp_path / "python"), CLOCK_MOVED=str(moved)) as stage:
        before_s = await _server_s(stage)
        moved.touch()
        async with asyncio.timeout(5.0):
            while await _server_s(stage) - before_s < 3600:
                assert stage.speed > 0.9, "who holds it is not disturbed"
                await asyncio.sleep(0.1)
        await stage.page.freeze()
        await stopped(stage, "wall clock set, then the browser frozen")


async def _server_s(stage: Stage) -> float:
    """The wall clock of the server: its answers bear it."""
    answer = await stage.page.client.get("/api/live/motion")
    return parsedate_to_datetime(answer.headers["date"]).timestamp()


async def test_the_button_is_let_go(served: Served, tmp_path: Path) -> None:
    async with turning(served, tmp_path) as stage:
        await stage.page.hold(False)
        await stopped(stage, "let go")
        assert (await stage.motion).json() == {"why": "released"}


@pytest.mark.parametrize(("number", "what"), [(signal.SIGSTOP, "server SIGSTOP"), (signal.SIGKILL, "server SIGKILL")])
async def test_the_server_is_gone(served: Served, tmp_path: Path, number: signal.Signals, what: str) -> None:
    async with turning(served, tmp_path) as stage:
        pid = stage.process.popen.pid
        os.kill(pid, number)
        try:
            await stopped(stage, what)
        finally:
            if number is signal.SIGSTOP:
                os.kill(pid, signal.SIGCONT)


async def test_the_cable_is_pulled(served: Served, tmp_path: Path) -> None:
    async with turning(served, tmp_path) as stage:
        served.cut()
        await stopped(stage, "cable out")
        ended = await stage.page.client.get("/api/live/motion")
        assert ended.json()["prepared"] == [], "each must prove it anew"


async def test_a_second_page_and_old_orders_do_nothing(served: Served, tmp_path: Path) -> None:
    async with turning(served, tmp_path) as stage:
        held, other = stage.page, await stage.open_page("other")
        answer = await other.post("/api/live/motion/lease", page="other")
        assert (answer.status_code, answer.json()["code"]) == (409, "lease_held")
        for fence, order, code in ((held.fence - 1, 99, "lease"), (held.fence, held.order, "old_order")):
            answer = await other.post(f"{URL}/jog", fence=fence, order=order, speed=4.0)
            assert (answer.status_code, answer.json()["code"]) == (409, code)
        assert stage.speed > 0.9, "who holds it is not disturbed"
        await held.freeze()
        other.fence, other.number = held.fence, 10_000
        await other.hold(True)  # the number of the lease alone holds nothing: another page has it
        await stopped(stage, "browser frozen, another page beats")
        answer = await held.post(f"{URL}/jog", fence=held.fence, order=held.order, speed=SPEED_DPS)
        assert answer.json()["code"] == "old_order"
        answer = await held.post(f"{URL}/jog", fence=held.fence, speed=SPEED_DPS)
        assert answer.json()["code"] == "not_held"
        await asyncio.sleep(0.3)
        assert stage.speed < NO_MORE


async def test_nothing_moves_without_a_lease(served: Served, tmp_path: Path) -> None:
    async with turning(served, tmp_path) as stage:
        page = stage.page
        answer = await page.post("/api/live/motion/lease/give-back", fence=page.fence)
        assert answer.status_code == 200
        await stopped(stage, "lease given back")
        answer = await page.post(f"{URL}/jog", fence=page.fence, speed=SPEED_DPS)
        assert (answer.status_code, answer.json()["code"]) == (409, "lease_needed")
        await asyncio.sleep(0.3)
        assert stage.speed < NO_MORE
