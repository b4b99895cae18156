"""The two OAT descriptions against the manual: counts, rows with traps checked by hand, tables of bits and errors."""

from __future__ import annotations

from decimal import Decimal
from itertools import pairwise
from typing import Final

import pytest

from app.model.address import Address, parse_address
from app.model.datatypes import DataType
from app.model.description import Access, Description, Entry, Kind, LimitRef, RestoreClass, Verify
from app.model.description_file import load_builtin

PMM: Final = "oat-pmm"
PMC: Final = "oat-pmc"

# CiA 301 objects that the chapters of the manual do not list; 1001h, 1003h and 2030h they do.
ADDED: Final = {0x1000, 0x1005, 0x1008, 0x1009, 0x100A, 0x1010, 0x1011, 0x1014, 0x1016, 0x1017, 0x1018, 0x1200}

RO, RW, FACTORY = "ro", "rw", "r(w)"
YES, NO = True, False

# device, address, type, access, PDO mapping, default, unit, scale, saved: read from the detail tables by hand.
ROWS: Final = [
    # chapter 3
    (PMM, "1001", "UNSIGNED8", RO, NO, 0, "", "1", NO),
    (PMM, "1003:08", "UNSIGNED32", RO, NO, None, "", "1", NO),
    (PMC, "603F", "UNSIGNED16", RO, YES, 0, "", "1", NO),
    (PMM, "5040", "UNSIGNED8", RW, YES, 0, "", "1", NO),
    (PMC, "5041", "UNSIGNED8", RO, YES, 0, "", "1", NO),  # one table has rw
    (PMM, "5042", "UNSIGNED8", RO, YES, 0, "", "1", NO),
    # 4.1: 3004h is printed as 3003h, 3040h as 2040h
    (PMM, "3003", "UNSIGNED8", RO, YES, None, "", "1", NO),
    (PMM, "3004", "UNSIGNED8", RO, YES, None, "", "1", NO),
    (PMM, "3005", "UNSIGNED8", RO, YES, None, "", "1", NO),  # Map J; no Mem column
    (PMM, "3040", "UNSIGNED16", RW, YES, None, "", "1", NO),
    # 4.2
    (PMM, "30B2", "UNSIGNED16", RO, YES, None, "ms", "1", NO),
    (PMM, "30B3", "UNSIGNED16", RO, YES, None, "s", "1", NO),
    (PMM, "30E0", "UNSIGNED16", RW, NO, 3000, "ms", "1", YES),
    (PMM, "30E1", "UNSIGNED16", RW, NO, 30, "s", "1", YES),  # Map Z
    (PMM, "30FA:00", "UNSIGNED8", RO, NO, 3, "", "1", YES),
    (PMM, "30FA:01", "UNSIGNED16", RW, NO, 560, "V", "1", YES),
    (PMM, "30FA:03", "UNSIGNED16", RW, NO, 400, "V", "1", YES),
    (PMM, "3066", "UNSIGNED16", RO, YES, None, "mV", "1", NO),  # index split over two cells
    (PMM, "30C0", "UNSIGNED16", RW, NO, 1000, "mA", "1", YES),  # no unit printed
    # 4.3
    (PMM, "3020:01", "UNSIGNED8", RW, NO, 0xA1, "", "1", YES),
    (PMM, "3020:04", "UNSIGNED16", RW, NO, 6, "", "1", YES),
    (PMM, "3020:05", "UNSIGNED16", RW, NO, 36000, "mV", "1", YES),  # does not fit a signed word
    (PMM, "3020:08", "UNSIGNED16", RW, NO, 150, "mΩ", "1", YES),
    (PMM, "301F:05", "INTEGER16", RO, YES, None, "°C", "0.1", NO),  # row lost in print
    (PMM, "3050", "UNSIGNED32", RW, YES, None, "mAh", "1", YES),
    (PMM, "3051", "INTEGER16", RO, YES, None, "mAh", "1", YES),
    (PMM, "3061:00", "UNSIGNED8", RO, NO, 8, "", "1", NO),
    (PMM, "3061:07", "UNSIGNED16", RO, YES, None, "mV", "1", NO),
    (PMM, "3067", "UNSIGNED16", RO, YES, None, "V", "1", NO),  # Map ">"
    (PMM, "3068", "UNSIGNED16", RO, YES, None, "V", "1", NO),
    (PMM, "3070", "INTEGER32", RO, YES, None, "mA", "1", NO),
    (PMM, "3080", "UNSIGNED8", RO, YES, None, "%", "1", NO),
    (PMM, "30B4", "UNSIGNED16", RO, YES, None, "mΩ", "1", NO),
    (PMM, "30E3", "UNSIGNED16", RW, NO, 0, "min", "1", YES),
    (PMM, "30F0:03", "UNSIGNED16", FACTORY, NO, 1500, "mA", "1", YES),
    (PMM, "30F1:03", "UNSIGNED16", FACTORY, NO, 500, "ms", "1", YES),
    (PMM, "30F1:04", "UNSIGNED16", RW, NO, 246, "V", "1", YES),
    (PMM, "30F1:06", "UNSIGNED16", RW, NO, 300, "mA", "1", YES),
    # 4.4, 4.5
    (PMM, "30FB:01", "UNSIGNED16", FACTORY, NO, 128, "", "1", YES),  # not the switch-on voltage of Table 19
    (PMM, "30FB:03", "UNSIGNED16", FACTORY, NO, 90, "A", "1", YES),
    (PMM, "30FB:07", "UNSIGNED16", RW, NO, 600, "V", "1", YES),
    (PMM, "30FB:08", "UNSIGNED16", RW, NO, 420, "V", "1", YES),
    (PMM, "30FB:09", "UNSIGNED16", RW, NO, 180, "µH", "1", YES),
    (PMM, "30FC:01", "UNSIGNED16", RW, NO, 670, "V", "1", YES),  # collapsed row
    (PMM, "30B1", "UNSIGNED8", RO, YES, None, "%", "1", NO),
    # 4.6
    (PMM, "3110:01", "INTEGER16", RW, NO, 500, "°C", "0.1", YES),
    (PMM, "3111:03", "INTEGER16", RW, NO, -200, "°C", "0.1", YES),
    (PMM, "3113:02", "INTEGER16", RW, NO, 500, "°C", "0.1", YES),
    (PMM, "3202:03", "INTEGER16", RW, NO, 50, "K", "0.1", YES),  # printed in degrees
    (PMM, "3203:04", "UNSIGNED16", RW, NO, 0x80, "", "1", YES),
    (PMM, "3203:06", "UNSIGNED16", RW, NO, 0x20, "", "1", YES),
    (PMM, "3204:01", "INTEGER16", RW, NO, 800, "°C", "0.1", YES),  # printed 0,08
    (PMM, "3008", "UNSIGNED8", RO, YES, None, "", "1", NO),  # collapsed row
    (PMM, "3011", "INTEGER16", RO, YES, None, "°C", "0.1", NO),
    (PMM, "3013", "INTEGER16", RO, YES, None, "°C", "0.1", NO),  # lost its type in the overview
    # 4.7 to 4.9
    (PMM, "30A0", "UNSIGNED16", RO, YES, None, "mV", "1", NO),
    (PMM, "30E2", "UNSIGNED16", RW, NO, 2000, "ms", "1", YES),
    (PMM, "30FE:01", "UNSIGNED32", RW, YES, 0, "", "1", NO),
    (PMM, "30FE:03", "UNSIGNED32", RO, YES, None, "", "1", NO),
    (PMM, "30FF:01", "UNSIGNED16", RW, YES, 0x0800, "", "1", YES),  # Map Y on a saved parameter
    (PMM, "3220:01", "INTEGER16", RW, NO, -8700, "°", "0.01", YES),
    (PMM, "3220:02", "INTEGER16", RW, NO, 8700, "°", "0.01", YES),
    (PMM, "3300:05", "UNSIGNED16", RW, NO, 0, "", "1", YES),  # row lost without a trace
    (PMM, "30DC:02", "UNSIGNED16", RW, NO, None, "V/s", "1", YES),
    # 5.1, 5.2
    (PMC, "6510:01", "UNSIGNED16", RO, NO, None, "", "1", YES),
    (PMC, "6510:03", "INTEGER16", RO, YES, None, "°C", "0.1", NO),  # live value in a saved record
    (PMC, "6510:04", "UNSIGNED16", RW, NO, 100, "V", "1", YES),  # Table 19 swaps 4 and 5
    (PMC, "6510:05", "UNSIGNED16", RW, NO, 750, "V", "1", YES),
    (PMC, "6510:06", "UNSIGNED16", RW, NO, 750, "°C", "0.1", YES),  # unsigned as printed
    (PMC, "6510:07", "UNSIGNED16", RW, NO, 0xFFFF, "", "1", YES),
    (PMC, "6510:08", "UNSIGNED16", RO, YES, None, "", "1", NO),
    (PMC, "6510:0A", "UNSIGNED16", RW, NO, 8, "kHz", "1", YES),
    (PMC, "6402", "UNSIGNED16", RW, NO, 0, "", "1", YES),
    (PMC, "6410:00", "UNSIGNED8", RO, NO, 12, "", "1", YES),  # 12 printed, 15 described
    (PMC, "6410:03", "UNSIGNED16", RW, NO, 4000, "V", "0.1", YES),
    (PMC, "6410:06", "UNSIGNED16", RW, NO, 500, "Hz", "0.1", YES),
    (PMC, "6410:09", "INTEGER16", RO, YES, None, "°C", "0.1", NO),
    (PMC, "6410:0D", "UNSIGNED16", RW, NO, 100, "%", "0.1", YES),
    (PMC, "6410:0F", "UNSIGNED16", RW, NO, None, "", "1", YES),
    (PMC, "6073", "UNSIGNED16", RW, NO, 2000, "%", "0.1", YES),
    (PMC, "6076", "UNSIGNED32", RW, NO, 17000, "mA", "1", YES),  # overview has 16 bits
    (PMC, "60F6:03", "UNSIGNED16", RW, NO, 5000, "ms", "1", YES),
    (PMC, "6077", "INTEGER16", RO, YES, None, "%", "0.1", NO),
    (PMC, "6078", "INTEGER16", RO, YES, None, "%", "0.1", NO),
    (PMC, "6079", "UNSIGNED32", RO, YES, None, "mV", "1", NO),
    (PMC, "5079", "UNSIGNED16", RO, YES, None, "V", "1", NO),
    # 5.3, 5.4
    (PMC, "6080", "UNSIGNED32", RW, NO, 3000, "1/min", "1", YES),  # overview has 16 bits
    (PMC, "60F9:06", "UNSIGNED16", RW, NO, 200, "Hz", "0.01", YES),  # Map empty
    (PMC, "6065", "UNSIGNED32", RW, NO, 100, "°", "0.01", YES),
    (PMC, "6066", "UNSIGNED16", RW, NO, 10, "ms", "1", YES),  # Map a Greek zeta
    (PMC, "6068", "UNSIGNED16", RW, NO, 10, "ms", "1", YES),  # index split over two cells
    (PMC, "606A", "INTEGER16", RW, NO, 0, "", "1", YES),
    (PMC, "60FB:02", "UNSIGNED16", RW, NO, 1000, "%", "0.1", YES),
    (PMC, "60FB:03", "UNSIGNED16", RW, NO, 1, "", "1", YES),
    # 5.5, 5.6
    (PMC, "607C", "INTEGER32", RW, NO, 0, "°", "0.01", YES),  # overview unsigned
    (PMC, "687C", "INTEGER32", RW, NO, 0, "°", "0.01", YES),
    (PMC, "608F:01", "UNSIGNED32", RW, NO, 512, "", "1", YES),
    (PMC, "6092:01", "UNSIGNED32", RW, NO, 36000, "", "1", YES),
    (PMC, "6864", "INTEGER32", RO, YES, None, "°", "0.01", NO),
    (PMC, "68F4", "INTEGER32", RO, YES, 0, "°", "0.01", NO),  # Map J
    (PMC, "6865", "UNSIGNED32", RW, NO, 0, "°", "0.01", YES),  # Mem J
    (PMC, "6866", "UNSIGNED16", RW, NO, 0, "ms", "1", YES),
    # 5.7 to 5.9
    (PMC, "6007", "INTEGER16", RW, NO, 1, "", "1", YES),
    (PMC, "605E", "INTEGER16", RW, YES, 2, "", "1", YES),  # Map Y on a saved parameter
    (PMC, "6040", "UNSIGNED16", RW, YES, None, "", "1", NO),
    (PMC, "6041", "UNSIGNED16", RW, YES, None, "", "1", NO),  # rw as printed
    (PMC, "6060", "INTEGER8", RW, YES, 0, "", "1", NO),
    (PMC, "6502", "UNSIGNED32", RO, NO, 0x1A5, "", "1", NO),
    # 5.10 to 5.14
    (PMC, "507A", "INTEGER16", RW, YES, 0, "°", "0.01", NO),
    (PMC, "607D:02", "INTEGER32", RW, NO, 36000, "°", "0.01", YES),
    (PMC, "607F", "UNSIGNED32", RW, NO, 20000, "°/s", "0.01", YES),
    (PMC, "6081", "UNSIGNED32", RW, YES, 0, "°/s", "0.01", NO),
    (PMC, "60C5", "UNSIGNED32", RW, YES, 2000, "°/s²", "0.01", YES),
    (PMC, "60C6", "UNSIGNED32", RW, YES, 0, "°/s²", "0.01", YES),
    (PMC, "5083", "UNSIGNED16", RW, YES, 0, "°/s²", "0.01", YES),  # the mirrors with Mem Y
    (PMC, "5084", "UNSIGNED16", RW, YES, 0, "°/s²", "0.01", YES),
    (PMC, "60FF", "INTEGER32", RW, YES, 0, "°/s", "0.01", NO),  # one overview unsigned
    (PMC, "50FF", "INTEGER16", RW, YES, 0, "°/s", "0.01", NO),
    (PMC, "60B1", "INTEGER32", RW, YES, 0, "°/s", "0.01", NO),  # Map ">"
    (PMC, "60C2:01", "UNSIGNED8", RW, NO, 1, "", "1", YES),
    (PMC, "60C2:02", "INTEGER8", RW, NO, -3, "", "1", YES),  # overview an array of UNSIGNED8
    (PMC, "6098", "INTEGER8", RW, NO, 35, "", "1", YES),
    # 5.15 to 5.17
    (PMC, "567A", "INTEGER32", RW, NO, 9000, "°", "0.01", YES),
    (PMC, "5684", "UNSIGNED32", RW, NO, None, "°/s²", "0.01", YES),
    (PMC, "60FD", "UNSIGNED32", RO, YES, 0, "", "1", NO),
    (PMC, "60FE:03", "UNSIGNED32", RO, NO, None, "", "1", NO),  # overview has type and object swapped
    (PMC, "60BA", "INTEGER32", RO, NO, None, "°", "0.01", NO),
    (PMC, "5664:01", "INTEGER32", RO, NO, None, "°", "0.01", NO),
    (PMC, "1400:01", "UNSIGNED32", RW, NO, 0x200, "", "1", NO),
    (PMC, "1603:00", "UNSIGNED8", RW, NO, 2, "", "1", NO),  # printed 5
    (PMC, "1A03:02", "UNSIGNED32", RW, NO, 0x606C0020, "", "1", NO),
]


@pytest.fixture(params=[PMM, PMC])
def description(request: pytest.FixtureRequest) -> Description:
    return load_builtin(request.param)


def entry(device: str, address: str) -> Entry:
    return load_builtin(device).entry(parse_address(address))


def manual_indices(device: str) -> set[int]:
    """The indices that chapters 3 to 5 list, without the objects added for CiA 301."""
    found = {one.address.major for one in load_builtin(device)}
    return {index for index in found if index not in ADDED and not 0x1400 <= index <= 0x1BFF}


def test_the_manual_lists_73_indices_for_the_pmm_and_85_for_the_pmc() -> None:
    assert len(manual_indices(PMM)) == 73
    assert len(manual_indices(PMC)) == 85
    assert manual_indices(PMM) & manual_indices(PMC) == {0x1001, 0x1003, 0x2030, 0x603F, 0x5040, 0x5041}
    assert 0x5042 in manual_indices(PMM)


def test_objects_of_the_communication_profile_are_there(description: Description) -> None:
    for index in ADDED | {0x1400, 0x1403, 0x1600, 0x1603, 0x1800, 0x1803, 0x1A00, 0x1A03}:
        assert description.has_index(index), hex(index)


@pytest.mark.parametrize(("device", "address", "type_", "access", "pdo", "default", "unit", "scale", "saved"), ROWS)
def test_row_is_as_the_manual_has_it(
    device: str,
    address: str,
    type_: str,
    access: str,
    pdo: bool,
    default: int | None,
    unit: str,
    scale: str,
    saved: bool,
) -> None:
    row = entry(device, address)
    assert row.type is DataType[type_]
    assert row.access is Access(access)
    assert row.pdo is pdo
    assert row.default == default
    assert row.quantity.unit == unit
    assert row.quantity.scale == Decimal(scale)
    assert row.saved is saved


def test_no_row_is_checked_twice() -> None:
    assert len({(row[0], row[1]) for row in ROWS}) == len(ROWS) >= 60


def test_arrays_have_all_their_elements() -> None:
    pmm = load_builtin(PMM)
    for index in (0x301F, 0x3061, 0x3300):
        assert [one.address.minor for one in pmm if one.address.major == index] == list(range(9))
    motor = [one.address.minor for one in load_builtin(PMC) if one.address.major == 0x6410]
    assert motor == list(range(16))


def test_sub_0_counts_the_elements_except_where_the_manual_prints_another_number(description: Description) -> None:
    for index, entries in description.objects():
        if entries[0].kind is Kind.VAR or index == 0x1003 or 0x1600 <= index < 0x1700 or 0x1A00 <= index < 0x1B00:
            continue
        count, last = entries[0].default, entries[-1].address.minor
        assert count == (12 if index == 0x6410 else last), hex(index)


def test_voltages_of_the_dc_link_are_chained_in_their_order() -> None:
    """Table 19: each voltage is limited by its neighbours, and the defaults keep the order."""
    order = ["30FA:03", "30FB:08", "30FA:01", "30FB:07", "30FC:02", "30FC:01", "30FA:02"]
    rows = [entry(PMM, address) for address in order]
    defaults = [row.default for row in rows]
    assert defaults == [400, 420, 560, 600, 650, 670, 750]
    for lower, upper in pairwise(rows):
        assert lower.maximum == LimitRef(upper.address)
        assert upper.minimum == LimitRef(lower.address)
    assert entry(PMC, "6510:04").maximum == LimitRef(Address(0x6510, 5))
    assert entry(PMC, "6510:05").minimum == LimitRef(Address(0x6510, 4))


def test_defaults_lie_within_limits_and_enumerations(description: Description) -> None:
    for row in description:
        if not isinstance(row.default, int) or row.default in row.also:
            continue
        for limit, sign in ((row.minimum, 1), (row.maximum, -1)):
            value = description.entry(limit.address).default if isinstance(limit, LimitRef) else limit
            if value is not None:
                assert isinstance(value, int | Decimal)
                assert sign * (row.default - value) >= 0, row.address.short
        if row.enumeration is not None:
            assert description.enumerations[row.enumeration].by_value(row.default), row.address.short


def test_default_masks_use_named_bits_only(description: Description) -> None:
    for row in description:
        # Bit 1 of the error mask belongs to no error.
        if row.bits is None or not isinstance(row.default, int) or row.name == "error mask":
            continue
        named = 0
        for bit in description.bit_tables[row.bits].bits:
            named |= bit.mask
        assert row.default & ~named == 0, row.address.short


@pytest.mark.parametrize(
    ("device", "table", "bits"),
    [
        (PMM, "pmm_status", range(8)),
        (PMM, "charger_status", [0, 1, 2, 3, 4, 7]),
        (PMM, "booster_status", range(6)),
        (PMM, "chopper_status", [0, 1, 4]),
        (PMM, "supply_status", [0, 1, 2, 4, 5, 6]),
        (PMM, "test_status", range(6)),
        (PMM, "pmm_controlword", [0, 1, 2, 7]),
        (PMM, "manual_control", [0, 1, 2, 3, 4, 5, 7]),
        (PMC, "manual_status", range(5)),
        (PMM, "battery_temperature_status", range(8)),
        (PMM, "heat_sink_temperature_status", [0, 4, 5, 6, 7]),
        (PMM, "pmm_digital_inputs", [0, 2, 3, 4, *range(8, 13), 16, 18, 19, 20, *range(27, 32)]),
        (PMM, "pmm_digital_outputs", [*range(12), 16, *range(24, 30)]),
        (PMM, "output_mask", range(12)),
        (PMM, "alarm_input_mask", [0, 2, 3, 4, *range(8, 13), 14, 15]),
        (PMC, "drive_errors", [0, *range(2, 16)]),
        (PMC, "control_flags", [0, 8, 9, 14, 15]),
        (PMC, "controlword", [0, 1, 2, 3, 4, 7, 8, 11, 14]),
        (PMC, "statusword", [*range(8), *range(9, 15)]),
        (PMC, "supported_modes", [0, 1, 2, 3, 5, 6, 7, 8, 9]),
        (PMC, "pmc_digital_inputs", [0, 1, 2, 3, *range(16, 21)]),
        (PMC, "pmc_digital_outputs", [0, 16, *range(24, 30)]),
    ],
)
def test_bit_table_names_the_bits_that_the_manual_uses(device: str, table: str, bits: list[int]) -> None:
    named = 0
    for bit in load_builtin(device).bit_tables[table].bits:
        named |= bit.mask
    assert [number for number in range(32) if named >> number & 1] == list(bits)


@pytest.mark.parametrize(
    ("table", "codes"),
    [
        ("battery_temperature_status", (0x4420, 0x4410, 0x4410)),
        ("heat_sink_temperature_status", (0x4220, 0x4210, 0x4210)),
        ("sensor1_temperature_status", (0x4120, 0x4110, 0x4110)),
        ("sensor2_temperature_status", (0x4121, 0x4111, 0x4111)),
    ],
)
def test_temperature_status_bits_carry_the_codes_of_their_sensor(table: str, codes: tuple[int, int, int]) -> None:
    by_bit = {bit.bit: bit.error_code for bit in load_builtin(PMM).bit_tables[table].bits}
    assert (by_bit[0], by_bit[4], by_bit[5]) == codes


def test_clamps_of_outputs_follow_table_35() -> None:
    """The example beside the table says 0006h for X14.3 and X14.4; the table says 000Ch."""
    clamps = {bit.clamp: bit.mask for bit in load_builtin(PMM).bit_tables["output_mask"].bits}
    assert clamps["X14.3"] | clamps["X14.4"] == 0x000C
    assert clamps["X13.3"] == 0x0400
    assert clamps["X16.3/X16.4"] == 0x0080


def test_every_code_of_a_bit_is_an_error_of_the_device(description: Description) -> None:
    for table in description.bit_tables.values():
        for bit in table.bits:
            assert bit.error_code is None or bit.error_code in description.errors, (table.id, bit.name)


def test_errors_have_the_reactions_of_table_48() -> None:
    errors = load_builtin(PMC).errors
    reactions = {code: error.reaction for code, error in errors.items() if error.reaction}
    assert reactions == {
        **dict.fromkeys((0x2310, 0x2320, 0x3210, 0x3220, 0x6010, 0x6080, 0x8400), "motor_off"),
        **dict.fromkeys((0x4210, 0x4310), "motor_off_after_30_s"),
        **dict.fromkeys((0x6320, 0x6380), "no_axis_command"),
        **dict.fromkeys((0x7305, 0x7320, 0x7321, 0x8611), "fault_reaction_option"),
    }


def test_error_codes_stand_for_the_devices_of_table_6() -> None:
    pmm, pmc = set(load_builtin(PMM).errors), set(load_builtin(PMC).errors)
    assert {0x3281, 0x3288, 0xFFF1, 0xFFF8, 0x3211, 0x3221} <= pmm - pmc
    assert {0x3210, 0x4310, 0x6080, 0x7300, 0x8620} <= pmc - pmm
    # 3220h is marked for the PMC only, but the threshold of the PMM raises it.
    assert 0x3220 in pmm & pmc


def test_mirrors_show_their_objects() -> None:
    mirrors = {row.address.major: row.mirror for row in load_builtin(PMC) if row.mirror is not None}
    assert mirrors.keys() == {
        0x5064, 0x506C, 0x5079, 0x507A, 0x5081, 0x5083, 0x5084, 0x50B0, 0x50B1, 0x50F4, 0x50FF, 0x5864, 0x58F4,
    }  # fmt: skip
    for index, mirror in mirrors.items():
        assert mirror.of == Address(index + 0x1000)
        assert mirror.divisor == (1000 if index == 0x5079 else 1)
        assert load_builtin(PMC).entry(Address(index)).restore is RestoreClass.NEVER


def test_home_offsets_are_of_this_machine_and_writable_in_homing_mode_only() -> None:
    for address in ("607C", "687C"):
        row = entry(PMC, address)
        assert row.restore is RestoreClass.UNIT
        assert [(need.address, need.values) for need in row.requires] == [(Address(0x6061), (6,))]


def test_restore_classes_follow_access_and_memory(description: Description) -> None:
    for row in description:
        if row.access is Access.FACTORY:
            assert row.restore is RestoreClass.FACTORY, row.address.short
        elif not row.saved or row.access is not Access.RW:
            assert row.restore is RestoreClass.NEVER, row.address.short
        elif row.mirror is None:
            assert row.restore in (RestoreClass.COPY, RestoreClass.UNIT), row.address.short
    of_this_machine = {row.address.short for row in description if row.restore is RestoreClass.UNIT}
    assert of_this_machine == ({"3050"} if description.id == PMM else {"607C", "687C", "6410:02"})


def test_commands_are_proven_by_their_effect_and_saving_by_its_acknowledge(description: Description) -> None:
    commands = {"5040", "3040"} if description.id == PMM else {"5040", "6040"}
    assert {row.address.short for row in description if row.verify is Verify.EFFECT} == commands
    for sub in (1, 2, 3):
        store = description.entry(Address(0x1010, sub))
        assert store.verify is Verify.ACK
        assert store.timeout_s is not None and store.timeout_s >= 10
    assert [(one.address, one.signature) for one in description.save] == [(Address(0x1010, 3), 0x65766173)]
    assert [(one.address, one.signature) for one in description.load] == [(Address(0x1011, 3), 0x64616F6C)]


def test_positions_take_their_unit_from_the_feed_constant_of_their_encoder() -> None:
    for row in load_builtin(PMC):
        if not row.quantity.unit.startswith("°") or row.quantity.unit == "°C":
            continue
        rule = row.quantity_rule
        assert rule is not None, row.address.short
        feed = 0x6892 if row.group == "blade_encoder" or row.address.major == 0x687C else 0x6092
        assert (rule.address, rule.shaft) == (Address(feed, 1), Address(feed, 2)), row.address.short


@pytest.mark.parametrize("device", [PMM, PMC])
def test_default_pdos_map_what_may_be_mapped_and_fit(device: str) -> None:
    description = load_builtin(device)
    for first, writable in ((0x1600, True), (0x1A00, False)):
        for number in range(4):
            parameters = description.entry(Address(first - 0x200 + number, 1))
            assert parameters.node_id
            assert isinstance(parameters.default, int)
            assert bool(parameters.default >> 31) is (number > 0)  # only the first PDO is active
            count = description.entry(Address(first + number, 0)).default
            assert isinstance(count, int)
            bits = 0
            for sub in range(1, count + 1):
                mapped = description.entry(Address(first + number, sub)).default
                assert isinstance(mapped, int)
                target = description.entry(Address(mapped >> 16, mapped >> 8 & 0xFF))
                assert target.pdo
                assert target.type.bits == mapped & 0xFF
                assert target.access.writable if writable else target.access.readable
                bits += mapped & 0xFF
            assert bits <= 64


def test_mode_of_operation_8f_is_negative_in_an_integer8() -> None:
    modes = load_builtin(PMC).enumerations["mode_of_operation"]
    assert {value.value for value in modes.values} == {-113, 0, 1, 3, 6, 8, 9}
    assert entry(PMC, "6060").enumeration == entry(PMC, "6061").enumeration == modes.id
