"""Other people's tools on the same bus: canopen's client, python-can's logger and player."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import canopen
import pytest

from app.drivers.contract import LinkState
from app.errors import NoAnswerError
from app.model.address import Address
from app.model.description_file import builtin_folder, load_builtin
from app.model.site import load_site
from app.recording.content import EventKind
from app.recording.reader import open_recording
from app.service.backup import read_device
from app.service.connection import Connection
from app.service.journal import Kind
from app.service.options import Options
from app.wire.nmt import NmtState
from tests.e2e.conftest import Twins, site_for
from tests.e2e.processes import running

EDS = builtin_folder() / "eds"
LIMIT = Address(0x3110, 1)


async def until(condition: Callable[[], bool], timeout_s: float = 10.0) -> None:
    """Wait for a condition, with an end."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "the condition never came true"
        await asyncio.sleep(0.01)


def connection_to(twins: Twins, recordings: Path | None = None, consent: bool = False) -> Connection:
    (turbine,) = load_site(twins.site)
    descriptions = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}
    return Connection(turbine, descriptions, Options("test", recordings, consent=consent, listen_s=0.1))


def test_canopens_own_client_reads_and_writes_our_twins(twins: Twins) -> None:
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=twins.port, channel="can0")
    try:
        pmm = network.add_node(1, str(EDS / "oat_pmm.eds"))
        pmc = network.add_node(11, str(EDS / "oat_pmc.eds"))
        for node in (pmm, pmc):
            node.sdo.RESPONSE_TIMEOUT = 5.0
            node.nmt.wait_for_heartbeat(timeout=10)
        assert pmm.sdo[0x1008].raw == "HUBSIDE TWIN PMM", "a segmented upload"
        assert pmm.sdo[0x3110][1].raw == 500
        pmm.sdo[0x3110][1].raw = 480
        assert pmm.sdo[0x3110][1].raw == 480
        with pmm.sdo[0x1008].open("rb", block_transfer=True) as stream:
            assert stream.read() == b"HUBSIDE TWIN PMM", "a block upload"
        assert pmc.sdo[0x6064].raw == 8000
        for index, sub, data, code in (
            (0x4711, 0, None, 0x06020000),
            (0x3110, 9, None, 0x06090011),
            (0x3000, 0, b"\1", 0x06010002),
            (0x3110, 1, b"\1", 0x06070013),
            (0x3110, 1, b"\1\2\3\4", 0x06070012),
        ):
            with pytest.raises(canopen.SdoAbortedError) as aborted:
                pmm.sdo.upload(index, sub) if data is None else pmm.sdo.download(index, sub, data)
            assert aborted.value.code == code
        pmc.nmt.state = "OPERATIONAL"
        pmc.nmt.wait_for_heartbeat(timeout=5)
        assert pmc.nmt.state == "OPERATIONAL"
    finally:
        network.disconnect()


def interrupted(process: subprocess.Popen[str], tries: int = 10) -> None:
    """Ctrl-C until it ends: python-can takes one that comes in a callback for an error of the bus, and goes on."""
    for _ in range(tries):
        process.send_signal(signal.SIGINT)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(5)
            return
    process.kill()
    raise AssertionError("it did not end")


@contextmanager
def logging_to(log: Path, address: list[str]) -> Iterator[None]:
    """python-can's logger on the bus while the block runs, started when it says that it is connected."""
    logger = subprocess.Popen(
        [sys.executable, "-u", "-m", "can.logger", *address, "-f", str(log)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    started = threading.Event()

    def follow() -> None:
        for line in logger.stdout or ():
            if "Connected to" in line or "Started on" in line:
                started.set()

    reader = threading.Thread(target=follow, daemon=True)
    reader.start()
    try:
        assert started.wait(20), "the logger did not start"
        yield
    finally:
        interrupted(logger)
        reader.join(5)
        if logger.stdout is not None:
            logger.stdout.close()


async def test_python_cans_logger_and_player_beside_us(twins: Twins, tmp_path: Path) -> None:
    """The logger sees what we do; what the player sends is understood by us and told as another master."""
    log = tmp_path / "bus.log"
    address = ["-i", "socketcand", "-c", "can0", "--bus-kwargs", "host=127.0.0.1", f"port={twins.port}"]
    with logging_to(log, address):
        async with connection_to(twins) as connection:
            target = connection.target("wtg-07/blade-1/pmm")
            report = await read_device(connection.driver(target), target)
            assert report.values[LIMIT] == 500

            script = tmp_path / "start.log"
            script.write_text("(1.000000) can0 000#0100\n", encoding="ascii")
            played = await asyncio.to_thread(
                subprocess.run,
                [sys.executable, "-m", "can.player", *address, "-v", str(script)],
                capture_output=True,
                timeout=30,
                check=False,
            )
            assert played.returncode == 0, played.stderr

            def states() -> set[NmtState | None]:
                return {view.state for view in connection.live.nodes()}

            await until(lambda: states() == {NmtState.OPERATIONAL})
            await until(lambda: any(entry.kind.value == "other_master" for entry in connection.journal.latest()))
    seen = {message.arbitration_id for message in can.LogReader(str(log))}
    assert {0x601, 0x581} <= seen, "our requests and the twin's answers"
    assert 0x000 in seen


async def test_a_cut_connection_comes_back_and_is_recorded_as_a_gap(tmp_path: Path) -> None:
    """The bus server dies and returns on the same port: told at once, back within 2 s, written into the recording."""
    state = str(tmp_path / "state")
    with running("twin", "oat", "--can", "socketcand:127.0.0.1:0", "--state", state, "--json") as first:
        address = json.loads(first.wait_for('"address"'))["address"]
        site = site_for(address, tmp_path)
        (turbine,) = load_site(site)
        descriptions = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}
        connection = Connection(turbine, descriptions, Options("test", tmp_path / "rec", listen_s=0.1))
        await connection.open()
        target = connection.target("wtg-07/blade-1/pmm")
        await until(lambda: connection.live.node("can0", 1) is not None)
        assert await connection.driver(target).read(1, LIMIT) == b"\xf4\x01"
    link = connection.buses["can0"]
    await until(lambda: link.status.state is LinkState.LOST, 2.0)
    with pytest.raises(NoAnswerError):
        await connection.driver(target).read(1, LIMIT)
    view = connection.live.value("can0", 1, LIMIT)
    await until(lambda: (now := connection.live.value("can0", 1, LIMIT)) is None or now.stale or now != view)
    with running("twin", "oat", "--can", address, "--state", state, "--json") as second:
        second.wait_for('"address"')
        await until(lambda: link.status.state is LinkState.CONNECTED, 2.0)
        await until(lambda: any(entry.kind is Kind.BUS_BACK for entry in connection.journal.latest()))
        await until(lambda: (node := connection.live.node("can0", 1)) is not None and node.boots > 0)
        assert await connection.driver(target).read(1, LIMIT) == b"\xf4\x01"
        await connection.close()
    (path,) = (tmp_path / "rec").glob("*.mcap")
    with open_recording(path) as recording:
        kinds = [event.kind for event in recording.events()]
    assert EventKind.BUS_LOST in kinds and EventKind.BUS_BACK in kinds
