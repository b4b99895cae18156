"""The driver for PROFIBUS-DP as the Wandfluh ED2 speaks it: DP-V0, parameters by PKW, process data of its telegrams.

It is the only master of its line. Stations of the configuration are run from the start, others from when they are asked
for something first. A device has no restart command: it is restarted by switching it off and on.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Final

from app.drivers.contract import (
    DriverStatus,
    FoundNode,
    FramesCallback,
    LinkState,
    OrderStanding,
    ProgressCallback,
    Written,
)
from app.drivers.profibus_bus import LISTEN_S, ProfibusBus
from app.drivers.profibus_config import ProfibusConfig, checked, require_node
from app.drivers.profibus_device import ProfibusDevice
from app.drivers.profibus_line import Line, SerialLine
from app.drivers.profibus_order import OrderCheck
from app.drivers.profibus_probe import Probed
from app.drivers.profibus_save import save
from app.drivers.profibus_scan import TWIN_IDENT, found_node, is_twin, look
from app.drivers.profibus_startup import STATUSWORD
from app.drivers.profibus_station import StationState
from app.drivers.profibus_taps import Taps
from app.drivers.profibus_view import StationView, look_at
from app.drivers.urgent import UrgentCommands
from app.errors import (
    BusLostError,
    BusOpenError,
    DeviceError,
    HubsideError,
    NoAnswerError,
)
from app.model.address import Address
from app.model.description import Bus, Description, Verify
from app.wire.frame import Stamper
from app.wire.profibus.control import Station as StationKind
from app.wire.profibus.fdl import MAX_ADDRESS

_PROGRESS_S: Final = 0.05
_BEAT_S: Final = 0.2
Open = Callable[[ProfibusConfig], Line]


def open_serial(config: ProfibusConfig) -> Line:
    """The port of ``config``. Raises LineError."""
    return SerialLine(config.port, config.baud)


class ProfibusDriver:
    """The stations of ``config`` as the bus ``bus``. ``stamper`` gives frames their times."""

    ends_when_silent: Final = True
    ends_with_restart: Final = False
    restarts_by_hand: Final = True

    def __init__(
        self, config: ProfibusConfig, stamper: Stamper, bus: str = "profibus0",
        descriptions: Sequence[Description] = (), open_line: Open = open_serial, listen_s: float = LISTEN_S,
    ) -> None:  # fmt: skip
        self.bus = bus
        self._config = checked(config)
        self._stamper = stamper
        self._descriptions = tuple(each for each in descriptions if each.bus is Bus.PROFIBUS_DP)
        self._commands = UrgentCommands()
        self._taps = Taps(bus, stamper)
        self._devices: dict[int, ProfibusDevice] = {}
        self._open_line = open_line
        self._listen_s = listen_s
        self._changed = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._line = self._new_bus()
        self._open = False
        self._beating: asyncio.Task[None] | None = None

    def _new_bus(self) -> ProfibusBus:
        config, open_line = self._config, self._open_line
        return ProfibusBus(
            config, self.bus, self._stamper, lambda: open_line(config), self._taps, self._tell_change, self._listen_s
        )

    # -- the link -------------------------------------------------------------------------

    async def connect(self, timeout_s: float = 5.0) -> None:
        """Open the port and listen, then begin with the stations; returns once each was asked.

        Raises BusOpenError, also where nothing of all that has happened in time, and ForeignMasterError where anybody
        else speaks on the line: nothing was sent then.
        """
        if self._open:
            return
        self._loop = asyncio.get_running_loop()
        self._line, self._open = self._new_bus(), True
        for device in self._devices.values():
            device.renew(self._line)
        self._line.start()
        try:
            async with asyncio.timeout(timeout_s):
                await self._until(lambda: self._line.error is not None or self._begun)
        except TimeoutError:
            await self.close()
            raise BusOpenError(bus=self.bus, reason=f"{self._config.port}: not open within {timeout_s:g} s") from None
        except asyncio.CancelledError:
            await self.close()
            raise
        error = self._line.error
        if error is not None:
            await self.close()
            raise error
        self._beating = asyncio.create_task(self._beat())

    async def _beat(self) -> None:
        """The line lets axes go where this stops: see ``ProfibusBus.alive``."""
        while True:
            self._line.alive()
            await asyncio.sleep(_BEAT_S)

    @property
    def _begun(self) -> bool:
        if not self._config.stations:
            return self._line.state is LinkState.LISTENING and self._line.port is not None
        first = [self._line.stations[each.node] for each in self._config.stations]
        waits = [each for each in first if each.looked_s is None or each.state is StationState.STARTING]
        return self._line.state in (LinkState.CONNECTED, LinkState.LOST) and not waits

    async def close(self, timeout_s: float = 5.0) -> None:
        """Bring axes to rest, give the slaves back and close the port; what runs ends with BusLostError."""
        if self._open:
            self._open = False
            if self._beating is not None:
                self._beating.cancel()
                await asyncio.gather(self._beating, return_exceptions=True)
                self._beating = None
            await asyncio.to_thread(self._line.stop, timeout_s)

    @property
    def status(self) -> DriverStatus:
        """Connected is a line on which a station has answered a short while ago; there is never another master."""
        line = self._line
        return DriverStatus(self.bus, line.state, line.since_ns, line.reason, 0, line.reconnects, ())

    def says_twin(self, node: int) -> bool | None:
        """See Driver. By its ident number, as it was told last."""
        station = self._line.stations.get(node)
        diagnosis = None if station is None else station.diagnosis
        return None if diagnosis is None else diagnosis.ident == TWIN_IDENT

    @property
    def problem(self) -> HubsideError | None:
        """Why the line is not open; None while it is."""
        return self._line.error

    def subscribe(self, callback: FramesCallback) -> Callable[[], None]:
        """See Driver."""
        return self._taps.subscribe(callback)

    def _tell_change(self) -> None:
        """On the thread of the bus."""
        if self._loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._changed.set)

    async def _until(self, holds: Callable[[], bool]) -> None:
        while not holds():
            self._changed.clear()
            if not holds():
                await self._changed.wait()

    def set_description(self, node: int, description: Description) -> None:
        """Take time-outs, names and the save command of ``node`` from its description."""
        self._device(node).description = description

    # -- parameters ----------------------------------------------------------------------------

    async def read(self, node: int, address: Address, timeout_s: float | None = None, urgent: bool = False) -> bytes:
        """See Driver. By PKW. Raises PkwRefusedError, NoAnswerError, BusLostError."""
        return await self._opened(node).read(address, timeout_s, urgent)

    async def read_many(
        self,
        node: int,
        addresses: Iterable[Address],
        timeout_s: float | None = None,
        on_progress: ProgressCallback | None = None,
        urgent: bool = False,
    ) -> dict[Address, bytes | HubsideError]:
        """See Driver. A station that does not answer ends the list: the rest is that error."""
        device, wanted = self._device(node), tuple(dict.fromkeys(addresses))
        results: dict[Address, bytes | HubsideError] = {}
        told_s = time.monotonic()
        for address in wanted:
            try:
                self._opened(node)
                results[address] = await device.read(address, timeout_s, urgent)
            except DeviceError as error:
                results[address] = error
            except NoAnswerError as error:
                results.update((other, error) for other in wanted if other not in results)
                break
            if on_progress is not None and time.monotonic() - told_s >= _PROGRESS_S:
                told_s = time.monotonic()
                on_progress(len(results), len(wanted))
        if on_progress is not None:
            on_progress(len(results), len(wanted))
        return results

    async def write(
        self,
        node: int,
        address: Address,
        data: bytes,
        timeout_s: float | None = None,
        verify: Verify = Verify.EQUAL,
        urgent: bool = False,
        known: int | None = None,
    ) -> Written:
        """See Driver. What process data carry is written there; no bit of the controlword before their order is proven.

        Raises PreconditionError where it cannot be proven.
        """
        device = self._opened(node)
        if urgent:
            known = self._commands.note(node, address)
        return await device.write(address, data, timeout_s, verify, urgent, known)

    def commanded(self, node: int, address: Address) -> int:
        """See Driver."""
        return self._commands.count(node, address)

    async def check_order(self, node: int) -> OrderCheck:
        """The guided check of the order of process data: what PKW reads, compared with them."""
        return await self._opened(node).startup.check_order()

    async def order_standing(self, node: int) -> OrderStanding:
        """Whether a bit of the controlword may be sent; what is not proven yet is compared now, by reading alone."""
        if (await self.view(node)).order is not None:
            return OrderStanding(True, "profibus.order.proven")
        check = await self.check_order(node)
        return OrderStanding(check.proven is not None, check.reason_key)

    async def view(self, node: int) -> StationView:
        """Where the station at ``node`` is, and its process data. Raises BusLostError."""
        proven = self._device(node).startup.proven
        shown = await look_at(self._line, node, proven) if self._open and self._line.error is None else None
        if shown is None:
            raise BusLostError(bus=self.bus, node=node, reason=self._line.reason or LinkState.CLOSED.value)
        return shown

    # -- the whole device -----------------------------------------------------------------------

    async def save(self, node: int, category: str | None = None) -> None:
        """Save all parameters by db_StoreParameter, with the axis not enabled. Not proven before a restart.

        Raises PreconditionError (the axis is enabled: nothing was saved), UsageError, and what writes raise.
        """
        await save(self._opened(node), category)

    async def bears(self, node: int, stamp: tuple[int, int]) -> bool:
        """A save leaves no mark in this device."""
        return False

    async def restart(self, node: int, timeout_s: float = 10.0) -> None:
        """Wait until somebody has switched the device off and on: it must fall silent, then exchange data again.

        Raises NoAnswerError where it is not there, or not back in time.
        """
        device = self._opened(node)
        station = device.station
        if station is None or station.state is not StationState.EXCHANGING:
            await device.read(STATUSWORD, timeout_s)
            station = device.station
        assert station is not None  # it has answered
        starts = station.starts
        try:
            async with asyncio.timeout(timeout_s):
                await self._until(lambda: station.starts > starts)
        except TimeoutError:
            raise NoAnswerError(node=node, address="restart", timeout_s=timeout_s) from None

    async def scan(
        self, nodes: Sequence[int] | None = None, on_progress: ProgressCallback | None = None
    ) -> list[FoundNode]:
        """Ask ``nodes``, or all addresses, who is there. Whom we know no description of is found as well."""
        master = self._config.master
        wanted = [node for node in range(MAX_ADDRESS + 1) if node != master] if nodes is None else list(nodes)
        found = []
        for number, node in enumerate(wanted, 1):
            require_node(node, master)
            self._opened(node)
            probed = await look(self._line, node)
            if probed is not None and probed.kind is StationKind.SLAVE:
                found.append(self._found(node, probed))
            if on_progress is not None:
                on_progress(number, len(wanted))
        return found

    def _found(self, node: int, probed: Probed) -> FoundNode:
        """The manual prints no ident number: who is named in the configuration is the device, and so is our twin."""
        named = is_twin(probed) or any(each.node == node for each in self._config.stations)
        matching = self._descriptions[0] if len(self._descriptions) == 1 and named else None
        if matching is not None:
            self._device(node).description = matching
        return found_node(node, probed, matching)

    def _opened(self, node: int) -> ProfibusDevice:
        """Raises UsageError, BusLostError, and what keeps the station from being run."""
        device = self._device(node)
        if not self._open:
            raise BusLostError(bus=self.bus, node=node, reason=self._line.reason or LinkState.CLOSED.value)
        device.require_open()
        return device

    def _device(self, node: int) -> ProfibusDevice:
        device = self._devices.get(node)
        if device is None:
            require_node(node, self._config.master)
            device = self._devices[node] = ProfibusDevice(self._line, node, self._commands)
            if len(self._descriptions) == 1:
                device.description = self._descriptions[0]
        return device
