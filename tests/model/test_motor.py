"""Motors: what belongs to them, what is refused, how they compare, and their CSV, line and column where it is wrong."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from typing import Final

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from app.errors import MotorFieldError, MotorFileError
from app.model.address import Address, parse_address
from app.model.description import RestoreClass
from app.model.description_file import load_builtin
from app.model.motor import (
    PLATE_FIELDS,
    Draft,
    Motor,
    Plate,
    Source,
    checked,
    disagreements,
    dump_draft,
    entries_of,
    load_draft,
    parse_value,
    wanted_values,
)
from app.model.motor_csv import read_motors, write_motors
from app.model.motor_diff import RowState, compare_plates, compare_values
from app.model.texts import error_text, load_texts

PMC: Final = load_builtin("oat-pmc")
RHO: Final = Address(0x6410, 2)
ID: Final = "0197a000-0000-7000-8000-0000000000aa"
PLATE: Final = Plate(
    Decimal("5.5"), Decimal("18"), Decimal(2920), Decimal("11.3"), Decimal(400), Decimal(1), "sine/cosine", "", "PT100"
)
VALUES: Final = {
    parse_address(text): raw
    for text, raw in {
        "6402": 7,
        "6410:01": 1,
        "6410:02": 1234,
        "6410:03": 4000,
        "6410:04": 2920,
        "6073": 2000,
        "6076": 11_300,
    }.items()
}
DRAFT: Final = Draft("Lorentz", "PM 5.5-2", PLATE, VALUES, "measured on the bench")


def motor(draft: Draft = DRAFT, source: Source = Source.TYPED) -> Motor:
    return Motor(ID, 1, draft, source, "", 0, "Anna", PMC.version)


def with_values(**values: int) -> Draft:
    own = {parse_address(name[1:].replace("_", ":")): raw for name, raw in values.items()}
    return replace(DRAFT, values={**VALUES, **own})


# -- what belongs to a motor -------------------------------------------------------


def test_a_motor_holds_all_that_the_manual_takes_from_the_database_and_can_be_set() -> None:
    addresses = [entry.address.short for entry in entries_of(PMC)]
    motor_data = [f"6410:{sub:02X}" for sub in (*range(1, 9), *range(10, 16))]
    torque, velocity = [f"60F6:{sub:02X}" for sub in range(1, 4)], [f"60F9:{sub:02X}" for sub in range(1, 7)]
    assert addresses == ["6402", *motor_data, "6073", "6076", "6080", *torque, *velocity]


def test_what_belongs_to_the_machine_never_goes_into_a_device() -> None:
    assert PMC.entry(RHO).restore is RestoreClass.UNIT
    wanted = wanted_values(PMC, VALUES)
    assert RHO in VALUES and RHO not in wanted
    assert wanted == {address: raw for address, raw in VALUES.items() if address != RHO}


def test_a_draft_comes_back_from_the_store_as_it_was() -> None:
    draft = checked(PMC, DRAFT)
    assert load_draft(dump_draft(draft)) == draft
    assert load_draft(dump_draft(Draft("a", "b"))) == Draft("a", "b")


# -- what is refused ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("draft", "field", "reason"),
    [
        (replace(DRAFT, maker="  "), "maker", "motor.flaw.missing"),
        (replace(DRAFT, type="x" * 81), "type", "motor.flaw.long"),
        (replace(DRAFT, type="a\x07"), "type", "motor.flaw.long"),
        (replace(DRAFT, remarks="a\x00b"), "remarks", "motor.flaw.long"),
        (replace(DRAFT, remarks="x" * 2001), "remarks", "motor.flaw.long"),
        (replace(DRAFT, plate=replace(PLATE, power_kw=Decimal(1001))), "power_kw", "motor.flaw.range"),
        (replace(DRAFT, plate=replace(PLATE, power_kw=Decimal(0))), "power_kw", "motor.flaw.range"),
        (replace(DRAFT, plate=replace(PLATE, power_kw=Decimal("NaN"))), "power_kw", "motor.flaw.range"),
        (replace(DRAFT, plate=replace(PLATE, pole_pairs=Decimal("1.5"))), "pole_pairs", "motor.flaw.decimals"),
        (replace(DRAFT, plate=replace(PLATE, brake="x" * 81)), "brake", "motor.flaw.long"),
        (with_values(_6073=2001), "6073", "motor.flaw.range"),
        (with_values(_6410_03=65_536), "6410:03", "motor.flaw.range"),
        (with_values(_6076=-1), "6076", "motor.flaw.range"),
        (with_values(_6402=8), "6402", "motor.flaw.misfit"),
        (with_values(_6410_09=100), "6410:09", "motor.flaw.no_parameter"),
        (with_values(_6065=100), "6065", "motor.flaw.no_parameter"),
    ],
)
def test_what_does_not_fit_is_refused_and_named(draft: Draft, field: str, reason: str) -> None:
    with pytest.raises(MotorFieldError) as refused:
        checked(PMC, draft)
    assert (refused.value.details["field"], refused.value.details["reason_key"]) == (field, reason)


def test_a_limit_is_named_in_units_in_both_languages() -> None:
    with pytest.raises(MotorFieldError) as refused:
        checked(PMC, with_values(_6073=2001))
    assert error_text(load_texts("en"), refused.value) == "6073 max current: it must be from 0.0 to 200.0 %"
    assert "zwischen 0.0 und 200.0 %" in error_text(load_texts("de"), refused.value)
    with pytest.raises(MotorFieldError) as refused:
        checked(PMC, replace(DRAFT, maker=""))
    assert error_text(load_texts("de"), refused.value).startswith("Hersteller: ")


def test_texts_are_put_in_order_and_numbers_lose_what_a_float_adds() -> None:
    draft = replace(DRAFT, maker=" Lorentz \n GmbH ", plate=replace(PLATE, current_a=Decimal(str(11.3000000000001))))
    fine = checked(PMC, draft)
    assert fine.maker == "Lorentz GmbH"
    assert str(fine.plate.current_a) == "11.3"
    assert str(checked(PMC, DRAFT).plate.voltage_v) == "400"


def test_typed_values_are_read_in_their_units() -> None:
    voltage, kind = PMC.entry(parse_address("6410:03")), PMC.entry(parse_address("6402"))
    assert [parse_value(PMC, voltage, text) for text in ("400", "400,5 V", "raw:17")] == [4000, 4005, 17]
    assert parse_value(PMC, kind, "synchronous_servo") == 10
    for text in ("400 A", "much", "400.05"):
        with pytest.raises(MotorFieldError):
            parse_value(PMC, voltage, text)


def test_a_plate_that_says_another_number_than_its_parameter_is_noticed() -> None:
    assert disagreements(PMC, DRAFT) == []
    other = replace(DRAFT, plate=replace(PLATE, current_a=Decimal("11.2"), speed_rpm=Decimal(2900)))
    assert [(field.name, address.short) for field, address in disagreements(PMC, other)] == [
        ("speed_rpm", "6410:04"),
        ("current_a", "6076"),
    ]
    assert disagreements(PMC, replace(other, values={})) == []


# -- comparison --------------------------------------------------------------------


def test_two_motors_compare_row_by_row() -> None:
    other = {**VALUES, Address(0x6073): 1500, RHO: 99, Address(0x6080): 3000}
    del other[Address(0x6402)]
    rows = {row.address.short: (row.state, row.left, row.right) for row in compare_values(PMC, VALUES, other)}
    assert rows["6073"] == (RowState.DIFFERENT, 2000, 1500)
    assert rows["6410:03"] == (RowState.SAME, 4000, 4000)
    assert rows["6402"] == (RowState.MISSING, 7, None)
    assert rows["6080"] == (RowState.MISSING, None, 3000)
    assert rows["6410:02"] == (RowState.UNIT, 1234, 99)
    assert "60F6:01" not in rows


def test_plates_compare_field_by_field() -> None:
    rows = {row.field.name: row.state for row in compare_plates(PLATE, replace(PLATE, encoder="", power_kw=Decimal(6)))}
    assert rows["power_kw"] is RowState.DIFFERENT
    assert rows["encoder"] is RowState.MISSING
    assert rows["voltage_v"] is RowState.SAME
    assert "brake" not in rows


# -- CSV ---------------------------------------------------------------------------


def test_motors_come_back_from_a_file_as_they_were() -> None:
    draft = replace(checked(PMC, DRAFT), remarks='first\nsecond, with "quotes"; and =1+1', type="=PM")
    text = write_motors(PMC, [motor(draft), motor(checked(PMC, Draft("a", "b")), Source.EXAMPLE)])
    again = write_motors(PMC, [motor(draft)])
    assert "'=PM" in text
    rows = read_motors(PMC, again.encode(), "x.csv")
    assert [(row.id, row.draft, row.invented) for row in rows] == [(ID, draft, False)]
    with pytest.raises(MotorFileError):  # both have one id
        read_motors(PMC, text.encode(), "x.csv")


def test_what_a_german_spreadsheet_writes_is_read() -> None:
    head = "\ufeffmaker;type;power_kw [kW];6410:03 motor data: nominal voltage [V];6402"
    (row,) = read_motors(PMC, f"{head}\r\nLorentz;PM;5,5;400,5;asynchronous\r\n".encode(), "x.csv")
    assert row.id is None and row.line == 2
    assert row.draft.plate.power_kw == Decimal("5.5")
    assert row.draft.values == {Address(0x6402): 7, Address(0x6410, 3): 4005}


HEAD: Final = "id,maker,type,power_kw,6073,6402"


@pytest.mark.parametrize(
    ("text", "line", "column", "reason"),
    [
        ("", 1, "maker", "motor.file.no_column"),
        ("maker,power_kw\nA,1\n", 1, "type", "motor.file.no_column"),
        ("maker,type,torque\n", 1, "torque", "motor.file.unknown_column"),
        ("maker,type,6065\n", 1, "6065", "motor.file.unknown_column"),
        ("maker,type,6410:09\n", 1, "6410:09", "motor.file.unknown_column"),
        ("maker,type,type\n", 1, "type", "motor.file.column_twice"),
        ("maker,type,power_kw [W]\n", 1, "power_kw [W]", "motor.file.unit"),
        ("maker,type,6073 max current [A]\n", 1, "6073 max current [A]", "motor.file.unit"),
        (f"{HEAD}\n,A,B,1,100,\n,A,B,1,100\n", 3, "–", "motor.file.count"),
        (f"{HEAD}\n,A,B,5,100,\n,A\n", 3, "–", "motor.file.count"),
        (f"{HEAD}\n,A,B,5,100,\n{ID},A,C,5,100,\n", 3, "torque_nm", "motor.file.drops"),
        (f"{HEAD}\n,A,B,much,100,\n", 2, "power_kw", "motor.file.no_number"),
        (f"{HEAD}\n,A,B,5000,100,\n", 2, "power_kw", "motor.flaw.range"),
        (f"{HEAD}\n,A,B,5,300,\n", 2, "6073", "motor.flaw.range"),
        (f"{HEAD}\n,A,B,5,1e2,\n", 2, "6073", "motor.flaw.misfit"),
        (f"{HEAD}\n,A,B,5,100,petrol\n", 2, "6402", "motor.flaw.misfit"),
        (f"{HEAD}\n,A,B,5,100,9\n", 2, "6402", "motor.flaw.misfit"),
        (f"{HEAD}\n\n,A,,5,100,\n", 3, "type", "motor.flaw.missing"),
        (f"{HEAD}\n7,A,B,5,100,\n", 2, "id", "motor.file.id"),
        (f"{HEAD}\n0197a000-0000-4000-8000-0000000000aa,A,B,5,100,\n", 2, "id", "motor.file.id"),
        (f"{HEAD}\n{ID},A,B,5,100,\n{ID},A,C,5,100,\n", 3, "id", "motor.file.twice"),
        ("maker,type,source\nA,B,found\n", 2, "source", "motor.file.source"),
        ('maker,type,remarks\nA,B,"two\nlines"\nA,,x\n', 4, "type", "motor.flaw.missing"),
    ],
)
def test_a_damaged_file_names_line_column_and_reason(text: str, line: int, column: str, reason: str) -> None:
    with pytest.raises(MotorFileError) as wrong:
        read_motors(PMC, text.encode(), "bad.csv")
    found = wrong.value.details
    assert (found["file"], found["line"], found["column"], found["reason_key"]) == ("bad.csv", line, column, reason)
    for language in ("en", "de"):
        words = error_text(load_texts(language), wrong.value)
        assert "{" not in words and "motor.f" not in words and f" {line}," in words


def test_other_text_than_utf_8_is_named_with_its_line() -> None:
    with pytest.raises(MotorFileError) as wrong:
        read_motors(PMC, "maker,type\nA,B\nWürth,C\n".encode("cp1252"), "bad.csv")
    assert (wrong.value.details["line"], wrong.value.details["reason_key"]) == (3, "motor.file.encoding")


PRINTABLE: Final = st.characters(categories=("L", "M", "N", "P", "S"), include_characters=" ")
WORDS: Final = st.text(PRINTABLE, min_size=1, max_size=20).filter(lambda text: text.strip() != "")


@st.composite
def drafts(draw: st.DrawFn) -> Draft:
    values = {}
    for entry in entries_of(PMC):
        if draw(st.booleans()):
            high = 2000 if entry.address.short == "6073" else (entry.type.range or (0, 0))[1]
            choices = st.sampled_from((0, 7, 10, 13, 14, 15, 16)) if entry.enumeration else st.integers(0, high)
            values[entry.address] = draw(choices)
    plate: dict[str, object] = {}
    for one in PLATE_FIELDS:
        if draw(st.booleans()):
            numbers = st.decimals(one.minimum, one.maximum, allow_nan=False, places=one.decimals)
            plate[one.name] = draw(WORDS if one.is_text else numbers)
    remarks = draw(st.lists(WORDS, max_size=3).map("\r\n".join))
    return Draft(draw(WORDS), draw(WORDS), Plate(**plate), values, remarks)  # type: ignore[arg-type]


@settings(max_examples=60, deadline=None)
@given(drafts())
@example(Draft("'=1", "''x", Plate(), {}, "'@now"))
def test_every_motor_survives_store_and_file(draft: Draft) -> None:
    fine = checked(PMC, draft)
    assert load_draft(dump_draft(fine)) == fine
    (row,) = read_motors(PMC, write_motors(PMC, [motor(fine)]).encode(), "x.csv")
    assert row.draft == fine
