"""What ``--modbus`` says: which devices, where, and as which nodes."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from app.errors import UsageError
from app.model.servers import PORT, Server, parse_server

MAX_NODE: Final = 247
"""As many as Modbus can number."""


class ModbusPeer(NamedTuple):
    """One device: it listens at ``host``:``port``; ``unit`` is the unit identifier, 0 in every example of the PD4-E."""

    node: int
    host: str
    port: int = PORT
    unit: int = 0

    @property
    def server(self) -> str:
        """``host:port``, as it stands in frames."""
        return Server(self.host, self.port, self.unit).text


class ModbusConfig(NamedTuple):
    """Devices that are shown as one bus."""

    peers: tuple[ModbusPeer, ...]

    def __str__(self) -> str:
        """The text that ``parse_modbus`` reads."""
        return ",".join(f"{peer.server}/{peer.unit}={peer.node}" for peer in self.peers)


_PEER: Final = re.compile(r"(?P<server>[^=]+)(=(?P<node>[0-9]{1,3}))?")


def parse_modbus(text: str) -> ModbusConfig:
    """Read ``HOST[:PORT][/UNIT][=NODE]``, several with commas between. Raises UsageError.

    A device without a number gets its place in the list.
    """
    peers = tuple(_peer(text, part.strip(), place) for place, part in enumerate(text.split(","), 1))
    if len({peer.node for peer in peers}) < len(peers):
        raise _wrong(text, "two devices have the same node number")
    if len({peer.server for peer in peers}) < len(peers):
        raise _wrong(text, "two devices have the same address")
    return ModbusConfig(peers)


def _peer(text: str, part: str, place: int) -> ModbusPeer:
    match = _PEER.fullmatch(part)
    if match is None:
        raise _wrong(text, f"'{part}' is not HOST[:PORT][/UNIT][=NODE]")
    try:
        server = parse_server(match["server"])
    except ValueError as error:
        raise _wrong(text, str(error)) from error
    node = int(match["node"] or place)
    if not 1 <= node <= MAX_NODE:
        raise _wrong(text, f"node {node} is not within 1 to {MAX_NODE}")
    return ModbusPeer(node, *server)


def _wrong(text: str, reason: str) -> UsageError:
    return UsageError(reason=f"Modbus connection '{text}': {reason}")
