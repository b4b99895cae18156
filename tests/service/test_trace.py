"""The trace of a connection: what a page is sent of a flood, pages from memory and from the recording, the tables."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace

import pytest

from app.errors import RefusedError
from app.model.address import Address
from app.model.texts import load_texts
from app.service.connection import Connection
from app.service.trace import tables
from app.service.trace.pages import Side, TracePages
from app.service.trace.query import TraceQuery
from app.service.trace.tail import MAX_ROWS, MAX_WAITING, TraceTail
from app.service.trace.text import TraceLine
from app.service.write import write_raw
from app.wire import sdo
from app.wire.emcy import emcy
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtState, heartbeat
from tests.service.conftest import Served
from tests.web.rig import make_connection
from tests.wire import traffic

BUS = "can0"
PMC, PMM = 11, 1
FOLLOWING = Address(0x6065)
DEADLINE_S = 15.0


def plain_connection() -> Connection:
    """A connection whose bus is not opened: frames are fed by hand."""
    return make_connection()


class Feed:
    """Frames on the bus of a connection, each with a time stamp of its own."""

    def __init__(self, connection: Connection) -> None:
        self.connection = connection
        self.link = connection.buses[BUS]
        self.frames: list[Frame] = []

    def can(self, can_id: int, data: bytes, direction: Direction = Direction.RX) -> Frame:
        frame = Frame(self.connection.stamper(), BUS, direction, Can(can_id, data))
        self.link.on_frames([frame])
        self.frames.append(frame)
        return frame

    def exchange(self, node: int, lines: list[traffic.Line]) -> list[Frame]:
        return [
            self.can((0x600 if one.client else 0x580) + node, one.data, Direction.TX if one.client else Direction.RX)
            for one in lines
        ]

    def heartbeats(self, count: int) -> None:
        for _ in range(count):
            self.can(0x700 + PMC, heartbeat(NmtState.OPERATIONAL))


def says(line: TraceLine, language: str = "en") -> str:
    """A line as the page words it."""
    texts = load_texts(language)
    step = "" if line.step is None else texts(f"trace.step.{line.step}")
    items = [
        f"{item.address} {texts.name(item.name or '')}" + ("" if item.text is None else f" = {item.text} {item.unit}")
        for item in line.items
    ]
    notes = []
    for note in line.notes:
        filled = {
            name.removesuffix("_key"): texts(str(detail)) if name.endswith("_key") else detail
            for name, detail in note.details.items()
        }
        notes.append(texts(note.key, **filled))
    return " | ".join(part.strip() for part in (step, *items, *notes) if part)


# -- what a row says -------------------------------------------------------------------


def test_rows_name_objects_values_units_and_reasons_in_both_languages() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    tail = TraceTail(connection, TraceQuery())
    feed.exchange(PMM, traffic.read(Address(0x3110, 1), b"\xf4\x01"))
    refused = traffic.Line(False, sdo.abort(FOLLOWING, sdo.Abort.READ_ONLY))
    feed.exchange(PMC, [traffic.Line(True, sdo.download_request(FOLLOWING, b"\x64\0\0\0")), refused])
    feed.can(0x80 + PMM, emcy(0x3284, 0x05))
    feed.can(0x700 + 42, b"\0")
    rows = tail.batch().rows
    assert rows[0].device == "wtg-07/blade-1/pmm" and rows[-1].device is None
    assert "3110:01" in says(rows[1]) and "= 50.0 °C" in says(rows[1])
    assert says(rows[3]) == "ABORT | 6065 following error window | 06010002h The object can only be read"
    assert says(rows[3], "de").startswith("ABBRUCH | 6065 Schleppfehlerfenster | 06010002h ")
    assert "3284h" in says(rows[4]) and rows[4].tone == "error"
    assert says(rows[5]) == "BOOT-UP: node has started anew"
    assert rows[1].start_t_ns == rows[0].t_ns, "the answer leads to its request"


# -- the running trace ------------------------------------------------------------------


def test_quiet_traffic_is_sent_whole_and_a_flood_is_sampled_with_exact_counts() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    tail = TraceTail(connection, TraceQuery(id=7))
    feed.heartbeats(30)
    first = tail.batch()
    assert (first.id, len(first.rows), first.seen, first.matched, first.sent, first.left_out) == (7, 30, 30, 30, 30, 0)
    feed.heartbeats(1000)
    flood = tail.batch()
    assert len(flood.rows) == MAX_ROWS
    assert (flood.seen, flood.matched, flood.sent, flood.left_out) == (1030, 1030, 130, 1000 - MAX_WAITING)
    rest = [tail.batch() for _ in range(4)]
    assert [len(batch.rows) for batch in rest] == [MAX_ROWS, MAX_ROWS, 0, 0]
    assert rest[-1].sent + rest[-1].left_out == rest[-1].matched, "nothing is unaccounted for"
    shown = [row.t_ns for batch in (flood, *rest) for row in batch.rows]
    assert shown == [frame.t_ns for frame in feed.frames[-MAX_WAITING:]], "the newest, in order"


def test_what_failed_is_never_left_out_of_a_sample() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    tail = TraceTail(connection, TraceQuery())
    error = feed.can(0x80 + PMC, emcy(0x3284, 0x05))
    feed.heartbeats(2000)
    batches = [tail.batch() for _ in range(3)]
    assert batches[0].rows[0].t_ns == error.t_ns
    assert sum(len(batch.rows) for batch in batches) == MAX_WAITING


def test_filters_combine_and_counts_tell_what_matched() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    query = TraceQuery(nodes=(PMC,), services=("sdo-request", "sdo-response"), q="schleppfehlerFENSTER")
    tail = TraceTail(connection, query)
    feed.heartbeats(5)
    feed.exchange(PMC, [*traffic.read(FOLLOWING, b"\1\0\0\0"), *traffic.read(Address(0x1008), b"abc")])
    feed.exchange(12, traffic.read(FOLLOWING, b"\1\0\0\0"))
    batch = tail.batch()
    assert (batch.seen, batch.matched) == (len(feed.frames), 2)
    assert {row.node for row in batch.rows} == {PMC}
    assert [row.items[0].address for row in batch.rows] == ["6065", "6065"]


def test_a_filter_that_makes_no_sense_says_so_and_sends_nothing() -> None:
    connection = plain_connection()
    tail = TraceTail(connection, TraceQuery(ids="zz"))
    Feed(connection).heartbeats(3)
    batch = tail.batch()
    assert "zz" in (batch.invalid or "")
    assert (batch.rows, batch.seen, batch.matched) == ((), 3, 0)


def test_a_tail_begins_in_the_middle_of_a_transfer_and_knows_its_object() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    lines = traffic.read(Address(0x1008), b"HUBSIDE TWIN")
    feed.exchange(PMC, lines[:3])
    tail = TraceTail(connection, TraceQuery())
    feed.exchange(PMC, lines[3:])
    rows = tail.batch().rows
    assert [row.items[0].address for row in rows] == ["1008"] * 3
    assert rows[-1].items[0].text == "HUBSIDE TWIN"


# -- pages ------------------------------------------------------------------------------


def test_pages_go_back_and_forth_through_memory_without_a_gap_or_a_double() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    feed.heartbeats(3500)
    pages = TracePages(connection, TraceQuery())
    times: list[int] = []
    before_ns = connection.stamper()
    while True:
        page = pages.page(Side.BEFORE, before_ns, 400)
        assert page.source == "ring"
        if not page.rows:
            break
        times = [row.t_ns for row in page.rows] + times
        before_ns = page.rows[0].t_ns
        if not page.older:
            break
    assert times == [frame.t_ns for frame in feed.frames]
    onwards = pages.page(Side.AFTER, times[1000], 50)
    assert [row.t_ns for row in onwards.rows] == times[1001:1051]
    assert onwards.newer
    around = pages.page(Side.AROUND, times[2000], 20)
    assert times[2000] in [row.t_ns for row in around.rows] and len(around.rows) == 20


def test_a_rare_row_is_found_far_back() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    wanted = feed.exchange(PMC, traffic.read(FOLLOWING, b"\1\0\0\0"))
    feed.heartbeats(6000)
    page = TracePages(connection, TraceQuery(q="6065")).page(Side.BEFORE, connection.stamper(), 10)
    assert [row.t_ns for row in page.rows] == [frame.t_ns for frame in wanted]
    assert page.from_t_ns == feed.frames[0].t_ns and not page.older


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.02)


async def test_what_memory_no_longer_holds_comes_from_the_running_recording(
    connection: Connection, served: Served
) -> None:
    """A write to a twin; its frames are dropped from memory and found in the file that is being written."""
    target = connection.target("wtg-07/blade-1/pmm")
    address = Address(0x3110, 1)
    await write_raw(connection.driver(target), target, address, 490, connection.journal)
    pages = TracePages(connection, TraceQuery(nodes=(PMM,), q="3110:01"))
    kept = pages.page(Side.BEFORE, connection.stamper(), 50)
    assert kept.source == "ring" and len(kept.rows) >= 4
    recorded = connection.recorded.frames
    link = connection.buses[BUS]
    link.describe(PMM, target.description)  # what was kept is forgotten
    await until(lambda: connection.recorded.frames > recorded + 10)
    page = pages.page(Side.AROUND, kept.rows[1].t_ns, 50)
    assert page.source == "recording"
    plain = [replace(row, t_adapter_ns=None) for row in kept.rows]  # which the file keeps once a while only
    assert list(page.rows[: len(plain)]) == plain, "the same rows, from the file"
    early = pages.page(Side.BEFORE, 1, 50)
    assert early.rows == () and not early.older


async def test_without_a_recording_there_is_nothing_older_than_memory() -> None:
    connection = plain_connection()
    Feed(connection).heartbeats(5)
    page = TracePages(connection, TraceQuery()).page(Side.BEFORE, 1, 50)
    assert (page.rows, page.older) == ((), False)


# -- tables -----------------------------------------------------------------------------


async def test_the_tables_of_a_real_bus(connection: Connection, served: Served) -> None:
    target = connection.target("wtg-07/blade-2/pmm")
    address = Address(0x3110, 1)
    await write_raw(connection.driver(target), target, address, 490, connection.journal)
    with pytest.raises(RefusedError):
        await write_raw(connection.driver(target), target, Address(0x3000), 1, connection.journal)
    await until(lambda: all(node.heartbeat_t_ns is not None for node in tables.nodes(connection)))
    nodes = {node.node: node for node in tables.nodes(connection)}
    assert sorted(nodes) == [1, 2, 3, 11, 12, 13]
    assert nodes[2].device == "wtg-07/blade-2/pmm" and nodes[2].nmt == "nmt.state.pre_operational"
    assert nodes[2].sdo_count >= 3

    transfers = tables.transfers(connection, "writes", 2, 10)
    assert [(one.access, one.item.address, one.item.text, one.outcome, one.ours) for one in transfers] == [
        ("write", "3110:01", "49.0", "done", True)
    ]
    assert len(tables.transfers(connection, "all", 2, 100)) == nodes[2].sdo_count

    identifiers = {one.can_id: one for one in tables.identifiers(connection)}
    assert identifiers[0x602].service == "sdo-request" and identifiers[0x602].direction == "tx"
    assert identifiers[0x702].node == 2 and identifiers[0x702].frames >= 1


def test_load_by_node_is_the_load_and_is_kept_second_by_second() -> None:
    connection = plain_connection()
    link = connection.buses[BUS]
    second, start_ns = 1_000_000_000, connection.stamper() // 1_000_000_000 * 1_000_000_000
    for tick in range(250):
        t_ns = start_ns + tick * second // 100
        link.on_frames([Frame(t_ns, BUS, Direction.RX, Can(0x18B, bytes(8)))])
        link.on_frames([Frame(t_ns + 512, BUS, Direction.RX, Can(0x701, b"\5"))])
    seconds, by_node = link.load_history(300)
    assert [one.frames for one in seconds] == [200, 200]
    for one, (number, shares) in zip(seconds, by_node, strict=True):
        assert one.second == number and set(shares) == {11, 1}
        assert sum(shares.values()) == pytest.approx(one.load)
    now = link.node_load(start_ns + 5 * second // 2)
    assert sum(now.values()) == pytest.approx(link.bus_load(start_ns + 5 * second // 2))


def test_emergencies_and_foreign_nodes_are_listed() -> None:
    connection = plain_connection()
    feed = Feed(connection)
    feed.can(0x80 + 77, emcy(0x2310, 3, b"\1"))
    feed.can(0x80 + 77, emcy(0, 0))
    lines = tables.emergencies(connection, 10)
    assert [(one.node, one.reset, one.details["code_hex"], one.device) for one in lines] == [
        (77, True, "0000h", None),
        (77, False, "2310h", None),
    ]
    foreign = next(node for node in tables.nodes(connection) if node.node == 77)
    assert foreign.seen and foreign.device is None and foreign.emcy is not None and foreign.emcy["reset"] is True
