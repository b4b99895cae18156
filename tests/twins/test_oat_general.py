"""What both units have in common, over the wire: the object dictionary and its rules, errors and their messages."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from app.model.description import Access, Entry, Kind
from tests.twins.harness import MS, SECOND, AbortedError
from tests.twins.oat_rig import DISABLE_VOLTAGE, FAULT_RESET, PMC, PMM, BladeRig

NO_OBJECT, NO_SUB_INDEX, READ_ONLY, NOT_MAPPABLE = 0x06020000, 0x06090011, 0x06010002, 0x06040041
RESET, BY_OBJECT = 0x80, 0x80
FAULT, WARNING = 1 << 3, 1 << 7
X14_11 = 1 << 9
SAVE = b"save"
COUNTS = frozenset((0x1003, *range(0x1600, 0x1604), *range(0x1A00, 0x1A04)))
"""Sub-index 0 of these tells how many are in use (CiA 301)."""
FACTORY = {f"30F0:{sub:02X}" for sub in range(1, 7)} | {f"30F1:{sub:02X}" for sub in range(1, 4)}
FACTORY |= {f"30FB:{sub:02X}" for sub in range(1, 7)}
MIRRORS = (
    ("5064", "6064"), ("506C", "606C"), ("507A", "607A"), ("5081", "6081"), ("5083", "6083"), ("5084", "6084"),
    ("50B0", "60B0"), ("50B1", "60B1"), ("50F4", "60F4"), ("50FF", "60FF"), ("5864", "6864"), ("58F4", "68F4"),
)  # fmt: skip
READ_ONLY_MIRRORS = ("5064", "506C", "50F4", "5864", "58F4", "5079")
ACTING = frozenset((0x3040, 0x5040, 0x6040, 0x6041, 0x6060))
"""Not parameters: a write starts something."""


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def entries(rig: BladeRig, node: int) -> list[Entry]:
    device = rig.pmm.device if node == PMM else rig.pmc.device
    return list(device.description)


def where(entry: Entry) -> str:
    return str(entry.address)


def no_read(rig: BladeRig, node: int, place: str) -> int:
    """The abort code of a read that must be refused."""
    return rig.master.refused(lambda: rig.master.read(node, place))


def no_write(rig: BladeRig, node: int, place: str, data: bytes) -> int:
    """The abort code of a write that must be refused."""
    return rig.master.refused(lambda: rig.master.write(node, place, data))


def settle(rig: BladeRig) -> None:
    rig.master.run(250 * MS)


def reload(rig: BladeRig, node: int) -> None:
    rig.restart(node)
    settle(rig)


# -- A: the object dictionary ----------------------------------------------------------------


@pytest.mark.rule("A1")
@pytest.mark.parametrize("node", [PMM, PMC])
def test_sub_index_0_counts_the_elements_and_a_variable_has_no_other(rig: BladeRig, node: int) -> None:
    subs: dict[int, list[int]] = {}
    kinds: dict[int, Kind] = {}
    for entry in entries(rig, node):
        subs.setdefault(entry.address.major, []).append(entry.address.minor)
        kinds[entry.address.major] = entry.kind
    assert {Kind.VAR, Kind.ARRAY, Kind.RECORD} <= set(kinds.values())
    for index, found in subs.items():
        if kinds[index] is Kind.VAR:
            assert found == [0]
            assert no_read(rig, node, f"{index:04X}:01") == NO_SUB_INDEX
            continue
        assert found[:2] == [0, 1], f"{index:04X}"
        if index not in COUNTS:
            assert rig.get(f"{index:04X}:00", node) == max(found), f"{index:04X}"
        assert no_read(rig, node, f"{index:04X}:{max(found) + 1:02X}") == NO_SUB_INDEX


@pytest.mark.rule("A2")
@pytest.mark.parametrize("node", [PMM, PMC])
def test_what_is_read_only_is_not_written(rig: BladeRig, node: int) -> None:
    kinds = set()
    for entry in entries(rig, node):
        kinds.add(entry.access)
        if entry.access in (Access.RO, Access.CONST) and entry.type.size is not None:
            assert no_write(rig, node, where(entry), bytes(entry.type.size)) == READ_ONLY, where(entry)
    assert Access.RO in kinds


@pytest.mark.rule("A2")
def test_what_the_maker_has_preset_is_written_by_the_maker_only(rig: BladeRig) -> None:
    found = {where(entry) for entry in entries(rig, PMM) if entry.access is Access.FACTORY}
    assert found == FACTORY
    factory = BladeRig(factory=True)
    for place in sorted(found):
        assert rig.refused(place, 5, PMM) == READ_ONLY
        factory.put(place, 5, PMM)
        assert factory.get(place, PMM) == 5
    rig.put("30F1:04", 245, PMM)
    rig.put("30FB:07", 610, PMM)


@pytest.mark.rule("A3")
@pytest.mark.parametrize("node", [PMM, PMC])
def test_only_what_has_map_y_is_mapped(rig: BladeRig, node: int) -> None:
    rig.put("1A03:00", 0, node)
    found = {True: 0, False: 0}
    for entry in entries(rig, node):
        bits = entry.type.bits
        if bits is None or not entry.access.readable or entry.address.major < 0x2000:
            continue
        raw = entry.address.major << 16 | entry.address.minor << 8 | bits
        found[entry.pdo] += 1
        if entry.pdo:
            rig.put("1A03:01", raw, node)
        else:
            assert rig.refused("1A03:01", raw, node) == NOT_MAPPABLE, where(entry)
    assert min(found.values()) > 40


def change(rig: BladeRig, node: int, entry: Entry) -> int | None:
    """Write another value than there is; None where the unit takes none of those tried."""
    was = rig.get(where(entry), node)
    for candidate in (was + 1, was - 1, was + 60, 1 if was == 0 else 0):
        try:
            rig.put(where(entry), candidate, node)
        except (AbortedError, OverflowError):
            continue
        return candidate
    return None


@pytest.mark.rule("A3")
@pytest.mark.rule("A5")
@pytest.mark.parametrize("node", [PMM, PMC])
def test_what_has_mem_y_outlives_a_restart_after_a_save_and_nothing_else_does(
    rig: BladeRig, node: int, tmp_path: Path
) -> None:
    rig = BladeRig(state_dir=tmp_path)
    written: dict[bool, dict[str, tuple[int, int]]] = {True: {}, False: {}}
    for entry in entries(rig, node):
        major = entry.address.major
        parameter = entry.access is Access.RW and entry.type.is_integer and major >= 0x2000 and major not in ACTING
        if not parameter or entry.mirror is not None or (entry.address.minor == 0 and entry.kind is not Kind.VAR):
            continue
        was = rig.get(where(entry), node)
        value = change(rig, node, entry)
        if value is not None:
            written[entry.saved][where(entry)] = (was, value)
    assert len(written[True]) > 40
    assert written[False]
    rig.save(node)
    rig.restart(node)
    for saved, values in written.items():
        for place, (was, value) in values.items():
            if place not in ("3050:00",):  # remanent, and counted on
                assert rig.get(place, node) == (value if saved else was), place


@pytest.mark.rule("A3")
@pytest.mark.parametrize(("node", "live"), [(PMC, "6410:09"), (PMC, "6510:03"), (PMC, "6510:08")])
def test_live_values_in_a_saved_record_are_not_restored(rig: BladeRig, node: int, live: str) -> None:
    before = rig.get(live, node)
    rig.save(node)
    rig.blade.power.motor_c += 40.0
    rig.blade.power.heat_sink_c += 20.0
    rig.restart(node)
    rig.pmc.errors.condition(0x2310, True)
    assert rig.get(live, node) > before


@pytest.mark.rule("A4")
def test_who_has_which_objects(rig: BladeRig) -> None:
    pmm = {entry.address.major for entry in entries(rig, PMM)}
    pmc = {entry.address.major for entry in entries(rig, PMC)}
    assert {index for index in pmm if index >= 0x4000} == {0x5040, 0x5041, 0x5042, 0x603F}
    assert not any(0x3000 <= index < 0x5000 for index in pmc)
    assert {index >> 12 for index in pmm} >= {1, 2, 3}
    assert {index >> 12 for index in pmc} >= {1, 2, 5, 6}
    for index in pmc:
        if 0x6800 <= index < 0x6900:  # the blade encoder as a second axis
            assert index - 0x800 in pmc | {0x6065}, f"{index:04X}"
    for node, others in ((PMM, sorted(pmc - pmm)), (PMC, sorted(pmm - pmc))):
        for index in others:
            assert no_read(rig, node, f"{index:04X}") == NO_OBJECT
    assert 0x5042 in pmm - pmc


@pytest.mark.rule("A5")
@pytest.mark.parametrize(("node", "place"), [(PMM, "3110:01"), (PMC, "6065")])
def test_saving_wants_its_signature_at_1010h_3(rig: BladeRig, node: int, place: str) -> None:
    rig.put(place, 321, node)
    for wrong in (b"evas", b"Save", bytes(4)):
        with pytest.raises(AbortedError):
            rig.master.write(node, "1010:03", wrong)
    rig.restart(node)
    assert rig.get(place, node) != 321
    rig.put(place, 321, node)
    rig.master.write(node, "1010:03", SAVE)
    assert int.from_bytes(SAVE, "little") == 0x65766173
    rig.restart(node)
    assert rig.get(place, node) == 321


@pytest.mark.rule("A6")
def test_twelve_mirrors_show_their_object_while_the_axis_moves(rig: BladeRig) -> None:
    rig.enable()
    rig.go(3000)
    rig.master.run(SECOND)
    store = rig.pmc.device.store
    moving = 0
    for mirror, of in MIRRORS:
        low, full = (store.cell(int(place, 16)) for place in (mirror, of))
        assert low.number == full.number, mirror
        assert low.entry.type.bits == 16
        assert full.entry.type.bits == 32
        moving += low.number not in (0, 3000)
    assert moving >= 5
    mirrored = {where(entry)[:4] for entry in entries(rig, PMC) if entry.mirror is not None}
    assert mirrored == {mirror for mirror, _of in MIRRORS} | {"5079"}


@pytest.mark.rule("A7")
def test_5079h_is_6079h_in_volt(rig: BladeRig) -> None:
    for volt in (120.0, 333.9, 560.0, 700.0):
        rig.blade.power.dc_link_v = volt
        store = rig.pmc.device.store
        assert store.number(0x5079) == store.number(0x6079) // 1000 == int(volt)


@pytest.mark.rule("A8")
@pytest.mark.parametrize(
    ("place", "other", "raw"),
    [
        ("5094", "6094", 2),
        ("5894", "6894", 0xFF),
        ("567A", "607A", 77),
        ("5681", "6081", 77),
        ("5683", "6083", 77),
        ("5684", "6084", 77),
    ],
)
def test_what_looks_like_a_mirror_and_is_none(rig: BladeRig, place: str, other: str, raw: int) -> None:
    def there(index: str) -> int | None:
        cell = rig.pmc.device.store.find(int(index, 16))
        return None if cell is None else cell.number

    before = there(other)
    rig.put(place, raw)
    assert rig.get(place) == raw
    assert there(other) == before
    if place.startswith("56"):
        rig.put(place, 70_000)  # 32 bits
        assert rig.get(place) == 70_000


@pytest.mark.rule("A8")
def test_capture_values_and_manual_functions_are_objects_of_their_own(rig: BladeRig) -> None:
    before = rig.get("5664:01")
    rig.enable()
    rig.move(7500)
    assert rig.get("6064") != 8000
    assert rig.get("5664:01") == before
    assert rig.pmc.device.store.cell(0x5664, 1).entry.type.bits == 32
    rig.put("5040", 0x21)
    assert rig.get("5041") == 0x01
    assert rig.get("6040") & 0xFF == 0x0F  # 5040h shows nothing of the controlword


@pytest.mark.rule("A9")
@pytest.mark.parametrize(
    ("mirror", "of", "raw", "shown"),
    [
        ("507A", "607A", 36000, 32767),
        ("507A", "607A", -36000, -32768),
        ("50B0", "60B0", 1 << 20, 32767),
        ("50FF", "60FF", -(1 << 20), -32768),
        ("5081", "6081", 70_000, 65535),
        ("5083", "6083", 65_535, 65535),
    ],
)
def test_a_mirror_too_small_for_its_object_is_held_at_its_limit(
    rig: BladeRig, mirror: str, of: str, raw: int, shown: int
) -> None:
    rig.put(of, raw)
    assert (rig.get(of), rig.get(mirror)) == (raw, shown)


@pytest.mark.rule("A10")
def test_access_mapping_and_memory_of_the_mirrors(rig: BladeRig) -> None:
    rig.put("1A03:00", 0)
    for mirror in (*(mirror for mirror, _of in MIRRORS), "5079"):
        rig.put("1A03:01", int(mirror, 16) << 16 | 16)
        if mirror in READ_ONLY_MIRRORS:
            assert rig.refused(mirror, 1) == READ_ONLY
        else:
            rig.put(mirror, 123)
            assert rig.get(mirror) == 123
    rig.save()
    rig.restart()
    kept = {mirror for mirror, _of in MIRRORS if mirror not in READ_ONLY_MIRRORS and rig.get(mirror) == 123}
    assert kept == {"5083", "5084"}


# -- B: errors and warnings --------------------------------------------------------------------


def lightning(rig: BladeRig, fault: bool) -> int:
    """Raise FFF1h in the PMM as a fault or as a warning."""
    rig.put("3300:01", 0x4200 if fault else 0x0200, PMM)
    rig.pmm.inputs.digital &= ~X14_11
    settle(rig)
    return 0xFFF1


def hot(rig: BladeRig, node: int) -> int:
    """Raise the warning of the heat sink."""
    if node == PMM:
        rig.put("3111:01", 0, PMM)
    else:
        rig.put("6510:06", 0, PMC)
    settle(rig)
    return 0x4210


@pytest.mark.rule("B1")
@pytest.mark.rule("B2")
@pytest.mark.rule("B3")
def test_a_warning_of_the_pmm(rig: BladeRig) -> None:
    code = hot(rig, PMM)
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (code, 0b010)
    assert rig.get("1003:00", PMM) == 0
    assert list(rig.errors(PMM)) == []
    assert rig.get("1001", PMM) == 0


@pytest.mark.rule("B1")
@pytest.mark.rule("B2")
@pytest.mark.rule("B3")
def test_an_error_of_the_pmm(rig: BladeRig) -> None:
    code = lightning(rig, fault=True)
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (code, 0b100)
    assert (rig.get("1003:00", PMM), rig.get("1003:01", PMM) & 0xFFFF) == (1, code)
    message = rig.master.all_of(0x80 + PMM)[-1].can.data
    assert (int.from_bytes(message[:2], "little"), message[2]) == (code, rig.get("1001", PMM))
    assert message[2] & 1
    hot(rig, PMM)
    assert (rig.get("603F", PMM), rig.get("3000", PMM)) == (code, 0b110)
    assert list(rig.errors(PMM)) == [code]


@pytest.mark.rule("B1")
@pytest.mark.rule("B2")
def test_a_warning_of_the_pmc(rig: BladeRig) -> None:
    code = hot(rig, PMC)
    assert rig.get("603F") == code
    assert rig.status() & (WARNING | FAULT) == WARNING
    assert rig.get("1003:00") == 0
    assert list(rig.errors(PMC)) == []


@pytest.mark.rule("B1")
@pytest.mark.rule("B2")
def test_an_error_of_the_pmc(rig: BladeRig) -> None:
    rig.put("605E", 2)
    rig.pmc.errors.event(0x8611)
    settle(rig)
    assert rig.get("603F") == 0x8611
    assert rig.status() & (WARNING | FAULT) == FAULT
    assert (rig.get("1003:00"), rig.get("1003:01") & 0xFFFF) == (1, 0x8611)
    assert list(rig.errors(PMC)) == [0x8611]


@pytest.mark.rule("B1")
@pytest.mark.parametrize("node", [PMM, PMC])
def test_the_history_keeps_what_was_reset(rig: BladeRig, node: int) -> None:
    errors = rig.pmm.errors if node == PMM else rig.pmc.errors
    for code in (0x8130, 0x5530) if node == PMM else (0x8611, 0x7300):
        errors.event(code)
        settle(rig)
        rig.put("5040", 0, node)
        rig.put("5040", BY_OBJECT, node)
        settle(rig)
    assert rig.get("603F", node) == 0
    codes = [rig.get(f"1003:{sub:02X}", node) & 0xFFFF for sub in (1, 2)]
    assert codes == ([0x5530, 0x8130] if node == PMM else [0x7300, 0x8611])


def by_controlword(rig: BladeRig, node: int) -> None:
    place, first, second = ("3040", 0, RESET) if node == PMM else ("6040", DISABLE_VOLTAGE, FAULT_RESET)
    rig.put(place, first, node)
    rig.put(place, second, node)


def by_object(rig: BladeRig, node: int) -> None:
    rig.put("5040", 0, node)
    rig.put("5040", BY_OBJECT, node)


def by_input(rig: BladeRig, _node: int) -> None:
    rig.pmc.inputs.reset = False
    rig.master.run(30 * MS)
    rig.pmc.inputs.reset = True
    rig.master.run(30 * MS)


Reset = Callable[[BladeRig, int], None]
WAYS: list[tuple[int, Reset]] = [(PMM, by_controlword), (PMM, by_object), (PMM, reload)]
WAYS += [(PMC, by_controlword), (PMC, by_object), (PMC, by_input), (PMC, reload)]


@pytest.mark.rule("B4")
@pytest.mark.parametrize(("node", "reset"), WAYS, ids=[f"{node}-{way.__name__}" for node, way in WAYS])
def test_every_way_to_reset_an_error(rig: BladeRig, node: int, reset: Reset) -> None:
    code = 0x8130 if node == PMM else 0x8611
    (rig.pmm.errors if node == PMM else rig.pmc.errors).event(code)
    settle(rig)
    assert rig.get("603F", node) == code
    reset(rig, node)
    settle(rig)
    assert rig.get("603F", node) == 0
    if node == PMM:
        assert rig.get("3000", PMM) == 1
    else:
        assert not rig.status() & FAULT


@pytest.mark.rule("B4")
@pytest.mark.parametrize(("node", "reset"), WAYS[:2] + WAYS[3:6], ids=["3040", "PMM 5040", "6040", "PMC 5040", "X2.4"])
def test_a_reset_acts_by_its_edge_only(rig: BladeRig, node: int, reset: Reset) -> None:
    reset(rig, node)  # stands at 1 from here on
    errors = rig.pmm.errors if node == PMM else rig.pmc.errors
    errors.event(0x8130 if node == PMM else 0x8611)
    settle(rig)
    if reset is by_controlword:
        rig.put("3040" if node == PMM else "6040", RESET if node == PMM else FAULT_RESET, node)
    elif reset is by_object:
        rig.put("5040", BY_OBJECT, node)
    settle(rig)
    assert errors.pending
    reset(rig, node)
    settle(rig)
    assert not errors.pending


@pytest.mark.rule("B4")
def test_an_error_whose_cause_stands_is_not_reset(rig: BladeRig) -> None:
    lightning(rig, fault=True)
    by_controlword(rig, PMM)
    by_object(rig, PMM)
    assert rig.get("603F", PMM) == 0xFFF1
    rig.restart(PMM)
    settle(rig)
    assert rig.get("603F", PMM) == 0  # 3300h was not saved: the restart has lost the alarm itself
    lightning(rig, fault=True)
    rig.save(PMM)
    reload(rig, PMM)
    assert rig.get("603F", PMM) == 0xFFF1


@pytest.mark.rule("B5")
def test_function_status_is_ok_where_the_error_lies_elsewhere(rig: BladeRig) -> None:
    lightning(rig, fault=True)
    assert rig.get("3000", PMM) & 0b101 == 0b100
    assert [rig.get(f"300{number}", PMM) & 1 for number in (1, 2, 3, 4)] == [1, 1, 1, 1]
    rig.blade.power.dc_link_v = 900.0
    rig.master.run(30 * MS)
    assert [rig.get(f"300{number}", PMM) & 1 for number in (1, 2, 3, 4)] == [1, 0, 1, 1]


@pytest.mark.rule("B6")
def test_bits_of_3000h_by_mains_and_battery(rig: BladeRig) -> None:
    def bits() -> int:
        settle(rig)
        return rig.get("3000", PMM) >> 3

    power = rig.blade.power
    assert bits() == 0
    power.mains_factor = 1.2
    assert (bits(), rig.get("603F", PMM)) == (0b01000, 0x3110)
    power.mains_factor = 0.7
    assert (bits(), rig.get("603F", PMM)) == (0b00110, 0x3120)
    power.mains_factor = 1.0
    assert bits() == 0
    power.phases[1] = 0.0
    assert (bits(), rig.get("603F", PMM)) == (0b10000, 0x3130)
    power.phases[1] = 1.0
    assert bits() == 0
    power.blocs[3].charge = 0.0
    power.blocs[3].offset_v = -10.0
    rig.run_until(lambda: bool(rig.get("3000", PMM) & 1 << 3), 20 * SECOND)
    assert rig.get("603F", PMM) == 0x3284


@pytest.mark.rule("B6")
@pytest.mark.rule("D3")
def test_the_switch_off_counter_runs_while_there_is_something_left(rig: BladeRig) -> None:
    rig.put("30E1", 5, PMM)
    assert not rig.get("3000", PMM) & 1 << 4
    rig.blade.power.mains_present = False
    settle(rig)
    assert rig.get("3000", PMM) & 1 << 4
    rig.blade.power.mains_present = True
    settle(rig)
    assert not rig.get("3000", PMM) & 1 << 4


@pytest.mark.rule("B7")
@pytest.mark.parametrize("number", range(1, 7))
def test_each_bloc_has_its_code(rig: BladeRig, number: int) -> None:
    rig.blade.power.blocs[number - 1].offset_v = -15.0
    rig.run_until(lambda: bool(rig.errors(PMM)), 20 * SECOND)
    assert list(rig.errors(PMM)) == [0x3280 | number]


@pytest.mark.rule("C5")
@pytest.mark.parametrize("bit", [3, 4, 5, 6, *range(8, 16)])
def test_unused_bits_of_3040h_do_nothing(rig: BladeRig, bit: int) -> None:
    rig.pmm.errors.event(0x8130)
    before = [rig.get(place, PMM) for place in ("3000", "3001", "3002", "3003", "3005", "603F")]
    rig.put("3040", 1 << bit, PMM)
    settle(rig)
    rig.put("3040", 0, PMM)
    settle(rig)
    assert [rig.get(place, PMM) for place in ("3000", "3001", "3002", "3003", "3005", "603F")] == before


@pytest.mark.rule("C1")
@pytest.mark.parametrize("word", [0x01, 0x04])
def test_a_command_that_stands_does_not_start_again(rig: BladeRig, word: int) -> None:
    status, active = ("3001", 1 << 1) if word == 0x01 else ("3002", 1 << 1)
    rig.put("3040", word, PMM)
    settle(rig)
    assert rig.get(status, PMM) & active
    rig.pmm.charger.clear()
    rig.pmm.supply.boost(False)
    settle(rig)
    rig.put("3040", word, PMM)
    settle(rig)
    assert not rig.get(status, PMM) & active
    rig.put("3040", 0, PMM)
    rig.put("3040", word, PMM)
    settle(rig)
    assert rig.get(status, PMM) & active
