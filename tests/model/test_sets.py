"""Parameter sets: the file, its hash, and damaged files."""

from __future__ import annotations

import dataclasses

import pytest

from app.errors import SetFileError
from app.model.address import Address
from app.model.sets import Identity, Origin, ParameterSet, dump_set, load_set

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


@pytest.mark.parametrize(
    ("old", "new", "at", "reason"),
    [
        ('"3110:01": 500', '"3110:01": 501', '"hash"', "hash"),
        ('"3110:01": 500', '"3110.1.1": 500', "3110.1.1", "no address"),
        ('"3110:01": 500', '"3110:01": 500,,', "500,,", "JSON"),
        ("hubside-set/1", "hubside-set/2", '"format"', "hubside-set/2"),
        ("hubside-set/1", "other", "{", "no parameter set"),
        ('"values"', '"value"', "{", "missing"),
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
