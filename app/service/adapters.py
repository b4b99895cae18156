"""Adapters of this machine: which there are, whether one hears its bus, at which bit rate, and who is on it.

Nothing here disturbs the connection that is open: an adapter in use is not opened a second time; what is asked of it is
answered from that connection, or refused.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from app.drivers.adapters import Adapter, Place, adapter, detect
from app.drivers.bitrate_search import SEARCH_LISTEN_S, rates_to_try, search_bitrate
from app.drivers.can_config import CanConfig, CanInterface, parse_can
from app.drivers.can_port import CanPort, PortState
from app.drivers.contract import FoundNode, MasterSeen
from app.drivers.listening import BusWatch
from app.drivers.table import driver_class
from app.errors import BusLostError, SettingsError, UsageError
from app.model.description import Bus, Description
from app.model.site import Turbine
from app.service.bus_link import BusLink
from app.service.connection import Connection
from app.service.jobs import Job
from app.wire.can_bits import frame_bits
from app.wire.frame import Can, Direction, Frame, Stamper

TEST_S: Final = 3.0
"""How long a test listens."""
STEP_S: Final = 0.25
"""So often it says what it has heard so far."""
OPEN_S: Final = 3.0
NEEDED: Final = 2
"""Valid frames that prove a bit rate, as in the search for one."""


class Verdict(Enum):
    """What a test says of the bit rate. The value is the end of its text key."""

    LISTENING = "listening"
    FITS = "fits"
    ERRORS = "errors"
    SILENT = "silent"


@dataclass(frozen=True, slots=True)
class NamedAdapter:
    """An adapter and who names it: this machine reports it, turbines of the site use it, the connection has it open."""

    adapter: Adapter
    found: bool
    turbines: tuple[str, ...]
    in_use: bool


@dataclass(frozen=True, slots=True)
class Overview:
    """All adapters that are known, and the places that were looked at."""

    adapters: tuple[NamedAdapter, ...]
    places: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class Heard:
    """What was heard in ``heard_s``; ``load`` 0..1. ``shared``: through the connection that is open anyway.

    ``silent``: the adapter acknowledged nothing, so a bus with a single other node stays unheard.
    """

    connection: str
    bitrate: int
    shared: bool
    silent: bool
    heard_s: float
    frames: int
    errors: int
    load: float
    nodes: tuple[int, ...]
    masters: tuple[MasterSeen, ...]
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class RateTried:
    """One bit rate of a search: what was heard at it."""

    bitrate: int
    frames: int
    errors: int


@dataclass(frozen=True, slots=True)
class SearchResult:
    """A search so far: rates tried, the one that is listened to now, the one that fits."""

    connection: str
    rates: tuple[int, ...]
    tried: tuple[RateTried, ...] = ()
    trying: int | None = None
    bitrate: int | None = None


@dataclass(frozen=True, slots=True)
class ScanResult:
    """Devices that a scan found."""

    connection: str
    bitrate: int
    found: tuple[FoundNode, ...]


# -- which there are ------------------------------------------------------------------


async def overview(turbines: Iterable[Turbine], connection: Connection | None) -> Overview:
    """Adapters that this machine reports, and those that the site names."""
    places = await detect()
    found = {one.connection: one for place in places for one in place.adapters}
    named: dict[str, list[str]] = {}
    for turbine in turbines:
        for bus in turbine.buses:
            if bus.kind is not Bus.CANOPEN:
                continue  # its devices are reached by their own addresses, through no adapter
            try:
                plain = adapter(bus.connection).connection
            except UsageError:
                continue  # damaged by hand: the turbine's own page says so
            named.setdefault(plain, []).append(turbine.slug)
    every = {**{name: adapter(name) for name in named}, **found}
    lines = [
        NamedAdapter(
            one, name in found, tuple(dict.fromkeys(named.get(name, ()))), in_use(connection, name) is not None
        )
        for name, one in every.items()
    ]
    return Overview(tuple(lines), tuple(places))


def in_use(connection: Connection | None, text: str) -> BusLink | None:
    """The bus of the open connection that has the adapter of ``text``. Raises UsageError."""
    if connection is None:
        return None
    wanted = _place(parse_can(text))
    can = (link for link in connection.buses.values() if link.kind is Bus.CANOPEN)
    return next((link for link in can if _place(parse_can(link.adapter)) == wanted), None)


def _place(config: CanConfig) -> tuple[CanInterface, str, str, int]:
    return config.interface, config.channel, config.host, config.port


def configured(connection: str, bitrate: int) -> CanConfig:
    """The adapter at a bit rate. Raises UsageError."""
    plain = adapter(connection).connection
    return parse_can(f"{plain}@{bitrate}")


def _plain(config: CanConfig) -> str:
    """The connection without its bit rate: the name of the bus in errors."""
    return str(config).rpartition("@")[0]


# -- test -----------------------------------------------------------------------------


async def listen_to(job: Job, config: CanConfig, sure: bool, link: BusLink | None) -> None:
    """Listen, and keep what was heard so far as the job's result. ``link`` is the open bus of this adapter.

    ``sure``: the person knows the bit rate; asked for where a wrong one would disturb the bus. Raises SettingsError,
    BusOpenError, BusLostError.
    """
    job.total = round(TEST_S / STEP_S)
    if link is not None:
        await _share(job, str(replace(config, bitrate=link.bitrate)), link)
        return
    if config.sets_bitrate and not config.has_silent_mode and not sure:
        raise SettingsError(reason_key="settings.refused.no_silent_mode", interface=config.interface.value)
    await _listen(job, config.listening(True))


async def _share(job: Job, connection: str, link: BusLink) -> None:
    """The figures of the connection that is open."""
    ear = _Ear()
    forget = link.driver.subscribe(ear.on_frames)
    try:
        await _hear(job, ear, connection, link.bitrate, True, False, lambda: None)
    finally:
        forget()


async def _listen(job: Job, config: CanConfig) -> None:
    stamper = Stamper(time.time_ns(), time.monotonic_ns)
    port = CanPort(config, _plain(config), stamper)
    ear = _Ear()
    port.add_listener(ear.on_frames)

    def lost() -> None:
        status = port.status
        if status.state is not PortState.CONNECTED:
            raise BusLostError(bus=port.bus, reason=status.reason or status.state.value)

    try:
        await asyncio.to_thread(port.open, OPEN_S)
        await _hear(job, ear, str(config), config.bitrate, False, config.has_silent_mode, lost)
    finally:
        await asyncio.to_thread(port.close)


async def _hear(
    job: Job, ear: _Ear, connection: str, bitrate: int, shared: bool, silent: bool, check: Callable[[], None]
) -> None:
    loop = asyncio.get_running_loop()
    began = loop.time()
    while job.done < job.total:
        await asyncio.sleep(STEP_S)
        check()
        job.done += 1
        heard_s = loop.time() - began
        job.result = ear.result(connection, bitrate, shared, silent, heard_s, job.done == job.total)


class _Ear:
    """Counts what comes. ``on_frames`` runs on the receive thread; numbers are read from the loop."""

    def __init__(self) -> None:
        self._watch = BusWatch()
        self._bits = self._frames = self._errors = 0

    def on_frames(self, frames: Sequence[Frame]) -> None:
        """Count received frames."""
        self._watch.on_frames(frames)
        for _t_ns, _, direction, can, _ in frames:
            if direction is not Direction.RX or not isinstance(can, Can):
                continue
            self._bits += frame_bits(can)
            self._errors += can.error
            self._frames += not can.error

    def result(self, connection: str, bitrate: int, shared: bool, silent: bool, heard_s: float, ended: bool) -> Heard:
        """What was heard in ``heard_s``."""
        verdict = Verdict.LISTENING
        if ended:
            verdict = self._verdict()
        return Heard(
            connection=connection,
            bitrate=bitrate,
            shared=shared,
            silent=silent,
            heard_s=heard_s,
            frames=self._frames,
            errors=self._errors,
            load=min(1.0, self._bits / bitrate / heard_s) if heard_s else 0.0,
            nodes=self._watch.nodes,
            masters=self._watch.masters,
            verdict=verdict,
        )

    def _verdict(self) -> Verdict:
        if self._errors:
            return Verdict.ERRORS
        return Verdict.FITS if self._frames >= NEEDED else Verdict.SILENT


# -- bit rate -------------------------------------------------------------------------


async def find_bitrate(job: Job, connection: str, link: BusLink | None) -> None:
    """Find the bit rate by listening. Raises SettingsError where that would disturb the bus, BusOpenError."""
    config = replace(parse_can(adapter(connection).connection), search=True)
    if link is not None:
        raise SettingsError(reason_key="settings.refused.in_use", connection=connection, bitrate=link.bitrate)
    if not config.sets_bitrate:
        raise SettingsError(reason_key="settings.refused.rate_is_set", interface=config.interface.value)
    if not config.has_silent_mode:
        raise SettingsError(reason_key="settings.refused.no_silent_mode", interface=config.interface.value)
    result = SearchResult(adapter(connection).connection, rates_to_try(config))
    job.result, job.total = result, len(result.rates)

    def on_try(bitrate: int) -> None:
        nonlocal result
        result = replace(result, trying=bitrate)
        job.result = result

    def on_heard(bitrate: int, frames: int, errors: int) -> None:
        nonlocal result
        result = replace(result, trying=None, tried=(*result.tried, RateTried(bitrate, frames, errors)))
        job.result, job.done = result, len(result.tried)

    found = await search_bitrate(config, SEARCH_LISTEN_S, on_try, on_heard=on_heard)
    job.result, job.done = replace(result, trying=None, bitrate=found), job.total


# -- scan -----------------------------------------------------------------------------


async def scan_adapter(
    job: Job, config: CanConfig, known: Sequence[Description], consent: bool, link: BusLink | None
) -> None:
    """Find the devices; through the open connection where it has the adapter.

    Raises BusOpenError, BusLostError, and ConsentError where another master is heard and ``consent`` is not given.
    """

    def progress(done: int, total: int) -> None:
        job.done, job.total = done, total

    if link is not None:
        found = await link.driver.scan(on_progress=progress)
        job.result = ScanResult(str(replace(config, bitrate=link.bitrate)), link.bitrate, tuple(found))
        return
    stamper = Stamper(time.time_ns(), time.monotonic_ns)
    driver = driver_class(Bus.CANOPEN)(config, stamper, _plain(config), known, consent=consent)
    try:
        await driver.connect(OPEN_S)
        found = await driver.scan(on_progress=progress)
    finally:
        await driver.close()
    job.result = ScanResult(str(config), config.bitrate, tuple(found))
