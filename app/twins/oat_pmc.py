"""Twin of the OAT PMC, the axis controller: its objects, its time and its state machine (manual, chapter 5)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.twins.axis_drive import AxisDrive, Feedback, Mode
from app.twins.axis_errors import KINDS, SWITCH_95_CODE, AxisErrors
from app.twins.canopen_device import MS, Application, CanopenDevice, Power
from app.twins.cia402 import Command, Control, Signals, State, StateMachine, Status, command_of
from app.twins.manual_function import ManualFunction
from app.twins.object_store import Deferred, RefusedAccessError
from app.twins.plant import AxisPlant
from app.twins.plant_power import PowerPlant
from app.twins.pmc_cyclic import CyclicPeriod
from app.twins.pmc_inputs import AxisInputs, Edges, input_word, output_word
from app.twins.pmc_monitors import JUDGED, Monitors, motor_rpm
from app.twins.unit_link import AxisFlag, AxisReport, SupplyReport, UnitLink
from app.wire.nmt import NmtState
from app.wire.sdo import Abort

TICK_BUSY_NS: Final = 5 * MS
"""How often it is called while what the axis does must be looked at closely: it stops, reaches something, feathers."""
TICK_CYCLIC_NS: Final = 10 * MS
"""The same while it only follows cyclic set-points, which are taken when they come."""
TICK_IDLE_NS: Final = 20 * MS
_CYCLE_NS: Final = MS
_ENCODER_CODES: Final = frozenset((0x7300, 0x7305, 0x7320))
_BLADE_ENCODER_CODES: Final = frozenset((0x7300, 0x7321))
"""Errors with which the position by that encoder is not to be trusted."""
_CYCLIC_SET_POINTS: Final = (0x607A, 0x60B0, 0x60B1, 0x60FF)
_AUTOSTART: Final = 1 << 0
_BEYOND_SWITCHES: Final = 1 << 14
"""60FBh/3: the axis may pass limit switches while the node is not operational."""
_FEATHER_BY_VELOCITY: Final = 1 << 9
"""60FBh/3: an EFC drives to the 90 degree switch under velocity control."""
_MODE_BITS: Final = 1 << 5 | 1 << 6 | 1 << 9
"""Bits of the controlword that mode 1 has no use for: change on the fly, relative position (5.10.1)."""
_CYCLIC: Final = (Mode.CYCLIC_POSITION, Mode.CYCLIC_VELOCITY)
_WATCHDOG_RESET: Final = 0x6010
_MEMORY_FAILED: Final = 0x5530
_MONITORED: Final = (0x6065, 0x6066, 0x6067, 0x6068, 0x60F6, 0x60F9, 0x60FB, 0x6073, 0x6080)
_SCALING_OBJECTS: Final = frozenset((0x607C, 0x607E, 0x608F, 0x6091, 0x6092, 0x606A, *_MONITORED))
_BLADE_SCALING_OBJECTS: Final = frozenset((0x687C, 0x687E, 0x688F, 0x6891, 0x6892))


class OatPmc(Application):
    """The PMC on a device. ``tick`` moves it on; frames are dealt with when they come."""

    def __init__(self, device: CanopenDevice, plant: AxisPlant, power: PowerPlant) -> None:
        device.application = self
        self.device = device
        self.plant = plant
        self.inputs = AxisInputs(self._probe_changed)
        self._power = power
        self._store = device.store
        self.errors = AxisErrors(self._store, device.emergency)
        self.drive = AxisDrive(self._store, plant)
        self.monitors = Monitors(self._store, plant, power, self.drive, self.errors)
        self.machine = StateMachine(self.drive)
        self.catch_up: Callable[[int], None] = self.run_cycles
        """Brings the axis to a time; whoever gives it a supply brings that along."""
        self.link: UnitLink[SupplyReport] | None = None
        self.manual = ManualFunction(self._store, self._sent_manual, self._reset_by_object)
        self._edges = Edges(plant, self.drive, self.inputs)
        self._period = CyclicPeriod(self._store)
        self._booted = False
        self._restart_code = 0
        self._last_ns = 0
        self._forget()
        self._bind_values()
        self._bind_commands()

    def _forget(self) -> None:
        """What does not outlast a restart."""
        self._controlword = 0
        self._commanded = False
        self._forced: Command | None = None
        self._homed = self._homing_error = False
        self._mode_is_new = True
        self._was_feather = False

    # -- application of the mount ---------------------------------------------------

    def begin(self, t_ns: int) -> None:
        """The axis moves from ``t_ns`` on."""
        self._last_ns = t_ns

    def restarted(self, t_ns: int) -> None:
        """T0: output stage off, brake engaged; the blade stays where it is."""
        self.powered_off()
        self.drive.refresh()
        self.drive.refresh_blade()
        self._edges.restart()
        self.monitors.restart(t_ns)

    def booted(self, t_ns: int) -> None:
        """T1. A restart that was no wish is told now."""
        self._booted = True
        self._evaluate(t_ns)
        if self.link is not None:
            self.link.start(t_ns)
        if self._restart_code:
            code, self._restart_code = self._restart_code, 0
            self.raise_error(code)

    def powered_off(self) -> None:
        """Output stage, brake and watchdog contact fall off; nothing in RAM is left."""
        self._booted = False
        self._forget()
        self._edges.forget()
        self._period.restart()
        self.manual.clear()
        self.errors.clear()
        self.drive.switch_off()
        self.drive.watchdog(False)
        self.drive.halted = False
        self.drive.set_mode(Mode.NONE)
        self.machine.reset()
        if self.link is not None:
            self.link.stop()

    def communication_error(self, code: int) -> None:
        """8130h and its like; what the axis does is for 6007h to say."""
        self.raise_error(code)

    def nmt_changed(self, state: NmtState, t_ns: int) -> None:
        """A stopped node has lost its connection too (CiA 402, 6007h), though nothing failed that could be reported."""
        if state is NmtState.STOPPED and self.drive.energised and self._store.number(0x6007) in (2, 3):
            self._commanded = True
            self._forced = Command.DISABLE_VOLTAGE if self._store.number(0x6007) == 2 else Command.QUICK_STOP
            self._evaluate(t_ns)

    def memory_failed(self, t_ns: int) -> None:
        """The EEPROM could not be written."""
        self.raise_error(_MEMORY_FAILED)

    def synchronised(self, t_ns: int) -> None:
        """A SYNC came."""
        self._period.synchronised(t_ns)

    # -- errors from around it ---------------------------------------------------------------

    def raise_error(self, code: int) -> None:
        """An error of table 6 without a lasting cause, or with one that no part of the plant can show (2320h, 6080h).

        Raises ValueError where the PMC has no such error.
        """
        if code not in KINDS:
            raise ValueError(f"the PMC has no error {code:04X}h")
        self.errors.event(code)
        self._evaluate(self.device.line.now_ns)

    def watchdog_reset(self) -> None:
        """The processor's watchdog strikes: the unit restarts, which turns the motor off, and tells 6010h then."""
        self._restart_code = _WATCHDOG_RESET
        self.device.power_on(self.device.line.now_ns)

    # -- safety chain and link to the PMM --------------------------------------------------

    def join(self, peer: int) -> None:
        """Talk with the PMM on node ``peer``."""
        self.link = UnitLink(self.device, peer, self._report, SupplyReport.from_bytes, self._link_changed)

    @property
    def watchdog_closed(self) -> bool:
        """The contact X2.1/X2.2 (60FEh/3 bit 16): opened by every error, also by one that is a message only.

        It stays open while an error is pending, even where an EFC left the fault (T15): else the chain that this error
        opened would close again by it, and end the EFC.
        """
        return self.drive.watchdog_closed and not self.errors.pending and self.device.power is not Power.OFF

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
        if self.drive.follows and self.drive.cyclic and not self.machine.feathering:
            return TICK_CYCLIC_NS
        return TICK_BUSY_NS if self.drive.busy else TICK_IDLE_NS

    def tick(self, t_ns: int) -> None:
        """Move axis, supply and monitors on to ``t_ns``."""
        self.catch_up(t_ns)
        self._look_at_switches()
        if self._booted:
            self.monitors.look(t_ns)
        if self.machine.feathering:
            self.drive.feather_on()
        self._evaluate(t_ns)
        self.device.poll(t_ns)

    def run_cycles(self, t_ns: int) -> None:
        """Run the axis' cycles up to ``t_ns``; what happens in one of them counts in that cycle."""
        while (cycles := (t_ns - self._last_ns) // _CYCLE_NS) > 0:
            self._last_ns += self.drive.advance(cycles) * _CYCLE_NS
            if self._look_at_switches():
                self._evaluate(self._last_ns)

    # -- state machine -----------------------------------------------------------------

    def _evaluate(self, t_ns: int) -> None:
        feather = self._feather_wanted()
        if self._was_feather and not feather and self.errors.pending:
            self.errors.react_again()
        self._was_feather = feather
        reaction = self.errors.take_reaction()
        if feather and not self.errors.blocks_feather:
            reaction = None  # an EFC is driven with another error pending, as far as it can be
        edges = self._edges
        if edges.reset and self.machine.state is not State.FAULT_REACTION_ACTIVE:
            self.errors.reset()
        signals = Signals(
            booted=self._booted,
            enable_input=self.inputs.enable,
            command=self._command_in_force(),
            feather=feather,
            hit_0=edges.hit_0,
            hit_90=edges.hit_90,
            fault=reaction,
            reset=edges.reset,
            errors_gone=self.errors.gone,
            autostart=bool(self._store.number(0x60FB, 3) & _AUTOSTART),
            brake_time_ns=self._store.number(0x60F9, 4) * MS,
        )
        edges.forget()
        self.drive.feedback = self._feedback(feather)
        self.machine.evaluate(t_ns, signals)
        self.drive.halted = bool(self._controlword & Control.HALT) and not self.machine.feathering
        if self.machine.state is State.OPERATION_ENABLED and not self.drive.halted:
            self._mode_is_new = False

    def _feedback(self, feather: bool) -> Feedback:
        """What an axis is controlled with that drives to feather, or is stopped, in spite of an encoder error.

        OPEN which of the two ways the text below table 50 means when: the additional encoder where it has a position
        of its own, else speed control without encoder; this also where 60FBh/3 bit 9 demands it of an EFC.
        """
        flags = self._store.number(0x60FB, 3)
        if feather and flags & _FEATHER_BY_VELOCITY:
            return Feedback.NONE
        normal = self.machine.state is State.OPERATION_ENABLED and not feather
        return Feedback.MOTOR_ENCODER if normal else self.monitors.feedback

    def _feather_wanted(self) -> bool:
        """OPEN which is stronger, an EFC or a missing enable input; the input, for it is there to keep a motor off."""
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
        self._edges.reset = self._edges.reset or (bool(rising & Control.FAULT_RESET) and self._remote())
        self._evaluate(self.device.line.now_ns)
        if not self._remote():
            return None
        if rising & Control.NEW_SET_POINT:
            self._new_set_point()
        elif before & ~word & Control.NEW_SET_POINT:
            self.drive.targets.withdraw()
        return None

    def _new_set_point(self) -> None:
        """OPEN what happens with bits 5, 6 or 9, which must be 0; such a target is not taken, bit 12 stays 0.

        To drive to it all the same would be a motion to elsewhere than its master believes.
        """
        if self.drive.mode is Mode.HOMING:
            self._homed = self.drive.at_rest and self.drive.set_home()
            self._homing_error = not self._homed
        elif not self.machine.feathering and not self._controlword & _MODE_BITS:
            self._mode_is_new = False
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
        if self._target_reached():
            word |= Status.TARGET_REACHED
        bit_12, bit_13 = self._mode_bits()
        return int(word | (Status.MODE_12 if bit_12 else 0) | (Status.MODE_13 if bit_13 else 0))

    def _mode_bits(self) -> tuple[bool, bool]:
        """Bits 12 and 13 (table 54)."""
        drive = self.drive
        match drive.mode:
            case Mode.PROFILE_POSITION:
                return drive.targets.acknowledged, drive.following_exceeded
            case Mode.PROFILE_VELOCITY:
                return drive.profile.velocity == 0, False
            case Mode.HOMING:
                return self._homed, self._homing_error
            case Mode.CYCLIC_POSITION:
                return drive.follows, drive.following_exceeded
            case Mode.CYCLIC_VELOCITY:
                return drive.follows, False
            case _:
                return False, False

    def _target_reached(self) -> bool:
        """Bit 10 (below table 53): a target reached, a new mode, or halted and at rest; always in the cyclic modes.

        OPEN what it shows in a cyclic mode under halt; as in the rest of these modes, where nobody evaluates it. In
        homing mode it is set by the choice of the mode, and the one command takes no time.
        """
        if self.drive.mode in (*_CYCLIC, Mode.HOMING):
            return True
        if self._controlword & Control.HALT and not self.machine.feathering:
            # In mode 3 the set-point decides, not the motor (5.11.1).
            by_speed = self.drive.mode is Mode.PROFILE_VELOCITY
            return self.drive.profile.velocity == 0 if by_speed else self.drive.at_rest
        return self._mode_is_new or self.drive.target_reached

    # -- inputs and outputs --------------------------------------------------------------

    def digital_inputs(self) -> int:
        """60FDh."""
        return input_word(self.plant, self.inputs)

    def digital_outputs(self) -> int:
        """60FEh/3."""
        fault = self.machine.state in (State.FAULT, State.FAULT_REACTION_ACTIVE)
        operational = self.device.state is NmtState.OPERATIONAL
        closed = self.watchdog_closed
        return output_word(self.plant, watchdog=closed, booted=self._booted, fault=fault, operational=operational)

    def _look_at_switches(self) -> bool:
        """Note edges of switches and inputs; True where the state machine has to see one."""
        flags = self._store.number(0x60FB, 3)
        beyond = bool(flags & _BEYOND_SWITCHES) and self.device.state is not NmtState.OPERATIONAL
        changed = self._edges.look(beyond)
        # OPEN whether the 95 degree error can be reset while the switch is actuated; it cannot, bit 14 leads out.
        self.errors.condition(SWITCH_95_CODE, self.plant.at_95 and not beyond)
        if self.drive.following_tripped:
            self.drive.following_tripped = False
            self.errors.event(0x8611)
            changed = True
        return changed

    def _probe_changed(self) -> None:
        """The measuring input rose or fell: keep the position of the latest cycle (60BAh, 60BBh)."""
        if self._booted:
            self.catch_up(self.device.line.now_ns)
            self._store.cell(0x60BA if self.inputs.probe else 0x60BB).raw = round(self.drive.position)

    # -- objects ---------------------------------------------------------------------------

    def _bind_values(self) -> None:
        """Objects that show what is, computed when they are read."""
        drive, power = self.drive, self._power
        sources: dict[Address, Callable[[], Raw]] = {
            Address(0x603F): lambda: self.errors.code,
            Address(0x6041): self.statusword,
            Address(0x6044): lambda: round(motor_rpm(self.plant)),
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
            Address(0x6510, 1): lambda: self.monitors.power_stage,
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
        store.cell(0x60FF).effect = self._on_velocity
        store.cell(0x6510, 7).effect = self._on_mask
        for index in _CYCLIC_SET_POINTS:
            store.cell(index).guard = self._before_set_point
        for sub in (1, 2):
            store.cell(0x60C2, sub).guard = self._period_guard(sub)
        for index, sub in JUDGED:
            store.cell(index, sub).effect = self._on_judged
        for cell in store:
            if cell.effect is None and cell.entry.address.major in _SCALING_OBJECTS:
                cell.effect = self._refresh
            elif cell.effect is None and cell.entry.address.major in _BLADE_SCALING_OBJECTS:
                cell.effect = self._refresh_blade

    def _before_set_point(self, _raw: Raw) -> None:
        """A cyclic set-point counts from the cycle in which it comes, so those before it are run first."""
        if self.drive.cyclic:
            self.catch_up(self.device.line.now_ns)

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
        if raw in {mode.value for mode in _CYCLIC}:
            self._period.check_mode(self.device.line.now_ns)

    def _on_mode(self, raw: Raw) -> None:
        if isinstance(raw, int) and raw not in (0, self.drive.mode.value):  # 0: no change
            self._homed = self._homing_error = False
            self._mode_is_new = True
            self.drive.set_mode(Mode(raw))

    def _on_velocity(self, _raw: Raw) -> None:
        """A new target of mode 3."""
        self._mode_is_new = False

    def _period_guard(self, sub: int) -> Callable[[Raw], None]:
        return lambda raw: self._period.check(sub, raw, self.drive.mode in _CYCLIC, self.device.line.now_ns)

    def _on_mask(self, _raw: Raw) -> None:
        self.errors.mask_changed()
        self._evaluate(self.device.line.now_ns)

    def _on_judged(self, _raw: Raw) -> None:
        self.monitors.judge()

    def _only_at_rest(self, _raw: Raw) -> None:
        if not self.drive.at_rest:
            raise RefusedAccessError(Abort.DEVICE_STATE)

    def _reset_by_object(self) -> None:
        """Bit 7 of 5040h; it counts while the EFC input controls too, when the controlword does not."""
        self._edges.reset = True
        self._evaluate(self.device.line.now_ns)


def _read_only(_raw: Raw) -> None:
    """6041h is printed as rw; it is a status, and nothing could be meant by writing it."""
    raise RefusedAccessError(Abort.READ_ONLY)
