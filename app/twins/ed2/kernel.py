"""What both axes do together in a millisecond: single or synchronous, by bus or local (ED2 manual, 4.2 and 4.3)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple

from app.twins.ed2 import errors
from app.twins.ed2.axis import Axis
from app.twins.ed2.delivered import INCREMENTAL
from app.twins.ed2.digital import HANDS, INPUTS, LIMITS, OUTPUTS, SINGLE, Forced, Input, is_on, level_of
from app.twins.ed2.motion import Order
from app.twins.ed2.params import SYNCHRONOUS_CONTROLLER, ControlMode, Params
from app.twins.ed2.states import FAULTY, Control, State
from app.twins.ed2.valve_output import joystick_percent

_SYNC_GAIN: Final = 2.0
"""How much harder the difference to the mean is pulled at than the mean itself (assumed)."""
_LEAST_V: Final = 18.0
_MOST_V: Final = 32.0
"""Supply beyond which error 5100h comes (assumed)."""
_CABLE: Final = (2.5, 97.5)
"""Per cent of an open loop input outside of which its wire is broken or shorted (4.3.1.1)."""


@dataclass(slots=True)
class Conditions:
    """What the device is exposed to; a test, a scenario or an operator may change it at any time.

    ``levels`` are inputs from outside besides the limit switches; ``analog`` are the six analog inputs, per cent of
    their range.
    """

    supply_v: float = 24.0
    supply_bar: float = 160.0
    levels: int = level_of(Input.RELEASE)
    analog: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0, 0.0, 50.0, 50.0])


class Wish(NamedTuple):
    """What is asked of one axis: its control mode, word and order, and where the setpoint is of the bus or local."""

    mode: ControlMode
    word: int
    order: Order


class Kernel:
    """Both axes."""

    def __init__(self, axes: tuple[Axis, Axis], transducer: int) -> None:
        self.axes = axes
        self.conditions = Conditions()
        self.inputs = Forced(INPUTS)
        self.outputs = Forced(OUTPUTS)
        self.single = False
        """0/53: two single axes; else both as one, by the mean of their places."""
        self.local = False
        """0/41."""
        self._transducer = transducer

    # -- digital -----------------------------------------------------------------------------

    @property
    def levels(self) -> int:
        """Inputs in force, bit 0 for input 1. Limit switches are closed, so on, where nothing touches them."""
        levels = self.conditions.levels
        for axis, numbers in zip(self.axes, LIMITS, strict=True):
            broken = axis.surroundings.switch_broken
            for touched, wire, number in zip(axis.cylinder.limits, broken, numbers, strict=True):
                if not touched and not wire:
                    levels |= level_of(number)
        return self.inputs.apply(levels)

    @property
    def output_levels(self) -> int:
        """Outputs in force: following error of both axes, then position reached (4.3.1.2)."""
        first, second = self.axes
        levels = first.follows_badly | first.reached << 2
        if self.single:
            levels |= second.follows_badly << 1 | second.reached << 3
        return self.outputs.apply(levels)

    # -- a millisecond -----------------------------------------------------------------------

    @property
    def asleep(self) -> bool:
        """Nothing moves, and nothing will before somebody asks for it."""
        return all(axis.cylinder.asleep and axis.state in (State.INIT, State.DISABLED) for axis in self.axes)

    def cycle(self, wishes: tuple[Wish, Wish], params: tuple[Params, Params]) -> None:
        """One millisecond of both axes."""
        levels = self.levels
        for axis, own in zip(self.axes, params, strict=True):
            axis.measure(own)
        self._watch(wishes, levels)
        pairs = [(0,), (1,)] if self.single else [(0, 1)]
        for pair in pairs:
            self._settle(pair, wishes, params, levels)
            self._steer(pair, wishes[pair[0]], params, levels)
        for axis in self.axes:
            axis.move(self.conditions.supply_bar, axis.surroundings.load_n + self._link_n(axis))

    def _link_n(self, axis: Axis) -> float:
        """What a link between both cylinders does to one of them."""
        first, second = (one.cylinder.position_mm for one in self.axes)
        pull = axis.cylinder.bench.link_n_mm * (first - second)
        return pull if axis.number == 1 else -pull

    # -- errors ------------------------------------------------------------------------------

    def _fail(self, axis: Axis, family: str) -> None:
        """An error of one axis; with synchronous axes both react, and both tell the code of the one that has it."""
        reaction = axis.fail(family)
        if reaction is not None and not self.single:
            for other in self.axes:
                if other is not axis:
                    other.states.fail(reaction)

    def _watch(self, wishes: tuple[Wish, Wish], levels: int) -> None:
        supplied = _LEAST_V <= self.conditions.supply_v <= _MOST_V
        for axis, wish, numbers in zip(self.axes, wishes, LIMITS, strict=True):
            if axis.state is State.NOT_READY:
                continue
            if not supplied:
                self._fail(axis, errors.SUPPLY)
            open_loop = self._is_open_loop(wish, levels)
            if axis.reading.trouble is not None and not open_loop:
                self._fail(axis, axis.reading.trouble.value)
            if open_loop and self._cable_broken(axis):
                self._fail(axis, errors.JOYSTICK)
            touched = (not is_on(levels, numbers[0]), not is_on(levels, numbers[1]))
            used = self.single or axis.number == 1 or open_loop
            family = axis.watch_limits(touched if used else (False, False))
            if family is not None and not open_loop:
                self._fail(axis, family)

    def _is_open_loop(self, wish: Wish, levels: int) -> bool:
        """Mode 6, or its local form: input 3 beside the release (4.2.1)."""
        return is_on(levels, Input.OPEN_LOOP) if self.local else wish.mode is ControlMode.OPEN_LOOP

    def _cable_broken(self, axis: Axis) -> bool:
        low, high = _CABLE
        return not low <= self.conditions.analog[3 + axis.number] <= high

    def _causes_gone(self, axis: Axis, wish: Wish, levels: int) -> bool:
        if not _LEAST_V <= self.conditions.supply_v <= _MOST_V:
            return False
        if self._is_open_loop(wish, levels):
            return not self._cable_broken(axis)
        return axis.reading.trouble is None

    # -- states and motion -------------------------------------------------------------------

    def _settle(
        self, pair: tuple[int, ...], wishes: tuple[Wish, Wish], params: tuple[Params, Params], levels: int
    ) -> None:
        axes = [self.axes[one] for one in pair]
        word = wishes[pair[0]].word
        may_run = is_on(levels, Input.RELEASE) and not self.local
        may_run = may_run and all(self._may_run(self.axes[one], wishes[one], params[one]) for one in pair)
        gone = all(self._causes_gone(self.axes[one], wishes[one], levels) for one in pair)
        at_rest = all(axis.cylinder.still for axis in axes)
        position = sum(axis.position for axis in axes) / len(axes)
        for axis in axes:
            axis.word = 0 if self.local else word
            axis.settle(may_run=may_run, at_rest=at_rest, causes_gone=gone, position=position)

    def _may_run(self, axis: Axis, wish: Wish, params: Params) -> bool:
        """What the modes need (4.3.1). OPEN what a controller does where it is missing; here it stays DISABLED."""
        if wish.mode is ControlMode.OPEN_LOOP:
            return self.single
        fits = params.controller == SYNCHRONOUS_CONTROLLER and axis.reading.trouble is None
        return fits and not (self.single and self._transducer == INCREMENTAL)

    def _steer(self, pair: tuple[int, ...], wish: Wish, params: tuple[Params, Params], levels: int) -> None:
        leader = self.axes[pair[0]]
        if self.local and leader.state is State.INIT:
            self._steer_local(pair, levels, params)
            return
        if wish.mode is ControlMode.OPEN_LOOP:
            for one in pair:
                self._open_loop(self.axes[one], wish, params[one], levels)
            return
        self._lead(leader, pair, wish, params[pair[0]])
        mean = sum(self.axes[one].position for one in pair) / len(pair)
        for one in pair:
            self._close_loop(self.axes[one], wish.mode, mean, params[one])

    def _lead(self, leader: Axis, pair: tuple[int, ...], wish: Wish, params: Params) -> None:
        """Move the setpoint; the second axis of a synchronous pair has that of the first."""
        motion = leader.motion
        if leader.state is State.DEVICE_MODE_ACTIVE:
            motion.run(wish.mode, leader.word, wish.order, params)
        elif leader.closed:
            motion.rest(params, wish.order.deceleration)
        self._bar(leader)
        for one in pair[1:]:
            other = self.axes[one].motion
            other.reference.follow(motion.reference.position, motion.reference.velocity)
            other.target, other.points = motion.target, motion.points

    def _bar(self, axis: Axis) -> None:
        for direction, barred in zip((-1, 1), axis.barred, strict=True):
            if barred:
                axis.motion.bar(direction, axis.position)

    def _close_loop(self, axis: Axis, mode: ControlMode, mean: float, params: Params) -> None:
        if not axis.closed:
            axis.close()
            axis.reached = False
            return
        wanted = axis.motion.reference.position
        error = wanted - mean + _SYNC_GAIN * (mean - axis.position)
        family = axis.control(axis.controller.percent(error, params), params)
        if family is not None:
            self._fail(axis, family)
        if axis.state not in FAULTY and axis.watch_course(wanted - axis.position, params):
            self._fail(axis, errors.FOLLOWING)
        axis.watch_window(mode, params)

    def _open_loop(self, axis: Axis, wish: Wish, params: Params, levels: int) -> None:
        """Mode 6: magnets by the joystick, between the limit switches, without an error at them."""
        allowed = axis.state is State.DEVICE_MODE_ACTIVE and is_on(levels, Input.OPEN_LOOP)
        axis.reached = False
        if allowed and wish.word & Control.START and not wish.word & Control.STOP:
            self._by_joystick(axis, params)
        else:
            axis.close()

    def _by_joystick(self, axis: Axis, params: Params) -> None:
        percent = joystick_percent(self.conditions.analog[3 + axis.number])
        negative, positive = axis.barred
        if (percent < 0.0 and negative) or (percent > 0.0 and positive):
            percent = 0.0
        family = axis.control(percent, params)
        if family is not None:
            self._fail(axis, family)

    # -- local operation ---------------------------------------------------------------------

    def _steer_local(self, pair: tuple[int, ...], levels: int, params: tuple[Params, Params]) -> None:
        """Local operation in INIT (4.2.1): open loop with input 3, else by hand with inputs 9 to 15, one axis each."""
        for axis, own in ((self.axes[one], params[one]) for one in pair):
            if not is_on(levels, Input.RELEASE):
                axis.close()
            elif is_on(levels, Input.OPEN_LOOP):
                self._by_joystick(axis, own)
            else:
                self._by_hand(axis, levels, own)

    def _by_hand(self, axis: Axis, levels: int, params: Params) -> None:
        forward, backward, rapid = (is_on(levels, number) for number in self._hands(axis, levels))
        direction = forward - backward
        if direction == 0 or axis.reading.trouble is not None:
            axis.close()
            axis.motion.begin(axis.position)
            return
        axis.motion.jog(direction, rapid, params)
        self._bar(axis)
        error = axis.motion.reference.position - axis.position
        family = axis.control(axis.controller.percent(error, params), params)
        if family is not None:
            self._fail(axis, family)

    def _hands(self, axis: Axis, levels: int) -> tuple[int, ...]:
        """Inputs that move an axis by hand. Synchronous by hand is not possible (4.2.1).

        OPEN what input 14 means there: the text asks for it to be on, the commissioning for it to be off. Here nothing
        moves with synchronous axes before it is on, and input 9 chooses the axis.
        """
        if self.single:
            return HANDS[axis.number - 1]
        chosen = is_on(levels, Input.AXIS_2) == (axis.number == 2)
        return HANDS[0] if chosen and is_on(levels, SINGLE) else (Input.NONE,) * 3
