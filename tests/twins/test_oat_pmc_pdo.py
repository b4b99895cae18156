"""PDOs of the PMC as they are after power-on (manual, 5.17, tables 74 and 75)."""

from __future__ import annotations

import pytest

from tests.twins.harness import MS
from tests.twins.oat_rig import ENABLE, PMC, BladeRig

TABLE_74 = {
    1: (0x00000200, [0x60400010]),
    2: (0x80000300, [0x60400010, 0x607A0020]),
    3: (0x80000400, [0x60400010, 0x60FF0020]),
    4: (0x80000500, [0x607A0020, 0x60810020]),
}
TABLE_75 = {
    1: (0x40000180, [0x60410010]),
    2: (0xC0000280, [0x60410010, 0x60640020]),
    3: (0xC0000380, [0x60410010, 0x606C0020]),
    4: (0xC0000480, [0x60640020, 0x606C0020]),
}
NO_RTR, INVALID = 1 << 30, 1 << 31


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


@pytest.mark.rule("O1")
@pytest.mark.parametrize("number", [1, 2, 3, 4])
@pytest.mark.parametrize(
    ("table", "communication", "mapping"), [(TABLE_74, 0x1400, 0x1600), (TABLE_75, 0x1800, 0x1A00)]
)
def test_identifiers_and_mapping(
    rig: BladeRig, table: dict[int, tuple[int, list[int]]], communication: int, mapping: int, number: int
) -> None:
    """RPDO4 is printed with 5 entries and has two (contradictory print; two fill it)."""
    cob_id, entries = table[number]
    assert rig.get(f"{communication + number - 1:04X}:01") == cob_id + PMC
    assert rig.get(f"{mapping + number - 1:04X}:00") == len(entries)
    for place, entry in enumerate(entries, 1):
        assert rig.get(f"{mapping + number - 1:04X}:{place:02X}") == entry


@pytest.mark.rule("O1")
def test_only_the_first_one_is_sent_and_taken(rig: BladeRig) -> None:
    rig.operational()
    rig.enable()
    rig.go(7900)
    rig.wait_bit(10)
    assert rig.master.all_of(0x180 + PMC)
    for base in (0x280, 0x380, 0x480):
        assert not rig.master.all_of(base + PMC)
    before = rig.get("607A")
    for base in (0x300, 0x400, 0x500):
        rig.master.send(base + PMC, bytes(8))
    rig.master.run(10 * MS)
    assert (rig.get("6040"), rig.get("607A")) == (0x000F, before)
    rig.master.send(0x200 + PMC, ENABLE.to_bytes(2, "little"))
    rig.master.run(10 * MS)
    assert rig.get("6040") == ENABLE


@pytest.mark.rule("O1")
@pytest.mark.parametrize("number", [2, 3, 4])
def test_the_others_work_once_bit_31_is_taken_away(rig: BladeRig, number: int) -> None:
    rig.operational()
    rig.put(f"18{number - 1:02X}:01", TABLE_75[number][0] + PMC & ~INVALID)
    rig.master.run(10 * MS)
    assert rig.master.all_of(0x180 + 0x100 * (number - 1) + PMC)
    rig.put(f"14{number - 1:02X}:01", TABLE_74[number][0] + PMC & ~INVALID)
    sent = {2: "06010001 0000", 3: "06010001 0000", 4: "00010000 00020000"}[number]
    rig.master.send(0x200 + 0x100 * (number - 1) + PMC, bytes.fromhex(sent))
    rig.master.run(10 * MS)
    assert rig.get({2: "607A", 3: "60FF", 4: "6081"}[number]) == {2: 0x100, 3: 0x100, 4: 0x200}[number]


@pytest.mark.rule("O1")
def test_bit_30_forbids_remote_frames(rig: BladeRig) -> None:
    rig.operational()
    assert rig.get("1800:01") & NO_RTR
    before = len([heard for heard in rig.master.all_of(0x180 + PMC) if not heard.can.remote])
    rig.master.send(0x180 + PMC, remote=True, dlc=2)
    rig.master.run(10 * MS)
    assert len([heard for heard in rig.master.all_of(0x180 + PMC) if not heard.can.remote]) == before
