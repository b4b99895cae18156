"""One bus of a connection: its driver, and what becomes of every frame that the driver hands over."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from threading import Lock
from typing import Any, Protocol

from app.drivers.contract import DriverStatus, OrderStanding
from app.model.address import Address
from app.model.description import Bus, Description
from app.model.site import BusConfig, Turbine
from app.service.bus_driver import bitrate_of, make_driver
from app.service.bus_feed import BusFeed
from app.service.office.foreign_writes import ForeignWrites
from app.service.options import Options
from app.wire.frame import Can, Frame, Stamper
from app.wire.live import LiveState
from app.wire.nmt import NmtState
from app.wire.profibus.order_proof import read_order
from app.wire.records import Record, Source


class FrameSink(Protocol):
    """Takes every frame in order and never blocks: the recorder."""

    def write(self, frames: Sequence[Frame]) -> None:
        """Take a batch."""


Listener = Callable[[Sequence[Record]], None]
"""Hears what the frames say, gaps too, on the driver's receive thread; never raises and never waits."""


class BusLink(BusFeed):
    """A bus: what its driver hears goes to the recorder first.

    ``on_frames`` runs on the driver's receive thread. ``known`` are the descriptions that a scan may recognise.
    """

    def __init__(
        self,
        config: BusConfig,
        turbine: Turbine,
        descriptions: Mapping[int, Description],
        known: Sequence[Description],
        live: LiveState,
        lock: Lock,
        stamper: Stamper,
        options: Options,
    ) -> None:
        self.kind = config.kind
        servers = None
        if self.kind is Bus.MODBUS_TCP:
            servers = {node: server.text for node, server in turbine.servers(config.name).items()}
        orders = {
            device.node: read_order(device.slave.pzd_order)
            for device in turbine.devices
            if device.bus == config.name and device.slave.pzd_order
        }
        super().__init__(config.name, bitrate_of(config), descriptions, live, lock, servers, config.kind, orders)
        self.adapter = config.connection
        self.sink: FrameSink | None = None
        self.foreign: ForeignWrites | None = None
        self.listeners: tuple[Listener, ...] = ()
        self.driver: Any = make_driver(config, turbine, known, stamper, options)
        for node, description in descriptions.items():
            self.describe(node, description)
        self.driver.subscribe(self.on_frames)
        if self.kind is Bus.MODBUS_TCP:
            self.driver.on_lost(lambda: self.gap(stamper()))

    def describe(self, node: int, description: Description) -> None:
        """Tell decoder, live state and driver what stands at ``node``."""
        super().describe(node, description)
        self.driver.set_description(node, description)

    def was_away(self, t_ns: int) -> None:
        """The link was seen to be gone, or to be back.

        A TCP connection tells its end at once, before there is a next one: what is read on that one stays proven.
        """
        if self.kind is not Bus.MODBUS_TCP:
            self.gap(t_ns)

    def on_frames(self, frames: list[Frame]) -> None:
        """Record, count, decode."""
        if self.sink is not None:
            self.sink.write(frames)
        self.take(frames)

    def _heard(self, records: Sequence[Record]) -> None:
        if self.foreign is not None:
            self.foreign.heard(records)  # before the live state: it still knows what was there
        self._tell(records)

    def _missed(self, records: Sequence[Record]) -> None:
        self._tell(records)

    def _tell(self, records: Sequence[Record]) -> None:
        for listener in self.listeners:
            listener(records)

    def listen(self, listener: Listener) -> None:
        """Have ``listener`` told from now on."""
        self.listeners = (*self.listeners, listener)

    def unlisten(self, listener: Listener) -> None:
        """Tell it no longer; nothing happens where it is not told."""
        self.listeners = tuple(one for one in self.listeners if one != listener)

    @property
    def status(self) -> DriverStatus:
        """State of the link."""
        status: DriverStatus = self.driver.status
        return status

    def says_twin(self, node: int) -> bool | None:
        """Whether ``node`` says by its bus that it is simulated; None where it would say so by its name."""
        said: bool | None = self.driver.says_twin(node)
        return said

    @property
    def needs_consent(self) -> bool:
        """Another master is at work, and nobody has consented to active access yet."""
        return bool(getattr(self.driver, "needs_consent", False))  # where only one can be, there is no other master

    async def order_check(self, node: int) -> OrderStanding | None:
        """How the proof of the order of process data stands; None where there is nothing to be proven.

        What is not proven yet is compared now, by reading alone. Raises BusLostError, NoAnswerError, DeviceError.
        """
        ask = getattr(self.driver, "order_standing", None)
        if ask is None:
            return None
        standing: OrderStanding = await ask(node)
        return standing

    @property
    def has_pdos(self) -> bool:
        """Commands go at once by PDO there, and devices can watch our heartbeat: CAN. Else they are written."""
        return self.kind is Bus.CANOPEN

    def send_pdo(self, node: int, address: Address, data: bytes) -> bool:
        """Send ``data`` by the receive PDO of ``node`` that carries ``address`` and nothing else, and works at once.

        False where it has to be written as well: the node is not operational, no such PDO is in force or the only ones
        wait for a SYNC (nothing was sent then), or an earlier write of ours to the object may be executed only now.
        Raises BusLostError.
        """
        view = self._live.node(self.name, node)
        if not self.has_pdos or view is None or view.state is not NmtState.OPERATIONAL or view.silent:
            return False
        for route in self.pdos(node):
            entries = route.mapping.entries
            carries = len(entries) == 1 and entries[0] == (address, 8 * len(data))
            if route.source is Source.PDO_RX and carries and route.at_once:
                return bool(self.driver.command_raw(node, address, Can(route.can_id, data, route.extended)))
        return False
