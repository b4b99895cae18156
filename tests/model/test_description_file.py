"""Descriptions: what is read, and how a wrong file is told."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest

from app.errors import DescriptionError, UnknownObjectError
from app.model.address import Address
from app.model.datatypes import DataType
from app.model.description import Access, Description, Fact, Kind, LimitRef, PdoSide, RestoreClass, Verify
from app.model.description_file import load, problems
from tests.model.conftest import TOY


def test_rows_inherit_from_their_object(toy: Description) -> None:
    warning = toy.entry(Address(0x2000, 1))
    assert (warning.type, warning.access, warning.saved) == (DataType.INTEGER16, Access.RW, True)
    assert (warning.quantity.unit, warning.quantity.scale) == ("°C", Decimal("0.1"))
    assert warning.maximum == LimitRef(Address(0x2000, 2))
    assert warning.restore is RestoreClass.COPY
    assert warning.title == "temperature supervisor: warning level"
    assert warning.default == 500


def test_sub_zero_is_implied(toy: Description) -> None:
    zero = toy.entry(Address(0x2000, 0))
    assert (zero.name, zero.type, zero.access, zero.default) == (
        "number of elements",
        DataType.UNSIGNED8,
        Access.RO,
        2,
    )
    assert zero.saved, "Mem stands for the whole index"
    assert zero.restore is RestoreClass.NEVER
    assert toy.entry(Address(0x1010, 0)).default == 3, "the highest sub-index, not the count"


def test_elements_are_expanded(toy: Description) -> None:
    assert [toy.entry(Address(0x2004, sub)).name for sub in (1, 2)] == ["part 1", "part 2"]
    assert toy.entry(Address(0x2004, 1)).kind is Kind.ARRAY


def test_verify_and_order(toy: Description) -> None:
    assert toy.entry(Address(0x1010, 3)).verify is Verify.ACK
    assert list(toy.entries) == sorted(toy.entries)


def test_unknown_address(toy: Description) -> None:
    with pytest.raises(UnknownObjectError) as caught:
        toy.entry(Address(0x4711))
    assert caught.value.details["address"] == "4711"


@pytest.mark.parametrize(
    ("old", "new", "at", "reason"),
    [
        ("schema = 1", "schema = 2", "schema", "this version reads 1"),
        ('default = 500, max = { address = "2000:02" }', "default = 99999", "99999", "does not fit INTEGER16"),
        ('sub = 1, name = "warning level"', 'sub = 1, naem = "warning level"', "naem", "naem"),
        ('sub = 1, name = "warning level"', 'sub = 300, name = "warning level"', "[[object]]\nindex = 0x2000", "300"),
        ('max = { address = "2000:02" }', 'max = { address = "2000:09" }', "2000:09", "2000:09"),
        ('bits = "outputs"', 'bits = "output"', "[[object]]\nindex = 0x2001", "bit table 'output'"),
        ('enumeration = "kind"', 'enumeration = "kin"', "[[object]]\nindex = 0x2002", "enumeration 'kin'"),
        ("min = -400", "min = 551", "min = 551", "below the minimum"),
        ('type = "visible_string"', 'type = "string"', "[[object]]\nindex = 0x2005", "type is 'string'"),
        ("index = 0x2005", "index = 0x2003", '[[object]]\nindex = 0x2003\nname = "label"', "stands twice"),
        ('access = "ro"', 'access = "ro"\ncolour = 1', "colour", "unknown key 'colour'"),
        ("{ bit = 4, last", "{ bit = 0, last", "[[bit_table]]", "stands twice"),
        ("by_variant = { big =", "by_variant = { small =", "small", "variant 'small'"),
        ('address = "1010:03"', 'address = "1010:04"', "[[save]]", "no object"),
        ('restore = "factory"', 'restore = "copy"', "[[object]]\nindex = 0x2004", "cannot be written"),
        (
            'group = "all"\ntype = "visible_string"',
            'group = "al"\ntype = "visible_string"',
            "[[object]]\nindex = 0x2005",
            "group 'al'",
        ),
        ("[[object]]\nindex = 0x2002", "[[object]\nindex = 0x2002", "[[object]\nindex = 0x2002", "no valid TOML"),
    ],
)
def test_a_wrong_file_names_line_and_reason(tmp_path: Path, old: str, new: str, at: str, reason: str) -> None:
    assert TOY.count(old) >= 1
    path = tmp_path / "wrong.toml"
    text = TOY.replace(old, new, 1)
    assert at in text
    line = text[: text.index(at)].count("\n") + 1
    path.write_text(text, encoding="utf-8")
    found = problems(path)
    assert any(p.line == line and reason in p.reason for p in found), [str(p) for p in found]
    with pytest.raises(DescriptionError) as caught:
        load(path)
    assert caught.value.details["file"] == str(path)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    assert "cannot be read" in problems(tmp_path / "nowhere.toml")[0].reason


def test_a_right_file_has_no_problems(toy_file: Path) -> None:
    assert problems(toy_file) == []


def test_errors_share_texts_by_their_family(tmp_path: Path) -> None:
    path = tmp_path / "toy.toml"
    family = 'aid = "bloc_low"\nnumber = 2\n'
    path.write_text(f'{TOY}\n[[error]]\ncode = 1\nname = "hot"\n[[error]]\ncode = 2\nname = "bloc_2_low"\n{family}')
    hot, bloc = load(path).errors.values()
    assert (hot.cause_key, hot.first_aid_key, hot.number) == ("error_cause.hot", "first_aid.hot", None)
    assert (bloc.cause_key, bloc.first_aid_key, bloc.number) == ("error_cause.bloc_low", "first_aid.bloc_low", 2)
    assert bloc.text_key == "error_code.bloc_2_low", "its name is its own"


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ('name = "hot"\nfamily = "x"', "unknown key 'family'"),
        ('name = "hot"\naid = ""', "key 'aid'"),
        ('name = "hot"\nnumber = "two"', "key 'number'"),
    ],
)
def test_a_wrong_error_names_line_and_reason(tmp_path: Path, row: str, reason: str) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(f"{TOY}\n[[error]]\ncode = 1\n{row}\n", encoding="utf-8")
    found = problems(path)
    assert [(one.line, reason in one.reason) for one in found] == [(TOY.count("\n") + 2, True)], [str(p) for p in found]


def row_of(tmp_path: Path, keys: str, head: str = "") -> Path:
    """The toy with one more object."""
    path = tmp_path / "toy.toml"
    row = 'index = 0x2999\nname = "more"\nsection = "1"\ngroup = "all"\ntype = "unsigned8"\naccess = "rw"'
    path.write_text(f"{TOY}\n{head}\n[[object]]\n{row}\n{keys}\n", encoding="utf-8")
    return path


def test_facts_that_are_not_printed_and_their_source(tmp_path: Path) -> None:
    head = '[[source]]\nid = "other"\ntitle = "Another manual"'
    some = load(row_of(tmp_path, 'inferred = ["default", "sub"]\norigin = "other"', head)).entry(Address(0x2999))
    assert (some.inferred, some.origin) == (True, "other")
    assert [some.proves(fact) for fact in (Fact.DEFAULT, Fact.SUB, Fact.TYPE)] == [False, False, True]
    whole = load(row_of(tmp_path, "inferred = true")).entry(Address(0x2999))
    assert not any(whole.proves(fact) for fact in Fact)
    printed = load(row_of(tmp_path, "")).entry(Address(0x2999))
    assert all(printed.proves(fact) for fact in Fact)


@pytest.mark.parametrize(("pdo", "side"), [('"rx"', PdoSide.RX), ('"tx"', PdoSide.TX), ("true", None)])
def test_the_side_of_the_process_image(tmp_path: Path, pdo: str, side: PdoSide | None) -> None:
    row = load(row_of(tmp_path, f"pdo = {pdo}")).entry(Address(0x2999))
    assert (row.pdo, row.pdo_side) == (True, side)


def test_objects_share_a_rule_of_units(tmp_path: Path) -> None:
    head = '[[unit_rule]]\nid = "way"\naddress = "2002"\nchoices = { "0x10" = { unit = "mm" } }'
    rule = load(row_of(tmp_path, 'unit_from = "way"', head)).entry(Address(0x2999)).quantity_rule
    assert rule is not None
    assert (rule.address, rule.choices[16].unit) == (Address(0x2002), "mm")


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ('inferred = ["colour"]', "inferred is 'colour'"),
        ('inferred = "yes"', "key 'inferred' is 'yes'"),
        ('origin = "nowhere"', "source 'nowhere' does not exist"),
        ('pdo = "both"', "neither true nor false"),
        ('unit_from = "nothing"', "unit rule 'nothing' does not exist"),
        ("by_variant = { big = { default = 300 } }", "does not fit UNSIGNED8"),
        ('enumeration_from = { address = "2002", choices = { "1" = "nothing" } }', "enumeration 'nothing'"),
        ('bits_from = { address = "2002", choices = { "1" = "nothing" } }', "bit table 'nothing'"),
        ('bits_from = { address = "4711", choices = { "1" = "outputs" } }', "bits_from refers to 4711"),
        ('limits_from = { address = "4711", choices = { "1" = { min = 1 } } }', "limits_from refers to 4711"),
        ('limits_from = { address = "2002", choices = { "1" = { min = "low" } } }', "limit 'low'"),
        ("step = 0", "step is 0"),
        ("step = 2\ndefault = 5", "default 5 is none of"),
        ("only = [1, 2]\ndefault = 5", "default 5 is none of"),
        ('tool_name = ""', "key 'tool_name'"),
    ],
)
def test_a_wrong_row_says_why(tmp_path: Path, keys: str, reason: str) -> None:
    found = problems(row_of(tmp_path, keys))
    assert any(reason in one.reason for one in found), [str(one) for one in found]
