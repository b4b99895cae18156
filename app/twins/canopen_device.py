"""A CANopen device on a line, built from its description: NMT slave, SDO server, heartbeat, EMCY, SYNC and PDOs.

Knows CiA 301 and nothing of what the device does; that is the ``Application`` which sits on it. Time is the line's.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw, encode_raw
from app.model.description import Description, Entry
from app.twins import sdo_block
from app.twins.emergency import Emergency
from app.twins.heartbeat import HeartbeatConsumer, HeartbeatProducer
from app.twins.nonvolatile import NonVolatile
from app.twins.object_store import ObjectStore, RefusedAccessError
from app.twins.pdo_engine import PdoEngine
from app.twins.ports import Alarm, Line
from app.twins.sdo_server import TIMEOUT_NS, SdoServer
from app.twins.state_file import StateFile
from app.wire import nmt, sdo, sync
from app.wire.frame import Can
from app.wire.nmt import NmtCommand, NmtState
from app.wire.sdo import Abort

MS: Final = 1_000_000
SECOND: Final = 1_000_000_000
HEARTBEAT_LOST: Final = 0x8130
"""Emergency code: life guard or heartbeat error (CiA 301, table 26)."""
OVERFLOW: Final = 0x8110
"""Emergency code: CAN overrun, messages lost (CiA 301, table 26)."""
WAS_BUS_OFF: Final = 0x8140
"""Emergency code: recovered from bus off (CiA 301, table 26)."""
_COMMUNICATION: Final = range(0x1000, 0x2000)
_SYNC_PRODUCER: Final = 1 << 30
_EXTENDED: Final = 1 << 29
_RESET_COMMUNICATION_NS: Final = 20 * MS
_QUEUE_FRAMES: Final = sdo_block.MAX_BLOCK + 17
"""OPEN how many frames wait in a unit whose bus is not free; a block of SDO segments, and some besides."""


class Power(Enum):
    """What of the device is alive."""

    OFF = "off"
    BOOTING = "booting"
    ON = "on"


@dataclass(frozen=True, slots=True)
class Mount:
    """How a device sits on the line. Durations in ns.

    ``turnaround_ns``: from an SDO request to the answer. ``boot_ns``: from power-on or reset to the boot-up message.
    ``save_ns``: how long 1010h and 1011h take. ``delivered``: what its memory holds when it leaves the maker, as
    raw integers. ``identity``: texts and numbers of 1008h, 1018h and their like that belong to this unit.
    """

    turnaround_ns: int = MS
    boot_ns: int = 500 * MS
    save_ns: int = 300 * MS
    factory: bool = False
    state_path: Path | None = None
    delivered: Mapping[Address, int] = field(default_factory=dict)
    identity: Mapping[Address, int | str] = field(default_factory=dict)


class Application:
    """What the device does. All methods run on the line's thread, ``t_ns`` is its time."""

    def restarted(self, t_ns: int) -> None:
        """RAM holds saved values and defaults; the device begins to boot."""

    def booted(self, t_ns: int) -> None:
        """The boot-up message was sent."""

    def powered_off(self) -> None:
        """The supply is gone; all that it drives falls off, at once."""

    def communication_error(self, code: int) -> None:
        """Raise a communication error with the code of an emergency message."""

    def memory_failed(self, t_ns: int) -> None:
        """The memory could not be written."""

    def nmt_changed(self, state: NmtState, t_ns: int) -> None:
        """The node is now in ``state``."""

    def synchronised(self, t_ns: int) -> None:
        """A SYNC came."""


class CanopenDevice:
    """One node. Build it, set ``application``, then call ``power_on``."""

    def __init__(self, line: Line, node_id: int, description: Description, mount: Mount) -> None:
        if not 1 <= node_id <= nmt.MAX_NODE:
            raise ValueError(f"node {node_id} is outside 1..127")
        self.line = line
        self.node_id = node_id
        self.description = description
        self.application = Application()
        self.power = Power.OFF
        self.state = NmtState.BOOT_UP
        self._mount = mount
        self._routes: dict[int, Callable[[Can, int], None]] = {}
        self._own_routes: dict[int, Callable[[Can, int], None]] = {}
        self._overflown = False
        self._powered_ns = 0
        self._boot_alarm = Alarm(line)
        self._port = self.port = line.attach(self._on_frame)
        self.store = ObjectStore(description, node_id, factory=mount.factory)
        self._give_identity(mount.identity)
        self.emergency = Emergency(self.store, self._send_emergency, self._uptime_s)
        self.memory = NonVolatile(
            self.store,
            None if mount.state_path is None else StateFile(mount.state_path, description.id),
            duration_ns=mount.save_ns,
            delivered=self._delivered(mount.delivered),
            failed=lambda: self.application.memory_failed(self.line.now_ns),
        )
        # The client cannot go on before it has the answer, so the turnaround is not its time.
        self._sdo = SdoServer(self.store, line, self._answer, TIMEOUT_NS + mount.turnaround_ns)
        self._producer = HeartbeatProducer(self.store, line, self._beat)
        self._consumer = HeartbeatConsumer(self.store, line, self._heartbeat_lost, self._route)
        self._pdo = PdoEngine(self.store, line, self._transmit, self._route)
        self._install_sync()
        self._route()

    # -- for the application and whoever builds the device -------------------------

    def power_on(self, t_ns: int) -> None:
        """Start with what the memory holds."""
        self._restart(t_ns)

    def power_off(self) -> None:
        """Fall silent; remanent values are kept."""
        self.memory.keep()
        self._silence()
        self.power = Power.OFF
        self.application.powered_off()

    def cut_power(self) -> None:
        """Lose the supply at this instant: what the memory's file does not hold is gone, a running save with it."""
        self.memory.forget()
        self._silence()
        self.power = Power.OFF
        self.application.powered_off()

    def bus_off(self) -> None:
        """The CAN controller takes itself off the bus (ISO 11898-1, 12.1.4); the device knows at once and reacts."""
        self.port.cut()
        if self.power is Power.ON:
            self.application.communication_error(WAS_BUS_OFF)

    def bus_back(self) -> None:
        """The CAN controller is back on the bus, and now others hear of it (CiA 301, table 26)."""
        self.port.join()
        self.emergency.repeat(WAS_BUS_OFF)

    def poll(self, t_ns: int) -> None:
        """Let event-driven PDOs see what changed."""
        if self.state is NmtState.OPERATIONAL:
            self._pdo.poll(t_ns)

    def listen(self, can_id: int, handler: Callable[[Can, int], None]) -> None:
        """Receive frames of the maker's own, which CiA 301 does not know; none while the node is stopped."""
        self._own_routes[can_id] = handler
        self._route()

    def send(self, can: Can) -> None:
        """Send a frame of the maker's own; nothing while the node boots or is stopped (CiA 301, 7.3.2.2.4)."""
        if self.power is Power.ON and self.state is not NmtState.STOPPED:
            self._transmit(can)

    # -- boot and NMT (7.3.2) ------------------------------------------------------

    def _restart(self, t_ns: int) -> None:
        """Power-on and NMT reset node: all RAM is lost, the memory comes back."""
        self._silence()
        self.emergency.reset()
        self.memory.recall(_all)
        self._powered_ns = t_ns
        self._boot(t_ns, self._mount.boot_ns)
        self.application.restarted(t_ns)

    def _reset_communication(self, t_ns: int) -> None:
        self._silence()
        self.memory.recall(_is_communication)
        self._boot(t_ns, _RESET_COMMUNICATION_NS)

    def _boot(self, t_ns: int, duration_ns: int) -> None:
        self.power = Power.BOOTING
        self.state = NmtState.BOOT_UP
        self._route()
        self._boot_alarm.set(t_ns + duration_ns, self._booted)

    def _booted(self, t_ns: int) -> None:
        self.power = Power.ON
        self._port.send(Can(nmt.HEARTBEAT_BASE + self.node_id, nmt.heartbeat(NmtState.BOOT_UP)))
        self._enter(NmtState.PRE_OPERATIONAL, t_ns)
        self._producer.start()
        self.application.booted(t_ns)

    def _silence(self) -> None:
        self._boot_alarm.clear()
        self._producer.stop()
        self._consumer.reset()
        self._pdo.stop()
        self._sdo.reset()
        self._port.clear()

    def _enter(self, state: NmtState, t_ns: int) -> None:
        if state is self.state:
            return
        was, self.state = self.state, state
        if state is NmtState.OPERATIONAL:
            self._pdo.start()
        elif was is NmtState.OPERATIONAL:
            self._pdo.stop()
        if state is NmtState.STOPPED:
            self._sdo.reset()
        self._route()
        self.application.nmt_changed(state, t_ns)

    def _on_nmt(self, can: Can, t_ns: int) -> None:
        try:
            message = nmt.parse_nmt_message(can.data)
        except ValueError:
            return  # not for a slave to complain
        if message.node not in (nmt.ALL_NODES, self.node_id):
            return
        if message.command is NmtCommand.RESET_NODE:
            self.memory.keep()
            self._restart(t_ns)
        elif message.command is NmtCommand.RESET_COMMUNICATION:
            self._reset_communication(t_ns)
        elif (state := message.command.leads_to) is not None:
            self._enter(state, t_ns)

    # -- frames --------------------------------------------------------------------

    def _on_frame(self, can: Can, t_ns: int) -> None:
        if can.extended or can.error or self.power is not Power.ON:
            return
        handler = self._routes.get(can.can_id)
        if handler is not None:
            handler(can, t_ns)

    def _route(self) -> None:
        """Receive only what concerns this node in its present state."""
        routes: dict[int, Callable[[Can, int], None]] = {}
        if self.state is NmtState.OPERATIONAL:
            routes.update(self._pdo.identifiers())
        if self.state in (NmtState.OPERATIONAL, NmtState.PRE_OPERATIONAL):
            routes.update(self._own_routes)
            routes[self._sync_id()] = self._on_sync
            routes[sdo.REQUEST_BASE + self.node_id] = self._on_sdo
        for node in self._consumer.nodes:
            routes[nmt.HEARTBEAT_BASE + node] = self._on_heartbeat
        routes[nmt.NMT_COB_ID] = self._on_nmt
        self._routes = routes
        self._port.accept(routes)

    def _sync_id(self) -> int:
        cell = self.store.find(0x1005)
        return sync.SYNC_COB_ID if cell is None else cell.number & 0x7FF

    def _install_sync(self) -> None:
        """1005h may name another identifier; this device cannot produce SYNC (bit 30)."""
        cell = self.store.find(0x1005)
        if cell is not None:
            cell.guard = _check_sync_id
            cell.effect = lambda _raw: self._route()

    def _on_sync(self, can: Can, t_ns: int) -> None:
        if can.remote:
            return
        self.application.synchronised(t_ns)
        if self.state is NmtState.OPERATIONAL:
            self._pdo.synchronise(t_ns)

    def _on_sdo(self, can: Can, t_ns: int) -> None:
        if not can.remote:
            self._sdo.request(can.data, t_ns)
            self.poll(t_ns)

    def _on_heartbeat(self, can: Can, t_ns: int) -> None:
        if not can.remote:
            self._consumer.heard(can.can_id - nmt.HEARTBEAT_BASE, t_ns)

    def _heartbeat_lost(self, _node: int) -> None:
        self.application.communication_error(HEARTBEAT_LOST)

    def _answer(self, data: bytes, t_ns: int) -> None:
        late_ns = self._mount.turnaround_ns + self._sdo.late_ns
        self._port.send(Can(sdo.RESPONSE_BASE + self.node_id, data), t_ns + late_ns)

    @property
    def answer_delay_ns(self) -> int:
        """How much later than usual SDO answers are sent; what is asked for is done at once."""
        return self._sdo.late_ns

    @answer_delay_ns.setter
    def answer_delay_ns(self, delay_ns: int) -> None:
        self._sdo.late_ns = delay_ns

    def _beat(self) -> None:
        self._transmit(Can(nmt.HEARTBEAT_BASE + self.node_id, nmt.heartbeat(self.state)))

    def _transmit(self, can: Can) -> None:
        """Send a frame that comes again; it is lost where too many wait already, and that is told once."""
        if self._port.pending < _QUEUE_FRAMES:
            self._overflown = False
            self._port.send(can)
        elif not self._overflown:
            self._overflown = True
            self.application.communication_error(OVERFLOW)

    def _send_emergency(self, can_id: int, data: bytes) -> None:
        if self.power is Power.ON and self.state is not NmtState.STOPPED:
            self._port.send(Can(can_id, data))

    def _uptime_s(self) -> int:
        return (self.line.now_ns - self._powered_ns) // SECOND

    # -- what this unit is -----------------------------------------------------------

    def _give_identity(self, identity: Mapping[Address, int | str]) -> None:
        for address, value in identity.items():
            cell = self.store.find(address.major, address.minor)
            if cell is not None:
                cell.source = lambda value=value: value

    def _delivered(self, values: Mapping[Address, int]) -> dict[Address, bytes]:
        return {address: encode_raw(self.store.at(address).entry.type, raw) for address, raw in values.items()}


def _all(_entry: Entry) -> bool:
    return True


def _check_sync_id(raw: Raw) -> None:
    if not isinstance(raw, int) or raw & (_SYNC_PRODUCER | _EXTENDED):
        raise RefusedAccessError(Abort.VALUE_RANGE)


def _is_communication(entry: Entry) -> bool:
    return entry.address.major in _COMMUNICATION
