"""The controllers of one axis: set-points by mode, position and velocity control, current limit (manual, 5.2 to 5.15).

Sits between the state machine, which switches it on and off, and the plant, which it moves. Works in position units;
every step is 1 ms, the controller's own cycle (manual, 60C2h).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from math import pi
from typing import Final

from app.twins.axis_profile import Profile, SetPoints, Target
from app.twins.axis_scaling import Scaling, blade_scaling, motor_scaling
from app.twins.cia402 import Stop
from app.twins.object_store import ObjectStore
from app.twins.plant import AxisPlant

CYCLE_S: Final = 0.001
_VELOCITY_LOOP_S: Final = 0.005
"""Time constant of the closed velocity loop (estimate; 60F9h holds gains without units)."""
_REST_RAD_S: Final = 1.0
"""Below this the motor counts as standing (0.03 degrees/s of the blade)."""
_SETTLED_RAD_S: Final = 0.05
"""Below this nothing is left to be controlled."""
_CURRENT_LIMIT_SHARE: Final = 0.8
"""Share of the current limit that a stop plans with, so that the controller can follow."""
_LEAST_STOP_SHARE: Final = 0.1
"""A stop is planned with at least this share of the rated torque, however low 6073h is."""
_NO_WINDOW: Final = 0xFFFFFFFF
"""6065h: monitoring off."""
_SIMULATION: Final = 1 << 15
"""60FBh/3: the axis is not moved."""
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


_POSITION_MODES: Final = (Mode.PROFILE_POSITION, Mode.CYCLIC_POSITION, Mode.HOMING, Mode.HEATING, Mode.NONE)


@dataclass(frozen=True, slots=True)
class _Parameters:
    """Parameters that every cycle needs, read when one of them was written."""

    scaling: Scaling
    position_gain: float
    feed_forward: float
    speed_limit_rad_s: float
    peak_torque_nm: float
    peak_time_s: float
    following_window: int
    following_time_s: float
    position_window: int
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
        self.targets = SetPoints()
        self.profile = Profile()
        self.limit_active = False
        self.following_exceeded = False
        self.following_tripped = False
        self.torque_nm = 0.0
        self._operating = False
        self._stop: Stop | None = None
        self._peak_s = 0.0
        self._peak_spent = False
        self._following_s = 0.0
        self._window_s = 0.0
        self._feather_target: Target | None = None
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
        return self.plant.speed_rad_s * self.scaling.units_per_rad

    @property
    def following_error(self) -> float:
        """Set-point minus actual position while the position is controlled (60F4h)."""
        return self.profile.position - self.position if self._controls_position else 0.0

    @property
    def current_permille(self) -> float:
        """Motor current in 0.1 % of the rated current (6078h)."""
        if self.energised and self._operating and self.mode is Mode.HEATING:
            return self._store.number(0x6410, 13)
        return abs(self.torque_nm) / self.plant.constants.rated_torque_nm * 1000

    @property
    def at_rest(self) -> bool:
        """Set-points and axis stand."""
        return abs(self.plant.speed_rad_s) < _REST_RAD_S and self.profile.velocity == 0.0

    @property
    def busy(self) -> bool:
        """It needs its cycles: something moves or is to move."""
        if self.plant.slips or not self.energised:
            return self.plant.slips or self.plant.speed_rad_s != 0.0
        settled = abs(self.plant.speed_rad_s) < _SETTLED_RAD_S and self.profile.velocity == 0.0
        return not settled or self._window_s < self._now.position_time_s or self._wants_to_move()

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
            self.profile.velocity = 0.0

    def switch_off(self) -> None:
        """Output stage off."""
        self.energised = False
        self._operating = False
        self._stop = None
        self.plant.brake_lifted = False
        self.torque_nm = 0.0
        self.targets.clear()
        self.following_exceeded = False
        self._following_s = 0.0

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
        self._now = self._read_parameters()
        if self._now.scaling != before:
            self.profile.put(self.position)

    def refresh_blade(self) -> None:
        """Take the scaling of the additional encoder in force."""
        self.blade = blade_scaling(self._store)

    def set_mode(self, mode: Mode) -> None:
        """Change the mode (the caller has seen that it may)."""
        self.mode = mode
        self.targets.clear()
        self.limit_active = False

    def new_set_point(self) -> None:
        """Controlword bit 4 rose in mode 1: the target is limited and handed over."""
        if self._operating and self.mode is Mode.PROFILE_POSITION:
            velocity, acceleration, deceleration = self._motion_limits()
            position = self._limited_position(self._store.number(0x607A))
            self.targets.offer(Target(position, velocity, acceleration, deceleration))
            self._window_s = 0.0

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
    def target_reached(self) -> bool:
        """Statusword bit 10 by mode and halt (manual, below table 53)."""
        if self.mode in (Mode.CYCLIC_POSITION, Mode.CYCLIC_VELOCITY):
            return True
        if self.halted and self._operating:
            return self.at_rest
        if self.mode is Mode.PROFILE_VELOCITY:
            return self.profile.velocity == self._velocity_target()
        return self.targets.reached and self.targets.last

    # -- cycles --------------------------------------------------------------------------

    def cycle(self) -> None:
        """One cycle of 1 ms, plant included."""
        if not self.energised or self._now.simulation:
            self.torque_nm = 0.0
            self.plant.step(CYCLE_S, 0.0)
            if self.energised:
                self._move_set_points()
            return
        self._move_set_points()
        self.torque_nm = self._torque()
        self.plant.step(CYCLE_S, self.torque_nm)
        self._watch()

    @property
    def _controls_position(self) -> bool:
        return self.energised and self._stop is not Stop.QUICK and self.mode in _POSITION_MODES

    def _move_set_points(self) -> None:
        profile = self.profile
        if self._stop is Stop.QUICK:
            profile.velocity = 0.0
            profile.position = self.position
        elif self._stop is not None or not self._operating:
            self._ramp_down()
        elif self.mode is Mode.PROFILE_POSITION:
            target = self.targets.active
            if self.halted or target is None:
                self._ramp_down()
            else:
                profile.towards(target, CYCLE_S)
        elif self.mode is Mode.PROFILE_VELOCITY:
            _limit, acceleration, deceleration = self._motion_limits()
            if self.halted:
                self._ramp_down()
            else:
                profile.run(self._velocity_target(), acceleration, deceleration, CYCLE_S)
        elif self.mode is Mode.CYCLIC_POSITION:
            self._follow_position()
        elif self.mode is Mode.CYCLIC_VELOCITY:
            self._follow_velocity()

    def _ramp_down(self) -> None:
        if self.profile.velocity:
            self.profile.run(0.0, 0.0, self._stopping_deceleration(), CYCLE_S)

    def _follow_position(self) -> None:
        """Mode 8. OPEN minimal or maximal deceleration on halt; the maximal one, the axis stops sooner."""
        if self.halted:
            self.profile.run(0.0, 0.0, self._current_limit_deceleration(), CYCLE_S)
            return
        velocity, acceleration, deceleration = self._motion_limits()
        position = self._limited_position(self._store.number(0x607A) + self._store.number(0x60B0))
        self.profile.towards(Target(position, velocity, acceleration, deceleration), CYCLE_S)

    def _follow_velocity(self) -> None:
        """Mode 9: 60FFh + 60B1h within the limits."""
        if self.halted:
            self.profile.run(0.0, 0.0, self._current_limit_deceleration(), CYCLE_S)
            return
        _limit, acceleration, deceleration = self._motion_limits()
        self.profile.run(self._velocity_target(), acceleration, deceleration, CYCLE_S)

    def _torque(self) -> float:
        now = self._now
        wanted = self.profile.velocity * (now.feed_forward if self._controls_position else 1.0)
        if self._controls_position:
            wanted += now.position_gain * (self.profile.position - self.position)
        limit = now.speed_limit_rad_s
        wanted_rad_s = min(max(wanted / now.scaling.units_per_rad, -limit), limit)
        constants = self.plant.constants
        torque = constants.inertia_kgm2 / _VELOCITY_LOOP_S * (wanted_rad_s - self.plant.speed_rad_s)
        return self._limited_torque(torque)

    def _limited_torque(self, torque_nm: float) -> float:
        """Peak current for 60F6h/3, then rated current for as long."""
        rated_nm = self.plant.constants.rated_torque_nm
        limit = min(self._now.peak_torque_nm, rated_nm) if self._peak_spent else self._now.peak_torque_nm
        torque_nm = min(max(torque_nm, -limit), limit)
        if abs(torque_nm) > rated_nm:
            self._peak_s += CYCLE_S
            self._peak_spent = self._peak_s >= self._now.peak_time_s
        else:
            self._peak_s = max(0.0, self._peak_s - CYCLE_S)
            self._peak_spent = self._peak_spent and self._peak_s > 0
        return torque_nm

    def _watch(self) -> None:
        """Following error (6065h, 6066h) and position window (6067h, 6068h)."""
        now = self._now
        error = abs(self.following_error)
        self.following_exceeded = now.following_window != _NO_WINDOW and error > now.following_window
        self._following_s = self._following_s + CYCLE_S if self.following_exceeded else 0.0
        if self._following_s > now.following_time_s:
            self.following_tripped = True
        target = self.targets.active
        if target is None or self.targets.reached or self.halted:
            return
        inside = abs(target.position - self.position) <= now.position_window
        self._window_s = self._window_s + CYCLE_S if inside else 0.0
        if inside and self._window_s >= now.position_time_s and self.profile.position == target.position:
            self.targets.arrive()
            self._window_s = 0.0 if not self.targets.reached else self._window_s

    def _wants_to_move(self) -> bool:
        if not self._operating or self._stop is not None:
            return False
        if self.mode is Mode.PROFILE_POSITION:
            return not self.targets.reached and not self.halted
        if self.mode is Mode.PROFILE_VELOCITY:
            return not self.halted and self._velocity_target() != 0
        return self.mode in (Mode.CYCLIC_POSITION, Mode.CYCLIC_VELOCITY)

    def _hold(self) -> None:
        """Set-points at the actual values; an axis that still moves is brought to rest from its velocity."""
        self.profile.put(self.position)
        if abs(self.plant.speed_rad_s) >= _REST_RAD_S:
            self.profile.velocity = self.velocity
        self.targets.clear()
        self._window_s = self._now.position_time_s
        self._following_s = 0.0
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
        velocity, acceleration, deceleration = self._motion_limits()
        if not velocity or not acceleration:
            acceleration = self._current_limit_deceleration()
            velocity = velocity or self._now.speed_limit_rad_s * abs(self.scaling.units_per_rad)
        self._feather_target = Target(
            self._limited_position(store.number(0x607A)), velocity, acceleration, deceleration
        )
        self.targets.force(self._feather_target)
        self._window_s = 0.0
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

    def _motion_limits(self) -> tuple[float, float, float]:
        """Velocity, acceleration and deceleration in force, each within its maximum (607Fh, 60C5h, 60C6h).

        A velocity or acceleration of 0 (their default) means no motion. OPEN what a maximum deceleration of 0 (its
        default) means; no limit, for an axis must be able to stop.
        """
        store = self._store
        velocity = min(store.number(0x6081), store.number(0x607F))
        acceleration = min(store.number(0x6083), store.number(0x60C5))
        return velocity, acceleration, self._stopping_deceleration()

    def _stopping_deceleration(self) -> float:
        store = self._store
        deceleration = store.number(0x6084) or store.number(0x6083)
        highest = store.number(0x60C6)
        if highest:
            deceleration = min(deceleration, highest)
        return deceleration or self._current_limit_deceleration()

    def _current_limit_deceleration(self) -> float:
        constants = self.plant.constants
        torque_nm = max(self._now.peak_torque_nm, constants.rated_torque_nm * _LEAST_STOP_SHARE)
        rate = torque_nm * _CURRENT_LIMIT_SHARE / constants.inertia_kgm2
        return rate * abs(self.scaling.units_per_rad)

    def _velocity_target(self) -> float:
        """60FFh (mode 9: with 60B1h) within +-607Fh."""
        store = self._store
        wanted = store.number(0x60FF)
        if self.mode is Mode.CYCLIC_VELOCITY:
            wanted += store.number(0x60B1)
        limit = store.number(0x607F)
        return min(max(wanted, -limit), limit)

    def _limited_position(self, wanted: int) -> float:
        store = self._store
        position = min(max(wanted, store.number(0x607D, 1)), store.number(0x607D, 2))
        self.limit_active = position != wanted
        return position

    def _read_parameters(self) -> _Parameters:
        store = self._store
        rated_nm = self.plant.constants.rated_torque_nm
        return _Parameters(
            scaling=motor_scaling(store),
            position_gain=store.number(0x60FB, 1),
            feed_forward=store.number(0x60FB, 2) / 1000,
            speed_limit_rad_s=store.number(0x6080) * 2 * pi / 60,
            peak_torque_nm=min(store.number(0x6073), 2000) / 1000 * rated_nm,
            peak_time_s=store.number(0x60F6, 3) / 1000,
            following_window=store.number(0x6065),
            following_time_s=store.number(0x6066) / 1000,
            position_window=store.number(0x6067),
            position_time_s=store.number(0x6068) / 1000,
            simulation=bool(store.number(0x60FB, 3) & _SIMULATION),
        )
