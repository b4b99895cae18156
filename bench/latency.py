"""From a frame on the bus to the message in a WebSocket client, at 20 % and at 100 % bus load.

The real thing: ``hubside serve`` with recording, 3D view and all, beside a turbine controller at work on a simulated
bus of 500 kbit/s in a process of its own. The client subscribes to what the page subscribes to. Every position that an
axis sends is a number of its own; its latency runs from the time that its frame left the bus to the first message that
carries it, or a later one of the same axis, because views tell the latest value only. Both clocks are the host's
monotonic one.

No peer does this: ratio = limit / 99th percentile, the worst of all loads and topics.
"""

from __future__ import annotations

import asyncio
import json
import math
import statistics
import tempfile
import time
from bisect import bisect_left
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NamedTuple
from urllib.parse import urlsplit

import httpx
from websockets.asyncio.client import ClientConnection, connect

from app.wire.can_bits import frame_bits
from bench._load import PMC_NODES, frames
from bench._priority import preferred
from bench._process import Child
from bench._result import Result
from bench._site import write_site

BITRATE: Final = 500_000
LIMITS_S: Final[Mapping[float, float]] = {0.2: 0.050, 1.0: 0.100}
"""Limit of the 99th percentile by bus load."""
MARGIN_S: Final = 20.0
TAIL_S: Final = 0.5
START_S: Final = 6.0
START_LOAD: Final = 0.05
POSITION: Final = "6064"
_NS: Final = 1_000_000_000
_SLUGS: Final = {f"wtg-07/blade-{blade}/pmc": node for blade, node in enumerate(PMC_NODES, 1)}
_STATIONS: Final = {f"wtg-07/blade-{blade}": node for blade, node in enumerate(PMC_NODES, 1)}
TOPICS: Final = ("values", "axes")
"""Those that carry positions."""
SUBSCRIBED: Final = ("link", "nodes", "axes", "events", *(f"values:{slug}" for slug in _SLUGS))
FIRST_CYCLE_STEP: Final = 1_000_000
"""Positions of one load are so far from those of the next."""


class Arrival(NamedTuple):
    """A message that carried the position of ``node`` came at ``t_ns``."""

    t_ns: int
    node: int
    position: int


class LoadRun(NamedTuple):
    """One load: the share of time that the bus was busy, positions sent (node, position, time), arrivals by topic."""

    load: float
    busy: float
    positions: list[tuple[int, int, int]]
    arrivals: dict[str, list[Arrival]]


class Latencies:
    """Times in s from bus to client; ``unseen`` positions never came, nor any later one."""

    def __init__(self, times_s: list[float], unseen: int) -> None:
        self.times_s = sorted(times_s)
        self.unseen = unseen

    def __len__(self) -> int:
        return len(self.times_s) + self.unseen

    def percentile(self, share: float) -> float:
        """The time in s that ``share`` of all do not exceed; infinite where that position never came."""
        rank = max(0, math.ceil(share * len(self)) - 1)
        return self.times_s[rank] if rank < len(self.times_s) else math.inf


def run(full: bool) -> Result:
    """Three rounds of 4 s at each load; nine of 10 s in the long form. The median round counts."""
    return measure(9, 10.0) if full else measure(3, 4.0)


def measure(rounds: int, seconds: float, limits_s: Mapping[float, float] = LIMITS_S) -> Result:
    """Serve, load the bus by turns, and listen."""
    with (
        preferred() as scheduling,
        tempfile.TemporaryDirectory() as name,
        Child("bench._source", "--bitrate", str(BITRATE)) as source,
    ):
        folder = Path(name)
        site = write_site(folder, source.hear()["address"], BITRATE)
        source.tell(count=_frames_in(START_S, START_LOAD), load=START_LOAD)  # the controller is there before us
        source.hear()
        arguments = ("--json", "--data", str(folder / "data"), "serve", "--site", str(site), "--port", "0")
        with Child("app.cli", *arguments, quiet=True) as server:
            url = server.hear()["url"]
            source.hear(START_S + MARGIN_S)
            runs = asyncio.run(_listen_at_loads(source, url, list(limits_s) * rounds, seconds))
            server.terminate()
    lines, ratios = [f"{BITRATE} bit/s, {rounds} rounds of {seconds:g} s at each load; scheduling: {scheduling}"], []
    for load, limit_s in limits_s.items():
        for topic in TOPICS:
            found = [latencies(run.positions, run.arrivals[topic]) for run in runs if run.load == load]
            p99_s = [each.percentile(0.99) for each in found]
            ratios.append(limit_s / statistics.median(p99_s))
            lines.append(
                f"{topic} at {load:.0%} load: p99 {statistics.median(p99_s) * 1e3:.1f} ms "
                f"({', '.join(f'{each * 1e3:.1f}' for each in p99_s)}), limit {limit_s * 1e3:g} ms; median "
                f"{statistics.median(each.percentile(0.5) for each in found) * 1e3:.1f}, worst "
                f"{max(each.percentile(1.0) for each in found) * 1e3:.1f}, {sum(map(len, found))} frames"
            )
    busy = {f"{load:.0%}": [f"{run.busy:.0%}" for run in runs if run.load == load] for load in limits_s}
    lines.append("bus really loaded: " + "; ".join(f"{load}: {' '.join(shares)}" for load, shares in busy.items()))
    return Result(min(ratios), 1.0, tuple(lines))


def latencies(sent: list[tuple[int, int, int]], arrivals: list[Arrival]) -> Latencies:
    """From each position sent (node, position, time in ns) to the first arrival of it or of a later one."""
    times_s, unseen = [], 0
    for node in PMC_NODES:
        mine = [arrival for arrival in arrivals if arrival.node == node]
        positions = [arrival.position for arrival in mine]
        for _, position, t_ns in (each for each in sent if each[0] == node):
            at = bisect_left(positions, position)
            if at < len(mine):
                times_s.append((mine[at].t_ns - t_ns) / _NS)
            else:
                unseen += 1
    return Latencies(times_s, unseen)


async def _listen_at_loads(source: Child, url: str, loads: list[float], seconds: float) -> list[LoadRun]:
    """Put one load after the other on the bus, and keep what comes."""
    runs = []
    socket = await _open(url)
    async with socket:
        await socket.send(json.dumps({"type": "subscribe", "topics": SUBSCRIBED}))
        for n, load in enumerate(loads, 1):
            first_cycle = n * FIRST_CYCLE_STEP
            messages: list[tuple[int, str | bytes]] = []
            listener = asyncio.create_task(_listen(socket, messages))
            source.tell(count=_frames_in(seconds, load), load=load, positions=True, cycle=first_cycle)
            await asyncio.to_thread(source.hear)
            report = await asyncio.to_thread(source.hear, seconds + MARGIN_S)
            await asyncio.sleep(TAIL_S)
            listener.cancel()
            await asyncio.gather(listener, return_exceptions=True)
            busy = report["busy_s"] / report["elapsed_s"]
            runs.append(LoadRun(load, busy, report["positions"], _arrivals(messages, first_cycle)))
    return runs


async def _open(url: str) -> ClientConnection:
    """Take the printed address as a browser does: the cookie first, then the socket."""
    async with httpx.AsyncClient() as client:
        answer = await client.get(url)
    cookies = "; ".join(f"{name}={content}" for name, content in answer.cookies.items())
    origin = f"http://{urlsplit(url).netloc}"
    address = f"ws://{urlsplit(url).netloc}/api/ws"
    headers = {"Cookie": cookies, "Origin": origin}
    return await connect(address, additional_headers=headers, compression=None, max_size=None)


async def _listen(socket: ClientConnection, messages: list[tuple[int, str | bytes]]) -> None:
    async for message in socket:
        messages.append((time.monotonic_ns(), message))


def _arrivals(messages: list[tuple[int, str | bytes]], least: int) -> dict[str, list[Arrival]]:
    """What the messages say of positions from ``least`` on, by topic."""
    found: dict[str, list[Arrival]] = {"values": [], "axes": []}
    for t_ns, text in messages:
        message = json.loads(text)
        data = message["data"]
        if message["type"] == "values" and POSITION in data["values"]:
            found["values"].append(Arrival(t_ns, _SLUGS[data["device"]], data["values"][POSITION]["raw"] or 0))
        elif message["type"] == "axes":
            angles = ((line["station"], line["position_deg"]) for line in data)
            found["axes"] += [Arrival(t_ns, _STATIONS[at], round(deg * 100)) for at, deg in angles if deg is not None]
    return {topic: [each for each in arrivals if each.position >= least] for topic, arrivals in found.items()}


def _frames_in(seconds: float, load: float) -> int:
    """How many frames load the bus to ``load`` for ``seconds``."""
    sample = frames(1000)
    return int(seconds * load * BITRATE * len(sample) / sum(map(frame_bits, sample)))
