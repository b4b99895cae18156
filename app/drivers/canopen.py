"""The driver for CANopen (CiA 301): reads, writes, restarts and finds the devices of one bus.

Calls are made in an event loop; the work is done on the receive thread of the port, where the SDO client lives, and
results come back in one piece. A bus with another master needs consent before anything is sent.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, Final, TypeVar

from app.drivers import scan as scanning
from app.drivers.can_config import CanConfig
from app.drivers.can_port import CanPort, PortState, PortStatus
from app.drivers.contract import (
    DriverStatus,
    FoundNode,
    FramesCallback,
    LinkState,
    MasterSign,
    ProgressCallback,
    Written,
)
from app.drivers.listening import BusWatch
from app.drivers.sdo_client import DEFAULT_TIMEOUT_NS, Job, SdoClient
from app.drivers.sdo_jobs import Counters, Steps, read_steps, write_steps
from app.drivers.urgent import UrgentCommands
from app.errors import BusLostError, ConsentError, HubsideError, NoAnswerError, RefusedError, UsageError
from app.model.address import Address
from app.model.description import Description, SaveCommand, Verify
from app.model.saving import command_of
from app.wire import nmt
from app.wire.frame import Can, Direction, Frame, Stamper

T = TypeVar("T")

LISTEN_S: Final = 0.5
"""How long is listened before anything is sent; a heartbeat of 500 ms is heard once."""
SAVE_TIMEOUT_NS: Final = 10_000_000_000
"""The least time-out of a write to 1010h or 1011h: non-volatile memory is slow."""
SHORT_LIST: Final = 16
"""A list of more objects is bulk: it waits for everything else."""
_SLOW: Final = frozenset({0x1010, 0x1011})
_PROGRESS_S: Final = 0.05
GATHER_S: Final = 0.002
"""While nothing of ours runs frames are read this often at most: a full bus then costs half, and views wait longer."""
_HEARTBEAT_BASE: Final = 0x700


class CanOpenDriver:
    """One CANopen bus.

    ``bus`` names it in frames, ``stamper`` gives frames their times, ``listen_s`` is the silence before the first
    request, ``consent`` allows active access beside another master.
    """

    ends_when_silent: Final = False
    ends_with_restart: Final = False
    restarts_by_hand: Final = False

    def __init__(
        self,
        config: CanConfig,
        stamper: Stamper,
        bus: str = "can0",
        descriptions: Sequence[Description] = (),
        consent: bool = False,
        listen_s: float = LISTEN_S,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.bus = bus
        self.watch = BusWatch()
        self._config = config
        self._descriptions = tuple(descriptions)
        self._consent = consent
        self._listen_s = listen_s
        self._listening = False
        self._on_connected: Callable[[], object] | None = None
        self._masters_before: tuple[MasterSign, ...] = ()
        self._pending: set[asyncio.Future[Any]] = set()
        self._timeouts_ns: dict[int, dict[Address, int]] = {}
        self._saves: dict[int, tuple[SaveCommand, ...]] = {}
        self._port = CanPort(config.listening(True), bus, stamper, self.watch.on_frames, monotonic_ns=monotonic_ns)
        self._port.gather_s = GATHER_S
        self._commands = UrgentCommands()
        self._client = SdoClient(self._port, monotonic_ns, self._commands)
        self._port.add_listener(self._client.on_frames, first=True)
        self._port.add_status_listener(self._on_status)

    # -- the link -------------------------------------------------------------

    async def connect(self, timeout_s: float = 5.0) -> None:
        """Open the bus, listen for ``listen_s`` in the adapter's silent mode where it has one, then go active.

        Nothing is sent here. ``masters`` and ``nodes_heard`` tell what was heard. Raises BusOpenError.
        """
        self._listening = True
        try:
            connected = self._next_connection()
            await asyncio.to_thread(self._port.open, timeout_s)
            await self._wait_for(connected, timeout_s)
            await asyncio.sleep(self._listen_s)
            self._masters_before = tuple(dict.fromkeys(seen.sign for seen in self.watch.masters))
            if not self._config.listen_only:
                await self._go_active(timeout_s)
        finally:
            self._listening = False

    async def _go_active(self, timeout_s: float) -> None:
        """Leave the silent mode; an adapter that has one is opened anew for that."""
        if not self._config.has_silent_mode:
            self._port.set_listen_only(False)
            return
        connected = self._next_connection()
        self._port.set_listen_only(False)
        await self._wait_for(connected, timeout_s)

    def _next_connection(self) -> asyncio.Event:
        """An event of this loop that is set when the port connects next."""
        loop, event = asyncio.get_running_loop(), asyncio.Event()
        self._on_connected = partial(loop.call_soon_threadsafe, event.set)
        return event

    async def _wait_for(self, connected: asyncio.Event, timeout_s: float) -> None:
        try:
            await asyncio.wait_for(connected.wait(), timeout_s)
        except TimeoutError:
            raise BusLostError(bus=self.bus, reason=f"the adapter was not ready within {timeout_s} s") from None
        finally:
            self._on_connected = None

    async def close(self, timeout_s: float = 5.0) -> None:
        """End all that runs with BusLostError and close the adapter. Once closed, it stays closed."""
        try:
            await asyncio.to_thread(self._port.close, timeout_s)
        finally:
            for future in tuple(self._pending):
                future.get_loop().call_soon_threadsafe(_settle, future, None, self._closed_error())

    def _closed_error(self) -> BusLostError:
        return BusLostError(bus=self.bus, reason=LinkState.CLOSED.value)

    @property
    def status(self) -> DriverStatus:
        """The present state of the link, and the other masters seen so far."""
        status, stats = self._port.status, self._port.stats
        state = LinkState(status.state.value)
        if self._listening and state is LinkState.CONNECTED:
            state = LinkState.LISTENING
        return DriverStatus(
            self.bus, state, status.t_ns, status.reason, stats.dropped, stats.reconnects, self.watch.masters
        )

    @property
    def port(self) -> CanPort:
        """The port, for its status listeners and counts."""
        return self._port

    @property
    def nodes_heard(self) -> tuple[int, ...]:
        """Nodes of which any frame was received."""
        return self.watch.nodes

    @property
    def masters_before(self) -> tuple[MasterSign, ...]:
        """By what other masters gave themselves away before we sent anything; empty where there was none."""
        return self._masters_before

    @property
    def counters(self) -> Counters:
        """What went other than planned: time-outs, retries, late and ignored answers."""
        return self._client.counters

    @property
    def needs_consent(self) -> bool:
        """True where another master was there before us and nobody has consented: nothing is sent."""
        return bool(self._masters_before) and not self._consent

    def grant_consent(self) -> None:
        """Allow active access although another master is on the bus."""
        self._consent = True

    def says_twin(self, node: int) -> None:
        """See Driver. By its name."""

    def subscribe(self, callback: FramesCallback) -> Callable[[], None]:
        """See Driver. Our own frames are tapped where they are sent."""
        self._port.add_listener(callback)
        return lambda: self._port.remove_listener(callback)

    def set_description(self, node: int, description: Description) -> None:
        """Take the time-outs of the objects of ``node``, and how it saves, from its description."""
        self._saves[_checked(node)] = description.save
        self._timeouts_ns[node] = {
            entry.address: int(entry.timeout_s * 1e9) for entry in description if entry.timeout_s is not None
        }

    def _on_status(self, status: PortStatus) -> None:
        on_connected = self._on_connected
        if status.state is PortState.CONNECTED and on_connected is not None:
            on_connected()
        if status.state is PortState.LOST:
            self._client.lose(BusLostError(bus=self.bus, reason=status.reason))

    # -- objects ----------------------------------------------------------------

    async def read(self, node: int, address: Address, timeout_s: float | None = None, urgent: bool = False) -> bytes:
        """See Driver. By SDO upload. Raises SdoAbortError, NoAnswerError, BusLostError, ConsentError."""
        result = (await self.read_many(node, (address,), timeout_s, urgent=urgent))[address]
        if isinstance(result, HubsideError):
            raise result
        return result

    async def read_many(
        self,
        node: int,
        addresses: Iterable[Address],
        timeout_s: float | None = None,
        on_progress: ProgressCallback | None = None,
        urgent: bool = False,
    ) -> dict[Address, bytes | HubsideError]:
        """See Driver. ``timeout_s`` is for each object; a long list lets short calls go first between two objects."""
        self._require_active(node, asked=not urgent)
        known_ns = self._timeouts_ns.get(node, {})
        timeouts_ns = {address: _timeout_ns(timeout_s, known_ns.get(address)) for address in addresses}
        results: dict[Address, bytes | HubsideError] = {}
        steps = read_steps(node, timeouts_ns, results, self._client.counters, self.bus)
        running = asyncio.ensure_future(self._run(node, steps, urgent, bulk=len(timeouts_ns) > SHORT_LIST))
        await self._watch_progress(running, results, len(timeouts_ns), on_progress)
        return results

    async def _watch_progress(
        self,
        running: asyncio.Future[None],
        results: dict[Address, bytes | HubsideError],
        total: int,
        on_progress: ProgressCallback | None,
    ) -> None:
        try:
            while not running.done():
                await asyncio.wait((running,), timeout=None if on_progress is None else _PROGRESS_S)
                if on_progress is not None:
                    on_progress(len(results), total)
        finally:
            running.cancel()
        await running

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
        """See Driver. By SDO download; a write to 1010h or 1011h waits at least 10 s for its acknowledge."""
        self._require_active(node, asked=not urgent)
        if urgent:
            known = self._commands.note(node, address)
        wait_ns = _timeout_ns(timeout_s, self._timeouts_ns.get(node, {}).get(address))
        if address.major in _SLOW:
            wait_ns = max(wait_ns, SAVE_TIMEOUT_NS)
        counters = self._client.counters
        steps = write_steps(node, address, data, wait_ns, DEFAULT_TIMEOUT_NS, verify, counters, self.bus, known)
        return await self._run(node, steps, urgent)

    def commanded(self, node: int, address: Address) -> int:
        """See Driver."""
        return self._commands.count(node, address)

    def command_raw(self, node: int, address: Address, can: Can) -> bool:
        """Send a command to ``address`` of ``node`` as one frame past all queues, without consent (STOP by RPDO).

        False where a write of ours may still be executed after it; then it has to be written as well.
        Raises BusLostError, RefusedError.
        """
        self._commands.note(_checked(node), address)
        self._port.send(can)
        return not self._client.may_still_write(node, address)

    def abort_current(self, node: int) -> None:
        """Abort the transfer that runs at ``node``; its caller gets NoAnswerError."""
        _checked(node)
        self._port.call_soon(lambda: self._client.abort_current(node))

    # -- network management -------------------------------------------------------

    def nmt(self, command: nmt.NmtCommand, node: int) -> None:
        """Send an NMT command (CiA 301, 7.2.8.3.1) to ``node``; 0 addresses all. Raises ConsentError, BusLostError."""
        if node != 0:
            _checked(node)
        self._require_active(None)
        self._port.send(Can(0x000, nmt.nmt_message(command, node)))

    def beat(self, node: int) -> None:
        """Send one heartbeat as ``node``, operational (CiA 301, 7.2.8.3.2.2). Raises ConsentError, BusLostError."""
        self._require_active(node)
        self._port.send(Can(_HEARTBEAT_BASE + node, nmt.heartbeat(nmt.NmtState.OPERATIONAL)))

    async def save(self, node: int, category: str | None = None) -> None:
        """See Driver. A device of CANopen keeps no date of it."""
        command = command_of(self._saves.get(_checked(node), ()), category)
        await self.write(node, command.address, command.signature.to_bytes(4, "little"), command.timeout_s, Verify.ACK)

    async def bears(self, node: int, stamp: tuple[int, int]) -> bool:
        """See Driver."""
        return False

    async def restart(self, node: int, timeout_s: float = 10.0) -> None:
        """NMT reset node, then wait for its boot-up message. Raises NoAnswerError, ConsentError, BusLostError."""
        self._require_active(node)
        loop, booted = asyncio.get_running_loop(), asyncio.Event()

        def on_frames(frames: list[Frame]) -> None:
            for frame in frames:
                can = frame.payload
                if frame.direction is Direction.RX and isinstance(can, Can) and _is_boot_up(can, node):
                    loop.call_soon_threadsafe(booted.set)

        unsubscribe = self.subscribe(on_frames)
        try:
            self.nmt(nmt.NmtCommand.RESET_NODE, node)
            await asyncio.wait_for(booted.wait(), timeout_s)
        except TimeoutError:
            raise NoAnswerError(node=node, address="boot-up", timeout_s=timeout_s) from None
        finally:
            unsubscribe()

    async def scan(
        self, nodes: Sequence[int] | None = None, on_progress: ProgressCallback | None = None
    ) -> list[FoundNode]:
        """Ask every node, or ``nodes``, for its device type, then identify those that are there."""
        self._require_active(None)
        wanted = tuple(range(1, 128)) if nodes is None else tuple(_checked(node) for node in nodes)
        return await scanning.scan(self, wanted, self._descriptions, on_progress)

    async def ask_presence(self, node: int, timeout_s: float) -> bool:
        """Whether ``node`` answers a read of 1000h, asked once; a late answer to an earlier such question counts."""
        results: dict[Address, bytes | HubsideError] = {}
        steps = scanning.presence_steps(node, int(timeout_s * 1e9), results)
        await self._run(node, steps, fenced=False)
        return bool(results) and not isinstance(results[scanning.DEVICE_TYPE], NoAnswerError)

    # -- the way to the receive thread ------------------------------------------------

    async def _run(
        self, node: int, steps: Steps[T], urgent: bool = False, fenced: bool = True, bulk: bool = False
    ) -> T:
        loop = asyncio.get_running_loop()
        future: asyncio.Future[T] = loop.create_future()
        self._pending.add(future)
        self._port.gather_s = 0.0
        future.add_done_callback(self._forget)

        def on_done(result: T | None, error: Exception | None) -> None:
            # One turn later, so that every subscriber has seen the frames before the caller has the result.
            self._port.call_soon(lambda: hand_over(result, error))

        def hand_over(result: T | None, error: Exception | None) -> None:
            loop.call_soon_threadsafe(_settle, future, result, error)

        job: Job[T] = Job(steps, on_done, urgent, fenced, bulk)
        self._port.call_soon(lambda: self._client.submit(node, job))
        try:
            return await future
        except asyncio.CancelledError:
            self._port.call_soon(lambda: self._client.cancel(node, job))
            raise

    def _forget(self, future: asyncio.Future[Any]) -> None:
        self._pending.discard(future)
        if not self._pending:
            self._port.gather_s = GATHER_S

    def _require_active(self, node: int | None, asked: bool = True) -> None:
        """Refuse what must not be sent. ``asked`` False skips the question for consent."""
        if node is not None:
            _checked(node)
        status = self._port.status
        if status.state is not PortState.CONNECTED:
            raise BusLostError(bus=self.bus, reason=status.reason or status.state.value)
        if self._config.listen_only or self._listening:
            raise RefusedError(device=self.bus, address="", reason_key="refused.listening")
        if asked and self.needs_consent:
            raise ConsentError(bus=self.bus, seen_keys=[sign.text_key for sign in self._masters_before])


def _settle(future: asyncio.Future[Any], result: object, error: Exception | None) -> None:
    if future.done():
        return
    if error is None:
        future.set_result(result)
    else:
        future.set_exception(error)


def _timeout_ns(timeout_s: float | None, known_ns: int | None) -> int:
    if timeout_s is not None:
        return int(timeout_s * 1e9)
    return DEFAULT_TIMEOUT_NS if known_ns is None else known_ns


def _checked(node: int) -> int:
    if not 1 <= node <= nmt.MAX_NODE:
        raise UsageError(reason=f"node {node} is outside 1 to {nmt.MAX_NODE}")
    return node


def _is_boot_up(can: Can, node: int) -> bool:
    return can.can_id == _HEARTBEAT_BASE + node and can.data == b"\0" and not can.extended and not can.remote
