"""Looks over an axis' shoulder: each transition against table 50, each statusword against table 49, each limit.

Written from the manual's tables alone, not from the twin. What it finds is an AssertionError in the step that did it.
Tolerances: 2 % and 60 rpm on a limit of speed (a load pulls the shaft before the controller answers), 0.5 degrees of
the blade on a limit of position, 5 % and 2 % of rated current on a limit of current (the current controller swings over
where its set-point jumps), 1 A of the battery (twice the resolution of 3070h).
"""

from __future__ import annotations

from collections.abc import Callable
from math import radians
from typing import Final

from app.twins.axis_drive import Feedback
from app.twins.canopen_device import Power
from app.twins.cia402 import Command, Signals, State
from app.twins.plant import GEAR_RATIO
from tests.twins.harness import MS
from tests.twins.oat_rig import BladeRig

LOOK_NS: Final = 5 * MS
STATES: Final = tuple(State)
OFF_COMMANDS: Final = (Command.DISABLE_VOLTAGE, Command.QUICK_STOP)
GO_COMMANDS: Final = (Command.SWITCH_ON, Command.ENABLE_OPERATION)
MASKS: Final = {
    State.NOT_READY: (0x4F, 0x00),
    State.SWITCH_ON_DISABLED: (0x4F, 0x40),
    State.READY: (0x6F, 0x21),
    State.SWITCHED_ON: (0x6F, 0x23),
    State.OPERATION_ENABLED: (0x6F, 0x27),
    State.QUICK_STOP_ACTIVE: (0x6F, 0x07),
    State.FAULT_REACTION_ACTIVE: (0x4F, 0x0F),
    State.FAULT: (0x4F, 0x08),
}
"""Table 49: mask and pattern."""
TABLE_50: Final[dict[int, tuple[tuple[State, ...], State]]] = {
    0: (STATES, State.NOT_READY),
    1: ((State.NOT_READY,), State.SWITCH_ON_DISABLED),
    2: ((State.SWITCH_ON_DISABLED,), State.READY),
    3: ((State.READY,), State.SWITCHED_ON),
    4: ((State.SWITCHED_ON,), State.OPERATION_ENABLED),
    5: ((State.OPERATION_ENABLED,), State.SWITCHED_ON),
    6: ((State.SWITCHED_ON,), State.READY),
    7: ((State.READY,), State.SWITCH_ON_DISABLED),
    8: ((State.OPERATION_ENABLED,), State.READY),
    9: ((State.OPERATION_ENABLED,), State.SWITCH_ON_DISABLED),
    10: ((State.SWITCHED_ON,), State.SWITCH_ON_DISABLED),
    11: ((State.OPERATION_ENABLED,), State.QUICK_STOP_ACTIVE),
    12: ((State.QUICK_STOP_ACTIVE,), State.SWITCH_ON_DISABLED),
    13: (tuple(s for s in STATES if s not in (State.FAULT_REACTION_ACTIVE, State.FAULT)), State.FAULT_REACTION_ACTIVE),
    14: ((State.FAULT_REACTION_ACTIVE,), State.FAULT),
    15: ((State.FAULT,), State.SWITCH_ON_DISABLED),
    # The sources of T16 are not printed; an EFC may come where no other transition leads to feather.
    16: ((State.SWITCH_ON_DISABLED, State.QUICK_STOP_ACTIVE), State.OPERATION_ENABLED),
}
"""Table 50: sources and target of each transition."""
EVENTS: Final[dict[int, Callable[[Signals], bool]]] = {
    1: lambda now: now.booted,
    2: lambda now: now.enable_input and (now.command is Command.SHUTDOWN or now.autostart),
    3: lambda now: now.command in GO_COMMANDS or now.feather,
    4: lambda now: now.command is Command.ENABLE_OPERATION or now.feather,
    5: lambda now: now.command is Command.SWITCH_ON or now.hit_90,
    6: lambda now: now.command is Command.SHUTDOWN,
    7: lambda now: not now.enable_input or now.command in OFF_COMMANDS,
    8: lambda now: now.command is Command.SHUTDOWN,
    9: lambda now: not now.enable_input or now.command is Command.DISABLE_VOLTAGE,
    10: lambda now: not now.enable_input or now.command in OFF_COMMANDS or now.hit_0,
    11: lambda now: now.command is Command.QUICK_STOP or now.hit_0,
    12: lambda _now: True,
    13: lambda now: now.fault is not None,
    14: lambda _now: True,
    15: lambda now: (now.reset and now.errors_gone) or now.feather,
    16: lambda now: now.feather,
}
"""Table 50: what must have happened."""
AFTER_ACTION: Final = frozenset((5, 6, 8, 9, 10, 12, 14))
"""They show when the axis stands or the brake's dwell time is over: their event came earlier."""
UNPOWERED: Final = (State.NOT_READY, State.SWITCH_ON_DISABLED, State.READY, State.FAULT)
_SPEED_SHARE, _SPEED_RPM = 1.02, 60
_SPEED_SHARE_BY_BLADE: Final = 1.1
"""The blade encoder sees the motor through play and gear: its loop is slow, and overshoots after its mark slips."""
_CURRENT_SHARE, _CURRENT_PERMILLE = 1.05, 20
_POSITION_DEG = 0.5
_BATTERY_A = 1.0
_PEAK_SLACK_NS = 100 * MS


class Witness:
    """Watches one blade, from its making on, in every 5 ms of the line's time."""

    def __init__(self, rig: BladeRig) -> None:
        self.rig = rig
        self.mode_may_become: int | None = None
        """What a write of 6060h may make of 6061h."""
        self.scaling_as_fitted = True
        """Encoders, gears and feed are described as they are; positions mean something."""
        self.controllers_damped = True
        """Those of current and velocity are not tuned so that they swing."""
        self.taken: list[int] = []
        """All transitions taken."""
        self._machine = rig.pmc.machine
        self._number = rig.pmc.device.store.number
        self._seen: list[Signals] = []
        self._state = self._machine.state
        self._mode = self._number(0x6061)
        self._fastest = 0.0
        self._farthest = (0.0, 0.0)
        self._has_rested = False
        self._peak_since_ns: int | None = None
        self._settling_until_ns = self._unwinding_until_ns = self._brakes_until_ns = 0
        self._restarted = self._feathered = False
        self._machine.history.clear()
        setattr(self._machine, "evaluate", self._evaluate)  # noqa: B010 - a method of this one machine
        self._look_again(rig.line.now_ns)

    # -- transitions --------------------------------------------------------------------

    def _evaluate(self, t_ns: int, signals: Signals) -> None:
        """See what the machine is told, and what it makes of it."""
        assert signals.enable_input is self.rig.pmc.inputs.enable
        if signals.feather:
            self._check_feather()
        self._replay()  # a restart takes T0 without being asked
        self._seen.append(signals)
        type(self._machine).evaluate(self._machine, t_ns, signals)
        self._feathered |= self._machine.feathering
        self._replay()
        del self._seen[:-200]

    def _check_feather(self) -> None:
        """An EFC is wanted only where it is asked for, and not on the switches beyond it (table 50, special case)."""
        pmc = self.rig.pmc
        assert not pmc.inputs.efc or self._number(0x6040) & 0x0800
        assert not pmc.plant.at_90 and not pmc.plant.at_95

    def _replay(self) -> None:
        """Follow the machine through the transitions that it names."""
        for number in self._machine.history:
            sources, target = TABLE_50[number]
            assert self._state in sources, f"T{number} out of {self._state}"
            self._check_event(number)
            self.taken.append(number)
            self._restarted |= number == 0
            self._state = target
            self._seen = self._seen[-1:]  # what came before a state was entered is no reason to leave it
        self._machine.history.clear()
        assert self._machine.state is self._state, f"{self._machine.state} without a transition"

    def _check_event(self, number: int) -> None:
        happened = EVENTS.get(number)
        if happened is None:
            return
        seen = self._seen if number in AFTER_ACTION else self._seen[-1:]
        assert any(happened(signals) for signals in seen), f"T{number} without its event"

    # -- what can be read ---------------------------------------------------------------

    def load_changed(self) -> None:
        """What pulled is gone, or pulls elsewhere: the controllers have to unwind."""
        self._unwinding_until_ns = self.rig.line.now_ns + 300 * MS

    def parameters_changed(self) -> None:
        """A limit may just have moved: what is beyond it now may only come back."""
        self._settling_until_ns = self.rig.line.now_ns + 20 * MS
        self._fastest = abs(self._number(0x606C))
        self._farthest = self._beyond()

    def _look_again(self, t_ns: int) -> None:
        self.look(t_ns)
        self.rig.line.call_at(t_ns + LOOK_NS, self._look_again)

    def look(self, t_ns: int) -> None:
        """All that must hold at any moment."""
        self._replay()
        self._check_status()
        self._check_mode()
        self._check_outputs()
        self._check_speed(t_ns)
        self._check_current(t_ns)
        self._check_position()
        self._check_battery()

    def _check_status(self) -> None:
        word = self._number(0x6041)
        fits = [state for state, (mask, pattern) in MASKS.items() if word & mask == pattern]
        assert fits == [self._state], f"{word:04X}h in {self._state}"
        assert not word & 0x8100
        pmc = self.rig.pmc
        assert bool(word & 0x0200) is pmc.inputs.efc
        if pmc.inputs.efc and pmc.device.power is not Power.OFF:  # what was in RAM is gone with the supply
            assert (word ^ self._number(0x6040)) & 0x4000 == 0

    def _check_mode(self) -> None:
        mode = self._number(0x6061)
        self._feathered |= self._machine.feathering
        if mode != self._mode:
            by_feather = mode == 1 and self._feathered
            by_restart = mode == 0 and self._restarted
            assert mode == self.mode_may_become or by_feather or by_restart, f"mode {self._mode} became {mode}"
        self._mode = mode
        self._restarted = False
        self._feathered = self._machine.feathering

    def _check_outputs(self) -> None:
        outputs = self._number(0x60FE, 3)
        if self._state in UNPOWERED:
            assert not outputs & 1, f"brake lifted in {self._state}"
            assert not self.rig.pmc.drive.energised
        if self._state in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            assert not outputs & 1 << 16, "the watchdog contact is closed"

    def _check_speed(self, t_ns: int) -> None:
        """Beyond 6080h and 607Fh the motor brakes, whatever pulls."""
        store = self._number
        rpm, torque = store(0x6044), store(0x6077)
        pushes = self.controllers_damped and rpm * torque > 0 and abs(torque) > _CURRENT_PERMILLE
        by_motor = self.rig.pmc.drive.feedback is Feedback.MOTOR_ENCODER
        knows_rpm = self.scaling_as_fitted or by_motor  # the blade encoder tells the motor's speed through 6091h
        if not knows_rpm:
            self._brakes_until_ns = t_ns + 300 * MS  # once it knows, it has to brake first
        if t_ns >= max(self._settling_until_ns, self._brakes_until_ns) and pushes:
            share = _SPEED_SHARE if by_motor else _SPEED_SHARE_BY_BLADE
            assert abs(rpm) <= store(0x6080) * share + _SPEED_RPM, "6080h"
        units = abs(store(0x606C))
        per_rpm = abs(self.rig.pmc.drive.scaling.units_per_rad) / 9.549
        allowed = max(store(0x607F), self._fastest) + store(0x60FB, 1) * abs(store(0x60F4)) + _SPEED_RPM * per_rpm
        if t_ns >= self._unwinding_until_ns and pushes and not self._machine.feathering and self.scaling_as_fitted:
            assert units <= allowed * _SPEED_SHARE, f"607Fh: {units} above {allowed}"
        self._fastest = min(self._fastest, units)

    def _check_current(self, t_ns: int) -> None:
        store = self._number
        if t_ns < self._settling_until_ns:
            return
        current = max(abs(store(0x6077)), store(0x6078))
        assert current <= store(0x6073) * _CURRENT_SHARE + _CURRENT_PERMILLE, f"6073h: {current}"
        if current <= 1000 * _CURRENT_SHARE:
            self._peak_since_ns = None
            return
        self._peak_since_ns = t_ns if self._peak_since_ns is None else self._peak_since_ns
        assert t_ns - self._peak_since_ns <= store(0x60F6, 3) * MS + _PEAK_SLACK_NS, "60F6h/3"

    def _beyond(self) -> tuple[float, float]:
        """How far the axis is below and above 607Dh, in units."""
        position = self._number(0x6064)
        return self._number(0x607D, 1) - position, position - self._number(0x607D, 2)

    def _check_position(self) -> None:
        """A target position never leads out of 607Dh. An axis that came from elsewhere comes back, or stands."""
        drive = self.rig.pmc.drive
        angle_deg = self.rig.angle_deg
        limits = drive.plant.constants
        assert limits.low_stop_deg - 0.01 <= angle_deg <= limits.high_stop_deg + 0.01
        obeys = self.scaling_as_fitted and self.controllers_damped
        moves = self._state is State.OPERATION_ENABLED and self._mode in (1, 8) and obeys
        if not moves:
            self._has_rested = False
            self._farthest = self._beyond()
            return
        self._has_rested = self._has_rested or drive.at_rest
        tolerance = radians(_POSITION_DEG) * GEAR_RATIO * abs(drive.scaling.units_per_rad)
        beyond = self._beyond()
        if not self._has_rested:
            self._farthest = beyond
            return
        pushes = self._number(0x6077) * (1 if drive.scaling.sign > 0 else -1)
        for side, (now, before) in enumerate(zip(beyond, self._farthest, strict=True)):
            outward = (-pushes if side == 0 else pushes) > _CURRENT_PERMILLE
            assert not outward or now <= max(before, 0.0) + tolerance, f"607Dh/{side + 1}: {now} units beyond"
        self._farthest = (min(self._farthest[0], beyond[0]), min(self._farthest[1], beyond[1]))

    def _check_battery(self) -> None:
        pmm = self.rig.pmm
        limit_a = pmm.device.store.number(0x30FB, 3)
        assert pmm.power.battery_a <= limit_a + _BATTERY_A, "30FBh/3"
