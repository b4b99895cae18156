"""From arguments to a connection: which bus, which devices, and how a command is run and ended."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import signal
import sys
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.output import Output, tell_warning
from app.cli.runtime import spare_collector
from app.cli.targets import (
    MODBUS_BUS,
    Sheets,
    bare_turbine,
    descriptions_for,
    is_bare,
    line_turbine,
    modbus_turbine,
    scanned_turbine,
    site_turbine,
)
from app.drivers.contract import FoundNode
from app.drivers.modbus_config import ModbusConfig, parse_modbus
from app.drivers.profibus_config import parse_profibus
from app.errors import HubsideError, NoAnswerError, UsageError
from app.model.address import is_decimal
from app.model.description import Bus
from app.model.description_file import BUILTIN, load_builtin
from app.model.site import MAX_NODE, Turbine, load_site
from app.service.bitrates import with_bitrate, with_bitrates
from app.service.connection import Connection
from app.service.identify import Asked, identify
from app.service.options import Options
from app.service.sites import Sites

if TYPE_CHECKING:
    from app.service.bench import Bench

TERMINATED = 143
"""Exit code after SIGTERM, as shells have it."""
SWITCH_INTERVAL_S = 0.0005
"""The receive thread gets its turn sooner than Python's 5 ms, so that a request follows an answer at once."""


def run_command(command: Coroutine[Any, Any, int]) -> int:
    """Run a command in an event loop; gives its exit code."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    return asyncio.run(_until_terminated(command))


async def _until_terminated(command: Coroutine[Any, Any, int]) -> int:
    """SIGTERM ends a command as Ctrl-C does: the bus and the recording are closed."""
    task = asyncio.ensure_future(command)
    with contextlib.suppress(NotImplementedError):  # Windows has no such handlers
        asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, task.cancel)
    try:
        return await task
    except asyncio.CancelledError:
        return TERMINATED


@asynccontextmanager
async def connected(
    arguments: argparse.Namespace, output: Output, record: bool | None = None
) -> AsyncIterator[Connection]:
    """The connection that the arguments name; on a bare bus the devices are found by a scan first."""
    sheets = sheets_of(arguments, output)
    turbine = await _turbine_with_devices(arguments, output, sheets)
    connection = make_connection(arguments, turbine, sheets, arguments.record if record is None else record)
    spare_collector()
    async with connection:
        yield connection


async def make_bench(arguments: argparse.Namespace, output: Output, record: bool) -> tuple[str | None, Bench]:
    """A bench that knows all turbines of the arguments, and the slug of the one to connect to.

    Where no bus is given it knows those of the data folder's site file, and connects to one where only one
    is named; what is connected, and to what, is chosen in the page then.
    """
    # Late: the other commands on a bus need neither bench nor store, and these take some time to load.
    from app.service.bench import Bench
    from app.store.store import Store

    store = Store.open(arguments.settings.data)  # first: nothing is sent where another process is at work already
    sheets = sheets_of(arguments, output)
    home: Path = arguments.settings.data / "site.toml"
    if is_bare(arguments):
        turbine = await _turbine_with_devices(arguments, output, sheets, some=True)
        known, first = _only(turbine)
    else:
        known, first = _from_site_file(arguments, home)
    sites = Sites(known, lambda one: descriptions_for(sheets, one, arguments.site), arguments.site, home)
    spare_collector()
    instructor = arguments.instructor
    bench = Bench(sites, options_of(arguments, record), output.error, store=store, instructor=instructor)
    return None if first is None else first.slug, bench


def _only(turbine: Turbine) -> tuple[tuple[Turbine, ...], Turbine | None]:
    return (turbine,), turbine


def _from_site_file(arguments: argparse.Namespace, home: Path) -> tuple[tuple[Turbine, ...], Turbine | None]:
    """The turbines that are known, and the one to connect to, where it is clear which."""
    named = arguments.site is not None
    if not named and home.exists():
        arguments.site = home
    if arguments.site is None:
        return (), None
    known = load_site(arguments.site)
    clear = named or len(known) == 1 or arguments.turbine is not None
    return known, site_turbine(arguments) if clear else None


async def _turbine_with_devices(
    arguments: argparse.Namespace, output: Output, sheets: Sheets, some: bool = False
) -> Turbine:
    """The turbine of the arguments; on a bare bus with the devices that a scan finds.

    ``some``: addresses of Modbus TCP where nobody answers, or nobody whom we know, are told and left out.
    """
    nodes = _named_nodes(arguments)
    if arguments.modbus is not None:
        return await _modbus_turbine(parse_modbus(arguments.modbus), output, nodes, some)
    turbine = await named_turbine(arguments, output)
    if arguments.site is not None or turbine.devices:
        return turbine
    found = await find_nodes(arguments, output, sheets, turbine, nodes)
    turbine = scanned_turbine(turbine, sheets, found)
    _all_there(nodes, found, turbine)
    return turbine


async def _modbus_turbine(config: ModbusConfig, output: Output, nodes: list[int] | None, some: bool) -> Turbine:
    """The devices at the given addresses; only ``nodes`` where given. Raises UsageError, NoAnswerError."""
    places = {peer.node for peer in config.peers}
    for node in nodes or ():
        if node not in places:
            there = ", ".join(f"{peer.node} ({peer.server})" for peer in config.peers)
            raise UsageError(reason=f"no device '{node}'; there are: {there}")
    config = ModbusConfig(tuple(peer for peer in config.peers if nodes is None or peer.node in nodes))
    asked = await ask_peers(config, output)
    for one in asked:
        problem = one.error or _undescribed(one)
        if problem is not None and not some:
            raise problem
        if problem is not None:
            output.error(problem)
    if all(one.found is None for one in asked):
        raise _error_of(asked)
    return modbus_turbine(config, [one.found for one in asked if one.found is not None])


async def ask_peers(config: ModbusConfig, output: Output) -> list[Asked]:
    """Who is at the addresses; what can be read there is told by the caller."""
    output.say("cli.modbus.asking", addresses=", ".join(peer.server for peer in config.peers))
    known = [description for description in map(load_builtin, BUILTIN) if description.bus is Bus.MODBUS_TCP]
    return await identify(config, known, MODBUS_BUS)


def _undescribed(one: Asked) -> UsageError | None:
    if one.found is None or one.found.description_id is not None:
        return None
    name = one.found.device_name or "without a name"
    return UsageError(reason=f"nothing describes the device at {one.peer.server} (node {one.peer.node}, {name})")


def _error_of(asked: list[Asked]) -> HubsideError:
    return next(one.error for one in asked if one.error is not None)


async def named_turbine(arguments: argparse.Namespace, output: Output) -> Turbine:
    """The turbine of the site file, or a bare bus; bit rates that are to be searched are found here, silently.

    Raises SiteError, UsageError, and what ``search_bitrate`` raises.
    """
    if arguments.modbus is not None:
        reason = "a recording of Modbus TCP holds what is asked here, and 'record' asks nothing: serve the page, "
        raise UsageError(reason=reason + "or add --record to another command")
    if arguments.profibus is not None:
        return line_turbine(parse_profibus(arguments.profibus))
    turbine = site_turbine(arguments)
    if turbine is None:
        return bare_turbine(await with_bitrate(arguments.can, arguments.listen_s, _Telling(output)))
    return await with_bitrates(turbine, arguments.listen_s, _Telling(output))


class _Telling:
    """Tells a search for the bit rate on the command line."""

    def __init__(self, output: Output) -> None:
        self._output = output

    def trying(self, connection: str, bitrate: int) -> None:
        self._output.progress("cli.bitrate_trying", bus=connection, bitrate=bitrate)

    def found(self, connection: str, bitrate: int) -> None:
        self._output.say("cli.bitrate_found", bus=connection, bitrate=bitrate)


def sheets_of(arguments: argparse.Namespace, output: Output) -> Sheets:
    """The EDS files of the command line; their warnings are told. Raises DescriptionError."""
    return Sheets(arguments.eds, lambda path, warning: tell_warning(output, path, warning))


def make_connection(arguments: argparse.Namespace, turbine: Turbine, sheets: Sheets, record: bool) -> Connection:
    """A connection that is not open yet. Raises OSError where nothing can be recorded in the data folder."""
    options = options_of(arguments, record)
    return Connection(turbine, descriptions_for(sheets, turbine, arguments.site), options)


def options_of(arguments: argparse.Namespace, record: bool) -> Options:
    """How connections are made. Raises OSError where nothing can be recorded in the data folder."""
    settings = arguments.settings
    if record:
        settings.recordings.mkdir(parents=True, exist_ok=True)
    return Options(
        person=settings.person,
        recordings=settings.recordings if record else None,
        consent=arguments.consent,
        listen_s=arguments.listen_s,
        data=settings.data,
        site=None if arguments.site is None else arguments.site.parent,
        more_recordings=getattr(arguments, "recordings", ()),
    )


def _all_there(nodes: list[int] | None, found: list[FoundNode], turbine: Turbine) -> None:
    """Raises NoAnswerError for a node that is not there, UsageError for one that nothing describes."""
    for node in nodes or ():
        if all(one.node != node for one in found):
            raise NoAnswerError(node=node, address="1000", timeout_s=1)
        if turbine.device(str(node)) is None:
            raise UsageError(reason=f"nothing describes the device at node {node}; name its EDS file with --eds")


def _named_nodes(arguments: argparse.Namespace) -> list[int] | None:
    """The node numbers that the command names: nobody else need be asked. None where it names none."""
    named = getattr(arguments, "target", [])
    texts = [named] if isinstance(named, str) else named
    kind = Bus.CANOPEN if arguments.modbus is None else Bus.MODBUS_TCP
    most = MAX_NODE[kind if arguments.profibus is None else Bus.PROFIBUS_DP]
    return [int(text) for text in texts if is_decimal(text) and 1 <= int(text) <= most] or None


async def find_nodes(
    arguments: argparse.Namespace, output: Output, sheets: Sheets, turbine: Turbine, nodes: list[int] | None = None
) -> list[FoundNode]:
    """Scan the buses of ``turbine``; only ``nodes`` where given."""
    output.say("cli.listening", bus=", ".join(bus.connection for bus in turbine.buses))
    async with make_connection(arguments, turbine, sheets, False) as connection:
        found = [await link.driver.scan(nodes) for link in connection.buses.values()]
    return [node for on_bus in found for node in on_bus]
