"""The description of the ED2 against its manual: printed rows by hand, what was read otherwise, general rules."""

from __future__ import annotations

from decimal import Decimal
from typing import Final

import pytest

from app.errors import LimitError, PreconditionError, ValueTypeError
from app.model.address import Address, Addressing, parse_address
from app.model.checks import Allow, check_write, limits_of
from app.model.datatypes import Raw
from app.model.description import Access, Entry, Fact, LimitRef, Lookup, PdoSide, RestoreClass
from app.model.description_file import load_builtin
from app.model.values import depends_on, quantity_of

ED2: Final = load_builtin("wandfluh-ed2")
NO: Final = None
U8, I8, U16, I16, U32, I32 = "UNSIGNED8", "INTEGER8", "UNSIGNED16", "INTEGER16", "UNSIGNED32", "INTEGER32"
E: Final = "E"
"""The unit that 1/84 chooses."""

# As printed, list (4.4) and descriptions (4.8): address, type, volatile or not, access, numbers as process data,
# lowest, highest, default, unit, name in the maker's tool.
ROWS: Final[list[tuple[str, str, str, str, str, int | None, int | str | None, int | None, str, str]]] = [
    ("0/36", U16, "V", "r", "105", NO, NO, NO, "", ""),
    ("0/37", U16, "V", "w", "1", NO, NO, NO, "", ""),
    ("0/38", U16, "V", "r", "2", NO, NO, NO, "", ""),
    ("0/39", I8, "N", "rw", "103, 104", NO, NO, NO, "", ""),
    ("0/40", I8, "N", "rw", "103, 104", NO, NO, NO, "", ""),
    ("0/41", I8, "N", "rw", "", NO, NO, NO, "", ""),
    ("0/51", I32, "V", "w", "", NO, NO, NO, "", ""),
    ("0/53", I8, "N", "rw", "", NO, NO, NO, "", ""),
    ("1/20", U8, "N", "rw", "", NO, NO, NO, "", "Benutzer Eingang Istwert"),
    ("1/22", I8, "N", "r", "", NO, NO, NO, "", ""),
    ("1/84", U8, "N", "rw", "", NO, NO, NO, "", "Anzeige der Weggrösse"),
    ("1/97", U8, "V", "rw", "", NO, NO, NO, "", "Signaltyp Istwert"),
    ("1/98", I32, "N", "rw", "", -99999900, 99999900, 0, "1/100 E", "Offset Messsystem"),
    ("1/99", U32, "N", "rw", "", 1000, 10000000, 10000000, "1/1000000 E", "Auflösung Istwert"),
    ("1/100", I32, "N", "rw", "", -400000, 400000, 0, "1/10 E", "Neg. Wegbegrenzung"),
    ("1/101", I32, "N", "rw", "", -400000, 400000, 0, "1/10 E", "Pos. Wegbegrenzung"),
    ("1/102", U32, "N", "rw", "", -100000, 100000, 0, "1/10 E", "Referenz Suchgeschw."),
    ("1/103", U32, "N", "rw", "", -100000, 100000, 0, "1/10 E", "Referenz Schaltergeschw."),
    ("1/104", I8, "N", "rw", "", NO, NO, NO, "", "Referenzierungsart"),
    ("1/105", I8, "N", "rw", "", NO, NO, NO, "", "Referenzfahrt-Kontrolle"),
    ("1/106", I8, "N", "rw", "", NO, NO, NO, "", "Wegbegrenzung"),
    ("3/73", U16, "N", "rw", "", 0, 950, 150, "mA", "Imin A"),
    ("3/76", U16, "N", "rw", "", 0, 950, 150, "mA", "Imin B"),
    ("3/94", I32, "N", "rw", "", -200, 200, 0, "1/10 %", "Offset"),
    ("3/98", U8, "N", "rw", "", 20, 500, 100, "Hz", "Dither Frequenz"),
    ("3/101", U8, "N", "rw", "", 0, 200, 100, "mA", "Dither Pegel"),
    ("3/129", U16, "N", "rw", "", 0, 1800, 700, "mA", "Imax A"),
    ("3/130", U16, "N", "rw", "", 0, 1800, 700, "mA", "Imax B"),
    ("3/131", I8, "N", "rw", "", NO, NO, NO, "", "Systemregelsinn"),
    ("3/132", I32, "N", "rw", "", 50, 100, 100, "%", "Bereich"),
    ("3/133", I8, "N", "rw", "", NO, NO, NO, "", "Ventiltyp"),
    ("12/21", I32, "V", "rw", "", 0, 999999000, 0, "1/1000 E", ""),
    ("12/42", I8, "N", "r", "", NO, NO, NO, "", ""),
    ("12/61", U32, "N", "rw", "100", 0, 100000, 100, "1/10 E/s²", "Max. Geschwindigkeit"),
    ("12/64", U32, "N", "rw", "101", 0, 100000, 100, "1/10 E/s²", "Max. Beschleunigung"),
    ("12/100", I32, "V", "r", "", 0, 999999000, 0, "1/1000 E", ""),
    ("12/103", I32, "V", "r", "", 0, 999999000, 0, "1/1000 E", ""),
    ("12/116", U32, "N", "rw", "", 1, 50000, 1000, "1/100 s", "Nachstellzeit Pos."),
    ("12/119", U32, "N", "rw", "", 0, 100000, 0, "1/100 %", "I-Begrenzung Pos."),
    ("12/162", I32, "N", "rw", "", 0, 99999900, 5000, "1/100 E", "Schleppfehlergrenzwert fein"),
    ("12/163", I32, "N", "rw", "", 0, 99999900, 5000, "1/100 E", "Schleppfehlergrenzwert grob"),
    ("12/164", U16, "N", "rw", "", 0, 3000, 0, "1/100 s", "Fehlerauslösung nach"),
    ("12/178", I16, "N", "rw", "", 0, 10000, 10, "1/100 E", "Positionsfenster"),
    ("12/207", U32, "N", "rw", "", 0, 50000, 10000, "1/100 %", "Proportionalbeiwert Pos."),
    ("12/208", U32, "N", "rw", "", 0, 50000, 10000, "1/100 %", "Proportionalbeiwert Neg."),
    ("12/209", U32, "N", "rw", "", 0, 10000, 10000, "1/100 %", "P-Anteil Pos."),
    ("12/210", U32, "N", "rw", "", 0, 10000, 10000, "1/100 %", "P-Anteil Neg."),
    ("12/211", U32, "N", "rw", "", NO, NO, NO, "", "I-Begrenzung Neg."),
    ("12/212", U32, "N", "rw", "", 1, 50000, 1000, "1/100 s", "Nachstellzeit Neg."),
    ("12/213", I16, "N", "rw", "", 0, 10000, 10, "1/100 E", "Positionsfenster Hysterese"),
    ("12/216", U32, "N", "rw", "", 0, "12/61", 200, "1/10 E/s", "Eilganggeschw"),
    ("12/217", U32, "N", "rw", "", 0, "12/61", 50, "1/10 E/s", "Schleichgeschw"),
    ("12/218", U32, "N", "rw", "", 0, 100000, 100, "1/10 E/s²", "Beschleunigung"),
    ("12/219", I8, "N", "rw", "", NO, NO, NO, "", "Reglertyp"),
    ("12/220", U8, "N", "rw", "", NO, NO, NO, "", "Signaltyp Sollwert"),
    ("12/221", U8, "N", "rw", "", NO, NO, NO, "", "Benutzer Eingang Sollwert"),
    ("12/223", I32, "N", "rw", "", 100000, 1000000000, 10000000, "1/1000000 E", "Auflösung Sollwert"),
    ("12/224", U16, "N", "rw", "", NO, NO, NO, "", "Digitale Eingänge"),
    ("12/225", U16, "N", "rw", "", NO, NO, NO, "", "Digitale Ausgänge"),
]  # fmt: skip

# What the manual prints in another place, or cannot mean: address, field, value.
READ_OTHERWISE: Final[dict[tuple[str, str], object]] = {
    ("1/102", "type"): I32,
    ("1/103", "type"): I32,
    ("3/98", "max"): 250,
    ("12/21", "signals"): "12",
    ("12/61", "unit"): "1/10 E/s",
    ("12/100", "signals"): "3",
    ("12/100", "min"): None,
    ("12/103", "min"): None,
    ("12/211", "min"): 0,
    ("12/211", "max"): 100000,
    ("12/211", "default"): 0,
    ("12/211", "unit"): "1/100 %",
    ("1/102", "unit"): "1/10 E/s",
    ("1/103", "unit"): "1/10 E/s",
    ("1/99", "max"): 1000000000,
    ("12/224", "min"): 0x0100,
    ("12/224", "max"): 0x1202,
    ("12/225", "min"): 0x0100,
    ("12/225", "max"): 0x0602,
}


def entry(address: str) -> Entry:
    return ED2.entry(parse_address(address))


def device_with(values: dict[str, Raw]) -> Lookup:
    known = {parse_address(address): raw for address, raw in values.items()}
    return known.get


def write(address: str, raw: Raw, **values: Raw) -> bytes:
    """A checked write beside known values, named ``i12_61`` for 12/61."""
    known = {name[1:].replace("_", "/"): value for name, value in values.items()}
    return check_write(ED2, entry(address), raw, device_with(known), allow=Allow.MOTION)


def unit_of(row: Entry) -> str:
    """As the manual prints it, with E for the unit that 1/84 chooses."""
    quantity = quantity_of(row, device_with({"1/84": 1}))
    unit = quantity.unit.replace("mm", E) if row.quantity_rule is not None else quantity.unit
    return unit if quantity.scale == 1 else f"1/{1 / quantity.scale:f} {unit}"


@pytest.mark.parametrize("row", ROWS, ids=[row[0] for row in ROWS])
def test_rows_are_those_of_the_manual(
    row: tuple[str, str, str, str, str, int | None, int | str | None, int | None, str, str],
) -> None:
    address, *printed = row
    names = ("type", "saved", "access", "signals", "min", "max", "default", "unit", "tool")
    wanted = {name: READ_OTHERWISE.get((address, name), value) for name, value in zip(names, printed, strict=True)}
    one = entry(address)
    high = one.maximum.address.short if isinstance(one.maximum, LimitRef) else one.maximum
    assert {
        "type": one.type.name,
        "saved": "N" if one.saved else "V",
        "access": {"ro": "r", "wo": "w"}.get(one.access.value, one.access.value),
        "signals": ", ".join(map(str, one.signals)),
        "min": one.minimum,
        "max": high,
        "default": one.default,
        "unit": unit_of(one),
        "tool": one.tool_name or "",
    } == wanted


def test_there_are_the_59_parameters_of_the_list() -> None:
    assert [str(one.address) for one in ED2] == [row[0] for row in ROWS]
    assert len(ROWS) == 59
    assert len({one.name for one in ED2}) == 59
    assert {one.address.addressing for one in ED2} == {Addressing.PKW}


def test_sections_count_on_as_the_parameters_do() -> None:
    assert [one.section for one in ED2] == [f"4.8.{number}" for number in range(1, 60)]


def test_blocks() -> None:
    blocks = {0: "device_block", 1: "transducer_block", 3: "valve_block", 12: "position_block"}
    assert all(one.group == blocks[one.address.major] for one in ED2)
    assert [sum(one.address.major == ind for one in ED2) for ind in blocks] == [8, 13, 10, 28]


def test_defaults_lie_within_limits_for_every_unit_and_transducer() -> None:
    """But the one that the manual itself prints above the default of its limit."""
    defaults = {str(one.address): one.default for one in ED2 if one.default is not None}
    outside = set()
    for transducer in (64, 65, 66, 67):
        lookup = device_with(defaults | {"1/22": transducer})
        for one in ED2:
            low, high = limits_of(one, lookup)
            if isinstance(one.default, int) and not (low or 0) <= one.default <= (high or 0):
                outside.add(str(one.address))
    assert outside == {"12/216"}


def test_no_default_is_printed_for_an_enumeration() -> None:
    assert [one.name for one in ED2 if one.enumeration is not None and one.default is not None] == []


def test_every_restore_class_follows_from_what_the_parameter_is() -> None:
    for one in ED2:
        if not one.access.writable or not one.saved:
            assert one.restore is RestoreClass.NEVER, one.name
    unit = {str(one.address) for one in ED2 if one.restore is RestoreClass.UNIT}
    assert unit == {"1/98", "3/94"}, "offsets belong to one transducer and one valve"
    never = {str(one.address) for one in ED2 if one.saved and one.access.writable and one.restore is RestoreClass.NEVER}
    assert never == {"12/224", "12/225"}, "forced inputs and outputs"


def test_what_can_move_an_axis_needs_leave() -> None:
    assert {str(one.address) for one in ED2 if one.motion} == {"0/37", "1/105", "12/21", "12/224", "12/225"}


def test_process_data_go_where_the_telegrams_have_them() -> None:
    sides = {str(one.address): one.pdo_side for one in ED2 if one.pdo}
    received, sent = PdoSide.RX, PdoSide.TX
    assert sides == {
        "0/36": sent, "0/37": received, "0/38": sent, "0/39": None, "0/40": None,
        "12/21": received, "12/61": received, "12/64": received, "12/100": sent,
    }  # fmt: skip
    assert all(bool(one.signals) == one.pdo for one in ED2)


def test_what_was_not_printed_is_marked() -> None:
    marked = {str(one.address): one.unproven for one in ED2 if one.inferred}
    assert marked == {
        "1/102": {Fact.TYPE}, "1/103": {Fact.TYPE}, "12/211": {Fact.DEFAULT}, "12/212": {Fact.DEFAULT},
    }  # fmt: skip


# -- preconditions, steps, tables that depend on other parameters -----------------------


def test_local_control_ignores_every_write_but_its_own() -> None:
    for one in ED2:
        if one.access.writable and str(one.address) != "0/41":
            assert Address(0, 41, Addressing.PKW) in {need.address for need in one.requires}, one.name
    with pytest.raises(PreconditionError):
        write("12/61", 100, i0_41=1)
    assert write("0/41", 0, i0_41=1) == b"\0"


@pytest.mark.parametrize(
    ("address", "raw", "of", "allowed", "refused"),
    [
        ("0/39", 1, "0/40", (9, -1, -2), (6,)),
        ("0/39", 2, "0/40", (9,), (6, -1, -2)),
        ("0/53", 1, "0/39", (1,), (2,)),
        ("0/53", 0, "0/39", (1, 2), ()),
        ("1/100", 5, "1/106", (1,), (0,)),
        ("1/101", 5, "1/106", (1,), (0,)),
        ("1/102", -5, "1/22", (64,), (65, 66, 67)),
        ("1/103", 5, "1/22", (64,), (65, 66, 67)),
        ("1/104", 5, "1/22", (64,), (65, 66, 67)),
        ("1/105", 1, "1/22", (64,), (65, 66, 67)),
        ("3/73", 200, "3/133", (0,), (1,)),
        ("3/76", 200, "3/133", (0,), (1,)),
        ("3/94", 5, "3/133", (1,), (0,)),
        ("3/98", 50, "3/133", (0,), (1,)),
        ("3/101", 50, "3/133", (0,), (1,)),
        ("3/129", 500, "3/133", (0,), (1,)),
        ("3/130", 500, "3/133", (0,), (1,)),
        ("3/132", 60, "3/133", (1,), (0,)),
    ],
)
def test_preconditions(address: str, raw: int, of: str, allowed: tuple[int, ...], refused: tuple[int, ...]) -> None:
    one = entry(address)
    for value in allowed:
        check_write(ED2, one, raw, device_with({of: value}), allow=Allow.MOTION)
    for value in refused:
        with pytest.raises(PreconditionError):
            check_write(ED2, one, raw, device_with({of: value}), allow=Allow.MOTION)


@pytest.mark.parametrize("address", ["3/73", "3/76", "3/129", "3/130"])
def test_currents_go_in_steps_of_two(address: str) -> None:
    assert write(address, 152) == b"\x98\0"
    with pytest.raises(ValueTypeError):
        write(address, 151)


def test_a_dither_frequency_divides_a_thousand_and_fits_a_byte() -> None:
    taken = []
    for hz in range(20, 251):
        try:
            write("3/98", hz)
        except ValueTypeError:
            continue
        taken.append(hz)
    assert taken == [hz for hz in range(20, 251) if 1000 % hz == 0]
    with pytest.raises(LimitError):
        write("3/98", 500)


@pytest.mark.parametrize(
    ("transducer", "low", "high"), [(64, 1000, 10**7), (65, 1000, 10**7), (66, 1000, 10**7), (67, 10**5, 10**9)]
)
def test_the_resolution_is_limited_by_the_kind_of_transducer(transducer: int, low: int, high: int) -> None:
    assert limits_of(entry("1/99"), device_with({"1/22": transducer})) == (Decimal(low), Decimal(high))
    assert limits_of(entry("1/99"), device_with({})) == (Decimal(1000), Decimal(10**9))
    assert parse_address("1/22") in set(depends_on(entry("1/99")))


@pytest.mark.parametrize(
    ("address", "transducer", "values"),
    [
        ("1/20", 64, {8, 9}),
        ("1/20", 66, {8, 9}),
        ("1/20", 67, {0, 1, 2, 3}),
        ("1/20", None, {0, 1, 2, 3, 8, 9}),
        ("1/97", 64, {0}),
        ("1/97", 65, {0, 1, 2}),
        ("1/97", 67, {0, 1, 2, 3, 4, 5}),
        ("1/97", None, {0, 1, 2, 3, 4, 5}),
    ],
)
def test_names_of_values_that_depend_on_the_transducer(address: str, transducer: int | None, values: set[int]) -> None:
    lookup = device_with({} if transducer is None else {"1/22": transducer})
    table = ED2.enumeration_of(entry(address), lookup)
    assert table is not None
    assert {value.value for value in table.values} == values
    for raw in range(10):
        if raw not in values:
            with pytest.raises(ValueTypeError):
                check_write(ED2, entry(address), raw, lookup)


# -- bits and codes ----------------------------------------------------------------------

CONTROL: Final = {6: {13: "start"}, 9: {13: "start"}, -1: {10: "force_setpoint", 13: "new_setpoint"},
                  -2: {9: "positive", 10: "negative", 13: "rapid"}}  # fmt: skip
STATUS: Final = {6: {10: "limit_touched"}, 9: {10: "limit_touched", 11: "control_error"},
                 -1: {11: "control_error", 13: "setpoint_acknowledge"}, -2: {11: "control_error"}}  # fmt: skip
COMMON_CONTROL: Final = {
    0: "disable", 1: "hold_enable", 2: "device_mode_active", 3: "reset_fault", 6: "parameter_set", 14: "stop",
}  # fmt: skip
COMMON_STATUS: Final = {
    0: "disabled", 1: "hold", 2: "active", 3: "ready", 4: "local_control", 5: "warning", 12: "target_reached",
}  # fmt: skip


@pytest.mark.parametrize("mode", [6, 9, -1, -2, None])
@pytest.mark.parametrize(
    ("address", "common", "own"), [("0/37", COMMON_CONTROL, CONTROL), ("0/38", COMMON_STATUS, STATUS)]
)
def test_bits_of_each_control_mode(
    address: str, common: dict[int, str], own: dict[int, dict[int, str]], mode: int | None
) -> None:
    table = ED2.bits_of(entry(address), device_with({} if mode is None else {"0/40": mode}))
    assert table is not None
    named = {bit.bit: bit.name for bit in table.bits if not bit.name.startswith("mode_")}
    assert named == common | ({} if mode is None else own[mode])


def test_error_codes_and_reactions() -> None:
    codes = """5100 5520 5510 5211 5212 5213 5214 5231 5232 5233 5235 5236 5237 5411 5412 5413 5414 5301 5302 8230 8231
    0000 1000""".split()
    assert set(ED2.errors) == {int(code, 16) for code in codes}
    held = {code for code, error in ED2.errors.items() if error.reaction == "ed2_fault_hold"}
    assert held == {0x5100, 0x8230, 0x8231}
    assert all(error.reaction for code, error in ED2.errors.items() if code)
    second = {0x5213, 0x5214, 0x5235, 0x5236, 0x5237, 0x5413, 0x5414, 0x5302, 0x8231}
    assert {code for code, error in ED2.errors.items() if error.number == 2} == second


def test_no_reference_leads_to_a_parameter_that_cannot_be_read() -> None:
    for one in ED2:
        for address in depends_on(one):
            assert ED2.entry(address).access is not Access.WO, one.name
