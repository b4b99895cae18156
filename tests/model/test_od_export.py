"""The CSV table and the JSON document of a description."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from decimal import Decimal
from typing import Any

import pytest

from app.model.address import Address, Addressing
from app.model.datatypes import DataType
from app.model.description import Access, Description, Quantity
from app.model.description_file import load_builtin
from app.model.od_export import CSV_COLUMNS, description_dict, to_csv, to_json


def rows_of(description: Description) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(to_csv(description))))


def with_entry(description: Description, address: str, **changes: Any) -> Description:
    entries = {
        key: dataclasses.replace(entry, **changes) if key.short == address else entry
        for key, entry in description.entries.items()
    }
    return dataclasses.replace(description, entries=entries)


def row(description: Description, index: str, sub: str = "0") -> dict[str, str]:
    (found,) = [one for one in rows_of(description) if (one["index"], one["sub"]) == (index, sub)]
    return found


def entry(description: Description, address: str) -> dict[str, Any]:
    (found,) = [one for one in description_dict(description)["entries"] if one["address"] == address]
    return dict(found)


# CSV


def test_header_is_exactly_this(toy: Description) -> None:
    assert to_csv(toy).splitlines()[0] == "index,sub,name,type,access,pdo,default,unit,scale,saved,class"
    assert ",".join(CSV_COLUMNS) == to_csv(toy).splitlines()[0]


def test_rows_as_text(toy: Description) -> None:
    lines = to_csv(toy).splitlines()
    assert "2000,0,number of elements,UNSIGNED8,ro,no,2,,1,yes,never" in lines
    assert "2000,1,warning level,INTEGER16,rw,no,500,°C,0.1,yes,copy" in lines
    assert "2004,2,part 2,UNSIGNED32,r(w),no,1,,1,no,factory" in lines
    assert "2005,0,label,VISIBLE_STRING,ro,no,x,,1,no,never" in lines
    assert "2003,0,home offset,INTEGER32,rw,no,,°,0.01,no,never" in lines


@pytest.mark.parametrize("device", ["oat-pmm", "oat-pmc"])
def test_every_sub_index_has_its_row(device: str) -> None:
    description = load_builtin(device)
    rows = rows_of(description)
    assert [(int(one["index"], 16), int(one["sub"])) for one in rows] == [
        (address.major, address.minor) for address in description.entries
    ]
    assert {one["access"] for one in rows} <= {"ro", "rw", "wo", "r(w)"}
    assert {one["class"] for one in rows} <= {"copy", "unit", "factory", "never"}
    assert {one["type"] for one in rows} <= {data_type.name for data_type in DataType}
    assert {one["pdo"] for one in rows} | {one["saved"] for one in rows} == {"yes", "no"}
    assert all(one["index"] == one["index"].upper() and len(one["index"]) == 4 for one in rows)
    assert all("E" not in one["scale"] and Decimal(one["scale"]) > 0 for one in rows)


def test_constants_are_read_only(toy: Description) -> None:
    assert row(with_entry(toy, "2005", access=Access.CONST), "2005")["access"] == "ro"


def test_defaults_that_depend_on_the_node_are_those_of_node_zero(toy: Description) -> None:
    assert row(with_entry(toy, "2001", node_id=True, default=0x80), "2001")["default"] == "128"


@pytest.mark.parametrize(
    ("scale", "text"), [("1", "1"), ("0.10", "0.1"), ("10", "10"), ("1E+2", "100"), ("0.0000001", "0.0000001")]
)
def test_scales_are_plain_decimals(toy: Description, scale: str, text: str) -> None:
    assert row(with_entry(toy, "2001", quantity=Quantity("s", Decimal(scale))), "2001")["scale"] == text


def test_texts_and_bytes(toy: Description) -> None:
    text = with_entry(toy, "2005", default='a, "b"')
    assert row(text, "2005")["default"] == 'a, "b"'
    data = with_entry(toy, "2005", type=DataType.OCTET_STRING, default=b"\x0a\xff")
    assert row(data, "2005")["default"] == "0AFF"


def test_ind_and_pnu(toy: Description) -> None:
    address = Address(12, 221, Addressing.PKW)
    one = dataclasses.replace(toy.entry(Address(0x2005)), address=address)
    device = dataclasses.replace(toy, addressing=Addressing.PKW, entries={address: one})
    assert (row(device, "000C", "221")["name"]) == "label"
    found = entry(device, "12/221")
    assert (found["ind"], found["pnu"], found["index"], found["sub"]) == (12, 221, None, None)


# JSON


def test_json_is_canonical(toy: Description) -> None:
    text = to_json(toy)
    document = json.loads(text)
    assert document == description_dict(toy)
    assert text == json.dumps(document, ensure_ascii=False, sort_keys=True, indent=2) + "\n"
    assert text == to_json(toy)


@pytest.mark.parametrize("device", ["oat-pmm", "oat-pmc"])
def test_json_holds_everything(device: str) -> None:
    description = load_builtin(device)
    document = json.loads(to_json(description))
    assert len(document["entries"]) == len(description.entries)
    assert [group["id"] for group in document["groups"]] == list(description.groups)
    assert document["bit_tables"].keys() == description.bit_tables.keys()
    assert document["enumerations"].keys() == description.enumerations.keys()
    assert [error["code"] for error in document["errors"]] == list(description.errors)
    keys = {frozenset(one) for one in document["entries"]}
    assert len(keys) == 1, "every entry has every key"


def test_entry_for_a_web_client(toy: Description) -> None:
    found = entry(toy, "2000:01")
    assert found["title"] == "temperature supervisor: warning level"
    assert (found["index"], found["sub"], found["type"], found["bit_count"]) == (0x2000, 1, "INTEGER16", 16)
    assert found["range"] == [-32768, 32767]
    assert (found["unit"], found["scale"], found["decimals"]) == ("°C", 0.1, 1)
    assert (found["minimum"], found["maximum"]) == (None, {"address": "2000:02", "factor": 1})
    assert (found["readable"], found["writable"], found["restore"]) == (True, True, "copy")
    other = entry(toy, "2000:02")
    assert (other["minimum"], other["maximum"]) == (-400, 900)
    assert other["by_variant"] == {"big": {"default": None, "minimum": None, "maximum": 1200}}


def test_references_of_an_entry(toy: Description) -> None:
    found = entry(toy, "2003")
    assert found["unit_from"] == {"address": "2004:01", "shaft": "2004:02", "choices": {}}
    assert found["requires"] == [{"address": "2002", "values": [1], "writing": []}]
    assert entry(toy, "1010:03")["verify"] == "ack"


def test_tables(toy: Description) -> None:
    document = description_dict(toy)
    assert document["bit_tables"]["outputs"] == [
        {"bit": 0, "last": 0, "name": "fan", "text_key": "bit.outputs.fan", "clamp": "X1.1", "error_code": None},
        {"bit": 4, "last": 5, "name": "mode", "text_key": "bit.outputs.mode", "clamp": None, "error_code": None},
    ]
    assert document["enumerations"]["kind"]["values"][1] == {
        "value": -3,
        "name": "three",
        "text_key": "enum.kind.three",
    }
    assert document["save"] == [{"address": "1010:03", "signature": 0x65766173, "category": None, "timeout_s": 10.0}]
    assert document["groups"] == [{"id": "all", "text_key": "group.all"}]


def test_bytes_in_json(toy: Description) -> None:
    data = with_entry(toy, "2005", type=DataType.OCTET_STRING, default=b"\x0a\xff")
    assert entry(data, "2005")["default"] == {"hex": "0AFF"}
