"""The live state: what is known now of every node and object, from records alone, with time and source.

One thread writes (``apply``, ``apply_all``, ``tick``, ``restore``, ``set_description``); any thread reads, through the
same lock, and gets immutable copies. Every change raises ``version``; ``changes_since`` gives what changed after one,
in time proportional to the changes, so that any number of readers can coalesce at their own pace.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from threading import Lock
from typing import Any, Final, NamedTuple

from app.model.address import Address
from app.model.description import Description
from app.wire import sdo
from app.wire.events import (
    Event,
    EventKind,
    EventLog,
    Severity,
    Told,
    tell_diagnosis,
    tell_emcy,
    tell_fault,
    tell_sdo,
    tell_slave,
    tell_transaction,
)
from app.wire.frame import Direction
from app.wire.live_node import LiveNode, NodeView
from app.wire.memory import Cell, Reading, Stored
from app.wire.nmt import ALL_NODES, NmtCommand, NmtState
from app.wire.records import (
    BootUpSeen,
    DiagnosisSeen,
    EmcySeen,
    EnvironmentSeen,
    FaultSeen,
    GapSeen,
    LoadSeen,
    MalformedAduSeen,
    MalformedSeen,
    NmtCommandSeen,
    OrphanSeen,
    Outcome,
    Protocol,
    Record,
    RestartSeen,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    SlaveSeen,
    SlaveState,
    Source,
    StateSeen,
    SyncSeen,
    TransactionSeen,
    ValueSeen,
)
from app.wire.sdo_follower import LOAD_INDEX, SAVE_INDEX
from app.wire.twin_environment import TwinEnvironment

__all__ = ["Changes", "LiveState", "NodeView", "ValueView"]

HEARTBEAT_PRODUCER: Final = Address(0x1017)
SILENT_FACTOR: Final = 1.5
"""A node is silent after so many heartbeat periods."""
SILENT_MARGIN_NS: Final = 100_000_000
_WITHOUT_HEARTBEATS: Final = (Protocol.OBJECT, Protocol.FRAMES, Protocol.REGISTERS, Protocol.PKW)
"""What is spoken where only an answer tells that a device is there."""
SNAPSHOT_VERSION: Final = 1
_SNAPSHOT_EVENTS: Final = 200


class ValueView(NamedTuple):
    """One object now. ``reading`` None: RAM is unknown; ``stored`` None: unknown (a dash)."""

    bus: str
    node: int
    address: Address
    reading: Reading | None
    stored: Stored | None
    stale: bool
    version: int


class Changes(NamedTuple):
    """What changed up to ``version``. ``full``: this is everything; drop what was known before."""

    version: int
    t_ns: int
    full: bool
    values: tuple[ValueView, ...]
    nodes: tuple[NodeView, ...]
    events: tuple[Event, ...]


class LiveState:
    """The state of all buses. Keeps the last ``max_events`` events."""

    def __init__(self, max_events: int = 2000) -> None:
        self._lock = Lock()
        self._max_events = max_events
        self._version = 0
        self._full_since = 0
        self._t_ns = 0
        self._nodes: dict[tuple[str, int], LiveNode] = {}
        # Changed cells and nodes, the latest change last: reading backwards gives what is newer than a version.
        self._changed_cells: dict[Cell, None] = {}
        self._changed_nodes: dict[LiveNode, None] = {}
        self._events = EventLog(max_events)
        self._environment: EnvironmentSeen | None = None
        self._handlers: dict[type, Callable[[Any], None]] = {
            ValueSeen: self._on_value,
            SdoSeen: self._on_sdo,
            OrphanSeen: self._on_orphan,
            SaveSeen: self._on_save,
            LoadSeen: self._on_load,
            NmtCommandSeen: self._on_nmt,
            StateSeen: self._on_state,
            BootUpSeen: self._on_boot_up,
            EmcySeen: self._on_emcy,
            SyncSeen: self._on_sync,
            EnvironmentSeen: self._on_environment,
            GapSeen: self._on_gap,
            MalformedSeen: self._on_malformed,
            TransactionSeen: self._on_transaction,
            RestartSeen: self._on_restart,
            FaultSeen: self._on_fault,
            MalformedAduSeen: self._on_malformed_adu,
            SlaveSeen: self._on_slave,
            DiagnosisSeen: self._on_diagnosis,
        }

    # -- writing -----------------------------------------------------------------

    def set_description(self, bus: str, node: int, description: Description | None) -> None:
        """Tell what a node is: which objects are saved, which are mirrors, and the words of its error codes."""
        with self._lock:
            self._node(bus, node).memory.description = description

    def apply(self, record: Record) -> None:
        """Take one record of a decoder."""
        with self._lock:
            self._t_ns = record.t_ns
            self._handlers[type(record)](record)

    def apply_all(self, records: Iterable[Record]) -> None:
        """Take many records in their order, under one lock."""
        with self._lock:
            for record in records:
                self._t_ns = record.t_ns
                self._handlers[type(record)](record)

    def tick(self, now_ns: int) -> None:
        """Find nodes whose heartbeat is overdue at ``now_ns``. Call it a few times a second."""
        with self._lock:
            self._t_ns = max(self._t_ns, now_ns)
            for node in self._nodes.values():
                period_ns = node.period_ns or node.interval_ns
                if node.silent or period_ns is None or node.heartbeat_ns is None:
                    continue
                if now_ns - node.heartbeat_ns > period_ns * SILENT_FACTOR + SILENT_MARGIN_NS:
                    node.silent = True
                    self._touch_node(node)
                    self._tell(node, now_ns, EventKind.HEARTBEAT_LOST, Severity.ERROR, period_ms=period_ns / 1e6)

    # -- reading -----------------------------------------------------------------

    @property
    def version(self) -> int:
        """Raised by every change."""
        return self._version

    @property
    def t_ns(self) -> int:
        """Time of the latest record or tick."""
        return self._t_ns

    def changes_since(self, version: int) -> Changes:
        """What changed after ``version``; everything where that is 0 or older than a ``restore``."""
        with self._lock:
            full = not self._full_since < version <= self._version
            floor = 0 if full else version
            cells, nodes = [], []
            for cell in reversed(self._changed_cells):
                if cell.version <= floor:
                    break
                cells.append(_view(cell))
            for node in reversed(self._changed_nodes):
                if node.version <= floor:
                    break
                nodes.append(node.view())
            events = self._events.since(floor)
            return Changes(self._version, self._t_ns, full, tuple(cells[::-1]), tuple(nodes[::-1]), events)

    def value(self, bus: str, node: int, address: Address) -> ValueView | None:
        """One object, or None where nothing was ever seen of it."""
        with self._lock:
            found = self._nodes.get((bus, node))
            cell = None if found is None else found.memory.cells.get(address)
            return None if cell is None else _view(cell)

    def values(self, bus: str, node: int) -> dict[Address, ValueView]:
        """All objects of a node of which anything was seen."""
        with self._lock:
            found = self._nodes.get((bus, node))
            return {} if found is None else {a: _view(cell) for a, cell in found.memory.cells.items()}

    def node(self, bus: str, node: int) -> NodeView | None:
        """One node, or None where it never said anything."""
        with self._lock:
            found = self._nodes.get((bus, node))
            return found.view() if found is not None and found.seen else None

    def nodes(self) -> list[NodeView]:
        """All nodes that ever said anything, by bus and number."""
        with self._lock:
            seen = [node.view() for node in self._nodes.values() if node.seen]
        return sorted(seen, key=lambda view: (view.bus, view.node))

    @property
    def environment(self) -> EnvironmentSeen | None:
        """Rotor and wind as a twin told them last; None where none did."""
        return self._environment

    def events(self, since_version: int = 0) -> tuple[Event, ...]:
        """The kept events later than ``since_version``, oldest first."""
        with self._lock:
            return self._events.since(since_version)

    # -- keyframes ---------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state for a keyframe, with the last 200 events; descriptions are not in it."""
        with self._lock:
            return {
                "snapshot": SNAPSHOT_VERSION,
                "t_ns": self._t_ns,
                "nodes": [node.snapshot() for node in self._nodes.values()],
                "events": self._events.snapshot(_SNAPSHOT_EVENTS),
                "environment": None if self._environment is None else list(self._environment),
            }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Replace all by ``snapshot()``; descriptions stay. Readers get everything anew (``Changes.full``).

        Raises KeyError or ValueError on another state; then nothing has changed.
        """
        if state["snapshot"] != SNAPSHOT_VERSION:
            raise ValueError(f"snapshot version {state['snapshot']}")
        nodes: dict[tuple[str, int], LiveNode] = {}
        for item in state["nodes"]:
            node = nodes[item["bus"], item["node"]] = LiveNode(item["bus"], item["node"])
            node.restore(item)
        events = EventLog(self._max_events)
        events.restore(state["events"], self._version + 1)
        environment = _environment_of(state.get("environment"))
        with self._lock:
            self._full_since = self._version
            for key, before in self._nodes.items():
                nodes.setdefault(key, LiveNode(*key)).memory.description = before.memory.description
            self._nodes, self._events, self._t_ns = nodes, events, state["t_ns"]
            self._environment = environment
            self._changed_cells, self._changed_nodes = {}, {}
            self._version += 1
            for node in nodes.values():
                if node.seen:
                    self._touch_node(node)
                for cell in node.memory.cells.values():
                    self._touch_cell(cell)

    # -- records -----------------------------------------------------------------

    def _on_value(self, seen: ValueSeen) -> None:
        t_ns, bus, number, address, data, source = seen
        node = self._nodes.get((bus, number)) or self._node(bus, number)
        memory = node.memory
        cell = memory.cells.get(address) or memory.cell(address)
        reading = Reading(data, t_ns, source)
        if source is Source.PDO_TX or source is Source.EMCY:
            memory.sent(cell, reading)
            self._touch_cell(cell)
            if node.exchanging:
                node.answered_ns = t_ns
        elif source is Source.SDO_READ:
            if memory.read(cell, reading):
                self._tell(node, t_ns, EventKind.STORED_DIFFERS, Severity.WARNING, address=address.short)
            self._touch_cell(cell)
        else:
            self._touch_cells(memory.written(cell, reading))
        if source is not Source.PDO_RX and not node.seen:
            self._see(node)
        if address == HEARTBEAT_PRODUCER and len(data) == 2:
            node.period_ns = int.from_bytes(data, "little") * 1_000_000 or None
            self._touch_node(node)

    def _on_sdo(self, seen: SdoSeen) -> None:
        node = self._node(seen.bus, seen.node)
        if seen.outcome is Outcome.DONE or seen.aborted_by is Side.SERVER:
            if seen.protocol in _WITHOUT_HEARTBEATS:
                node.answered_ns = seen.t_ns
            self._see(node)
        if seen.client is Direction.RX and node.seen:
            node.other_client_ns = seen.t_ns
            self._touch_node(node)
        if seen.access is SdoAccess.WRITE:
            self._on_unfinished_write(node, seen)
        told = tell_sdo(seen)
        if told is not None and node.seen:
            self._add_event(seen.t_ns, seen.bus, seen.node, told)

    def _on_unfinished_write(self, node: LiveNode, seen: SdoSeen) -> None:
        """A write whose end nobody saw, one given up by its client, or a save that broke."""
        unsure = seen.outcome in (Outcome.LOST, Outcome.BROKEN) or seen.aborted_by is Side.CLIENT
        if seen.address.major == SAVE_INDEX:
            if unsure or seen.abort_code == sdo.Abort.HARDWARE:
                self._touch_cells(node.memory.save_unsure())
        elif not unsure:
            return
        elif seen.address.major == LOAD_INDEX:
            self._touch_cells(node.memory.loaded(seen.address))
        else:
            self._touch_cells(node.memory.unsure(node.memory.cell(seen.address)))

    def _on_orphan(self, seen: OrphanSeen) -> None:
        node = self._node(seen.bus, seen.node)
        if seen.side is Side.SERVER:
            self._see(node)
        if node.seen:
            address = None if seen.address is None else seen.address.short
            self._tell(
                node, seen.t_ns, EventKind.ORPHAN, Severity.WARNING,
                address=address, data=seen.data.hex(), side=seen.side.value,
            )  # fmt: skip

    def _on_save(self, seen: SaveSeen) -> None:
        node = self._node(seen.bus, seen.node)
        if seen.done:
            self._touch_cells(node.memory.saved(seen.address, seen.t_ns))
            self._tell(node, seen.t_ns, EventKind.SAVED, Severity.INFO, address=seen.address.short)
        elif node.seen:
            self._tell(node, seen.t_ns, EventKind.SAVE_FAILED, Severity.ERROR, address=seen.address.short)

    def _on_load(self, seen: LoadSeen) -> None:
        node = self._node(seen.bus, seen.node)
        if seen.done:
            self._touch_cells(node.memory.loaded(seen.address))
            self._tell(node, seen.t_ns, EventKind.LOADED, Severity.WARNING, address=seen.address.short)
        elif node.seen:
            self._tell(node, seen.t_ns, EventKind.LOAD_FAILED, Severity.ERROR, address=seen.address.short)

    def _on_nmt(self, seen: NmtCommandSeen) -> None:
        nodes = [n for n in self._nodes.values() if n.bus == seen.bus and seen.node in (ALL_NODES, n.number)]
        for node in nodes:
            if seen.command.leads_to is None:
                node.state = None
                node.reset_communication = seen.command is NmtCommand.RESET_COMMUNICATION
            elif node.state is not seen.command.leads_to:
                node.state, node.commanded = seen.command.leads_to, True
            if node.seen:
                self._touch_node(node)
        details = {"command_key": seen.command.text_key, "client": seen.client.value}
        kind = EventKind.NMT_COMMAND
        self._add_event(seen.t_ns, seen.bus, seen.node, Told(kind, Severity.INFO, kind.text_key, details))

    def _on_state(self, seen: StateSeen) -> None:
        node = self._node(seen.bus, seen.node)
        if node.heartbeat_ns is not None and not node.silent:
            node.measured(seen.t_ns - node.heartbeat_ns)
        node.heartbeat_ns = seen.t_ns
        if node.silent:
            node.silent = False
            self._tell(node, seen.t_ns, EventKind.HEARTBEAT_BACK, Severity.INFO)
        if node.state is not seen.state or node.commanded:
            node.state, node.commanded = seen.state, False
            self._tell(node, seen.t_ns, EventKind.STATE_CHANGED, Severity.INFO, state_key=seen.state.text_key)
        self._see(node)
        self._touch_node(node)

    def _on_boot_up(self, seen: BootUpSeen) -> None:
        node = self._node(seen.bus, seen.node)
        self._touch_cells(node.memory.boot_up(node.reset_communication))
        node.reset_communication = False
        node.state, node.commanded = NmtState.PRE_OPERATIONAL, False
        node.boot_ns, node.boots = seen.t_ns, node.boots + 1
        node.period_ns = node.emcy_code = None
        node.forget_heartbeat()
        node.silent = False
        self._see(node)
        self._touch_node(node)
        self._tell(node, seen.t_ns, EventKind.BOOT_UP, Severity.INFO, boots=node.boots)

    def _on_emcy(self, seen: EmcySeen) -> None:
        node = self._node(seen.bus, seen.node)
        node.emcy_code, node.emcy_ns = seen.code, seen.t_ns
        self._see(node)
        self._touch_node(node)
        self._add_event(seen.t_ns, seen.bus, seen.node, tell_emcy(seen, node.memory.description))

    def _on_sync(self, seen: SyncSeen) -> None:
        """Time goes on; nothing else."""

    def _on_environment(self, seen: EnvironmentSeen) -> None:
        self._environment = seen
        self._version += 1

    def _on_gap(self, seen: GapSeen) -> None:
        for node in self._nodes.values():
            if node.bus == seen.bus:
                self._touch_cells(node.memory.gap())
                node.state = None
                node.forget_heartbeat()
                if node.seen:
                    self._touch_node(node)
        kind = EventKind.GAP
        told = Told(kind, Severity.WARNING, kind.text_key, {"reason_key": seen.reason})
        self._add_event(seen.t_ns, seen.bus, seen.node, told)

    def _on_malformed(self, seen: MalformedSeen) -> None:
        kind = EventKind.MALFORMED
        details = {"can_id_hex": f"{seen.can_id:X}h", "fault_key": seen.fault.text_key, "data": seen.data.hex()}
        self._add_event(seen.t_ns, seen.bus, seen.node, Told(kind, Severity.WARNING, kind.text_key, details))

    def _on_transaction(self, seen: TransactionSeen) -> None:
        node = self._node(seen.bus, seen.node)
        if seen.outcome in (Outcome.DONE, Outcome.ABORTED):
            node.answered_ns = seen.t_ns
            self._see(node)
        if seen.client is Direction.RX and node.seen:
            node.other_client_ns = seen.t_ns
            self._touch_node(node)
        told = tell_transaction(seen)
        if told is not None and node.seen:
            self._add_event(seen.t_ns, seen.bus, seen.node, told)

    def _on_restart(self, seen: RestartSeen) -> None:
        """As a boot-up, of a device that has no NMT state."""
        node = self._node(seen.bus, seen.node)
        self._touch_cells(node.memory.boot_up(communication_only=False))
        node.boot_ns, node.boots = seen.t_ns, node.boots + 1
        self._see(node)
        self._touch_node(node)
        self._tell(node, seen.t_ns, EventKind.BOOT_UP, Severity.INFO, boots=node.boots)

    def _on_fault(self, seen: FaultSeen) -> None:
        description = self._node(seen.bus, seen.node).memory.description
        self._add_event(seen.t_ns, seen.bus, seen.node, tell_fault(seen, description))

    def _on_malformed_adu(self, seen: MalformedAduSeen) -> None:
        details = {"fault_key": seen.fault.text_key, "offset": seen.offset, "link": seen.link, "data": seen.data.hex()}
        key = "event.malformed_adu" if seen.link else "event.malformed_fdl"
        told = Told(EventKind.MALFORMED, Severity.WARNING, key, details)
        self._add_event(seen.t_ns, seen.bus, seen.node, told)

    def _on_slave(self, seen: SlaveSeen) -> None:
        node = self._node(seen.bus, seen.node)
        self._see(node)
        node.silent = seen.state is SlaveState.ABSENT
        if not node.silent:
            node.answered_ns = seen.t_ns
        exchanging = seen.state is SlaveState.EXCHANGING
        if exchanging and node.exchanging is False:
            self._came_back(node, seen.t_ns)
        if exchanging or node.exchanging is not None:
            node.exchanging = exchanging
        self._touch_node(node)
        self._add_event(seen.t_ns, seen.bus, seen.node, tell_slave(seen))

    def _came_back(self, node: LiveNode, t_ns: int) -> None:
        """A slave that had to be parametrised again was switched off, or only cut off: nobody can tell which.

        So what it holds has to be read again, and proves nothing of what it has stored.
        """
        self._touch_cells(node.memory.gap())
        node.boot_ns, node.boots = t_ns, node.boots + 1

    def _on_diagnosis(self, seen: DiagnosisSeen) -> None:
        node = self._node(seen.bus, seen.node)
        self._see(node)
        told = f"{seen.status:06X} {seen.ident:04X} {seen.extended.hex()}"
        if told != node.diagnosis:
            node.diagnosis = told
            self._add_event(seen.t_ns, seen.bus, seen.node, tell_diagnosis(seen))

    # -- bookkeeping -------------------------------------------------------------

    def _node(self, bus: str, number: int) -> LiveNode:
        node = self._nodes.get((bus, number))
        if node is None:
            node = self._nodes[bus, number] = LiveNode(bus, number)
        return node

    def _see(self, node: LiveNode) -> None:
        if not node.seen:
            node.seen = True
            self._touch_node(node)

    def _touch_cell(self, cell: Cell) -> None:
        self._version += 1
        cell.version = self._version
        self._changed_cells.pop(cell, None)
        self._changed_cells[cell] = None

    def _touch_cells(self, cells: Iterable[Cell]) -> None:
        for cell in cells:
            self._touch_cell(cell)

    def _touch_node(self, node: LiveNode) -> None:
        self._version += 1
        node.version = self._version
        self._changed_nodes.pop(node, None)
        self._changed_nodes[node] = None

    def _tell(self, node: LiveNode, t_ns: int, kind: EventKind, severity: Severity, **details: Any) -> None:
        self._add_event(t_ns, node.bus, node.number, Told(kind, severity, kind.text_key, details))

    def _add_event(self, t_ns: int, bus: str, node: int, told: Told) -> None:
        self._version += 1
        self._events.add(Event(self._version, t_ns, bus, node, *told))


def _view(cell: Cell) -> ValueView:
    return ValueView(cell.bus, cell.node, cell.address, cell.reading, cell.stored, cell.stale, cell.version)


def _environment_of(kept: list[Any] | None) -> EnvironmentSeen | None:
    """What a snapshot kept; those of older recordings have nothing of the kind. Raises ValueError."""
    if kept is None:
        return None
    try:
        t_ns, bus, node, environment = kept
        return EnvironmentSeen(t_ns, bus, node, TwinEnvironment(*environment))
    except TypeError as error:
        raise ValueError(f"{kept} is no environment") from error
