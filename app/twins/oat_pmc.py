"""Twin of the OAT PMC, the axis controller: its objects, inputs, monitors and state machine (manual, chapter 5)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.twins.axis_drive import AxisDrive, Mode
from app.twins.axis_errors import SWITCH_95_CODE, AxisErrors
from app.twins.canopen_device import MS, SECOND, Application, CanopenDevice, Power
from app.twins.cia402 import Command, Control, Signals, State, StateMachine, Status, command_of
from app.twins.manual_function import ManualFunction
from app.twins.object_store import Deferred, RefusedAccessError
from app.twins.plant import AxisPlant
from app.twins.plant_power import PowerPlant
from app.twins.unit_link import AxisFlag, AxisReport, SupplyReport, UnitLink
from app.wire.nmt import NmtState
from app.wire.sdo import Abort

TICK_BUSY_NS: Final = 5 * MS
"""How often it is called while the axis needs its cycles."""
TICK_IDLE_NS: Final = 20 * MS
_CYCLE_NS: Final = MS
_TEMPERATURE_ALERT_NS: Final = 30 * SECOND
"""Table 48: the motor is turned off 30 s after the alert."""
_ENCODER_CODES: Final = frozenset((0x7300, 0x7305, 0x7320))
_BLADE_ENCODER_CODES: Final = frozenset((0x7300, 0x7321))
"""Errors with which the position by that encoder is not to be trusted."""
_AUTOSTART: Final = 1 << 0
_BEYOND_SWITCHES: Final = 1 << 14
"""60FBh/3: the axis may pass limit switches while the node is not operational."""
_OVERSPEED_SHARE: Final = 1.2
"""8400h; its threshold is not printed, 20 % above 6080h is taken."""
_SCALING_OBJECTS: Final = frozenset(
    (0x607C, 0x607E, 0x608F, 0x6091, 0x6092, 0x606A, 0x6065, 0x6066, 0x6067, 0x6068, 0x60F6, 0x60F9, 0x60FB, 0x6073, 0x6080)
)
_BLADE_SCALING_OBJECTS: Final = frozenset((0x687C, 0x687E, 0x688F, 0x6891, 0x6892))


@dataclass(slots=True)
class AxisInputs:
    """Levels at the clamps that no part of the plant drives (table 72); ``efc`` and ``enable``: True is healthy."""

    enable: bool = True
    efc: bool = True
    reference: bool = False
    probe: bool = False
    reset: bool = False
    free: bool = False


class OatPmc(Application):
    """The PMC on a device. ``tick`` moves it on; frames are dealt with when they come."""

    def __init__(self, device: CanopenDevice, plant: AxisPlant, power: PowerPlant) -> None:
        device.application = self
        self.device = device
        self.plant = plant
        self.inputs = AxisInputs()
        self._power = power
        self._store = device.store
        self.errors = AxisErrors(self._store, device.emergency)
        self.drive = AxisDrive(self._store, plant)
        self.machine = StateMachine(self.drive)
        self._controlword = 0
        self._commanded = False
        self._forced: Command | None = None
        self.link: UnitLink[SupplyReport] | None = None
        self.manual = ManualFunction(self._store, self._sent_manual, self._reset_by_object)
        self._booted = False
        self._last_ns = 0
        self._was_0 = self._was_90 = self._was_95 = False
        self._was_reset_input = self._was_probe = self._was_feather = False
        self._hit_0 = self._hit_90 = self._reset_edge = False
        self._homed = self._homing_error = False
        self._hot_since_ns: dict[int, int] = {}
        self._differs_since_ns = 0
        self._bind_values()
        self._bind_commands()

    # -- application of the mount ---------------------------------------------------

    def begin(self, t_ns: int) -> None:
        """The axis moves from ``t_ns`` on."""
        self._last_ns = t_ns

    def restarted(self, t_ns: int) -> None:
        """T0: output stage off, brake engaged; the blade stays where it is."""
        self._booted = False
        self._controlword = 0
        self.manual.clear()
        if self.link is not None:
            self.link.stop()
        self._commanded, self._forced = False, None
        self._homed = self._homing_error = False
        self._hit_0 = self._hit_90 = self._reset_edge = False
        self._hot_since_ns.clear()
        self.errors.clear()
        self.drive.switch_off()
        self.drive.watchdog(False)
        self.drive.halted = False
        self.drive.set_mode(Mode.NONE)
        self.drive.refresh()
        self.drive.refresh_blade()
        self.machine.reset()
        self._was_0, self._was_90, self._was_95 = self.plant.at_0, self.plant.at_90, self.plant.at_95
        self._differs_since_ns = t_ns

    def booted(self, t_ns: int) -> None:
        """T1."""
        self._booted = True
        self._evaluate(t_ns)
        if self.link is not None:
            self.link.start(t_ns)

    def powered_off(self) -> None:
        """Output stage, brake and watchdog contact fall off."""
        self._booted = False
        self.drive.switch_off()
        self.drive.watchdog(False)
        self.machine.reset()
        if self.link is not None:
            self.link.stop()

    def communication_error(self, code: int) -> None:
        """8130h and its like; what the axis does is for 6007h to say."""
        self.errors.event(code)
        self._evaluate(self.device.line.now_ns)

    def nmt_changed(self, state: NmtState, t_ns: int) -> None:
        """A stopped node has lost its connection too (CiA 402, 6007h), though nothing failed that could be reported."""
        if state is NmtState.STOPPED and self.drive.energised and self._store.number(0x6007) in (2, 3):
            self._commanded = True
            self._forced = Command.DISABLE_VOLTAGE if self._store.number(0x6007) == 2 else Command.QUICK_STOP
            self._evaluate(t_ns)

    # -- safety chain and link to the PMM --------------------------------------------------

    def join(self, peer: int) -> None:
        """Talk with the PMM on node ``peer``."""
        self.link = UnitLink(self.device, peer, self._report, SupplyReport.from_bytes, self._link_changed)

    @property
    def watchdog_closed(self) -> bool:
        """The contact X2.1/X2.2 (60FEh/3 bit 16).

        It stays open while an error is pending, even where an EFC left the fault (T15): else the chain that this error
        opened would close again by it, and end the EFC.
        """
        return self.drive.watchdog_closed and not self.errors.stops and self.device.power is not Power.OFF

    def _report(self) -> AxisReport:
        drive, store = self.drive, self._store
        feed, shaft = store.number(0x6092, 1), store.number(0x6092, 2)
        by_blade = store.number(0x606A) == -1
        bad = (_BLADE_ENCODER_CODES if by_blade else _ENCODER_CODES).intersection(self.errors.pending)
        flags = AxisFlag.NONE if bad or not feed else AxisFlag.POSITION_VALID
        flags |= AxisFlag.MOVES if self.plant.speed_rad_s != 0.0 else AxisFlag.NONE
        flags |= AxisFlag.FAULT if self.errors.stops else AxisFlag.NONE
        position_cdeg = round(drive.position * 36000 * shaft / feed) if feed else 0
        return AxisReport(position_cdeg, round(self._power.motor_c * 10), flags)

    def _link_changed(self, _broken: bool) -> None:
        """Table 6 has no code of the PMC for it; the manual function is 0 while its PMM is not heard."""

    def _sent_manual(self) -> int:
        data = None if self.link is None else self.link.data
        return 0 if data is None else data.manual

    # -- time -------------------------------------------------------------------------

    @property
    def tick_ns(self) -> int:
        """How long until the next ``tick`` is wanted."""
        return TICK_BUSY_NS if self.drive.busy else TICK_IDLE_NS

    def tick(self, t_ns: int) -> None:
        """Move axis, supply and monitors on to ``t_ns``."""
        while (cycles := (t_ns - self._last_ns) // _CYCLE_NS) > 0:
            self._last_ns += self.drive.advance(cycles) * _CYCLE_NS
            if self._look_at_switches():
                self._evaluate(self._last_ns)
        self._look_at_switches()
        self._monitor(t_ns)
        if self.machine.feathering:
            self.drive.feather_on()
        self._evaluate(t_ns)
        self.device.poll(t_ns)

    # -- state machine -----------------------------------------------------------------

    def _evaluate(self, t_ns: int) -> None:
        feather = self._feather_wanted()
        if self._was_feather and not feather and self.errors.pending:
            self.errors.react_again()
        self._was_feather = feather
        reaction = self.errors.take_reaction()
        if feather and not self.errors.blocks_feather:
            reaction = None  # an EFC is driven with another error pending, as far as it can be
        if self._reset_edge and self.machine.state is not State.FAULT_REACTION_ACTIVE:
            self.errors.reset()
        signals = Signals(
            booted=self._booted,
            enable_input=self.inputs.enable,
            command=self._command_in_force(),
            feather=feather,
            hit_0=self._hit_0,
            hit_90=self._hit_90,
            fault=reaction,
            reset=self._reset_edge,
            errors_gone=self.errors.gone,
            autostart=bool(self._store.number(0x60FB, 3) & _AUTOSTART),
            brake_time_ns=self._store.number(0x60F9, 4) * MS,
        )
        self._hit_0 = self._hit_90 = self._reset_edge = False
        self.machine.evaluate(t_ns, signals)
        self.drive.halted = bool(self._controlword & Control.HALT) and not self.machine.feathering

    def _feather_wanted(self) -> bool:
        asked = not self.inputs.efc or bool(self._controlword & Control.EFC)
        reached = self.plant.at_90 or self.plant.at_95
        return asked and not reached and self._booted and self.inputs.enable and not self.errors.blocks_feather

    def _remote(self) -> bool:
        """The controlword counts; not while the EFC input controls (statusword bit 9)."""
        return self.inputs.efc

    def _command_in_force(self) -> Command | None:
        """None before the first command and while the EFC input controls; afterwards the controlword that stands."""
        if not (self._commanded and self._remote()):
            return None
        return self._forced or command_of(self._controlword)

    def _on_controlword(self, raw: Raw) -> Deferred | None:
        word = raw if isinstance(raw, int) else 0
        before, self._controlword = self._controlword, word
        self._commanded, self._forced = True, None
        rising = word & ~before
        self._reset_edge = bool(rising & Control.FAULT_RESET) and self._remote()
        self._evaluate(self.device.line.now_ns)
        if not self._remote():
            return None
        if rising & Control.NEW_SET_POINT:
            self._new_set_point()
        elif before & ~word & Control.NEW_SET_POINT:
            self.drive.targets.withdraw()
        return None

    def _new_set_point(self) -> None:
        if self.drive.mode is Mode.HOMING:
            self._homed = self.drive.set_home()
            self._homing_error = not self._homed
        elif not self.machine.feathering:
            self.drive.new_set_point()

    def statusword(self) -> int:
        """6041h (table 53); bits 12 and 13 by mode (table 54)."""
        drive = self.drive
        word = self.machine.state.value | (self._controlword & Control.MIRRORED)
        if self._power.dc_link_v >= self._store.number(0x6510, 4):
            word |= Status.VOLTAGE_ENABLED
        if self.errors.warns:
            word |= Status.WARNING
        if self._remote():
            word |= Status.REMOTE
        if drive.limit_active:
            word |= Status.INTERNAL_LIMIT
        if drive.mode is Mode.HOMING:
            done = self._homed or self._homing_error
            return int(word | self._mode_bits(done, self._homed, self._homing_error))
        acknowledged = {
            Mode.PROFILE_POSITION: drive.targets.acknowledged,
            Mode.PROFILE_VELOCITY: drive.profile.velocity == 0,
            Mode.CYCLIC_POSITION: drive.follows,
            Mode.CYCLIC_VELOCITY: drive.follows,
        }.get(drive.mode, False)
        watched = drive.mode in (Mode.PROFILE_POSITION, Mode.CYCLIC_POSITION)
        return int(word | self._mode_bits(drive.target_reached, acknowledged, watched and drive.following_exceeded))

    @staticmethod
    def _mode_bits(reached: bool, bit_12: bool, bit_13: bool) -> int:
        return int(
            (Status.TARGET_REACHED if reached else 0)
            | (Status.MODE_12 if bit_12 else 0)
            | (Status.MODE_13 if bit_13 else 0)
        )

    # -- inputs and monitors --------------------------------------------------------------

    def digital_inputs(self) -> int:
        """60FDh (table 72)."""
        levels = {
            0: not self.plant.at_0,
            1: not self.plant.at_95,
            2: self.inputs.reference,
            3: self.inputs.enable,
            16: self.plant.at_90,
            17: self.inputs.probe,
            18: self.inputs.efc,
            19: self.inputs.reset,
            20: self.inputs.free,
        }
        return sum(1 << bit for bit, level in levels.items() if level)

    def digital_outputs(self) -> int:
        """60FEh/3 (table 73): brake, watchdog contact, LEDs of device and failure, watchdog and field bus."""
        fault = self.machine.state in (State.FAULT, State.FAULT_REACTION_ACTIVE)
        operational = self.device.state is NmtState.OPERATIONAL
        levels = {
            0: self.plant.brake_lifted,
            16: self.watchdog_closed,
            24: self._booted,
            25: fault,
            26: self.watchdog_closed,
            27: operational,
        }
        return sum(1 << bit for bit, level in levels.items() if level)

    def _look_at_switches(self) -> bool:
        """Note edges of switches and inputs; True where the state machine has to see one."""
        plant, inputs = self.plant, self.inputs
        flags = self._store.number(0x60FB, 3)
        beyond = bool(flags & _BEYOND_SWITCHES) and self.device.state is not NmtState.OPERATIONAL
        if plant.at_0 and not self._was_0 and not beyond:
            self._hit_0 = True
        if plant.at_90 and not self._was_90 and not beyond:
            self._hit_90 = True
        # OPEN whether the 95 degree error can be reset while the switch is actuated; it cannot, bit 14 leads out.
        self.errors.condition(SWITCH_95_CODE, plant.at_95 and not beyond)
        changed = (plant.at_0, plant.at_90, plant.at_95) != (self._was_0, self._was_90, self._was_95)
        self._was_0, self._was_90, self._was_95 = plant.at_0, plant.at_90, plant.at_95
        if inputs.reset and not self._was_reset_input:
            self._reset_edge = changed = True
        self._was_reset_input = inputs.reset
        if inputs.probe != self._was_probe:
            self._store.cell(0x60BA if inputs.probe else 0x60BB).raw = round(self.drive.position)
            self._was_probe = inputs.probe
        if self.drive.following_tripped:
            self.drive.following_tripped = False
            self.errors.event(0x8611)
            changed = True
        return changed

    def _monitor(self, t_ns: int) -> None:
        if not self._booted:
            return
        store, power, errors = self._store, self._power, self.errors
        errors.condition(0x3220, power.dc_link_v < store.number(0x6510, 4))
        errors.condition(0x3210, power.dc_link_v > store.number(0x6510, 5))
        self._watch_difference(t_ns)
        highest = store.number(0x6080) * _OVERSPEED_SHARE
        errors.condition(0x8400, abs(self._motor_rpm()) > highest)
        self._watch_temperature(0x4210, power.heat_sink_c, store.number(0x6510, 6), store.number(0x6510, 2), t_ns)
        self._watch_temperature(0x4310, power.motor_c, store.number(0x6410, 8), store.number(0x6410, 7), t_ns)

    def _watch_difference(self, t_ns: int) -> None:
        """8620h: the encoders differ by more than 6865h for longer than 6866h ms.

        OPEN what a window of 0 (its default) means; no monitoring, for literally every twin would fail at once.
        """
        window = self._store.number(0x6865)
        difference = abs(self.drive.motor_position - self.drive.blade_position)
        if not window or difference <= window:
            self._differs_since_ns = t_ns
        self.errors.condition(0x8620, t_ns - self._differs_since_ns > self._store.number(0x6866) * MS)

    def _watch_temperature(self, code: int, temperature_c: float, warning: int, highest: int, t_ns: int) -> None:
        """Warning at its level; error 30 s after the maximum. OPEN from where the 30 s count.

        From the maximum: from the warning level, a warm day would end in a motor that cannot drive to feather.
        """
        tenths = temperature_c * 10
        self.errors.warning(code, tenths >= warning)
        if tenths < highest:
            self._hot_since_ns.pop(code, None)
            self.errors.condition(code, False)
        elif t_ns - self._hot_since_ns.setdefault(code, t_ns) >= _TEMPERATURE_ALERT_NS:
            self.errors.condition(code, True)

    def _motor_rpm(self) -> float:
        return self.plant.speed_rad_s * 60 / (2 * pi)

    # -- objects ---------------------------------------------------------------------------

    def _bind_values(self) -> None:
        """Objects that show what is, computed when they are read."""
        drive, power = self.drive, self._power
        sources: dict[Address, Callable[[], Raw]] = {
            Address(0x603F): lambda: self.errors.code,
            Address(0x6041): self.statusword,
            Address(0x6044): lambda: round(self._motor_rpm()),
            Address(0x6061): lambda: drive.mode.value,
            Address(0x6064): lambda: round(drive.position),
            Address(0x606C): lambda: round(drive.velocity),
            Address(0x6077): lambda: round(drive.torque_nm / self.plant.constants.rated_torque_nm * 1000),
            Address(0x6078): lambda: round(drive.current_permille),
            Address(0x6079): lambda: round(power.dc_link_v * 1000),
            Address(0x60F4): lambda: round(drive.following_error),
            Address(0x60FD): self.digital_inputs,
            Address(0x60FE, 3): self.digital_outputs,
            Address(0x6410, 9): lambda: round(power.motor_c * 10),
            Address(0x6510, 3): lambda: round(power.heat_sink_c * 10),
            Address(0x6510, 8): lambda: self.errors.flags,
            Address(0x6864): lambda: round(drive.blade_position),
            # The text says "motor encoder and blade encoder", whichever 606Ah selects for 6064h.
            Address(0x68F4): lambda: round(drive.motor_position - drive.blade_position),
        }
        for address, source in sources.items():
            self._store.at(address).source = source

    def _bind_commands(self) -> None:
        store = self._store
        store.cell(0x6040).effect = self._on_controlword
        store.cell(0x6041).guard = _read_only
        store.cell(0x6060).guard = self._check_mode
        store.cell(0x6060).effect = self._on_mode
        store.cell(0x606A).guard = self._only_at_rest
        for cell in store:
            if cell.effect is None and cell.entry.address.major in _SCALING_OBJECTS:
                cell.effect = self._refresh
            elif cell.effect is None and cell.entry.address.major in _BLADE_SCALING_OBJECTS:
                cell.effect = self._refresh_blade

    def _refresh(self, _raw: Raw) -> None:
        self.drive.refresh()

    def _refresh_blade(self, _raw: Raw) -> None:
        self.drive.refresh_blade()

    def _check_mode(self, raw: Raw) -> None:
        """A mode changes only while the output stage is off: controlword bit 3 and statusword bit 2 are 0."""
        if raw not in {mode.value for mode in Mode}:
            raise RefusedAccessError(Abort.VALUE_RANGE)
        if not self._remote():
            raise RefusedAccessError(Abort.LOCAL_CONTROL)
        enabled = self._controlword & Control.ENABLE_OPERATION or self.statusword() & Status.OPERATION_ENABLED
        if enabled and raw not in (0, self.drive.mode.value):
            raise RefusedAccessError(Abort.DEVICE_STATE)

    def _on_mode(self, raw: Raw) -> None:
        if isinstance(raw, int) and raw not in (0, self.drive.mode.value):  # 0: no change
            self._homed = self._homing_error = False
            self.drive.set_mode(Mode(raw))

    def _only_at_rest(self, _raw: Raw) -> None:
        if not self.drive.at_rest:
            raise RefusedAccessError(Abort.DEVICE_STATE)

    def _reset_by_object(self) -> None:
        """Bit 7 of 5040h; it counts while the EFC input controls too, when the controlword does not."""
        self._reset_edge = True
        self._evaluate(self.device.line.now_ns)


def _read_only(_raw: Raw) -> None:
    """6041h is printed as rw; it is a status, and nothing could be meant by writing it."""
    raise RefusedAccessError(Abort.READ_ONLY)
