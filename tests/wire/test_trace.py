"""The trace: what each frame of a mixed exchange means, what is kept of it, and which rows a filter lets pass."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pytest

from app.errors import UsageError
from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.texts import LANGUAGES, load_texts
from app.wire import sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.emcy import emcy
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtCommand, NmtState, heartbeat, nmt_message
from app.wire.records import ValueSeen
from app.wire.trace.filter import TraceFilter, parse_data, parse_ids
from app.wire.trace.ids import Identifiers
from app.wire.trace.ring import FrameRing
from app.wire.trace.service import Service, Speaker, predefined
from app.wire.trace.tracer import Gap, Item, Step, Tone, Tracer, TraceRow
from tests.wire import traffic
from tests.wire.traffic import BUS, frame

NODE = 11
PMC = load_builtin("oat-pmc")
FOLLOWING = Address(0x6065)
NAME = Address(0x1008)
MS = 1_000_000


def tracer() -> Tracer:
    return Tracer(BUS, {NODE: PMC})


def text(row: TraceRow) -> str:
    """A row in short: service, node, step, object, value, abort code, tone."""
    speaker = row.speaker
    parts = [
        f"{speaker.service.value}{speaker.number or ''}",
        f"@{speaker.node}",
        "" if row.step is None else row.step.value,
        "" if row.address is None else row.address.short,
        "" if row.value is None else row.value.hex(),
        "" if row.abort_code is None else f"{row.abort_code:08X}",
        "" if row.tone is Tone.PLAIN else row.tone.value,
    ]
    return " ".join(part for part in parts if part)


def texts(frames: Iterable[Item]) -> list[str]:
    return [text(row) for row in tracer().rows(frames)]


def conversation(*parts: Sequence[traffic.Line]) -> list[Frame]:
    return traffic.frames(NODE, [line for part in parts for line in part])


def test_expedited_read_and_write_show_the_value_where_it_is_carried() -> None:
    lines = [*traffic.read(FOLLOWING, b"\x64\0\0\0"), *traffic.write(FOLLOWING, b"\x65\0\0\0")]
    assert texts(conversation(lines)) == [
        "sdo-request @11 read 6065",
        "sdo-response @11 read-answer 6065 64000000",
        "sdo-request @11 write 6065 65000000",
        "sdo-response @11 write-answer 6065 65000000",
    ]


def test_a_segmented_read_names_its_object_in_every_frame_and_its_value_in_the_last() -> None:
    assert texts(conversation(traffic.read(NAME, b"HUBSIDE TWIN"))) == [
        "sdo-request @11 read 1008",
        "sdo-response @11 read-answer 1008",
        "sdo-request @11 segment-asked 1008",
        "sdo-response @11 segment 1008",
        "sdo-request @11 segment-asked 1008",
        "sdo-response @11 segment 1008 48554253494445205457494e",
    ]


def test_a_segmented_write_is_done_with_the_last_acknowledge() -> None:
    assert texts(conversation(traffic.write(NAME, b"12345678")))[-3:] == [
        "sdo-response @11 segment-taken 1008",
        "sdo-request @11 segment 1008",
        "sdo-response @11 segment-taken 1008 3132333435363738",
    ]


def test_segments_of_a_block_are_told_from_protocol_steps() -> None:
    data = bytes(range(0x40, 0x50))
    assert texts(conversation(traffic.block_read(NAME, data))) == [
        "sdo-request @11 block-read 1008",
        "sdo-response @11 block-read-answer 1008",
        "sdo-request @11 block-start 1008",
        "sdo-response @11 block-segment 1008",
        "sdo-response @11 block-segment 1008",
        "sdo-response @11 block-segment 1008",
        "sdo-request @11 block-taken 1008",
        "sdo-response @11 block-end 1008",
        f"sdo-request @11 block-end-taken 1008 {data.hex()}",
    ]
    steps = [row.step for row in tracer().rows(conversation(traffic.block_write(NAME, data)))]
    assert steps == [
        Step.BLOCK_WRITE, Step.BLOCK_WRITE_ANSWER, Step.BLOCK_SEGMENT, Step.BLOCK_SEGMENT, Step.BLOCK_SEGMENT,
        Step.BLOCK_TAKEN, Step.BLOCK_END, Step.BLOCK_END_TAKEN,
    ]  # fmt: skip


def test_an_abort_tells_its_code_whether_it_was_awaited_or_not() -> None:
    refused = traffic.Line(False, sdo.abort(FOLLOWING, sdo.Abort.READ_ONLY))
    asked = traffic.Line(True, sdo.download_request(FOLLOWING, b"\1"))
    assert texts(conversation([asked, refused, refused])) == [
        "sdo-request @11 write 6065 01",
        "sdo-response @11 abort 6065 06010002 error",
        "sdo-response @11 abort 6065 06010002 error",
    ]


def test_a_transfer_that_is_replaced_warns_where_the_next_begins() -> None:
    lines = [traffic.Line(True, sdo.upload_request(NAME)), *traffic.read(FOLLOWING, b"\1")]
    assert texts(conversation(lines))[1:] == [
        "sdo-request @11 read 6065 warning",
        "sdo-response @11 read-answer 6065 01",
    ]


def test_everything_else_on_the_bus() -> None:
    frames: list[Item] = [
        frame(0, 0x000, nmt_message(NmtCommand.START, NODE)),
        frame(MS, 0x080, b""),
        frame(2 * MS, 0x08B, emcy(0x3284, 0x09, b"\4")),
        frame(3 * MS, 0x08B, emcy(0, 0)),
        frame(4 * MS, 0x70B, heartbeat(NmtState.OPERATIONAL)),
        frame(5 * MS, 0x70B, b"\x07"),
        frame(6 * MS, 0x100, bytes(6)),
        frame(7 * MS, 0x7E5, bytes(8)),
        frame(8 * MS, 0x1AA, bytes(8)),
        frame(9 * MS, 0x67F, b"\xe0" + bytes(7)),
        Frame(10 * MS, BUS, Direction.RX, Can(0, error=True)),
        Frame(11 * MS, BUS, Direction.RX, Can(0x1F000000, bytes(2), extended=True)),
        Gap(12 * MS, BUS, "gap.bus_lost"),
    ]
    assert texts(frames) == [
        "nmt @0",
        "sync @0",
        "emcy @11 error",
        "emcy @11",
        "heartbeat @11",
        "heartbeat @11 error",
        "time @0",
        "lss @0",
        "tpdo1 @42",
        "sdo-request @127 unknown error",
        "error @0 error",
        "unknown @0",
        "gap @0 error",
    ]


def test_a_pdo_carries_what_is_mapped_and_says_which_it_is() -> None:
    (route,) = [route for route in CanOpenDecoder(BUS, {NODE: PMC}).pdos(NODE) if route.can_id == 0x18B]
    row = tracer().take(frame(0, 0x18B, bytes(8)))
    assert row.speaker == Speaker(Service.TPDO, NODE, 1)
    mapped = [address for address, _ in route.mapping.entries]
    assert [one.address for one in row.records if isinstance(one, ValueSeen)] == mapped


def test_a_moved_identifier_belongs_to_who_uses_it_now() -> None:
    moved = traffic.write(Address(0x1800, 1), (0x1F0).to_bytes(4, "little"))
    rows = list(tracer().rows([*conversation(moved), frame(9 * MS, 0x1F0, bytes(8)), frame(10 * MS, 0x18B, bytes(8))]))
    assert rows[-2].speaker == Speaker(Service.TPDO, NODE, 1)
    assert rows[-1].records == (), "nobody maps 18Bh any more"


def test_the_predefined_connection_set() -> None:
    assert predefined(0x581) == Speaker(Service.SDO_RESPONSE, 1)
    assert predefined(0x57F) == Speaker(Service.RPDO, 127, 4)
    assert predefined(0x180) == predefined(0x600) == Speaker(Service.UNKNOWN)


# -- the ring ------------------------------------------------------------------------


def ring_of(frames: Sequence[Frame], limit: int, chunk: int, batch: int = 3) -> FrameRing:
    decoder = CanOpenDecoder(BUS, {NODE: PMC})
    ring = FrameRing(BUS, decoder.snapshot, limit, chunk)
    for at in range(0, len(frames), batch):
        ring.extend(frames[at : at + batch])
        decoder.feed_all(frames[at : at + batch])
    return ring


def test_packed_items_come_back_as_they_were() -> None:
    items: list[Item] = [
        Frame(512, BUS, Direction.TX, Can(0x60B, bytes(range(8))), 77),
        Frame(1024, BUS, Direction.RX, Can(0x1FFFFFFF, b"\1", extended=True)),
        Frame(1536, BUS, Direction.RX, Can(0x18B, remote=True, dlc=6)),
        Frame(2048, BUS, Direction.RX, Can(0, error=True)),
        Gap(2560, BUS, "gap.bus_lost"),
        Frame(3072, BUS, Direction.RX, Can(0x70B, b"")),
    ]
    ring = FrameRing(BUS, dict, limit=100, chunk=6)
    ring.extend(items)
    ring.extend([Frame(4096, BUS, Direction.RX, Can(1))])
    assert list(ring.chunks()[0].items()) == items


def test_the_ring_keeps_the_last_and_no_more_than_a_chunk_beyond() -> None:
    frames = [frame(n * MS, 0x18B, n.to_bytes(8, "little")) for n in range(1000)]
    ring = ring_of(frames, limit=100, chunk=10, batch=1)
    chunks = ring.chunks()
    kept = [item for chunk in chunks for item in chunk.items()]
    assert ring.total == 1000
    assert 100 <= len(kept) <= 110
    assert kept == frames[-len(kept) :]
    assert [chunk.first for chunk in chunks] == [item[0] // MS for item in kept[::10]]


def test_items_since_a_number_and_what_is_gone() -> None:
    frames = [frame(n * MS, 0x18B, bytes(8)) for n in range(95)]
    ring = ring_of(frames, limit=30, chunk=10, batch=5)
    assert ring.since(90) == (90, frames[90:])
    assert ring.since(77) == (77, frames[77:])
    assert ring.since(95) == (95, [])
    first, items = ring.since(0)
    assert first == 60 and items == frames[60:]


def test_any_chunk_can_be_decoded_with_its_context() -> None:
    """Chunk borders in the middle of transfers: the rows are those of one pass over everything."""
    lines = [
        *traffic.read(NAME, b"HUBSIDE TWIN PMC"),
        *traffic.block_read(NAME, bytes(50)),
        *traffic.write(NAME, b"x" * 20),
    ]
    frames = conversation(lines * 3)
    whole = texts(frames)
    ring = ring_of(frames, limit=1000, chunk=7, batch=1)
    for chunk in ring.chunks():
        part = tracer()
        part.restart(chunk.snapshot)
        assert [text(row) for row in part.rows(chunk.items())] == whole[chunk.first : chunk.first + chunk.count]


# -- filters -------------------------------------------------------------------------


def passed(frames: Iterable[Item], **conditions: object) -> list[str]:
    wanted = TraceFilter(**conditions)  # type: ignore[arg-type]
    rows = tracer().rows(frames)
    return [text(row) for row in rows if wanted.passes_item(row.item, row.speaker) and wanted.passes_row(row)]


def mixed() -> list[Item]:
    refused = [
        traffic.Line(True, sdo.download_request(FOLLOWING, b"\1")),
        traffic.Line(False, sdo.abort(FOLLOWING, sdo.Abort.READ_ONLY)),
    ]
    other = traffic.frames(12, traffic.read(FOLLOWING, b"\7"), 50 * MS)
    return [
        *conversation(traffic.read(NAME, b"abc"), refused),
        frame(20 * MS, 0x70B, heartbeat(NmtState.OPERATIONAL)),
        *other,
        Gap(60 * MS, BUS, "gap.bus_lost"),
    ]


def test_kinds_of_conditions_combine_and_choices_within_one_add() -> None:
    both = frozenset({Service.SDO_REQUEST, Service.SDO_RESPONSE})
    assert passed(mixed(), services=frozenset({Service.HEARTBEAT})) == ["heartbeat @11", "gap @0 error"]
    assert passed(mixed(), nodes=frozenset({12}), services=both) == [
        "sdo-request @12 read 6065",
        "sdo-response @12 read-answer 6065 07",
        "gap @0 error",
    ]
    assert passed(mixed(), nodes=frozenset({12}), ids=((0x600, 0x67F),)) == [
        "sdo-request @12 read 6065",
        "gap @0 error",
    ]
    assert passed(mixed(), addresses=frozenset({FOLLOWING}), nodes=frozenset({11})) == [
        "sdo-request @11 write 6065 01",
        "sdo-response @11 abort 6065 06010002 error",
        "gap @0 error",
    ]


def test_errors_alone_times_and_data() -> None:
    assert passed(mixed(), only_errors=True) == ["sdo-response @11 abort 6065 06010002 error", "gap @0 error"]
    assert passed(mixed(), from_ns=20 * MS, to_ns=20 * MS) == ["heartbeat @11"]
    data = parse_data("40 65 60")
    assert passed(mixed(), data=data, to_ns=59 * MS) == ["sdo-request @12 read 6065"]


@pytest.mark.parametrize(
    ("pattern", "hexadecimal", "fits"),
    [
        ("40 64", "4064600000000000", True),
        ("4? ?? 60", "4b64600000000000", True),
        ("4? ?? 61", "4b64600000000000", False),
        ("64 60", "4064600000000000", False),
        ("* 64 60", "4064600000000000", True),
        ("*06 46", "4064600000000000", False),
    ],
)
def test_a_pattern_of_bytes(pattern: str, hexadecimal: str, fits: bool) -> None:
    compiled = parse_data(pattern)
    assert compiled is not None
    assert (compiled.match(hexadecimal) is not None) is fits


def test_what_is_no_filter_is_refused() -> None:
    assert parse_ids("18B, 580-5ff 70Bh") == ((0x18B, 0x18B), (0x580, 0x5FF), (0x70B, 0x70B))
    assert parse_data("  ") is None
    for wrong in ("xyz", "18B-", "1-2-3"):
        with pytest.raises(UsageError):
            parse_ids(wrong)
    for wrong in ("4", "4g", "** 40", "40" * 40):
        with pytest.raises(UsageError):
            parse_data(wrong)


# -- identifiers -----------------------------------------------------------------------


def test_identifiers_are_counted_with_their_periods_and_rates() -> None:
    table = Identifiers()
    second = 1_000 * MS
    frames = [frame(n * 100 * MS, 0x18B, bytes([n])) for n in range(25)]
    table.take([*frames, frame(150 * MS, 0x70B, b"\5"), Gap(0, BUS, "gap.bus_lost")])
    pdo, beat = table.views(2 * second + 450 * MS)
    assert (pdo.frames, pdo.frame, pdo.per_second) == (25, frames[-1], 10)
    assert pdo.period_ns == pdo.shortest_ns == pdo.longest_ns == 100 * MS
    assert (beat.frames, beat.period_ns, beat.per_second) == (1, None, 0)
    assert table.copy().views(3 * second)[0].per_second == 5, "the last full second is the running one of before"


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_step_and_service_has_words(language: str) -> None:
    texts = load_texts(language).flat
    keys = [*(step.text_key for step in Step), *(f"trace.service.{service.value}" for service in Service)]
    assert [key for key in keys if not texts.get(key)] == []
