"""A twin behind a real TCP port, with a clock that the test drives, and a client on a plain socket."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from app.model.address import Address, parse_address
from app.model.description_file import load_builtin
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import BOOT_NS, FREE_SHAFT, Pd4e, Settings
from app.twins.pd4e.server import Pd4eServer
from app.twins.pd4e.servo import Bench
from app.wire.modbus.adu import HEADER_SIZE, AduSplitter, Message, decode_adu
from app.wire.modbus.answers import AbortAnswer, Answer, ExceptionAnswer, ObjectRead, RegistersRead, decode_answer
from app.wire.modbus.requests import ReadObject, ReadRegisters, Request, WriteObject, WriteRegisters

MS = 1_000_000
FOREVER = 10**18
TIMEOUT_S = 5.0


class AbortedError(Exception):
    """The device refused with an abort code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{code:08X}h")
        self.code = code


class ExceptionError(Exception):
    """The device refused with an exception code."""

    def __init__(self, code: int) -> None:
        super().__init__(str(code))
        self.code = code


class Clock:
    """Stands until it is moved."""

    def __init__(self) -> None:
        self.now_ns = 1_000 * MS

    def __call__(self) -> int:
        return self.now_ns


class Client:
    """One connection."""

    def __init__(self, address: tuple[str, int], clock: Clock) -> None:
        self.clock = clock
        self.socket = socket.create_connection(address, TIMEOUT_S)
        self._splitter = AduSplitter()
        self._received: list[bytes] = []
        self._transaction = 0

    def close(self) -> None:
        self.socket.close()

    # -- messages ------------------------------------------------------------------------

    def send(self, data: bytes) -> None:
        self.socket.sendall(data)

    def receive(self) -> Message:
        """The next ADU. Raises ConnectionError where the device has closed."""
        while not self._received:
            data = self.socket.recv(65536)
            if not data:
                raise ConnectionError
            self._received += self._splitter.feed(data)
        return decode_adu(self._received.pop(0))

    def exchange(self, pdu: bytes) -> bytes:
        """One request and the PDU of its answer."""
        self._transaction = (self._transaction + 1) % 0x10000
        self.send(Message(self._transaction, 0, pdu).encode())
        answer = self.receive()
        assert (answer.transaction, answer.unit) == (self._transaction, 0)
        return answer.pdu

    def ask(self, request: Request) -> Answer:
        """The answer to a request, refusals raised."""
        answer = decode_answer(self.exchange(request.pdu()), HEADER_SIZE)
        if isinstance(answer, AbortAnswer):
            raise AbortedError(answer.abort_code)
        if isinstance(answer, ExceptionAnswer):
            raise ExceptionError(answer.exception)
        return answer

    # -- objects -------------------------------------------------------------------------

    def raw(self, where: str, size: int) -> bytes:
        answer = self.ask(ReadObject(parse_address(where), size))
        assert isinstance(answer, ObjectRead)
        return answer.data

    def read(self, where: str) -> int:
        """An integer object, signed as it is described."""
        size, signed = shape(where)
        return int.from_bytes(self.raw(where, size), "little", signed=signed)

    def text(self, where: str) -> str:
        return self.raw(where, 200).decode("ascii")

    def write(self, where: str, number: int) -> None:
        size, signed = shape(where)
        self.ask(WriteObject(parse_address(where), number.to_bytes(size, "little", signed=signed)))

    def refused(self, action: Callable[[], object]) -> int:
        """The abort or exception code of what must be refused."""
        try:
            action()
        except (AbortedError, ExceptionError) as error:
            return error.code
        raise AssertionError("it was not refused")

    def registers(self, start: int, quantity: int) -> tuple[int, ...]:
        answer = self.ask(ReadRegisters(start, quantity))
        assert isinstance(answer, RegistersRead)
        return answer.registers

    def put(self, start: int, *registers: int) -> None:
        self.ask(WriteRegisters(start, registers))

    # -- time and the drive --------------------------------------------------------------

    def advance(self, ms: int) -> None:
        """Let time pass; the device gets there before it answers the next request."""
        self.clock.now_ns += ms * MS

    def until(self, condition: Callable[[], bool], timeout_ms: int = 30_000, step_ms: int = 5) -> int:
        """Let time pass until a condition holds; gives how long it took, ms."""
        passed = 0
        while not condition():
            assert passed < timeout_ms, f"not within {timeout_ms} ms; 6041h is {self.read('6041'):04X}h"
            self.advance(step_ms)
            passed += step_ms
        return passed

    def control(self, *words: int) -> int:
        """Write controlwords one after another; gives the statusword after them."""
        for word in words:
            self.write("6040", word)
        return self.read("6041")

    def enable(self, mode: int) -> None:
        """To Operation enabled in a mode."""
        self.write("6060", mode)
        status = self.control(0x06, 0x07, 0x0F)
        assert status & 0x6F == 0x27, f"{status:04X}"

    def has(self, bits: int) -> bool:
        return self.read("6041") & bits == bits

    def stands(self) -> bool:
        return self.read("606C") == 0 and self.read("606B") == 0

    def fault(self) -> bool:
        return self.read("6041") & 0x4F == 0x08


def shape(where: str) -> tuple[int, bool]:
    """Size and sign of an object by the description."""
    kind = load_builtin("nanotec-pd4e").entry(parse_address(where)).type
    assert kind.size is not None
    return kind.size, kind.is_signed


@dataclass
class Rig:
    """A running twin and one client."""

    device: Pd4e
    thread: PacedThread
    server: Pd4eServer
    clock: Clock
    client: Client

    def connect(self) -> Client:
        """Another client."""
        return Client((self.server.host, self.server.port), self.clock)

    def reconnect(self) -> Client:
        """The client after a restart: the old connection is closed by the device, a new one made once it has booted."""
        try:
            self.client.receive()
        except ConnectionError:
            pass
        else:
            raise AssertionError("the device did not close the connection")
        self.client.close()
        self.clock.now_ns += BOOT_NS
        self.client = self.connect()
        return self.client

    def restart(self) -> Client:
        """Restart by 2800h and connect again."""
        self.client.write("2800:01", 0x746F6F62)
        return self.reconnect()


@contextmanager
def running(
    *, variant: str = "pd4-e591", bench: Bench = FREE_SHAFT, state: Path | None = None, nanoj_program: bool = True
) -> Iterator[Rig]:
    """A twin that has booted, served on a free port."""
    clock = Clock()
    settings = Settings(variant=variant, bench=bench, state=state, nanoj_program=nanoj_program)
    device = Pd4e(load_builtin("nanotec-pd4e"), settings)
    device.run_until(BOOT_NS)
    thread = PacedThread(device, clock, max_lag_ns=FOREVER)
    with thread, Pd4eServer(thread, device, port=0) as server:
        client = Client((server.host, server.port), clock)
        rig = Rig(device, thread, server, clock, client)
        try:
            yield rig
            assert thread.handler_errors == 0
        finally:
            rig.client.close()


def address(where: str) -> Address:
    return parse_address(where)
