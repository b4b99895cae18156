"""PDOs of a twin over the line: transmission types, inhibit time, event timer, mapping procedure."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND
from tests.twins.oat_rig import ENABLE, PMC, SHUTDOWN, BladeRig

TPDO1, TPDO2, RPDO1, RPDO2 = 0x180 + PMC, 0x280 + PMC, 0x200 + PMC, 0x300 + PMC
STATUSWORD = 0x60410010
POSITION = 0x60640020


@pytest.fixture
def rig() -> BladeRig:
    return BladeRig()


def enable_tpdo2(rig: BladeRig, kind: int, inhibit: int = 0, event_ms: int = 0) -> None:
    rig.put("1801:02", kind)
    rig.put("1801:03", inhibit)
    rig.put("1801:05", event_ms)
    rig.put("1801:01", 0x40000000 | TPDO2)


@pytest.mark.rule("O1")
def test_only_the_first_pdos_are_active(rig: BladeRig) -> None:
    rig.operational()
    assert [heard.can.data for heard in rig.master.all_of(TPDO1)] == [bytes.fromhex("3106")]
    assert not rig.master.all_of(TPDO2)
    assert rig.get("1801:01") == 0xC0000000 | TPDO2
    assert rig.get("1400:01") == RPDO1
    rig.master.send(RPDO1, ENABLE.to_bytes(2, "little"))
    heard = rig.master.wait_id(TPDO1)
    assert heard.can.data[0] & 0x6F == 0x27


def test_no_pdo_before_operational(rig: BladeRig) -> None:
    rig.master.send(RPDO1, ENABLE.to_bytes(2, "little"))
    rig.master.run(100 * MS)
    assert rig.get("6040") == 0
    assert not rig.master.all_of(TPDO1)
    rig.operational()
    rig.master.nmt(NmtCommand.PRE_OPERATIONAL, PMC)
    rig.master.run(10 * MS)
    before = len(rig.master.all_of(TPDO1))
    rig.command(SHUTDOWN | 0x4000)
    assert len(rig.master.all_of(TPDO1)) == before


def test_event_driven_on_change_only(rig: BladeRig) -> None:
    enable_tpdo2(rig, 255)
    rig.operational()
    rig.master.run(SECOND)
    assert len(rig.master.all_of(TPDO2)) == 1
    rig.enable()
    rig.go(7900)
    rig.wait_bit(10)
    assert len(rig.master.all_of(TPDO2)) > 20
    last = rig.master.all_of(TPDO2)[-1].can.data
    assert int.from_bytes(last[2:], "little", signed=True) == pytest.approx(7900, abs=2)


def test_event_timer_and_inhibit_time(rig: BladeRig) -> None:
    enable_tpdo2(rig, 254, inhibit=500, event_ms=200)
    rig.operational()
    rig.master.run(1050 * MS)
    heard = rig.master.all_of(TPDO2)
    assert len(heard) == 6
    rig.enable()
    rig.go(7000)
    rig.master.run(2 * SECOND)
    times = [heard.t_ns for heard in rig.master.all_of(TPDO2)]
    gaps = [later - earlier for earlier, later in pairwise(times)]
    assert min(gaps) >= 49 * MS
    assert max(gaps) <= 201 * MS


@pytest.mark.parametrize(("kind", "sent"), [(1, 12), (4, 3)])
def test_cyclic_on_sync(rig: BladeRig, kind: int, sent: int) -> None:
    enable_tpdo2(rig, kind)
    rig.operational()
    for _ in range(12):
        rig.master.send(0x80)
        rig.master.run(10 * MS)
    assert len(rig.master.all_of(TPDO2)) == sent


def test_acyclic_on_sync_after_a_change(rig: BladeRig) -> None:
    enable_tpdo2(rig, 0)
    rig.operational()
    for _ in range(5):
        rig.master.send(0x80)
        rig.master.run(10 * MS)
    assert len(rig.master.all_of(TPDO2)) == 1
    rig.command(SHUTDOWN | 0x4000)
    assert len(rig.master.all_of(TPDO2)) == 1
    rig.master.send(0x80)
    rig.master.run(10 * MS)
    assert len(rig.master.all_of(TPDO2)) == 2


def test_remote_frame_where_allowed(rig: BladeRig) -> None:
    rig.operational()
    before = len(rig.master.all_of(TPDO1))
    rig.master.send(TPDO1, remote=True, dlc=2)
    rig.master.run(10 * MS)
    assert len([heard for heard in rig.master.all_of(TPDO1) if not heard.can.remote]) == before
    rig.put("1800:01", 0x80000000 | TPDO1)
    rig.put("1800:02", 253)
    rig.put("1800:01", TPDO1)
    rig.master.send(TPDO1, remote=True, dlc=2)
    rig.master.run(10 * MS)
    assert len([heard for heard in rig.master.all_of(TPDO1) if not heard.can.remote]) == before + 1


def test_rpdo_waits_for_sync(rig: BladeRig) -> None:
    rig.put("1401:02", 1)
    rig.put("1401:01", RPDO2)
    rig.operational()
    rig.master.send(RPDO2, bytes.fromhex("0601") + (7000).to_bytes(4, "little"))
    rig.master.run(10 * MS)
    assert rig.get("607A") == 0
    rig.master.send(0x80)
    rig.master.run(10 * MS)
    assert (rig.get("6040"), rig.get("607A")) == (0x0106, 7000)


def test_a_short_rpdo_is_not_used(rig: BladeRig) -> None:
    rig.operational()
    rig.master.send(RPDO1, b"\x0f")
    rig.master.run(10 * MS)
    assert rig.get("6040") == 0


def test_mapping_procedure(rig: BladeRig) -> None:
    rig.put("1A01:00", 0)
    rig.put("1A01:01", POSITION)
    rig.put("1A01:02", 0x60780010)
    rig.put("1A01:00", 2)
    enable_tpdo2(rig, 255)
    rig.operational()
    data = rig.master.wait_id(TPDO2, since=0).can.data
    assert data == (8000).to_bytes(4, "little") + bytes(2)


def test_the_mapping_of_a_pdo_in_use_cannot_change(rig: BladeRig) -> None:
    assert rig.refused("1A00:00", 0) == 0x06010000
    assert rig.refused("1A00:01", POSITION) == 0x06010000
    assert rig.refused("1A01:01", POSITION) == 0x06010000
    rig.put("1A01:00", 0)
    rig.put("1A01:01", POSITION)


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        (0x47110010, 0x06020000),
        (0x60FE0920, 0x06090011),
        (0x60650020, 0x06040041),
        (0x60640010, 0x06040042),
    ],
)
def test_what_cannot_be_mapped(rig: BladeRig, entry: int, code: int) -> None:
    rig.put("1A01:00", 0)
    assert rig.refused("1A01:01", entry) == code


@pytest.mark.rule("A3")
def test_a_read_only_object_cannot_be_received(rig: BladeRig) -> None:
    rig.put("1601:00", 0)
    assert rig.refused("1601:01", POSITION) == 0x06040041
    rig.put("1601:01", 0x00070020)
    rig.put("1601:02", 0x60400010)
    rig.put("1601:00", 2)
    rig.put("1401:01", RPDO2)
    rig.operational()
    rig.master.send(RPDO2, bytes(4) + bytes.fromhex("0601"))
    rig.master.run(10 * MS)
    assert rig.get("6040") == 0x0106


def test_more_than_64_bits_are_refused(rig: BladeRig) -> None:
    rig.put("1A01:00", 0)
    for sub in (1, 2, 3):
        rig.put(f"1A01:{sub:02X}", POSITION)
    assert rig.refused("1A01:00", 3) == 0x06040042
    rig.put("1A01:00", 2)


@pytest.mark.parametrize("cob_id", [0x000, 0x07F, 0x101, 0x58B, 0x60B, 0x701, 1 << 29 | 0x290])
def test_identifiers_that_a_pdo_must_not_use(rig: BladeRig, cob_id: int) -> None:
    assert rig.refused("1801:01", cob_id) == 0x06090030


def test_the_identifier_of_a_pdo_in_use_cannot_change(rig: BladeRig) -> None:
    assert rig.refused("1800:01", 0x40000000 | 0x1F0) == 0x06090030
    assert rig.refused("1800:03", 100) == 0x06090030
    assert rig.refused("1800:02", 245) == 0x06090030
    rig.put("1800:01", 0x80000000 | TPDO1)
    rig.put("1800:03", 100)
    rig.put("1800:01", 0x40000000 | 0x1F0)


def test_a_restart_brings_the_default_mapping_back(rig: BladeRig) -> None:
    enable_tpdo2(rig, 255)
    rig.restart()
    assert rig.get("1801:01") == 0xC0000000 | TPDO2
    assert rig.get("1A00:01") == STATUSWORD
