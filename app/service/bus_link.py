"""One bus of a connection: its driver, and what becomes of every frame that the driver hands over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from threading import Lock
from typing import Any, Final, Protocol

from app.drivers.can_config import parse_can
from app.drivers.contract import DriverStatus, LinkState
from app.drivers.table import driver_class
from app.model.address import Address
from app.model.description import Bus, Description
from app.model.site import BusConfig
from app.service.office.foreign_writes import ForeignWrites
from app.service.options import Options
from app.service.trace.log import BusTrace
from app.wire.busload import EXTENDED_KEY, BusLoad, LoadSecond
from app.wire.can_bits import frame_bits
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Frame, Stamper
from app.wire.live import LiveState
from app.wire.nmt import NmtState
from app.wire.pdo_follower import PdoRoute
from app.wire.records import Source

GAP_REASON: Final = "gap.bus_lost"


class FrameSink(Protocol):
    """Takes every frame in order and never blocks: the recorder."""

    def write(self, frames: Sequence[Frame]) -> None:
        """Take a batch."""


class BusLink:
    """A CANopen bus: frames go to the recorder, through the decoder into the live state, and count as bus load.

    ``on_frames`` runs on the driver's receive thread; ``lock`` is shared by all buses of a connection, because the live
    state has one writer at a time. ``descriptions`` by node; ``known`` are those that a scan may recognise.
    """

    def __init__(
        self,
        config: BusConfig,
        descriptions: Mapping[int, Description],
        known: Sequence[Description],
        live: LiveState,
        lock: Lock,
        stamper: Stamper,
        options: Options,
    ) -> None:
        self.name = config.name
        with_rate = "@" in config.connection or not config.bitrate
        can = parse_can(config.connection if with_rate else f"{config.connection}@{config.bitrate}")
        self.bitrate = can.bitrate
        self.adapter = config.connection
        self.decoder = CanOpenDecoder(config.name, descriptions)
        self.load = BusLoad(self.bitrate)
        self.trace = BusTrace(config.name, self.decoder, lock)
        self.frames = 0
        self.sink: FrameSink | None = None
        self.foreign: ForeignWrites | None = None
        self._live = live
        self._lock = lock
        self._state = LinkState.CLOSED
        self.driver: Any = driver_class(Bus.CANOPEN)(
            can,
            stamper,
            config.name,
            known,
            consent=options.consent,
            listen_s=options.listen_s,
        )
        for node, description in descriptions.items():
            self.describe(node, description)
        self.driver.subscribe(self.on_frames)

    def describe(self, node: int, description: Description) -> None:
        """Tell decoder, live state and driver what stands at ``node``."""
        with self._lock:
            self.decoder.set_description(node, description)
            self.trace.describe(node, description)
            self._live.set_description(self.name, node, description)
        self.driver.set_description(node, description)

    def on_frames(self, frames: list[Frame]) -> None:
        """Record, count, decode."""
        if self.sink is not None:
            self.sink.write(frames)
        with self._lock:
            self.frames += len(frames)
            count = self.load.feed
            for t_ns, _, _, can, _ in frames:
                if type(can) is Can:
                    count(t_ns, frame_bits(can), can.can_id, can.extended)
            self.trace.take(frames)
            records = self.decoder.feed_all(frames)
            if records:
                self.trace.heard(records)
                if self.foreign is not None:
                    self.foreign.heard(records)  # before the live state: it still knows what was there
                self._live.apply_all(records)

    def gap(self, t_ns: int) -> None:
        """Frames are missing before ``t_ns``: what was read until then proves nothing any more."""
        with self._lock:
            self.trace.gap(t_ns, GAP_REASON)
            records = self.decoder.gap(t_ns, GAP_REASON)
            self.trace.heard(records)
            self._live.apply_all(records)

    def bus_load(self, now_ns: int) -> float:
        """Load of the last second, 0..1."""
        with self._lock:
            return self.load.load(now_ns)

    def node_load(self, now_ns: int) -> dict[int, float]:
        """Load of the last second by node; 0 is what belongs to none."""
        with self._lock:
            return self.load.shares_by(self._node_of, now_ns)

    def identifier_load(self, now_ns: int) -> dict[int, float]:
        """Load of the last second by identifier; 29-bit identifiers have 2^29 added."""
        with self._lock:
            return self.load.shares(now_ns)

    def load_history(self, seconds: int) -> tuple[list[LoadSecond], list[tuple[int, dict[int, float]]]]:
        """The last full seconds, oldest first: the load, and the load by node."""
        with self._lock:
            return list(self.load.history)[-seconds:], self.load.history_by(self._node_of)[-seconds:]

    def _node_of(self, key: int) -> int:
        return self.decoder.speaker(key & ~EXTENDED_KEY, bool(key & EXTENDED_KEY)).node

    @property
    def status(self) -> DriverStatus:
        """State of the link."""
        status: DriverStatus = self.driver.status
        return status

    @property
    def needs_consent(self) -> bool:
        """Another master is at work, and nobody has consented to active access yet."""
        return bool(self.driver.needs_consent)

    def pdos(self, node: int) -> tuple[PdoRoute, ...]:
        """The PDOs of ``node`` by the mapping in force."""
        with self._lock:
            return self.decoder.pdos(node)

    def send_pdo(self, node: int, address: Address, data: bytes) -> bool:
        """Send ``data`` by the receive PDO of ``node`` that carries ``address`` and nothing else.

        False where it has to be written as well: the node is not operational, no such PDO is in force (nothing was
        sent then), or an earlier write of ours to the object may be executed only now. Raises BusLostError.
        """
        view = self._live.node(self.name, node)
        if view is None or view.state is not NmtState.OPERATIONAL or view.silent:
            return False
        for route in self.pdos(node):
            entries = route.mapping.entries
            if route.source is Source.PDO_RX and len(entries) == 1 and entries[0] == (address, 8 * len(data)):
                return bool(self.driver.command_raw(node, address, Can(route.can_id, data, route.extended)))
        return False
