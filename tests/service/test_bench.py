"""Connections follow one another at one bench; time, journal and the people at work go on."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import can
import pytest

from app.errors import BusOpenError, NotConnectedError, UsageError
from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.site import Turbine, load_site
from app.recording.reader import open_recording
from app.service.bench import Bench
from app.service.journal import Kind
from app.service.link import bench_line
from app.service.options import Options
from app.service.scope.order import ScopeOrder, TriggerOrder
from app.service.sites import Sites
from tests.e2e.conftest import site_for
from tests.service.conftest import Served

POSITION = Address(0x6064)


def describe(_turbine: Turbine) -> dict[str, Description]:
    return {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}


@pytest.fixture
async def bench(served: Served, tmp_path: Path) -> AsyncIterator[Bench]:
    """Knows the turbine on the served line, and one whose adapter nobody serves."""
    site = site_for(served.address, tmp_path)
    text = site.read_text(encoding="utf-8").replace("wtg-07", "wtg-08").replace("schema = 1", "")
    (here,) = load_site(site)
    other = tmp_path / "other.toml"
    other.write_text("schema = 1\n" + text.replace(served.address, "socketcand:127.0.0.1:9"), encoding="utf-8")
    (gone,) = load_site(other)
    (tmp_path / "rec").mkdir()
    opened = Bench(Sites((here, gone), describe), Options("tester", tmp_path / "rec", listen_s=0.2))
    yield opened
    await opened.close()


async def heard_of(bench: Bench) -> None:
    """Until the position of an axis is known."""
    connection = bench.require()
    target = connection.target("wtg-07/blade-1/pmc")
    async with asyncio.timeout(10):
        while target.lookup(POSITION) is None:  # noqa: ASYNC110  the live state has no event for it
            await asyncio.sleep(0.02)


async def test_nothing_is_connected_at_first(bench: Bench) -> None:
    with pytest.raises(NotConnectedError):
        bench.require()
    await bench.disconnect("anna")
    assert bench.epoch == 0
    assert bench.journal.latest() == []


async def test_connect_end_and_connect_again(bench: Bench, tmp_path: Path) -> None:
    first = await bench.connect("wtg-07", "anna")
    await heard_of(bench)
    before_ns = bench.stamper()
    await bench.disconnect("bert")
    assert (bench.connection, bench.twins, bench.epoch) == (None, None, 2)
    second = await bench.connect("wtg-07", "carl")
    await heard_of(bench)
    assert second is not first
    assert bench.epoch == 3
    assert bench.stamper() > before_ns
    notes = [(one.kind, one.person) for one in bench.journal.latest()]
    assert (Kind.CONNECTED, "anna") in notes
    assert (Kind.DISCONNECTED, "bert") in notes
    assert (Kind.CONNECTED, "carl") in notes
    await bench.close()
    recorded = sorted((tmp_path / "rec").glob("*.mcap"))
    assert len(recorded) == 2, "each connection has a recording of its own"
    with open_recording(recorded[0], strict=True) as recording:
        assert recording.info.who == "anna"
        assert any("disconnected" in str(event) for event in recording.events())


async def test_another_turbine_ends_the_connection_that_there_is(bench: Bench) -> None:
    await bench.connect("wtg-07", "anna")
    with pytest.raises(BusOpenError):
        await bench.connect("wtg-08", "anna", timeout_s=1)
    assert bench.connection is None, "a bench that could not connect serves nothing, and does not show the one before"
    await bench.connect("wtg-07", "anna")
    await heard_of(bench)


async def test_no_scope_stays_armed_for_a_connection_that_ends(bench: Bench) -> None:
    """Somebody arms again and again while the connection ends: each is refused, or ended with the connection."""
    connection = await bench.connect("wtg-07", "anna")
    await heard_of(bench)
    by_hand = TriggerOrder("manual", None, None, None, None, None, None, None)
    order = ScopeOrder(("wtg-07/blade-1/pmc/6064",), by_hand, 1.0, 0.5, "single", 0.0, 1.0)
    await bench.scope.arm(connection, order, "bert")
    ending = asyncio.create_task(bench.disconnect("anna"))
    refused = 0
    while not ending.done():
        try:
            await bench.scope.arm(connection, order, "bert")
        except NotConnectedError:
            refused += 1
        await asyncio.sleep(0)
    await ending
    assert refused > 0
    assert bench.scope.run is not None
    assert bench.scope.run.over
    assert all(link.listeners == () for link in connection.buses.values())
    again = await bench.connect("wtg-07", "anna")
    assert (await bench.scope.arm(again, order, "bert")).connection is again


async def test_an_unknown_turbine_leaves_the_connection_alone(bench: Bench) -> None:
    connection = await bench.connect("wtg-07", "anna")
    with pytest.raises(UsageError, match="wtg-99"):
        await bench.connect("wtg-99", "anna")
    assert bench.connection is connection


async def test_beside_another_master_only_listening_until_somebody_consents(served: Served, bench: Bench) -> None:
    stop = asyncio.Event()

    async def foreign_master() -> None:
        with can.Bus(interface="socketcand", host="127.0.0.1", port=served.server.port, channel="can0") as bus:
            while not stop.is_set():
                bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
                await asyncio.sleep(0.01)

    master = asyncio.create_task(foreign_master())
    try:
        connection = await bench.connect("wtg-07", "anna")
        assert bench_line(bench).needs_consent
        assert connection.target("wtg-07/blade-1/pmc").lookup(POSITION) is None
        await bench.consent("bert")
        await heard_of(bench)
        told = bench_line(bench)
        assert told.needs_consent is False
        consents = [one for one in bench.journal.latest() if one.kind is Kind.CONSENT]
        assert [one.person for one in consents] == ["bert"]
        await bench.consent("bert")
        assert len([one for one in bench.journal.latest() if one.kind is Kind.CONSENT]) == 1, "told once"
    finally:
        stop.set()
        await master
