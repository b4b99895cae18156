"""The passive CANopen decoder: frames of one bus in, records out, whoever sent them.

Understands NMT, boot-up, heartbeat, node guarding, SYNC, EMCY, PDOs by the mapping in force and every SDO transfer;
TIME and LSS are passed over. It sends nothing, reads no clock and never raises on any bytes: what makes no sense gives
a record that says so. COB-IDs are those of the predefined connection set (CiA 301, 7.3.5) until SDO traffic shows
others. One thread feeds it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from app.model.address import Address
from app.model.description import Description
from app.wire import emcy, nmt, sync, twin_environment
from app.wire.frame import Can, Direction, Frame
from app.wire.nmt import NmtState
from app.wire.pdo import Slot, unpack
from app.wire.pdo_follower import NodeConfiguration, PdoRoute, configures
from app.wire.records import (
    BootUpSeen,
    EmcySeen,
    EnvironmentSeen,
    Fault,
    GapSeen,
    LoadSeen,
    MalformedSeen,
    NmtCommandSeen,
    Outcome,
    Record,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    Source,
    StateSeen,
    SyncSeen,
    ValueSeen,
)
from app.wire.sdo_follower import SdoFollower
from app.wire.trace.service import UNKNOWN, Service, Speaker, predefined

ERROR_REGISTER: Final = Address(0x1001)
_EXTENDED: Final = 1 << 29
_NOTHING: Final[tuple[Record, ...]] = ()


class _Node:
    """What the decoder keeps of a node. ``state`` is None until a heartbeat or an NMT command tells it."""

    __slots__ = ("configuration", "layout", "number", "sdo", "state")

    def __init__(self, bus: str, number: int, description: Description | None) -> None:
        self.number = number
        self.sdo = SdoFollower(bus, number)
        self.configuration = NodeConfiguration(number, description)
        self.layout = self.configuration.layout()
        self.state: NmtState | None = None


class _PdoTarget:
    """One reading of a PDO: that of the node which sends it, or of one that takes it."""

    __slots__ = ("node", "received", "route", "size", "slots")

    def __init__(self, node: _Node, route: PdoRoute) -> None:
        self.node = node
        self.route = route
        self.size = route.mapping.size
        self.slots: tuple[Slot, ...] | None = route.mapping.slots
        self.received = route.source is Source.PDO_RX


_Handler = Callable[[Any, int, Direction, Can], Sequence[Record]]


class CanOpenDecoder:
    """Decoder of the bus ``bus``; ``descriptions`` by node number, more by ``set_description``."""

    def __init__(self, bus: str, descriptions: Mapping[int, Description] | None = None) -> None:
        self.bus = bus
        self._nodes = {
            number: _Node(bus, number, (descriptions or {}).get(number)) for number in range(1, nmt.MAX_NODE + 1)
        }
        self._routes: dict[int, tuple[_Handler, Any]] = {}
        self._speakers: dict[int, Speaker] = {}
        self.layouts = 0
        """Counts how often the meaning of identifiers was found out anew: equal counts, equal ``speakers``."""
        self._route()

    def set_description(self, node: int, description: Description | None) -> None:
        """Tell what the node is. Its mapping falls back to the description's defaults; open transfers go on.

        Raises KeyError where ``node`` is outside 1..127.
        """
        self._nodes[node].configuration = NodeConfiguration(node, description)
        self._refresh(self._nodes[node])

    def feed(self, frame: Frame) -> Sequence[Record]:
        """Decode one frame. Frames of other buses, remote and error frames say nothing."""
        t_ns, bus, direction, can, _ = frame
        if type(can) is not Can or bus != self.bus:
            return _NOTHING
        route = self._routes.get(can.can_id | _EXTENDED if can.extended else can.can_id)
        if route is None or can.remote or can.error:
            return _NOTHING
        handler, target = route
        return handler(target, t_ns, direction, can)

    def feed_all(self, frames: Iterable[Frame]) -> list[Record]:
        """Decode many frames in their order."""
        records: list[Record] = []
        feed = self.feed
        for frame in frames:
            records += feed(frame)
        return records

    def gap(self, t_ns: int, reason: str) -> Sequence[Record]:
        """Frames are missing before ``t_ns``: open transfers are given up. ``reason`` is a text key."""
        records: list[Record] = []
        for node in self._nodes.values():
            records += self._learned(node, node.sdo.close(t_ns))
            node.state = None
        return (*records, GapSeen(t_ns, self.bus, 0, reason))

    def pdos(self, node: int) -> tuple[PdoRoute, ...]:
        """The valid PDOs of ``node`` whose mapping is known, as in force now. Raises KeyError outside 1..127."""
        return self._nodes[node].layout.pdos

    def sdo(self, node: int) -> SdoFollower:
        """Who follows the transfers of ``node``. Raises KeyError outside 1..127."""
        return self._nodes[node].sdo

    def state(self, node: int) -> NmtState | None:
        """NMT state of ``node`` as heard last, None where nothing told it. Raises KeyError outside 1..127."""
        return self._nodes[node].state

    def service_ids(self) -> list[tuple[int, int, int, bool]]:
        """Of every node the identifiers of SDO request, SDO response and EMCY, and whether all are predefined."""
        return [node.layout[:4] for node in self._nodes.values()]

    def speakers(self) -> dict[int, Speaker]:
        """Whose every identifier is that ``feed`` listens to; extended ones plus 2^29."""
        services = self._services()
        found = {}
        for key, (handler, target) in self._routes.items():
            service = services.get(handler)
            number = 0 if target is None or service is None else target.number
            found[key] = self._who(key, key) if service is None else Speaker(service, number)
        return found

    def speaker(self, can_id: int, extended: bool = False) -> Speaker:
        """Whose identifier this is by what is known now, else by the predefined connection set."""
        if extended:
            return self._who(can_id | _EXTENDED, can_id)
        found = self._speakers.get(can_id)
        if found is None:
            found = self._speakers[can_id] = self._who(can_id, can_id)
        return found

    def _who(self, key: int, can_id: int) -> Speaker:
        route = self._routes.get(key)
        if route is None:
            return UNKNOWN if key & _EXTENDED else predefined(can_id)
        handler, target = route
        if handler == self._on_pdo:
            sender = next((one for one in target if not one.received), target[0])
            service = Service.RPDO if sender.received else Service.TPDO
            return Speaker(service, sender.node.number, sender.route.number)
        return Speaker(self._services()[handler], 0 if target is None else target.number)

    def _services(self) -> dict[_Handler, Service]:
        """The services but for PDOs, by who handles them."""
        return {
            self._on_sdo_request: Service.SDO_REQUEST,
            self._on_sdo_response: Service.SDO_RESPONSE,
            self._on_emcy: Service.EMCY,
            self._on_heartbeat: Service.HEARTBEAT,
            self._on_nmt: Service.NMT,
            self._on_sync: Service.SYNC,
            self._on_environment: Service.TWIN,
        }

    # -- routes ----------------------------------------------------------------

    def _refresh(self, node: _Node) -> None:
        layout = node.configuration.layout()
        if layout != node.layout:
            node.layout = layout
            self._route()

    def _route(self) -> None:
        """Make the table from CAN identifier (extended: plus 2^29) to handler.

        Where identifiers clash, fixed services win over PDOs, and predefined identifiers over learned ones.
        """
        routes: dict[int, tuple[_Handler, Any]] = {}
        targets: dict[int, list[_PdoTarget]] = {}
        for node in self._nodes.values():
            for route in node.layout.pdos:
                key = route.can_id | _EXTENDED if route.extended else route.can_id
                targets.setdefault(key, []).append(_PdoTarget(node, route))
        for key, readings in targets.items():
            routes[key] = (self._on_pdo, readings)
        for node in sorted(self._nodes.values(), key=lambda node: node.layout.predefined):
            routes[node.layout.sdo_request] = (self._on_sdo_request, node)
            routes[node.layout.sdo_response] = (self._on_sdo_response, node)
            routes[node.layout.emcy] = (self._on_emcy, node)
        for node in self._nodes.values():
            routes[nmt.HEARTBEAT_BASE + node.number] = (self._on_heartbeat, node)
        routes[nmt.NMT_COB_ID] = (self._on_nmt, None)
        routes[sync.SYNC_COB_ID] = (self._on_sync, None)
        routes[twin_environment.CAN_ID | _EXTENDED] = (self._on_environment, None)
        self._routes = routes
        self._speakers.clear()
        self.layouts += 1

    # -- services --------------------------------------------------------------

    def _on_sdo_request(self, node: _Node, t_ns: int, direction: Direction, can: Can) -> Sequence[Record]:
        records = node.sdo.request(t_ns, direction, can.can_id, can.data)
        return self._learned(node, records) if records else records

    def _on_sdo_response(self, node: _Node, t_ns: int, _direction: Direction, can: Can) -> Sequence[Record]:
        records = node.sdo.response(t_ns, can.can_id, can.data)
        return self._learned(node, records) if records else records

    def _learned(self, node: _Node, records: Sequence[Record]) -> Sequence[Record]:
        """Take what the records say about the mapping."""
        configuration, changed = node.configuration, False
        for record in records:
            if isinstance(record, ValueSeen):
                if configures(record.address):
                    changed |= configuration.learn(record.address, record.data, record.source is Source.SDO_WRITE)
            elif isinstance(record, SdoSeen):
                unsure = record.outcome is not Outcome.DONE and record.aborted_by is not Side.SERVER
                if unsure and record.access is SdoAccess.WRITE and configures(record.address):
                    changed |= configuration.forget(record.address)
            elif isinstance(record, SaveSeen) and record.done:
                configuration.save(record.address)
            elif isinstance(record, LoadSeen) and record.done:
                configuration.load(record.address)
        if changed:
            self._refresh(node)
        return records

    def _on_pdo(self, targets: list[_PdoTarget], t_ns: int, _direction: Direction, can: Can) -> Sequence[Record]:
        data, bus = can.data, self.bus
        records: list[Record] = []
        for target in targets:
            node = target.node
            if target.received and node.state not in (None, NmtState.OPERATIONAL):
                continue  # a node takes PDOs only when operational
            if len(data) < target.size:
                records.append(MalformedSeen(t_ns, bus, node.number, can.can_id, Fault.PDO_LENGTH, data))
                continue
            number, source = node.number, target.route.source
            if target.slots is None:
                values = unpack(target.route.mapping, data)
                records += [ValueSeen(t_ns, bus, number, address, raw, source) for address, raw in values]
            else:
                records += [
                    ValueSeen(t_ns, bus, number, address, data[start:stop], source)
                    for address, start, stop in target.slots
                ]
        return records

    def _on_heartbeat(self, node: _Node, t_ns: int, _direction: Direction, can: Can) -> Sequence[Record]:
        number, data = node.number, can.data
        if len(data) != 1:
            return (MalformedSeen(t_ns, self.bus, number, can.can_id, Fault.LENGTH, data),)
        try:
            state = NmtState(data[0] & 0x7F)
        except ValueError:
            return (MalformedSeen(t_ns, self.bus, number, can.can_id, Fault.STATE, data),)
        if state is not NmtState.BOOT_UP:
            node.state = state
            return (StateSeen(t_ns, self.bus, number, state),)
        lost = self._learned(node, node.sdo.close(t_ns))
        node.state = NmtState.PRE_OPERATIONAL
        if node.configuration.boot_up():
            self._refresh(node)
        return (*lost, BootUpSeen(t_ns, self.bus, number))

    def _on_nmt(self, _target: None, t_ns: int, direction: Direction, can: Can) -> Sequence[Record]:
        try:
            command, number = nmt.parse_nmt_message(can.data)
        except ValueError:
            fault = Fault.COMMAND if len(can.data) == 2 else Fault.LENGTH
            return (MalformedSeen(t_ns, self.bus, 0, can.can_id, fault, can.data),)
        for node in self._nodes.values() if number == nmt.ALL_NODES else (self._nodes[number],):
            node.state = command.leads_to  # the best guess until the next heartbeat, and where there is none
        return (NmtCommandSeen(t_ns, self.bus, number, command, direction),)

    def _on_emcy(self, node: _Node, t_ns: int, _direction: Direction, can: Can) -> Sequence[Record]:
        bus, number = self.bus, node.number
        try:
            code, register, data = emcy.parse_emcy(can.data)
        except ValueError:
            return (MalformedSeen(t_ns, bus, number, can.can_id, Fault.LENGTH, can.data),)
        return (
            EmcySeen(t_ns, bus, number, code, register, data),
            ValueSeen(t_ns, bus, number, ERROR_REGISTER, bytes((register,)), Source.EMCY),
        )

    def _on_sync(self, _target: None, t_ns: int, _direction: Direction, can: Can) -> Sequence[Record]:
        try:
            counter = sync.parse_sync(can.data)
        except ValueError:
            return (MalformedSeen(t_ns, self.bus, 0, can.can_id, Fault.LENGTH, can.data),)
        return (SyncSeen(t_ns, self.bus, 0, counter),)

    def _on_environment(self, _target: None, t_ns: int, _direction: Direction, can: Can) -> Sequence[Record]:
        try:
            return (EnvironmentSeen(t_ns, self.bus, 0, twin_environment.parse_environment(can.data)),)
        except ValueError:
            return ()  # somebody else's frame: on a bus without twins the identifier means nothing to us

    # -- keyframes -------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state for a keyframe: open transfers, learned mappings, NMT states. Descriptions are not in it."""
        nodes = {}
        for number, node in self._nodes.items():
            configuration, transfer = node.configuration.snapshot(), node.sdo.snapshot()
            if node.state is not None or transfer is not None or any(configuration.values()):
                nodes[str(number)] = {"state": node.state, "sdo": transfer, "configuration": configuration}
        return {"bus": self.bus, "nodes": nodes}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()`` with the descriptions set here. Raises KeyError or ValueError on another state."""
        nothing: dict[str, Any] = {"known": {}, "stored": {}, "written": []}
        for number, node in self._nodes.items():
            kept = state["nodes"].get(str(number), {"state": None, "sdo": None, "configuration": nothing})
            node.state = None if kept["state"] is None else NmtState(kept["state"])
            node.sdo.restore(kept["sdo"])
            node.configuration.restore(kept["configuration"])
            node.layout = node.configuration.layout()
        self._route()
