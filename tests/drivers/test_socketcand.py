"""Our socketcand client against a scripted server: byte splits, traps, ends."""

from __future__ import annotations

import itertools
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing

import can
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.drivers.socketcand import Received, SocketcandBus
from app.wire.frame import Can


class Script:
    """A server for one client at a time that sends what it is told, in the pieces that it is told."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(5)
        self.port: int = self._listener.getsockname()[1]
        self.peer: socket.socket | None = None
        self.thread: threading.Thread | None = None

    def serve(self, *steps: bytes) -> threading.Thread:
        """Take a client and greet it; then answer each element it sends with the next of ``steps``."""

        def run() -> None:
            sock, _ = self._listener.accept()
            self.peer = sock
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            sock.sendall(b"< hi >")
            for step in steps:
                if not self.read_element():
                    return
                sock.sendall(step)

        self.thread = threading.Thread(target=run)
        self.thread.start()
        return self.thread

    def read_element(self) -> bytes:
        """The next element of the client; nothing where it has hung up."""
        assert self.peer is not None
        data = b""
        while not data.endswith(b">"):
            try:
                part = self.peer.recv(1)
            except ConnectionError:
                part = b""
            if not part:
                return b""
            data += part
        return data

    def send(self, data: bytes) -> None:
        assert self.peer is not None
        self.peer.sendall(data)

    def hang_up(self) -> None:
        if self.peer is not None:
            self.peer.close()

    def close(self) -> None:
        self.hang_up()
        self._listener.close()
        if self.thread is not None:
            self.thread.join(5)


@pytest.fixture
def script() -> Iterator[Script]:
    with closing(Script()) as script:
        yield script


def connect(script: Script, *steps: bytes, timeout_s: float = 5.0) -> SocketcandBus:
    thread = script.serve(*(steps or (b"< ok >", b"< ok >")))
    bus = SocketcandBus("can0", "127.0.0.1", script.port, timeout_s)
    thread.join(5)
    return bus


def collect(bus: SocketcandBus, count: int) -> list[Received]:
    frames: list[Received] = []
    deadline = time.monotonic() + 5
    while len(frames) < count:
        assert time.monotonic() < deadline
        frames += bus.recv_many(0.1)
    return frames


def test_frames_in_the_read_of_the_last_ok_are_kept(script: Script) -> None:
    with connect(script, b"< ok >", b"< ok >< frame 181 1.5 0102 >< frame 080 2.000001  >") as bus:
        assert collect(bus, 2) == [
            (Can(0x181, b"\x01\x02"), 1_500_000_000),
            (Can(0x080), 2_000_001_000),
        ]


def test_all_kinds_of_frames(script: Script) -> None:
    with connect(script) as bus:
        script.send(
            b"< frame 000 0.000000 >< frame 12345678 1700000000.123456 AABBCCDDEEFF0011 >"
            b"< rtr 701 3.0 1 >< rtr 00000701 3.0 0 >< error 004 4.25 >< frame 00000001 5.0 ff >"
        )
        assert collect(bus, 6) == [
            (Can(0), 0),
            (Can(0x12345678, bytes.fromhex("AABBCCDDEEFF0011"), extended=True), 1_700_000_000_123_456_000),
            (Can(0x701, remote=True, dlc=1), 3_000_000_000),
            (Can(0x701, extended=True, remote=True, dlc=0), 3_000_000_000),
            (Can(4, error=True), 4_250_000_000),
            (Can(1, b"\xff", extended=True), 5_000_000_000),
        ]


def test_messages_for_python_can(script: Script) -> None:
    with connect(script) as bus:
        script.send(b"< frame 181 1.5 0102 >< rtr 701 3.0 1 >")
        message, remote = bus.recv(5), bus.recv(5)
        assert bus.recv(0.01) is None
    assert message is not None
    assert remote is not None
    assert (message.arbitration_id, bytes(message.data), message.timestamp) == (0x181, b"\x01\x02", 1.5)
    assert (message.is_extended_id, message.is_rx, message.channel) == (False, True, "can0")
    assert (remote.is_remote_frame, remote.dlc, bytes(remote.data)) == (True, 1, b"")


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.integers(1, 200), max_size=8), st.data())
def test_elements_split_anyhow(cuts: list[int], data: st.DataObject) -> None:
    frames = data.draw(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), min_size=1, max_size=8))
    text = b"".join(b"< frame %03X 1.000000 %s >" % (can_id, body.hex().upper().encode()) for can_id, body in frames)
    edges = sorted({min(cut, len(text)) for cut in cuts} | {0, len(text)})
    with closing(Script()) as script, connect(script) as bus:
        got: list[Received] = []
        for start, end in itertools.pairwise(edges):
            script.send(text[start:end])
            got += bus.recv_many(1.0)
        got += collect(bus, len(frames) - len(got))
    assert [frame for frame, _ in got] == [Can(can_id, body) for can_id, body in frames]


def test_what_is_sent(script: Script) -> None:
    with connect(script) as bus:
        assert script.read_element() == b"< echo >"
        bus.send(can.Message(arbitration_id=0x601, data=b"\x40\x00\x0a", is_extended_id=False))
        bus.send(can.Message(arbitration_id=0x601, data=b"\x01", is_extended_id=True))
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))
        bus.send(can.Message(arbitration_id=0x701, is_remote_frame=True, dlc=1, is_extended_id=False))
        bus.send_frame(Can(0x1, remote=True, dlc=8, extended=True))
        assert [script.read_element() for _ in range(5)] == [
            b"< send 601 3 40 00 0a >",
            b"< send 00000601 1 01 >",
            b"< send 080 0  >",
            b"< sendrtr 701 1 >",
            b"< sendrtr 00000001 8 >",
        ]
        with pytest.raises(can.CanOperationError):
            bus.send(can.Message(is_error_frame=True))


def test_end_of_connection_raises_again_and_again(script: Script) -> None:
    with connect(script) as bus:
        assert script.read_element() == b"< echo >"
        script.send(b"< frame 181 1.5 01 >")
        script.hang_up()
        assert bus.recv(5) is not None
        for _ in range(3):
            with pytest.raises(can.CanOperationError):
                bus.recv(1)


def test_sending_into_a_cut_connection_raises(script: Script) -> None:
    with connect(script) as bus:
        script.hang_up()
        deadline = time.monotonic() + 5
        with pytest.raises(can.CanOperationError):
            while time.monotonic() < deadline:
                bus.send_frame(Can(1, bytes(8)))


def test_rubbish_is_counted_and_skipped(script: Script) -> None:
    with connect(script) as bus:
        script.send(b"< frame xyz 1.0 01 >< frame 181 >< frame 181 1.0 010 >rubbish>< frame 1 1.0 112233445566778899 >")
        script.send(b"< error unknown command >< frame 182 1.0 02 >")
        assert collect(bus, 1) == [(Can(0x182, b"\x02"), 1_000_000_000)]
        assert bus.malformed == 5


def test_an_element_without_end_is_no_socketcand(script: Script) -> None:
    with connect(script) as bus:
        script.send(b"x" * 1000)
        deadline = time.monotonic() + 5
        with pytest.raises(can.CanOperationError, match="without end"):
            while time.monotonic() < deadline:
                bus.recv_many(1)


@pytest.mark.parametrize(
    "steps, reason",
    [
        ((b"< error could not open bus >",), "could not open bus"),
        ((b"< ok >", b"< error unknown command >"), "unknown command"),
        ((b"", b""), "in time"),
    ],
)
def test_handshake_that_fails(script: Script, steps: tuple[bytes, ...], reason: str) -> None:
    with pytest.raises(can.CanInitializationError, match=reason):
        connect(script, *steps, timeout_s=0.3)


def test_no_server() -> None:
    with closing(socket.create_server(("127.0.0.1", 0))) as sock:
        port = sock.getsockname()[1]
    before = time.monotonic()
    with pytest.raises(can.CanInitializationError):
        SocketcandBus("can0", "127.0.0.1", port, 1.0)
    assert time.monotonic() - before < 3
