"""What the traffic has told of one device: its process images, the order of its registers, and its restarts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from app.model.address import Address
from app.wire.fault_watch import FaultWatch
from app.wire.modbus.image import (
    RX_MAPPING,
    RX_REGISTER,
    TX_MAPPING,
    TX_REGISTER,
    MappingObjects,
    WordOrder,
    shown_order,
)
from app.wire.modbus.requests import Request, WriteArray, WriteObject
from app.wire.records import Record, RestartSeen, Source, ValueSeen

REBOOT: Final = 0x2800
"""Bootloader and reboot settings; "boot" written to it restarts the firmware (pages 92 and 188)."""
BOOT: Final = b"boot"
UPTIME: Final = Address(0x230F)
"""Seconds since the start, UNSIGNED32 (page 180)."""
_UPTIME_SLACK_NS: Final = 2_000_000_000
_CLOCK_SLACK: Final = 1000
"""One part in so many that the device's clock may be slow."""
_FRESH_NS: Final = 1_000_000_000
"""Registers and an object tell the order of words only where they are read so soon after each other."""
_MAX_CLIENTS: Final = 1024
"""So many are known as seen before, the latest ones."""


class DeviceWatch:
    """One device. ``received`` is the image that it takes (3502h), ``sent`` the one that it gives (3602h)."""

    def __init__(self, node: int) -> None:
        self.node = node
        self.received = MappingObjects(RX_MAPPING, RX_REGISTER)
        self.sent = MappingObjects(TX_MAPPING, TX_REGISTER)
        self._uptime: tuple[int, int] | None = None
        self._clients: dict[str, None] = {}
        self._told_to_boot: frozenset[str] | None = None
        """The clients that were seen before it was told to, and who told it."""
        self._registers: tuple[int, int, tuple[int, ...]] | None = None
        self._faults = FaultWatch()

    def forget(self) -> None:
        """Frames are missing, or it has restarted: any mapping may be in force. The order of words is its nature."""
        self.received.forget()
        self.sent.forget()
        self._registers = None
        self._faults.forget()

    def asked(self, request: Request, client: str) -> None:
        """A request was sent to it."""
        self._clients.pop(client, None)
        self._clients[client] = None
        if len(self._clients) > _MAX_CLIENTS:
            del self._clients[next(iter(self._clients))]
        if _tells_to_boot(request):
            self._told_to_boot = frozenset(self._clients)

    def refused(self, request: Request) -> None:
        """It has refused a request."""
        if _tells_to_boot(request):
            self._told_to_boot = None

    def unsure(self, request: Request) -> None:
        """Nobody has seen how a request ended."""
        if isinstance(request, WriteObject):
            self._forget(request.address)
        elif isinstance(request, WriteArray):
            for frame in request.frames:
                self._forget(frame.address)

    def back(self, t_ns: int, bus: str, client: str) -> Sequence[Record]:
        """It has answered ``client``. A connection does not outlive a restart: a new one shows that it is over."""
        if self._told_to_boot is None or client in self._told_to_boot:
            return ()
        return self._restarted(t_ns, bus)

    def registers_read(self, t_ns: int, start: int, registers: tuple[int, ...]) -> None:
        """It has given registers."""
        self._registers = (t_ns, start, registers)

    def learn(self, t_ns: int, bus: str, records: list[Record]) -> Sequence[Record]:
        """Take what ``records`` tell; gives them, with a restart before them where they show one, and faults behind."""
        restart: Sequence[Record] = ()
        values = [record for record in records if isinstance(record, ValueSeen)]
        for record in values:
            if record.source in (Source.SDO_READ, Source.SDO_WRITE):
                if record.address == UPTIME and record.source is Source.SDO_READ:
                    restart = self._learn_uptime(t_ns, bus, int.from_bytes(record.data, "little")) or restart
                self._learn_order(t_ns, record)
                if not self.received.learn(record.address, record.data):
                    self.sent.learn(record.address, record.data)
        faults = [
            fault
            for value in values
            if value.source in (Source.SDO_READ, Source.PDO_TX) and (fault := self._faults.see(value)) is not None
        ]
        return (*restart, *records, *faults) if restart or faults else records

    def _learn_uptime(self, t_ns: int, bus: str, uptime_s: int) -> Sequence[Record]:
        before, self._uptime = self._uptime, (uptime_s, t_ns)
        if before is None:
            return ()
        elapsed_ns = t_ns - before[1]
        expected_ns = before[0] * 1_000_000_000 + elapsed_ns
        if uptime_s * 1_000_000_000 >= expected_ns - elapsed_ns // _CLOCK_SLACK - _UPTIME_SLACK_NS:
            return ()
        restart = self._restarted(t_ns, bus)
        self._uptime = (uptime_s, t_ns)
        return restart

    def _learn_order(self, t_ns: int, value: ValueSeen) -> None:
        read = self._registers
        if self.sent.order is not None or read is None or t_ns - read[0] > _FRESH_NS:
            return
        _, start, registers = read
        for image in (self.sent.image, self.received.image):
            span = None if image is None else image.places.get(value.address)
            if span is not None and start <= span.start and span.start + span.quantity <= start + len(registers):
                order = shown_order(value.data, registers[span.start - start :][: span.quantity])
                self.sent.order = self.received.order = order

    def _restarted(self, t_ns: int, bus: str) -> Sequence[Record]:
        self._told_to_boot = None
        self._uptime = None
        self.forget()
        return (RestartSeen(t_ns, bus, self.node),)

    def _forget(self, address: Address) -> None:
        self.received.forget(address)
        self.sent.forget(address)

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state."""
        order = self.sent.order
        return {
            "received": self.received.snapshot(),
            "sent": self.sent.snapshot(),
            "order": None if order is None else order.value,
            "uptime": self._uptime,
            "clients": list(self._clients),
            "told_to_boot": None if self._told_to_boot is None else sorted(self._told_to_boot),
            "registers": self._registers,
            "faults": self._faults.snapshot(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError on another state."""
        self.received.restore(state["received"])
        self.sent.restore(state["sent"])
        self.sent.order = self.received.order = None if state["order"] is None else WordOrder(state["order"])
        self._uptime = None if state["uptime"] is None else (state["uptime"][0], state["uptime"][1])
        self._clients = dict.fromkeys(state["clients"])
        self._told_to_boot = None if state["told_to_boot"] is None else frozenset(state["told_to_boot"])
        read = state["registers"]
        self._registers = None if read is None else (read[0], read[1], tuple(read[2]))
        self._faults = FaultWatch()
        if "faults" in state:  # keyframes of earlier recordings have none
            self._faults.restore(state["faults"])


def _tells_to_boot(request: Request) -> bool:
    return isinstance(request, WriteObject) and request.address.major == REBOOT and request.data == BOOT
