"""A master of our own for the ED2 twin: frames of ``app/wire/profibus`` over the in-process line or the real pty."""

from __future__ import annotations

import os
import select
import termios
import threading
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Final, Protocol

from app.model.address import Address, parse_address
from app.model.description_file import load_builtin
from app.twins.ed2.device import IDENT_EXAMPLE, Ed2, Settings
from app.twins.ed2.dp_line import DpLine, to_bytes, to_symbols
from app.twins.ed2.pty_line import PtyLine
from app.twins.ed2.segment import Segment
from app.twins.paced_thread import PacedThread
from app.wire.profibus import dp, pkw
from app.wire.profibus.diagnosis import Diagnosis
from app.wire.profibus.fdl import AnyTelegram, ShortAck, Telegram, decode
from app.wire.profibus.pkw import PkwAnswer, PkwError, PkwRequest, ReplyKind
from app.wire.profibus.pzd import decode_pzd, encode_pzd
from app.wire.profibus.splitter import Found, Splitter
from app.wire.profibus.telegrams import (
    ACTUAL,
    CONTROL_WORD,
    SETPOINT,
    STATUS_WORD,
    TELEGRAM_TYPES,
    Signal,
    assumed_modules,
)

MS: Final = 1_000_000
MASTER: Final = 2
PATIENCE_MS: Final = 200


class RefusedError(Exception):
    """A PKW job was refused."""

    def __init__(self, code: int) -> None:
        super().__init__(PkwError(code).name)
        self.code = PkwError(code)


class Wire(Protocol):
    """What carries bytes: the in-process line, or the pty."""

    def exchange(self, data: bytes) -> list[AnyTelegram]:
        """Send a telegram and take what is answered."""

    def wait(self, ms: int) -> None:
        """Let time pass."""


class VirtualWire:
    """The in-process line with its clock."""

    def __init__(self, line: DpLine) -> None:
        self.line = line
        self._splitter = Splitter()

    def exchange(self, data: bytes) -> list[AnyTelegram]:
        sent_ns = self.line.send(to_symbols(data))
        self.line.run_until(sent_ns)
        self.line.run_until(max(self.line.busy_until_ns, sent_ns + MS))
        return self.take()

    def take(self) -> list[AnyTelegram]:
        """What has arrived."""
        pieces = self._splitter.feed(to_bytes(self.line.receive()))
        return [decode(piece.data) for piece in pieces if isinstance(piece, Found)]

    def wait(self, ms: int) -> None:
        self.line.run_until(self.line.now_ns + ms * MS)


class PtyWire:
    """The real pseudo terminal; the twin's clock is the test's, so that time passes when the test says so."""

    def __init__(self, path: str, clock: Clock, thread: PacedThread) -> None:
        self._handle = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._handle, termios.TCSANOW)
        self._clock = clock
        self._thread = thread
        self._splitter = Splitter()

    def exchange(self, data: bytes) -> list[AnyTelegram]:
        os.write(self._handle, data)
        for _ in range(PATIENCE_MS):
            self.wait(1)
            pieces = self._splitter.feed(self.read())
            told = [decode(piece.data) for piece in pieces if isinstance(piece, Found)]
            if told:
                return told
        return []

    def read(self) -> bytes:
        """What there is to read; the system hands bytes of a pty on when it finds the time, so it gets a moment."""
        ready, _, _ = select.select([self._handle], (), (), 0.003)
        return os.read(self._handle, 4096) if ready else b""

    def wait(self, ms: int) -> None:
        """Let time pass: when this returns the twin has read what was written, and has lived until then."""
        self._clock.now_ns += ms * MS
        for _ in range(2):
            done = threading.Event()
            self._thread.call_soon(done.set)
            assert done.wait(30), "the twin's thread stands still"

    def close(self) -> None:
        os.close(self._handle)


class Clock:
    """Stands until it is moved."""

    def __init__(self) -> None:
        self.now_ns = 1_000 * MS

    def __call__(self) -> int:
        return self.now_ns


@dataclass
class Master:
    """A master of class 1 that knows one slave, and what it sends to it."""

    wire: Wire
    slave: int = 6
    address: int = MASTER
    telegrams: tuple[int, ...] = (1,)
    settings: Settings = field(default_factory=Settings)
    fcb: bool = False
    first: bool = True
    values: list[dict[Signal, int]] = field(default_factory=lambda: [{}, {}])
    job: PkwRequest = pkw.IDLE
    jobs_of: int = 0
    """Which axis, from 0, the PKW jobs are of."""
    seen: list[dict[Signal, int]] = field(default_factory=lambda: [{}, {}])
    answers: list[PkwAnswer] = field(default_factory=list)

    # -- services ----------------------------------------------------------------------------

    def send(self, service: dp.Service, *, again: bool = False) -> list[AnyTelegram]:
        """Send a service, counted by the frame count bit; ``again`` repeats the count of the one before."""
        return self.wire.exchange(self.frame(service, again=again).encode())

    def frame(self, service: dp.Service, *, again: bool = False) -> Telegram:
        """The telegram of a service."""
        if isinstance(service, dp.FdlStatus | dp.GlobalControl):
            return dp.encode_request(service, self.address, self.slave)
        if not again:
            self.fcb = True if self.first else not self.fcb
        frame = dp.encode_request(service, self.address, self.slave, self.fcb, not self.first)
        self.first = False
        return frame

    def ask(self, service: dp.Service) -> dp.ServiceAnswer:
        """The one answer to a service."""
        told = self.send(service)
        assert len(told) == 1, told
        assert isinstance(told[0], Telegram | ShortAck)
        return dp.decode_answer(service, told[0])

    def diagnosis(self) -> Diagnosis:
        answer = self.ask(dp.SlaveDiag())
        assert isinstance(answer, dp.DiagnosisAnswer)
        return answer.diagnosis

    def start(self, *telegrams: int, watchdog: tuple[int, int] | None = None) -> None:
        """Bring the slave to Data_Exchange."""
        self.telegrams = telegrams or self.telegrams
        modules = [module for number in self.telegrams for module in assumed_modules(TELEGRAM_TYPES[number])]
        assert self.ask(dp.SetPrm(IDENT_EXAMPLE, watchdog=watchdog)) == dp.Done()
        assert self.ask(dp.ChkCfg(tuple(modules))) == dp.Done()
        assert self.diagnosis().ready
        self.exchange()

    # -- data --------------------------------------------------------------------------------

    def outputs(self) -> bytes:
        data = b""
        for number, axis in zip(self.telegrams, range(2), strict=False):
            telegram = TELEGRAM_TYPES[number]
            job = self.job if axis == self.jobs_of else pkw.IDLE
            data += job.encode() if telegram.has_pkw else b""
            data += encode_pzd(telegram.received, self.values[axis], self.settings.order)
        return data

    def exchange(self) -> list[PkwAnswer]:
        """One Data_Exchange; gives the PKW answers, one a telegram that has them."""
        answer = self.ask(dp.DataExchange(self.outputs()))
        assert isinstance(answer, dp.Inputs), answer
        at, self.answers = 0, []
        for number, axis in zip(self.telegrams, range(2), strict=False):
            telegram = TELEGRAM_TYPES[number]
            data = answer.data[at : at + telegram.input_size]
            at += telegram.input_size
            if telegram.has_pkw:
                self.answers.append(pkw.decode_answer(data[: pkw.SIZE]))
                data = data[pkw.SIZE :]
            self.seen[axis] = decode_pzd(telegram.sent, data, self.settings.order)
        assert at == len(answer.data)
        return self.answers

    def advance(self, ms: int, every: int = 2) -> None:
        """Go on exchanging for some time."""
        for _ in range(ms // every):
            self.wire.wait(every)
            self.exchange()

    def until(self, condition: Callable[[], bool], timeout_ms: int = 20_000) -> int:
        """Exchange until a condition holds; gives how long it took, ms of waiting."""
        passed = 0
        while not condition():
            assert passed < timeout_ms, f"not within {timeout_ms} ms: {self.status:04X}h, {self.seen}"
            self.wire.wait(5)
            self.exchange()
            passed += 5
        return passed

    def set(self, word: int, setpoint: int | None = None, *, axis: int = 1) -> int:
        """Set the control word and perhaps the setpoint, let the device take them; gives its status word."""
        self.values[axis - 1][CONTROL_WORD] = word
        if setpoint is not None:
            self.values[axis - 1][SETPOINT] = setpoint
        self.exchange()
        self.advance(10)
        return self.seen[axis - 1][STATUS_WORD]

    @property
    def status(self) -> int:
        return self.seen[0].get(STATUS_WORD, 0)

    @property
    def actual(self) -> int:
        return self.seen[0][ACTUAL]

    # -- parameters --------------------------------------------------------------------------

    def do(self, job: PkwRequest, *, timeout_ms: int = 2_000) -> PkwAnswer:
        """One job by the rules: AK 0 first, then the job until its answer stands."""
        channel = self.channel
        self.job = pkw.IDLE
        self.until(lambda: self.answers[channel].kind is ReplyKind.NOTHING)
        self.job = job
        self.exchange()
        self.until(lambda: self.answers[channel].kind is not ReplyKind.NOTHING, timeout_ms)
        answer = self.answers[channel]
        assert pkw.answers(job, answer)
        return answer

    @property
    def channel(self) -> int:
        """Which of the PKW answers is that of the axis asked."""
        return sum(TELEGRAM_TYPES[number].has_pkw for number in self.telegrams[: self.jobs_of])

    def read(self, where: str, value: int = 0) -> int:
        """An integer parameter, signed as it is described."""
        answer = self.do(pkw.read(parse_address(where), value))
        if answer.kind is ReplyKind.REFUSED:
            raise RefusedError(answer.value)
        assert answer.data is not None
        return int.from_bytes(answer.data, "little", signed=shape(where)[1])

    def write(self, where: str, number: int) -> None:
        size, signed = shape(where)
        answer = self.do(pkw.write(parse_address(where), number.to_bytes(size, "little", signed=signed)))
        if answer.kind is ReplyKind.REFUSED:
            raise RefusedError(answer.value)
        assert answer.kind is not ReplyKind.NOTHING

    def refused(self, action: Callable[[], object]) -> PkwError:
        try:
            action()
        except RefusedError as error:
            return error.code
        raise AssertionError("it was not refused")

    def ask_raw(self, data: bytes) -> bytes:
        """A job by its bytes, whatever they are; gives the bytes of the answer."""
        job = pkw.decode_request(data)
        return self.do(job).encode()


def shape(where: str) -> tuple[int, bool]:
    """Size and sign of a parameter by the description."""
    kind = load_builtin("wandfluh-ed2").entry(parse_address(where)).type
    assert kind.size is not None
    return kind.size, kind.is_signed


@dataclass
class Rig:
    """A twin on the in-process line, and its master."""

    device: Ed2
    line: DpLine
    master: Master

    def restart(self) -> None:
        """Power off and on, and the self test."""
        self.device.power_off()
        self.master.wire.wait(100)
        self.device.power_on()
        self.master.wire.wait(1_000)


def made(settings: Settings | None = None, *, baud: int = 1_500_000) -> Rig:
    """A twin on the in-process line."""
    chosen = settings or Settings()
    device = Ed2(load_builtin("wandfluh-ed2"), chosen)
    line = DpLine([device.slave], baud)
    line.on_time = device.run_until
    master = Master(VirtualWire(line), chosen.address, settings=chosen)
    master.wire.wait(1_000)  # the self test
    return Rig(device, line, master)


@contextmanager
def on_pty(settings: Settings | None = None, *, baud: int = 500_000) -> Iterator[tuple[Ed2, Master, PtyWire]]:
    """A twin on a pty, and a master that has opened it."""
    chosen = settings or Settings()
    device = Ed2(load_builtin("wandfluh-ed2"), chosen)
    device.run_until(1_000 * MS)
    line = PtyLine(Segment([device.slave], baud), [device])
    clock = Clock()
    thread = PacedThread(line, clock, max_lag_ns=10**18)
    line.serve(thread)
    with thread:
        wire = PtyWire(line.path, clock, thread)
        yield device, Master(wire, chosen.address, settings=chosen), wire
        wire.close()
    assert thread.handler_errors == 0
    line.close()


def where(text: str) -> Address:
    return parse_address(text)
