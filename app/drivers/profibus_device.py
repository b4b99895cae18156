"""Parameters of one station for callers of the event loop: read and written by PKW, or as process data.

What a telegram carries from the master, PKW cannot write: process data always win (ED2 manual, 4.6). Such a write goes
into the process data, and is done once an exchange has surely brought it to the station.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Mapping
from typing import Any, Final

from app.drivers.contract import Written
from app.drivers.profibus_bus import ProfibusBus
from app.drivers.profibus_image import Change
from app.drivers.profibus_pkw import Failure, PkwJob, Result
from app.drivers.profibus_startup import Startup
from app.drivers.profibus_station import Station, StationState
from app.drivers.urgent import UrgentCommands
from app.errors import (
    BusLostError,
    DeviceError,
    HubsideError,
    NoAnswerError,
    OvertakenError,
    PkwRefusedError,
    RefusedError,
    UnverifiedError,
    UsageError,
)
from app.model.address import Address, Addressing
from app.model.description import Description, Verify
from app.wire.profibus import pkw
from app.wire.profibus.pkw import PkwAnswer, PkwRequest, ReplyKind
from app.wire.profibus.telegrams import (
    CONTROL_WORD,
    Signal,
)

DEFAULT_TIMEOUT_S: Final = 2.0
CONTROLWORD: Final = Address(0, 37, Addressing.PKW)
_LENGTHS: Final = (1, 2, 4)


class ProfibusDevice:
    """The station at ``node`` of ``bus``. Lives in the event loop in which it is asked."""

    def __init__(self, bus: ProfibusBus, node: int, commands: UrgentCommands) -> None:
        self.node = node
        self.description: Description | None = None
        self.startup = Startup(self)
        self._bus = bus
        self._commands = commands
        self._written: frozenset[Address] = frozenset()
        self._written_since = 0
        """Parameters that were written as process data, and since which start of the station."""

    def renew(self, bus: ProfibusBus) -> None:
        """The line was closed and is opened again: all that was known of the station is void."""
        self._bus, self.startup = bus, Startup(self)

    @property
    def station(self) -> Station | None:
        """As the bus knows it; its fields may be read from here."""
        return self._bus.stations.get(self.node)

    # -- PKW -------------------------------------------------------------------------------------

    async def read(self, address: Address, timeout_s: float | None = None, urgent: bool = False) -> bytes:
        """One parameter, least significant byte first. Raises PkwRefusedError, NoAnswerError, BusLostError.

        DeviceError where only the zero of our own process data stands there: what the device had before, nobody knows.
        """
        data, _inputs = await self.read_with_inputs(address, timeout_s, urgent)
        if not any(data) and address in self.overridden:
            raise DeviceError(node=self.node, address=str(address), reason_key="profibus.overridden")
        return data

    @property
    def overridden(self) -> frozenset[Address]:
        """Kept parameters that process data have set to 0 since the exchange began, and that nobody has written since.

        Process data win over parameters, and before anything is known of a station they are zeros (ED2 manual, 4.6).
        """
        station = self.station
        if station is None or self.description is None:
            return frozenset()
        if station.starts != self._written_since:
            return self._zeroed(station)
        return self._zeroed(station) - self._written

    def _zeroed(self, station: Station) -> frozenset[Address]:
        """What its telegram carries to it, is kept, and may be 0."""
        signals = (signal for word in station.telegram.received for signal in word)
        addresses = {signal.address for signal in signals if signal.address is not None}
        entries = (self.description.entries.get(address) for address in addresses) if self.description else ()
        return frozenset(one.address for one in entries if one is not None and one.saved and one.enumeration is None)

    async def read_with_inputs(self, address: Address, timeout_s: float | None, urgent: bool) -> tuple[bytes, bytes]:
        """The parameter, and the process data of the exchange that told it."""
        wait_s = self._timeout_s(address, timeout_s)
        answer, _sent, inputs = await self._job(pkw.read(_checked(address)), wait_s, urgent, lambda: None)
        if isinstance(answer, Failure):
            raise self._failed(answer, address, wait_s)
        data = answer.data
        if answer.kind is ReplyKind.REFUSED or data is None:
            raise self._refusal(answer, address)
        return data, inputs

    async def write(
        self, address: Address, data: bytes, timeout_s: float | None = None,
        verify: Verify = Verify.EQUAL, urgent: bool = False, known: int | None = None,
    ) -> Written:  # fmt: skip
        """Write once. See ``contract.Driver.write``."""
        signal = self._signal(_checked(address))
        if signal is not None:
            await self._write_image(address, signal, data, timeout_s, urgent, known)
            plain = verify is Verify.EQUAL and not urgent and signal is not CONTROL_WORD
            return await self._read_back(address, data) if plain else Written.ACKNOWLEDGED
        if len(data) not in _LENGTHS:
            raise RefusedError(device=str(self.node), address=address.short, reason=f"no job writes {len(data)} bytes")
        wait_s = self._timeout_s(address, timeout_s)
        refusal = self._overtaken(address, known)
        answer, sent, _ = await self._job(pkw.write(address, data), wait_s, urgent, refusal)
        if isinstance(answer, Failure):
            if answer is Failure.TIMEOUT and sent:
                return await self._look_at(address, data, verify, urgent)
            if answer is Failure.GONE and sent:
                raise self._open_outcome(address, data)
            raise self._failed(answer, address, wait_s)
        if answer.kind is ReplyKind.REFUSED:
            raise self._refusal(answer, address)
        return Written.ACKNOWLEDGED

    async def _look_at(self, address: Address, data: bytes, verify: Verify, urgent: bool) -> Written:
        """A write was sent and not answered: what stands there now decides."""
        try:
            found: bytes | None = await self.read(address, DEFAULT_TIMEOUT_S, urgent)
        except DeviceError:
            found = None
        except NoAnswerError as error:
            error.details["outcome"] = "unknown"
            raise
        if verify is Verify.EQUAL and found == data:
            return Written.READ_BACK
        raise self._open_outcome(address, data, found if verify is Verify.EQUAL else None)

    async def _job(
        self, request: PkwRequest, timeout_s: float, urgent: bool, refusal: Callable[[], Failure | None]
    ) -> tuple[Result, bool, bytes]:
        """What became of a job, whether it was sent, and the process data that came with its answer."""
        self._require_pkw(request.address)
        done: asyncio.Future[tuple[Result, bool, bytes]] = asyncio.get_running_loop().create_future()

        def end(result: Result, sent: bool) -> None:
            station = self.station
            tell(done, (result, sent, b"" if station is None else station.inputs))

        job = PkwJob(request, timeout_s, end, urgent, refusal)
        self.post(lambda station: station.channel.put(job))
        try:
            return await done
        except asyncio.CancelledError:
            self.post(lambda station: station.channel.drop(job), lenient=True)
            raise

    # -- process data --------------------------------------------------------------------------------

    def _signal(self, address: Address) -> Signal | None:
        """The signal to the station that has the parameter's value, None where no telegram carries it there."""
        station = self.station
        if station is None:
            return CONTROL_WORD if address == CONTROLWORD else None
        words = station.telegram.received
        return next((signal for word in words for signal in word if signal.address == address), None)

    async def _write_image(
        self, address: Address, signal: Signal, data: bytes, timeout_s: float | None, urgent: bool, known: int | None
    ) -> None:
        value = int.from_bytes(data, "little", signed=signal.signed)
        low = -(1 << signal.bits - 1) if signal.signed else 0
        if not low <= value < low + (1 << signal.bits):
            reason = f"{value} does not fit into the {signal.bits} bits of process data"
            raise RefusedError(device=str(self.node), address=address.short, reason=reason)
        if value:
            await self.startup.prepare(address)
        await self.send({signal: value, **self._with_it(signal, value)}, address, data, timeout_s, urgent, known)
        station = self.required()
        if station.starts != self._written_since:
            self._written, self._written_since = frozenset(), station.starts
        self._written |= {address}

    def _with_it(self, signal: Signal, value: int) -> dict[Signal, int]:
        """What the device itself changes with a write, where process data carry that too: else they would undo it."""
        entry = None if self.description is None or signal.address is None else self.description.entries[signal.address]
        changed = {} if entry is None else {one.address: one.raw for one in entry.effects if value in one.writing}
        found = ((self._signal(address), raw) for address, raw in changed.items())
        return {other: raw for other, raw in found if other is not None}

    async def _read_back(self, address: Address, data: bytes) -> Written:
        """Process data are not acknowledged one by one: whether the device has taken a value only PKW tells."""
        found = await self.read(address)
        if found != data:
            raise self._open_outcome(address, data, found)
        return Written.READ_BACK

    async def send(
        self, values: Mapping[Signal, int], address: Address, data: bytes,
        timeout_s: float | None = None, urgent: bool = False, known: int | None = None,
    ) -> None:  # fmt: skip
        """Give signals new values at once, and wait until the station has them."""
        done: asyncio.Future[tuple[Failure | None, bool]] = asyncio.get_running_loop().create_future()
        change = Change(
            values, lambda failure, sent: tell(done, (failure, sent)), urgent, self._overtaken(address, known)
        )
        self.post(lambda station: station.image.put(change))
        wait_s = self._timeout_s(address, timeout_s)
        try:
            async with asyncio.timeout(wait_s):
                failure, sent = await done
        except TimeoutError:
            self.post(lambda station: station.image.drop(change), lenient=True)
            raise NoAnswerError(node=self.node, address=str(address), timeout_s=wait_s, outcome="unknown") from None
        except asyncio.CancelledError:
            self.post(lambda station: station.image.drop(change), lenient=True)
            raise
        if failure is Failure.GONE and sent:
            raise self._open_outcome(address, data)
        if failure is not None:
            raise self._failed(failure, address, wait_s)

    # -- errors and names ------------------------------------------------------------------------------

    def name(self, address: Address) -> str:
        """The parameter's name, empty where it is not described."""
        entry = None if self.description is None else self.description.entries.get(address)
        return "" if entry is None else entry.title

    def required(self) -> Station:
        """The station, exchanging data. Raises NoAnswerError where it does not."""
        station = self.station
        if station is None or station.state is not StationState.EXCHANGING:
            raise NoAnswerError(node=self.node, address="Data_Exchange", timeout_s=DEFAULT_TIMEOUT_S)
        return station

    def _require_pkw(self, address: Address) -> None:
        """Raises RefusedError where the station's telegram carries no parameters (ED2 manual, 4.5)."""
        station = self.station
        if station is not None and not station.telegram.has_pkw:
            reason = f"telegram {station.telegram.number} carries no parameters (1, 102 and 103 do)"
            raise RefusedError(device=str(self.node), address=address.short, reason=reason)

    def require_open(self) -> None:
        """Raises BusLostError, BusOpenError or what keeps the station from being run."""
        error = self._bus.error
        if error is not None:
            raise type(error)(**error.details)
        station = self.station
        problem = None if station is None else station.problem
        if problem is not None:
            raise type(problem)(**problem.details)

    def post(self, do: Callable[[Station], None], lenient: bool = False) -> None:
        """Have ``do`` called on the thread of the bus. Raises what ``require_open`` raises, if not ``lenient``."""
        if not lenient:
            self.require_open()
        self._bus.post(lambda bus: do(bus.station(self.node)))

    def _overtaken(self, address: Address, known: int | None) -> Callable[[], Failure | None]:
        def refusal() -> Failure | None:
            newer = known is not None and self._commands.count(self.node, address) != known
            return Failure.OVERTAKEN if newer else None

        return refusal

    def _failed(self, failure: Failure, address: Address, timeout_s: float) -> HubsideError:
        if failure is Failure.OVERTAKEN:
            return OvertakenError(bus=self._bus.bus, node=self.node, address=address.short)
        if failure is Failure.NOT_READY:
            return RefusedError(device=str(self.node), address=address.short, reason="the station was restarted")
        error = self._bus.error
        if failure is Failure.GONE and error is not None:
            reason = str(error.details.get("reason", error.code))
            return BusLostError(bus=self._bus.bus, node=self.node, reason=reason)
        return NoAnswerError(node=self.node, address=str(address), timeout_s=timeout_s)

    def _open_outcome(self, address: Address, data: bytes, found: bytes | None = None) -> UnverifiedError:
        return UnverifiedError(
            node=self.node, address=str(address), name=self.name(address), sent=data.hex(),
            found=None if found is None else found.hex(),
            reason_key=f"unverified.{'unknown' if found is None else 'other_value'}",
        )  # fmt: skip

    def _refusal(self, answer: PkwAnswer, address: Address) -> PkwRefusedError:
        key = pkw.error_text_key(answer.value)
        return PkwRefusedError(
            node=self.node, address=str(address), name=self.name(address), pkw_code=answer.value, text_key_reason=key
        )

    def _timeout_s(self, address: Address, timeout_s: float | None) -> float:
        if timeout_s is not None:
            return timeout_s
        entry = None if self.description is None else self.description.entries.get(address)
        return DEFAULT_TIMEOUT_S if entry is None or entry.timeout_s is None else entry.timeout_s


def _checked(address: Address) -> Address:
    if address.addressing is not Addressing.PKW or not (0 <= address.major <= 255 and 0 <= address.minor <= 255):
        raise UsageError(reason=f"{address} is no IND/PNU (examples: 0/38, 12/100)")
    return address


def tell(done: asyncio.Future[Any], result: Any) -> None:
    """Settle ``done`` from the thread of the bus."""

    def settle() -> None:
        if not done.done():
            done.set_result(result)

    with contextlib.suppress(RuntimeError):  # the loop has ended, and with it who waited
        done.get_loop().call_soon_threadsafe(settle)
