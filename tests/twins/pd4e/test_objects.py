"""Single objects by FC 43, and the whole dictionary by FC 101 to 103."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest

from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.variant import as_variant
from app.twins.pd4e.device import MOTORS
from app.wire.modbus.answers import FramesRead, ObjectRead, ObjectWritten
from app.wire.modbus.frames import ObjectFrame
from app.wire.modbus.functions import Phase
from app.wire.modbus.requests import ReadArray, ReadDictionary, ReadObject, Request, WriteArray, WriteObject
from tests.twins.pd4e.rig import AbortedError, Client, Rig, address, running

NO_DATA = 0x08000024


def frames(client: Client, request: Callable[[Phase], Request]) -> list[ObjectFrame]:
    """All frames of FC 101 or 102, until there are no more."""
    found: list[ObjectFrame] = []
    phase = Phase.START
    while True:
        try:
            answer = client.ask(request(phase))
        except AbortedError as error:
            assert error.code == NO_DATA
            return found
        assert isinstance(answer, FramesRead)
        assert answer.frames
        found += answer.frames
        phase = Phase.CONTINUE


def test_the_example_of_the_manual_byte_for_byte(client: Client) -> None:
    """Page 110: two bytes are asked of 6060h, which has one."""
    client.send(bytes.fromhex("00 00 00 00 00 0D 00 2B 0D 00 00 01 60 60 00 00 00 00 02"))
    assert client.receive().encode() == bytes.fromhex("00 00 00 00 00 0B 00 AB FF 00 06 0D CE 12 00 07 06")


def test_a_write_is_acknowledged_as_in_the_manual(client: Client) -> None:
    """Page 103: 6040h is set to 80h."""
    client.send(bytes.fromhex("00 03 00 00 00 0F 00 2B 0D 01 00 01 60 40 00 00 00 00 02 80 00"))
    assert client.receive().encode() == bytes.fromhex("00 03 00 00 00 0D 00 2B 0D 01 00 01 60 40 00 00 00 00 00")


@pytest.mark.parametrize(
    ("where", "data", "code"),
    [
        ("6081", b"\0\0\0\0\0", 0x06070012),
        ("6081", b"\0\0", 0x06070013),
        ("6041", b"\0\0", 0x06010002),
        ("5FFF", b"\0", 0x06020000),
        ("6091:07", b"\0\0\0\0", 0x06090011),
        ("2030", bytes(4), 0x06090032),
        ("605A", b"\x03\0", 0x06090030),
        ("2800:01", b"boo!", 0x06090030),
    ],
)
def test_writes_are_refused_with_the_abort_code_that_fits(client: Client, where: str, data: bytes, code: int) -> None:
    assert client.refused(lambda: client.ask(WriteObject(address(where), data))) == code


@pytest.mark.parametrize(
    ("where", "size", "code"),
    [("6064", 2, 0x06070013), ("6064", 8, 0x06070012), ("5FFF", 4, 0x06020000), ("6091:07", 4, 0x06090011)],
)
def test_reads_are_refused_with_the_abort_code_that_fits(client: Client, where: str, size: int, code: int) -> None:
    assert client.refused(lambda: client.raw(where, size)) == code


def test_a_refused_write_changes_nothing(client: Client) -> None:
    client.write("6081", 300)
    for wrong in (lambda: client.ask(WriteObject(address("6081"), b"\1\2")), lambda: client.write("2030", 0)):
        client.refused(wrong)
    assert client.read("6081") == 300
    assert client.read("2030") == 50


def test_texts_are_read_whole_or_in_pieces(client: Client) -> None:
    name = client.text("1008")
    assert name == "HUBSIDE TWIN PD4-E591L42-E-65-4"
    piece = client.ask(ReadObject(Address(0x1008), 4, start=8))
    assert isinstance(piece, ObjectRead)
    assert piece.data == b"TWIN"
    assert client.text("4040") == "TWIN-0001"
    assert len(client.text("200F")) == 17


def test_the_start_address_belongs_to_texts_alone(client: Client) -> None:
    assert client.refused(lambda: client.ask(ReadObject(Address(0x6064), 2, start=2))) == 0xFFFF000E
    assert client.refused(lambda: client.ask(WriteObject(Address(0x6081), b"\0\0", start=2))) == 0xFFFF000E


def test_an_option_that_there_is_not_is_refused(client: Client) -> None:
    pdu = bytes.fromhex("2B 0D 20 00 01 60 41 00 00 00 00 02")
    assert client.exchange(pdu) == bytes.fromhex("AB FF 00 06 0D CE 03 00 FF FF")


def test_data_that_are_not_as_long_as_announced_are_refused(client: Client) -> None:
    pdu = bytes.fromhex("2B 0D 01 00 01 60 40 00 00 00 00 02 80")
    assert client.exchange(pdu) == bytes.fromhex("AB FF 00 06 0D CE 0E 00 FF FF")
    assert client.read("6040") == 0


@pytest.mark.parametrize("variant", sorted(MOTORS))
def test_each_variant_has_its_own_defaults(variant: str) -> None:
    wanted = as_variant(load_builtin("nanotec-pd4e"), variant)
    with running(variant=variant) as rig:
        for where in ("1000", "1018:02", "2030", "2031", "203A:01", "203B:01", "3202", "3210:01", "6073"):
            default = wanted.entry(address(where)).default
            assert default is not None
            assert rig.client.read(where) == default
        assert rig.client.text("1008").startswith("HUBSIDE TWIN PD4-E")


def test_the_whole_dictionary_in_rising_order(client: Client) -> None:
    found = frames(client, ReadDictionary)
    addresses = [frame.address for frame in found]
    assert all(before < after for before, after in pairwise(addresses))
    known = set(load_builtin("nanotec-pd4e").entries)
    left_out = known - set(addresses)
    assert {one.major for one in left_out} == {0x1003}, "the places of errors that there are not"
    assert set(addresses) <= known
    by_address = dict(found)
    assert by_address[Address(0x2030)] == (50).to_bytes(4, "little")
    assert by_address[Address(0x6041)] == bytes.fromhex("40 06")


def test_the_dictionary_shows_errors_that_there_are(rig: Rig) -> None:
    rig.device.drive.conditions.supply_mv = 60_000
    rig.client.until(rig.client.fault, 100)
    found = dict(frames(rig.client, ReadDictionary))
    assert found[Address(0x1003, 1)] == bytes.fromhex("00 31 04 01")
    assert Address(0x1003, 2) not in found


def test_reading_on_needs_a_beginning_and_a_new_one_begins_anew(client: Client) -> None:
    assert client.refused(lambda: client.ask(ReadDictionary(Phase.CONTINUE))) == 0xFFFF1004
    first = client.ask(ReadDictionary(Phase.START))
    second = client.ask(ReadDictionary(Phase.CONTINUE))
    assert first != second
    assert client.ask(ReadDictionary(Phase.START)) == first


def test_two_clients_read_the_dictionary_each_for_itself(rig: Rig) -> None:
    other = rig.connect()
    first = rig.client.ask(ReadDictionary(Phase.START))
    assert other.refused(lambda: other.ask(ReadDictionary(Phase.CONTINUE))) == 0xFFFF1004
    assert other.ask(ReadDictionary(Phase.START)) == first
    assert rig.client.ask(ReadDictionary(Phase.CONTINUE)) == other.ask(ReadDictionary(Phase.CONTINUE))
    other.close()


@pytest.mark.parametrize("index", [0x2400, 0x203B, 0x2701])
def test_an_array_is_read_with_all_its_entries(client: Client, index: int) -> None:
    found = [frame.address for frame in frames(client, lambda phase: ReadArray(phase, index))]
    wanted = [one for one in load_builtin("nanotec-pd4e").entries if one.major == index]
    assert found == wanted


def test_an_array_is_refused_where_there_is_none(client: Client) -> None:
    assert client.refused(lambda: client.ask(ReadArray(Phase.START, 0x5FFF))) == 0x06020000
    assert client.refused(lambda: client.ask(ReadArray(Phase.START, 0x6041))) == 0xFFFF0008
    client.ask(ReadArray(Phase.START, 0x2400))
    assert client.refused(lambda: client.ask(ReadArray(Phase.CONTINUE, 0x2500))) == 0xFFFF1004


def test_an_array_is_written_at_once(client: Client) -> None:
    values = [ObjectFrame(Address(0x2400, sub), (100 * sub).to_bytes(4, "little")) for sub in range(1, 33)]
    with_count = [ObjectFrame(Address(0x2400, 0), b"\x20"), *values]
    client.ask(WriteArray(Phase.START, tuple(with_count[:20])))
    client.ask(WriteArray(Phase.CONTINUE, tuple(with_count[20:])))
    assert [client.read(f"2400:{sub:02X}") for sub in (1, 19, 20, 32)] == [100, 1900, 2000, 3200]


def test_writing_an_array_ends_at_what_is_refused(client: Client) -> None:
    values = (
        ObjectFrame(Address(0x6091, 1), (4).to_bytes(4, "little")),
        ObjectFrame(Address(0x6091, 2), bytes(4)),
    )
    assert client.refused(lambda: client.ask(WriteArray(Phase.START, values))) == 0x06090032
    assert client.read("6091:01") == 4, "OPEN in the manual; what came before stays"
    mixed = (values[0], ObjectFrame(Address(0x6092, 1), (4).to_bytes(4, "little")))
    assert client.refused(lambda: client.ask(WriteArray(Phase.START, mixed))) == 0xFFFF000E


def test_a_write_answers_with_the_object_and_no_data(client: Client) -> None:
    answer = client.ask(WriteObject(Address(0x6081), (700).to_bytes(4, "little")))
    assert answer == ObjectWritten(Address(0x6081))
