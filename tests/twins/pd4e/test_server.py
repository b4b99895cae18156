"""The TCP side: requests split and joined, several clients, what ends a connection."""

from __future__ import annotations

import random
import threading

import pytest

from app.model.address import parse_address
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import ObjectRead, decode_answer
from app.wire.modbus.functions import Phase
from app.wire.modbus.requests import ReadDictionary, ReadObject, ReadRegisters, WriteObject
from tests.twins.pd4e.rig import Client, Rig

READ = ReadObject(parse_address("6041"), 2).pdu()


def test_transaction_and_unit_come_back_as_they_were_sent(client: Client) -> None:
    for transaction, unit in ((0, 0), (1, 1), (0xFFFF, 0xFF), (0x1234, 17)):
        client.send(Message(transaction, unit, READ).encode())
        answer = client.receive()
        assert (answer.transaction, answer.unit) == (transaction, unit)


def test_requests_in_one_segment_are_answered_in_their_order(client: Client) -> None:
    words = [0x06, 0x07, 0x0F]
    requests = [WriteObject(parse_address("6040"), word.to_bytes(2, "little")).pdu() for word in words]
    client.send(b"".join(Message(place, 0, pdu).encode() for place, pdu in enumerate([*requests, READ])))
    answers = [client.receive() for _ in range(4)]
    assert [answer.transaction for answer in answers] == [0, 1, 2, 3]
    last = decode_answer(answers[3].pdu)
    assert isinstance(last, ObjectRead)
    assert int.from_bytes(last.data, "little") & 0x6F == 0x27, "each word was obeyed"


def test_a_request_in_single_bytes_is_answered_when_it_is_whole(client: Client) -> None:
    message = Message(7, 0, READ).encode()
    for place in range(len(message)):
        client.send(message[place : place + 1])
    assert client.receive().transaction == 7


def test_any_cut_of_a_stream_gives_the_same_answers(rig: Rig) -> None:
    source = random.Random(5)
    pdus = [READ, ReadRegisters(5000, 7).pdu(), b"\x01\0\0\0\1", ReadDictionary(Phase.START).pdu()]
    stream = b"".join(Message(number, 0, source.choice(pdus)).encode() for number in range(60))
    whole = rig.connect()
    whole.send(stream)
    wanted = [whole.receive() for _ in range(60)]
    whole.close()
    for _ in range(5):
        client = rig.connect()
        place = 0
        while place < len(stream):
            size = source.randint(1, 40)
            client.send(stream[place : place + size])
            place += size
        assert [client.receive() for _ in range(60)] == wanted
        client.close()


@pytest.mark.parametrize(
    "garbage",
    [
        "00 01 00 01 00 06 00 03 13 88 00 01",
        "00 01 00 00 00 00 00",
        "00 01 00 00 00 01 00",
        "00 01 00 00 FF FF 00 03",
        "47 45 54 20 2F 20 48 54 54 50",
    ],
)
def test_what_is_no_modbus_ends_the_connection_and_no_other(rig: Rig, garbage: str) -> None:
    other = rig.connect()
    rig.client.send(Message(1, 0, READ).encode() + bytes.fromhex(garbage))
    assert rig.client.receive().transaction == 1, "what came before is answered"
    with pytest.raises(ConnectionError):
        rig.client.receive()
    assert other.read("6061") == 0
    other.close()


def test_several_clients_at_once_each_get_their_own_answers(rig: Rig) -> None:
    wrong: list[str] = []

    def ask(number: int) -> None:
        client = rig.connect()
        for turn in range(60):
            client.write(f"2400:{number:02X}", number * 1000 + turn)
            found = client.read(f"2400:{number:02X}")
            if found != number * 1000 + turn:
                wrong.append(f"{number}: {found}")
        client.close()

    threads = [threading.Thread(target=ask, args=(number,)) for number in range(1, 9)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert not any(thread.is_alive() for thread in threads)
    assert wrong == []


def test_a_client_that_vanishes_leaves_the_rest_alone(rig: Rig) -> None:
    for _ in range(5):
        other = rig.connect()
        other.send(Message(1, 0, READ).encode()[:9])
        other.close()
    assert rig.client.read("6061") == 0


def test_only_so_many_clients_are_taken_and_room_is_made_again(rig: Rig) -> None:
    others = [rig.connect() for _ in range(15)]
    for other in others:
        assert other.read("6061") == 0
    surplus = rig.connect()
    with pytest.raises(ConnectionError):
        surplus.exchange(READ)
    surplus.close()
    others.pop().close()
    assert rig.client.read("6061") == 0
    again = rig.connect()
    assert again.read("6061") == 0
    again.close()
    for other in others:
        other.close()


def test_what_one_client_writes_another_reads(rig: Rig) -> None:
    other = rig.connect()
    rig.client.write("6081", 123)
    assert other.read("6081") == 123
    other.close()


def test_a_restart_ends_every_connection(rig: Rig) -> None:
    other = rig.connect()
    other.read("6061")
    rig.client.write("2800:01", 0x746F6F62)
    with pytest.raises(ConnectionError):
        other.receive()
    other.close()
    assert rig.reconnect().read("6061") == 0


def test_time_stands_where_nobody_moves_it(rig: Rig) -> None:
    """Two runs of the same requests at the same times end alike, to the last bit."""
    client = rig.client
    client.enable(3)
    client.write("60FF", 100)
    client.advance(777)
    first = [client.read(where) for where in ("6064", "606C", "6077")]
    assert [client.read(where) for where in ("6064", "606C", "6077")] == first
