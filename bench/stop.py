"""From the press of STOP or FEATHER to the controlword on the bus, while the SDO channel is busy, against its queue.

The real thing: ``hubside serve`` beside twins in a process of their own. It is pressed as the page does, by a request,
and in a real page of a real browser, by the key Esc and the button; its frame is seen by another client of the same
simulated bus. Meanwhile nothing else runs, or a backup of all six devices, or a save of 10 s at every axis, or a
restore of a station; first while the nodes are pre-operational, so that the command goes by SDO, then while they are
operational, by RPDO. The peer sends the same command through the queue of the same driver, as an ordinary write of
6040h: it waits for what runs before it. All clocks are the host's monotonic one; the times of a key count from before
the browser is told of it.

Three axes are told by each press; the last of the three frames counts.
"""

from __future__ import annotations

import asyncio
import math
import statistics
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Final, NamedTuple

import httpx

from app.drivers.can_config import parse_can
from app.drivers.canopen import CanOpenDriver
from app.errors import HubsideError
from app.model.address import Address
from app.model.description import Verify
from app.model.description_file import load_builtin
from app.service.stop import CONTROLWORD, Command
from app.wire.frame import Stamper
from bench._busy import LOOK_S, Busy
from bench._page import PressedPage
from bench._priority import preferred
from bench._process import Child
from bench._result import Result
from bench._site import write_site
from bench._watch import AXES, Watch, word_of
from bench.backup import wait_for

TARGET: Final = 10.0
LIMIT_S: Final = 0.050
BITRATE: Final = 500_000
SAVE_MS: Final = 10_000
MARGIN_S: Final = 30.0
FIRSTLOOK_S: Final = 4.0
"""The server reads all devices first."""
_SAVE: Final = Address(0x1010, 3)


class Run(NamedTuple):
    """Times in s from the press to the last frame."""

    name: str
    times_s: list[float]

    @property
    def p99_s(self) -> float:
        """What 99 of 100 do not exceed."""
        return sorted(self.times_s)[max(0, math.ceil(0.99 * len(self.times_s)) - 1)]


def run(full: bool) -> Result:
    """40 presses in each state, 5 beside saves, one by the peer; in the long form 200, 25 and three."""
    return asyncio.run(measure(200, 3) if full else measure(40, 1))


async def measure(presses: int, peers: int) -> Result:
    """Serve, press, and look at the bus."""
    with preferred() as scheduling, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        faults = [f"eeprom_slow@0s,node={node},save_ms={SAVE_MS}" for node in AXES]
        options = [part for fault in faults for part in ("--fault", fault)]
        arguments = ("--json", "twin", "oat", "--can", "socketcand:127.0.0.1:0", "--bitrate", str(BITRATE), *options)
        with Child("app.cli", *arguments, quiet=True) as twins:
            address = str(twins.hear()["address"]).removeprefix("socketcand:")
            await wait_for(address, {1, 2, 3, *AXES})
            site = write_site(folder, address, BITRATE)
            serving = ("--json", "--data", str(folder / "data"), "serve", "--site", str(site), "--port", "0")
            with Child("app.cli", *serving, quiet=True) as server:
                ours = await _ours(str(server.hear()["url"]), address, presses)
                server.terminate()
            peer = await _peer(address, peers)
            twins.terminate()
    worst = max(run.p99_s for run in ours)
    short = [f"{run.name}: p99 {1e3 * run.p99_s:.1f} ms" for run in ours if run.p99_s > LIMIT_S]
    return Result(
        peer.p99_s / worst,
        TARGET,
        (
            f"three axes, {BITRATE} bit/s, from the press to the last of three frames; scheduling: {scheduling}",
            *(_line(run) for run in ours),
            f"peer, {peer.name}: {', '.join(f'{each:.2f}' for each in peer.times_s)} s",
        ),
        tuple(short),
    )


def _line(run: Run) -> str:
    return (
        f"ours, {run.name}: median {1e3 * statistics.median(run.times_s):.1f} ms, p99 {1e3 * run.p99_s:.1f} ms, "
        f"worst {1e3 * max(run.times_s):.1f} ms, {len(run.times_s)} presses; limit {1e3 * LIMIT_S:.0f} ms"
    )


@asynccontextmanager
async def _watching(address: str) -> AsyncIterator[Watch]:
    driver = _driver(address)
    await driver.connect()
    watch = Watch(driver)
    driver.subscribe(watch.hear)
    try:
        yield watch
    finally:
        await driver.close()


def _driver(address: str) -> CanOpenDriver:
    config = parse_can(f"socketcand:{address}@{BITRATE}")
    driver = CanOpenDriver(config, Stamper(time.time_ns(), time.monotonic_ns), listen_s=0.0, consent=True)
    pmc = load_builtin("oat-pmc")
    for node in AXES:
        driver.set_description(node, pmc)
    return driver


# -- ours -------------------------------------------------------------------------------------


async def _ours(url: str, address: str, presses: int) -> list[Run]:
    base = url.split("/?")[0]
    async with (
        httpx.AsyncClient(base_url=base, trust_env=False, timeout=MARGIN_S) as client,
        _watching(address) as watch,
    ):
        await client.get(url)
        await asyncio.sleep(FIRSTLOOK_S)
        await client.post("/api/live/consent", json={})  # a page has asked for something before it stops anything
        runs, work = [], Busy(client)
        for way in ("by SDO", "by RPDO"):
            if way == "by RPDO":
                watch.start(AXES)
            runs += await _requests(client, watch, work, way, presses)
        runs += await _keys(base, client, watch, work, presses // 2)
        await work.end()
        return runs


async def _requests(client: httpx.AsyncClient, watch: Watch, work: Busy, way: str, presses: int) -> list[Run]:
    """STOP and FEATHER by a request, as the page sends it."""
    runs = []
    for command, name, begin in (
        (Command.STOP, "alone", work.nothing),
        (Command.STOP, "beside a backup", work.backup),
        (Command.STOP, "beside saves", work.saves),
        (Command.STOP, "beside a restore", work.restore),
        (Command.FEATHER, "alone", work.nothing),
        (Command.FEATHER, "beside a backup", work.backup),
    ):
        long = begin in (work.saves, work.restore)  # these take seconds each
        times_s = []
        for _ in range(presses // 8 if long else presses):
            await begin()
            times_s.append(await _press(client, watch, command))
        runs.append(Run(f"{command.name} {way}, {name}", times_s))
    await _press(client, watch, Command.STOP)  # nothing is on its way to feather when the next begins
    return runs


async def _press(client: httpx.AsyncClient, watch: Watch, command: Command) -> float:
    watch.expect(command)
    started_s = time.monotonic()
    answer = asyncio.create_task(client.post(f"/api/live/{command.name.lower()}", json={}))
    took_s = await watch.last(MARGIN_S) - started_s
    (await answer).raise_for_status()
    return took_s


async def _keys(base: str, client: httpx.AsyncClient, watch: Watch, work: Busy, presses: int) -> list[Run]:
    """STOP by Esc while an axis has power, and FEATHER by its button, in a browser."""
    runs = []
    async with PressedPage.at(base, client) as page:
        for name, begin in (("alone", work.nothing), ("beside a backup", work.backup)):
            stop_s, feather_s = [], []
            for _ in range(presses):
                await work.over()  # there is one SDO channel to a node, and the next line wants it
                await watch.enable()
                await page.until_moving()
                await begin()
                watch.expect(Command.STOP)
                pressed_s = await page.escape()
                stop_s.append(await watch.last(MARGIN_S) - pressed_s)
                await begin()
                watch.expect(Command.FEATHER)
                pressed_s = await page.click("feather")
                feather_s.append(await watch.last(MARGIN_S) - pressed_s)
                await _press(client, watch, Command.STOP)
            runs += [Run(f"STOP by Esc, {name}", stop_s), Run(f"FEATHER by its button, {name}", feather_s)]
    return runs


# -- the peer ---------------------------------------------------------------------------------


async def _peer(address: str, presses: int) -> Run:
    """The same command as an ordinary write, behind a save that runs."""
    times_s = []
    async with _watching(address) as watch:
        driver = _driver(address)
        await driver.connect()
        try:
            for _ in range(presses):
                saves = [asyncio.create_task(driver.write(node, _SAVE, b"save", verify=Verify.ACK)) for node in AXES]
                await asyncio.sleep(2 * LOOK_S)
                watch.expect(Command.STOP)
                started_s = time.monotonic()
                stops = [driver.write(node, CONTROLWORD, word_of(Command.STOP), verify=Verify.ACK) for node in AXES]
                done = asyncio.gather(*stops, return_exceptions=True)
                times_s.append(await watch.last(3 * MARGIN_S) - started_s)
                await done
                for save in saves:
                    with suppress(HubsideError):
                        await save
        finally:
            await driver.close()
    return Run("as an ordinary write behind a save of 10 s", times_s)
