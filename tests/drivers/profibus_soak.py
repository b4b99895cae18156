"""A master and a twin on a line in this process, by a clock of its own, with whatever a line can do to telegrams.

A run looks at everything that the driver believes: each value that it reads, each process data that it calls fresh, and
each change of the controlword that it calls delivered, against what the twin has really said and taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import ceil
from random import Random
from unittest.mock import patch

import pyprofibus.dp_master
import pyprofibus.phy
import pyprofibus.util

from app.drivers.profibus_bus import ProfibusBus
from app.drivers.profibus_config import ProfibusConfig, ProfibusStation
from app.drivers.profibus_image import Change
from app.drivers.profibus_line import NOTHING, Received
from app.drivers.profibus_pkw import Failure, PkwJob, Result
from app.drivers.profibus_station import Station, StationState
from app.twins.ed2.device import BOOT_NS, Ed2, Settings
from app.twins.ed2.dp_line import DpLine, LineNoise, parity_holds, to_bytes, to_symbols
from app.wire.frame import Direction
from app.wire.profibus import pkw
from app.wire.profibus.pzd import AS_PKW, decode_pzd
from app.wire.profibus.telegrams import CONTROL_WORD, Signal
from tests.drivers.profibus_rig import ED2, NODE, RAMP_VELOCITY
from tests.drivers.wire import stamper

S = 1_000_000_000
BAUD = 500_000
TELEGRAM = 102
PIECE_NS = 200_000
"""A port hands on what has come in pieces: of a telegram that comes twice, the second is often still on its way."""
NEW_SETPOINT = 0x2000
"""An edge that moves nothing while D, H and M are 0."""


class VirtualLine:
    """The line as the driver sees it; time passes while it waits."""

    def __init__(self, line: DpLine) -> None:
        self.line = line

    def now_s(self) -> float:
        return self.line.now_ns / S

    def send(self, data: bytes) -> None:
        self.line.send(to_symbols(data))

    def receive(self, timeout_s: float) -> Received:
        end_ns = self.line.now_ns + ceil(timeout_s * S)
        while not (symbols := self.line.receive()):
            due_ns = self.line.next_due_ns()
            if self.line.now_ns >= end_ns:
                return NOTHING
            due_ns = end_ns if due_ns is None else max(due_ns, self.line.now_ns + PIECE_NS)
            self.line.run_until(min(due_ns, end_ns))
        whole = [symbol for symbol in symbols if parity_holds(symbol)]
        return Received(to_bytes(whole), len(symbols) - len(whole))

    def close(self) -> None: ...


@dataclass
class Findings:
    """What a run has seen."""

    reads: int = 0
    writes: int = 0
    open_writes: int = 0
    """Without an answer: nobody claims to know."""
    timeouts: int = 0
    fresh: int = 0
    edges: int = 0
    wrong: list[str] = field(default_factory=list)
    """What the driver believed and was not so."""
    recoveries_s: list[float] = field(default_factory=list)
    """From power-on of the slave to the first exchange."""


class Soak:
    """One run: jobs all the time, one after another, and an edge of the controlword now and then."""

    def __init__(self, seed: int, noise: LineNoise | None, restart_every_s: float | None) -> None:
        self.found = Findings()
        self.device = Ed2(ED2, Settings())
        self.device.run_until(BOOT_NS)
        self.line = DpLine((self.device.slave,), BAUD, start_ns=BOOT_NS)
        self.line.on_time = self.device.run_until
        self.line.fault = noise
        self._random = Random(seed)
        self._restart_every_s = restart_every_s
        self._transmitted = b""
        self._transmitted_ns = 0
        self._turn_ns = 0
        self._received: list[int] = []
        self._watch()
        config = ProfibusConfig("line", BAUD, (ProfibusStation(NODE, TELEGRAM),))
        self.port_line = VirtualLine(self.line)
        self.bus = ProfibusBus(
            config, "profibus0", stamper(), lambda: self.port_line, self._tap, lambda: None, listen_s=0.05
        )
        self._busy = False
        self._seen_s: float | None = None
        self._on_ns = 0

    @property
    def station(self) -> Station:
        return self.bus.stations[NODE]

    def run(self, duration_s: float) -> Findings:
        """So many seconds of line time."""
        end_ns = self.line.now_ns + round(duration_s * S)
        next_off_ns = None if self._restart_every_s is None else self.line.now_ns + round(self._restart_every_s * S)
        self.bus.open()
        while self.line.now_ns < end_ns:
            if next_off_ns is not None and self.line.now_ns >= next_off_ns:
                self._switch()
                next_off_ns = self.line.now_ns + round((self._restart_every_s or 0) * S)
            self._turn()
        return self.found

    def _turn(self) -> None:
        self._turn_ns = self.line.now_ns
        wait_s = self.bus.turn()
        self._look()
        self._ask()
        self.line.run_until(self.line.now_ns + ceil(min(wait_s, 0.01) * S) + 1000)

    # -- the truth --------------------------------------------------------------------------------

    def _watch(self) -> None:
        transmit, receive = self.device.transmit, self.device.receive

        def transmitting() -> bytes:
            self._transmitted, self._transmitted_ns = transmit(), self.line.now_ns
            return self._transmitted

        def receiving(outputs: bytes) -> None:
            receive(outputs)
            values: dict[Signal, int] = decode_pzd(self.station.telegram.received, outputs[pkw.SIZE :], AS_PKW)
            if not self._received or values[CONTROL_WORD] != self._received[-1]:
                self._received.append(values[CONTROL_WORD])

        self.device.transmit = transmitting  # type: ignore[method-assign]
        self.device.receive = receiving  # type: ignore[method-assign]

    def _switch(self) -> None:
        """Off for a while, then on: it forgets all that was not saved."""
        self.device.power_off()
        off_ns = self.line.now_ns + round((0.3 + self._random.random()) * S)
        while self.line.now_ns < off_ns:
            self._turn()
        self.device.power_on()
        self._on_ns = self.line.now_ns
        starts = self.station.starts
        while self.station.starts == starts:
            self._turn()
        self.found.recoveries_s.append((self.line.now_ns - self._on_ns) / S)

    def _ramp(self) -> int:
        return self.device.channels[0].number(RAMP_VELOCITY.major, RAMP_VELOCITY.minor)

    def _tap(self, direction: Direction, data: bytes, age_s: float) -> None: ...

    # -- what the driver believes --------------------------------------------------------------------

    def _look(self) -> None:
        """Process data that are called fresh are those that the twin gave in this very exchange."""
        station = self.station
        if station.inputs_s is None or station.inputs_s == self._seen_s:
            return
        self._seen_s = station.inputs_s
        self.found.fresh += 1
        if self._transmitted_ns < self._turn_ns:
            self._wrong(f"inputs of {self._transmitted_ns / S:.3f} s are called fresh")
        if station.inputs != self._transmitted[pkw.SIZE :]:
            self._wrong(f"inputs {station.inputs.hex()}, given were {self._transmitted.hex()}")

    def _ask(self) -> None:
        station = self.station
        if self._busy or station.state is not StationState.EXCHANGING:
            return
        station.image.order = AS_PKW
        choice = self._random.random()
        if choice < 0.1 and not station.image.busy:
            self._edge(station)
        elif choice < 0.5:
            self._write(station)
        else:
            self._read(station)

    def _read(self, station: Station) -> None:
        self._busy = True
        before = self._ramp()

        def end(result: Result, _sent: bool) -> None:
            self._busy = False
            if isinstance(result, Failure):
                self.found.timeouts += 1
                return
            self.found.reads += 1
            value = int.from_bytes(result.data or b"", "little")
            if value not in (before, self._ramp()):
                self._wrong(f"read {value}, it is {self._ramp()} and was {before}")

        station.channel.put(PkwJob(pkw.read(RAMP_VELOCITY), 2.0, end))

    def _write(self, station: Station) -> None:
        self._busy = True
        wanted = 1000 + self._random.randrange(50_000)

        def end(result: Result, sent: bool) -> None:
            self._busy = False
            if isinstance(result, Failure):
                self.found.open_writes += sent
                return
            self.found.writes += 1
            if self._ramp() != wanted:
                self._wrong(f"{wanted} is called written, and {self._ramp()} stands there")

        station.channel.put(PkwJob(pkw.write(RAMP_VELOCITY, wanted.to_bytes(4, "little")), 2.0, end))

    def _edge(self, station: Station) -> None:
        word = NEW_SETPOINT - station.image.controlword
        known = len(self._received)

        def end(failure: Failure | None, _sent: bool) -> None:
            if failure is not None:
                return
            self.found.edges += 1
            if word not in self._received[max(0, known - 1) :]:
                self._wrong(f"controlword {word:04X}h is called delivered, taken were {self._received[-3:]}")

        station.image.put(Change({CONTROL_WORD: word}, end))

    def _wrong(self, what: str) -> None:
        self.found.wrong.append(f"{self.line.now_ns / S:.3f} s: {what}")


@contextmanager
def library_clock(line: DpLine) -> Iterator[None]:
    """The library reads the time of the line."""

    def now_s() -> float:
        return line.now_ns / S

    with (
        patch.object(pyprofibus.util, "monotonic_time", now_s),
        patch.object(pyprofibus.phy, "monotonic_time", now_s),
        patch.object(pyprofibus.dp_master, "monotonic_time", now_s),
    ):
        yield
