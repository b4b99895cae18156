"""The simulated line: arbitration, exact bus time, queues, faults, and its thread."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.twins.line import MAX_BITRATE, MIN_BITRATE, CanLine, Fault, TxOrder, arbitration_key, delay, drop, duplicate
from app.twins.line_thread import LineThread
from app.wire.can_bits import frame_bits
from app.wire.frame import Can

BIT_NS = 2000
"""At 500 kbit/s."""


class Node:
    """Collects what it receives."""

    def __init__(self, line: CanLine, order: TxOrder = TxOrder.BY_IDENTIFIER) -> None:
        self.got: list[tuple[int, Can]] = []
        self.port = line.attach(lambda can, t_ns: self.got.append((t_ns, can)), order=order)

    @property
    def ids(self) -> list[int]:
        return [can.can_id for _, can in self.got]


@pytest.fixture
def line() -> CanLine:
    return CanLine(500_000)


def test_lowest_identifier_goes_first(line: CanLine) -> None:
    a, b, listener = Node(line), Node(line), Node(line)
    a.port.send(Can(0x700))
    b.port.send(Can(0x581))
    a.port.send(Can(0x080))
    line.run_until(10_000_000)
    assert listener.ids == [0x080, 0x581, 0x700]
    assert a.ids == [0x581]
    assert b.ids == [0x080, 0x700]


def test_a_frame_on_the_line_is_not_interrupted(line: CanLine) -> None:
    a, b, listener = Node(line), Node(line), Node(line)
    a.port.send(Can(0x700, bytes(8)))
    line.run_until(10_000)
    b.port.send(Can(0x001))
    a.port.send(Can(0x600))
    line.run_until(10_000_000)
    assert listener.ids == [0x700, 0x001, 0x600]


def test_exact_times_of_a_known_sequence(line: CanLine) -> None:
    # Without stuffing a base frame of n bytes has 47 + 8 n bits with its intermission; these two have no stuff bits
    # in the data, those in their headers and CRCs are in frame_bits, whose own tests compare it with the standard.
    sender, listener = Node(line), Node(line)
    frames = [Can(0x555, b"\x55\x55"), Can(0x556, b"\xaa"), Can(0x557)]
    for can in frames:
        sender.port.send(can)
    line.run_until(10_000_000)
    bits = list(itertools.accumulate(frame_bits(can) for can in frames))
    assert [t_ns for t_ns, _ in listener.got] == [(total - 3) * BIT_NS for total in bits]
    assert line.busy_ns == bits[-1] * BIT_NS
    assert bits[0] in range(63, 68)
    assert line.frames == 3


def test_time_does_not_drift_at_odd_bit_rates() -> None:
    line = CanLine(83_333)
    sender, listener = Node(line), Node(line)
    can = Can(0x181, bytes(8))
    for _ in range(100):
        sender.port.send(can)
    line.run_until(10_000_000_000)
    exact_ns = (100 * frame_bits(can) - 3) * 1e9 / 83_333
    assert listener.got[-1][0] == pytest.approx(exact_ns, abs=200)


def test_turnaround_and_timers(line: CanLine) -> None:
    client = Node(line)
    fired: list[int] = []

    def answer(can: Can, t_ns: int) -> None:
        server.send(Can(can.can_id - 0x80), t_ns + 2_000_000)

    server = line.attach(answer)
    line.call_at(2_500_000, fired.append)
    line.call_at(1_000_000, fired.append)
    client.port.send(Can(0x601))
    line.run_until(10_000_000)
    request_end_ns = (frame_bits(Can(0x601)) - 3) * BIT_NS
    answer_ns = (frame_bits(Can(0x581)) - 3) * BIT_NS
    assert [t_ns for t_ns, _ in client.got] == [request_end_ns + 2_000_000 + answer_ns]
    assert fired == [1_000_000, 2_500_000]
    assert line.now_ns == 10_000_000


def test_an_answer_within_the_intermission_arbitrates(line: CanLine) -> None:
    a, listener = Node(line), Node(line)
    quick = line.attach(lambda can, _t: quick.send(Can(0x080)) if can.can_id == 0x100 else None)
    a.port.send(Can(0x100))
    a.port.send(Can(0x101))
    line.run_until(10_000_000)
    assert listener.ids == [0x100, 0x080, 0x101]


def test_order_of_one_sender(line: CanLine) -> None:
    mailboxes, fifo, listener = Node(line), Node(line, TxOrder.FIFO), Node(line)
    for can_id, data in ((0x300, b"a"), (0x200, b"b"), (0x300, b"c")):
        mailboxes.port.send(Can(can_id, data))
    line.run_until(10_000_000)
    assert [can.data for _, can in listener.got] == [b"b", b"a", b"c"]
    listener.got.clear()
    for can_id, data in ((0x300, b"a"), (0x200, b"b"), (0x300, b"c")):
        fifo.port.send(Can(can_id, data))
    line.run_until(20_000_000)
    assert [can.data for _, can in listener.got] == [b"a", b"b", b"c"]
    assert fifo.port.pending == 0


@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.integers(0, 0x7FF), st.binary(max_size=8), st.integers(0, 5_000_000)),
        max_size=40,
    )
)
def test_no_frame_lost_no_overlap_no_priority_inverted(sends: list[tuple[int, int, bytes, int]]) -> None:
    line = CanLine(500_000)
    ports = [line.attach(lambda _can, _t: None) for _ in range(4)]
    seen: list[tuple[int, int, Can]] = []
    line.tap(lambda start_ns, end_ns, can: seen.append((start_ns, end_ns, can)))
    for node, can_id, data, t_ns in sends:
        ports[node].send(Can(can_id, data), t_ns)
    line.run_until(1_000_000_000)
    assert sorted(can for _, _, can in seen) == sorted(Can(can_id, data) for _, can_id, data, _ in sends)
    waiting = sorted((t_ns, can_id) for _, can_id, _, t_ns in sends)
    for (_, before_ns, _), (start_ns, _, _) in itertools.pairwise(seen):
        assert start_ns >= before_ns + 3 * BIT_NS
    for start_ns, end_ns, can in seen:
        assert end_ns - start_ns == (frame_bits(can) - 3) * BIT_NS
        ready = [entry for entry in waiting if entry[0] <= start_ns]
        assert can.can_id == min(can_id for _, can_id in ready)
        waiting.remove(min(entry for entry in ready if entry[1] == can.can_id))


def test_run_in_small_steps_is_the_same_as_in_one() -> None:
    def trace(step_ns: int) -> list[tuple[int, Can]]:
        line = CanLine(500_000)
        listener = Node(line)
        ping = line.attach(lambda can, t: ping.send(Can(can.can_id + 1), t + 5_000) if can.can_id < 0x140 else None)
        pong = line.attach(lambda can, t: pong.send(Can(can.can_id + 1), t) if can.can_id < 0x140 else None)
        line.call_at(33_333, lambda t: ping.send(Can(0x100), t))
        for t_ns in range(0, 20_000_000 + 1, step_ns):
            line.run_until(t_ns)
        return listener.got

    assert trace(20_000_000) == trace(1_000)


@pytest.mark.parametrize(
    "winner, loser",
    [
        (Can(0x100), Can(0x101)),
        (Can(0x100), Can(0x100, remote=True, dlc=0)),
        (Can(0x100, remote=True, dlc=0), Can(0x100 << 18, extended=True)),
        (Can(0x100 << 18, extended=True), Can(0x101)),
        (Can((0x100 << 18) + 1, extended=True), Can((0x100 << 18) + 2, extended=True)),
        (Can(5, extended=True), Can(5, extended=True, remote=True, dlc=1)),
    ],
)
def test_arbitration_field(winner: Can, loser: Can) -> None:
    assert arbitration_key(winner) < arbitration_key(loser)


def test_frames_that_cannot_exist_are_refused(line: CanLine) -> None:
    node = Node(line)
    for can in (Can(0x800), Can(1, bytes(9)), Can(1 << 29, extended=True)):
        with pytest.raises(ValueError):
            node.port.send(can)
    assert node.port.pending == 0


@pytest.mark.parametrize("bitrate", [-500_000, 0, 1, MIN_BITRATE - 1, MAX_BITRATE + 1])
def test_bit_rates_that_can_cannot_have_are_refused(bitrate: int) -> None:
    with pytest.raises(ValueError, match=str(bitrate)):
        CanLine(bitrate)


@pytest.mark.parametrize("bitrate", [MIN_BITRATE, MAX_BITRATE])
def test_the_slowest_and_the_fastest_line(bitrate: int) -> None:
    assert CanLine(bitrate).bitrate == bitrate


def test_filter_clear_and_detach(line: CanLine) -> None:
    sender, other = Node(line), Node(line)
    got: list[Can] = []
    filtered = line.attach(lambda can, _t: got.append(can), identifiers={0x181})
    sender.port.send(Can(0x181))
    sender.port.send(Can(0x182))
    sender.port.send(Can(0x181, extended=True))
    line.run_until(10_000_000)
    assert got == [Can(0x181)]
    filtered.accept(None)
    sender.port.send(Can(0x182))
    sender.port.send(Can(0x183))
    line.run_until(10_010_000)
    sender.port.clear()
    line.run_until(20_000_000)
    assert got == [Can(0x181), Can(0x182)]
    other.port.detach()
    sender.port.send(Can(0x182))
    line.run_until(30_000_000)
    assert len(other.got) == 4
    assert len(got) == 3


@pytest.mark.parametrize(
    "action, expected",
    [(drop, [2]), (delay(5_000_000), [2, 1]), (duplicate(3), [1, 1, 1, 2])],
)
def test_faults(line: CanLine, action: Callable[[Can], list[tuple[int, Can]]], expected: list[int]) -> None:
    sender, listener = Node(line), Node(line)
    line.inject(Fault(lambda can: can.can_id == 1, action))
    sender.port.send(Can(1))
    sender.port.send(Can(2))
    line.run_until(10_000_000)
    assert listener.ids == expected
    sender.port.send(Can(1))
    line.run_until(20_000_000)
    assert listener.ids == [*expected, 1]


def test_a_node_that_raises_reaches_the_caller_or_the_hook(line: CanLine) -> None:
    sender = Node(line)

    def broken(_can: Can, _t_ns: int) -> None:
        raise RuntimeError("broken node")

    line.attach(broken)
    listener = Node(line)
    sender.port.send(Can(1))
    with pytest.raises(RuntimeError, match="broken node"):
        line.run_until(1_000_000)
    errors: list[Exception] = []
    line.on_handler_error = errors.append
    sender.port.send(Can(2))
    line.run_until(2_000_000)
    assert listener.ids == [2]
    assert len(errors) == 1


def test_real_time_pacing_never_accumulates_an_error() -> None:
    line = CanLine(1_000_000)
    can = Can(0x181, bytes(range(8)))
    frames = 2000
    late_ns: list[int] = []
    done = threading.Event()
    sender = line.attach(lambda _can, _t: None)

    def tap(_start_ns: int, end_ns: int, _can: Can) -> None:
        late_ns.append(thread.now_ns() - end_ns)
        if len(late_ns) == frames:
            done.set()

    line.tap(tap)
    for _ in range(frames):
        sender.send(can)
    thread = LineThread(line)
    with thread:
        assert done.wait(20)
    assert min(late_ns) >= 0
    # 0.24 s of bus time: an error of one sleep a frame would sum up to more than 0.1 s; a busy machine may delay some.
    assert sorted(late_ns)[frames // 2] < 50_000_000
    assert line.busy_ns == frames * frame_bits(can) * 1000


def test_thread_survives_a_node_that_raises_and_takes_calls() -> None:
    line = CanLine(500_000)
    got = threading.Event()

    def broken(_can: Can, _t_ns: int) -> None:
        raise RuntimeError("broken node")

    line.attach(broken)
    line.attach(lambda _can, _t: got.set())
    sender = line.attach(lambda _can, _t: None)
    with LineThread(line) as thread:
        thread.call_soon(lambda: sender.send(Can(1)))
        assert got.wait(5)
        assert thread.handler_errors == 1
    assert not thread.is_alive()


def test_idle_thread_sleeps() -> None:
    line = CanLine(500_000)
    steps: list[int] = []
    fired = threading.Event()
    line.call_at(200_000_000, lambda _t: fired.set())
    thread = LineThread(line)
    thread.after_step(lambda: steps.append(line.now_ns))
    with thread:
        assert fired.wait(5)
    assert len(steps) < 20


def test_a_standstill_of_the_host_is_skipped() -> None:
    clock = itertools.chain([0, 0], itertools.repeat(60_000_000_000))
    line = CanLine(500_000)
    ticks: list[int] = []
    enough = threading.Event()

    def tick(t_ns: int) -> None:
        ticks.append(t_ns)
        enough.set()
        line.call_at(t_ns + 1_000_000, tick)

    line.call_at(1_000_000, tick)
    with LineThread(line, monotonic_ns=lambda: next(clock)) as thread:
        assert enough.wait(5)
    assert len(ticks) <= 2
    assert thread.skipped_ns >= 59_000_000_000


def test_a_node_that_is_cut_off_neither_sends_nor_hears(line: CanLine) -> None:
    a, b = Node(line), Node(line)
    a.port.send(Can(0x100))
    a.port.cut()
    a.port.send(Can(0x101))
    b.port.send(Can(0x200))
    line.run_until(10_000_000)
    assert (a.got, b.got, a.port.pending) == ([], [], 0)
    a.port.cut()
    a.port.join()
    b.port.send(Can(0x201))
    line.run_until(20_000_000)
    assert a.got == [], "cuts add up"
    a.port.join()
    a.port.send(Can(0x102))
    b.port.send(Can(0x202))
    line.run_until(30_000_000)
    assert (a.ids, b.ids) == ([0x202], [0x102])


def test_a_frame_on_the_line_ends_normally_though_its_sender_is_cut_off(line: CanLine) -> None:
    a, b = Node(line), Node(line)
    a.port.send(Can(0x100, bytes(8)))
    line.run_until(10_000)
    a.port.cut()
    line.run_until(10_000_000)
    assert b.ids == [0x100]


def test_a_node_that_is_cut_off_while_a_frame_is_handed_out_does_not_get_it(line: CanLine) -> None:
    sender, last = Node(line), Node(line)
    line.attach(lambda _can, _t_ns: None)
    cutter = line.attach(lambda _can, _t_ns: later.port.cut())
    later = Node(line)
    sender.port.send(Can(0x100))
    line.run_until(10_000_000)
    assert cutter.live
    assert last.ids == [0x100]
    assert later.got == []


def test_a_port_that_has_left_stays_away(line: CanLine) -> None:
    a, b = Node(line), Node(line)
    a.port.cut()
    a.port.detach()
    a.port.join()
    a.port.put(Can(0x100))
    b.port.send(Can(0x200))
    line.run_until(10_000_000)
    assert (a.got, b.got) == ([], [])


def test_what_a_fault_puts_on_the_line_is_exempt_from_faults(line: CanLine) -> None:
    a, listener = Node(line), Node(line)
    line.inject(Fault(lambda can: can.can_id == 0x100, duplicate(2), None))
    line.inject(Fault(lambda _can: True, drop, None))
    a.port.send(Can(0x100))
    a.port.send(Can(0x200))
    line.run_until(10_000_000)
    assert listener.ids == [0x100, 0x100]


def test_a_fault_that_was_withdrawn_does_nothing_more(line: CanLine) -> None:
    a, listener = Node(line), Node(line)
    fault = Fault(lambda _can: True, drop, None)
    line.inject(fault)
    line.withdraw(fault)
    line.withdraw(fault)
    a.port.send(Can(0x100))
    line.run_until(10_000_000)
    assert listener.ids == [0x100]


def test_a_tap_can_take_itself_away(line: CanLine) -> None:
    seen: list[int] = []

    def once(_start_ns: int, _end_ns: int, can: Can) -> None:
        seen.append(can.can_id)
        line.untap(once)

    a = Node(line)
    line.tap(once)
    line.tap(lambda _start_ns, _end_ns, can: seen.append(-can.can_id))
    a.port.send(Can(0x100))
    a.port.send(Can(0x200))
    line.run_until(10_000_000)
    assert seen == [0x100, -0x100, -0x200]
