"""Signs from records: begins and ends, chatter as one sign, limits in force, silence, and nothing where nothing is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.model.texts import load_texts
from app.wire.events import Severity
from app.wire.frame import Direction
from app.wire.nmt import NmtCommand, NmtState
from app.wire.records import (
    BootUpSeen,
    EmcySeen,
    GapSeen,
    NmtCommandSeen,
    Outcome,
    Protocol,
    Record,
    SdoAccess,
    SdoSeen,
    Side,
    Source,
    StateSeen,
    ValueSeen,
)
from app.wire.signs import Sign, SignFinder, SignKind, folded
from app.wire.signs.condition import SETTLE_NS, Condition

BUS, PMM, PMC = "can0", 2, 12
MS, S = 1_000_000, 1_000_000_000
DESCRIPTIONS = {(BUS, PMM): load_builtin("oat-pmm"), (BUS, PMC): load_builtin("oat-pmc")}
ENABLED, REMOTE_LOST, FAULT = 0x1637, 0x1437, 0x1618
CHAIN_CLOSED = 0b11101


def value(t_ms: float, node: int, address: str, raw: int, source: Source = Source.PDO_TX) -> ValueSeen:
    where = parse_address(address)
    size = DESCRIPTIONS[BUS, node].entries[where].type.size
    assert size is not None
    data = (raw & (1 << 8 * size) - 1).to_bytes(size, "little")
    return ValueSeen(round(t_ms * MS), BUS, node, where, data, source)


def found(records: Iterable[Record], end_ms: float = 0) -> list[Sign]:
    """The folded signs, with a tick every 100 ms between the records."""
    finder, at = SignFinder(DESCRIPTIONS), None
    signs: list[Sign] = []
    for record in records:
        while at is not None and record.t_ns - at >= 100 * MS:
            at += 100 * MS
            signs += finder.tick(at)
        at = record.t_ns if at is None else at
        signs += finder.feed(record)
    while at is not None and at < end_ms * MS:
        at += 100 * MS
        signs += finder.tick(at)
    return folded([*signs, *finder.finish(at or 0)])


def told(signs: Iterable[Sign], *kinds: SignKind) -> list[tuple[float, SignKind, bool]]:
    return [(one.t_ns / MS, one.kind, one.ends) for one in signs if not kinds or one.kind in kinds]


def write(t_ms: float, address: str, data: bytes, abort: int | None = None) -> SdoSeen:
    outcome = Outcome.DONE if abort is None else Outcome.ABORTED
    return SdoSeen(
        round(t_ms * MS), BUS, PMC, SdoAccess.WRITE, parse_address(address), outcome, data if abort is None else None,
        abort, None if abort is None else Side.SERVER, Protocol.EXPEDITED, MS, Direction.RX,
    )  # fmt: skip


def test_a_condition_begins_at_once_and_ends_with_its_own_time() -> None:
    finder = SignFinder(DESCRIPTIONS)
    finder.feed(value(0, PMC, "6041", ENABLED))
    (lost,) = (s for s in finder.feed(value(50, PMC, "6041", REMOTE_LOST)) if s.kind is SignKind.REMOTE_LOST)
    assert (lost.t_ns, lost.ends, lost.standing, lost.severity) == (50 * MS, False, False, Severity.WARNING)
    assert [s for s in finder.feed(value(300, PMC, "6041", ENABLED)) if s.kind is SignKind.REMOTE_LOST] == []
    assert finder.tick(300 * MS + SETTLE_NS - 1) == []
    (back,) = finder.tick(300 * MS + SETTLE_NS)
    assert (back.kind, back.t_ns, back.ends, back.key) == (SignKind.REMOTE_LOST, 300 * MS, True, lost.key)


def test_what_chatters_is_one_sign_with_its_count() -> None:
    records = [value(0, PMC, "6041", ENABLED)]
    for n in range(50):
        records += [value(100 + 40 * n, PMC, "6041", FAULT), value(110 + 40 * n, PMC, "6041", ENABLED)]
    signs = [one for one in found(records, 5000) if one.kind is SignKind.AXIS_FAULT]
    assert [(one.t_ns / MS, one.ends, one.times) for one in signs] == [(100, False, 50), (110 + 40 * 49, True, 50)]


def test_chatter_at_the_end_of_a_recording_is_counted_too() -> None:
    records = [value(0, PMC, "6041", ENABLED)]
    for n in range(7):
        records += [value(100 + 40 * n, PMC, "6041", FAULT), value(110 + 40 * n, PMC, "6041", ENABLED)]
    signs = [one for one in found(records) if one.kind is SignKind.AXIS_FAULT]
    assert [(one.ends, one.times) for one in signs] == [(False, 7)]


@given(st.lists(st.tuples(st.integers(1, 3000), st.booleans()), max_size=60))
def test_begins_and_ends_alternate_and_every_edge_is_counted(steps: list[tuple[int, bool]]) -> None:
    condition, t_ns, signs, on, edges = Condition(BUS, 1, SignKind.SILENT, "x", Severity.ERROR), 0, [], False, 0
    condition.see(0, False, None, {})
    for dt_ms, state in steps:
        t_ns += dt_ms * MS
        signs += [condition.settle(t_ns)]
        signs += [condition.see(t_ns, state, None, {})]
        edges, on = edges + (state and not on), state
    signs += [condition.settle(t_ns + SETTLE_NS), condition.told_again() if on else None]
    seen = folded([one for one in signs if one is not None])
    assert [one.ends for one in seen] == [bool(n % 2) for n in range(len(seen))]
    assert sum(one.times for one in seen if not one.ends) == edges
    assert [one.t_ns for one in seen] == sorted(one.t_ns for one in seen)


def test_what_was_so_when_it_was_first_seen_is_told_as_standing() -> None:
    (sign,) = (one for one in found([value(0, PMC, "60FD", 0xB)]) if one.kind is SignKind.EFC_INPUT)
    assert sign.standing
    assert sign.details["clamp"] == "X2.3"


def test_a_value_that_is_polled_tells_since_when_it_may_be_so() -> None:
    read = Source.SDO_READ
    signs = found([value(0, PMC, "60FE:03", 1 << 16, read), value(1000, PMC, "60FE:03", 0, read)])
    (sign,) = (one for one in signs if one.kind is SignKind.WATCHDOG_OPEN)
    assert (sign.t_ns, sign.since_ns) == (1000 * MS, 0)
    signs = found([value(0, PMC, "60FD", 0x4000B), value(900, PMC, "6064", 0), value(1000, PMC, "60FD", 0xB)])
    (sign,) = (one for one in signs if one.kind is SignKind.EFC_INPUT)
    assert sign.since_ns >= 900 * MS, "a PDO comes with the change"


@pytest.mark.parametrize(("window", "beyond"), [(None, True), (200, False), (0xFFFFFFFF, False)])
def test_the_limit_in_force_is_that_of_the_traffic_else_the_one_as_delivered(window: int | None, beyond: bool) -> None:
    records: list[Record] = [] if window is None else [value(0, PMC, "6065", window, Source.SDO_READ)]
    records += [value(10, PMC, "60F4", 0), value(20, PMC, "60F4", -150)]
    signs = [one for one in found(records) if one.kind is SignKind.LIMIT]
    assert len(signs) == beyond
    if beyond:
        details = signs[0].details
        assert (details["amount"], details["bound"], details["limit_address"]) == ("-1.50", "1.00", "6065")


def test_a_value_is_back_only_when_it_is_well_within_its_limit() -> None:
    records = [value(0, PMC, "60F4", 0), value(10, PMC, "60F4", 101), value(20, PMC, "60F4", 99)]
    records += [value(5000, PMC, "60F4", 96), value(5010, PMC, "60F4", 94)]
    signs = [one for one in found(records, 10_000) if one.kind is SignKind.LIMIT]
    assert [(one.t_ns / MS, one.ends) for one in signs] == [(10, False), (5010, True)]


def test_the_mains_are_lost_below_their_limit() -> None:
    records = [value(0, PMM, "3062", 400), value(100, PMM, "3062", 340), value(200, PMM, "3062", 330)]
    (lost,) = found(records)
    assert (lost.kind, lost.t_ns / MS, lost.details["bound"]) == (SignKind.MAINS_LOW, 200, "337")


def test_a_broken_temperature_sensor_is_no_temperature() -> None:
    kinds = SignKind.LIMIT
    assert told(found([value(0, PMM, "3012", 200), value(100, PMM, "3012", 32767)]), kinds) == []
    hot = found([value(0, PMM, "3012", 200), value(100, PMM, "3012", 450), value(200, PMM, "3012", 500)])
    assert [one.severity for one in hot] == [Severity.WARNING, Severity.ERROR]


def test_the_safety_chain_is_told_once_for_its_three_inputs_and_by_the_relay_that_opens() -> None:
    records = [value(0, PMM, "30FD", CHAIN_CLOSED), value(0, PMM, "30FE:03", 1 << 16)]
    records += [value(100, PMM, "30FE:03", 0), value(120, PMM, "30FD", CHAIN_CLOSED & ~1), value(125, PMM, "30FD", 0)]
    signs = found(records)
    assert told(signs) == [(100, SignKind.RELAY_OPEN, False), (120, SignKind.CHAIN_OPEN, False)]


def test_an_output_mask_is_no_output() -> None:
    assert (
        found([value(0, PMM, "30FE:01", 0), value(1, PMM, "30FE:02", 0xFFFF), value(2, PMC, "6510:07", 0x4000)]) == []
    )


def beats(node: int, first_ms: int, last_ms: int) -> Iterator[Record]:
    return (StateSeen(t * MS, BUS, node, NmtState.OPERATIONAL) for t in range(first_ms, last_ms + 1, 500))


def test_silence_is_told_with_the_last_frame_and_ends_with_the_next_heartbeat() -> None:
    records = [*beats(PMC, 0, 2000), value(2300, PMC, "6064", 5), *beats(PMC, 6000, 8000)]
    silent, heard = found(records, 8800)
    assert (silent.kind, silent.since_ns, silent.ends) == (SignKind.SILENT, 2300 * MS, False)
    assert 2000 + 750 + 100 < silent.t_ns / MS <= 2000 + 750 + 200
    assert (heard.t_ns / MS, heard.ends) == (6000, True)
    assert found(beats(99, 0, 8000), 8800) == [], "a node that beats is not silent"


def test_what_came_while_a_node_was_silent_tells_since_when_nobody_heard_it() -> None:
    records = [*beats(PMC, 0, 1000), value(1100, PMC, "60FD", 0x4000B), value(1300, PMC, "6064", 5)]
    records += [StateSeen(6000 * MS, BUS, PMC, NmtState.OPERATIONAL), value(6300, PMC, "60FD", 0xB)]
    records += [value(6400, PMC, "60FE:03", 0)]
    (lost,) = (one for one in found(records) if one.kind is SignKind.EFC_INPUT)
    assert (lost.t_ns / MS, lost.since_ns / MS) == (6300, 1300)


def test_a_restart_is_told_and_what_objects_held_is_forgotten() -> None:
    records: list[Record] = [BootUpSeen(0, BUS, PMC), value(10, PMC, "60FD", 0x4000B)]
    records += [BootUpSeen(5 * S, BUS, PMC), value(5010, PMC, "60FD", 0x4000B)]
    first, again = found(records)
    assert (first.severity, again.severity) == (Severity.INFO, Severity.WARNING)
    assert first.details["first"]
    assert again.since_ns == 10 * MS


def test_a_command_that_takes_a_node_out_of_operation_is_told_with_what_follows() -> None:
    records: list[Record] = [*beats(PMC, 0, 1000)]
    records += [NmtCommandSeen(1200 * MS, BUS, PMC, NmtCommand.PRE_OPERATIONAL, Direction.RX)]
    records += [StateSeen(1500 * MS, BUS, PMC, NmtState.PRE_OPERATIONAL)]
    assert told(found(records)) == [(1200, SignKind.NMT_COMMAND, False), (1500, SignKind.NOT_OPERATIONAL, False)]
    assert found([NmtCommandSeen(0, BUS, PMC, NmtCommand.START, Direction.RX)]) == []
    (early,) = found([NmtCommandSeen(0, BUS, PMC, NmtCommand.PRE_OPERATIONAL, Direction.RX)])
    assert early.severity is Severity.INFO, "it was not operational"


def test_emergencies_and_the_codes_that_none_told() -> None:
    records: list[Record] = [EmcySeen(0, BUS, PMC, 0x8611, 0x21, bytes(5)), value(10, PMC, "603F", 0x8611)]
    records += [value(20, PMM, "603F", 0x3120), EmcySeen(30 * MS, BUS, PMC, 0, 0, bytes(5))]
    signs = found(records)
    assert [one.kind for one in signs] == [SignKind.EMCY, SignKind.ERROR_CODE, SignKind.EMCY_RESET]
    assert [one.node for one in signs] == [PMC, PMM, PMC]
    texts = load_texts("en")
    assert texts(signs[0].text_key, **signs[0].details) == "Following error too large (8611h)"
    assert texts(signs[1].text_key, **signs[1].details) == "error code 3120h: Mains under voltage"


def test_writes_that_changed_a_parameter_or_were_refused() -> None:
    records: list[Record] = [
        value(0, PMC, "6065", 100, Source.SDO_READ),
        write(10, "6065", (2000).to_bytes(4, "little")),
    ]
    records += [value(10, PMC, "6065", 2000, Source.SDO_WRITE), write(20, "6065", (2000).to_bytes(4, "little"))]
    records += [write(30, "1017", b"\xf4\x01"), write(40, "6041", b"", 0x06010002)]
    written, refused = found(records)
    assert written.kind is SignKind.PARAMETER_WRITTEN
    assert (written.details["was_shown"], written.details["shown"], written.details["unit"]) == ("1.00", "20.00", "°")
    assert (refused.kind, refused.details["abort_code_hex"]) == (SignKind.WRITE_ABORTED, "06010002h")


def test_a_gap_is_told_and_nobody_is_silent_for_it() -> None:
    records: list[Record] = [
        *beats(PMC, 0, 2000),
        GapSeen(2100 * MS, BUS, 0, "gap.bus_lost"),
        *beats(PMC, 9000, 11_000),
    ]
    assert [one.kind for one in found(records, 11_800)] == [SignKind.GAP]


def test_every_kind_has_words_for_its_begin_and_conditions_for_their_end() -> None:
    moments = {
        SignKind.EMCY, SignKind.EMCY_RESET, SignKind.ERROR_CODE, SignKind.BOOT_UP, SignKind.NMT_COMMAND,
        SignKind.WRITE_ABORTED, SignKind.PARAMETER_WRITTEN, SignKind.GAP,
    }  # fmt: skip
    for language in ("en", "de"):
        texts: Any = load_texts(language)._texts
        assert [k for k in SignKind if k.text_key not in texts] == []
        assert [k for k in SignKind if (k.ended_key in texts) is (k in moments)] == []


def test_what_is_not_watched_costs_no_more_than_a_look() -> None:
    finder = SignFinder(DESCRIPTIONS)
    watched = finder.watched(BUS, PMC)
    assert parse_address("6041") in watched
    assert parse_address("6064") not in watched
    assert finder.feed(value(0, PMC, "6064", 1)) == ()
