"""The text of a signature: what it means, that it comes back the same, and where it is not understood."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import TypeAdapter, ValidationError

from app.errors import HubsideError, SignatureError, UnknownObjectError, UsageError
from app.model.address import Address, Addressing
from app.model.description_file import load_builtin
from app.model.texts import error_text, load_texts
from app.service.analysis.search.match import check
from app.service.analysis.search.parser import EXAMPLES, parse_query
from app.service.analysis.search.query import (
    All,
    Any,
    Comparison,
    EventIs,
    Level,
    Not,
    Order,
    Pair,
    Query,
    Same,
    Scope,
    Special,
)
from app.web.models.signature import QueryPart, part_of, query_of
from app.wire.signs import SignKind

S, MS = 1_000_000_000, 1_000_000
KNOWN = [load_builtin("oat-pmm"), load_builtin("oat-pmc")]
FOLLOWING = Level(Address(0x60F4), Comparison.ABOVE, 2, "°")
FAULT = EventIs(SignKind.EMCY, 0x8611)


def test_the_example_of_a_following_error_before_its_emergency() -> None:
    assert parse_query("60F4 > 2 deg within 5 s before emcy 8611") == Pair(FOLLOWING, Order.BEFORE, FAULT, 5 * S)


@pytest.mark.parametrize(
    ("text", "query"),
    [
        ("TRIP", EventIs(Special.TRIP)),
        ("emcy", EventIs(SignKind.EMCY)),
        ("emcy any on blade 2 pmc", EventIs(SignKind.EMCY, None, Scope(blade=2, device="pmc"))),
        ("emcy 0x8611", FAULT),
        ("emcy 8611h", FAULT),
        ("emcy 3280", EventIs(SignKind.EMCY, 0x3280)),
        ("ended chain_open on bus can0", EventIs(SignKind.CHAIN_OPEN, None, Scope(bus="can0"), True)),
        ("60F4>2°", FOLLOWING),
        ("60f4 > 2,0 deg", FOLLOWING),
        ("3062 < 2000V for 5s", Level(Address(0x3062), Comparison.BELOW, 2000, "V", 5 * S)),
        ("3080 < 50 %", Level(Address(0x3080), Comparison.BELOW, 50, "%")),
        ("6044 > 10 1/min", Level(Address(0x6044), Comparison.ABOVE, 10, "1/min")),
        ("6510:03 >= 75.5 degC", Level(Address(0x6510, 3), Comparison.FROM, 75.5, "°C")),
        ("3062 <= -1", Level(Address(0x3062), Comparison.UP_TO, -1)),
        ("|60F4| != 0 for 200 ms on node 12",
         Level(Address(0x60F4), Comparison.OTHER, 0, "", 200 * MS, True, Scope(node=12))),
        ("trip and not mains_low or error",
         Any((All((EventIs(Special.TRIP), Not(EventIs(SignKind.MAINS_LOW)))), EventIs(Special.ERROR)))),
        ("(trip or error) and warning",
         All((Any((EventIs(Special.TRIP), EventIs(Special.ERROR))), EventIs(Special.WARNING)))),
        ("mains_low then emcy 8611 within 1 min on same blade",
         Pair(EventIs(SignKind.MAINS_LOW), Order.THEN, FAULT, 60 * S, Same.BLADE)),
        ("chain_open without trip within 1.5 s",
         Pair(EventIs(SignKind.CHAIN_OPEN), Order.WITHOUT, EventIs(Special.TRIP), 1500 * MS)),
        ("mains_low then booster within 1 s then trip within 5 s",
         Pair(Pair(EventIs(SignKind.MAINS_LOW), Order.THEN, EventIs(SignKind.BOOSTER), S), Order.THEN,
              EventIs(Special.TRIP), 5 * S)),
    ],
)  # fmt: skip
def test_what_a_text_means(text: str, query: Query) -> None:
    assert parse_query(text) == query


@pytest.mark.parametrize(
    ("text", "position", "found", "reason"),
    [
        ("", 1, "–", "event"),
        ("foo", 1, "foo", "event"),
        ("trip and", 9, "–", "event"),
        ("emcy 86x1", 6, "86", "code"),
        ("60F4 > deg", 8, "deg", "number"),
        ("60F4 > 2 within 5 before emcy", 19, "before", "time"),
        ("trip within 5 s befor emcy", 17, "befor", "before"),
        ("emcy 8611 then trip", 20, "–", "within"),
        ("(trip", 6, "–", "bracket"),
        ("trip)", 5, ")", "end"),
        ("trip € 2", 6, "€", "character"),
        ("silent on", 10, "–", "where"),
        ("silent on blade two", 17, "two", "number"),
        ("|60F4 > 2", 7, ">", "bar"),
        ("|trip| > 2", 2, "trip", "address"),
        ("60F4 > 2 deg deg", 14, "deg", "end"),
        ("ended trip", 7, "trip", "event"),
        ("(not trip) then emcy within 2 s", 12, "then", "no_pair"),
        ("trip then emcy within 2 s on same", 34, "–", "same"),
        ("(" * 30, 22, "(", "too_deep"),
        ("x" * 1001, 1000, "…", "too_long"),
    ],
)
def test_where_a_text_is_not_understood(text: str, position: int, found: str, reason: str) -> None:
    with pytest.raises(SignatureError) as raised:
        parse_query(text)
    assert raised.value.details == {"position": position, "found": found, "reason_key": f"signature.{reason}"}
    for language in ("en", "de"):
        told = error_text(load_texts(language), raised.value)
        assert str(position) in told
        assert f"signature.{reason}" not in told


scopes = st.builds(
    Scope, st.none() | st.integers(1, 9), st.none() | st.integers(1, 127), st.sampled_from([None, "pmm", "pmc"]),
    st.sampled_from([None, "can0", "can1"]),
)  # fmt: skip
events = st.builds(EventIs, st.sampled_from([*SignKind, *Special]), st.none(), scopes) | st.builds(
    EventIs, st.just(SignKind.EMCY), st.integers(0, 0xFFFF), scopes, st.booleans()
)
addresses = st.builds(Address, st.integers(0x1000, 0xFFFF), st.integers(0, 255), st.just(Addressing.OD))
levels = st.builds(
    Level, addresses, st.sampled_from(Comparison),
    st.integers(-9999, 9999).map(lambda n: n / 10), st.sampled_from(["", "°", "V", "°C", "°/s", "mV"]),
    st.integers(0, 5000).map(lambda ms: ms * MS), st.booleans(), scopes,
)  # fmt: skip


def _grown(inner: st.SearchStrategy[Query]) -> st.SearchStrategy[Query]:
    timed = inner.filter(lambda one: not isinstance(one, Not | All))
    times = st.integers(0, 100_000).map(lambda ms: ms * MS)
    parts = st.lists(inner, min_size=2, max_size=3).map(tuple)
    return (
        st.builds(Pair, timed, st.sampled_from(Order), timed, times, st.sampled_from([None, *Same]))
        | st.builds(Not, inner)
        | st.builds(Any, parts)
        | st.builds(All, parts)
    )


queries: st.SearchStrategy[Query] = st.recursive(events | levels, _grown, max_leaves=8)


def _flat(query: Query) -> Query:
    """Nested ``and`` and ``or`` are one list when they are read again."""
    if isinstance(query, All | Any):
        parts: list[Query] = []
        for part in map(_flat, query.parts):
            parts += part.parts if isinstance(part, type(query)) else [part]
        return type(query)(tuple(parts))
    if isinstance(query, Not):
        return Not(_flat(query.part))
    if isinstance(query, Pair):
        return Pair(_flat(query.left), query.order, _flat(query.right), query.within_ns, query.same)
    return query


@pytest.mark.filterwarnings("ignore:Generating overly large repr")  # hypothesis, of its own strategies
@given(queries)
def test_a_signature_comes_back_the_same_from_its_text_and_from_json(query: Query) -> None:
    assert _flat(parse_query(str(query))) == _flat(query)
    adapter: TypeAdapter[QueryPart] = TypeAdapter(QueryPart)
    assert query_of(adapter.validate_json(json.dumps(part_of(query).model_dump(mode="json")))) == query


@given(
    st.text(max_size=60)
    | st.lists(st.sampled_from("trip 60F4 > 2 deg within s before then ( ) | on blade".split())).map(" ".join)
)
def test_no_text_does_worse_than_not_being_understood(text: str) -> None:
    try:
        parse_query(text)
    except SignatureError as error:
        assert 1 <= error.details["position"] <= len(text) + 1


def test_a_json_signature_that_makes_no_sense_is_refused() -> None:
    adapter: TypeAdapter[QueryPart] = TypeAdapter(QueryPart)
    for wrong in ({"type": "event", "kind": "nothing"}, {"type": "level", "object": "60F4"}, {"type": "x"}, {}):
        with pytest.raises(ValidationError):
            adapter.validate_python(wrong)
    nested: dict[str, object] = {"type": "event", "kind": "trip"}
    for _ in range(30):
        nested = {"type": "not", "part": nested}
    with pytest.raises(UsageError):
        query_of(adapter.validate_python(nested))


@pytest.mark.parametrize("text", EXAMPLES)
def test_examples_can_be_found(text: str) -> None:
    check(parse_query(text), KNOWN)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("1234 > 3", UnknownObjectError),
        ("trip and not 3062 > 3 deg", UsageError),
        ("60F4 > 2 V then trip within 1 s", UsageError),
    ],
)
def test_what_no_device_can_show_is_refused_before_anything_is_searched(text: str, error: type[HubsideError]) -> None:
    with pytest.raises(error):
        check(parse_query(text), KNOWN)
