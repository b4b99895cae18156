"""What has to be known of a station before a bit of its controlword is sent: the order of its bytes, and its values.

Data_Exchange has begun by then, with zeros. Process data always win over PKW, so they are filled with what the station
has before they come into force (ED2 manual, 4.6).
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final, Protocol

from app.drivers.profibus_order import ATTEMPTS, OrderCheck, evidence_of
from app.drivers.profibus_station import Station
from app.errors import PreconditionError
from app.model.address import Address, Addressing
from app.wire.profibus.pzd import Order
from app.wire.profibus.telegrams import (
    ACTUAL,
    CONTROL_WORD,
    RAMP_ACCELERATION,
    RAMP_DECELERATION,
    SETPOINT,
    Part,
    Signal,
)

STATUSWORD: Final = Address(0, 38, Addressing.PKW)
_SOURCES: Final = {SETPOINT: ACTUAL, RAMP_DECELERATION: RAMP_ACCELERATION}
"""Where a signal's first value comes from, if not from its own parameter: the deceleration has none."""


class Reader(Protocol):
    """What is needed of a device."""

    @property
    def station(self) -> Station | None:
        """As the bus knows it."""

    def required(self) -> Station:
        """It, exchanging data. Raises NoAnswerError."""

    def name(self, address: Address) -> str:
        """The parameter's name."""

    async def read(self, address: Address) -> bytes:
        """One parameter."""

    async def read_with_inputs(self, address: Address, timeout_s: float | None, urgent: bool) -> tuple[bytes, bytes]:
        """One parameter, and the process data of the exchange that told it."""

    def post(self, do: Callable[[Station], None], lenient: bool = False) -> None:
        """Have it done on the thread of the bus."""


class Startup:
    """The start-up of one device, made anew after each time that it was gone."""

    def __init__(self, device: Reader) -> None:
        self.check: OrderCheck | None = None
        """The latest comparison."""
        self._device = device
        self._checked = 0
        """Of which start of the station that is."""
        self._prepared = 0
        """Of which start of the station the process data are filled and their order is proven."""
        self._preparing = asyncio.Lock()

    @property
    def proven(self) -> Order | None:
        """The order of process data that was proven since the station is there."""
        station = self._device.station
        current = station is not None and self.check is not None and self._checked == station.starts
        return self.check.proven if current and self.check is not None else None

    async def prepare(self, address: Address) -> OrderCheck:
        """Prove the order of process data and fill them with what the station has; nothing where that is done.

        Raises PreconditionError where the order cannot be proven: ``address`` is what was to be written.
        """
        async with self._preparing:
            station = self._device.station
            if station is not None and self.check is not None and self._prepared == station.starts:
                return self.check
            check = await self.check_order()
            station = self._device.required()
            starts, order = station.starts, check.proven
            if order is None:
                raise PreconditionError(
                    address=address.short, name=self._device.name(address),
                    needs="a proven order of process data", needs_key="profibus.order.needs",
                    found=", ".join(f"{one.signal.name}={one.value}" for one in check.evidence),
                    found_key=check.reason_key,
                )  # fmt: skip
            values = await self._present(station)
            self._device.post(lambda one: one.fill(order, values, starts))
            self._prepared = starts
            return check

    async def check_order(self) -> OrderCheck:
        """Compare process data with what PKW reads. Raises what reads raise."""
        evidence = []
        await self._device.read(STATUSWORD)  # a station that is not there has no process data either
        station = self._device.required()
        for signal in (signal for word in station.telegram.sent for signal in word):
            if signal.address is None or signal.part is not Part.WHOLE:
                continue
            for _ in range(ATTEMPTS):
                data, inputs = await self._device.read_with_inputs(signal.address, None, False)
                found = evidence_of(station.telegram, signal, data, inputs)
                if found.fits:
                    break
            evidence.append(found)
        self.check, self._checked = OrderCheck(tuple(evidence), station.config.order), station.starts
        return self.check

    async def _present(self, station: Station) -> dict[Signal, int]:
        """What the process data have to be so that nothing changes when they come into force.

        The setpoint is where the axis stands: one of before would set it off.
        """
        values = {}
        for signal in (signal for word in station.telegram.received for signal in word):
            source = _SOURCES.get(signal, signal)
            if signal is CONTROL_WORD or source.address is None:
                continue
            data, _ = await self._device.read_with_inputs(source.address, None, False)
            value = int.from_bytes(data, "little", signed=source.signed)
            values[signal] = min(value, (1 << signal.bits) - 1)
        return values
