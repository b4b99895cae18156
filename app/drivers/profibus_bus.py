"""A PROFIBUS line and its stations on a thread of their own: opened, listened to, run, left, and opened again.

A turn of the line gives every station its own. Others hand in what is to be done by ``post``; it is done between turns.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import Final

from app.drivers.contract import LinkState
from app.drivers.profibus_config import ProfibusConfig, ProfibusStation, require_fits, require_node
from app.drivers.profibus_line import Line, LineError
from app.drivers.profibus_port import ProfibusPort, Tap
from app.drivers.profibus_station import Station, StationState
from app.errors import BusLostError, BusOpenError, ForeignMasterError
from app.wire.frame import Stamper
from app.wire.profibus.telegrams import TelegramType

_LOG: Final = logging.getLogger(__name__)
LISTEN_S: Final = 0.5
"""How long the line has to be quiet before the first telegram; a master alone on its line is never so for 100 ms."""
SILENT_S: Final = 1.0
"""Without a right answer for so long nobody is connected, whatever state was reached before."""
_REOPEN_S: Final = (0.2, 0.5, 1.0, 2.0)
DEAD_MAN_S: Final = 1.0
"""Whoever commands axes shows that he is there; silent for so long, all of them get a controlword of 0."""
_STILL_S: Final = 0.3
"""More than a turn takes: for what goes beyond it the host stood still, and so did everybody."""
_NOBODY_S: Final = 0.05
"""How often to look where no station is spoken to."""

Open = Callable[[], Line]
Posted = Callable[["ProfibusBus"], None]


class ProfibusBus:
    """The line of ``config``. ``tap`` gets what crosses it, ``on_change`` is called when a state has changed.

    Both are called on the thread of the bus.
    """

    def __init__(
        self, config: ProfibusConfig, bus: str, stamper: Stamper, open_line: Open, tap: Tap,
        on_change: Callable[[], None], listen_s: float = LISTEN_S,
    ) -> None:  # fmt: skip
        self.config = config
        self.bus = bus
        self.state = LinkState.CLOSED
        self.reason = ""
        self.since_ns = stamper()
        self.reconnects = 0
        self.error: BusOpenError | BusLostError | None = None
        """Why the line is not open."""
        self.port: ProfibusPort | None = None
        self.stations: dict[int, Station] = {}
        self._stamper = stamper
        self._open_line = open_line
        self._tap = tap
        self._on_change = on_change
        self._listen_s = listen_s
        self._alive = self._seen_alive = 0
        self._silence_s = self._turned_s = 0.0
        self._posted: deque[Posted] = deque()
        self._wake = threading.Event()
        self._closing = False
        self._thread: threading.Thread | None = None
        for station in config.stations:
            self._add(station)

    # -- any thread --------------------------------------------------------------------------------

    def start(self) -> None:
        """Open the line on its thread, and go on until ``stop``."""
        self._closing = False
        self._thread = threading.Thread(target=self._run, name=f"profibus {self.bus}", daemon=True)
        self._thread.start()

    def stop(self, timeout_s: float) -> None:
        """Leave the line and wait for the end. Raises TimeoutError."""
        thread, self._thread = self._thread, None
        self._closing = True
        self._wake.set()
        if thread is not None:
            thread.join(timeout_s)
            if thread.is_alive():
                raise TimeoutError

    def alive(self) -> None:
        """Whoever commands axes is there."""
        self._alive += 1

    def post(self, do: Posted) -> None:
        """Have ``do`` called on the thread of the bus, between two turns."""
        self._posted.append(do)
        self._wake.set()

    # -- the thread of the bus -----------------------------------------------------------------------

    def station(self, node: int) -> Station:
        """The one at ``node``; from now on it is spoken to. Raises UsageError."""
        found = self.stations.get(node)
        if found is None:
            require_node(node, self.config.master)
            found = self._add(ProfibusStation(node))
        return found

    def open(self) -> None:
        """Open the line and listen; nothing is sent. Raises BusOpenError, ForeignMasterError."""
        line: Line | None = None
        try:
            line = self._open_line()
            port = ProfibusPort(line, self.bus, self.config.baud, self.config.master, self._tap)
            self._become(LinkState.LISTENING, "")
            port.listen(self._listen_s)
            self.port = port
        except LineError as error:
            if line is not None:
                line.close()
            raise BusOpenError(bus=self.bus, reason=f"{self.config.port}: {error}") from error
        except ForeignMasterError:
            assert line is not None  # it was heard on it
            line.close()
            raise

    def turn(self) -> float:
        """Once around; gives in how many seconds to come again. Raises LineError, ForeignMasterError."""
        while self._posted:
            self._posted.popleft()(self)
        assert self.port is not None  # it was opened
        self._mind_silence(self.port.line.now_s())
        waits_s = [station.turn(self.port) for station in list(self.stations.values())]
        self._judge()
        return min(waits_s, default=_NOBODY_S)

    def leave(self) -> None:
        """Bring all axes to rest, give all slaves back, and close the line."""
        port, self.port = self.port, None
        if port is None:
            return
        try:
            for station in self.stations.values():
                station.leave(port)
        except (LineError, ForeignMasterError) as error:
            _LOG.info("%s was left without a word: %s", self.bus, error)
        port.line.close()

    def _run(self) -> None:
        attempt = 0
        while not self._closing:
            try:
                self.open()
                self._on_change()
                attempt = 0
                while not self._closing:
                    wait_s = self.turn()
                    if wait_s > 0 and self._wake.wait(wait_s):
                        self._wake.clear()
            except (BusOpenError, LineError) as error:
                self._lose(error)
            except Exception as error:  # noqa: BLE001 - whatever it is, who waits must not wait for ever
                _LOG.exception("%s failed", self.bus)
                self._lose(LineError(f"{type(error).__name__}: {error}"))  # who waits is told, the line begins anew
            if self.port is None and not self._closing:
                self._wake.clear()
                self._wake.wait(_REOPEN_S[min(attempt, len(_REOPEN_S) - 1)])
                attempt += 1
                self.reconnects += 1
        self.leave()
        self._forget(BusLostError(bus=self.bus, reason=LinkState.CLOSED.value))
        self._become(LinkState.CLOSED, LinkState.CLOSED.value)

    def _lose(self, error: BusOpenError | LineError) -> None:
        """The line is gone, or not ours: on it nothing more is said, not even goodbye."""
        port, self.port = self.port, None
        if port is not None:
            port.line.close()
        lost = error if isinstance(error, BusOpenError) else BusLostError(bus=self.bus, reason=str(error))
        _LOG.info("%s: %s", self.bus, lost)
        self._forget(lost)
        self._become(LinkState.LOST, str(lost.details.get("reason", lost.code)))

    def _forget(self, error: BusOpenError | BusLostError) -> None:
        self.error = error
        while self._posted:  # what was handed in by now ends with all the rest
            try:
                self._posted.popleft()(self)
            except Exception:  # noqa: BLE001 - the others are told all the same
                _LOG.exception("what was handed in to %s failed", self.bus)
        for station in self.stations.values():
            station.lost()

    def _mind_silence(self, now_s: float) -> None:
        """The thread would feed the last controlword for ever: where who minds it hangs, the axes are let go."""
        passed_s, self._turned_s = min(now_s - self._turned_s, _STILL_S), now_s
        if self._alive != self._seen_alive:
            self._seen_alive, self._silence_s = self._alive, 0.0
            return
        self._silence_s += passed_s
        if self._silence_s > DEAD_MAN_S:
            for station in self.stations.values():
                station.let_go()

    def _judge(self) -> None:
        """Connected is who was heard a short while ago, whatever the master believes."""
        assert self.port is not None  # the caller has looked
        last_s = self.port.last_input_s
        heard = last_s is not None and self.port.line.now_s() - last_s <= SILENT_S
        if heard:
            self.error = None
            self._become(LinkState.CONNECTED, "")
        elif not self.stations:
            self.error = None
            self._become(LinkState.LISTENING, "")
        elif self.state is not LinkState.LOST and all(one.looked_s is not None for one in self.stations.values()):
            self._become(LinkState.LOST, "no station answers")

    def _become(self, state: LinkState, reason: str) -> None:
        if (state, reason) != (self.state, self.reason):
            self.state, self.reason, self.since_ns = state, reason, self._stamper()
            self._on_change()

    def _add(self, config: ProfibusStation) -> Station:
        station = Station(config, self.bus, lambda _station: self._on_change(), self._require_fits)
        self.stations[config.node] = station
        return station

    def _require_fits(self, added: Station, telegram: TelegramType) -> None:
        """Raises UsageError where the line has no time for one more."""
        others = [
            one.telegram for one in self.stations.values() if one is not added and one.state is not StationState.ABSENT
        ]
        require_fits((*others, telegram), self.config.baud)
