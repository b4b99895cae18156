"""``hubside serve`` on a disk that gets full at random, and all that must go on meanwhile."""

from __future__ import annotations

import asyncio
import os
import time
from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import httpx
import numpy as np
from websockets.asyncio.client import connect

from app.recording.content import EventKind
from app.recording.reader import open_recording
from app.recording.recover import RecoveryKind, recover_all
from bench._process import Child
from tests.e2e.conftest import Twins
from tests.e2e.processes import HUBSIDE, USUAL
from tests.recording.rig import by_mcap, files
from tests.soak.killing import START_TIMEOUT_S, recorded
from tests.soak.numbered import wrong
from tests.soak.small_disk import IN_NAMESPACE, can_mount
from tests.web.rig import Page

FEEDER_BUS: Final = "can1"
BITRATE: Final = 1_000_000
SPACE_LOW_BYTES: Final = 600 << 20
"""Room enough to close the file, and less than the recorder wants to be free."""
MOST_LEFT_BYTES: Final = 1 << 16
"""At random up to this: some chunks fit, and one does not."""
FEEDER_RATE: Final = 1500
LONGEST_S: Final = 3600.0
END_S: Final = 60.0
FRAMES_ON: Final = 300
REASONS: Final = {"recording_stopped.space_low", "recording_stopped.disk_error"}


class Served(NamedTuple):
    """The page's view of a served turbine, and the hand on its disk."""

    client: httpx.AsyncClient
    page: Page
    disk: Child

    def leave(self, free_bytes: int | None) -> None:
        """Leave so much free space; None for plenty."""
        self.disk.tell(leave=free_bytes)
        self.disk.hear(START_TIMEOUT_S)


def site_with(twins: Twins, port: int, folder: Path) -> Path:
    """The twins' turbine with one more bus."""
    more = f'\n[turbine.wtg-07.bus.{FEEDER_BUS}]\nconnection = "socketcand:127.0.0.1:{port}"\nbitrate = {BITRATE}\n'
    path = folder / "two-buses.toml"
    path.write_text(twins.site.read_text(encoding="utf-8") + more, encoding="utf-8")
    return path


@asynccontextmanager
async def served(site: Path, folder: Path, mounted: bool) -> AsyncIterator[Served]:
    """``hubside serve`` with its recordings on a small disk, see ``small_disk``; they end up in ``folder / "kept"``."""
    data, kept = folder / "data", folder / "kept"
    serve = (*HUBSIDE, "--data", str(data), "serve", "--site", str(site), "--port", "0", "--consent", "--json")
    program = ("tmpfs" if mounted else "limit", str(data / "recordings"), str(kept), *serve)
    environment = {**os.environ, **USUAL}
    before = IN_NAMESPACE if mounted else ()
    with Child("tests.soak.small_disk", *program, before=before, environment=environment) as disk:
        url = disk.hear(START_TIMEOUT_S)["url"]
        origin = url.split("/?")[0]
        async with httpx.AsyncClient(base_url=origin, trust_env=False, timeout=30) as client:
            await client.get(url)
            cookie = "; ".join(f"{name}={text}" for name, text in client.cookies.items())
            address = origin.replace("http", "ws") + "/api/ws"
            async with connect(address, origin=origin, additional_headers={"Cookie": cookie}, proxy=None) as socket:
                page = Page(socket)
                await page.subscribe("link", "events")
                yield Served(client, page, disk)


async def fill(bench: Served, free_bytes: int) -> str:
    """The disk is full at some byte, then no longer; what the page is told meanwhile. Gives the reason of the stop."""
    page = bench.page
    before = await _link(page, lambda link: link["recording"]["state"] == "on")
    bench.leave(free_bytes)
    stopped = await _link(page, lambda link: link["recording"]["state"] == "stopped")
    reason: str = stopped["recording"]["reason"]
    assert reason in REASONS
    assert stopped["state"] == "connected"
    await _stop_all(bench.client)
    on = await _link(page, lambda link: link["frames"] > stopped["frames"] + FRAMES_ON)
    assert on["recording"]["state"] == "stopped" and on["recording"]["frames"] == stopped["recording"]["frames"]
    bench.leave(None)
    back = await _link(page, lambda link: link["recording"]["state"] == "on")
    assert back["recording"]["file"] != before["recording"]["file"]
    assert back["recording"]["lost"] > before["recording"]["lost"]
    await _told(page, "journal.recording_stopped", "reason_key", reason)
    await _told(page, "journal.recording_started", "file", back["recording"]["file"])
    return reason


async def _stop_all(client: httpx.AsyncClient) -> None:
    """STOP is confirmed by every axis. Twins on a busy machine may answer too late: then it is pressed again."""
    async with asyncio.timeout(END_S):
        while True:
            axes = (await client.post("/api/live/stop", json={})).json()["axes"]
            if axes and all(axis["error"] is None and axis["confirmed_t_ns"] for axis in axes):
                return


async def _link(page: Page, fits: Callable[[Any], bool]) -> dict[str, Any]:
    """The next state of the link that fits."""
    async with asyncio.timeout(END_S):
        while True:
            message = await page.next()
            if message["type"] == "link" and fits(message["data"]):
                data: dict[str, Any] = message["data"]
                return data


async def _told(page: Page, text_key: str, name: str, text: str) -> None:
    """Wait for an event, which may have come already."""

    def fits(message: dict[str, Any]) -> bool:
        data = message["data"]
        return bool(message["type"] == "event" and data["text_key"] == text_key and data["details"].get(name) == text)

    async with asyncio.timeout(END_S):
        while not any(map(fits, page.heard)):
            await page.next()


def shortfalls(folder: Path, sent: int) -> Iterator[str]:
    """What is wrong with the files of a recording of ``sent`` numbered frames on a disk that was full at times."""
    for recovery in recover_all(folder, time.time_ns()):
        if recovery.kind is not RecoveryKind.CLOSED or recovery.lost_bytes:
            yield f"damaged by the full disk: {recovery}"
    lost, last_lost = Counter[str](), 0
    kinds: set[EventKind] = set()
    for path in files(folder):
        with open_recording(path, strict=True) as recording:
            ours = sum(count for topic, count in recording.topics.items() if topic.startswith("/can"))
            for event in recording.events():
                kinds.add(event.kind)
                if event.kind is EventKind.FRAMES_LOST:
                    lost[event.bus] += event.details["count"]
            last_lost = recording.totals.lost if recording.totals else last_lost
        if ours != sum(topic.startswith("/can") for topic, _, _ in by_mcap(path)):
            yield f"{path.name}: mcap reads another number of frames"
    columns = recorded(folder, FEEDER_BUS)
    if wrong(columns) or np.any(np.diff(columns.numbers.astype(np.int64)) <= 0):
        yield "frames are not what was sent, or in another order"
    if len(columns.numbers) + lost[FEEDER_BUS] != sent:
        yield f"{sent} sent, {len(columns.numbers)} recorded, {lost[FEEDER_BUS]} counted as lost"
    if lost.total() != last_lost:
        yield f"{lost.total()} lost by the events, {last_lost} by the totals"
    if EventKind.RESUMED not in kinds or not kinds & {EventKind.SPACE_LOW, EventKind.DISK_ERROR}:
        yield f"only {kinds} are noted"


async def fill_often(twins: Twins, folder: Path, left_bytes: Sequence[int]) -> str:
    """A round for each of ``left_bytes``. Gives why it stopped each time; raises AssertionError where it fell short."""
    with Child("tests.soak.feeder", str(folder / "ticks"), str(FEEDER_RATE), str(LONGEST_S), "1") as feeder:
        (port,) = feeder.hear(START_TIMEOUT_S)["ports"]
        async with served(site_with(twins, port, folder), folder, can_mount()) as bench:
            reasons = [await fill(bench, free_bytes) for free_bytes in left_bytes]
            feeder.tell(stop=True)
            await _link(bench.page, lambda link: bool(link["state"] == "lost"))  # it has all there was
        sent = feeder.hear(START_TIMEOUT_S)["sent"][0]
    assert list(shortfalls(folder / "kept", sent)) == []
    return f"{len(left_bytes)} times full, stopped for {dict(Counter(reasons))}; {sent} frames sent"
