"""A service master on the line of a scenario: reads, writes, saves and restarts units as it is ordered, one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from app.errors import UsageError
from app.model.address import Address
from app.model.description import SAVE_SIGNATURE
from app.twins.canopen_device import CanopenDevice
from app.twins.line_client import Answer, LineClient
from app.twins.ports import Line
from app.twins.scenario import MasterDo, MasterOrder
from app.wire.frame import Can
from app.wire.nmt import NmtCommand

SAVE: Final = Address(0x1010, 3)
"""Saves the parameters of an OAT unit (manual, 5.14.1)."""
_LONG: Final = 4


@dataclass(frozen=True, slots=True)
class Done:
    """An order and what came of it."""

    order: MasterOrder
    answer: Answer


class ServiceMaster:
    """The master. ``done`` tells what came of its orders; ``close`` takes it off the line."""

    def __init__(self, line: Line, devices: Mapping[int, CanopenDevice]) -> None:
        self.done: list[Done] = []
        self._devices = devices
        self._client = LineClient(line)

    def check(self, order: MasterOrder) -> None:
        """Whether an order can be carried out at all. Raises UsageError."""
        if order.node and order.node not in self._devices:
            raise UsageError(reason=f"master: there is no node {order.node}", field="node")
        if order.do is MasterDo.WRITE:
            self._bytes(order)

    def do(self, order: MasterOrder) -> None:
        """Carry an order out, behind those that run. Raises UsageError as ``check``."""
        self.check(order)

        def then(answer: Answer) -> None:
            self.done.append(Done(order, answer))

        if order.do is MasterDo.NMT and order.command is not None:
            self._client.nmt(order.command, order.node)
        elif order.do is MasterDo.RESTART:
            self._client.nmt(NmtCommand.RESET_NODE, order.node)
        elif order.do is MasterDo.SAVE:
            self._client.write(order.node, SAVE, SAVE_SIGNATURE.to_bytes(4, "little"), then)
        elif order.do is MasterDo.WRITE and order.address is not None:
            self._client.write(order.node, order.address, self._bytes(order), then)
        elif order.address is not None:
            self._client.read(order.node, order.address, then)

    def on_send(self, told: Callable[[Can], None]) -> None:
        """Have ``told`` called with every frame of this master, as it is queued."""
        self._client.on_send = told

    def close(self) -> None:
        """Leave the line."""
        self._client.close()

    def _bytes(self, order: MasterOrder) -> bytes:
        """The value in the size of the object; of 4 bytes where the device has no such object, for it to refuse."""
        address = order.address
        cell = None if address is None else self._devices[order.node].store.find(address.major, address.minor)
        size = _LONG if cell is None or cell.size is None else cell.size
        low, high = -(1 << 8 * size - 1), (1 << 8 * size) - 1
        if size > _LONG or not low <= order.raw <= high:
            raise UsageError(reason=f"master: {order.raw} does not fit into {address}", field="raw")
        return (order.raw & high).to_bytes(size, "little")
