"""Sets as CSV: read back whole, from spreadsheets, and refused with line and reason where a row is not understood."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.errors import SetFileError
from app.model.address import Address
from app.model.datatypes import Raw
from app.model.set_csv import dump_csv, load_csv
from app.model.set_import import read_set_file
from app.model.sets import ParameterSet, dump_set, load_set
from tests.model.set_rig import DESCRIPTIONS, any_set, taking, whole_set

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
        ("1234", "18446744073709551616", 2, "is no raw value"),
        ("1234", "1e999", 2, "is no raw value"),
        ("1234", 'json:"\\ud800"', 2, "is no raw value"),
        ("1234", "json:7", 2, "is no raw value"),
        ("window,1234", '"win\ndow",many', 2, "is no raw value"),
        ("1017,heartbeat", '"10\n17",heartbeat', 3, "no address"),
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
@given(any_set())
def test_any_set_comes_back_from_its_file(parameters: ParameterSet) -> None:
    for description in (DESCRIPTIONS["oat-pmc"], None):
        data = dump_csv(parameters, description).encode()
        read = read_set_file(data, "x.csv", taking(origin=None, descriptions={})).parameters
        assert read == parameters
        assert read.hash == parameters.hash, "minus zero too"


def test_a_value_that_no_cell_can_hold_comes_back() -> None:
    values: dict[Address, Raw] = {
        Address(0x1F50): bytes(150_000),
        Address(0x1008): "x" * 150_000,
        Address(0x1009): "\x7f" * 50_000,
    }
    parameters = replace(whole_set("oat-pmc"), values=values, unread={}, empty=())
    text = dump_csv(parameters, DESCRIPTIONS["oat-pmc"])
    assert read_set_file(text.encode(), "x.csv", taking()).parameters == parameters


@pytest.mark.parametrize(
    "text", ["a\r\nb\rc\nd", "\0", "=cmd()", "'=1", '"', ' "a", ', "\ufeff", "\u2028", "", "x\ty;z"]
)
def test_a_text_comes_back_as_it_went_out_also_where_the_values_only_are_read(text: str) -> None:
    parameters = whole_set("oat-pmc")
    parameters = replace(parameters, values={**parameters.values, Address(0x1008): text})
    data = dump_csv(parameters, DESCRIPTIONS["oat-pmc"]).encode()
    assert b"\0" not in data
    for how in (taking(), taking(as_values=True)):
        read = read_set_file(data, "x.csv", how)
        where = [one.line for one in read.unknown if one.address == Address(0x1008)]
        assert where or read.parameters.values[Address(0x1008)] == text
        assert bool(where) is (how.as_values and not text.isascii()), "1008h is an ASCII text"


CELLS = st.one_of(
    st.sampled_from(["6065", "6065:00", "1008", "12/221", "text:", 'json:"a"', 'json:"\\ud800"', "json:1", "json:["]),
    st.sampled_from(
        ["hex:00", "hex:0g", "1" * 25, "18446744073709551615", "18446744073709551616", "0xFFFFFFFFFFFFFFFF"]
    ),
    st.sampled_from(
        ["1e999", "-1.5e308", "nan", "1_0", "12,5", "#hubside-set", '{"format":"hubside-set/1"}', '"', "\0"]
    ),
    st.text(max_size=4),
)


@settings(max_examples=400, deadline=None)
@given(st.lists(st.lists(CELLS, max_size=5), max_size=5), st.sampled_from(",;\t"), st.booleans(), st.booleans())
def test_any_other_table_is_a_set_or_an_error_with_line_and_reason(
    rows: list[list[str]], delimiter: str, as_values: bool, quoted: bool
) -> None:
    out = io.StringIO(newline="")
    out.write(delimiter.join(("address", "raw", "value")) + "\r\n6065" + delimiter + "1\r\n")
    if quoted:
        csv.writer(out, delimiter=delimiter).writerows(rows)
    else:
        out.write("\n".join(delimiter.join(row) for row in rows))
    data = out.getvalue().encode("utf-8", "replace")
    try:
        read = read_set_file(data, "x.csv", taking(as_values=as_values))
    except SetFileError as error:
        assert 1 <= error.details["line"] <= data.count(b"\n") + data.count(b"\r") + 1
        assert error.details["reason"]
    else:
        assert load_set(dump_set(read.parameters), "x.json") == read.parameters, "it can be kept"


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


def test_a_file_that_calls_itself_json_is_judged_as_such() -> None:
    with pytest.raises(SetFileError) as caught:
        read_set_file(b"no set", "x.json", taking())
    assert caught.value.details["reason"].startswith("no valid JSON")
