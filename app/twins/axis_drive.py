"""The controllers of one axis: set-points by mode, position and velocity control, current limit (manual, 5.2 to 5.15).

Sits between the state machine, which switches it on and off, and the plant, which it moves. It says what is to be done,
in position units; the cycles of 1 ms themselves are those of ``axis_kernel``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import pi
from typing import Final

from app.twins import axis_kernel as k
from app.twins.axis_limits import AxisLimits
from app.twins.axis_profile import Profile, SetPoints, Target
from app.twins.axis_scaling import Scaling, blade_scaling, interpolation_ms, motor_scaling
from app.twins.axis_tuning import SIMULATION, tune
from app.twins.cia402 import Stop
from app.twins.object_store import ObjectStore
from app.twins.plant import BLADE_INCREMENTS_PER_RAD, ENCODER_INCREMENTS, AxisPlant

_REST_RAD_S: Final = 1.0
"""Below this the motor counts as standing (0.03 degrees/s of the blade)."""
_SETTLED_RAD_S: Final = 0.05
"""Below this nothing is left to be controlled."""
_FEATHER_TO_SWITCH: Final = 1 << 8
"""60FBh/3: the 90 degree switch must be actuated in feather."""
_FEATHER_BY_VELOCITY: Final = 1 << 9
"""60FBh/3: an EFC drives to the 90 degree switch under velocity control."""


class Mode(Enum):
    """Modes of operation (table 55)."""

    NONE = 0
    PROFILE_POSITION = 1
    PROFILE_VELOCITY = 3
    HOMING = 6
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    HEATING = -113


class Feedback(Enum):
    """What the axis is controlled with (manual, below table 50: an EFC with an encoder error)."""

    MOTOR_ENCODER = "motor encoder"
    """Its speed; the position by the encoder that 606Ah selects."""
    BLADE_ENCODER = "additional encoder"
    NONE = "speed control without encoder"


_SPEED_SOURCES: Final = {
    Feedback.MOTOR_ENCODER: k.MOTOR_ENCODER,
    Feedback.BLADE_ENCODER: k.BLADE_ENCODER,
    Feedback.NONE: k.NO_ENCODER,
}
_POSITION_MODES: Final = (Mode.PROFILE_POSITION, Mode.CYCLIC_POSITION, Mode.HOMING, Mode.HEATING, Mode.NONE)


@dataclass(frozen=True, slots=True)
class _Parameters:
    """Parameters that are looked at between the cycles, read when one of them was written."""

    scaling: Scaling
    speed_limit_rad_s: float
    position_time_s: float
    simulation: bool


class AxisDrive:
    """Implements ``cia402.Axis`` on a plant."""

    def __init__(self, store: ObjectStore, plant: AxisPlant) -> None:
        self._store = store
        self.plant = plant
        self.mode = Mode.NONE
        self.halted = False
        self.energised = False
        self.watchdog_closed = False
        self._feedback = Feedback.MOTOR_ENCODER
        self.targets = SetPoints()
        self.profile = Profile(plant.s)
        self.limit_active = False
        self.following_tripped = False
        self._operating = False
        self._stop: Stop | None = None
        self._feather_target: Target | None = None
        self._cyclic: Target | None = None
        self._cyclic_halted = False
        self._limits = AxisLimits(store, plant.constants)
        self.blade = blade_scaling(store)
        self._now = self._read_parameters()

    # -- values ----------------------------------------------------------------------

    @property
    def scaling(self) -> Scaling:
        """Of the motor encoder, as it is in force."""
        return self._now.scaling

    @property
    def position(self) -> float:
        """Actual position by the encoder that 606Ah selects (6064h)."""
        return self.blade_position if self._store.number(0x606A) == -1 else self.motor_position

    @property
    def feedback(self) -> Feedback:
        """What the axis is controlled with; set by whoever sees that an encoder has failed."""
        return self._feedback

    @feedback.setter
    def feedback(self, feedback: Feedback) -> None:
        if feedback is not self._feedback:
            self._feedback = feedback
            self.plant.p[k.SPEED_SOURCE] = _SPEED_SOURCES[feedback]
            self._now = self._read_parameters()
            # The encoders differ: without this the axis would jump.
            self.profile.put(self._controlled_position, self.profile.velocity)

    @property
    def _by_blade(self) -> bool:
        if self._feedback is Feedback.BLADE_ENCODER:
            return True
        return self._store.number(0x606A) == -1 and not self.plant.blade_encoder_failed

    @property
    def _controlled_position(self) -> float:
        """Actual position by the encoder that the axis is controlled with."""
        return self.blade_position if self._by_blade else self.motor_position

    @property
    def motor_position(self) -> float:
        """Actual position by the motor encoder."""
        return self.scaling.position(self.plant.encoder_increments)

    @property
    def blade_position(self) -> float:
        """Actual position by the additional encoder (6864h); 5894h = FFh copies the motor encoder."""
        if self._store.number(0x5894) == 0xFF:
            return self.motor_position
        return self.blade.position(self.plant.blade_encoder_increments)

    @property
    def velocity(self) -> float:
        """Actual velocity in units/s (606Ch)."""
        return self.plant.s[k.ENCODER_RAD_S] * self._units_per_rad

    @property
    def torque_nm(self) -> float:
        """Torque of the motor."""
        return self.plant.torque_nm

    @property
    def following_exceeded(self) -> bool:
        """The following error is beyond 6065h now."""
        return self.energised and self.plant.s[k.FOLLOWING_EXCEEDED] != 0.0

    @property
    def _units_per_rad(self) -> float:
        """Position units for one radian of the shaft, by what the encoder really counts."""
        return self.scaling.signed_factor * ENCODER_INCREMENTS / (2 * pi)

    @property
    def following_error(self) -> float:
        """Set-point minus actual position while the position is controlled (60F4h)."""
        return self.profile.position - self._controlled_position if self._controls_position else 0.0

    @property
    def current_permille(self) -> float:
        """Motor current in 0.1 % of the rated current (6078h)."""
        if self.energised and self._operating and self.mode is Mode.HEATING:
            return self._store.number(0x6410, 13)
        return abs(self.plant.s[k.CURRENT_A]) / self.plant.constants.rated_current_a * 1000

    @property
    def at_rest(self) -> bool:
        """Set-points and axis stand."""
        return abs(self.plant.speed_rad_s) < _REST_RAD_S and self.profile.velocity == 0.0

    @property
    def busy(self) -> bool:
        """It needs its cycles: something moves or is to move."""
        if not self.energised:
            return not self.plant.at_rest
        settled = abs(self.plant.speed_rad_s) < _SETTLED_RAD_S and self.profile.velocity == 0.0
        waits = self.plant.s[k.WINDOW_S] < self._now.position_time_s
        return not settled or waits or self._wants_to_move()

    # -- commanded by the state machine --------------------------------------------------

    def switch_on(self) -> None:
        """Output stage on, brake lifted, set-points at the actual values (T3)."""
        self.refresh()
        self.energised = True
        self.plant.brake_lifted = not self._now.simulation
        self._operating = False
        self._stop = None
        self._hold()

    def engage_brake(self) -> None:
        """Open the brake contact: the set-point of the speed is 0 from now on (manual, 60F9h/4)."""
        self.plant.brake_lifted = False
        if self.energised:
            self._operating = False
            self._stop = Stop.QUICK
            self.profile.put(self.profile.position)

    def switch_off(self) -> None:
        """Output stage off."""
        self.energised = False
        self._operating = False
        self._stop = None
        self.plant.brake_lifted = False
        self.targets.clear()
        self.plant.s[k.FOLLOWING_S] = self.plant.s[k.FOLLOWING_EXCEEDED] = 0.0

    def operate(self, feather: bool) -> None:
        """Follow set-points (T4); where ``feather``, drive to the EFC target."""
        if not self._operating or self._stop is not None:
            self._hold()
        self._operating = True
        self._stop = None
        if feather:
            self._start_feather()

    def stop(self, how: Stop) -> None:
        """Come to rest and stay there, under control."""
        self._operating = False
        self._stop = how
        self.targets.clear()

    def watchdog(self, closed: bool) -> None:
        """Set the watchdog contact."""
        self.watchdog_closed = closed

    # -- commanded through objects -------------------------------------------------------

    def refresh(self) -> None:
        """Take the parameters in force, after one was written."""
        before = self._now.scaling
        self._limits.refresh()
        self._now = self._read_parameters()
        if self._now.scaling != before:
            self.profile.put(self._controlled_position)

    def refresh_blade(self) -> None:
        """Take the scaling of the additional encoder in force."""
        self.blade = blade_scaling(self._store)

    def set_mode(self, mode: Mode) -> None:
        """Change the mode (the caller has seen that it may)."""
        self.mode = mode
        self.targets.clear()
        self.limit_active = False
        self._cyclic, self._cyclic_halted = None, False

    def new_set_point(self) -> None:
        """Controlword bit 4 rose in mode 1: the target is limited and handed over."""
        if self._operating and self.mode is Mode.PROFILE_POSITION:
            velocity, acceleration, deceleration = self._limits.motion()
            position = self._limited_position(self._store.number(0x607A))
            self.targets.offer(Target(position, velocity, acceleration, deceleration))
            self.plant.s[k.WINDOW_S] = 0.0

    def set_home(self) -> bool:
        """Homing method 35: make the actual position that of 607Ah. False where it cannot be done.

        OPEN which offset changes; each is said to be changed by it, so both are, and the encoders agree afterwards.
        """
        if self.energised or self._store.number(0x6098) != 35:
            return False
        wanted = self._store.number(0x607A)
        motor, blade = self._store.cell(0x607C), self._store.cell(0x687C)
        motor.raw = motor_scaling(self._store).offset_for(self.plant.encoder_increments, wanted)
        blade.raw = blade_scaling(self._store).offset_for(self.plant.blade_encoder_increments, wanted)
        self.refresh()
        self.refresh_blade()
        return True

    @property
    def follows(self) -> bool:
        """It follows cyclic set-points (statusword bit 12 in modes 8 and 9)."""
        return self._operating and not self.halted

    @property
    def cyclic(self) -> bool:
        """Set-points come in a cycle (modes 8 and 9)."""
        return self.mode is Mode.CYCLIC_POSITION or self.mode is Mode.CYCLIC_VELOCITY

    @property
    def target_reached(self) -> bool:
        """Statusword bit 10 by mode and halt (manual, below table 53)."""
        if self.cyclic:
            return True
        if self.halted and self._operating:
            return self.at_rest
        if self.mode is Mode.PROFILE_VELOCITY:
            return self.profile.velocity == self._limits.velocity_target(cyclic=False)
        return self.targets.reached and self.targets.last

    # -- cycles --------------------------------------------------------------------------

    def advance(self, cycles: int) -> int:
        """Run up to so many cycles of 1 ms, plant included; gives how many: an event ends them early."""
        self._command()
        done = self.plant.advance(cycles)
        events = self.plant.events
        if events & int(k.TRIP_EVENT):
            self.following_tripped = True
        if events & int(k.REACHED_EVENT):
            self.targets.arrive()
            if not self.targets.reached:
                self.plant.s[k.WINDOW_S] = 0.0
        return done

    @property
    def _controls_position(self) -> bool:
        if not self.energised or self._stop is Stop.QUICK or self.feedback is Feedback.NONE:
            return False
        return self.mode in _POSITION_MODES

    def _command(self) -> None:
        """What the next cycles are to do."""
        p = self.plant.p
        p[k.ENERGISED] = 1.0 if self.energised else 0.0
        p[k.EXTRA_VELOCITY] = p[k.WATCHES_TARGET] = p[k.HEATING_A] = 0.0
        if not self.energised:
            return
        p[k.CONTROLS_POSITION] = 1.0 if self._controls_position else 0.0
        self._choose_encoders()
        if self._stop is Stop.QUICK:
            p[k.SET_KIND] = k.QUICK
        elif self._stop is not None or not self._operating:
            self._hold_at(self._limits.stopping())
        elif self.mode is Mode.PROFILE_POSITION:
            self._follow_target()
        elif self.mode is Mode.PROFILE_VELOCITY:
            self._follow_velocity(self._limits.stopping())
        elif self.mode is Mode.CYCLIC_POSITION:
            self._follow_position()
        elif self.mode is Mode.CYCLIC_VELOCITY:
            self._follow_velocity(self._limits.current_limit)
        else:
            self._hold_at(self._limits.stopping())
            if self.mode is Mode.HEATING:
                p[k.HEATING_A] = self._store.number(0x6410, 13) / 1000 * self.plant.constants.rated_current_a

    def _choose_encoders(self) -> None:
        p = self.plant.p
        by_blade = self._by_blade
        p[k.POSITION_SOURCE] = k.BLADE_ENCODER if by_blade else k.MOTOR_ENCODER
        if by_blade:
            failed = self.plant.blade_encoder_failed
            zero = self.plant.blade_encoder_increments if failed else self.plant.blade_encoder_zero_increments
            p[k.BLADE_UNITS_PER_RAD] = 0.0 if failed else self.blade.signed_factor * BLADE_INCREMENTS_PER_RAD
            p[k.BLADE_OFFSET_UNITS] = self.blade.position(zero)

    def _hold_at(self, deceleration: float) -> None:
        p = self.plant.p
        p[k.SET_KIND] = k.HOLD
        p[k.TARGET_DECELERATION] = deceleration

    def _go_to(self, target: Target) -> None:
        p = self.plant.p
        p[k.SET_KIND] = k.TOWARDS
        p[k.TARGET] = target.position
        p[k.TARGET_VELOCITY] = target.velocity
        p[k.TARGET_ACCELERATION] = target.acceleration
        p[k.TARGET_DECELERATION] = target.deceleration
        p[k.PASS_VELOCITY] = 0.0

    def _follow_target(self) -> None:
        target = self.targets.active
        if self.halted or target is None:
            self._hold_at(self._limits.stopping())
            return
        self._go_to(target)
        self.plant.p[k.WATCHES_TARGET] = 0.0 if self.targets.reached else 1.0
        if self.feedback is Feedback.NONE:  # no position: towards the 90 degree switch, which ends it
            self._run_at(target.velocity, target.acceleration, target.deceleration)

    def _follow_position(self) -> None:
        """Mode 8: 607Ah + 60B0h, with 60B1h.

        OPEN minimal or maximal deceleration on halt; the maximal one, the axis stops sooner.
        """
        if self.halted:
            self._hold_at(self._limits.current_limit)
            self._cyclic, self._cyclic_halted = None, True
            return
        position = self._limited_position(self._store.number(0x607A) + self._store.number(0x60B0))
        if self._cyclic_halted:  # back to position control without a ramp
            self._cyclic_halted = False
            self.profile.put(position)
        if self._cyclic is None or self._cyclic.position != position:
            velocity, acceleration, deceleration = self._limits.motion()
            before, self._cyclic = self._cyclic, Target(position, velocity, acceleration, deceleration)
            self._approach(self._cyclic, 0.0 if before is None else position - before.position)
        self.plant.p[k.EXTRA_VELOCITY] = self._store.number(0x60B1)

    def _approach(self, target: Target, moved: float) -> None:
        """A cyclic set-point: straight within the time of 60C2h, or as fast as the limits allow where they do not."""
        period_s = float(interpolation_ms(self._store.number(0x60C2, 1), self._store.number(0x60C2, 2))) / 1000
        velocity = abs(target.position - self.profile.position) / max(period_s, k.CYCLE_S)
        change = abs(velocity - abs(self.profile.velocity))
        self._go_to(target)
        self.plant.s[k.WAITED] = 0.0
        if velocity <= target.velocity and change <= target.acceleration * period_s:
            self.plant.p[k.SET_KIND] = k.LINEAR
            self.plant.p[k.TARGET_VELOCITY] = velocity
        else:
            self.plant.p[k.PASS_VELOCITY] = moved / max(period_s, k.CYCLE_S)
            self.plant.p[k.PASS_CYCLES] = period_s / k.CYCLE_S + k.PATIENCE

    def _follow_velocity(self, stopping: float) -> None:
        """Modes 3 and 9: 60FFh (mode 9: + 60B1h) within the limits; ``stopping`` is the deceleration on halt."""
        if self.halted:
            self._hold_at(stopping)
            self._cyclic_halted = self.mode is Mode.CYCLIC_VELOCITY
            return
        _limit, acceleration, deceleration = self._limits.motion()
        if self._cyclic_halted:  # mode 9: back to its velocity without a ramp
            self._cyclic_halted = False
            self.profile.put(self.profile.position, self._limits.velocity_target(self.mode is Mode.CYCLIC_VELOCITY))
        self._run_at(self._limits.velocity_target(self.mode is Mode.CYCLIC_VELOCITY), acceleration, deceleration)

    def _run_at(self, velocity: float, acceleration: float, deceleration: float) -> None:
        p = self.plant.p
        p[k.SET_KIND] = k.RUN
        p[k.TARGET_VELOCITY] = velocity
        p[k.TARGET_ACCELERATION] = acceleration
        p[k.TARGET_DECELERATION] = deceleration

    def _wants_to_move(self) -> bool:
        if not self._operating or self._stop is not None:
            return False
        if self.mode is Mode.PROFILE_POSITION:
            return not self.targets.reached and not self.halted
        if self.mode is Mode.PROFILE_VELOCITY:
            return not self.halted and self._limits.velocity_target(cyclic=False) != 0
        return self.mode in (Mode.CYCLIC_POSITION, Mode.CYCLIC_VELOCITY)

    def _hold(self) -> None:
        """Set-points at the actual values; an axis that still moves is brought to rest from its velocity."""
        moves = abs(self.plant.speed_rad_s) >= _REST_RAD_S
        self.profile.put(self._controlled_position, self.velocity if moves else 0.0)
        self.targets.clear()
        self._cyclic = None
        self.plant.s[k.WINDOW_S] = self._now.position_time_s
        self.plant.s[k.FOLLOWING_S] = 0.0
        self.following_tripped = False

    # -- limits --------------------------------------------------------------------------

    def _start_feather(self) -> None:
        """EFC: its objects go to those of mode 1. OPEN what blank ones mean; the limits count then."""
        store = self._store
        self.set_mode(Mode.PROFILE_POSITION)
        self.halted = False
        for source, target, fallback in (
            (0x567A, 0x607A, None),
            (0x5681, 0x6081, 0x607F),
            (0x5683, 0x6083, 0x60C5),
            (0x5684, 0x6084, None),
        ):
            value = store.number(source)
            if not value and fallback is not None:
                value = store.number(fallback)
            store.cell(target).raw = value
        velocity, acceleration, deceleration = self._limits.motion()
        if not velocity or not acceleration:
            acceleration = self._limits.current_limit
            velocity = velocity or self._now.speed_limit_rad_s * abs(self.scaling.units_per_rad)
        self._feather_target = Target(
            self._limited_position(store.number(0x607A)), velocity, acceleration, deceleration
        )
        self.targets.force(self._feather_target)
        self.plant.s[k.WINDOW_S] = 0.0
        if store.number(0x60FB, 3) & _FEATHER_BY_VELOCITY:
            self._seek_switch()

    def feather_on(self) -> None:
        """The EFC target is reached without the 90 degree switch: go on to it, where 60FBh/3 bit 8 demands it."""
        if self.targets.reached and self._store.number(0x60FB, 3) & _FEATHER_TO_SWITCH:
            self._seek_switch()

    def _seek_switch(self) -> None:
        """Drive on with the velocity of the EFC; the switch ends it (T5), at the latest the upper position limit."""
        target = self._feather_target
        if target is not None:
            self.targets.force(replace(target, position=float(self._store.number(0x607D, 2))))

    def _limited_position(self, wanted: int) -> float:
        store = self._store
        position = min(max(wanted, store.number(0x607D, 1)), store.number(0x607D, 2))
        self.limit_active = position != wanted
        return position

    def _read_parameters(self) -> _Parameters:
        store = self._store
        tune(store, self.plant)
        return _Parameters(
            scaling=motor_scaling(store),
            speed_limit_rad_s=store.number(0x6080) * 2 * pi / 60,
            position_time_s=store.number(0x6068) / 1000,
            simulation=bool(store.number(0x60FB, 3) & SIMULATION),
        )
