"""The SDO client of the masters on a line: order, refusals, silence, and other people's answers."""

from __future__ import annotations

from app.model.address import Address
from app.twins.line import CanLine
from app.twins.sdo_client import SdoClient
from app.wire import sdo
from app.wire.frame import Can

NODE = 5
SPEED, MODE = Address(0x6081), Address(0x6060)
MS = 1_000_000


class Rig:
    """A client, and a server that answers what the test lets it."""

    def __init__(self) -> None:
        self.line = CanLine(500_000)
        self.requests: list[bytes] = []
        self.server = self.line.attach(lambda can, _t_ns: self.requests.append(can.data), [sdo.REQUEST_BASE + NODE])
        port = self.line.attach(lambda can, _t_ns: self.client.response(can), [sdo.RESPONSE_BASE + NODE])
        self.client = SdoClient(self.line, port, timeout_ns=100 * MS)
        self.told: list[tuple[str, bytes | None]] = []

    def read(self, name: str, address: Address) -> None:
        self.client.read(NODE, address, lambda data: self.told.append((name, data)))

    def write(self, name: str, address: Address, data: bytes) -> None:
        self.client.write(NODE, address, data, lambda answer: self.told.append((name, answer)))

    def answer(self, data: bytes) -> None:
        self.server.send(Can(sdo.RESPONSE_BASE + NODE, data))
        self.run(2)

    def run(self, ms: int) -> None:
        self.line.run_until(self.line.now_ns + ms * MS)


def test_one_after_the_other_in_order() -> None:
    rig = Rig()
    rig.write("first", MODE, b"\x08")
    rig.read("second", SPEED)
    assert not rig.client.idle(NODE)
    rig.run(2)
    assert rig.requests == [sdo.download_request(MODE, b"\x08")]
    rig.answer(sdo.download_response(MODE))
    assert rig.requests[1:] == [sdo.upload_request(SPEED)]
    rig.answer(sdo.upload_response(SPEED, b"\x20\x03\0\0"))
    assert rig.told == [("first", b""), ("second", b"\x20\x03\0\0")]
    assert rig.client.idle(NODE)


def test_a_refusal_and_silence_both_end_without_a_value() -> None:
    rig = Rig()
    rig.write("refused", MODE, b"\x63")
    rig.run(2)
    rig.answer(sdo.abort(MODE, sdo.Abort.VALUE_RANGE))
    assert rig.told == [("refused", None)]
    rig.read("late", SPEED)
    rig.run(99)
    assert rig.told == [("refused", None)]
    rig.run(3)
    assert rig.told[1:] == [("late", None)]
    assert rig.requests[-1] == sdo.abort(SPEED, sdo.Abort.TIMED_OUT)


def test_an_answer_that_comes_too_late_is_not_that_of_the_next_request() -> None:
    rig = Rig()
    rig.read("late", SPEED)
    rig.run(110)
    rig.read("next", MODE)
    rig.run(2)
    rig.answer(sdo.upload_response(SPEED, b"\x01\0\0\0"))
    assert rig.told == [("late", None)]
    rig.answer(sdo.upload_response(MODE, b"\x08"))
    assert rig.told == [("late", None), ("next", b"\x08")]


def test_answers_to_other_masters_are_not_taken() -> None:
    rig = Rig()
    rig.answer(sdo.upload_response(SPEED, b"\x01\0\0\0"))
    rig.write("mine", SPEED, b"\x20\x03\0\0")
    rig.run(2)
    rig.answer(sdo.upload_response(SPEED, b"\x01\0\0\0"))  # somebody else has read the same object
    assert rig.told == []
    rig.answer(sdo.download_response(SPEED))
    assert rig.told == [("mine", b"")]


def test_what_is_dropped_is_never_told() -> None:
    rig = Rig()
    rig.read("first", SPEED)
    rig.read("second", MODE)
    rig.run(2)
    rig.client.drop(NODE)
    assert rig.client.idle(NODE)
    rig.answer(sdo.upload_response(SPEED, b"\x01\0\0\0"))
    rig.run(300)
    assert rig.told == []
