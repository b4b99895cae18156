"""Saving by categories, restoring, restart: what a value is after each."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.twins.pd4e.rig import Client, Rig, running

SAVE, LOAD, BOOT = 0x65766173, 0x64616F6C, 0x746F6F62
SAVE_MS = 250


def save(client: Client, sub: int) -> None:
    """Write "save" and wait until the entry is 1 again."""
    client.write(f"1010:{sub:02X}", SAVE)
    client.until(lambda: client.read(f"1010:{sub:02X}") == 1, 5_000)


def load(client: Client, sub: int) -> None:
    client.write(f"1011:{sub:02X}", LOAD)
    client.until(lambda: client.read(f"1011:{sub:02X}") == 1, 5_000)


OF_CATEGORY = {3: ("6083", 777), 4: ("2701:05", 12345), 5: ("6073", 800), 6: ("2031", 1500), 0x0C: ("2011", 0xC0A80205)}


def test_unsaved_values_are_lost_with_a_restart(rig: Rig) -> None:
    for where, value in OF_CATEGORY.values():
        rig.client.write(where, value)
    client = rig.restart()
    for where, value in OF_CATEGORY.values():
        assert client.read(where) != value


@pytest.mark.parametrize("sub", sorted(OF_CATEGORY))
def test_a_category_saves_its_own_and_nothing_else(rig: Rig, sub: int) -> None:
    for where, value in OF_CATEGORY.values():
        rig.client.write(where, value)
    save(rig.client, sub)
    client = rig.restart()
    for place, (where, value) in OF_CATEGORY.items():
        assert (client.read(where) == value) == (place == sub), where


def test_all_saves_every_category(rig: Rig) -> None:
    for where, value in OF_CATEGORY.values():
        rig.client.write(where, value)
    save(rig.client, 1)
    client = rig.restart()
    assert {where: client.read(where) for where, _ in OF_CATEGORY.values()} == dict(OF_CATEGORY.values())


def test_saved_values_outlive_the_process(tmp_path: Path) -> None:
    with running(state=tmp_path / "pd4e.json") as rig:
        rig.client.write("6083", 777)
        rig.client.write("6084", 888)
        save(rig.client, 3)
        rig.client.write("6084", 999)
    with running(state=tmp_path / "pd4e.json") as rig:
        assert rig.client.read("6083") == 777
        assert rig.client.read("6084") == 888


def test_the_memory_of_another_variant_is_not_used(tmp_path: Path) -> None:
    with running(state=tmp_path / "pd4e.json") as rig:
        rig.client.write("2031", 1500)
        save(rig.client, 6)
    with running(state=tmp_path / "pd4e.json", variant="pd4-eb59") as rig:
        assert rig.client.read("2031") == 6000
        assert (tmp_path / "pd4e.damaged").is_file()


def test_a_save_takes_its_time_and_tells_when_it_is_done(rig: Rig) -> None:
    client = rig.client
    client.write("1010:03", SAVE)
    assert client.read("1010:03") == SAVE, "still running"
    assert client.refused(lambda: client.write("1010:05", SAVE)) == 0x08000022, "one at a time"
    client.advance(SAVE_MS)
    assert client.read("1010:03") == 1


def test_a_save_cut_by_a_restart_has_not_happened(rig: Rig) -> None:
    rig.client.write("6083", 777)
    rig.client.write("1010:03", SAVE)
    client = rig.restart()
    assert client.read("6083") == 500


def test_a_save_is_refused_while_the_motor_moves(client: Client) -> None:
    client.enable(3)
    client.write("60FF", 60)
    client.until(lambda: client.read("606C") > 30)
    assert client.refused(lambda: client.write("1010:01", SAVE)) == 0x08000022
    client.write("60FF", 0)
    client.until(client.stands)
    client.advance(50)
    save(client, 1)


def test_the_motor_does_not_start_while_a_save_runs(client: Client) -> None:
    client.write("6060", 3)
    client.write("60FF", 60)
    client.control(0x06, 0x07)
    client.write("1010:01", SAVE)
    assert client.control(0x0F) & 0x6F == 0x23, "still Switched on"
    client.advance(SAVE_MS)
    assert client.read("6041") & 0x6F == 0x27


@pytest.mark.parametrize("value", [0, 1, LOAD, SAVE + 1])
def test_only_the_signature_saves(client: Client, value: int) -> None:
    assert client.refused(lambda: client.write("1010:03", value)) == 0x08000020
    assert client.read("1010:03") == 1


def test_what_cannot_be_saved_refuses(client: Client) -> None:
    assert client.read("1010:09") == 0
    assert client.refused(lambda: client.write("1010:09", SAVE)) == 0x08000020


def test_discarding_takes_effect_with_the_restart(rig: Rig) -> None:
    client = rig.client
    client.write("6083", 777)
    client.write("2031", 1500)
    save(client, 1)
    load(client, 3)
    assert client.read("6083") == 777, "RAM is as it was"
    client = rig.restart()
    assert client.read("6083") == 500
    assert client.read("2031") == 1500, "another category"
    load(client, 1)
    assert rig.restart().read("2031") == 2100


def test_date_and_time_of_the_configuration_go_with_any_save(rig: Rig) -> None:
    rig.client.write("1020:01", 14_610)
    rig.client.write("1020:02", 43_200_000)
    save(rig.client, 6)
    client = rig.restart()
    assert (client.read("1020:01"), client.read("1020:02")) == (14_610, 43_200_000)
    client.write("1020:01", 15_000)
    assert rig.restart().read("1020:01") == 14_610, "not saved again"


def test_a_restart_answers_first_and_comes_back_at_the_start(rig: Rig) -> None:
    client = rig.client
    client.enable(3)
    client.write("60FF", 60)
    client.until(lambda: client.read("6064") > 100)
    client.advance(2_000)
    assert client.read("230F") >= 2
    client = rig.restart()
    assert client.read("6041") & 0x027F == 0x0240
    assert client.read("6061") == 0
    assert client.read("60FF") == 0
    assert client.read("230F") == 0
    assert abs(client.read("6064")) < 400, "an incremental encoder begins at 0; the shaft ran out a little"


def test_no_connection_is_taken_while_the_device_boots(rig: Rig) -> None:
    rig.client.write("2800:01", BOOT)
    other = rig.connect()
    with pytest.raises(ConnectionError):
        other.exchange(b"\x03\x13\x88\x00\x01")
    other.close()
    rig.reconnect()


def test_a_restart_can_wait(rig: Rig) -> None:
    client = rig.client
    client.write("2800:02", 300)
    client.write("2800:01", BOOT)
    assert client.read("6061") == 0, "not yet"
    client.advance(400)
    rig.reconnect()


def test_a_memory_that_takes_nothing_is_a_warning(rig: Rig) -> None:
    rig.client.write("6083", 777)
    rig.device.memory.failing = True
    save(rig.client, 3)
    assert rig.client.read("1003:01") == 0x10017600
    assert rig.client.has(0x80), "warning"
    assert rig.restart().read("6083") == 500


def test_a_static_address_counts_after_save_and_restart(rig: Rig) -> None:
    client = rig.client
    client.write("2010", 1)
    client.write("2011", 0xC0A80205)
    client.write("2012", 0xFFFFFF00)
    client.write("2013", 0xC0A80201)
    assert client.read("2014") == 0x7F000001
    save(client, 0x0C)
    client = rig.restart()
    assert [client.read(where) for where in ("2014", "2015", "2016")] == [0xC0A80205, 0xFFFFFF00, 0xC0A80201]
    client.write("2010", 0)
    client.write("2011", 0)
    save(client, 0x0C)
    assert rig.restart().read("2014") == 0x7F000001, "both 0: DHCP, as the manual says"
