"""One Modbus TCP device: its connection, opened again whenever it is lost, and its objects, read and written by FC 43.

Nothing is asked twice by itself, but a read that had to make room for an urgent request.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import Final

from app.drivers.contract import LinkState, Written
from app.drivers.modbus_config import ModbusPeer
from app.drivers.modbus_link import Attempt, InterruptedRequest, ModbusLink
from app.drivers.modbus_size import SIZES, SizeSearch
from app.drivers.urgent import UrgentCommands
from app.errors import (
    BusLostError,
    BusOpenError,
    DeviceError,
    HubsideError,
    ModbusExceptionError,
    NoAnswerError,
    OvertakenError,
    PreconditionError,
    ProtocolError,
    RefusedError,
    SdoAbortError,
    UnverifiedError,
)
from app.model.address import Address
from app.model.axis_state import AxisState
from app.model.description import Description, Verify
from app.wire.frame import Frame, Stamper
from app.wire.modbus.answers import AbortAnswer, Answer, ExceptionAnswer, ObjectRead
from app.wire.modbus.functions import exception_text_key
from app.wire.modbus.requests import MAX_OBJECT_DATA, ReadObject, Request, WriteObject
from app.wire.sdo import abort_text_key

_LOG: Final = logging.getLogger(__name__)
DEFAULT_TIMEOUT_S: Final = 1.0
SAVE_TIMEOUT_S: Final = 10.0
"""The least time-out of a write to 1010h or 1011h: non-volatile memory is slow."""
STATUSWORD: Final = Address(0x6041)
_SLOW: Final = frozenset({0x1010, 0x1011})
_REOPEN_S: Final = (0.1, 0.2, 0.5, 1.0, 2.0)
_STATE_NAMES: Final = {AxisState.READY: "ready_to_switch_on", AxisState.NOT_READY: "not_ready_to_switch_on"}


class ModbusDevice:
    """The device at ``peer``. ``tap`` gets every ADU."""

    def __init__(
        self, peer: ModbusPeer, bus: str, stamper: Stamper, tap: Callable[[Frame], None], commands: UrgentCommands
    ) -> None:
        self.peer = peer
        self.state = LinkState.CLOSED
        self.since_ns = stamper()
        self.reason = ""
        self.reconnects = 0
        self.description: Description | None = None
        self.has_dictionary = True
        """Whether FC 101 is worth asking; False since an answer showed that it is not, until the device is closed."""
        self.on_lost: Callable[[], None] = lambda: None
        """Called when a connection has ended otherwise than by ``close``, before there is another one."""
        self._bus = bus
        self._stamper = stamper
        self._tap = tap
        self._commands = commands
        self._link: ModbusLink | None = None
        self._reopening: asyncio.Task[None] | None = None
        self._opening = asyncio.Lock()
        self._closed = 0
        self._saves: list[Address] = []
        self._changed = asyncio.Event()

    # -- the connection ------------------------------------------------------------------

    async def open(self, timeout_s: float) -> None:
        """Connect; nothing where it is connected. Raises BusOpenError, BusLostError (it was closed meanwhile)."""
        async with self._opening:
            if self.state is LinkState.CONNECTED:
                return
            closed = self._closed
            link = ModbusLink(self.peer, self._bus, self._stamper, self._tap, lambda error: self._on_lost(link, error))
            await link.open(timeout_s)
            if self._closed != closed:
                error = self._not_connected()
                await link.close(error)
                raise error
            self._link = link
            self._turn(LinkState.CONNECTED, "")

    async def close(self) -> None:
        """End the connection for good; what runs ends with BusLostError."""
        self._closed += 1
        self.has_dictionary = True
        self._turn(LinkState.CLOSED, LinkState.CLOSED.value)
        link, self._link = self._link, None
        reopening, self._reopening = self._reopening, None
        if reopening is not None:
            reopening.cancel()
        if link is not None:
            await link.close(self._not_connected())
        if reopening is not None:
            await asyncio.gather(reopening, return_exceptions=True)

    async def renew(self) -> None:
        """End the connection and open it again as soon as the device lets us."""
        link, error = self.link, BusLostError(bus=self._bus, reason="renewed")
        self._on_lost(link, error)  # first: who is cancelled below leaves no connection that only seems to be one
        await link.close(error)

    @property
    def link(self) -> ModbusLink:
        """The connection as it is now. Raises BusLostError where there is none."""
        if self._link is None or self.state is not LinkState.CONNECTED:
            raise self._not_connected()
        return self._link

    async def wait_for(self, state: LinkState, timeout_s: float | None = None) -> None:
        """Wait until the connection is in ``state``. Raises TimeoutError."""
        async with asyncio.timeout(timeout_s):
            while self.state is not state:
                self._changed.clear()
                await self._changed.wait()

    def _not_connected(self) -> BusLostError:
        return BusLostError(bus=self._bus, node=self.peer.node, reason=self.reason or self.state.value)

    def _turn(self, state: LinkState, reason: str) -> None:
        self.state, self.reason, self.since_ns = state, reason, self._stamper()
        self._changed.set()

    def _on_lost(self, link: ModbusLink, error: BusLostError | ProtocolError) -> None:
        if link is not self._link or self.state is not LinkState.CONNECTED:
            return
        self._turn(LinkState.LOST, str(error.details["reason"]))
        self.on_lost()
        if self._reopening is None or self._reopening.done():
            self._reopening = asyncio.get_running_loop().create_task(self._reopen())

    async def _reopen(self) -> None:
        attempt = 0
        while self.state is LinkState.LOST:
            await asyncio.sleep(_REOPEN_S[min(attempt, len(_REOPEN_S) - 1)])
            attempt += 1
            try:
                await self.open(_REOPEN_S[-1])
                self.reconnects += 1
            except BusOpenError as error:
                self.reason = str(error.details["reason"])
                _LOG.debug("not open again: %s", error)

    # -- objects ---------------------------------------------------------------------------

    async def ask(self, request: Request, timeout_s: float, urgent: bool = False, what: str = "") -> Answer:
        """Ask for what changes nothing: after it had to make room for an urgent request, again."""
        while True:
            try:
                return await self.link.request(request, timeout_s, urgent, what)
            except InterruptedRequest:
                continue

    async def read(
        self, address: Address, timeout_s: float | None = None, urgent: bool = False, held: ModbusLink | None = None
    ) -> bytes:
        """One object. Raises SdoAbortError, ModbusExceptionError, NoAnswerError, BusLostError, ProtocolError.

        The number of bytes has to be that of the object: where the device refuses the described one, it is looked for.
        ``held``: the connection whose turn the caller holds; InterruptedRequest is raised then too.
        """
        wait_s = self._timeout_s(address, timeout_s)
        sizes = SizeSearch(self._sizes(address))
        while True:
            request, what = ReadObject(address, sizes.size), str(address)
            if held is None:
                answer = await self.ask(request, wait_s, urgent, what)
            else:
                answer = await held.finish(held.send(request, urgent), wait_s, what)
            if isinstance(answer, ObjectRead):
                return answer.data
            if not isinstance(answer, AbortAnswer) or not sizes.refused(answer.abort_code):
                raise self.refusal(answer, what)

    async def write(
        self, address: Address, data: bytes, timeout_s: float | None = None,
        verify: Verify = Verify.EQUAL, urgent: bool = False, known: int | None = None,
        before: Callable[[ModbusLink], Awaitable[None]] | None = None,
    ) -> Written:  # fmt: skip
        """Write once. See ``contract.Driver.write``.

        ``before`` is awaited in the same turn right before the write is sent, and again where it had to make room for
        an urgent request; what it raises else ends the write unsent.
        """
        if len(data) > MAX_OBJECT_DATA:
            reason = f"{len(data)} bytes do not fit one message ({MAX_OBJECT_DATA} do)"
            raise RefusedError(device=self.peer.server, address=address.short, reason=reason)
        link, wait_s = self.link, self._timeout_s(address, timeout_s)
        if address.major in _SLOW:
            wait_s = max(wait_s, SAVE_TIMEOUT_S)
        while True:
            async with link.turn(urgent):
                self.require_known(address, known)
                if not urgent:
                    self.require_no_save(address)
                if before is not None:
                    try:
                        await before(link)
                    except InterruptedRequest:
                        continue
                attempt = link.send(WriteObject(address, data), urgent)
                answer = await self._end_of_write(link, attempt, address, wait_s)
            if answer is None:
                return await self._look_at(attempt, address, data, verify, urgent)
            return await self._written(answer, address, urgent)

    def require_known(self, address: Address, known: int | None) -> None:
        """Raises OvertakenError where an urgent command came to the object that a write did not know of."""
        if known is not None and self._commands.count(self.peer.node, address) != known:
            raise OvertakenError(bus=self._bus, node=self.peer.node, address=address.short)

    @contextmanager
    def saving(self, entry: Address) -> Iterator[None]:
        """Until the save by ``entry`` has ended: nothing is sent that could start the motor, but what is urgent."""
        self._saves.append(entry)
        try:
            yield
        finally:
            self._saves.remove(entry)

    def require_no_save(self, address: Address, motion: bool = False) -> None:
        """Raises PreconditionError where a save is under way, and a write to ``address`` could start the motor.

        ``motion``: so it could, whatever the description says of the object.
        """
        entry = None if self.description is None else self.description.entries.get(address)
        if self._saves and (motion or (entry is not None and entry.motion)):
            needs, found = "an ended save", f"a save by {self._saves[0].short} under way"
            key = "saving.needs.no_save"
            name = self.name(address)
            raise PreconditionError(address=address.short, name=name, needs=needs, needs_key=key, found=found)

    async def _end_of_write(self, link: ModbusLink, attempt: Attempt, address: Address, wait_s: float) -> Answer | None:
        """The answer, None where there was none in time. Raises BusLostError where the connection has ended."""
        try:
            return await link.finish(attempt, wait_s, str(address))
        except (BusLostError, ProtocolError) as error:
            reason = f"lost while writing, outcome unknown ({error.details['reason']})"
            raise BusLostError(bus=self._bus, node=self.peer.node, address=str(address), reason=reason) from error
        except (InterruptedRequest, NoAnswerError):
            return None

    async def _look_at(self, attempt: Attempt, address: Address, data: bytes, verify: Verify, urgent: bool) -> Written:
        """A write had no answer in time. The device answers in order: what comes late comes before what is read."""
        try:
            found: bytes | None = await self.read(address, DEFAULT_TIMEOUT_S, urgent)
        except DeviceError:
            found = None
        except (NoAnswerError, ProtocolError) as error:
            error.details["outcome"] = "unknown"
            raise
        if attempt.late is not None:
            return await self._written(attempt.late, address, urgent)
        if verify is Verify.EQUAL and found == data:
            return Written.READ_BACK
        raise UnverifiedError(
            node=self.peer.node,
            address=str(address),
            name=self.name(address),
            sent=data.hex(),
            found=None if found is None else found.hex(),
            reason_key=f"unverified.{'unknown' if found is None or verify is not Verify.EQUAL else 'other_value'}",
        )

    async def _written(self, answer: Answer, address: Address, urgent: bool) -> Written:
        if isinstance(answer, AbortAnswer | ExceptionAnswer):
            raise self.refusal(answer, str(address), None if urgent else await self._state_key())
        return Written.ACKNOWLEDGED

    async def _state_key(self) -> str | None:
        """In what state the device refused a write: a text key; None where it does not say."""
        try:
            state = AxisState.of(int.from_bytes(await self.read(STATUSWORD), "little"))
        except HubsideError:
            return None
        return None if state is None else state_text_key(state)

    # -- what is known of objects ------------------------------------------------------------

    def refusal(self, answer: Answer, what: str, state_key: str | None = None) -> DeviceError:
        """The error for a refusal; ``what`` is the object, or whatever was asked for."""
        details = {"node": self.peer.node, "address": what, "name": self._name_of(what)}
        if state_key is not None:
            details["state_key"] = state_key
        if isinstance(answer, AbortAnswer):
            code = answer.abort_code
            return SdoAbortError(**details, abort_code=code, text_key_reason=abort_text_key(code))
        if isinstance(answer, ExceptionAnswer):
            key = exception_text_key(answer.exception)
            function, exception = answer.function, answer.exception
            return ModbusExceptionError(**details, function=function, exception=exception, text_key_reason=key)
        return DeviceError(**details, reason=type(answer).__name__)

    def name(self, address: Address) -> str:
        """The object's name, empty where it is not described."""
        entry = None if self.description is None else self.description.entries.get(address)
        return "" if entry is None else entry.title

    def _name_of(self, what: str) -> str:
        if self.description is None:
            return ""
        return next((entry.title for entry in self.description if str(entry.address) == what), "")

    def _sizes(self, address: Address) -> tuple[int, ...]:
        entry = None if self.description is None else self.description.entries.get(address)
        if entry is None:
            return SIZES
        size = entry.type.size or MAX_OBJECT_DATA
        return (size, *(other for other in SIZES if other != size))

    def _timeout_s(self, address: Address, timeout_s: float | None) -> float:
        if timeout_s is not None:
            return timeout_s
        entry = None if self.description is None else self.description.entries.get(address)
        return DEFAULT_TIMEOUT_S if entry is None or entry.timeout_s is None else entry.timeout_s


def state_text_key(state: AxisState) -> str:
    """Key of the state's name."""
    return f"axis_state.{_STATE_NAMES.get(state, state.name.lower())}"
