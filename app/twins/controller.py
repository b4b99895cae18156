"""The turbine controller of a scenario: the master of the simulated line that pitches the blades by the wind.

It waits for the boot-up of its six devices, sets their PDOs by SDO, starts them, and from then on sends SYNC, commands
the axes in cyclic position mode (8) by RPDO, reads what no PDO carries by SDO, and beats its own heart as node 100. Of
the nacelle it knows what its own sensors tell: wind and rotor; it commands the generator.

It stands outside the safety chain as a real one does: where a blade fails, a device falls silent or an EFC input takes
an axis, it lets the generator go, opens its contact and commands nothing any more until it is reset; what feathers the
blades is the chain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any, Final, NoReturn

from app.errors import UsageError
from app.model.address import Address
from app.twins.cia402 import State
from app.twins.controller_devices import PARK_DEG, SeenDevice, SeenPmc, SeenPmm
from app.twins.controller_plan import (
    HEARTBEAT_MS,
    PMC_POLLS,
    PMM_POLLS,
    SYNC_NS,
    Poll,
    pdo_id,
    settings,
)
from app.twins.pitch_law import PitchLaw
from app.twins.ports import Alarm, Line
from app.twins.rotor import Rotor
from app.twins.sdo_client import SdoClient
from app.wire import emcy, nmt, sdo, sync
from app.wire.frame import Can
from app.wire.nmt import NmtCommand, NmtState

CONTROLLER_NODE: Final = 100
PMMS: Final = (1, 2, 3)
PMCS: Final = (11, 12, 13)
_MS: Final = 1_000_000
_MISSING_NS: Final = 3 * HEARTBEAT_MS * _MS
"""A device that has not beaten for so long is missing."""
_SETTLED_DEG: Final = 0.5
_MANUAL_DPS: Final = 4.0
"""How fast the blades are parked or moved to an angle that is ordered, degrees/s."""
_UNITS_PER_DEG: Final = 100
_CYCLIC_POSITION: Final = 8
_PMM_FAULT: Final = 1 << 2
_PMM_TEST, _PMM_RESET = 1 << 1, 1 << 7
_SHUTDOWN, _SWITCH_ON, _ENABLE, _RUN, _DISABLE_VOLTAGE = 0x0106, 0x0107, 0x010F, 0x000F, 0x010C
_MODE: Final = Address(0x6060)
_MANUAL: Final = Address(0x5040)
_MANUAL_RESET: Final = 0x80
_IDLE_BEATS: Final = 2
"""The first one may have been on its way when the node was started."""
_ANEW_CYCLES: Final = 10
"""So often an enable that has no effect is given anew."""
_PULSE_NS: Final = 200 * _MS
"""How long a command bit stands."""


class Phase(Enum):
    """What the controller does.

    ``WAITING``: devices are missing or not set yet. ``STANDBY``: axes off. ``RUNNING``: power by the wind. ``MANUAL``:
    an angle that was ordered. ``PARKING``: on the way to the park angle. ``TRIPPED``: nothing, until it is reset.
    """

    WAITING = "waiting"
    STANDBY = "standby"
    RUNNING = "running"
    MANUAL = "manual"
    PARKING = "parking"
    TRIPPED = "tripped"


_MOVING: Final = (Phase.RUNNING, Phase.MANUAL, Phase.PARKING)


class TurbineController:
    """The controller on ``line``. ``start`` lets it work; ``command`` takes the orders of a scenario.

    ``contact``: its contact in the safety chain, called with whether it is closed; None: it has none.
    """

    def __init__(
        self, line: Line, rotor: Rotor, law: PitchLaw | None = None, contact: Callable[[bool], None] | None = None
    ) -> None:
        self._line = line
        self._rotor = rotor
        self.law = PitchLaw() if law is None else law
        self._contact = contact
        self.phase = Phase.WAITING
        self.trip_reason = ""
        """Why it tripped last."""
        self.silent = False
        """It reads nothing by SDO: service people are at the bus."""
        self._wanted: Phase = Phase.RUNNING
        self._resetting = False
        self._angle_deg = PARK_DEG
        self._units = {node: SeenPmm(node) for node in PMMS}
        self._axes = {node: SeenPmc(node) for node in PMCS}
        self._devices: dict[int, SeenDevice] = {**self._units, **self._axes}
        self._port = line.attach(self._on_frame)
        self._port.accept(self._routes())
        self._sdo = SdoClient(line, self._port)
        self._polls: dict[int, dict[Poll, int]] = {}
        self._alarm, self._heart, self._reset_alarm = Alarm(line), Alarm(line), Alarm(line)

    # -- for whoever runs it ---------------------------------------------------------

    def start(self, t_ns: int) -> None:
        """Switched on at ``t_ns`` (line time). It takes the generator over when it begins to run."""
        self._close_contact(True)
        self._alarm.set(t_ns + SYNC_NS, self._cycle)
        self._heart.set(t_ns + HEARTBEAT_MS * _MS, self._beat)
        self._port.send(Can(nmt.HEARTBEAT_BASE + CONTROLLER_NODE, nmt.heartbeat(NmtState.BOOT_UP)))

    def stop(self) -> None:
        """Switched off: silent, the generator free, its contact open."""
        for alarm in (self._alarm, self._heart, self._reset_alarm):
            alarm.clear()
        for node in self._devices:
            self._sdo.drop(node)
        self._port.clear()
        self._rotor.generator_nm = None
        self._close_contact(False)

    def command(self, table: Mapping[str, Any]) -> None:
        """Take an order: a table with one key.

        ``run``, ``park`` and ``reset`` are true; ``angle_deg`` moves all blades there; ``silent`` ends or begins its
        reading by SDO; ``battery_test`` names a blade, 0 for all. Raises UsageError that names the field.
        """
        if len(table) != 1:
            _wrong("controller", f"has {len(table)} orders, not one")
        (name, value), *_ = table.items()
        order = {
            "run": self._order_run,
            "park": self._order_park,
            "angle_deg": self._order_angle,
            "reset": self._order_reset,
            "silent": self._order_silent,
            "battery_test": self._order_test,
        }.get(name)
        if order is None:
            _wrong(name, "is no order to the controller")
        order(value)

    # -- orders ------------------------------------------------------------------------

    def _order_run(self, value: Any) -> None:
        _flag("run", value, only=True)
        self._want(Phase.RUNNING)

    def _order_park(self, value: Any) -> None:
        _flag("park", value, only=True)
        self._want(Phase.PARKING)

    def _order_angle(self, value: Any) -> None:
        low_deg, high_deg = self.law.constants.fine_deg, self.law.constants.feather_deg
        if not isinstance(value, int | float) or isinstance(value, bool) or not low_deg <= value <= high_deg:
            _wrong("angle_deg", f"is {value!r}, not {low_deg:g} to {high_deg:g}")
        self._angle_deg = float(value)
        self._want(Phase.MANUAL)

    def _order_reset(self, value: Any) -> None:
        _flag("reset", value, only=True)
        self._reset()

    def _order_silent(self, value: Any) -> None:
        self.silent = _flag("silent", value)

    def _order_test(self, value: Any) -> None:
        if value not in (0, *PMMS) or isinstance(value, bool):
            _wrong("battery_test", f"is {value!r}, neither a blade nor 0 for all")
        chosen = PMMS if value == 0 else (value,)
        self._pulse(chosen, _PMM_TEST)

    def _want(self, phase: Phase) -> None:
        if self.phase is Phase.TRIPPED and not self._resetting:
            return  # it takes no other order until it is reset
        self._wanted = phase
        if self.phase in (Phase.STANDBY, *_MOVING):
            self._enter(phase)

    def _enter(self, phase: Phase) -> None:
        if phase is self.phase:
            return
        if phase is Phase.RUNNING:
            known = [axis.position_deg for axis in self._axes.values() if axis.position_deg is not None]
            self.law.start(sum(known) / len(known) if known else PARK_DEG, self._rotor.speed_rpm)
        else:
            self._rotor.generator_nm = 0.0
        self.phase = phase

    def _pulse(self, nodes: tuple[int, ...], bit: int) -> None:
        """A bit of the PMM controlword rises and falls (table 17: both edges count)."""
        for node in nodes:
            self._send_unit(self._units[node], bit)
        self._line.call_at(self._line.now_ns + _PULSE_NS, lambda _t_ns: self._release(nodes))

    def _release(self, nodes: tuple[int, ...]) -> None:
        for node in nodes:
            self._send_unit(self._units[node], 0)

    def _send_unit(self, unit: SeenPmm, word: int) -> None:
        unit.word = word
        self._port.send(Can(pdo_id(1, unit.node, False), word.to_bytes(2, "little")))

    # -- trip and reset --------------------------------------------------------------------

    def _trip(self, reason: str) -> None:
        self.trip_reason = reason
        self._rotor.generator_nm = 0.0
        self.phase = Phase.TRIPPED
        self._wanted = Phase.STANDBY
        self._resetting = False
        self._close_contact(False)
        for axis in self._axes.values():
            axis.mode_set = False

    def _reset(self) -> None:
        """Contact closed and PMM first, for an axis is released by its chain; then the axes."""
        self._resetting = True
        self._close_contact(True)
        for device in self._devices.values():
            device.error = 0
            if device.idle_beats:  # somebody took it out of operation: set and started anew
                device.ready, device.idle_beats = False, 0
        self._pulse(PMMS, _PMM_RESET)
        self._reset_alarm.set(self._line.now_ns + 2 * _PULSE_NS, self._reset_axes)

    def _reset_axes(self, t_ns: int) -> None:
        """By 5040h bit 7: while the chain is open, an axis does not listen to its controlword (5.15)."""
        for axis in self._axes.values():
            self._write(axis.node, _MANUAL, bytes((_MANUAL_RESET,)))
            self._write(axis.node, _MANUAL, b"\0")
        self._reset_alarm.set(t_ns + _PULSE_NS, self._reset_done)

    def _write(self, node: int, address: Address, data: bytes) -> None:
        if self._heard_lately(self._devices[node]):
            self._sdo.write(node, address, data, lambda _answer: None)

    def _reset_done(self, _t_ns: int) -> None:
        self._resetting = False
        if self.phase is Phase.TRIPPED:
            self.phase = Phase.WAITING

    def _heard_lately(self, device: SeenDevice) -> bool:
        return device.heard_ns is not None and self._line.now_ns - device.heard_ns <= _MISSING_NS

    def _close_contact(self, closed: bool) -> None:
        if self._contact is not None:
            self._contact(closed)

    def _fault(self) -> str:
        """What keeps it from working on, or nothing."""
        for device in self._devices.values():
            if device.heard_ns is not None and not self._heard_lately(device):
                return f"node {device.node} is silent"
            if not device.ready:
                return f"node {device.node} has restarted"
            if device.idle_beats >= _IDLE_BEATS:
                return f"node {device.node} is not operational"
            if device.error:
                return f"node {device.node} tells error {device.error:04X}h"
        for axis in self._axes.values():
            if axis.failed:
                return f"axis {axis.node} has failed"
            if not axis.remote:
                return f"axis {axis.node} is driven by its EFC input"
        failed = [unit.node for unit in self._units.values() if unit.status & _PMM_FAULT]
        return f"node {failed[0]} has failed" if failed else ""

    # -- cycle -------------------------------------------------------------------------------

    def _cycle(self, t_ns: int) -> None:
        self._alarm.set(t_ns + SYNC_NS, self._cycle)
        self._watch()
        demand_deg, rate_dps = self._demand(SYNC_NS / 1e9)
        if self.phase not in (Phase.WAITING, Phase.TRIPPED):
            for axis in self._axes.values():
                self._follow(axis, demand_deg, rate_dps * SYNC_NS / 1e9)
                self._send_axis(axis, self._word(axis))
        self._port.send(Can(sync.SYNC_COB_ID, sync.sync()))
        self._set_missing()
        if not self.silent:
            self._poll(t_ns)

    def _watch(self) -> None:
        if self.phase is Phase.TRIPPED:
            return
        if self.phase is Phase.WAITING:
            known = all(axis.status is not None and axis.position_deg is not None for axis in self._axes.values())
            if known and not self._fault():
                self._enter(Phase.STANDBY)
                self._enter(self._wanted)
            return
        if reason := self._fault():
            self._trip(reason)

    def _demand(self, dt_s: float) -> tuple[float, float]:
        """Where the blades shall be, and how fast they may go there."""
        if self.phase is Phase.RUNNING:
            self.law.step(dt_s, self._rotor.speed_rpm)
            self._rotor.generator_nm = self.law.generator_nm
            return self.law.pitch_deg, self.law.constants.rate_dps
        if self.phase is Phase.PARKING:
            parked = (abs((axis.position_deg or 0.0) - PARK_DEG) < _SETTLED_DEG for axis in self._axes.values())
            if all(parked):
                self._enter(Phase.STANDBY)
            return PARK_DEG, _MANUAL_DPS
        return self._angle_deg, _MANUAL_DPS

    def _follow(self, axis: SeenPmc, demand_deg: float, most_deg: float) -> None:
        """Let the set-point go from where the blade is to where it shall be."""
        if not axis.enabled or axis.position_deg is None:
            axis.set_deg = PARK_DEG if axis.position_deg is None else axis.position_deg
        elif self.phase in _MOVING:
            axis.set_deg += min(max(demand_deg - axis.set_deg, -most_deg), most_deg)

    def _word(self, axis: SeenPmc) -> int:
        """The controlword that leads on from the state in which the axis is (tables 50 and 52)."""
        if self.phase not in _MOVING:
            return _SHUTDOWN
        if axis.state in (State.SWITCH_ON_DISABLED.value, State.READY.value) and not axis.mode_set:
            self._set_mode(axis)
            return _SHUTDOWN
        if axis.state == State.READY.value:
            return _SWITCH_ON
        if axis.state == State.SWITCHED_ON.value:  # after a stop at the 90 degree switch "enable" must come anew
            axis.waited += 1
            return _SWITCH_ON if axis.waited % _ANEW_CYCLES == 0 else _ENABLE
        if axis.enabled:
            return _RUN
        return _DISABLE_VOLTAGE if axis.state == State.QUICK_STOP_ACTIVE.value else _SHUTDOWN

    def _set_mode(self, axis: SeenPmc) -> None:
        def done(answer: bytes | None) -> None:
            axis.mode_set = answer is not None

        if self._sdo.idle(axis.node):
            self._sdo.write(axis.node, _MODE, bytes((_CYCLIC_POSITION,)), done)

    def _send_axis(self, axis: SeenPmc, word: int) -> None:
        axis.word = word
        target = round(axis.set_deg * _UNITS_PER_DEG)
        data = word.to_bytes(2, "little") + target.to_bytes(4, "little", signed=True)
        self._port.send(Can(pdo_id(2, axis.node, False), data))

    def _beat(self, t_ns: int) -> None:
        self._heart.set(t_ns + HEARTBEAT_MS * _MS, self._beat)
        self._port.send(Can(nmt.HEARTBEAT_BASE + CONTROLLER_NODE, nmt.heartbeat(NmtState.OPERATIONAL)))

    # -- SDO: settings and what no PDO carries -------------------------------------------------

    def _set(self, device: SeenDevice) -> None:
        """Write all settings, then start the node; once more after a while where one of them fails."""
        device.setting, device.ready = True, False
        waiting = settings(device.node, device.node in self._axes, CONTROLLER_NODE)

        def go_on(answer: bytes | None) -> None:
            if answer is None:
                device.setting = False
                return
            following = next(waiting, None)
            if following is not None:
                self._sdo.write(device.node, *following, go_on)
                return
            device.setting, device.ready = False, True
            self._port.send(Can(nmt.NMT_COB_ID, nmt.nmt_message(NmtCommand.START, device.node)))

        go_on(b"")

    def _set_missing(self) -> None:
        """Begin to set who has booted and is not set yet."""
        for device in self._devices.values():
            fresh = device.heard_ns is not None and not (device.ready or device.setting)
            if fresh and self._sdo.idle(device.node):
                self._set(device)

    def _poll(self, t_ns: int) -> None:
        """Ask every node for the object that is due longest; one at a time, nobody who is silent."""
        if not self._polls:
            self._polls = {node: _due(t_ns, PMC_POLLS if node in self._axes else PMM_POLLS) for node in self._devices}
        for device in self._devices.values():
            if not (self._heard_lately(device) and device.ready and self._sdo.idle(device.node)):
                continue
            due = self._polls[device.node]
            poll = min(due, key=due.__getitem__)
            if due[poll] <= t_ns:
                due[poll] = max(due[poll] + poll.period_ns, t_ns)
                self._sdo.read(device.node, poll.address, lambda _answer: None)

    # -- frames --------------------------------------------------------------------------------

    def _routes(self) -> list[int]:
        bases = (emcy.EMCY_BASE, sdo.RESPONSE_BASE, nmt.HEARTBEAT_BASE, pdo_id(1, 0, True), pdo_id(2, 0, True))
        return [base + node for base in bases for node in self._devices]

    def _on_frame(self, can: Can, t_ns: int) -> None:
        if can.remote or can.error or can.extended:
            return
        base, node = can.can_id & 0x780, can.can_id & 0x7F
        device = self._devices[node]
        if base == sdo.RESPONSE_BASE:
            self._sdo.response(can)
        elif base == nmt.HEARTBEAT_BASE:
            self._on_heartbeat(device, can.data, t_ns)
        elif base == emcy.EMCY_BASE:
            device.error = int.from_bytes(can.data[:2], "little")
        elif node in self._axes:
            self._on_axis(self._axes[node], base, can.data)
        elif base == pdo_id(1, 0, True):
            self._units[node].status = can.data[0] if can.data else 0

    def _on_heartbeat(self, device: SeenDevice, data: bytes, t_ns: int) -> None:
        device.heard_ns = t_ns
        if data != nmt.heartbeat(NmtState.BOOT_UP):
            idle = device.ready and data != nmt.heartbeat(NmtState.OPERATIONAL)
            device.idle_beats = device.idle_beats + 1 if idle else 0
            return
        device.ready = device.setting = False
        device.error = device.idle_beats = 0
        self._sdo.drop(device.node)
        if device.node in self._axes:
            axis = self._axes[device.node]
            axis.status = axis.position_deg = None
            axis.mode_set = False

    @staticmethod
    def _on_axis(axis: SeenPmc, base: int, data: bytes) -> None:
        if base == pdo_id(1, 0, True) and len(data) >= 2:
            axis.status = int.from_bytes(data[:2], "little")
        elif base == pdo_id(2, 0, True) and len(data) >= 4:
            axis.position_deg = int.from_bytes(data[:4], "little", signed=True) / _UNITS_PER_DEG


def _due(t_ns: int, polls: tuple[Poll, ...]) -> dict[Poll, int]:
    """When each is to be read first: one after the other, so that they do not come in a burst."""
    return {poll: t_ns + number * SYNC_NS for number, poll in enumerate(polls)}


def _flag(name: str, value: Any, only: bool | None = None) -> bool:
    if not isinstance(value, bool) or (only is not None and value is not only):
        _wrong(name, f"is {value!r}, not {'true' if only else 'true or false'}")
    return value


def _wrong(name: str, reason: str) -> NoReturn:
    raise UsageError(reason=f"controller: field '{name}' {reason}", field=name)
