"""Makes ``recordings/scenarios/ed2-bench.mcap``: ``python -m tests.recording.make_ed2``.

The twin of an ED2 and a master on a line in simulated time, so that the same program makes the same file: all
parameters, a refused one, a motion, a sensor wire that breaks, the reset, the way back, and a power cycle.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from app.model.description_file import load_builtin
from app.model.od_export import to_json
from app.recording.content import AttachedFile, EventKind, RecorderClock, RecordingInfo
from app.recording.index import Course
from app.recording.pack import pack
from app.recording.writer import RecorderCore, RecorderSettings
from app.twins.ed2.device import IDENT_EXAMPLE, Ed2, Settings
from app.twins.ed2.dp_line import DpLine, to_bytes, to_symbols
from app.twins.ed2.faults import FaultPlan, parse_order
from app.wire.frame import Direction, Fdl, Frame, Stamper
from app.wire.profibus import dp, pkw
from app.wire.profibus.fdl import AnyTelegram, decode
from app.wire.profibus.splitter import Found, Splitter
from app.wire.profibus.telegrams import ERROR_CODE
from tests.twins.ed2.rig import MS, Master, RefusedError

SAMPLE: Final = Path(__file__).resolve().parents[2] / "recordings" / "scenarios" / "ed2-bench.mcap"
BUS: Final = "dp0"
NODE: Final = 6
TELEGRAM: Final = 102
BAUD: Final = 500_000
TURBINE: Final = "bench-ed2"
SLUG: Final = "bench-ed2/bench/axes"
BEGIN_NS: Final = 1_772_431_200_000_000_000 + 200 * 3_600_000_000_000
LIBRARY: Final = "0.1.0"
RAMP: Final = 50_000
_HOLD, _RUN, _START, _RESET = 0x3, 0x7, 0x2000, 0x8
_REACHED: Final = 0x1000
_EVERY_MS: Final = 10
"""Of the exchange of data while nothing else is asked."""


class RecordedWire:
    """The line, with a tap on it and the recorder behind."""

    def __init__(self, folder: Path, orders: Mapping[str, str] | None = None) -> None:
        description = load_builtin("wandfluh-ed2")
        self.device = Ed2(description, Settings())
        self.line = DpLine([self.device.slave], BAUD)
        self.plan = FaultPlan([self.device], lambda _noise: None)
        self.line.on_time = self._live
        self.line.run_until(1_000 * MS)
        self._begin_ns = BEGIN_NS - self.line.now_ns
        self._splitter = Splitter()
        self.stamp = Stamper(BEGIN_NS, lambda: self.line.now_ns)
        self.course = Course((BUS,), {(BUS, NODE): description})
        info = RecordingInfo(
            TURBINE, "bench", {BUS: BAUD}, {f"{BUS}/{NODE}": f"{SLUG} {description.id}"},
            {"hubside": LIBRARY, description.id: description.version}, {}, {BUS: "profibus-dp"}, dict(orders or {}),
        )  # fmt: skip
        attached = AttachedFile(
            f"descriptions/{description.id}.json", "application/json", to_json(description).encode()
        )
        clock = RecorderClock(lambda: self.line.now_ns, lambda: self._begin_ns + self.line.now_ns, self.stamp)
        settings = RecorderSettings(flush_s=5.0, min_free_bytes=0, max_file_bytes=1 << 40, max_file_s=1e9)
        self.recorder = RecorderCore(folder, info, clock, [attached], settings)

    def _live(self, t_ns: int) -> None:
        self.plan.run_until(t_ns)
        self.device.run_until(t_ns)

    def exchange(self, data: bytes) -> list[AnyTelegram]:
        """Send a telegram and take what is answered; both are recorded."""
        sent_ns = self.line.send(to_symbols(data))
        self.line.run_until(sent_ns)
        self._record(Direction.TX, data)
        self.line.run_until(max(self.line.busy_until_ns, sent_ns + MS))
        told: list[AnyTelegram] = []
        for piece in self._splitter.feed(to_bytes(self.line.receive())):
            self._record(Direction.RX, piece.data)
            if isinstance(piece, Found):
                told.append(decode(piece.data))
        self._record_time()
        return told

    def wait(self, ms: int) -> None:
        """Let time pass."""
        self.line.run_until(self.line.now_ns + ms * MS)
        self._record_time()

    def _record(self, direction: Direction, data: bytes) -> None:
        frame = Frame(self.stamp(), BUS, direction, Fdl(data))
        self.recorder.write([frame])
        self.course.decode([frame])

    def _record_time(self) -> None:
        if self.recorder.keyframe_due():
            self.recorder.keyframe(self.course.snapshot(), self.stamp())
        self.recorder.cycle()

    def fault(self, text: str) -> None:
        """Something breaks."""
        self.plan.add(parse_order(text))

    def note(self, **details: Any) -> None:
        """What a person noted."""
        self.recorder.event(EventKind.NOTE, BUS, self.stamp(), **details)


def rest(master: Master, ms: int) -> None:
    """Go on exchanging."""
    master.advance(ms, _EVERY_MS)


def until(master: Master, holds: Callable[[], bool], most_ms: int = 10_000) -> None:
    """Exchange until it is so."""
    for _ in range(most_ms // _EVERY_MS):
        if holds():
            return
        rest(master, _EVERY_MS)
    raise AssertionError(f"the device did not come there: {master.status:04X}h")


def begin(master: Master) -> None:
    """From the first question to the exchange of data, as every master does it."""
    master.send(dp.FdlStatus())
    master.diagnosis()
    master.start(TELEGRAM, watchdog=(10, 10))
    master.send(dp.GlobalControl())


def parameters(master: Master) -> None:
    """All of them; what the device refuses stays unknown."""
    for entry in load_builtin("wandfluh-ed2"):
        if entry.access.readable and entry.type.size is not None:
            try:
                master.read(entry.address.short)
            except RefusedError:
                continue


def play(wire: RecordedWire) -> None:
    """The whole course, a quarter of a minute."""
    master = Master(wire, NODE)
    begin(master)
    parameters(master)
    master.write("12/61", RAMP)
    master.refused(lambda: master.write("0/38", 1))
    rest(master, 300)
    master.set(_RUN, 300_000)
    rest(master, 200)
    master.set(_RUN | _START)
    until(master, lambda: bool(master.status & _REACHED))
    rest(master, 500)
    wire.fault("sensor_wire,axis=1,for_s=0.5")
    until(master, lambda: bool(master.seen[0].get(ERROR_CODE)))
    wire.note(text="sensor plug pressed home", device=SLUG, person="bench")
    rest(master, 800)
    master.set(0)
    master.set(_RESET)
    until(master, lambda: not master.seen[0].get(ERROR_CODE))
    master.set(_HOLD)
    master.write("0/51", 0x73617665)
    rest(master, 300)
    restart(wire, master)
    parameters(master)
    leave(master)
    rest_of_time(wire)


def restart(wire: RecordedWire, master: Master) -> None:
    """Off and on; the master asks in vain, and begins anew."""
    wire.device.power_off()
    for _ in range(4):
        master.send(dp.DataExchange(master.outputs()))
        wire.wait(50)
    wire.device.power_on()
    wire.wait(1_000)
    master.values, master.job = [{}, {}], pkw.IDLE
    master.first = True
    begin(master)


def leave(master: Master) -> None:
    """Outputs to zero, then the slave is free for another master."""
    master.send(dp.GlobalControl(dp.Command.CLEAR))
    master.send(dp.SetPrm(IDENT_EXAMPLE, lock=False, unlock=True))
    master.diagnosis()


def rest_of_time(wire: RecordedWire) -> None:
    """The line falls silent."""
    wire.wait(200)


def record(folder: Path, orders: Mapping[str, str] | None = None) -> Path:
    """Plays and records; the file as the recorder leaves it."""
    wire = RecordedWire(folder, orders)
    play(wire)
    wire.recorder.shut()
    status = wire.recorder.status()
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
