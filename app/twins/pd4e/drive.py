"""The drive behind the dictionary: state machine, operating modes, monitors, a millisecond at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from app.twins.cia402 import Control as Word
from app.twins.cia402 import State, Status, command_of
from app.twins.object_store import ObjectStore
from app.twins.pd4e import digital
from app.twins.pd4e.axis import NO_REACTION, Axis
from app.twins.pd4e.error_stack import ErrorStack, Trouble
from app.twins.pd4e.modes import OFF_32, Hold, Mode, ModeCode, ProfilePosition, ProfileVelocity, Velocity
from app.twins.pd4e.more_modes import (
    AutoSetup,
    CyclicPosition,
    CyclicTorque,
    CyclicVelocity,
    Homing,
    InterpolatedPosition,
    Torque,
)
from app.twins.pd4e.overload import Limits, Overload
from app.twins.pd4e.power_states import ENERGISED, UNDER_VOLTAGE_BIT, How, Options, PowerStates, stop_by
from app.twins.pd4e.servo import Control, Servo
from app.twins.pd4e.units import UNIT_OBJECTS, units_of

CLOSED_LOOP_ACTIVE: Final = 1 << 15
"""Bit of the statusword by sibling drives: the closed loop is in force."""
_WATCHED_POSITION: Final = (
    ModeCode.PROFILE_POSITION,
    ModeCode.INTERPOLATED_POSITION,
    ModeCode.CYCLIC_POSITION,
)
_HALTING: Final = (
    ModeCode.PROFILE_POSITION,
    ModeCode.VELOCITY,
    ModeCode.PROFILE_VELOCITY,
    ModeCode.PROFILE_TORQUE,
    ModeCode.HOMING,
    ModeCode.INTERPOLATED_POSITION,
)
OVER_TEMPERATURE_C: Final = 80.0
"""Sibling drives switch off here."""
OVER_VOLTAGE_MV: Final = 51_500
"""Manual, 3.6.3, where 2034h does not tell."""
_AMBIENT_C: Final = 25.0
_WARMTH_K: Final = 30.0
"""Above the ambient with the rated current for ever (assumed)."""
_WARMING_MS: Final = 300_000.0


@dataclass(slots=True)
class Conditions:
    """What the drive is exposed to; a test or an operator may change it at any time. ``levels``: inputs 4 and up.

    ``analogue``: what the converters of the analogue inputs give, digits of 16 bits with a sign.
    """

    supply_mv: int = 48_000
    logic_mv: int = 24_000
    ambient_c: float = _AMBIENT_C
    levels: int = 0
    analogue: tuple[int, int] = (0, 0)


class Drive:
    """Everything that moves. ``saving`` tells whether a save runs, during which the motor does not start."""

    def __init__(self, store: ObjectStore, servo: Servo, saving: Callable[[], bool]) -> None:
        self.store = store
        self.axis = Axis(store, servo)
        self.conditions = Conditions()
        self.errors = ErrorStack()
        self.overload = Overload()
        self.temperature_c = self.conditions.ambient_c
        self._saving = saving
        self._homing = Homing(self.axis)
        self._velocity = ProfileVelocity(self.axis)
        converter = Velocity(self.axis)
        self.velocity_factor: Callable[[], float] = lambda: converter.factor
        """604Ch, by which 6042h to 6044h are divided."""
        self.setup_ended: Callable[[], None] = lambda: None
        """Called when the auto set-up has ended: the device stores what it found."""
        self.setup = AutoSetup(self.axis)
        self._modes: dict[ModeCode, Mode] = {
            ModeCode.AUTO_SETUP: self.setup,
            ModeCode.CLOCK_DIRECTION: Hold(self.axis),
            ModeCode.NONE: Hold(self.axis),
            ModeCode.PROFILE_POSITION: ProfilePosition(self.axis),
            ModeCode.VELOCITY: converter,
            ModeCode.PROFILE_VELOCITY: self._velocity,
            ModeCode.PROFILE_TORQUE: Torque(self.axis),
            ModeCode.HOMING: self._homing,
            ModeCode.INTERPOLATED_POSITION: InterpolatedPosition(self.axis),
            ModeCode.CYCLIC_POSITION: CyclicPosition(self.axis),
            ModeCode.CYCLIC_VELOCITY: CyclicVelocity(self.axis),
            ModeCode.CYCLIC_TORQUE: CyclicTorque(self.axis),
        }
        self.mode_code = ModeCode.NONE
        self.states = PowerStates(self)
        self._word = 0
        self._unit_values: tuple[int, ...] = ()
        self._following_ms = 0
        self._deviates = False
        self._limits_hit = 0

    # -- what the state machine commands ----------------------------------------------------

    @property
    def at_rest(self) -> bool:
        """A commanded stop has ended."""
        return self.axis.at_rest

    def operate(self) -> None:
        """Current on; the mode begins."""
        self.axis.operate(self.mode.control, self.mode.ramp)
        self._following_ms, self._deviates = 0, False
        self.mode.begin()

    def stop(self, how: How) -> None:
        """Come to rest."""
        self.axis.stop(how)

    def release(self) -> None:
        """Current off."""
        self.axis.release()

    # -- what the dictionary shows -----------------------------------------------------------

    @property
    def mode(self) -> Mode:
        """The mode in force (6061h)."""
        return self._modes[self.mode_code]

    @property
    def moving(self) -> bool:
        """The motor turns, or is about to."""
        axis = self.axis
        return not axis.servo.still or (axis.control is not Control.OFF and axis.reference.velocity != 0.0)

    @property
    def levels(self) -> int:
        """Levels of the input pins, bit 0 for input 1."""
        return self.axis.servo.bench.inputs(self.axis.servo.position) | self.conditions.levels

    @property
    def inputs(self) -> int:
        """60FDh."""
        return digital.inputs(self.store, self.levels)

    @property
    def outputs(self) -> int:
        """3250h:05."""
        return digital.outputs(self.store, self.states.state in ENERGISED)

    @property
    def statusword(self) -> int:
        """6041h."""
        state = self.states.state
        bits = state.value
        if state is not State.NOT_READY:
            bits |= Status.REMOTE
        if state in UNDER_VOLTAGE_BIT:
            bits |= Status.VOLTAGE_ENABLED
        if any(not trouble.fault for trouble in self.errors.active):
            bits |= Status.WARNING
        if state in ENERGISED:
            bits |= self.mode.status() | (CLOSED_LOOP_ACTIVE if self.axis.closed_loop else 0)
        elif self.mode_code is ModeCode.HOMING:
            bits |= self.mode.status()
        elif self.axis.servo.still:
            bits |= Status.TARGET_REACHED
        return bits | (Status.MODE_13 if self._deviates else 0)

    @property
    def torque_demand(self) -> int:
        """6074h, per mille of the rated torque."""
        mode = self.mode
        return round(mode.demand) if isinstance(mode, Torque) and self.states.obeying else 0

    @property
    def current_limits(self) -> Limits:
        """203Bh, 6073h, 2031h."""
        store = self.store
        rated = store.number(0x203B, 1)
        highest = min(store.number(0x6073) * rated // 1000, store.number(0x2031))
        return Limits(rated, highest, store.number(0x203B, 2))

    # -- commands ----------------------------------------------------------------------------

    def restart(self) -> None:
        """Power-on: everything begins anew, the shaft stands where it stands."""
        self.states.restart()
        self.errors = ErrorStack()
        self.overload = Overload()
        self.axis.restart()
        self._unit_values = self._units_now()
        self.mode_code = ModeCode.NONE
        self._word = 0
        self._deviates = False
        self._limits_hit = 0
        for mode in self._modes.values():
            mode.begin()

    def settle(self) -> None:
        """Obey what was written to 6040h and 6060h since the last time."""
        self._follow_units()
        self._follow_mode()
        word = self.store.number(0x6040)
        rising, changed = word & ~self._word, word ^ self._word
        if rising & Word.FAULT_RESET:
            self._reset_faults()
        self._evaluate(word)
        if changed:
            self._pass_on(word, rising)
        self._word = self.store.number(0x6040)

    def _pass_on(self, word: int, rising: int) -> None:
        if self.states.obeying:
            self.mode.command(word, rising)
        elif self.mode_code is ModeCode.HOMING and rising & Word.NEW_SET_POINT:
            self._homing.start_where_it_stands()

    def _evaluate(self, word: int) -> None:
        number = self.store.number
        options = Options(number(0x605A), number(0x605B), number(0x605C), number(0x605E))
        self.states.evaluate(command_of(word), options, not self._saving())

    def _follow_mode(self) -> None:
        wanted = self.store.number(0x6060)
        try:
            code = ModeCode(wanted)
        except ValueError:
            return
        if code is not self.mode_code:
            self.mode_code = code
            if self.states.obeying:
                self.operate()
            else:
                self.mode.begin()

    def _units_now(self) -> tuple[int, ...]:
        cells = (self.store.find(index, sub) for index in UNIT_OBJECTS for sub in range(3))
        return tuple(cell.number for cell in cells if cell is not None)

    def _follow_units(self) -> None:
        """Units change at once, but not in Operation enabled (manual, 5.3)."""
        if self.states.state in ENERGISED:
            return
        now = self._units_now()
        if now != self._unit_values:
            self._unit_values = now
            self.axis.units = units_of(self.store)

    def _reset_faults(self) -> None:
        gone = not any(self._holds(trouble) for trouble in self.errors.active if trouble.fault)
        if self.states.state is State.FAULT and gone:
            self.errors.reset()
            self._deviates = False
            self._velocity.slipped = False
        self.states.reset_fault(gone)

    def _holds(self, trouble: Trouble) -> bool:
        """Whether the cause of a fault is still there."""
        if trouble is Trouble.OVER_VOLTAGE:
            return self.conditions.supply_mv > self._most_mv
        if trouble is Trouble.UNDER_VOLTAGE:
            return self.conditions.supply_mv < self._least_mv
        return trouble is Trouble.OVER_TEMPERATURE and self.temperature_c >= OVER_TEMPERATURE_C

    @property
    def _most_mv(self) -> int:
        cell = self.store.find(0x2034)
        return OVER_VOLTAGE_MV if cell is None else cell.number

    @property
    def _least_mv(self) -> int:
        cell = self.store.find(0x2035)
        return 0 if cell is None else cell.number

    # -- a millisecond -------------------------------------------------------------------------

    def cycle(self) -> None:
        """One millisecond."""
        self.settle()
        self._watch_surroundings()
        self._watch_limits()
        axis = self.axis
        limits = self.current_limits
        axis.most_ma = self.overload.allowed_ma(limits)
        if self.states.obeying:
            self._obey()
        homing = self.mode_code is ModeCode.HOMING and self.states.obeying
        axis.step(self._homing.limit_ma if homing else axis.most_ma)
        self.overload.step(limits, axis.servo.current_ma)
        self._warm_up(limits.rated_ma)
        if self.states.obeying:
            self._watch_course()

    def _obey(self) -> None:
        axis, mode = self.axis, self.mode
        if self._word & Word.HALT and self.mode_code in _HALTING:
            if not axis.stopping:
                axis.stop(stop_by(self.store.number(0x605D)))
            return
        if axis.stopping:
            axis.go_on(mode.control)
        if mode is self._homing:
            self._homing.switches = self.inputs
        mode.cycle()

    def _watch_surroundings(self) -> None:
        supply = self.conditions.supply_mv
        if supply > self._most_mv:
            self._fail(Trouble.OVER_VOLTAGE, None)
        elif supply < self._least_mv:
            self._fail(Trouble.UNDER_VOLTAGE, None)
        if self.temperature_c >= OVER_TEMPERATURE_C:
            self._fail(Trouble.OVER_TEMPERATURE, How.QUICK)

    def _watch_limits(self) -> None:
        """Limit switches: a warning while one is closed, the action of 3701h when it closes."""
        closed = self.inputs & 0x3
        for bit, trouble in ((0, Trouble.NEGATIVE_LIMIT), (1, Trouble.POSITIVE_LIMIT)):
            if closed >> bit & 1:
                self.errors.raised(trouble)
            else:
                self.errors.gone(trouble)
        option = self.store.number(0x3701)
        self.axis.barred = 0
        if option >= 0 and closed:
            self.axis.barred = -1 if closed & 1 else 1
            if closed & ~self._limits_hit:
                self.states.obstruct(stop_by(option))
        self._limits_hit = closed

    def _watch_course(self) -> None:
        if self.mode_code in _WATCHED_POSITION:
            error = abs(self.axis.following_error)
            window = self.store.number(0x6065)
            exceeded = window != OFF_32 and error > window
            self._following_ms = self._following_ms + 1 if exceeded else 0
            if self._following_ms > self.store.number(0x6066):
                self._deviate(Trouble.FOLLOWING_ERROR)
            elif not exceeded:
                self._deviates = False
        elif self.mode_code is ModeCode.PROFILE_VELOCITY and self._velocity.slipped:
            self._deviate(Trouble.SLIPPAGE)
        if self.setup.finished:
            self.setup.finished = False
            self.setup_ended()

    def _deviate(self, trouble: Trouble) -> None:
        """Following or slippage error: bit 13 and the action of 3700h. OPEN for -1; here only the bit shows then."""
        self._deviates = True
        option = self.store.number(0x3700)
        if option != NO_REACTION:
            self._fail(trouble, stop_by(option))

    def _fail(self, trouble: Trouble, how: How | None) -> None:
        """Enter a fault. ``how`` None takes the current away: nothing else can be done without supply."""
        if not self.errors.raised(trouble):
            return
        if how is None:
            self.axis.release()
        elif trouble is Trouble.OVER_TEMPERATURE:
            how = stop_by(self.store.number(0x605E))
        self.states.fault(how or How.AT_ONCE)

    def _warm_up(self, rated_ma: int) -> None:
        share = abs(self.axis.servo.current_ma) / max(rated_ma, 1)
        end = self.conditions.ambient_c + _WARMTH_K * share * share
        self.temperature_c += (end - self.temperature_c) / _WARMING_MS
