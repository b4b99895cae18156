"""The data link layer of the PROFIBUS master, on a line that plays what a test has written down, by its own clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import pytest

from app.drivers.profibus_config import wire_s
from app.drivers.profibus_line import NOTHING, LineError, Received
from app.drivers.profibus_port import PATIENCE_S, ProfibusPort, Reply
from app.errors import ForeignMasterError
from app.model.texts import error_text, load_texts
from app.wire.frame import Direction
from app.wire.profibus import dp
from app.wire.profibus.control import Answer, Station
from app.wire.profibus.control import Reply as ControlReply
from app.wire.profibus.fdl import ShortAck, Telegram, Token, decode

BAUD = 19200
MASTER, SLAVE, OTHER = 2, 6, 1
STATUS = dp.encode_request(dp.FdlStatus(), MASTER, SLAVE)
ANSWER = Telegram(MASTER, SLAVE, Answer(ControlReply.OK, Station.SLAVE))
THERE = ANSWER.encode()
SIZE = len(THERE)
ON_TIME_S = wire_s(len(STATUS.encode()) + SIZE, BAUD) + 0.001

Coming = tuple[float, bytes | Received]
"""How many seconds after a request, and what."""


class ScriptedLine:
    """Time passes in ``receive`` only. ``plays`` has what comes after each request, in their order."""

    def __init__(self, *plays: Sequence[Coming], first: Sequence[Coming] = ()) -> None:
        self.sent: list[bytes] = []
        self.time_s = 100.0
        self._plays = deque(plays)
        self._coming = [(self.time_s + delay_s, what) for delay_s, what in first]

    def now_s(self) -> float:
        return self.time_s

    def send(self, data: bytes) -> None:
        self.sent.append(data)
        play = self._plays.popleft() if self._plays else ()
        self._coming += [(self.time_s + delay_s, what) for delay_s, what in play]
        self._coming.sort(key=lambda one: one[0])

    def receive(self, timeout_s: float) -> Received:
        end_s = self.time_s + timeout_s
        if self._coming and self._coming[0][0] <= end_s:
            at_s, what = self._coming.pop(0)
            self.time_s = max(self.time_s, at_s)
            return what if isinstance(what, Received) else Received(what)
        self.time_s = end_s
        return NOTHING

    def close(self) -> None: ...


class Seen:
    """What was tapped, in order."""

    def __init__(self) -> None:
        self.all: list[tuple[Direction, bytes]] = []

    def __call__(self, direction: Direction, data: bytes, age_s: float) -> None:
        assert age_s >= 0
        self.all.append((direction, data))

    @property
    def short(self) -> str:
        return " ".join(f"{direction.name}:{data[:1].hex()}" for direction, data in self.all)


def port_on(line: ScriptedLine) -> tuple[ProfibusPort, Seen]:
    seen = Seen()
    return ProfibusPort(line, "profibus0", BAUD, MASTER, seen), seen


def ask(port: ProfibusPort, repeats: int = 0) -> Reply | None:
    def is_status(answer: Telegram | ShortAck) -> bool:
        return isinstance(answer, Telegram)

    return port.ask(STATUS, SIZE, is_status, repeats)


def test_an_answer_is_taken_and_all_is_tapped_in_order() -> None:
    line = ScriptedLine([(ON_TIME_S, THERE)])
    port, seen = port_on(line)
    assert port.last_input_s is None
    assert ask(port) == Reply(ANSWER, THERE)
    assert seen.all == [(Direction.TX, STATUS.encode()), (Direction.RX, THERE)]
    assert port.last_input_s == line.time_s


def test_an_answer_in_pieces_is_one() -> None:
    line = ScriptedLine([(ON_TIME_S, THERE[:2]), (ON_TIME_S + 0.001, THERE[2:])])
    assert ask(port_on(line)[0]) is not None


def test_a_doubled_answer_is_not_that_of_the_next_request() -> None:
    """It is there before the next request leaves, and is drained."""
    line = ScriptedLine([(ON_TIME_S, THERE + THERE)], [])
    port, _ = port_on(line)
    assert ask(port) is not None
    assert ask(port) is None
    assert (port.counters.stray, port.counters.unanswered) == (1, 1)


def test_a_late_answer_is_drained_before_the_next_request() -> None:
    late_s = port_on(ScriptedLine())[0].slot_s(len(STATUS.encode()), SIZE) + 0.002
    line = ScriptedLine([(late_s, THERE)], [(ON_TIME_S, THERE)])
    port, seen = port_on(line)
    assert ask(port) is None
    line.time_s += 0.01
    assert ask(port) is not None
    assert port.counters.stray == 1
    assert seen.short == "TX:10 RX:10 TX:10 RX:10"


def test_an_answer_faster_than_the_wire_is_none() -> None:
    """What comes while the request is still on its way is the answer to another one, and is told before it."""
    early_s = wire_s(len(STATUS.encode()), BAUD) * 1.1
    line = ScriptedLine([(early_s, THERE)], [(early_s, THERE), (ON_TIME_S, THERE)])
    port, seen = port_on(line)
    assert ask(port) is None
    assert port.counters.early == 1
    assert seen.short == "RX:10 TX:10"
    assert ask(port) is not None


def test_a_request_without_an_answer_is_repeated_as_it_was() -> None:
    line = ScriptedLine([], [], [(ON_TIME_S, THERE)])
    port, _ = port_on(line)
    assert ask(port, repeats=2) is not None
    assert line.sent == [STATUS.encode()] * 3
    assert (port.counters.repeated, port.counters.unanswered) == (2, 0)


def test_a_station_that_is_not_there_costs_its_slots_and_no_more() -> None:
    line = ScriptedLine()
    port, _ = port_on(line)
    assert ask(port, repeats=1) is None
    wires_s = 2 * wire_s(len(STATUS.encode()) + SIZE, BAUD)
    assert line.time_s - 100 < wires_s + 2 * PATIENCE_S + 0.02


@pytest.mark.parametrize("byte", range(SIZE))
def test_a_damaged_answer_is_none(byte: int) -> None:
    damaged = THERE[:byte] + bytes((THERE[byte] ^ 0x12,)) + THERE[byte + 1 :]
    line = ScriptedLine([(ON_TIME_S, damaged)], [(ON_TIME_S, THERE)])
    port, _ = port_on(line)
    assert ask(port, repeats=1) == Reply(ANSWER, THERE)
    assert len(line.sent) == 2


def test_an_answer_with_a_wrong_parity_is_none_even_if_its_sum_is_right() -> None:
    line = ScriptedLine([(ON_TIME_S, Received(b"", 1)), (ON_TIME_S + 0.001, THERE)], [(ON_TIME_S, THERE)])
    port, _ = port_on(line)
    assert ask(port, repeats=1) is not None
    assert len(line.sent) == 2
    assert port.counters.damaged == 1


def test_an_answer_of_another_station_is_none() -> None:
    foreign = ANSWER._replace(source=SLAVE + 1).encode()
    line = ScriptedLine([(ON_TIME_S, foreign), (ON_TIME_S + 0.001, THERE)])
    port, _ = port_on(line)
    assert ask(port) == Reply(ANSWER, THERE)
    assert port.counters.stray == 1


def test_an_adapter_that_hears_itself_does_no_harm() -> None:
    line = ScriptedLine([(ON_TIME_S, STATUS.encode() + THERE)])
    port, seen = port_on(line)
    assert ask(port) is not None
    assert seen.short == "TX:10 RX:10"


def test_an_answer_that_waits_when_the_host_comes_back_is_taken() -> None:
    """The host stood still between sending and looking."""
    line = ScriptedLine([(ON_TIME_S, THERE)])
    send = line.send

    def send_and_sleep(data: bytes) -> None:
        send(data)
        line.time_s += 3

    line.send = send_and_sleep  # type: ignore[method-assign]
    assert ask(port_on(line)[0]) is not None


# -- another master -----------------------------------------------------------------------------


def test_a_quiet_line_is_ours() -> None:
    line = ScriptedLine()
    port_on(line)[0].listen(0.5)
    assert (line.time_s, line.sent) == (100.5, [])


@pytest.mark.parametrize(
    ("heard", "reason", "master"),
    [
        (Token(OTHER, OTHER).encode(), "token", OTHER),
        (dp.encode_request(dp.SlaveDiag(), OTHER, SLAVE).encode(), "request", OTHER),
        (b"\x00\xff\x00\x7f", "noise", None),
        (THERE, "noise", None),
    ],
)
def test_whoever_speaks_before_us_keeps_us_from_beginning(heard: bytes, reason: str, master: int | None) -> None:
    line = ScriptedLine(first=[(0.2, heard)])
    port, seen = port_on(line)
    with pytest.raises(ForeignMasterError) as caught:
        port.listen(0.5)
    assert (caught.value.details["reason_key"], caught.value.details["master"]) == (
        f"profibus.foreign.{reason}",
        master,
    )
    assert line.sent == []
    assert b"".join(data for _, data in seen.all) in (heard, b"")
    for language in ("en", "de"):
        assert "{" not in error_text(load_texts(language), caught.value)


def test_a_request_of_another_master_ends_everything() -> None:
    theirs = dp.encode_request(dp.DataExchange(b"\1\2"), OTHER, SLAVE).encode()
    line = ScriptedLine([(ON_TIME_S, theirs)])
    with pytest.raises(ForeignMasterError):
        ask(port_on(line)[0])


def test_a_token_has_no_check_sum_so_one_is_not_believed_while_we_run() -> None:
    token = Token(OTHER, OTHER).encode()
    line = ScriptedLine([(ON_TIME_S, THERE), (ON_TIME_S + 0.001, token)], [(ON_TIME_S, THERE), (0.05, token)])
    port, _ = port_on(line)
    assert ask(port) is not None
    line.time_s += 0.01
    assert ask(port) is not None
    line.time_s += 0.1
    with pytest.raises(ForeignMasterError):
        ask(port)


def test_what_is_told_to_all_is_not_answered_and_has_left_when_we_go_on() -> None:
    line = ScriptedLine()
    port, seen = port_on(line)
    clear = dp.encode_request(dp.GlobalControl(dp.Command.CLEAR), MASTER, 127)
    port.tell(clear)
    assert decode(line.sent[0]) == clear
    assert line.time_s - 100 == pytest.approx(wire_s(len(line.sent[0]), BAUD) + 44 / BAUD)
    assert seen.short == "TX:68"


def test_a_line_that_is_never_quiet_is_not_ours() -> None:
    line = ScriptedLine(first=[(number * 0.001, b"\x55") for number in range(3000)])
    with pytest.raises(ForeignMasterError):
        ask(port_on(line)[0])
    assert line.sent == []


def test_a_line_that_breaks_is_told() -> None:
    line = ScriptedLine()

    def broken(timeout_s: float) -> Received:
        raise LineError("gone")

    line.receive = broken  # type: ignore[method-assign]
    with pytest.raises(LineError):
        ask(port_on(line)[0])
