"""The lines of a connection and their stations, as their drivers have them: for the diagnosis of the bus.

Live only: of a recording nobody knows what a driver thought.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from app.drivers.contract import DriverStatus
from app.drivers.profibus_order import Evidence, OrderCheck
from app.errors import BusLostError, HubsideError, SettingsError, UsageError
from app.model.description import Bus
from app.service.bus_link import BusLink
from app.service.connection import Connection
from app.service.devices import Target
from app.service.journal import Journal
from app.service.site_edit import SiteEditor
from app.wire.profibus.pzd import ORDERS, Order, decode_pzd
from app.wire.profibus.telegrams import Signal, Words

if TYPE_CHECKING:  # it comes with an optional package
    from app.drivers.profibus_view import StationView


@runtime_checkable
class Stations(Protocol):
    """A driver whose stations can be looked at one by one."""

    @property
    def problem(self) -> HubsideError | None:
        """Why the line is not open."""

    async def view(self, node: int) -> StationView:
        """Where a station is, and what is exchanged with it. Raises BusLostError."""

    async def check_order(self, node: int) -> OrderCheck:
        """Compare process data with what is read of the same parameters."""


@dataclass(frozen=True, slots=True)
class Line:
    """One bus of the connection. ``master`` is our own address where it has one; ``load`` 0..1.

    ``problem`` is why it is not open. ``stations`` are those of the site, by node, with the device of each; None where
    nothing can be said of one, because the line is gone.
    """

    link: BusLink
    status: DriverStatus
    load: float
    connection: str
    master: int | None
    problem: HubsideError | None
    stations: tuple[tuple[Target, StationView | None], ...]


async def lines(connection: Connection) -> list[Line]:
    """All buses of ``connection``, in the order of the site."""
    return [await _line(connection, link) for link in connection.buses.values()]


async def _line(connection: Connection, link: BusLink) -> Line:
    config = next(bus for bus in connection.turbine.buses if bus.name == link.name)
    driver = link.driver
    problem, stations = None, []
    if isinstance(driver, Stations):
        problem = driver.problem
        stations = [(target, await _view(driver, target.node)) for target in _of(connection, link.name)]
    return Line(
        link, link.status, link.bus_load(connection.stamper()), config.connection,
        config.master if config.kind is Bus.PROFIBUS_DP else None, problem, tuple(stations),
    )  # fmt: skip


def _of(connection: Connection, bus: str) -> Iterator[Target]:
    return (target for target in connection.targets if target.device.bus == bus)


async def _view(driver: Stations, node: int) -> StationView | None:
    try:
        return await driver.view(node)
    except BusLostError:
        return None


@dataclass(frozen=True, slots=True)
class Reading:
    """One parameter of a check: ``value`` as it was read, ``data`` the bytes that tell it too, and what they say."""

    signal: Signal
    value: int
    data: bytes
    by_order: Mapping[Order, int]


@dataclass(frozen=True, slots=True)
class Checked:
    """What came of the guided check of a station's order of bytes."""

    order: OrderCheck
    readings: tuple[Reading, ...]


async def check_order(connection: Connection, target: Target) -> Checked:
    """The guided check; nothing of the station is changed. Raises what reads raise, UsageError."""
    driver = connection.driver(target)
    if not isinstance(driver, Stations):
        raise UsageError(reason=f"{target.slug}: its bus has no order of bytes to be proven")
    check = await driver.check_order(target.node)
    words = (await driver.view(target.node)).telegram.sent
    return Checked(check, tuple(_reading(words, one) for one in check.evidence))


def _reading(words: Words, one: Evidence) -> Reading:
    said = {order: decode_pzd(words, one.data, order)[one.signal] for order in ORDERS}
    data = next(part.data for part in parts(words, one.data) if one.signal in part.signals)
    return Reading(one.signal, one.value, data, said)


@dataclass(frozen=True, slots=True)
class Part:
    """One or two words of process data, the first of which is ``word`` (from 1), and the signals that share them."""

    word: int
    words: int
    signals: tuple[Signal, ...]
    data: bytes


def parts(words: Words, data: bytes) -> Iterator[Part]:
    """``data`` word by word; empty bytes where there are none."""
    word = 0
    for signals in words:
        count = signals[0].words
        yield Part(word + 1, count, signals, data[2 * word : 2 * (word + count)])
        word += count


async def keep_order(
    connection: Connection, target: Target, order: str, editor: SiteEditor, journal: Journal
) -> Checked:
    """Put ``order`` into the site file, where the check that is made now does not contradict it.

    In force with the next connection. Raises SettingsError, SiteError, and what ``check_order`` raises.
    """
    checked = await check_order(connection, target)
    if order not in [order_name(one) for one in checked.order.fits]:
        raise SettingsError(reason_key="lines.refused.order", order=order, device=target.slug)
    slug, state = connection.turbine.slug, editor.state()
    before = next((one for one in state.turbines if one.slug == slug), None)
    if before is None:
        raise SettingsError(reason_key="settings.refused.no_turbine", slug=slug)
    stations = tuple(
        replace(
            station,
            devices=tuple(
                replace(device, slave=device.slave._replace(pzd_order=order)) if device.slug == target.slug else device
                for device in station.devices
            ),
        )
        for station in before.stations
    )
    await editor.change(slug, replace(before, stations=stations), state.revision, journal)
    return checked


def order_name(order: Order) -> str:
    """As a site file names it."""
    return f"{order.byte.value}-{order.word.value}"
