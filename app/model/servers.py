"""Where the devices of a Modbus TCP bus are reached, and which addresses a site allows for them."""

from __future__ import annotations

import re
from ipaddress import IPv4Address, IPv6Address, ip_address, ip_network
from typing import Final, NamedTuple

PORT: Final = 502
"""That of Modbus TCP (Modbus messaging on TCP/IP, 3.1)."""
MODBUS: Final = "modbus-tcp"
"""The connection of a bus whose devices have an address each."""

Ip = IPv4Address | IPv6Address
_SERVER: Final = re.compile(
    r"(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+)(:(?P<port>[0-9]{1,5}))?(/(?P<unit>[0-9]{1,3}))?"
)
_PORTED: Final = re.compile(r"(?P<hosts>\[[^\]]+\]|[^:\[\]]+)(:(?P<port>[0-9]{1,5}))?")


class Server(NamedTuple):
    """One device: it listens at ``host``:``port``; ``unit`` is the unit identifier, 0 in every example of the PD4-E."""

    host: str
    port: int = PORT
    unit: int = 0

    @property
    def text(self) -> str:
        """``host:port``, as it stands in frames."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"

    def __str__(self) -> str:
        """As ``parse_server`` reads it, what is usual left out."""
        port = f":{self.port}" if self.port != PORT else ""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{host}{port}{f'/{self.unit}' if self.unit else ''}"


def parse_server(text: str) -> Server:
    """Read ``HOST[:PORT][/UNIT]``. Raises ValueError with the reason."""
    match = _SERVER.fullmatch(text)
    if match is None:
        raise ValueError(f"'{text}' is not HOST[:PORT][/UNIT]")
    port, unit = _port(match["port"]), int(match["unit"] or 0)
    if unit > 255:
        raise ValueError(f"unit {unit} is not within 0 to 255")
    return Server(match["host"].strip("[]"), port, unit)


class ServerRange(NamedTuple):
    """Addresses from ``first`` to ``last`` with one port."""

    first: Ip
    last: Ip
    port: int = PORT

    def holds(self, server: Server) -> bool:
        """Whether ``server`` is one of them; one that is given by a name is not."""
        try:
            host = ip_address(server.host)
        except ValueError:
            return False
        inside = host.version == self.first.version and int(self.first) <= int(host) <= int(self.last)
        return inside and server.port == self.port


def parse_range(text: str) -> ServerRange:
    """Read ``IP[:PORT]``, ``IP-IP[:PORT]`` or ``NETWORK/BITS[:PORT]``; of a network every address of a device.

    IPv6 stands in brackets. Raises ValueError with the reason.
    """
    match = _PORTED.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"'{text}' is not IP, IP-IP or NETWORK/BITS, with or without :PORT")
    hosts, port = match["hosts"].strip("[]"), _port(match["port"])
    try:
        first, last = _ends(hosts)
    except ValueError as error:
        raise ValueError(f"'{text}' is not IP, IP-IP or NETWORK/BITS, with or without :PORT: {error}") from error
    if first.version != last.version or int(first) > int(last):
        raise ValueError(f"'{text}' ends before it begins")
    return ServerRange(first, last, port)


def _ends(hosts: str) -> tuple[Ip, Ip]:
    if "/" in hosts:
        network = ip_network(hosts, strict=False)
        some = network.num_addresses > 2 and network.version == 4
        return network.network_address + some, network.broadcast_address - some
    first, _, last = hosts.partition("-")
    return ip_address(first.strip()), ip_address((last or first).strip())


def _port(text: str | None) -> int:
    port = int(text or PORT)
    if not 0 < port < 65536:
        raise ValueError(f"port {port} is not within 1 to 65535")
    return port
