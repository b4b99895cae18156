"""Process data by FC 3, 4, 6, 16 and 23, and changing what is mapped."""

from __future__ import annotations

import pytest

from app.wire.modbus.answers import RegistersRead, RegistersWritten
from app.wire.modbus.functions import Function
from app.wire.modbus.requests import ReadRegisters, ReadWriteRegisters, WriteRegister, WriteRegisters
from tests.twins.pd4e.rig import Client, Rig

RX, TX = 6000, 5000
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE, FAILURE = 1, 2, 3, 4
TX_DEFAULT = [0x60410010, 0x00050008, 0x60610008, 0x60640020, 0x60440010, 0x60FD0020]


def remap(client: Client, index: int, entries: list[int]) -> None:
    client.write(f"{index:04X}:00", 0)
    for place, entry in enumerate(entries, 1):
        client.write(f"{index:04X}:{place:02X}", entry)
    client.write(f"{index:04X}:00", len(entries))


def test_what_the_drive_sends_lies_as_the_manual_draws_it(rig: Rig) -> None:
    """Page 115: 6041h, dummy and 6061h, 6064h, 6044h, 60FDh: 7 registers, high byte first."""
    client = rig.client
    assert client.read("3602:00") == 6
    assert [client.read(f"3602:{sub:02X}") for sub in range(1, 7)] == TX_DEFAULT
    client.write("6060", 1)
    rig.device.servo.position = 20.0
    rig.device.drive.conditions.levels = 0b1001
    status, mode, high, low, speed, inputs_high, inputs_low = client.registers(TX, 7)
    assert status == client.read("6041") == 0x0640
    assert mode == 0x0001, "the dummy is the high byte"
    assert high << 16 | low == client.read("6064") == 72_000
    assert speed == 0
    assert (inputs_high, inputs_low) == (0b1001, 0)


def test_a_part_can_be_read_and_fc_4_reads_the_same(client: Client) -> None:
    whole = client.registers(TX, 7)
    assert client.registers(TX + 2, 2) == whole[2:4]
    answer = client.ask(ReadRegisters(TX, 7, Function.READ_INPUT_REGISTERS))
    assert answer == RegistersRead(whole, Function.READ_INPUT_REGISTERS)


def test_negative_values_are_two_complements(rig: Rig) -> None:
    rig.device.servo.position = -1.0
    high, low = rig.client.registers(TX + 2, 2)
    assert (high << 16 | low) - (1 << 32) == rig.client.read("6064") == -3_600


@pytest.mark.parametrize(
    ("start", "quantity"), [(TX - 1, 1), (TX, 8), (TX + 7, 1), (0, 1), (0xFFFF, 1), (RX - 1, 2), (40_001, 1)]
)
def test_registers_that_there_are_not(client: Client, start: int, quantity: int) -> None:
    assert client.refused(lambda: client.registers(start, quantity)) == ILLEGAL_ADDRESS


@pytest.mark.parametrize("quantity", [0, 126, 0xFFFF])
def test_a_number_of_registers_that_no_request_may_have(client: Client, quantity: int) -> None:
    pdu = b"\x03" + TX.to_bytes(2, "big") + quantity.to_bytes(2, "big")
    assert client.exchange(pdu) == bytes((0x83, ILLEGAL_VALUE))


def test_what_the_drive_sends_cannot_be_written(client: Client) -> None:
    assert client.refused(lambda: client.put(TX, 1)) == ILLEGAL_ADDRESS
    assert client.refused(lambda: client.ask(WriteRegister(TX, 1))) == ILLEGAL_ADDRESS


def test_the_example_of_fc_6(client: Client) -> None:
    """Page 97: register 6000 is set to 1; the answer repeats the request."""
    request = bytes.fromhex("00 00 00 00 00 06 00 06 17 70 00 01")
    client.send(request)
    assert client.receive().encode() == request
    assert client.read("6040") == 1
    assert client.registers(RX, 1) == (1,)


def test_the_drive_is_enabled_and_moved_by_registers_alone(client: Client) -> None:
    """6040h, dummy and 6060h, 3202h, 607Ah, 6081h, 6042h, 60FEh, as delivered."""
    drive_mode = client.read("3202")
    for word in (0x06, 0x07, 0x0F):
        answer = client.ask(WriteRegisters(RX, (word, 0x0001, drive_mode >> 16, drive_mode & 0xFFFF, 0, 1_800, 0, 300)))
        assert answer == RegistersWritten(RX, 8)
    assert client.read("6061") == 1
    status, *_ = client.registers(TX, 1)
    assert status & 0x6F == 0x27
    answer = client.ask(ReadWriteRegisters(TX, 4, RX, (0x1F,)))
    assert isinstance(answer, RegistersRead)
    client.until(lambda: client.registers(TX, 1)[0] & 0x400 != 0)
    assert client.registers(TX + 2, 2) == (0, 1_800)
    assert client.read("6081") == 300


def test_a_target_in_the_same_message_as_bit_4_is_the_one_that_counts(client: Client) -> None:
    """6040h stands before 607Ah in the mapping, but the drive looks at both when the message is whole."""
    client.write("607A", 7_200)
    client.enable(1)
    client.put(RX, 0x1F, 0x0001, 0, 0, 0, 360)
    client.until(lambda: client.has(0x400))
    assert client.read("6064") == 360


def test_fc_23_writes_before_it_reads(client: Client) -> None:
    answer = client.ask(ReadWriteRegisters(RX, 2, RX, (0x0006, 0x0003)))
    assert answer == RegistersRead((0x0006, 0x0003), Function.READ_WRITE_REGISTERS)
    answer = client.ask(ReadWriteRegisters(TX, 2, RX, (0x0006,)))
    assert isinstance(answer, RegistersRead)
    assert answer.registers[1] == 3


def test_one_half_of_a_32_bit_object_can_be_written(client: Client) -> None:
    client.write("607A", 0x00010002)
    client.put(RX + 5, 0x1234)
    assert client.read("607A") == 0x00011234
    client.put(RX + 4, 0xFFFF)
    assert client.read("607A") == 0xFFFF1234 - (1 << 32)


def test_a_value_that_its_object_refuses(client: Client) -> None:
    assert client.refused(lambda: client.put(RX + 1, 0x0005)) == ILLEGAL_VALUE, "there is no mode 5"
    client.put(RX + 1, 0x0201)
    assert client.read("6060") == 1, "the dummy beside it is nothing"


def test_a_mapping_is_changed_while_its_count_is_0(client: Client) -> None:
    assert client.refused(lambda: client.write("3602:01", 0x60640020)) in (0x08000022, 0x06010000)
    client.write("3602:00", 0)
    assert client.refused(lambda: client.registers(TX, 1)) == ILLEGAL_ADDRESS, "nothing is mapped"
    remap(client, 0x3602, [0x606C0020, 0x60410010])
    client.write("6040", 0x06)
    assert client.registers(TX, 3) == (0, 0, client.read("6041"))
    assert client.refused(lambda: client.registers(TX, 4)) == ILLEGAL_ADDRESS
    remap(client, 0x3502, [0x60FF0020])
    client.put(RX, 0xFFFF, 0xFFF6)
    assert client.read("60FF") == -10


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        (0x5FFF0010, 0x06020000),
        (0x60910720, 0x06090011),
        (0x60640010, 0x06040041),
        (0x20300020, 0x06040041),
        (0x00050010, 0x06040041),
        (0x00080020, 0x06020000),
    ],
)
def test_what_cannot_be_mapped_is_refused(client: Client, entry: int, code: int) -> None:
    client.write("3602:00", 0)
    assert client.refused(lambda: client.write("3602:01", entry)) == code


def test_what_is_read_only_cannot_be_received(client: Client) -> None:
    client.write("3502:00", 0)
    assert client.refused(lambda: client.write("3502:01", 0x60410010)) == 0x06040041


def test_more_than_16_entries_are_refused(client: Client) -> None:
    client.write("3602:00", 0)
    assert client.refused(lambda: client.write("3602:00", 17)) == 0x06090031


def test_a_mapping_outlives_a_restart_only_where_it_was_saved(rig: Rig) -> None:
    remap(rig.client, 0x3602, [0x606C0020])
    client = rig.restart()
    assert client.registers(TX, 7)
    remap(client, 0x3602, [0x606C0020])
    client.write("1010:02", 0x65766173)
    client.until(lambda: client.read("1010:02") == 1)
    client = rig.restart()
    assert client.refused(lambda: client.registers(TX, 3)) == ILLEGAL_ADDRESS
    assert client.registers(TX, 2) == (0, 0)


@pytest.mark.parametrize("function", [1, 2, 5, 7, 8, 15, 17, 20, 22, 24, 44, 100, 104, 127])
def test_functions_that_are_not_documented_are_refused(client: Client, function: int) -> None:
    assert client.exchange(bytes((function, 0, 0, 0, 1))) == bytes((function | 0x80, ILLEGAL_FUNCTION))


def test_device_identification_is_not_the_function_43_of_this_drive(client: Client) -> None:
    assert client.exchange(bytes.fromhex("2B 0E 01 00")) == bytes((0xAB, ILLEGAL_FUNCTION))


@pytest.mark.parametrize("pdu", ["10 17 70 00 02 02 00 06", "10 17 70 00 01 02 00", "06 17 70 00", "17 13 88 00 01"])
def test_counts_that_do_not_fit_are_an_illegal_value(client: Client, pdu: str) -> None:
    request = bytes.fromhex(pdu)
    assert client.exchange(request) == bytes((request[0] | 0x80, ILLEGAL_VALUE))
    assert client.read("6040") == 0
