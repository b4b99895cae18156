"""The passive Modbus TCP decoder: ADUs of one bus in, records out, whoever sent them.

It sends nothing, reads no clock and never raises on any bytes: what makes no sense gives a record that says so. Objects
come as they do from CANopen: FC 43 is an SDO transfer in one message each way, FC 101 to 103 are many of them, and
registers are PDOs by the mapping that the device was seen to have. One thread feeds it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from app.model.description import Description
from app.wire.frame import Adu, Direction, Frame
from app.wire.modbus.adu import Message, decode_adu
from app.wire.modbus.answers import (
    ObjectRead,
    ObjectWritten,
    decode_answer,
)
from app.wire.modbus.device import DeviceWatch
from app.wire.modbus.fields import FormatError
from app.wire.modbus.image import ProcessImage
from app.wire.modbus.requests import (
    Request,
    decode_request,
)
from app.wire.modbus.telling import Teller
from app.wire.modbus.transactions import Connection, Open, Path, path_of
from app.wire.pdo_follower import PdoRoute
from app.wire.records import (
    Fault,
    GapSeen,
    MalformedAduSeen,
    OrphanSeen,
    Outcome,
    Record,
    Side,
)

_NOTHING: Final[tuple[Record, ...]] = ()
_MAX_PATHS: Final = 4096
_MAX_CONNECTIONS: Final = 64
"""Those without an open request are forgotten beyond so many."""


class ModbusDecoder:
    """Decoder of the bus ``bus``; ``servers`` are the nodes of the devices by ``host:port``, more by ``set_server``."""

    PROTOCOL: Final = "modbus-tcp"
    """Names the protocol in a kept state."""

    def __init__(self, bus: str, servers: Mapping[str, int] | None = None) -> None:
        self.bus = bus
        self._servers = dict(servers or {})
        self._devices: dict[int, DeviceWatch] = {}
        self._connections: dict[tuple[int, str], Connection] = {}
        self._paths: dict[tuple[str, Direction], Path | None] = {}
        self._teller = Teller(bus, self._device)

    def set_server(self, server: str, node: int) -> None:
        """The device ``node`` listens at ``server`` (``host:port``)."""
        self._servers[server] = node
        self._paths.clear()

    def set_description(self, node: int, description: Description | None) -> None:
        """Nothing is asked of a description: what a device maps is learned from the wire."""

    def pdos(self, node: int) -> tuple[PdoRoute, ...]:
        """None: nothing is sent unasked."""
        return ()

    def node_of(self, frame: Frame) -> int:
        """The device that sent or gets an ADU; 0 where none that is known does."""
        path = self.path(frame)
        return 0 if path is None else path.node

    def path(self, frame: Frame) -> Path | None:
        """Whose ADU it is and which way it goes; None where no device that is known takes part."""
        return self._path(frame.payload.link, frame.direction) if isinstance(frame.payload, Adu) else None

    def image(self, node: int, sent_by_device: bool) -> ProcessImage | None:
        """The process image of ``node`` as it was seen to be, None where it was not."""
        device = self._device(node)
        return device.sent.image if sent_by_device else device.received.image

    def feed(self, frame: Frame) -> Sequence[Record]:
        """Decode one frame. Frames of other buses, and connections to no known device, say nothing."""
        t_ns, bus, direction, adu, _ = frame
        if type(adu) is not Adu or bus != self.bus:
            return _NOTHING
        path = self._path(adu.link, direction)
        if path is None:
            return _NOTHING
        try:
            message = decode_adu(adu.data)
            if path.is_request:
                return self._on_request(path, t_ns, direction, message, adu)
            return self._on_answer(path, t_ns, message, adu)
        except FormatError as error:
            return (self._malformed(path, t_ns, adu, error),)

    def feed_all(self, frames: Iterable[Frame]) -> list[Record]:
        """Decode many frames in their order."""
        records: list[Record] = []
        for frame in frames:
            records += self.feed(frame)
        return records

    def gap(self, t_ns: int, reason: str) -> Sequence[Record]:
        """Frames are missing before ``t_ns``: open requests are given up, mappings may have changed. A text key."""
        records: list[Record] = []
        for connection in self._connections.values():
            for asked in connection.close():
                records += self._teller.unanswered(connection.node, t_ns, asked, Outcome.LOST)
        self._connections.clear()
        for device in self._devices.values():
            device.forget()
        return (*records, GapSeen(t_ns, self.bus, 0, reason))

    # -- both directions -----------------------------------------------------------

    def _on_request(self, path: Path, t_ns: int, direction: Direction, message: Message, adu: Adu) -> Sequence[Record]:
        request, malformed = _request(message)
        lost = self._abandoned(path) if direction is Direction.TX else []
        lost += self._connection(path).ask(Open(t_ns, direction, message, request))
        if request is not None:
            self._device(path.node).asked(request, path.client)
        records = [record for asked in lost for record in self._teller.unanswered(path.node, t_ns, asked, Outcome.LOST)]
        return records if malformed is None else [*records, self._malformed(path, t_ns, adu, malformed)]

    def _on_answer(self, path: Path, t_ns: int, message: Message, adu: Adu) -> Sequence[Record]:
        connection = self._connection(path)
        asked = connection.waiting(message)
        if asked is not None and asked.request is None:
            connection.settle(asked, None)
            return _NOTHING
        try:
            answer = decode_answer(message.pdu)
        except FormatError as error:
            malformed = self._malformed(path, t_ns, adu, error)
            if asked is None:
                return (malformed,)
            connection.settle(asked, None)
            return (malformed, *self._teller.unanswered(path.node, t_ns, asked, Outcome.BROKEN))
        if asked is None or asked.request is None or not connection.settle(asked, answer):
            address = answer.address if isinstance(answer, ObjectRead | ObjectWritten) else None
            return (OrphanSeen(t_ns, self.bus, path.node, address, Side.SERVER, message.pdu),)
        device = self._device(path.node)
        restart = device.back(t_ns, self.bus, path.client)
        records = [*restart, *self._teller.answered(path.node, t_ns, asked, asked.request, answer)]
        return device.learn(t_ns, self.bus, records)

    def _malformed(self, path: Path, t_ns: int, adu: Adu, error: FormatError) -> MalformedAduSeen:
        return MalformedAduSeen(t_ns, self.bus, path.node, adu.link, error.fault, error.offset, adu.data)

    # -- bookkeeping -------------------------------------------------------------------

    def _path(self, link: str, direction: Direction) -> Path | None:
        key = (link, direction)
        if key not in self._paths:
            if len(self._paths) > _MAX_PATHS:
                self._paths.clear()
            self._paths[key] = path_of(link, direction, self._servers)
        return self._paths[key]

    def _connection(self, path: Path) -> Connection:
        key = (path.node, path.client)
        found = self._connections.get(key)
        if found is None:
            if len(self._connections) >= _MAX_CONNECTIONS:
                self._connections = {k: each for k, each in self._connections.items() if not each.idle}
            found = self._connections[key] = Connection(*key)
        return found

    def _abandoned(self, path: Path) -> list[Open]:
        """What stayed open on our earlier connections to the device: there is one at a time."""
        if (path.node, path.client) in self._connections:
            return []
        earlier = [each for each in self._connections.values() if each.node == path.node]
        return [asked for connection in earlier for asked in connection.close(Direction.TX)]

    def _device(self, node: int) -> DeviceWatch:
        found = self._devices.get(node)
        if found is None:
            found = self._devices[node] = DeviceWatch(node)
        return found

    # -- keyframes ---------------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state for a keyframe: open requests, and what was learned of devices. Servers are not in it."""
        return {
            "bus": self.bus,
            "protocol": self.PROTOCOL,
            "devices": {str(node): device.snapshot() for node, device in self._devices.items()},
            "open": [[*key, connection.snapshot()] for key, connection in self._connections.items()],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()`` with the servers set here. Raises KeyError or ValueError on another state."""
        devices, connections = {}, {}
        for number, kept in state["devices"].items():
            devices[int(number)] = DeviceWatch(int(number))
            devices[int(number)].restore(kept)
        for node, client, waiting in state["open"]:
            connections[node, client] = Connection(node, client)
            connections[node, client].restore(waiting)
        self._devices, self._connections = devices, connections


def _request(message: Message) -> tuple[Request | None, FormatError | None]:
    """The request; None where it is of a function that the device has not, with the error where it is malformed."""
    try:
        return decode_request(message.pdu), None
    except FormatError as error:
        return None, None if error.fault is Fault.FUNCTION else error
