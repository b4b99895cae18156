"""The socket over a real server: snapshot, deltas, order, heartbeat, latency, and a client that takes nothing."""

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import time
from collections.abc import AsyncIterator
from typing import Any

import pytest
import websockets

from app.model.address import Address
from app.model.datatypes import DataType, encode_raw
from app.service.journal import Kind
from app.service.shown import LiveShown
from app.web.feed import HEARTBEAT_S, Feed
from app.wire import sdo
from app.wire.frame import Can, Direction, Frame
from app.wire.twin_environment import CAN_ID, TwinEnvironment, pack_environment
from tests.web.rig import BUS, DEADLINE_S, Page, Server, running, wait_until

PMC_2 = "wtg-07/blade-2/pmc"
PMM_2 = "wtg-07/blade-2/pmm"
POSITION = Address(0x6064)
LIMIT = Address(0x3110, 1)


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    async with running() as started:
        yield started


@pytest.fixture
async def page(server: Server) -> AsyncIterator[Page]:
    async with server.socket() as connection:
        yield Page(connection)


def feed_scaling(server: Server, node: int) -> None:
    """36000 units are one revolution, as every PMC of the example has it."""
    server.feeder.read(node, Address(0x6092, 1), encode_raw(DataType.UNSIGNED32, 36_000))
    server.feeder.read(node, Address(0x6092, 2), encode_raw(DataType.UNSIGNED32, 1))


def int32(raw: int) -> bytes:
    return encode_raw(DataType.INTEGER32, raw)


async def test_hello_comes_first_and_messages_are_numbered(page: Page) -> None:
    first = await page.next()
    assert (first["type"], first["v"], first["ctx"], first["seq"]) == ("hello", 1, "live", 1)
    await page.subscribe("link", "nodes", "axes", "events", f"values:{PMC_2}")
    await page.until("heartbeat")
    await page.until("heartbeat")
    assert [message["seq"] for message in page.heard] == list(range(1, len(page.heard) + 1))


async def test_values_are_a_snapshot_and_then_deltas(server: Server, page: Page) -> None:
    server.feeder.read(2, LIMIT, struct.pack("<h", 500))
    server.feeder.read(2, Address(0x3110, 2), struct.pack("<h", 550))
    await page.subscribe(f"values:{PMM_2}")
    snapshot = (await page.until("values"))["data"]
    assert (snapshot["device"], snapshot["full"]) == (PMM_2, True)
    value = snapshot["values"]["3110:01"]
    assert (value["raw"], value["hex"], value["source"], value["known"]) == (500, "f401", "sdo-read", True)
    assert value["stored"] is None

    server.feeder.write(2, LIMIT, struct.pack("<h", 490))
    delta = (await page.until("values"))["data"]
    assert (delta["full"], list(delta["values"])) == (False, ["3110:01"])
    assert (delta["values"]["3110:01"]["raw"], delta["values"]["3110:01"]["source"]) == (490, "sdo-write")


async def test_saving_and_restarting_show_in_the_stored_place(server: Server, page: Page) -> None:
    await page.subscribe(f"values:{PMM_2}", "events")
    server.feeder.read(2, LIMIT, struct.pack("<h", 490))
    server.feeder.write(2, Address(0x1010, 3), b"save")

    def is_saved(data: dict[str, Any]) -> bool:
        stored = data["values"].get("3110:01", {}).get("stored")
        return bool(stored == {"raw": 490, "state": "saved"})

    await page.until("values", is_saved)
    server.feeder.heartbeat(2, 0)
    unknown = await page.until("values", lambda data: not data["values"].get("3110:01", {"known": True})["known"])
    assert unknown["data"]["values"]["3110:01"]["raw"] is None
    server.feeder.read(2, LIMIT, struct.pack("<h", 490))
    proven = await page.until("values", lambda data: "3110:01" in data["values"])
    assert proven["data"]["values"]["3110:01"]["stored"] == {"raw": 490, "state": "proven"}
    kinds = {m["data"]["text_key"] for m in page.heard if m["type"] == "event"}
    assert {"event.saved", "event.boot_up"} <= kinds


async def test_only_what_was_asked_for_is_told(server: Server, page: Page) -> None:
    await page.subscribe(f"values:{PMC_2}")
    await page.until("values")
    server.feeder.read(2, LIMIT, struct.pack("<h", 1))
    server.feeder.read(12, POSITION, int32(1))
    await page.until("values", lambda data: "6064" in data["values"])
    assert {m["type"] for m in page.heard} <= {"hello", "bench", "heartbeat", "values"}
    assert {m["data"]["device"] for m in page.heard if m["type"] == "values"} == {PMC_2}
    await page.subscribe("values:wtg-07/blade-9/pmc", "nonsense")
    await page.until("heartbeat")
    await page.until("heartbeat")


async def test_axes(server: Server, page: Page) -> None:
    feed_scaling(server, 12)
    server.feeder.read(12, POSITION, int32(8123))
    server.feeder.read(12, Address(0x607A), int32(8200))
    server.feeder.read(12, Address(0x6041), struct.pack("<H", 0x0237))
    server.feeder.read(12, Address(0x6079), struct.pack("<I", 315_000))
    server.feeder.read(12, Address(0x603F), struct.pack("<H", 0x2310))
    server.feeder.read(2, Address(0x3080), bytes((87,)))
    server.feeder.read(2, Address(0x3060), struct.pack("<H", 216))
    await page.subscribe("axes")
    axes = {axis["blade"]: axis for axis in (await page.until("axes"))["data"]}
    assert list(axes) == [1, 2, 3]
    assert axes[1] | {"station": ""} == {
        "station": "", "blade": 1, "position_deg": None, "position_t_ns": None, "demand_deg": None,
        "velocity_dps": None, "state": None, "fault_code": None, "fault_text_key": None, "battery_soc_pct": None,
        "battery_v": None, "dc_link_v": None, "stale": True, "look": "unknown", "faults": [],
        "current_pct": None, "following_error_deg": None,
    }  # fmt: skip
    axis = axes[2]
    assert (axis["position_deg"], axis["demand_deg"], axis["state"]) == (81.23, 82.0, "axis_state.operation_enabled")
    assert (axis["battery_soc_pct"], axis["battery_v"], axis["dc_link_v"]) == (87, 216, 315)
    assert (axis["fault_code"], axis["fault_text_key"]) == (0x2310, "error_code.over_current_output")
    assert axis["stale"] is False
    # Nobody reads the angle any more: within a second it is no longer called the present one.
    stale = await page.until("axes", lambda data: data[1]["stale"])
    assert stale["data"][1]["position_deg"] == 81.23


async def test_nodes(server: Server, page: Page) -> None:
    await page.subscribe("nodes")
    lines = (await page.until("nodes"))["data"]
    assert [line["node"] for line in lines] == [1, 11, 2, 12, 3, 13]
    assert {line["nmt"] for line in lines} == {"unknown"}
    server.feeder.heartbeat(12, 5)
    told = await page.until("nodes", lambda data: data[3]["nmt"] == "operational")
    assert told["data"][3]["heartbeat_t_ns"] is not None
    server.feeder.heartbeat(12, 0)
    booted = await page.until("nodes", lambda data: data[3]["boots"] == 1)
    assert booted["data"][3]["nmt"] == "pre-operational"


async def test_link(page: Page) -> None:
    await page.subscribe("link")
    link = (await page.until("link"))["data"]
    assert (link["state"], link["bus"], link["bitrate"]) == ("disconnected", "can0", 500_000)
    assert link["recording"]["state"] == "off"


async def test_events_of_wire_and_journal_in_order_and_each_once(server: Server, page: Page) -> None:
    server.bench.journal.note(Kind.CONNECTED, None, bus="can0", adapter="x")
    server.feeder.heartbeat(12, 0)
    await page.subscribe("events")
    boot = await page.until("event", lambda data: data["text_key"] == "event.boot_up")
    assert boot["data"]["device"] == PMC_2
    server.bench.journal.note(Kind.SAVED, PMM_2, took_s="0.40")
    await page.until("event", lambda data: data["device"] == PMM_2)
    await page.subscribe("events", "axes")
    server.bench.journal.note(Kind.RESTART, PMM_2)
    await page.until("event", lambda data: data["text_key"].endswith("restart"))
    keys = [m["data"]["text_key"] for m in page.heard if m["type"] == "event"]
    assert [key.split(".")[1] for key in keys] == ["connected", "boot_up", "saved", "restart"]
    times = [m["data"]["t_ns"] for m in page.heard if m["type"] == "event"]
    assert times == sorted(times)


async def test_a_heartbeat_comes_within_the_second_that_makes_a_page_deaf(page: Page) -> None:
    await page.until("heartbeat")
    started = time.monotonic()
    for _ in range(4):
        await page.until("heartbeat")
    assert time.monotonic() - started < 4 * HEARTBEAT_S + 1.0


async def test_what_is_no_message_ends_the_connection(server: Server) -> None:
    for text in ("", "nonsense", "{}", '{"type":"write"}', '{"type":"subscribe","topics":5}', "[" * 5000):
        async with server.socket() as connection:
            await connection.send(text)
            with pytest.raises(websockets.ConnectionClosed) as closed:
                async with asyncio.timeout(DEADLINE_S):
                    while True:
                        await connection.recv()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1008, text
    async with server.socket() as connection:
        await Page(connection).until("hello")


async def test_bytes_end_the_connection_and_are_no_defect(server: Server, caplog: pytest.LogCaptureFixture) -> None:
    for data in (b"", b'{"type":"subscribe","topics":[]}', bytes(70_000)):
        async with server.socket() as connection:
            await connection.send(data)
            with pytest.raises(websockets.ConnectionClosed) as closed:
                async with asyncio.timeout(DEADLINE_S):
                    while True:
                        await connection.recv()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1003
    assert [record for record in caplog.records if record.levelno >= logging.ERROR] == []


async def test_a_twin_that_restarts_stays_a_twin_on_the_page(server: Server, page: Page) -> None:
    for target in server.connection.targets:
        server.feeder.read(target.node, Address(0x1008), b"HUBSIDE TWIN")
    await page.subscribe("link", "nodes")
    assert (await page.until("link"))["data"]["mode"] == "twin"
    server.feeder.heartbeat(12, 0)
    await page.until("nodes", lambda data: data[3]["boots"] == 1)
    for _ in range(2):
        assert (await page.until("link"))["data"]["mode"] == "twin"
    assert (await server.client.get("/api/live/turbine")).json()["mode"] == "twin"
    server.feeder.read(12, Address(0x1008), b"PMC")
    await page.until("link", lambda data: data["mode"] == "live")


async def test_an_empty_error_history_is_no_event(server: Server, page: Page) -> None:
    for address, code in ((Address(0x1003, 1), sdo.Abort.NO_DATA), (Address(0x4711), sdo.Abort.NO_OBJECT)):
        server.feeder.can(0x600 + 12, sdo.upload_request(address))
        server.feeder.can(0x580 + 12, sdo.abort(address, code))
    await page.subscribe("events")
    told = (await page.until("event"))["data"]
    assert (told["text_key"], told["details"]["address"]) == ("event.sdo_aborted", "4711")


async def test_a_change_reaches_the_page_quickly(server: Server, page: Page) -> None:
    await page.subscribe(f"values:{PMC_2}")
    await page.until("values")
    took_s = []
    for raw in range(60):
        started = time.monotonic()
        server.feeder.read(12, POSITION, int32(raw))
        await page.until("values", lambda data, raw=raw: data["values"].get("6064", {}).get("raw") == raw)  # type: ignore[misc]
        took_s.append(time.monotonic() - started)
    assert sorted(took_s)[len(took_s) // 2] < 0.05


def narrow_socket(port: int) -> socket.socket:
    """A connection that takes in hardly anything by itself."""
    plain = socket.socket()
    plain.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    plain.connect(("127.0.0.1", port))
    plain.setblocking(False)
    return plain


async def test_a_slow_client_holds_up_nobody_and_gets_the_latest(server: Server, page: Page) -> None:
    """It stops reading while values change without end; the other page goes on, and what waits for it is bounded."""
    target = server.connection.target(PMC_2)
    entries = [e for e in target.description if e.type.size == 4 and e.address.major >= 0x5000]
    topic = f"values:{PMC_2}"
    narrow: dict[str, Any] = {"host": None, "port": None, "sock": narrow_socket(server.port)}
    async with server.socket(max_queue=1, **narrow) as slow_socket:
        slow = Page(slow_socket)
        await slow.subscribe(topic)
        await slow.until("values")
        slow_socket.transport.pause_reading()
        await page.subscribe(topic)
        await page.until("values")
        rounds, worst_s = 120, 0.0
        for number in range(1, rounds + 1):
            for entry in entries:
                server.feeder.read(12, entry.address, int32(number))
            told = time.monotonic()
            await page.until("values", lambda data, n=number: data["values"].get("6064", {}).get("raw") == n)  # type: ignore[misc]
            worst_s = max(worst_s, time.monotonic() - told)
        assert worst_s < 1.0
        slow_socket.transport.resume_reading()
        await slow.until("values", lambda data: data["values"].get("6064", {}).get("raw") == rounds)
    deltas = [message for message in slow.heard if message["type"] == "values"]
    assert len(deltas) < rounds / 2, "nothing was held back, so nothing was proven"


async def test_a_page_that_leaves_is_forgotten(server: Server) -> None:
    listeners = server.bench.journal._pages.listeners
    others = len(listeners)
    for _ in range(3):
        async with server.socket() as connection:
            page = Page(connection)
            await page.subscribe("events")
            await page.until("heartbeat")
            assert len(listeners) == others + 1
        await wait_until(lambda: len(listeners) == others)


async def test_rotor_and_wind_are_told_where_a_twin_tells_them(server: Server, page: Page) -> None:
    await page.subscribe("rotor")
    unknown = await page.until("rotor")
    assert unknown["data"] == {
        "azimuth_deg": None, "rotor_rpm": None, "wind_mps": None, "wind_deg": None, "t_ns": None, "stale": False,
    }  # fmt: skip
    data = pack_environment(TwinEnvironment(12.5, 0.4, 7.5, -3.0))
    frame = Frame(server.bench.stamper(), BUS, Direction.RX, Can(CAN_ID, data, extended=True))
    server.connection.buses[BUS].on_frames([frame])
    known = (await page.until("rotor"))["data"]
    assert (known["azimuth_deg"], known["rotor_rpm"], known["wind_mps"], known["wind_deg"]) == (12.5, 0.4, 7.5, -3.0)
    assert (known["t_ns"], known["stale"]) == (frame.t_ns, False)
    stale = (await page.until("rotor", lambda line: line["stale"]))["data"]
    assert stale["azimuth_deg"] == 12.5


async def test_past_events_are_told_however_fast_a_page_asks_again() -> None:
    """Topics replaced before anything of them was told, and topics asked for while messages are on their way."""
    async with running() as server:
        server.bench.journal.note(Kind.CONNECTED, None, bus="can0", adapter="x")
        hasty = Feed(LiveShown(server.bench))
        hasty.subscribe(["link", "events"])
        hasty.subscribe(["link", "events", "axes"])
        assert [m.data.text_key for m in hasty.due(0.0) if m.type == "event"] == ["journal.connected"]

        midway = Feed(LiveShown(server.bench))
        midway.subscribe(["link", "nodes", "axes"])
        messages = midway.due(0.0)
        next(messages)
        midway.subscribe(["link", "nodes", "axes", "events"])
        told = [*messages, *midway.due(0.02)]
        assert [m.data.text_key for m in told if m.type == "event"] == ["journal.connected"]
        midway.subscribe(["events"])
        assert not [m for m in midway.due(0.04) if m.type == "event"]
        for feed in (hasty, midway):
            feed.close()
