"""Which CAN adapters this machine has: serial ports, network interfaces, and what the vendors' drivers report.

Every place is looked at in a thread of its own with a time-out, because vendors' drivers may hang; what goes wrong in
one is reported beside it and keeps nobody from seeing the others. Nothing is opened here.
"""

from __future__ import annotations

import asyncio
import importlib
import logging
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any, Final

import can
from serial.tools import list_ports

from app.drivers.can_config import CanInterface, parse_can
from app.drivers.can_link import error_text

TIMEOUT_S: Final = 3.0
"""How long one place may take."""
NET: Final = Path("/sys/class/net")
_ARPHRD_CAN: Final = "280"
"""Type of a network interface that is CAN (Linux, if_arp.h)."""

_LOG: Final = logging.getLogger(__name__)


class Health(Enum):
    """How the look at one place ended."""

    OK = "ok"
    NO_DRIVER = "no_driver"
    FAILED = "failed"
    TIMED_OUT = "timed_out"
    UNSUPPORTED = "unsupported"


@dataclass(frozen=True, slots=True)
class Adapter:
    """One adapter: ``connection`` is ``INTERFACE:CHANNEL``, ``title`` its own name; the rest as in CanConfig."""

    connection: str
    interface: CanInterface
    title: str
    silent: bool
    sets_bitrate: bool


@dataclass(frozen=True, slots=True)
class Place:
    """One kind of adapter, and what was found of it; ``reason`` is given where ``health`` is not OK."""

    interface: CanInterface
    health: Health
    reason: str
    adapters: tuple[Adapter, ...]


Look = Callable[[], list[Adapter]]
"""Lists the adapters of one place; may take its time."""


class _NoDriverError(Exception):
    """The vendor's library is not installed."""


def adapter(connection: str, title: str = "") -> Adapter:
    """The adapter that a connection names. Raises UsageError."""
    config = parse_can(connection)
    plain = connection.rpartition("@")[0] if "@" in connection else connection
    return Adapter(plain, config.interface, title, config.has_silent_mode, config.sets_bitrate)


async def detect(timeout_s: float = TIMEOUT_S, places: Mapping[CanInterface, Look] | None = None) -> list[Place]:
    """All places, in the order in which they are named here. Never raises for what a place does."""
    looks = _PLACES if places is None else places
    return list(await asyncio.gather(*(_look(interface, look, timeout_s) for interface, look in looks.items())))


_hanging: set[CanInterface] = set()
"""Places whose thread has not come back: another one would hang as well."""


async def _look(interface: CanInterface, look: Look, timeout_s: float) -> Place:
    if interface in _hanging:
        return Place(interface, Health.TIMED_OUT, f"has been busy for more than {timeout_s:g} s", ())
    loop = asyncio.get_running_loop()
    done: asyncio.Future[Place] = loop.create_future()

    def settle(place: Place) -> None:
        _hanging.discard(interface)
        if not done.done():
            done.set_result(place)

    def run() -> None:
        place = _place(interface, look)
        try:
            loop.call_soon_threadsafe(settle, place)
        except RuntimeError:  # the loop has ended meanwhile: nobody waits any more
            _hanging.discard(interface)

    _hanging.add(interface)
    threading.Thread(target=run, name=f"look-{interface.value}", daemon=True).start()
    try:
        return await asyncio.wait_for(done, timeout_s)
    except TimeoutError:
        return Place(interface, Health.TIMED_OUT, f"did not answer within {timeout_s:g} s", ())


def _place(interface: CanInterface, look: Look) -> Place:
    try:
        return Place(interface, Health.OK, "", tuple(look()))
    except _NoDriverError as error:
        return Place(interface, Health.NO_DRIVER, str(error), ())
    except NotImplementedError as error:
        return Place(interface, Health.UNSUPPORTED, error_text(error), ())
    except Exception as error:  # noqa: BLE001 - vendors' drivers raise what they like; it is told beside the place
        _LOG.info("looking for %s adapters: %s", interface.value, error_text(error))
        return Place(interface, Health.FAILED, error_text(error), ())


# -- the places ------------------------------------------------------------------------


def _serial() -> list[Adapter]:
    """Serial ports of USB adapters; what is built in to the board is left out, for no CAN adapter sits there."""
    ports = [port for port in list_ports.comports() if port.vid is not None]
    return [adapter(f"slcan:{port.device}", port.description or "") for port in sorted(ports)]


def _socketcan() -> list[Adapter]:
    if sys.platform != "linux":
        raise NotImplementedError("Linux only")
    return [adapter(f"socketcan:{name}", state) for name, state in network_interfaces(NET)]


def network_interfaces(net: Path) -> list[tuple[str, str]]:
    """CAN interfaces of Linux under ``net`` with their state (``up``, ``down``), by name."""
    found = []
    for folder in sorted(net.iterdir()):
        try:
            if (folder / "type").read_text(encoding="ascii").strip() == _ARPHRD_CAN:
                found.append((folder.name, (folder / "operstate").read_text(encoding="ascii").strip()))
        except OSError as error:  # unplugged at this very moment
            _LOG.debug("%s: %s", folder.name, error)
    return found


def _pcan() -> list[Adapter]:
    basic = importlib.import_module("can.interfaces.pcan.basic")
    try:
        basic.PCANBasic()
    except OSError as error:
        raise _NoDriverError(error_text(error)) from error
    return [adapter(f"pcan:{one['channel']}", str(one.get("device_name", ""))) for one in _reported("pcan")]


def _kvaser() -> list[Adapter]:
    canlib = importlib.import_module("can.interfaces.kvaser.canlib")
    if not hasattr(canlib, "canGetNumberOfChannels"):
        raise _NoDriverError("canlib")
    return [adapter(f"kvaser:{one['channel']}", str(one.get("device_name", ""))) for one in _reported("kvaser")]


def _ixxat() -> list[Adapter]:
    try:
        importlib.import_module("can.interfaces.ixxat.canlib")
    except (ImportError, OSError) as error:
        raise _NoDriverError("vcinpl") from error
    return [adapter(f"ixxat:{one['channel']}", str(one.get("unique_hardware_id", ""))) for one in _reported("ixxat")]


def _vector() -> list[Adapter]:
    canlib = importlib.import_module("can.interfaces.vector.canlib")
    if canlib.xldriver is None:
        raise _NoDriverError("vxlapi")
    return [adapter(f"vector:{one['channel']}", f"serial {one.get('serial', '–')}") for one in _reported("vector")]


def _reported(interface: str) -> list[dict[str, Any]]:
    return [dict(one) for one in can.detect_available_configs([interface], timeout=TIMEOUT_S)]


_PLACES: Final[Mapping[CanInterface, Look]] = {
    CanInterface.SLCAN: _serial,
    CanInterface.SOCKETCAN: _socketcan,
    CanInterface.PCAN: _pcan,
    CanInterface.KVASER: _kvaser,
    CanInterface.IXXAT: _ixxat,
    CanInterface.VECTOR: _vector,
}
