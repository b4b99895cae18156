"""The receive thread of a CAN bus: on our socketcand server, on python-can's virtual bus, on slcan over a pty."""

from __future__ import annotations

import itertools
import os
import select
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import can
import pytest

from app.drivers.can_config import CanConfig, CanInterface, parse_can
from app.drivers.can_port import CanPort, PortState, PortStatus, Timer
from app.drivers.slcan import format_line, parse_line
from app.drivers.socketcan import SocketcanLink
from app.drivers.socketcand import Received
from app.errors import BusLostError, BusOpenError, RefusedError
from app.twins.line import CanLine
from app.twins.line_thread import LineThread
from app.twins.socketcand_server import SocketcandServer
from app.wire.frame import STAMP_STEP_NS, Can, Direction, Frame, Stamper


class Witness:
    """A port's listener that remembers, and can be waited for."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.states: list[PortStatus] = []
        self.threads: set[int] = set()
        self._changed = threading.Condition()

    def on_frames(self, frames: list[Frame]) -> None:
        with self._changed:
            self.frames += frames
            self.threads.add(threading.get_ident())
            self._changed.notify_all()

    def on_status(self, status: PortStatus) -> None:
        with self._changed:
            self.states.append(status)
            self._changed.notify_all()

    def wait_for(self, condition: Callable[[], bool], timeout_s: float = 5.0) -> None:
        with self._changed:
            assert self._changed.wait_for(condition, timeout_s), (self.frames[-5:], self.states)

    def wait_for_state(self, state: PortState, timeout_s: float = 5.0) -> PortStatus:
        self.wait_for(lambda: bool(self.states) and self.states[-1].state is state, timeout_s)
        return self.states[-1]

    def received(self, direction: Direction = Direction.RX) -> list[Can]:
        return [frame.payload for frame in self.frames if frame.direction is direction]  # type: ignore[misc]


def port_for(config: CanConfig, witness: Witness) -> CanPort:
    stamper = Stamper(time.time_ns(), time.monotonic_ns)
    return CanPort(config, "can0", stamper, witness.on_frames, witness.on_status)


class Bench:
    """A served line with an echo node (600h + n is answered on 580h + n), and a port on it."""

    def __init__(self, stack: ExitStack) -> None:
        self.line = CanLine(1_000_000)
        self.node = self.line.attach(self._answer)
        self.thread = stack.enter_context(LineThread(self.line))
        self.server = SocketcandServer(self.thread)
        self.server.start()
        stack.callback(self.stop_server)
        self.config = parse_can(f"socketcand:127.0.0.1:{self.server.port}")
        self.witness = Witness()
        self.port = port_for(self.config, self.witness)
        stack.callback(self.port.close)

    def _answer(self, frame: Can, t_ns: int) -> None:
        if 0x600 < frame.can_id < 0x680:
            self.node.send(Can(frame.can_id - 0x80, frame.data), t_ns)

    def send(self, *frames: Can) -> None:
        for frame in frames:
            self.thread.call_soon(lambda frame=frame: self.node.send(frame))  # type: ignore[misc]

    def stop_server(self) -> None:
        self.server.stop()

    def restart_server(self) -> None:
        self.server = SocketcandServer(self.thread, port=self.server.port)
        self.server.start()


@pytest.fixture
def bench() -> Iterator[Bench]:
    with ExitStack() as stack:
        bench = Bench(stack)
        bench.port.open()
        yield bench


def test_both_directions_in_order_on_one_thread(bench: Bench) -> None:
    sent = [Can(0x601, bytes([number])) for number in range(100)]
    for frame in sent:
        bench.port.send(frame)
    witness = bench.witness
    witness.wait_for(lambda: len(witness.frames) == 200)
    assert witness.received(Direction.TX) == sent
    assert witness.received() == [Can(0x581, frame.data) for frame in sent]
    assert all(a.t_ns < b.t_ns for a, b in itertools.pairwise(witness.frames))
    for number, frame in enumerate(sent):
        asked = next(seen.t_ns for seen in witness.frames if seen.payload == frame)
        answered = next(seen.t_ns for seen in witness.frames if seen.payload == Can(0x581, bytes([number])))
        assert asked < answered
    assert len(witness.threads) == 1
    stats = bench.port.stats
    assert (stats.received, stats.sent, stats.dropped, stats.listener_errors) == (100, 100, 0, 0)


def test_adapter_time_and_kinds_of_frames(bench: Bench) -> None:
    frames = [Can(0x181, b"\x01"), Can(0), Can(0x1ABCDEF0, b"\x02", extended=True), Can(0x701, remote=True, dlc=1)]
    bench.send(*frames)
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 4)
    assert sorted(bench.witness.received()) == sorted(frames)
    for frame in bench.witness.frames:
        assert frame.t_adapter_ns is not None
        assert abs(frame.t_adapter_ns - frame.t_ns) < 5_000_000_000
    bench.port.send(Can(0x702, remote=True, dlc=0))
    bench.witness.wait_for(lambda: Can(0x702, remote=True, dlc=0) in bench.witness.received(Direction.TX))


def test_many_senders_keep_one_order(bench: Bench) -> None:
    def send(number: int) -> None:
        for _ in range(100):
            bench.port.send(Can(0x601 + number))

    threads = [threading.Thread(target=send, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10)
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 800)
    times = [frame.t_ns for frame in bench.witness.frames]
    assert times == sorted(times)


def test_a_listener_sends_on_the_receive_thread(bench: Bench) -> None:
    count = itertools.count(1)

    def engine(frames: list[Frame]) -> None:
        for frame in frames:
            if frame.direction is Direction.RX and (number := next(count)) < 50:
                bench.port.send(Can(0x601, bytes([number])))

    bench.port.add_listener(engine, first=True)
    bench.port.send(Can(0x601, b"\x00"))
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 100)
    assert [frame.data[0] for frame in bench.witness.received()] == list(range(50))
    directions = [frame.direction for frame in bench.witness.frames]
    assert directions == [Direction.TX, Direction.RX] * 50


def test_a_listener_that_raises_ends_nothing(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    def broken(_frames: list[Frame]) -> None:
        raise RuntimeError("broken listener")

    bench.port.add_listener(broken, first=True)
    for number in range(10):
        bench.port.send(Can(0x601, bytes([number])))
    bench.witness.wait_for(lambda: len(bench.witness.received()) == 10)
    assert bench.port.stats.listener_errors > 0
    assert "broken listener" in caplog.text
    bench.port.remove_listener(broken)
    bench.port.call_soon(lambda: broken([]))
    bench.port.send(Can(0x601))
    bench.witness.wait_for(lambda: len(bench.witness.received()) == 11)
    assert bench.port.status.state is PortState.CONNECTED


def test_calls_and_timers_on_the_receive_thread(bench: Bench) -> None:
    calls: list[tuple[str, int]] = []
    timers: list[Timer] = []
    done = threading.Event()

    def note(name: str) -> Callable[[], None]:
        return lambda: calls.append((name, threading.get_ident()))

    now_ns = time.monotonic_ns()
    bench.port.call_at(now_ns + 60_000_000, note("third"))
    bench.port.call_at(now_ns + 40_000_000, note("second"))
    bench.port.call_at(now_ns + 50_000_000, note("never")).cancel()
    bench.port.call_later(0.08, done.set)
    bench.port.call_soon(note("first"))
    bench.port.call_soon(lambda: timers.append(bench.port.call_later(0.07, note("fourth"))))
    assert done.wait(5)
    assert time.monotonic_ns() - now_ns >= 80_000_000
    names = [name for name, _ in calls]
    assert names[:3] == ["first", "second", "third"]
    assert "never" not in names
    assert len({thread for _, thread in calls}) == 1
    assert calls[0][1] != threading.get_ident()


def test_gathering_makes_fewer_batches_and_delays_no_call(bench: Bench) -> None:
    batches: list[int] = []
    bench.port.add_listener(lambda frames: batches.append(len(frames)))
    bench.port.gather_s = 0.05
    bench.send(*(Can(0x181, bytes(8)) for _ in range(500)))
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 500)
    # 500 frames take about 60 ms of the line: a batch for each of them would be 500.
    assert len(batches) <= 20
    bench.port.gather_s = 30.0
    bench.send(Can(0x182))
    bench.witness.wait_for(lambda: Can(0x182) in bench.witness.received())
    called = threading.Event()
    bench.port.call_soon(called.set)
    assert called.wait(5)


def test_frames_that_were_gathered_keep_the_distances_they_had_on_the_bus(bench: Bench) -> None:
    bench.send(Can(0x180))
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 1)
    bench.port.gather_s = 0.05
    bench.send(Can(0x181))  # the wait begins behind it
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 2)
    bench.send(*(Can(0x182, bytes([number])) for number in range(100)))
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 102)
    gathered = bench.witness.frames[2:]
    pairs = [
        (later.t_ns - frame.t_ns, later.t_adapter_ns - frame.t_adapter_ns)
        for frame, later in itertools.pairwise(gathered)
        if later.t_adapter_ns is not None and frame.t_adapter_ns is not None
    ]
    alike = sum(1 for ours_ns, adapter_ns in pairs if abs(ours_ns - adapter_ns) <= 2000)
    assert alike >= 0.9 * len(gathered)  # all but those at the seams of batches


def test_an_adapter_whose_clock_was_set_does_not_tell_distances(bench: Bench) -> None:
    received: list[Received] = [(Can(1), 9_000_000_000), (Can(2), 1_000_000_000), (Can(3), 1_000_100_000)]
    bench.port.call_soon(lambda: bench.port._hand_over(received))
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 3)
    first, second, third = (frame.t_ns for frame in bench.witness.frames)
    assert second - first == third - second == STAMP_STEP_NS


def test_a_cut_connection_comes_back_and_the_gap_is_told(bench: Bench) -> None:
    bench.send(Can(1))
    bench.witness.wait_for(lambda: len(bench.witness.frames) == 1)
    bench.server.stop()
    lost = bench.witness.wait_for_state(PortState.LOST)
    assert lost.reason
    assert lost.lost_since_ns == lost.t_ns
    with pytest.raises(BusLostError) as caught:
        bench.port.send(Can(2))
    assert caught.value.details["bus"] == "can0"
    fired = threading.Event()
    bench.port.call_later(0.05, fired.set)
    assert fired.wait(5)
    assert bench.port.status.state is PortState.LOST
    bench.restart_server()
    back_at = time.monotonic()
    back = bench.witness.wait_for_state(PortState.CONNECTED)
    assert time.monotonic() - back_at < 2
    assert back.lost_since_ns == lost.t_ns
    assert back.t_ns > lost.t_ns
    bench.port.send(Can(0x601, b"again"))
    bench.witness.wait_for(lambda: Can(0x581, b"again") in bench.witness.received())
    assert bench.port.stats.reconnects == 1
    assert all(a.t_ns < b.t_ns for a, b in itertools.pairwise(bench.witness.frames))


def test_it_comes_back_every_time(bench: Bench) -> None:
    for round_number in range(3):
        bench.server.stop()
        bench.witness.wait_for_state(PortState.LOST)
        bench.restart_server()
        bench.witness.wait_for_state(PortState.CONNECTED)
        assert bench.port.stats.reconnects == round_number + 1


def test_closing_while_lost(bench: Bench) -> None:
    bench.server.stop()
    bench.witness.wait_for_state(PortState.LOST)
    bench.port.close()
    assert bench.port.status.state is PortState.CLOSED
    assert not [thread for thread in threading.enumerate() if thread.name.startswith(("can-can0", "can-open"))]
    with pytest.raises(BusLostError):
        bench.port.send(Can(1))


def test_listen_only_sends_nothing(bench: Bench) -> None:
    bench.port.set_listen_only(True)
    with pytest.raises(RefusedError):
        bench.port.send(Can(0x601))
    bench.port.set_listen_only(False)
    bench.port.send(Can(0x601))
    bench.witness.wait_for(lambda: Can(0x581) in bench.witness.received())


@pytest.mark.parametrize("text", ["socketcand:127.0.0.1:1", "slcan:/dev/no-such-adapter", "socketcan:no-such-can"])
def test_an_adapter_that_is_not_there(text: str) -> None:
    port = port_for(parse_can(text), Witness())
    with pytest.raises(BusOpenError) as caught:
        port.open(1.0)
    assert caught.value.details["bus"] == "can0"
    assert caught.value.details["reason"]
    port.close()


def test_virtual_bus() -> None:
    witness = Witness()
    with (
        can.Bus(interface="virtual", channel="hubside-test") as other,
        port_for(parse_can("virtual:hubside-test"), witness) as port,
    ):
        port.send(Can(0x601, b"\x01\x02"))
        port.send(Can(0x701, remote=True, dlc=1))
        got, remote = other.recv(5), other.recv(5)
        assert got is not None
        assert remote is not None
        assert (got.arbitration_id, bytes(got.data), got.is_extended_id) == (0x601, b"\x01\x02", False)
        assert (remote.is_remote_frame, remote.dlc) == (True, 1)
        other.send(can.Message(arbitration_id=0x581, data=b"\x03", is_extended_id=False))
        witness.wait_for(lambda: witness.received() == [Can(0x581, b"\x03")])
        assert witness.received(Direction.TX) == [Can(0x601, b"\x01\x02"), Can(0x701, remote=True, dlc=1)]
        called = threading.Event()
        port.call_soon(called.set)
        assert called.wait(5)


def test_socketcan_frames_as_the_kernel_gives_them() -> None:
    def kernel(can_id: int, length: int, data: bytes) -> bytes:
        return struct.pack("=IB3x8s", can_id, length, data)

    parse = SocketcanLink.parse
    assert parse(kernel(0x181, 2, b"\x01\x02\xff")) == Can(0x181, b"\x01\x02")
    assert parse(kernel(0x80000181, 0, b"")) == Can(0x181, extended=True)
    assert parse(kernel(0x40000701, 1, b"")) == Can(0x701, remote=True, dlc=1)
    assert parse(kernel(0xC0000701, 8, b"")) == Can(0x701, extended=True, remote=True, dlc=8)
    assert parse(kernel(0x20000004, 8, bytes(8))) == Can(4, bytes(8), error=True)


class DatagramBus(can.BusABC):
    """Frames as the kernel gives them, over UDP: its sockets know the time stamps and drop counts of SocketCAN's."""

    def __init__(self) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setsockopt(socket.SOL_SOCKET, 35, 1)
        super().__init__("datagram")

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        raise NotImplementedError

    def fileno(self) -> int:
        return self.socket.fileno()

    def shutdown(self) -> None:
        super().shutdown()
        self.socket.close()


@pytest.mark.skipif(sys.platform != "linux", reason="socket options of Linux")
def test_socketcan_drops_are_counted() -> None:
    bus = DatagramBus()
    link = SocketcanLink(bus)
    with closing(link), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.connect(bus.socket.getsockname())
        frame = struct.pack("=IB3x8s", 0x181, 1, b"\x07")
        sender.send(frame)
        ((received, t_ns),) = link.recv_many(0)
        assert received == Can(0x181, b"\x07")
        assert t_ns is not None
        assert abs(t_ns - time.time_ns()) < 5_000_000_000
        assert link.dropped == 0
        sent = 0
        for _ in range(40_000):
            sender.send(frame)
            sent += 1
        read = 0
        while batch := link.recv_many(0):
            read += len(batch)
        sender.send(frame)
        assert len(link.recv_many(0)) == 1
        assert link.dropped == sent - read > 0
        assert read > 5000


def test_slcan_lines_both_ways() -> None:
    frames = {
        b"t18120102": Can(0x181, b"\x01\x02"),
        b"t0800": Can(0x080),
        b"T1ABCDEF01FF": Can(0x1ABCDEF0, b"\xff", extended=True),
        b"r7011": Can(0x701, remote=True, dlc=1),
        b"R000007018": Can(0x701, extended=True, remote=True, dlc=8),
    }
    for line, frame in frames.items():
        assert parse_line(line) == frame
        assert format_line(frame) == line + b"\r"
    assert parse_line(b"t0801AA1F3C") == Can(0x080, b"\xaa")
    for answer in (b"", b"z", b"Z", b"V1013", b"F00"):
        assert parse_line(answer) is None
    for damaged in (b"t", b"t18", b"t1812", b"t181201", b"t1819", b"tFFF0", b"txyz0", b"T1ABCDEF", b"t1811GG"):
        with pytest.raises((ValueError, IndexError)):
            parse_line(damaged)


class SlcanAdapter:
    """The other end of a pty that speaks slcan, as the firmware of a serial adapter does."""

    def __init__(self, link: Path) -> None:
        self.master, slave = os.openpty()
        self.commands: list[bytes] = []
        self._changed = threading.Condition()
        self._stop_rx, self._stop_tx = os.pipe()
        with suppress(FileNotFoundError):
            link.unlink()
        link.symlink_to(os.ttyname(slave))
        os.set_blocking(self.master, False)
        self._slave = slave
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        rest = b""
        while self._stop_rx not in select.select([self.master, self._stop_rx], [], [])[0]:
            *commands, rest = (rest + os.read(self.master, 4096)).split(b"\r")
            with self._changed:
                self.commands += commands
                self._changed.notify_all()

    def wait_for(self, command: bytes) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: command in self.commands, 5), self.commands

    def send(self, data: bytes) -> None:
        os.write(self.master, data)

    def close(self) -> None:
        if self._thread.is_alive():
            os.write(self._stop_tx, b"x")
            self._thread.join(5)
            for descriptor in (self._slave, self.master, self._stop_rx, self._stop_tx):
                os.close(descriptor)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pty")
def test_slcan_over_a_pty_that_is_pulled(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    witness = Witness()
    with ExitStack() as stack:
        adapter = stack.enter_context(closing(SlcanAdapter(link)))
        port = stack.enter_context(port_for(CanConfig(CanInterface.SLCAN, str(link), 250_000), witness))
        adapter.wait_for(b"S5")
        adapter.wait_for(b"O")
        adapter.send(b"t18120102\rT1ABCDEF00\rr7011\r\r\x07t0")
        witness.wait_for(lambda: len(witness.frames) == 3)
        adapter.send(b"800\r")
        witness.wait_for(lambda: len(witness.frames) == 4)
        assert witness.received() == [
            Can(0x181, b"\x01\x02"),
            Can(0x1ABCDEF0, extended=True),
            Can(0x701, remote=True, dlc=1),
            Can(0x080),
        ]
        port.send(Can(0x601, b"\x40\x00"))
        adapter.wait_for(b"t60124000")
        adapter.close()
        lost = witness.wait_for_state(PortState.LOST)
        with pytest.raises(BusLostError):
            port.send(Can(0x601))
        again = stack.enter_context(closing(SlcanAdapter(link)))
        back = witness.wait_for_state(PortState.CONNECTED)
        assert back.lost_since_ns == lost.t_ns
        again.wait_for(b"O")
        again.send(b"t08000\r")
        again.send(b"t0801AA\r")
        witness.wait_for(lambda: Can(0x080, b"\xaa") in witness.received())


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pty")
def test_slcan_listen_only_uses_the_silent_mode(tmp_path: Path) -> None:
    link = tmp_path / "tty"
    with closing(SlcanAdapter(link)) as adapter:
        config = CanConfig(CanInterface.SLCAN, str(link), 500_000, listen_only=True)
        witness = Witness()
        with port_for(config, witness) as port:
            adapter.wait_for(b"L")
            assert b"O" not in adapter.commands
            port.set_listen_only(False)
            adapter.wait_for(b"O")
            witness.wait_for_state(PortState.CONNECTED)
            port.send(Can(0x080))
            adapter.wait_for(b"t0800")
