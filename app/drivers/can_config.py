"""What a CAN connection is: ``INTERFACE:CHANNEL[@BITRATE]`` as text, and the keyword arguments of python-can.

==========================================  ==================================================================
``socketcand:127.0.0.1:29536[/can0]``       a socketcand server; ``[::1]:29536`` for IPv6
``socketcan:can0``                          a Linux network interface; its bit rate is set with ``ip link``
``slcan:/dev/ttyACM0@500000``               a serial adapter, also ``slcan:COM3``
``slcan:/dev/ttyACM0@search``               its bit rate is found by listening (slcan, pcan, kvaser, vector)
``pcan:PCAN_USBBUS1@250000``                PEAK
``kvaser:0``, ``ixxat:0``, ``vector:0``     channel number (ixxat and vector need their vendor's driver)
``virtual:name``                            python-can's bus inside one process
==========================================  ==================================================================
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Final

from app.errors import UsageError

DEFAULT_BITRATE: Final = 500_000
"""In bit/s, where the connection names none."""
SEARCH: Final = "search"
"""In place of the bit rate: find it by listening (``app.drivers.bitrate_search``)."""
_BITRATES: Final = (10_000, 1_000_000)
"""Least and highest bit rate of classic CAN adapters."""


class CanInterface(Enum):
    """The interfaces of python-can that are known here; the values are its names and those of the command line."""

    SOCKETCAND = "socketcand"
    SOCKETCAN = "socketcan"
    SLCAN = "slcan"
    PCAN = "pcan"
    KVASER = "kvaser"
    IXXAT = "ixxat"
    VECTOR = "vector"
    VIRTUAL = "virtual"


BITRATES_OF: Final[dict[CanInterface, frozenset[int]]] = {
    CanInterface.SLCAN: frozenset(
        {10_000, 20_000, 50_000, 83_300, 100_000, 125_000, 250_000, 500_000, 750_000, 1_000_000}
    ),
    # python-can takes 500 kbit/s for any rate that it does not know: never let it.
    CanInterface.PCAN: frozenset(
        {10_000, 20_000, 33_000, 47_000, 50_000, 83_000, 95_000, 100_000, 125_000, 250_000, 500_000, 800_000, 1_000_000}
    ),
}
_NUMBERED: Final = frozenset({CanInterface.KVASER, CanInterface.IXXAT, CanInterface.VECTOR})
_FIXED_RATE: Final = frozenset({CanInterface.SOCKETCAND, CanInterface.SOCKETCAN, CanInterface.VIRTUAL})
_SILENT: Final[dict[CanInterface, dict[str, Any]]] = {
    CanInterface.SLCAN: {"listen_only": True},
    CanInterface.VECTOR: {"listen_only": True},
    CanInterface.KVASER: {"driver_mode": False},
}


@dataclass(frozen=True)
class CanConfig:
    """One CAN connection. ``host`` and ``port`` are of socketcand only; ``extra`` goes to python-can as it is.

    ``bitrate`` in bit/s: where the interface cannot set it, what the bus is taken to have (for its load).
    ``search``: the bit rate is still to be found, and nothing can be opened before that.
    ``listen_only``: nothing is sent; the adapter is put into its silent mode where it has one.
    """

    interface: CanInterface
    channel: str
    bitrate: int = DEFAULT_BITRATE
    host: str = ""
    port: int = 0
    listen_only: bool = False
    search: bool = False
    extra: dict[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        """The text that ``parse_can`` reads."""
        rate = SEARCH if self.search else self.bitrate
        if self.interface is CanInterface.SOCKETCAND:
            host = f"[{self.host}]" if ":" in self.host else self.host
            return f"socketcand:{host}:{self.port}/{self.channel}@{rate}"
        return f"{self.interface.value}:{self.channel}@{rate}"

    @property
    def sets_bitrate(self) -> bool:
        """Whether the connection itself sets the bus's bit rate."""
        return self.interface not in _FIXED_RATE

    @property
    def has_silent_mode(self) -> bool:
        """Whether the adapter can listen without acknowledging frames; otherwise we just send nothing."""
        return self.interface in _SILENT or self.interface is CanInterface.PCAN

    def listening(self, listen_only: bool) -> CanConfig:
        """The same connection, listen-only or not."""
        return replace(self, listen_only=listen_only)

    def bus_arguments(self) -> dict[str, Any]:
        """Keyword arguments for ``can.Bus``; for PCAN the silent mode is added where the bus is opened."""
        arguments: dict[str, Any] = {"interface": self.interface.value, "channel": self.channel}
        if self.interface in _NUMBERED:
            arguments["channel"] = int(self.channel)
        if self.sets_bitrate:
            arguments["bitrate"] = self.bitrate
        if self.listen_only:
            arguments.update(_SILENT.get(self.interface, {}))
        return arguments | self.extra


def parse_can(text: str) -> CanConfig:
    """Read ``INTERFACE:CHANNEL[@BITRATE|@search]``. Raises UsageError that names the part that is wrong."""
    name, colon, rest = text.partition(":")
    try:
        interface = CanInterface(name)
    except ValueError:
        known = ", ".join(each.value for each in CanInterface)
        raise _wrong(text, f"'{name}' is no interface (there are: {known})") from None
    if not colon:
        raise _wrong(text, f"the channel is missing, as in {name}:CHANNEL[@BITRATE]")
    channel, at, rate = rest.rpartition("@")
    search = bool(at) and rate == SEARCH
    if not at:
        channel, bitrate = rest, DEFAULT_BITRATE
    else:
        bitrate = DEFAULT_BITRATE if search else _bitrate(text, interface, rate)
    if interface is CanInterface.SOCKETCAND:
        return replace(_socketcand(text, channel, bitrate), search=search)
    if not channel:
        raise _wrong(text, "the channel is empty")
    if interface in _NUMBERED and not re.fullmatch(r"[0-9]{1,3}", channel):
        raise _wrong(text, f"channel '{channel}' is no number, which {name} needs")
    return CanConfig(interface, channel, bitrate, search=search)


def _wrong(text: str, reason: str) -> UsageError:
    return UsageError(reason=f"CAN connection '{text}': {reason}")


def _bitrate(text: str, interface: CanInterface, rate: str) -> int:
    if not re.fullmatch(r"[0-9]{1,9}", rate):
        raise _wrong(text, f"bit rate '{rate}' is no number in bit/s")
    bitrate = int(rate)
    if not _BITRATES[0] <= bitrate <= _BITRATES[1]:
        raise _wrong(text, f"bit rate {bitrate} is outside {_BITRATES[0]} to {_BITRATES[1]} bit/s")
    offered = BITRATES_OF.get(interface)
    if offered is not None and bitrate not in offered:
        raise _wrong(text, f"{interface.value} has no bit rate {bitrate} ({', '.join(map(str, sorted(offered)))})")
    return bitrate


def _socketcand(text: str, channel: str, bitrate: int) -> CanConfig:
    address, slash, name = channel.partition("/")
    host, colon, port = address.rpartition(":")
    host = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not colon or not host:
        raise _wrong(text, "socketcand needs HOST:PORT")
    if not re.fullmatch(r"[0-9]{1,5}", port) or not 0 < int(port) < 65536:
        raise _wrong(text, f"port '{port}' is not within 1 to 65535")
    if (slash and not name) or re.search(r"[\s<>]", name):
        raise _wrong(text, f"'{name}' is no name of a channel")
    return CanConfig(CanInterface.SOCKETCAND, name or "can0", bitrate, host, int(port))
