"""The record itself: the same JSON byte for byte, and nothing else is taken for one."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from app.service.records.plain_json import RecordShapeError, canonical
from app.service.records.restore_record import Value, dump_record, load_record
from tests.service.records.sample import failed, record


@pytest.mark.parametrize("one", [record(), failed()], ids=["new", "incomplete"])
def test_a_record_comes_back_as_it_was(one: Any) -> None:
    text = dump_record(one)
    assert load_record(text) == one
    assert dump_record(load_record(text)) == text
    assert text == canonical(json.loads(text)), "canonical"


@pytest.mark.parametrize("raw", [0, -5, 2**63, 1.5, float("inf"), "text", "", b"\x00\xff", b""])
def test_every_kind_of_raw_value_comes_back(raw: Any) -> None:
    one = record()
    one = replace(one, rows=(replace(one.rows[0], was=Value(raw, "shown")),))
    again = load_record(dump_record(one)).rows[0].was
    assert again is not None
    assert again.raw == raw
    assert type(again.raw) is type(raw)


def parts(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths to everything in a JSON, lists by their first element."""
    if path:
        yield path
    if isinstance(data, dict):
        for key in data:
            yield from parts(data[key], (*path, key))
    elif isinstance(data, list) and data:
        yield from parts(data[0], (*path, 0))


WHOLE = json.loads(dump_record(record()))
FREE = ("details", "identity")
"""Objects whose keys are free."""


@pytest.mark.parametrize("path", tuple(parts(WHOLE)), ids=lambda path: ".".join(map(str, path)))
def test_no_part_may_be_missing_or_of_another_type(path: tuple[Any, ...]) -> None:
    for change in ("remove", "retype"):
        content = copy.deepcopy(WHOLE)
        parent = content
        for key in path[:-1]:
            parent = parent[key]
        if change == "retype":
            parent[path[-1]] = [["of", "no", "such", "type"]]
        elif isinstance(parent, list) or (len(path) > 1 and path[-2] in FREE):
            continue
        else:
            del parent[path[-1]]
        with pytest.raises(RecordShapeError):
            load_record(canonical(content))


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{",
        "null",
        '{"format":"hubside-restore-record/2","record":{}}',
        "[" * 100_000,
        '{"a":NaN}',
        '{"a":1,"a":1}',
    ],
    ids=lambda text: text[:20],
)
def test_what_is_no_record_is_refused(text: str) -> None:
    with pytest.raises(RecordShapeError):
        load_record(text)


def test_json_that_is_not_canonical_is_refused() -> None:
    text = dump_record(record())
    for other in (f" {text}", f"{text}\n", text.replace(":", ": ", 1), text.replace("é", "\\u00e9")):
        assert json.loads(other) == json.loads(text)
        with pytest.raises(RecordShapeError):
            load_record(other)


def test_a_part_more_is_refused() -> None:
    content = copy.deepcopy(WHOLE)
    content["record"]["rows"][0]["approved"] = True
    with pytest.raises(RecordShapeError, match=r"rows\[0\].*approved"):
        load_record(canonical(content))
