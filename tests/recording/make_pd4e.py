"""Makes ``recordings/scenarios/pd4e-bench.mcap``: ``python -m tests.recording.make_pd4e``.

The twin of a PD4-E and a master in simulated time, so that the same program makes the same file: the whole dictionary,
a motion, a shaft that blocks until the drive reports a following error, the reset, and the way back.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.model.od_export import to_json
from app.recording.content import AttachedFile, EventKind, RecorderClock, RecordingInfo
from app.recording.index import Course
from app.recording.pack import pack
from app.recording.writer import RecorderCore, RecorderSettings
from app.twins.pd4e.device import BOOT_NS, Pd4e, Settings
from app.twins.pd4e.requests import Answering
from app.twins.pd4e.servo import Bench
from app.wire.frame import Adu, Direction, Frame, Stamper
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import AbortAnswer, Answer, FramesRead, ObjectRead, RegistersRead, decode_answer
from app.wire.modbus.functions import Phase
from app.wire.modbus.requests import (
    ReadDictionary,
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    Request,
    WriteObject,
)

SAMPLE: Final = Path(__file__).resolve().parents[2] / "recordings" / "scenarios" / "pd4e-bench.mcap"
BUS: Final = "lan"
TURBINE: Final = "bench-pd4e"
SLUG: Final = "bench-pd4e/bench/servo"
SERVER: Final = "192.168.2.20:502"
MASTER: Final = "192.168.2.10:49152"
BEGIN_NS: Final = 1_772_431_200_000_000_000 + 100 * 3_600_000_000_000
LIBRARY: Final = "0.1.0"
MS: Final = 1_000_000
PERIOD_NS: Final = 20 * MS
"""Of the exchange of registers."""
ANSWER_NS: Final = 2 * MS
"""From a request to its answer, the network included."""
_SENT, _RECEIVED = 5000, 6000
_POLLED: Final = ("603F", "1001", "60F4", "606C", "4014:03")
"""One of them after each exchange of registers."""
_ENABLE, _NEW, _FAULT, _REACHED = 0x0F, 0x10, 0x08, 0x400


class Master:
    """Drive and master on one connection, and the recorder behind it. Time passes with what is asked."""

    def __init__(self, folder: Path) -> None:
        description = load_builtin("nanotec-pd4e")
        self.device = Pd4e(description, Settings(bench=Bench()))
        self.device.run_until(BOOT_NS)
        self.now_ns = self.device.now_ns
        self._begin_ns = BEGIN_NS - self.now_ns
        self._answering = Answering(self.device.store, self.device.process_data)
        self._transaction = 0
        self._polls = 0
        self._target = self._motor_mode = 0
        self.stamp = Stamper(self._begin_ns + self.now_ns, lambda: self.now_ns)
        self.sizes = {one.address: one.type for one in description}
        servers = {(BUS, 1): SERVER}
        self.course = Course((), {(BUS, 1): description}, 2000, servers)
        info = RecordingInfo(
            TURBINE, "bench", {}, {f"{BUS}/1": f"{SLUG} {description.id}"},
            {"hubside": LIBRARY, description.id: description.version}, {f"{BUS}/1": SERVER},
        )  # fmt: skip
        attached = AttachedFile(
            f"descriptions/{description.id}.json", "application/json", to_json(description).encode()
        )
        clock = RecorderClock(lambda: self.now_ns, lambda: self._begin_ns + self.now_ns, self.stamp)
        settings = RecorderSettings(flush_s=5.0, min_free_bytes=0, max_file_bytes=1 << 40, max_file_s=1e9)
        self.recorder = RecorderCore(folder, info, clock, [attached], settings)

    # -- one transaction ---------------------------------------------------------------

    def ask(self, request: Request) -> Answer:
        """One request and its answer, recorded both."""
        self._transaction += 1
        data = Message(self._transaction, 0, request.pdu()).encode()
        self._record(Direction.TX, Adu(data, f"{MASTER}>{SERVER}"))
        self.pass_time(ANSWER_NS)
        pdu = self._answering.answer(request.pdu())
        self.device.settle()
        self._record(Direction.RX, Adu(Message(self._transaction, 0, pdu).encode(), f"{SERVER}>{MASTER}"))
        return decode_answer(pdu)

    def _record(self, direction: Direction, adu: Adu) -> None:
        frame = Frame(self.stamp(), BUS, direction, adu)
        self.recorder.write([frame])
        self.course.decode([frame])

    def pass_time(self, ns: int) -> None:
        """The drive lives on, and the recorder with it."""
        self.now_ns += ns
        self.device.run_until(self.now_ns)
        if self.recorder.keyframe_due():
            self.recorder.keyframe(self.course.snapshot(), self.stamp())
        self.recorder.cycle()

    # -- objects -----------------------------------------------------------------------

    def read(self, where: str) -> int:
        """An integer object, read by FC 43."""
        address = parse_address(where)
        answer = self.ask(ReadObject(address, self.sizes[address].size or 0))
        assert isinstance(answer, ObjectRead)
        return int.from_bytes(answer.data, "little", signed=self.sizes[address].is_signed)

    def write(self, where: str, number: int) -> bool:
        """Written by FC 43; False where the drive refused."""
        address = parse_address(where)
        size, signed = self.sizes[address].size or 0, self.sizes[address].is_signed
        return not isinstance(
            self.ask(WriteObject(address, number.to_bytes(size, "little", signed=signed))), AbortAnswer
        )

    def learn_registers(self) -> None:
        """A target read both ways shows which register comes first. 3202h is among them: it keeps what it holds."""
        self._motor_mode = self.read("3202")
        self._target = 7_200
        self.write("607A", self._target)
        self.ask(ReadRegisters(_RECEIVED, 6))
        self.read("607A")

    def dictionary(self) -> None:
        """Every object, by FC 101."""
        phase = Phase.START
        while isinstance(self.ask(ReadDictionary(phase)), FramesRead):
            phase = Phase.CONTINUE

    def exchange(self, controlword: int) -> int:
        """Registers both ways by FC 23, then one object by FC 43; gives the statusword."""
        written = (controlword, 1, *_words(self._motor_mode), *_words(self._target))
        answer = self.ask(ReadWriteRegisters(_SENT, 7, _RECEIVED, written))
        assert isinstance(answer, RegistersRead)
        self.read(_POLLED[self._polls % len(_POLLED)])
        self._polls += 1
        self.pass_time(PERIOD_NS - 2 * ANSWER_NS)
        return answer.registers[0]

    def hold(self, controlword: int, until: Callable[[int], bool], most_s: float = 10.0) -> int:
        """Exchange until the statusword is so."""
        for _ in range(round(most_s * 1e9) // PERIOD_NS):
            status = self.exchange(controlword)
            if until(status):
                return status
        raise AssertionError("the drive did not come there")

    def rest(self, controlword: int, seconds: float) -> None:
        """Exchange for a while."""
        for _ in range(round(seconds * 1e9) // PERIOD_NS):
            self.exchange(controlword)

    def move(self, target: int) -> None:
        """Hand over a target; it is not waited for."""
        self._target = target
        self.hold(_ENABLE, lambda status: not status & 0x1000)
        self.hold(_ENABLE | _NEW, lambda status: bool(status & 0x1000))
        self.exchange(_ENABLE)

    def enable(self) -> None:
        """To Operation enabled."""
        for word, wanted in ((0x06, 0x21), (0x07, 0x23), (_ENABLE, 0x27)):
            self.hold(word, lambda status, wanted=wanted: status & 0x6F == wanted)  # type: ignore[misc]

    def note(self, **details: Any) -> None:
        """What a person noted."""
        self.recorder.event(EventKind.NOTE, BUS, self.stamp(), **details)


def _words(number: int) -> tuple[int, int]:
    """The registers of 32 bits, the high one first, as this twin has it."""
    return number >> 16 & 0xFFFF, number & 0xFFFF


def play(master: Master) -> None:
    """The whole course, half a minute."""
    for where in ("1008", "1018:04"):
        address = parse_address(where)
        master.ask(ReadObject(address, master.sizes[address].size or 200))
    master.dictionary()
    master.learn_registers()
    master.write("6060", 1)
    master.write("3700", 2)
    master.write("6066", 50)
    master.write("6081", 120)
    master.write("6041", 0)  # read only: refused
    master.rest(0x00, 1.0)
    master.enable()
    master.move(7_200)
    master.hold(_ENABLE, lambda status: bool(status & _REACHED))
    master.rest(_ENABLE, 2.0)
    position = master.device.servo.position
    master.device.servo.bench = Bench(low_stop=position - 0.1, high_stop=position + 0.1)
    master.move(0)
    master.hold(_ENABLE, lambda status: status & 0x4F == _FAULT)
    for where in ("1003:00", "1003:01", "603F"):
        master.read(where)
    master.rest(0x00, 3.0)
    master.device.servo.bench = Bench()
    master.note(text="brake released by hand", device=SLUG, person="bench")
    master.hold(0x80, lambda status: not status & _FAULT)
    master.rest(0x00, 1.0)
    master.enable()
    master.move(0)
    master.hold(_ENABLE, lambda status: bool(status & _REACHED))
    master.rest(_ENABLE, 1.0)
    master.hold(0x00, lambda status: status & 0x6F in (0x21, 0x40, 0x60))
    master.rest(0x00, 1.0)


def record(folder: Path) -> Path:
    """Plays and records; the file as the recorder leaves it."""
    master = Master(folder)
    play(master)
    master.recorder.shut()
    status = master.recorder.status()
    assert status.file is not None
    assert not status.lost
    return status.file


def make(path: Path) -> None:
    """Writes the sample to ``path``, in the archive form."""
    with tempfile.TemporaryDirectory() as name:
        path.unlink(missing_ok=True)
        pack(record(Path(name)), path)


if __name__ == "__main__":
    make(SAMPLE)
    sys.stdout.write(f"{SAMPLE}: {SAMPLE.stat().st_size} bytes\n")
