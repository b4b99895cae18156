"""The socketcand server, with python-can's own client and with plain sockets."""

from __future__ import annotations

import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing

import can
import pytest

from app.twins.line import CanLine, Port
from app.twins.line_thread import LineThread
from app.twins.socketcand_server import SocketcandServer, frame_element
from app.wire.can_bits import frame_bits
from app.wire.frame import Can


class Bench:
    """A line in real time with one node on it, served."""

    def __init__(self) -> None:
        self.line = CanLine(500_000)
        self.got: list[Can] = []
        self.arrived = threading.Condition()
        self.node: Port = self.line.attach(self._on_frame)
        self.thread = LineThread(self.line)
        self.server = SocketcandServer(self.thread)

    def _on_frame(self, frame: Can, _t_ns: int) -> None:
        with self.arrived:
            self.got.append(frame)
            self.arrived.notify_all()

    def send(self, *frames: Can) -> None:
        for frame in frames:
            self.thread.call_soon(lambda frame=frame: self.node.send(frame))  # type: ignore[misc]

    def wait_for(self, condition: Callable[[], bool], timeout_s: float = 5.0) -> None:
        with self.arrived:
            assert self.arrived.wait_for(condition, timeout_s)


@pytest.fixture
def bench() -> Iterator[Bench]:
    bench = Bench()
    with bench.thread, bench.server:
        yield bench


def stock(bench: Bench) -> can.BusABC:
    return can.Bus(interface="socketcand", host=bench.server.host, port=bench.server.port, channel="can0")


def raw(bench: Bench) -> socket.socket:
    """A plain client that has passed the handshake."""
    sock = socket.create_connection((bench.server.host, bench.server.port), timeout=5)
    assert read(sock, 6) == b"< hi >"
    sock.sendall(b"< open can0 >")
    assert read(sock, 6) == b"< ok >"
    sock.sendall(b"< rawmode >")
    assert read(sock, 6) == b"< ok >"
    sock.sendall(b"< echo >")
    assert read(sock, 8) == b"< echo >"
    return sock


def read(sock: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        part = sock.recv(size - len(data))
        assert part, data
        data += part
    return data


def elements(sock: socket.socket, count: int) -> list[list[str]]:
    data = b""
    while data.count(b">") < count:
        part = sock.recv(65536)
        assert part, data
        data += part
    return [element.split()[1:] for element in data.decode().split(">")[:count]]


def test_stock_client_receives(bench: Bench) -> None:
    frames = [Can(0x181, b"\x01\x02\xff"), Can(0x000), Can(0x12345678, b"\xaa", extended=True), Can(0x7FF, bytes(8))]
    with stock(bench) as bus:
        before = time.time()
        bench.send(*frames)
        got = {message.arbitration_id: message for message in (bus.recv(5) for _ in frames) if message}
    assert len(got) == len(frames)
    for frame in frames:
        message = got[frame.can_id]
        assert (bytes(message.data), message.dlc) == (frame.data, len(frame.data))
        assert message.is_extended_id == frame.extended
        assert before - 0.1 < message.timestamp < time.time() + 0.1


def test_stock_client_sends_and_gets_no_echo(bench: Bench) -> None:
    with stock(bench) as bus:
        bus.send(can.Message(arbitration_id=0x601, data=[0x40, 0, 0x10, 0, 0, 0, 0, 0], is_extended_id=False))
        bus.send(can.Message(arbitration_id=0x12345, data=[0x0F], is_extended_id=True))
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        bus.send(can.Message(arbitration_id=0x701, is_remote_frame=True, dlc=1, is_extended_id=False))
        bench.wait_for(lambda: len(bench.got) == 4)
        bench.send(Can(0x123))
        message = bus.recv(5)
    assert bench.got == [
        Can(0x601, bytes([0x40, 0, 0x10, 0, 0, 0, 0, 0])),
        Can(0x12345, b"\x0f", extended=True),
        Can(0x80),
        Can(0x701, remote=True, dlc=1),
    ]
    assert message is not None
    assert message.arbitration_id == 0x123


def test_stock_clients_connect_while_the_line_is_full_and_see_each_other(bench: Bench) -> None:
    stop = threading.Event()

    def flood(t_ns: int) -> None:
        if bench.node.pending < 3:
            bench.node.send(Can(0x700, bytes(8)), t_ns)
        if not stop.is_set():
            bench.line.call_at(t_ns + 100_000, flood)

    bench.thread.call_soon(lambda: flood(bench.line.now_ns))
    for _ in range(5):
        with stock(bench) as one, stock(bench) as two:
            one.send(can.Message(arbitration_id=0x123, data=b"x", is_extended_id=False))
            deadline = time.monotonic() + 5
            while (message := two.recv(1)) is None or message.arbitration_id != 0x123:
                assert time.monotonic() < deadline
    stop.set()


def test_commands_and_their_errors(bench: Bench) -> None:
    with closing(socket.create_connection((bench.server.host, bench.server.port), timeout=5)) as sock:
        assert elements(sock, 1) == [["hi"]]
        for command, answer in (
            (b"< rawmode >", "error unknown command"),
            (b"< open vcan7 >", "error could not open bus"),
            (b"< open can0 >", "ok"),
            (b"< echo >", "echo"),
            (b"< dance >", "error unknown command"),
            (b"nonsense>", "error unknown command"),
            (b"< rawmode >", "ok"),
            (b"< send 123 9 0 0 0 0 0 0 0 0 0 >", "error unknown frame format"),
            (b"< send 123 2 1 >", "error unknown frame format"),
            (b"< send 800 0 >", "error unknown frame format"),
            (b"< send xyz 0 >", "error unknown frame format"),
            (b"< send 123 1 100 >", "error unknown frame format"),
            (b"< send >", "error unknown frame format"),
        ):
            sock.sendall(command)
            assert " ".join(elements(sock, 1)[0]) == answer
    assert bench.got == []


def test_commands_split_and_joined_anyhow(bench: Bench) -> None:
    with closing(raw(bench)) as sock:
        for byte in b"< send 181 2 a 0B >< sendrtr 00000005 3 >":
            sock.sendall(bytes([byte]))
        sock.sendall(b"< send 1 0 >< send 2 0  >")
        bench.wait_for(lambda: len(bench.got) == 4)
    assert bench.got == [Can(0x181, b"\x0a\x0b"), Can(5, extended=True, remote=True, dlc=3), Can(1), Can(2)]


def test_remote_and_empty_frames_in_text(bench: Bench) -> None:
    assert frame_element(Can(0x80), 1_700_000_000_000_001_999) == b"< frame 080 1700000000.000001  >"
    assert frame_element(Can(0x1, b"\xab", extended=True), 10**9) == b"< frame 00000001 1.000000 AB >"
    assert frame_element(Can(0x4, error=True), 10**9) == b"< error 004 1.000000 >"
    with closing(raw(bench)) as sock:
        bench.send(Can(0x701, remote=True, dlc=1))
        (element,) = elements(sock, 1)
    assert (element[:2], element[3]) == (["rtr", "701"], "1")


def test_line_time_orders_a_client_among_the_others(bench: Bench) -> None:
    with closing(raw(bench)) as one, closing(raw(bench)) as two:
        one.sendall(b"".join(b"< send %03X 1 %X >" % (can_id, can_id & 0xFF) for can_id in range(0x400, 0x300, -1)))
        got = elements(two, 256)
    assert [int(element[1], 16) for element in got] == list(range(0x400, 0x300, -1))
    times = [float(element[2]) for element in got]
    assert times == sorted(times)
    bits = sum(frame_bits(Can(can_id, bytes([can_id & 0xFF]))) for can_id in range(0x3FF, 0x300, -1))
    assert times[-1] - times[0] >= bits / 500_000 - 2e-6


def test_a_client_that_floods_is_slowed_and_loses_nothing(bench: Bench) -> None:
    count = 3000
    with closing(raw(bench)) as sock:
        for number in range(count):
            sock.sendall(f"< send 100 2 {number >> 8:X} {number & 255:X} >".encode())
        bench.wait_for(lambda: len(bench.got) == count, 20)
    assert [int.from_bytes(frame.data, "big") for frame in bench.got] == list(range(count))


def test_a_client_that_does_not_read_is_dropped_and_others_are_not(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    bench.server.out_limit_bytes = 20_000
    caplog.set_level(logging.WARNING, "app.twins.socketcand_server")
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
    deaf.connect((bench.server.host, bench.server.port))
    deaf.sendall(b"< open can0 >< rawmode >< echo >")
    with closing(deaf), closing(raw(bench)) as good:
        bench.send(Can(1))
        assert elements(good, 1)[0][1] == "001"
        # What the system's own buffers take is not ours to know: go on until the client is gone.
        got = 0
        deadline = time.monotonic() + 60
        while bench.server.dropped_clients == 0:
            assert time.monotonic() < deadline
            bench.send(*(Can(0x300, bytes(8)) for _ in range(200)))
            got += len(elements(good, 200))
        assert got > 0
    assert "does not read" in caplog.text


def test_there_is_a_limit_of_clients(bench: Bench) -> None:
    with ExitStack() as stack:
        address = (bench.server.host, bench.server.port)
        clients = [stack.enter_context(closing(socket.create_connection(address, timeout=5))) for _ in range(65)]
        assert [client.recv(6) for client in clients[:64]] == [b"< hi >"] * 64
        assert clients[64].recv(6) == b""


def test_disconnect_leaves_the_line(bench: Bench) -> None:
    sock = raw(bench)
    sock.close()
    deadline = time.monotonic() + 5
    while bench.line.nodes > 1:
        assert time.monotonic() < deadline
    bench.send(Can(1))
    with closing(raw(bench)) as other:
        bench.send(Can(2))
        assert elements(other, 1)[0][1] in ("001", "002")


def test_stop_closes_all_and_is_repeatable() -> None:
    bench = Bench()
    with bench.thread:
        with bench.server, closing(raw(bench)) as sock:
            bench.server.stop()
            assert sock.recv(10) == b""
        with pytest.raises(OSError):
            socket.create_connection((bench.server.host, bench.server.port), timeout=1).close()
    bench.server.stop()
