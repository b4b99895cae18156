"""One axis at the cycle of its controllers, 1 ms: set-points, cascade of three controllers, motor, gear, blade.

Written so that the same source runs as plain Python and compiled (``plant_kernel``), bit for bit alike: floats in two
flat lists, ``s`` the state and ``p`` what is given from outside, and nothing but arithmetic and square roots. Indices
0 to 79 are of this module. Position units are those of the drive (6092h), all else is SI; angles, torques and inertias
are those of the motor shaft, the blade's too.

Mechanics: two masses, motor and blade, coupled by a gear with play, stiffness and damping, each with dry friction::

    J_m dw_m/dt = kt i - T - friction_m        J_b dw_b/dt = T + load - friction_b
    T = k (twist -+ play/2) + c dtwist/dt      none within the play

Motor: the torque-producing current i (amplitude) behind its resistance and inductance, back-EMF ke w; the output stage
gives at most DC link / sqrt 3 (amplitude of a phase)::

    L di/dt = v - R i - ke w_m      P = 3/2 v i      kt = 3/2 ke
"""

from __future__ import annotations

from math import copysign, sqrt

CYCLE_S = 0.001
"""The cycle of the position controller (manual, 60C2h)."""
SUBSTEPS = 2
"""Steps of the mechanics in a cycle: the gear's own oscillation (25 Hz) is followed closely."""
_STEP_S = CYCLE_S / SUBSTEPS

# -- state: s[...] ---------------------------------------------------------------------------
MOTOR_DC_W = 0
DC_LINK_V = 1
MOTOR_RAD = 2
MOTOR_RAD_S = 3
BLADE_RAD = 4
BLADE_RAD_S = 5
CURRENT_A = 6
VELOCITY_I_A = 7
CURRENT_I_V = 8
SPEED_FILTERED = 9
SET_POSITION = 10
SET_VELOCITY = 11
PEAK_S = 12
PEAK_SPENT = 13
FOLLOWING_S = 14
FOLLOWING_EXCEEDED = 15
WINDOW_S = 16
AT_0 = 17
AT_90 = 18
AT_95 = 19
EVENT = 20
ENCODER_RAD = 21
ENCODER_RAD_S = 22
MESH_NM = 23
CURRENT_WANTED_A = 24
WAITED = 25
"""Cycles for which a cyclic set-point has been reached, or approached beyond its time, and no other came."""
MOTOR_J = 30
"""Energy that the output stage took from the DC link; the next ones say what became of it."""
COPPER_J = 31
INVERTER_J = 32
FRICTION_J = 33
LOAD_J = 34
"""Work that the load has done on the blade."""
MESH_J = 35

# -- events: s[EVENT] is their sum -------------------------------------------------------------
SWITCH_EVENT = 1.0
TRIP_EVENT = 2.0
REACHED_EVENT = 4.0

# -- given from outside: p[...] ------------------------------------------------------------------
AWAKE = 0
ENERGISED = 1
SET_KIND = 2
TARGET = 3
TARGET_VELOCITY = 4
TARGET_ACCELERATION = 5
TARGET_DECELERATION = 6
CONTROLS_POSITION = 7
POSITION_GAIN = 8
FEED_FORWARD = 9
UNITS_PER_RAD = 10
OFFSET_UNITS = 11
BLADE_UNITS_PER_RAD = 12
BLADE_OFFSET_UNITS = 13
POSITION_SOURCE = 14
SPEED_SOURCE = 15
SPEED_LIMIT = 16
PEAK_A = 17
NOMINAL_A = 18
PEAK_TIME_S = 19
FILTER = 20
VELOCITY_P = 21
VELOCITY_I = 22
VELOCITY_D = 23
CURRENT_P = 24
CURRENT_I = 25
FOLLOWING_WINDOW = 26
FOLLOWING_TIME_S = 27
POSITION_WINDOW = 28
POSITION_TIME_S = 29
WATCHES_TARGET = 30
SIMULATION = 31
EXTRA_VELOCITY = 32
"""Added to the wanted velocity (60B1h in mode 8)."""
HEATING_A = 33
"""Current that heats the motor and makes no torque."""
PASS_VELOCITY = 34
"""With which a target is passed, signed: cyclic set-points that the axis has yet to catch up with go on with it..."""
PASS_CYCLES = 35
"""... for so many cycles, if no other comes."""
MOTOR_KGM2 = 40
BLADE_KGM2 = 41
MOTOR_FRICTION_NM = 42
"""Bearings and gear input, and the brake where it is engaged."""
BLADE_FRICTION_NM = 43
VISCOUS_NMS = 44
MESH_NM_PER_RAD = 45
MESH_NMS = 46
PLAY_RAD = 47
LOAD_NM = 48
TORQUE_NM_PER_A = 49
RESISTANCE_OHM = 50
INDUCTANCE_H = 51
DECAY = 52
"""exp(-R/L x cycle)."""
STAGE_W = 53
STAGE_V = 54
LOW_STOP_RAD = 55
HIGH_STOP_RAD = 56
CLOSES_0_RAD = 57
CLOSES_90_RAD = 58
CLOSES_95_RAD = 59
SWITCH_PLAY_RAD = 60
ENCODER_COUNTS = 61

# -- p[SET_KIND] ---------------------------------------------------------------------------------
HOLD = 0.0
"""Ramp down with p[TARGET_DECELERATION], then stand."""
TOWARDS = 1.0
"""To p[TARGET]."""
RUN = 2.0
"""With p[TARGET_VELOCITY], signed."""
QUICK = 3.0
"""No speed at once: as fast as the current allows."""
LINEAR = 4.0
"""To p[TARGET] with p[TARGET_VELOCITY], where the next one is expected by then."""
PATIENCE = 2.0
"""Cycles that a next set-point may be late: a SYNC is, by the frames before it."""

# -- p[POSITION_SOURCE], p[SPEED_SOURCE] -----------------------------------------------------------
MOTOR_ENCODER = 0.0
BLADE_ENCODER = 1.0
NO_ENCODER = 2.0
"""Speed from a model of the motor, position unknown: speed control without encoder."""

NO_WINDOW = -1.0
_DEAD_UNITS = 0.5
"""A standing axis leaves alone what is smaller than a position unit, else dry friction would make it hunt."""
_ROOT_3 = sqrt(3.0)


def axis_cycle(s: list[float], p: list[float]) -> None:
    """One cycle: control with what is measured now, 1 ms of physics, then set-points, monitors and switches."""
    s[EVENT] = 0.0
    if p[ENERGISED] and not p[SIMULATION]:
        voltage = current_control(s, p, velocity_control(s, p, position_control(s, p)))
        motor_and_gear(s, p, voltage)
    else:
        coast(s, p)
    measure(s, p)
    if p[ENERGISED]:
        move_set_points(s, p)
        if not p[SIMULATION]:
            watch(s, p)
    look_at_switches(s, p)


def position(s: list[float], p: list[float]) -> float:
    """Actual position in units, by the encoder that the position is controlled with."""
    if p[POSITION_SOURCE] == BLADE_ENCODER:
        return s[BLADE_RAD] * p[BLADE_UNITS_PER_RAD] + p[BLADE_OFFSET_UNITS]
    return s[ENCODER_RAD] * p[UNITS_PER_RAD] + p[OFFSET_UNITS]


def measure(s: list[float], p: list[float]) -> None:
    """What the encoders say; without sine and cosine the count stands still."""
    if p[ENCODER_COUNTS]:
        s[ENCODER_RAD] = s[MOTOR_RAD]
        s[ENCODER_RAD_S] = s[MOTOR_RAD_S]
    else:
        s[ENCODER_RAD_S] = 0.0
    speed = s[ENCODER_RAD_S]
    if p[SPEED_SOURCE] == BLADE_ENCODER:
        speed = s[BLADE_RAD_S]
    elif p[SPEED_SOURCE] == NO_ENCODER:
        speed = s[MOTOR_RAD_S]
    s[SPEED_FILTERED] += (speed - s[SPEED_FILTERED]) * p[FILTER]


def position_control(s: list[float], p: list[float]) -> float:
    """Wanted speed in rad/s: pre-control and gain on the following error (60FBh/1, /2), limited by 6080h."""
    wanted = s[SET_VELOCITY]
    if p[CONTROLS_POSITION]:
        error = s[SET_POSITION] - position(s, p)
        if wanted == 0.0 and abs(error) < _DEAD_UNITS:
            error = 0.0
        wanted = wanted * p[FEED_FORWARD] + p[POSITION_GAIN] * error + p[EXTRA_VELOCITY]
    wanted /= p[UNITS_PER_RAD]
    return min(max(wanted, -p[SPEED_LIMIT]), p[SPEED_LIMIT])


def velocity_control(s: list[float], p: list[float], wanted: float) -> float:
    """Wanted current: PI, with a share of the change of speed (60F9h/1 to /3); limited, also by time (60F6h/3)."""
    limit = p[PEAK_A]
    if s[PEAK_SPENT] and p[NOMINAL_A] < limit:
        limit = p[NOMINAL_A]
    error = wanted - s[SPEED_FILTERED]
    change = (s[ENCODER_RAD_S] - s[SPEED_FILTERED]) * p[VELOCITY_D]
    current = p[VELOCITY_P] * error + s[VELOCITY_I_A] - change
    # What is limited is not integrated any further, else the controller would have to unwind.
    if not (current > limit and error > 0.0) and not (current < -limit and error < 0.0):
        s[VELOCITY_I_A] = min(max(s[VELOCITY_I_A] + p[VELOCITY_I] * error * CYCLE_S, -limit), limit)
    return min(max(current, -limit), limit)


def current_control(s: list[float], p: list[float], wanted: float) -> float:
    """Voltage of the output stage: PI on the current with the back-EMF added, limited by the DC link."""
    s[CURRENT_WANTED_A] = wanted
    limit = max(s[DC_LINK_V], 0.0) / _ROOT_3
    error = wanted - s[CURRENT_A]
    back = s[MOTOR_RAD_S] * p[TORQUE_NM_PER_A] / 1.5
    voltage = back + p[CURRENT_P] * error + s[CURRENT_I_V]
    if abs(voltage) <= limit:
        s[CURRENT_I_V] += p[CURRENT_I] * error
        return voltage
    return copysign(limit, voltage)


def motor_and_gear(s: list[float], p: list[float], voltage: float) -> None:
    """One cycle of current and mechanics, and the power that this took from the DC link."""
    before = s[CURRENT_A]
    final = (voltage - s[MOTOR_RAD_S] * p[TORQUE_NM_PER_A] / 1.5) / p[RESISTANCE_OHM]
    after = final + (before - final) * p[DECAY]
    # The output stage itself stops a current that grows beyond what it may give, however the controller is tuned.
    if abs(after) > p[PEAK_A] and abs(after) > abs(before):
        after = copysign(max(p[PEAK_A], abs(before)), after)
    mean = (before + after) / 2
    s[CURRENT_A] = after
    work = mechanics(s, p, mean * p[TORQUE_NM_PER_A])
    copper = 1.5 * p[RESISTANCE_OHM] * (mean * mean + p[HEATING_A] * p[HEATING_A]) * CYCLE_S
    stage = (p[STAGE_W] + p[STAGE_V] * abs(mean)) * CYCLE_S
    magnetic = 0.75 * p[INDUCTANCE_H] * (after * after - before * before)
    taken = work + copper + stage + magnetic
    s[COPPER_J] += copper
    s[INVERTER_J] += stage
    s[MOTOR_J] += taken
    s[MOTOR_DC_W] = taken / CYCLE_S
    if abs(s[CURRENT_WANTED_A]) > p[NOMINAL_A]:
        s[PEAK_S] += CYCLE_S
        if s[PEAK_S] >= p[PEAK_TIME_S]:
            s[PEAK_SPENT] = 1.0
    else:
        s[PEAK_S] = max(0.0, s[PEAK_S] - CYCLE_S)
        if s[PEAK_S] == 0.0:
            s[PEAK_SPENT] = 0.0


def coast(s: list[float], p: list[float]) -> None:
    """One cycle with the output stage off: what was in the windings becomes heat."""
    s[COPPER_J] += 0.75 * p[INDUCTANCE_H] * s[CURRENT_A] * s[CURRENT_A]
    s[CURRENT_A] = s[VELOCITY_I_A] = s[CURRENT_I_V] = s[CURRENT_WANTED_A] = 0.0
    s[MOTOR_DC_W] = 0.0
    s[PEAK_S] = max(0.0, s[PEAK_S] - CYCLE_S)
    if s[PEAK_S] == 0.0:
        s[PEAK_SPENT] = 0.0
    mechanics(s, p, 0.0)


def mechanics(s: list[float], p: list[float], torque: float) -> float:
    """One cycle of the two masses under a motor torque; gives the work of the motor in J.

    Work is force times the mean of the speeds before and after, with which energy is kept exactly.
    """
    work = 0.0
    for _ in range(SUBSTEPS):
        mesh = mesh_torque(s, p)
        was, blade_was = s[MOTOR_RAD_S], s[BLADE_RAD_S]
        drive = torque - mesh - p[VISCOUS_NMS] * was
        now = slowed(was + drive / p[MOTOR_KGM2] * _STEP_S, p[MOTOR_FRICTION_NM] / p[MOTOR_KGM2] * _STEP_S)
        push = mesh + p[LOAD_NM]
        blade_now = slowed(blade_was + push / p[BLADE_KGM2] * _STEP_S, p[BLADE_FRICTION_NM] / p[BLADE_KGM2] * _STEP_S)
        s[MOTOR_RAD_S] = now
        s[BLADE_RAD_S] = blade_now
        s[MOTOR_RAD] += now * _STEP_S
        s[BLADE_RAD] += blade_now * _STEP_S
        way, blade_way = (was + now) / 2 * _STEP_S, (blade_was + blade_now) / 2 * _STEP_S
        work += torque * way
        s[LOAD_J] += p[LOAD_NM] * blade_way
        s[MESH_J] += mesh * (way - blade_way)
        s[FRICTION_J] += (torque - mesh) * way - p[MOTOR_KGM2] * (now - was) * (was + now) / 2
        s[FRICTION_J] += push * blade_way - p[BLADE_KGM2] * (blade_now - blade_was) * (blade_was + blade_now) / 2
        stop_at_ends(s, p)
    return work


def mesh_torque(s: list[float], p: list[float]) -> float:
    """Torque that motor and blade put on each other; none while the teeth are between their flanks."""
    twist = s[MOTOR_RAD] - s[BLADE_RAD]
    half = p[PLAY_RAD] / 2
    if twist > half:
        mesh = p[MESH_NM_PER_RAD] * (twist - half) + p[MESH_NMS] * (s[MOTOR_RAD_S] - s[BLADE_RAD_S])
        mesh = max(mesh, 0.0)
    elif twist < -half:
        mesh = p[MESH_NM_PER_RAD] * (twist + half) + p[MESH_NMS] * (s[MOTOR_RAD_S] - s[BLADE_RAD_S])
        mesh = min(mesh, 0.0)
    else:
        mesh = 0.0
    s[MESH_NM] = mesh
    return mesh


def slowed(speed: float, friction: float) -> float:
    """Dry friction brings to rest, and never beyond."""
    if abs(speed) <= friction:
        return 0.0
    return speed - copysign(friction, speed)


def stop_at_ends(s: list[float], p: list[float]) -> None:
    """The blade runs against a stop; its energy is lost there."""
    if s[BLADE_RAD] < p[LOW_STOP_RAD] or s[BLADE_RAD] > p[HIGH_STOP_RAD]:
        s[BLADE_RAD] = min(max(s[BLADE_RAD], p[LOW_STOP_RAD]), p[HIGH_STOP_RAD])
        s[FRICTION_J] += p[BLADE_KGM2] * s[BLADE_RAD_S] * s[BLADE_RAD_S] / 2
        s[BLADE_RAD_S] = 0.0


def move_set_points(s: list[float], p: list[float]) -> None:
    """Ramps (manual, 5.10, 5.11). Without velocity, acceleration or deceleration an axis does not move to a target."""
    kind = p[SET_KIND]
    velocity = s[SET_VELOCITY]
    acceleration, deceleration = p[TARGET_ACCELERATION], p[TARGET_DECELERATION]
    if kind == QUICK:
        s[SET_VELOCITY] = 0.0
        s[SET_POSITION] = position(s, p)
    elif kind == TOWARDS:
        distance = p[TARGET] - s[SET_POSITION]
        if acceleration <= 0.0 or deceleration <= 0.0:
            s[SET_VELOCITY] = 0.0
            return
        step = deceleration * CYCLE_S / 2
        onward = 0.0
        if p[PASS_VELOCITY] * distance > 0.0 and s[WAITED] < p[PASS_CYCLES]:
            s[WAITED] += 1.0
            onward = p[PASS_VELOCITY] * p[PASS_VELOCITY]
        braking = sqrt(step * step + 2 * deceleration * abs(distance) + onward) - step
        velocity = changed(velocity, copysign(min(p[TARGET_VELOCITY], braking), distance), acceleration, deceleration)
        move = velocity * CYCLE_S
        if abs(distance) <= abs(move) and abs(velocity) <= deceleration * CYCLE_S * 2:
            s[SET_POSITION] = p[TARGET]
            s[SET_VELOCITY] = 0.0
        else:
            s[SET_POSITION] += move
            s[SET_VELOCITY] = velocity
    elif kind == LINEAR:
        interpolate(s, p)
    else:
        wanted = p[TARGET_VELOCITY] if kind == RUN else 0.0
        velocity = changed(velocity, wanted, acceleration, deceleration)
        s[SET_VELOCITY] = velocity
        s[SET_POSITION] += velocity * CYCLE_S


def interpolate(s: list[float], p: list[float]) -> None:
    """Straight to a cyclic set-point; there, the velocity counts until the next one is overdue."""
    distance = p[TARGET] - s[SET_POSITION]
    if distance == 0.0:
        s[WAITED] += 1.0
        if s[WAITED] > PATIENCE:
            s[SET_VELOCITY] = 0.0
        return
    s[WAITED] = 0.0
    wanted = copysign(p[TARGET_VELOCITY], distance)
    velocity = changed(s[SET_VELOCITY], wanted, p[TARGET_ACCELERATION], p[TARGET_DECELERATION])
    move = velocity * CYCLE_S
    s[SET_VELOCITY] = velocity
    # Rounding must not leave a crumb for another cycle.
    if abs(distance) <= abs(move) * 1.000001 and move * distance > 0.0:
        s[SET_POSITION] = p[TARGET]
    else:
        s[SET_POSITION] += move


def changed(velocity: float, wanted: float, acceleration: float, deceleration: float) -> float:
    """A velocity one cycle further on the way to the wanted one."""
    faster = abs(wanted) > abs(velocity) and wanted * velocity >= 0.0
    most = (acceleration if faster else deceleration) * CYCLE_S
    if abs(wanted - velocity) <= most:
        return wanted
    return velocity + copysign(most, wanted - velocity)


def watch(s: list[float], p: list[float]) -> None:
    """Following error (6065h, 6066h) and position window (6067h, 6068h)."""
    now = position(s, p)
    error = abs(s[SET_POSITION] - now) if p[CONTROLS_POSITION] else 0.0
    if p[FOLLOWING_WINDOW] != NO_WINDOW and error > p[FOLLOWING_WINDOW]:
        s[FOLLOWING_EXCEEDED] = 1.0
        if s[FOLLOWING_S] <= p[FOLLOWING_TIME_S] < s[FOLLOWING_S] + CYCLE_S:
            s[EVENT] += TRIP_EVENT  # once
        s[FOLLOWING_S] += CYCLE_S
    else:
        s[FOLLOWING_EXCEEDED] = s[FOLLOWING_S] = 0.0
    if p[WATCHES_TARGET]:
        if abs(p[TARGET] - now) <= p[POSITION_WINDOW]:
            s[WINDOW_S] += CYCLE_S
            if s[WINDOW_S] >= p[POSITION_TIME_S] and s[SET_POSITION] == p[TARGET]:
                s[EVENT] += REACHED_EVENT
        else:
            s[WINDOW_S] = 0.0


def look_at_switches(s: list[float], p: list[float]) -> None:
    """Limit switches of the blade, each with some play."""
    blade, play = s[BLADE_RAD], p[SWITCH_PLAY_RAD]
    at_0 = 1.0 if blade <= p[CLOSES_0_RAD] + (play if s[AT_0] else 0.0) else 0.0
    at_90 = 1.0 if blade >= p[CLOSES_90_RAD] - (play if s[AT_90] else 0.0) else 0.0
    at_95 = 1.0 if blade >= p[CLOSES_95_RAD] - (play if s[AT_95] else 0.0) else 0.0
    if at_0 != s[AT_0] or at_90 != s[AT_90] or at_95 != s[AT_95]:
        s[EVENT] += SWITCH_EVENT
    s[AT_0] = at_0
    s[AT_90] = at_90
    s[AT_95] = at_95
