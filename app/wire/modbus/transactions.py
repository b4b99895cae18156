"""Which answer belongs to which request, seen from outside: by connection, transaction, unit and function.

A client may have several requests open at a time. ``Adu.link`` names a connection in the direction of the bytes, as
``host:port>host:port``; the plain ``host:port`` of a server stands for our own connection to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from app.wire.frame import Direction
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import Answer, answers
from app.wire.modbus.requests import Request, decode_request

ARROW: Final = ">"
MAX_OPEN: Final = 32
"""Of one connection; the oldest counts as lost where a client opens more."""
LATE_NS: Final = 60_000_000_000
"""No client waits as long for an answer."""


class Path(NamedTuple):
    """One direction of the connection between ``client`` and the device ``node``."""

    node: int
    client: str
    is_request: bool


def path_of(link: str, direction: Direction, servers: Mapping[str, int]) -> Path | None:
    """Whose connection ``link`` is, and which way; None where none of ``servers`` takes part."""
    sender, arrow, receiver = link.partition(ARROW)
    if not arrow:
        node = servers.get(link)
        return None if node is None else Path(node, "", direction is Direction.TX)
    node = servers.get(receiver)
    if node is not None:
        return Path(node, sender, is_request=True)
    node = servers.get(sender)
    return None if node is None else Path(node, receiver, is_request=False)


class Open(NamedTuple):
    """A request that is not answered yet. ``request`` None: of a function that is none of the device's."""

    t_ns: int
    direction: Direction
    message: Message
    request: Request | None


class Connection:
    """The open requests of one client to one device, oldest first."""

    def __init__(self, node: int, client: str) -> None:
        self.node = node
        self.client = client
        self._open: dict[int, Open] = {}

    def ask(self, new: Open) -> list[Open]:
        """A request was sent. Returns those that nobody will answer any more."""
        lost = []
        same = self._open.pop(new.message.transaction, None)
        if same is not None:
            lost.append(same)
        while self._open:
            oldest = next(iter(self._open.values()))
            if len(self._open) < MAX_OPEN and new.t_ns - oldest.t_ns < LATE_NS:
                break
            lost.append(self._open.pop(oldest.message.transaction))
        self._open[new.message.transaction] = new
        return lost

    def waiting(self, message: Message) -> Open | None:
        """The request with the transaction and unit of ``message``."""
        found = self._open.get(message.transaction)
        return found if found is not None and found.message.unit == message.unit else None

    def settle(self, asked: Open, answer: Answer | None) -> bool:
        """Take ``answer`` (None: it cannot be read) as that of ``asked``. False where it cannot be its answer."""
        if answer is not None and asked.request is not None and not answers(asked.request, answer):
            return False
        del self._open[asked.message.transaction]
        return True

    @property
    def idle(self) -> bool:
        """Nothing is open."""
        return not self._open

    def close(self, of: Direction | None = None) -> list[Open]:
        """Give all up, or those that went ``of`` that direction."""
        lost = [each for each in self._open.values() if of in (None, each.direction)]
        self._open = {each.message.transaction: each for each in self._open.values() if each not in lost}
        return lost

    def snapshot(self) -> list[list[Any]]:
        """JSON-able."""
        return [[t_ns, way.value, *message[:2], message.pdu.hex()] for t_ns, way, message, _ in self._open.values()]

    def restore(self, state: list[list[Any]]) -> None:
        """Go on from ``snapshot()``. Raises ValueError on another state."""
        self._open = {}
        for t_ns, direction, transaction, unit, pdu in state:
            message = Message(transaction, unit, bytes.fromhex(pdu))
            self._open[transaction] = Open(t_ns, Direction(direction), message, request_of(message))


def request_of(message: Message) -> Request | None:
    """The request, None where it is none of the device's functions, or makes no sense."""
    try:
        return decode_request(message.pdu)
    except ValueError:
        return None
