"""Parameter sets: the file, its hash, and damaged files."""

from __future__ import annotations

import dataclasses
import hashlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import SetFileError
from app.model.address import Address
from app.model.sets import Identity, Origin, ParameterSet, dump_set, iso_time, load_set, parse_content

ORIGIN = Origin("wtg-07", "wtg-07/blade-1/pmm", 1, "2026-03-04T14:03:21Z", "A. Technician", "as found", "hubside 0.1.0")
SET = ParameterSet(
    "oat-pmm",
    "1.0.0",
    Identity(device_type=0, device_name="PMM", serial=7),
    ORIGIN,
    {Address(0x3110, 1): 500, Address(0x1008): "PMM", Address(0x2030, 1): b"\1\2"},
    {Address(0x3111, 1): "no answer"},
)


def test_a_file_is_read_back() -> None:
    assert load_set(dump_set(SET), "x.json") == SET
    assert not SET.complete


def test_the_text_is_canonical() -> None:
    turned = dataclasses.replace(SET, values=dict(reversed(list(SET.values.items()))))
    assert dump_set(turned) == dump_set(SET)
    assert '\n  "3110:01": 500' in dump_set(SET), "one value a line"


def test_the_hash_covers_state_and_not_circumstance() -> None:
    later = dataclasses.replace(ORIGIN, time="2027-01-01T00:00:00Z", person="B")
    assert dataclasses.replace(SET, origin=later).hash == SET.hash
    assert dataclasses.replace(SET, values={**SET.values, Address(0x3110, 1): 501}).hash != SET.hash
    assert dataclasses.replace(SET, identity=Identity(serial=8)).hash != SET.hash
    assert dataclasses.replace(SET, description_version="1.0.1").hash != SET.hash


def test_sets_of_before_the_nameplate_keep_text_and_hash() -> None:
    """The hash stands in files and in the hands of people: it was made by the first version."""
    assert SET.hash == "f75a1da5e1d50c7641e1a7e204d7a43df7533de860e74dd19ea55877436fb1c6"
    assert "nameplate" not in dump_set(SET)
    assert "work_order" not in dump_set(SET)


def test_nameplate_and_work_order_are_kept_and_only_the_nameplate_is_state() -> None:
    plated = dataclasses.replace(SET, identity=dataclasses.replace(SET.identity, nameplate="SN 4711"))
    ordered = dataclasses.replace(SET, origin=dataclasses.replace(ORIGIN, work_order="WO-1"))
    assert plated.hash != SET.hash
    assert ordered.hash == SET.hash
    for one in (plated, ordered):
        assert load_set(dump_set(one), "x.json") == one


def test_the_content_is_what_the_hash_covers() -> None:
    assert hashlib.sha256(SET.content.encode()).hexdigest() == SET.hash
    assert parse_content(SET.content, ORIGIN) == dataclasses.replace(SET, unread={})
    with pytest.raises(SetFileError):
        parse_content(SET.content.replace('"identity"', '"identities"'), ORIGIN)


@pytest.mark.parametrize(
    ("text", "t_ns"),
    [
        ("2026-03-04T14:03:21Z", 1_772_633_001_000_000_000),
        ("2026-03-04T14:03:21.000250Z", 1_772_633_001_000_250_000),
    ],
)
def test_an_instant_is_written_as_it_is_read(text: str, t_ns: int) -> None:
    origin = dataclasses.replace(ORIGIN, time=text)
    assert origin.t_ns == t_ns
    assert iso_time(t_ns) == text
    assert dataclasses.replace(ORIGIN, time="2026-03-04T15:03:21+01:00").t_ns == 1_772_633_001_000_000_000
    with pytest.raises(ValueError, match="offset"):
        assert dataclasses.replace(ORIGIN, time="2026-03-04T15:03:21").t_ns


@pytest.mark.parametrize(
    ("old", "new", "at", "reason"),
    [
        ('"3110:01": 500', '"3110:01": 501', '"hash"', "hash"),
        ('"3110:01": 500', '"3110.1.1": 500', "3110.1.1", "no address"),
        ('"3110:01": 500', '"3110:1": 500', '"3110:1"', "written as 3110:01"),
        ('"3110:01": 500', '"3110:01": 500,,', "500,,", "JSON"),
        ('"3110:01": 500', '"3110:01": true', '"3110:01": true', "no raw value"),
        ('"3110:01": 500', '"3110:01": NaN', "NaN", "no number"),
        ('"3110:01": 500', '"3110:01": 1e999', "1e999", "too large"),
        ('"3110:01": 500', '"3110:01": ' + "7" * 5000, "777", "5000 digits"),
        ('"3110:01": 500', '"3110:01": 500,\n  "3110:01": 501', '"3110:01": 501', "twice"),
        ('"3110:01": 500', '"3111:01": 500', '"3111:01": 500', "said to have none"),
        ('"0102"', '"01 x"', '"2030:01"', "no bytes"),
        ("hubside-set/1", "hubside-set/2", '"format"', "hubside-set/2"),
        ("hubside-set/1", "other", "{", "no parameter set"),
        ('"values"', '"value"', '"value"', "no part 'value'"),
        ('"empty": [],', '"empty": {},', '"empty"', "another shape"),
        ('"empty": []', '"empty": [7]', '"empty"', "no text"),
        ('"complete": false', '"complete": true', '"complete"', "complete"),
        ('"serial": 7', '"serial": "7"', '"serial"', "another shape"),
        ('"serial": 7', '"colour": 7', '"colour"', "no 'colour'"),
        ('"node": 1', '"node": "1"', '"node"', "no number"),
        ('"person": "A. Technician",', "", '"origin"', "missing"),
        ("2026-03-04T14:03:21Z", "yesterday", '"time"', "no time"),
        ("2026-03-04T14:03:21Z", "2026-03-04T14:03:21", '"time"', "offset from UTC"),
        ("2026-03-04T14:03:21Z", "2026-03-04", '"time"', "offset from UTC"),
        ('"3110:01": 500', '"3110:01": 18446744073709551616', '"3110:01"', "64 bits"),
        ('"3110:01": 500', '"3110:01": -9223372036854775809', '"3110:01"', "64 bits"),
        ("2026-03-04T14:03:21Z", "9999-12-31T00:00:00Z", '"time"', "1970 to 2262"),
        ("2026-03-04T14:03:21Z", "1914-12-31T00:00:00Z", '"time"', "1970 to 2262"),
        ('"node": 1', '"node": 70000', '"node"', "from 0 to"),
        ('"person": "A. Technician"', '"person": "\\ud800"', '"person"', "half a character"),
        ('"PMM"', '"\\ud800"', "{", "text"),
    ],
)
def test_a_damaged_file_names_line_and_reason(old: str, new: str, at: str, reason: str) -> None:
    text = dump_set(SET).replace(old, new)
    assert text != dump_set(SET)
    line = text[: text.index(at)].count("\n") + 1
    with pytest.raises(SetFileError) as caught:
        load_set(text, "x.json")
    assert reason in caught.value.details["reason"]
    assert caught.value.details["line"] == line


def test_a_text_that_is_nested_without_end_is_refused() -> None:
    with pytest.raises(SetFileError):
        load_set('{"format": "hubside-set/1", "values": ' + "[" * 100_000, "x.json")


@settings(max_examples=300, deadline=None)
@given(st.data())
def test_whatever_is_done_to_a_file_the_same_set_comes_of_it_or_none(data: st.DataObject) -> None:
    text = dump_set(SET)
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 40)))
    piece = data.draw(st.one_of(st.text(max_size=4), st.sampled_from(list('{}[]",:0123456789'))))
    try:
        loaded = load_set(text[:start] + piece + text[end:], "x.json")
    except SetFileError as error:
        assert error.details["line"] >= 1
        assert error.details["reason"]
    else:
        assert (loaded.values, loaded.identity, loaded.hash) == (SET.values, SET.identity, SET.hash)
