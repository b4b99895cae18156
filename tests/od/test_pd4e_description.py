"""The description of the PD4-E against the known parts of its manual: counts, printed rows, variants, categories."""

from __future__ import annotations

from itertools import combinations
from typing import Final

import pytest

from app.errors import UsageError
from app.model.address import Address, parse_address
from app.model.datatypes import DataType, Raw, encode_raw
from app.model.description import Access, Entry, Fact, Lookup, PdoSide, RestoreClass, Verify
from app.model.description_file import load_builtin
from app.model.restore.plan import Treatment, Why
from app.model.restore.rows import rows_of
from app.model.restore.wanted import PlanOptions, Wanted
from app.model.station import DeviceValues
from app.model.values import quantity_of
from app.model.variant import as_variant
from app.wire.stored import covers

PD4E = load_builtin("nanotec-pd4e")
VARIANTS = {variant: as_variant(PD4E, variant) for variant in PD4E.variants}
ADDED: Final = {0x6077}
"""Objects without a title on the known parts."""

RO, RW, RX, TX, NO, LOST = "ro", "rw", "rx", "tx", "no", "lost"

# address, type, access, process data, default, category of saving (no: not saved): every row of which the manual still
# prints type, access and mapping. What it does not print any more is lost, and not tested here.
ROWS: Final[list[tuple[str, str, str, str, int | str, str]]] = [
    ("1000", "UNSIGNED32", RO, NO, LOST, NO),
    ("1010:04", "UNSIGNED32", RW, NO, 1, LOST),
    ("1010:05", "UNSIGNED32", RW, NO, LOST, LOST),
    ("1010:0A", "UNSIGNED32", RW, NO, 1, LOST),
    ("1011:01", "UNSIGNED32", RW, NO, 1, LOST),
    ("1011:02", "UNSIGNED32", RW, NO, 1, LOST),
    ("1011:06", "UNSIGNED32", RW, NO, 1, LOST),
    ("1011:07", "UNSIGNED32", RW, NO, 1, LOST),
    ("1011:0C", "UNSIGNED32", RW, NO, 1, LOST),
    ("1018:02", "UNSIGNED32", RO, NO, LOST, LOST),
    ("1018:03", "UNSIGNED32", RO, NO, LOST, LOST),
    ("1F50:02", "DOMAIN", RW, NO, LOST, LOST),
    ("1F50:03", "DOMAIN", RW, NO, LOST, LOST),
    ("1F51:01", "UNSIGNED8", RW, NO, LOST, LOST),
    ("1F51:02", "UNSIGNED8", RW, NO, LOST, LOST),
    ("1F57:01", "UNSIGNED32", RO, NO, 0, LOST),
    ("200F", "VISIBLE_STRING", RO, NO, LOST, NO),
    ("2035", "UNSIGNED32", RW, NO, 10000, "application"),
    ("2037", "INTEGER32", RW, NO, -50, "application"),
    ("2038:01", "UNSIGNED32", RW, NO, 1000, LOST),
    ("2038:02", "UNSIGNED32", RW, NO, LOST, LOST),
    ("2038:06", "UNSIGNED32", RW, NO, 0, LOST),
    ("203A:02", "INTEGER32", RW, NO, 200, LOST),
    ("203B:01", "UNSIGNED32", RW, NO, LOST, LOST),
    ("203B:02", "UNSIGNED32", RW, NO, LOST, LOST),
    ("203B:05", "UNSIGNED32", RW, NO, 0, LOST),
    ("203B:06", "UNSIGNED32", RW, NO, LOST, LOST),
    ("2101", "UNSIGNED32", RO, NO, 0x20010, NO),
    ("2103:01", "UNSIGNED32", RO, NO, 0, LOST),
    ("2103:02", "UNSIGNED32", RO, NO, 0x20010, LOST),
    ("2292:02", "INTEGER32", RO, TX, 0, LOST),
    ("2301", "UNSIGNED32", RO, TX, 0, NO),
    ("2302", "UNSIGNED32", RO, TX, 0, NO),
    ("230F", "UNSIGNED32", RO, TX, LOST, NO),
    ("3203:01", "UNSIGNED8", RW, RX, LOST, LOST),
    ("3204:02", "UNSIGNED16", RO, TX, 0x33A0, LOST),
    ("3210:01", "UNSIGNED32", RW, RX, LOST, LOST),
    ("3210:03", "UNSIGNED32", RW, RX, LOST, LOST),
    ("3210:04", "UNSIGNED32", RW, RX, LOST, LOST),
    ("3210:07", "UNSIGNED32", RW, RX, LOST, LOST),
    ("3210:0B", "UNSIGNED32", RW, RX, 1000, LOST),
    ("3210:0C", "UNSIGNED32", RW, RX, 0, LOST),
    ("3212:03", "INTEGER8", RW, NO, LOST, LOST),
    ("3220:01", "INTEGER16", RO, TX, 0, LOST),
    ("3220:02", "INTEGER16", RO, TX, 0, LOST),
    ("3240:02", "UNSIGNED32", RW, RX, 0, LOST),
    ("3240:03", "UNSIGNED32", RW, RX, LOST, LOST),
    ("3240:07", "UNSIGNED32", RW, RX, 0, LOST),
    ("3240:08", "UNSIGNED32", RW, RX, 0, LOST),
    ("3241:01", "UNSIGNED32", RW, TX, 0, LOST),
    ("3241:02", "UNSIGNED32", RW, TX, 0, LOST),
    ("3243:03", "UNSIGNED32", RW, RX, 0, LOST),
    ("3243:04", "UNSIGNED32", RW, RX, LOST, LOST),
    ("3250:04", "UNSIGNED32", RW, RX, 0, LOST),
    ("3250:05", "UNSIGNED32", RW, RX, 0, LOST),
    ("3252:02", "UNSIGNED16", RW, TX, 0x90, LOST),
    ("3252:03", "UNSIGNED16", RW, TX, 0x91, LOST),
    ("33A0:02", "UNSIGNED16", RW, RX, 0, LOST),
    ("3502:02", "UNSIGNED32", RW, NO, 0x50008, LOST),
    ("3502:03", "UNSIGNED32", RW, NO, LOST, LOST),
    ("3502:07", "UNSIGNED32", RW, NO, 0x60420010, LOST),
    ("3502:08", "UNSIGNED32", RW, NO, 0x60FE0120, LOST),
    ("3502:0D", "UNSIGNED32", RW, NO, 0, LOST),
    ("3602:04", "UNSIGNED32", RW, NO, 0x60640020, LOST),
    ("3602:05", "UNSIGNED32", RW, NO, 0x60440010, LOST),
    ("3602:0A", "UNSIGNED32", RW, NO, 0, LOST),
    ("3602:0F", "UNSIGNED32", RW, NO, 0, LOST),
    ("3602:10", "UNSIGNED32", RW, NO, LOST, LOST),
    ("4014:03", "INTEGER32", RO, TX, 0, LOST),
    ("4014:04", "INTEGER32", RO, TX, LOST, LOST),
    ("4040", "VISIBLE_STRING", RO, NO, LOST, NO),
    ("603F", "UNSIGNED16", RO, TX, 0, NO),
    ("6046:01", "UNSIGNED32", RW, RX, 0, LOST),
    ("6046:02", "UNSIGNED32", RW, RX, 20000, LOST),
    ("6048:01", "UNSIGNED32", RW, RX, 500, LOST),
    ("6048:02", "UNSIGNED16", RW, RX, LOST, LOST),
    ("6049:01", "UNSIGNED32", RW, RX, 500, LOST),
    ("604A:01", "UNSIGNED32", RW, RX, LOST, LOST),
    ("605B", "INTEGER16", RW, NO, 1, "application"),
    ("605E", "INTEGER16", RW, NO, 2, "application"),
    ("6062", "INTEGER32", RO, TX, 0, NO),
    ("6066", "UNSIGNED16", RW, RX, 100, "application"),
    ("6073", "UNSIGNED16", RW, RX, LOST, "drive"),
    ("6074", "INTEGER16", RO, TX, 0, NO),
    ("607B:01", "INTEGER32", RW, RX, 0, LOST),
    ("607B:02", "INTEGER32", RW, RX, LOST, LOST),
    ("6083", "UNSIGNED32", RW, RX, LOST, "application"),
    ("6085", "UNSIGNED32", RW, RX, 5000, "application"),
    ("6087", "UNSIGNED32", RW, RX, 0, "application"),
    ("608F:01", "INTEGER32", RW, RX, 2000, LOST),
    ("6099:01", "UNSIGNED32", RW, RX, 50, LOST),
    ("609A", "UNSIGNED32", RW, RX, 500, "application"),
    ("60A2:01", "UNSIGNED32", RW, RX, 1, LOST),
    ("60A2:02", "UNSIGNED32", RW, RX, 1, LOST),
    ("60A4:01", "UNSIGNED32", RW, NO, 1000, LOST),
    ("60A9", "UNSIGNED32", RW, NO, 0xB44700, "application"),
    ("60B1", "INTEGER32", RW, RX, 0, "application"),
    ("60C4:02", "UNSIGNED32", RW, NO, 1, LOST),
    ("60C4:03", "UNSIGNED8", RW, NO, LOST, LOST),
    ("60C4:04", "UNSIGNED16", RW, NO, LOST, LOST),
    ("60F8", "INTEGER32", RW, RX, 400, "application"),
    ("60FE:01", "UNSIGNED32", RW, RX, 0, LOST),
    ("6502", "UNSIGNED32", RO, TX, LOST, NO),
    ("6505", "VISIBLE_STRING", RO, NO, LOST, NO),
]  # fmt: skip

APPLICATION: Final = """
    2035 2037 203A 2058 3212 3241 3242 3243 3250 3252 3321 4013 604A 604C 605B 605E 6066 6071 607D 6083 6085 6087 6091
    6092 6096 609A 60A4 60A8 60A9 60B0 60B1 60B2 60C1 60F2 60F8
""".split()
NOT_SAVED: Final = """
    1000 1008 200F 2101 2301 2302 230F 2320 3320 4012 4014 4016 4040 603F 6044 6062 6074 60E4 6502 6505
""".split()


def entry(address: str, variant: str | None = None) -> Entry:
    return (PD4E if variant is None else VARIANTS[variant]).entry(parse_address(address))


def object_of(index: str) -> list[Entry]:
    return [one for one in PD4E if one.address.major == int(index, 16)]


def device_with(values: dict[str, Raw]) -> Lookup:
    known = {parse_address(address): raw for address, raw in values.items()}
    return known.get


def mapped(index: int) -> list[int]:
    """The mapping entries in force by the defaults."""
    count = PD4E.entry(Address(index, 0)).default
    assert isinstance(count, int)
    values = [PD4E.entry(Address(index, sub)).default for sub in range(1, count + 1)]
    return [value for value in values if isinstance(value, int)]


def registers(index: int, first: int) -> dict[str, int]:
    """Register of each mapped object, by the bits before it; the dummies of 8 bits fill up a register."""
    found, bits = {}, 0
    for value in mapped(index):
        if value >> 16 >= 0x1000:
            found[Address(value >> 16, value >> 8 & 0xFF).short] = first + bits // 16
        bits += value & 0xFF
    return found | {"end": first + bits // 16}


def test_it_has_the_172_objects_of_the_manual_and_one_without_a_title() -> None:
    indices = {index for index, _ in PD4E.objects()}
    assert indices >= ADDED
    assert len(indices - ADDED) == 172


@pytest.mark.parametrize(("address", "data_type", "access", "side", "default", "category"), ROWS)
def test_rows_are_those_of_the_manual(
    address: str, data_type: str, access: str, side: str, default: int | str, category: str
) -> None:
    row = entry(address)
    assert row.type is DataType[data_type]
    assert row.access is Access(access)
    assert (row.pdo, row.pdo_side) == ((False, None) if side == NO else (True, PdoSide(side)))
    if default != LOST:
        assert row.default == default
        assert row.proves(Fact.DEFAULT)
    if category == NO:
        assert not row.saved
    elif category != LOST:
        assert row.saved
        assert row.save_category == category


def test_no_row_stands_twice() -> None:
    assert len({row[0] for row in ROWS}) == len(ROWS) > 100


@pytest.mark.parametrize(
    ("address", "defaults"),
    [
        ("1000", (0x00040192, 0x00040192, 0x00020192)),
        ("1018:02", (0x36, 0x3F, 0x48)),
        ("2030", (50, 50, 3)),
        ("2031", (2100, 2100, 6000)),
        ("203A:01", (1260, 1260, 5600)),
        ("203B:01", (2100, 2100, 3000)),
        ("3202", (0, 0, 0x40)),
        ("3210:01", (10000, 2048, 30000)),
        ("3210:03", (20000, 7000, 60000)),
        ("3210:07", (500000, 420000, 25000)),
        ("6073", (1000, 1000, 2000)),
    ],
)
def test_defaults_of_the_variants(address: str, defaults: tuple[int, int, int]) -> None:
    assert entry(address).default is None
    assert tuple(entry(address, variant).default for variant in PD4E.variants) == defaults


def test_variants_differ_in_nothing_else() -> None:
    differ = {
        row.address.major
        for one, other in combinations(VARIANTS.values(), 2)
        for row in PD4E
        if one.entry(row.address) != other.entry(row.address)
    }
    assert differ == {0x1000, 0x1008, 0x1018, 0x2030, 0x2031, 0x203A, 0x203B, 0x3202, 0x3210, 0x6073}
    assert {row.address.short for row in PD4E if row.variants} >= {"1018:02", "203A:01", "203B:01"}
    assert all(set(row.variants) == set(PD4E.variants) for row in PD4E if row.variants)


@pytest.mark.parametrize("variant", PD4E.variants)
def test_currents_of_a_variant_fit_each_other(variant: str) -> None:
    """The largest current is the rated one times the per mille of 6073h."""
    rated, mille, largest = (entry(address, variant).default for address in ("203B:01", "6073", "2031"))
    assert isinstance(rated, int) and isinstance(mille, int)
    assert rated * mille // 1000 == largest


@pytest.mark.parametrize("variant", PD4E.variants)
def test_a_device_tells_its_variant_by_product_code_or_name(variant: str) -> None:
    code, name = entry("1018:02", variant).default, entry("1008", variant).default
    assert code is not None and isinstance(name, str)
    matches = {each: detail.match for each, detail in PD4E.variant_details.items()}
    assert [each for each, match in matches.items() if match.product_code == code] == [variant]
    assert [each for each, match in matches.items() if match.device_name and match.device_name in name] == [variant]


def test_there_is_no_other_variant() -> None:
    with pytest.raises(UsageError):
        as_variant(PD4E, "pd4-e999")


@pytest.mark.parametrize("index", APPLICATION)
def test_saved_with_the_application(index: str) -> None:
    rows = object_of(index)
    assert any(row.saved for row in rows)
    assert {row.save_category for row in rows} == {"application"}


@pytest.mark.parametrize("index", NOT_SAVED)
def test_not_saved(index: str) -> None:
    assert not any(row.saved for row in object_of(index))


def test_saved_with_the_other_categories() -> None:
    for address, category in (
        ("2030", "tuning"),
        ("2031", "tuning"),
        ("6080", "tuning"),
        ("3202", "drive"),
        ("6073", "drive"),
        ("2013", "ethernet"),
    ):
        assert entry(address).save_category == category, address
        assert entry(address).proves(Fact.SAVED), address
    assert {row.address.major for row in PD4E if row.save_category == "drive"} == {0x3202, 0x6073}


def test_each_category_has_commands_that_save_and_restore_it() -> None:
    save = {command.category: command.address for command in PD4E.save}
    load = {command.category: command.address for command in PD4E.load}
    order = [None, "communication", "application", "customer", "drive", "tuning", "miscellaneous", "reserved1"]
    order += ["reserved2", "canopen", "modbus_rtu", "ethernet", "profibus"]
    assert load == {category: Address(0x1011, sub) for sub, category in enumerate(order, 1)}
    assert entry("1010:09").default == 0, "what cannot be saved has no command"
    assert save == {category: Address(0x1010, sub) for sub, category in enumerate(order, 1) if sub != 9}
    assert {row.save_category for row in PD4E if row.saved} <= save.keys()
    assert {command.signature.to_bytes(4, "little") for command in PD4E.save} == {b"save"}
    assert {command.signature.to_bytes(4, "little") for command in PD4E.load} == {b"load"}


def test_the_sub_index_of_a_category_is_not_proven() -> None:
    for command in (*PD4E.save, *PD4E.load):
        row = PD4E.entry(command.address)
        assert not row.proves(Fact.SUB), row.address.short
        assert row.verify is Verify.ACK
        assert row.restore is RestoreClass.NEVER
        assert row.timeout_s is not None and row.timeout_s >= 10


def test_date_and_time_are_saved_with_every_category() -> None:
    for command in PD4E.save:
        assert covers(PD4E, command.address, Address(0x1020, 1)), command.category
        assert covers(PD4E, command.address, Address(0x2030)) is (command.category in (None, "tuning"))


def test_receive_image_by_its_defaults() -> None:
    assert mapped(0x3502)[:2] == [0x60400010, 0x00050008]
    assert registers(0x3502, 6000) == {
        "6040": 6000,
        "6060": 6001,
        "3202": 6002,
        "607A": 6004,
        "6081": 6006,
        "6042": 6008,
        "60FE:01": 6009,
        "end": 6011,
    }


def test_transmit_image_by_its_defaults() -> None:
    """Page 115 prints its order and sizes: 14 bytes."""
    found = registers(0x3602, 5000)
    assert found == {"6041": 5000, "6061": 5001, "6064": 5002, "6044": 5004, "60FD": 5005, "end": 5007}
    assert list(found) == ["6041", "6061", "6064", "6044", "60FD", "end"]


@pytest.mark.parametrize(("index", "side"), [(0x3502, PdoSide.RX), (0x3602, PdoSide.TX)])
def test_what_is_mapped_fits_its_image(index: int, side: PdoSide) -> None:
    for value in mapped(index):
        target = Address(value >> 16, value >> 8 & 0xFF)
        if target.major < 0x1000:
            assert (DataType(target.major).bits, target.minor) == (value & 0xFF, 0), "a dummy is a data type"
            continue
        row = PD4E.entry(target)
        assert (row.type.bits, row.pdo_side) == (value & 0xFF, side), target.short
    for sub in range(1, 17):
        assert [one.address for one in PD4E.entry(Address(index, sub)).requires] == [Address(index, 0)]


def test_nothing_that_moves_restarts_or_saves_is_restored() -> None:
    for row in PD4E:
        if row.motion or row.address.major in (0x1010, 0x1011, 0x1020, 0x1F50, 0x1F51, 0x2800, 0x4015, 0x6060):
            assert row.restore is RestoreClass.NEVER, row.address.short
        if not row.access.writable or not row.saved:
            assert row.restore is RestoreClass.NEVER, row.address.short
    assert {row.address.short for row in PD4E if row.restore is RestoreClass.UNIT} == {"33A0:02", "607C"}
    moving = {row.address.major for row in PD4E if row.motion and row.address.minor == 0}
    assert moving >= {0x6040, 0x6042, 0x6071, 0x607A, 0x60FF, 0x2300}


def test_results_of_the_i2t_monitoring_are_never_written() -> None:
    assert [entry(f"203B:{sub:02X}").restore for sub in range(1, 7)] == [RestoreClass.COPY] * 2 + [
        RestoreClass.NEVER
    ] * 4


def test_a_restore_leaves_the_network_address_alone_and_says_so() -> None:
    network = {row.address.short for row in PD4E if row.restore is RestoreClass.NETWORK}
    assert network == {"2010", "2011", "2012", "2013", "2102"}
    device = DeviceValues("blade-1/pd4e", PD4E, {Address(0x2011): 0xC0A80202, Address(0x6083): 500})
    wanted = Wanted({Address(0x2011): 0xC0A80203, Address(0x6083): 600})
    rows = {row.place.address.short: row for row in rows_of(device, wanted, PlanOptions(expert=True))}
    assert (rows["2011"].treatment, rows["2011"].why) == (Treatment.SKIP, Why.NETWORK)
    assert rows["6083"].treatment is Treatment.WRITE


@pytest.mark.parametrize("variant", PD4E.variants)
def test_defaults_fit_type_limits_names_and_bits(variant: str) -> None:
    for row in VARIANTS[variant]:
        if row.default is None:
            continue
        encode_raw(row.type, row.default)
        if not isinstance(row.default, int) or row.default in row.also:
            continue
        assert not isinstance(row.minimum, int) or row.default >= row.minimum, row.address.short
        assert not isinstance(row.maximum, int) or row.default <= row.maximum, row.address.short
        if row.enumeration is not None:
            assert PD4E.enumerations[row.enumeration].by_value(row.default), row.address.short
        if row.bits is not None:
            named = sum(bit.mask for bit in PD4E.bit_tables[row.bits].bits)
            assert row.default & ~named == 0, row.address.short


def test_a_default_that_is_lost_is_not_zero() -> None:
    for address in ("1018:03", "2010", "2011", "203B:02", "3203:01", "3210:04", "3252:04", "4015:01", "6041", "607A"):
        assert entry(address).default is None, address


def test_what_is_not_printed_is_marked_and_its_source_exists() -> None:
    assert entry("2031").proves(Fact.DEFAULT)
    assert not entry("2031").proves(Fact.TYPE)
    assert not entry("6077").proves(Fact.TYPE)
    assert entry("605B").proves(Fact.DEFAULT)
    assert entry("3502:08").proves(Fact.DEFAULT)
    assert not entry("3502:04").proves(Fact.DEFAULT)
    origins = {row.origin for row in PD4E} | {code.origin for code in PD4E.errors.values()}
    assert origins - {None} <= PD4E.sources.keys()
    assert all(code.origin == "nanolib" for code in PD4E.errors.values() if code.code)


def test_modes_and_homing_methods() -> None:
    modes = PD4E.enumerations["pd4e_mode"]
    assert [value.value for value in modes.values] == [-2, -1, 0, 1, 2, 3, 4, 6, 7, 8, 9, 10]
    supported = entry("6502").default
    assert isinstance(supported, int)
    assert [bit + 1 for bit in range(16) if supported >> bit & 1] == [1, 2, 3, 4, 6, 7, 8, 9, 10]
    methods = {value.value for value in PD4E.enumerations["pd4e_homing_method"].values}
    assert methods >= {*range(1, 15), *range(17, 31), 33, 34, 35}
    assert not {15, 16, 31, 32} & methods


def test_option_codes_that_leave_the_motor_energised_are_named() -> None:
    assert {value.value for value in PD4E.enumerations["quick_stop_option"].values} == {0, 1, 2, 5, 6}
    assert entry("3701").default == -1, "a limit switch does not stop the motor as delivered"
    assert {value.value for value in PD4E.enumerations["deviation_option"].values} == {-1, 0, 1, 2}


def test_the_buses_of_this_device_are_ethernet_and_modbus_tcp() -> None:
    value = entry("2101").default
    assert isinstance(value, int)
    assert {bit.name for bit in PD4E.bit_tables["fieldbus_module"].bits if bit.mask & value} == {
        "ethernet",
        "modbus_tcp",
    }


@pytest.mark.parametrize(
    ("address", "unit_of", "value", "scale", "unit"),
    [
        ("60FF", "60A9", 0x00B44700, "1", "1/min"),
        ("6083", "60A9", 0x00B44700, "1", "1/min/s"),
        ("60A4:01", "60A9", 0x00B44700, "1", "1/min/s²"),
        ("60FF", "60A9", 0x00410300, "1", "°/s"),
        ("607A", "60A8", 0xFF410000, "0.1", "°"),
        ("607A", "60A8", 0xFD010000, "1", "mm"),
        ("607A", "60A8", 0x12345678, "1", ""),
    ],
)
def test_units_follow_the_units_of_the_user(address: str, unit_of: str, value: int, scale: str, unit: str) -> None:
    quantity = quantity_of(entry(address), device_with({unit_of: value}))
    assert (str(quantity.scale), quantity.unit) == (scale, unit)
