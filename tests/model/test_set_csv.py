"""Sets as CSV: read back whole, from spreadsheets, and refused with line and reason where a row is not understood."""

from __future__ import annotations

import csv
import io

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import SetFileError
from app.model.address import Address
from app.model.set_csv import dump_csv, load_csv
from app.model.set_import import read_set_file
from tests.model.set_rig import DESCRIPTIONS, taking, whole_set

TABLE = "address,name,raw,value,unit\n6065,window,1234,12.34,°\n1017,heartbeat,500,500,ms\n2FFF,other,1,1,\n"


@pytest.mark.parametrize("device", ["oat-pmm", "oat-pmc"])
def test_the_very_set_comes_back(device: str) -> None:
    parameters = whole_set(device)
    for description in (DESCRIPTIONS[device], None):
        text = dump_csv(parameters, description)
        assert load_csv(text, "x.csv", taking(origin=None, descriptions={})).parameters == parameters
    assert read_set_file(b"\xef\xbb\xbf" + text.encode(), "x.csv", taking()).parameters == parameters


def test_the_rows_are_for_people_and_no_formula_is_in_them() -> None:
    text = dump_csv(whole_set("oat-pmc"), DESCRIPTIONS["oat-pmc"])
    rows = {row[0]: row for row in csv.reader(io.StringIO(text, newline=""))}
    assert rows["6866:00"] == ["6866:00", "difference error time out", "0", "0", "ms"]
    assert rows["6065:00"][2:] == [rows["6065:00"][2], f"{int(rows['6065:00'][2]) / 100:.2f}", "°"]
    assert not any(cell.startswith(("=", "@")) for row in rows.values() for cell in row)


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_a_table_of_a_spreadsheet_is_read_as_values(delimiter: str) -> None:
    text = TABLE.replace(",", delimiter).replace("\n", "\r\n")
    read = load_csv(text, "x.csv", taking())
    assert read.foreign
    assert read.parameters.values == {Address(0x6065): 1234, Address(0x1017): 500}
    assert [(one.address, one.line) for one in read.unknown] == [(Address(0x2FFF), 4)]
    assert read.parameters.unread[Address(0x6064)] == "not in the file"


def test_a_changed_value_is_refused_unless_the_values_are_wanted_as_they_are() -> None:
    parameters = whole_set("oat-pmc")
    text = dump_csv(parameters, DESCRIPTIONS["oat-pmc"])
    changed = text.replace("6866:00,difference error time out,0,", "6866:00,difference error time out,5,")
    assert changed != text
    with pytest.raises(SetFileError, match="was changed") as refused:
        load_csv(changed, "x.csv", taking())
    assert refused.value.details["line"] == 1
    read = load_csv(changed, "x.csv", taking(as_values=True))
    assert read.parameters.values[Address(0x6866)] == 5
    assert parameters.values[Address(0x6866)] == 0


@pytest.mark.parametrize(
    ("old", "new", "line", "reason"),
    [
        ("6065,", "65,", 2, "no address"),
        ("1234", "12,34", 2, "more cells than"),
        ("1234", "twelve", 2, "'twelve' is no raw value"),
        ("1234", "", 2, "is no raw value"),
        ("1234", "hex:0x", 2, "is no raw value"),
        ("6065,window,1234,12.34,°", "6065", 2, "ends too early"),
        ("1017", "6065", 3, "twice"),
        ("raw", "row", 1, "no column 'raw'"),
        ("window", '"win"dow', 2, "no valid CSV"),
        ("window", "win\0dow", 2, "zero byte"),
        (TABLE, "address,raw\n", 1, "no values"),
        ("6065,window", '#hubside-set,"{""format"": 1"\n6065,window', 2, "damaged"),
    ],
)
def test_a_damaged_file_names_line_and_reason(old: str, new: str, line: int, reason: str) -> None:
    text = TABLE.replace(old, new, 1)
    with pytest.raises(SetFileError) as refused:
        load_csv(text, "x.csv", taking())
    assert reason in refused.value.details["reason"]
    assert refused.value.details["line"] == line


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_whatever_is_done_to_our_own_file_the_same_set_comes_of_it_or_none(data: st.DataObject) -> None:
    parameters = whole_set("oat-pmc")
    text = dump_csv(parameters, None)
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, min(len(text), start + 30)))
    piece = data.draw(st.text(max_size=3))
    try:
        read = load_csv(text[:start] + piece + text[end:], "x.csv", taking(origin=None))
    except SetFileError as error:
        assert error.details["line"] >= 1
    else:
        assert read.parameters.hash == parameters.hash
