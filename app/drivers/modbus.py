"""The driver for Modbus TCP as the Nanotec PD4-E speaks it: reads, writes, saves, restarts and finds its devices.

Every device has a connection of its own, with one transaction at a time; a bus is the devices that are shown together.
Whether another master talks to them cannot be seen from here: a TCP connection shows only itself.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from datetime import UTC, datetime
from typing import Final

from app.drivers import modbus_restart, modbus_save
from app.drivers.contract import (
    DriverStatus,
    FoundNode,
    FramesCallback,
    Identity,
    LinkState,
    ProgressCallback,
    Written,
)
from app.drivers.modbus_backup import read_dictionary
from app.drivers.modbus_config import MAX_NODE, ModbusConfig
from app.drivers.modbus_device import ModbusDevice
from app.drivers.modbus_process import MAPPINGS, ProcessData
from app.drivers.modbus_save import Stamp
from app.drivers.modbus_verify import Finding, compare
from app.drivers.scan import match
from app.drivers.urgent import UrgentCommands
from app.errors import (
    BusLostError,
    BusOpenError,
    DeviceError,
    HubsideError,
    ModbusExceptionError,
    NoAnswerError,
    ProtocolError,
    UsageError,
)
from app.model.address import Address
from app.model.description import Bus, Description, Verify
from app.wire.frame import Frame, Stamper
from app.wire.modbus.functions import ModbusException

_LOG: Final = logging.getLogger(__name__)
BULK: Final = 64
"""A list of so many objects is read by FC 101 first, and what that does not give one by one."""
DEVICE_TYPE: Final = Address(0x1000)
DEVICE_NAME: Final = Address(0x1008)
HARDWARE: Final = Address(0x1009)
SOFTWARE: Final = Address(0x100A)
IDENTITY: Final = tuple(Address(0x1018, sub) for sub in (1, 2, 3, 4))
_ASKED: Final = (DEVICE_TYPE, DEVICE_NAME, HARDWARE, SOFTWARE, *IDENTITY)
_SCAN_TIMEOUT_S: Final = 0.5
_RETURN_S: Final = 5.0
_PROGRESS_S: Final = 0.05


def _now() -> datetime:
    return datetime.now(UTC)


class ModbusDriver:
    """The devices of ``config`` as the bus ``bus``. ``stamper`` gives frames their times, ``now`` stamps saves."""

    ends_when_silent: Final = True
    ends_with_restart: Final = True
    restarts_by_hand: Final = False

    def __init__(
        self, config: ModbusConfig, stamper: Stamper, bus: str = "modbus0",
        descriptions: Sequence[Description] = (), now: Callable[[], datetime] = _now,
    ) -> None:  # fmt: skip
        self.bus = bus
        self._descriptions = tuple(each for each in descriptions if each.bus is Bus.MODBUS_TCP)
        self._now = now
        self._commands = UrgentCommands()
        self._subscribers: list[FramesCallback] = []
        self._devices: dict[int, ModbusDevice] = {}
        self._process: dict[int, ProcessData] = {}
        for peer in config.peers:
            device = ModbusDevice(peer, bus, stamper, self._tap, self._commands)
            if len(self._descriptions) == 1:
                device.description = self._descriptions[0]
            self._devices[peer.node] = device
            self._process[peer.node] = ProcessData(device)

    # -- the link -------------------------------------------------------------------------

    async def connect(self, timeout_s: float = 5.0) -> None:
        """Open the connections, all at a time; nothing is sent. Raises BusOpenError where none can be opened.

        A device that cannot be reached now is not tried again: a scan does.
        """
        results = await asyncio.gather(
            *(device.open(timeout_s) for device in self._devices.values()), return_exceptions=True
        )
        errors = [result for result in results if isinstance(result, BaseException)]
        for error in errors:
            if not isinstance(error, BusOpenError):
                raise error
        if errors and len(errors) == len(results):
            raise errors[0]

    async def close(self, timeout_s: float = 5.0) -> None:
        """End all that runs with BusLostError and close the connections."""
        async with asyncio.timeout(timeout_s):
            await asyncio.gather(*(device.close() for device in self._devices.values()))

    @property
    def status(self) -> DriverStatus:
        """The worst state of those devices that were reached at all; other masters cannot be seen."""
        devices = list(self._devices.values())
        if not devices:
            return DriverStatus(self.bus, LinkState.CLOSED, 0, "", 0, 0, ())
        reached = [device for device in devices if device.state is not LinkState.CLOSED] or devices
        worst = next((device for device in reached if device.state is not LinkState.CONNECTED), reached[0])
        reconnects = sum(device.reconnects for device in devices)
        return DriverStatus(self.bus, worst.state, worst.since_ns, worst.reason, 0, reconnects, ())

    def says_twin(self, node: int) -> None:
        """See Driver. By its name."""

    def subscribe(self, callback: FramesCallback) -> Callable[[], None]:
        """See Driver. Called in the event loop."""
        self._subscribers = [*self._subscribers, callback]

        def unsubscribe() -> None:
            self._subscribers = [each for each in self._subscribers if each is not callback]

        return unsubscribe

    def _tap(self, frame: Frame) -> None:
        for subscriber in self._subscribers:
            try:
                subscriber([frame])
            except Exception:  # noqa: BLE001 - whatever a subscriber does, the others and the wire go on
                _LOG.exception("a subscriber of %s failed", self.bus)

    def set_description(self, node: int, description: Description) -> None:
        """Take sizes, time-outs and names of the objects of ``node`` from its description."""
        self._device(node).description = description

    def on_lost(self, callback: Callable[[], None]) -> None:
        """Have ``callback`` called at once when a connection ends otherwise than by ``close``."""
        for device in self._devices.values():
            device.on_lost = callback

    @property
    def servers(self) -> Mapping[str, int]:
        """The nodes by ``host:port``, as the passive decoder wants them."""
        return {device.peer.server: node for node, device in self._devices.items()}

    # -- objects ----------------------------------------------------------------------------

    async def read(self, node: int, address: Address, timeout_s: float | None = None, urgent: bool = False) -> bytes:
        """See Driver. By FC 43. Raises SdoAbortError, ModbusExceptionError, NoAnswerError, BusLostError."""
        return await self._device(node).read(address, timeout_s, urgent)

    async def read_many(
        self,
        node: int,
        addresses: Iterable[Address],
        timeout_s: float | None = None,
        on_progress: ProgressCallback | None = None,
        urgent: bool = False,
    ) -> dict[Address, bytes | HubsideError]:
        """See Driver. A long list by FC 101. A device that does not answer ends the list: the rest is that error."""
        device, wanted = self._device(node), tuple(dict.fromkeys(addresses))
        results: dict[Address, bytes | HubsideError] = {}
        if len(wanted) >= BULK and not urgent:
            results.update(await self._from_dictionary(device, wanted))
        told_s = time.monotonic()
        for address in wanted:
            if address in results:
                continue
            try:
                results[address] = await device.read(address, timeout_s, urgent)
            except (NoAnswerError, ProtocolError) as error:
                results.update((other, error) for other in wanted if other not in results)
            except DeviceError as error:
                results[address] = error
            if on_progress is not None and time.monotonic() - told_s >= _PROGRESS_S:
                told_s = time.monotonic()
                on_progress(len(results), len(wanted))
        if on_progress is not None:
            on_progress(len(results), len(wanted))
        return {address: results[address] for address in wanted}

    async def _from_dictionary(self, device: ModbusDevice, wanted: tuple[Address, ...]) -> dict[Address, bytes]:
        """What FC 101 gives of ``wanted``; nothing where it fails, and where it always would that is remembered.

        The device may end the connection because of it, or we do because of what no rule allows: its return is awaited
        then. Raises BusLostError where it does not come back.
        """
        if not device.has_dictionary:
            return {}
        try:
            found = await read_dictionary(device)
        except (DeviceError, ProtocolError) as error:
            _LOG.info("FC 101 failed, objects are read one by one: %s", error)
            device.has_dictionary = not _has_no_such_function(error) and "ended_early" not in error.details
            if device.state is LinkState.LOST:
                await self._back_after(device, error)
            return {}
        except BusLostError as error:
            if device.state is LinkState.CLOSED:
                raise
            await self._back_after(device, error)
            return {}
        except NoAnswerError:
            return {}
        return {address: found[address] for address in wanted if address in found}

    async def _back_after(self, device: ModbusDevice, error: HubsideError) -> None:
        """FC 101 has cost the connection: wait for its return, and do not ask so again.

        Raises BusLostError, with what ended the connection, where it does not come back in time.
        """
        device.has_dictionary = False
        try:
            await device.wait_for(LinkState.CONNECTED, _RETURN_S)
        except TimeoutError:
            reason = f"lost while the dictionary was read (FC 101): {error.details['reason']}"
            raise BusLostError(bus=self.bus, node=device.peer.node, reason=reason) from error

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
        """See Driver. By FC 43; a write to 1010h or 1011h waits at least 10 s for its answer."""
        device = self._device(node)
        if urgent:
            known = self._commands.note(node, address)
        with self._process[node].changing() if address.major in MAPPINGS else nullcontext():
            return await device.write(address, data, timeout_s, verify, urgent, known)

    def commanded(self, node: int, address: Address) -> int:
        """See Driver."""
        return self._commands.count(node, address)

    # -- the whole device -----------------------------------------------------------------------

    async def backup(self, node: int) -> dict[Address, bytes]:
        """Every object by FC 101. Raises SdoAbortError, NoAnswerError, ProtocolError, BusLostError."""
        return await read_dictionary(self._device(node))

    async def verify(self, node: int) -> tuple[Finding, ...]:
        """What the device has otherwise than its description says. Raises UsageError where it has none."""
        device = self._device(node)
        if device.description is None:
            raise UsageError(reason=f"node {node} has no description")
        return compare(device.description, await read_dictionary(device))

    async def save(self, node: int, category: str | None = None) -> Stamp:
        """Save ``category``, or all, at standstill; see ``modbus_save``."""
        return await modbus_save.save(self._device(node), category, self._now)

    async def bears(self, node: int, stamp: tuple[int, int]) -> bool:
        """Whether 1020h holds ``stamp``: after a restart, whether that save is in force."""
        return await modbus_save.bears(self._device(node), stamp)

    def process_data(self, node: int) -> ProcessData:
        """Process data of ``node`` by registers."""
        self._device(node)
        return self._process[node]

    async def restart(self, node: int, timeout_s: float = 10.0) -> None:
        """Restart the firmware by 2800h and wait until it is back; see ``modbus_restart``."""
        await modbus_restart.restart(self._device(node), timeout_s)

    async def scan(
        self, nodes: Sequence[int] | None = None, on_progress: ProgressCallback | None = None
    ) -> list[FoundNode]:
        """Identify the configured devices, or ``nodes`` of them; who does not answer is left out."""
        wanted = sorted(self._devices) if nodes is None else [self._device(node).peer.node for node in nodes]
        found = []
        for number, node in enumerate(wanted, 1):
            each = await self._identify(node)
            if each is not None:
                found.append(each)
            if on_progress is not None:
                on_progress(number, len(wanted))
        return found

    async def _identify(self, node: int) -> FoundNode | None:
        device = self._device(node)
        try:
            if device.state is LinkState.CLOSED:
                await device.open(_SCAN_TIMEOUT_S)
            results = await self.read_many(node, _ASKED, _SCAN_TIMEOUT_S)
        except BusOpenError:
            return None
        if isinstance(results[DEVICE_TYPE], NoAnswerError | ProtocolError):
            return None
        device_type, name = _number(results[DEVICE_TYPE]), _text(results[DEVICE_NAME])
        identity = Identity(*(_number(results[address]) for address in IDENTITY))
        matching = match(self._descriptions, device_type, name, identity)
        if matching is not None:
            device.description = matching
        description_id = None if matching is None else matching.id
        hardware, software = _text(results[HARDWARE]), _text(results[SOFTWARE])
        return FoundNode(node, device_type, name, hardware, software, identity, description_id)

    def _device(self, node: int) -> ModbusDevice:
        device = self._devices.get(node)
        if device is None:
            known = ", ".join(map(str, sorted(self._devices)))
            raise UsageError(reason=f"node {node} is not configured (there are: {known}; at most {MAX_NODE})")
        return device


def _has_no_such_function(error: HubsideError) -> bool:
    return isinstance(error, ModbusExceptionError) and error.details["exception"] == ModbusException.ILLEGAL_FUNCTION


def _number(result: bytes | HubsideError) -> int | None:
    return int.from_bytes(result, "little") if isinstance(result, bytes) and len(result) <= 4 else None


def _text(result: bytes | HubsideError) -> str | None:
    return result.rstrip(b"\0").decode("latin-1") if isinstance(result, bytes) else None
