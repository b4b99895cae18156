"""One axis of the controller: its sensor, its state, its closed loop and its valve, a millisecond at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.twins.ed2 import errors
from app.twins.ed2.errors import Active
from app.twins.ed2.hydraulics import Cylinder, Drive
from app.twins.ed2.motion import Motion
from app.twins.ed2.params import ControlMode, Params
from app.twins.ed2.states import CLOSED_LOOP, FAULTY, Reaction, State, States
from app.twins.ed2.transducers import Reading, Transducer
from app.twins.ed2.valve_output import Controller, drive_of

_OFF: Final = Drive()


@dataclass(slots=True)
class Surroundings:
    """What one axis is exposed to. ``load_n`` acts against extending; a broken magnet takes no current."""

    load_n: float = 0.0
    magnet_a_broken: bool = False
    magnet_b_broken: bool = False
    switch_broken: tuple[bool, bool] = (False, False)
    """Wires of the limit switches, negative and positive: a broken one reads as a switch that has opened."""


class Axis:
    """The axis ``number``, 1 or 2."""

    def __init__(self, number: int, cylinder: Cylinder, transducer: Transducer, active: Active) -> None:
        self.number = number
        self.cylinder = cylinder
        self.transducer = transducer
        self.errors = active
        self.surroundings = Surroundings()
        self.states = States()
        self.motion = Motion()
        self.controller = Controller()
        self.reading = Reading(0.0)
        self.drive = _OFF
        self.word = 0
        """Control word in force."""
        self.reached = False
        """Bit 12: inside the target window, with its hysteresis."""
        self._limits = (False, False)
        self._late_ms = 0
        self._was = State.NOT_READY

    # -- what is shown -----------------------------------------------------------------------

    @property
    def state(self) -> State:
        """State of the device for this axis."""
        return self.states.state

    @property
    def position(self) -> float:
        """Actual value, mm."""
        return self.reading.position_mm

    @property
    def deviation(self) -> float:
        """12/103: setpoint less actual value, mm; 0 while there is no closed loop."""
        return self.motion.reference.position - self.position if self.state in CLOSED_LOOP else 0.0

    @property
    def follows_badly(self) -> bool:
        """Bit 11."""
        return self.errors.has(errors.FOLLOWING)

    # -- power -------------------------------------------------------------------------------

    def power_on(self) -> None:
        """Everything begins anew; the cylinder is where it is."""
        self.states.power_on()
        self.errors.clear()
        self.transducer.power_on(self.cylinder.position_mm)
        self.motion.begin(0.0)
        self.controller.reset()
        self.drive = _OFF
        self.word, self.reached, self._late_ms = 0, False, 0
        self._limits, self._was = (False, False), State.NOT_READY

    # -- a millisecond -----------------------------------------------------------------------

    def measure(self, params: Params) -> None:
        """Read the sensor."""
        self.reading = self.transducer.read(self.cylinder.position_mm, params.scaling)

    def fail(self, family: str) -> Reaction | None:
        """An error; gives its reaction where it is new, and begins with it."""
        reaction = self.errors.raised(family)
        if reaction is not None:
            self.states.fail(reaction)
        return reaction

    def watch_limits(self, touched: tuple[bool, bool]) -> str | None:
        """Limit switches, negative and positive: the error of one that opens, None where none does.

        OPEN whether an open switch keeps the error from being reset; it does not, or nobody could leave it.
        """
        before, self._limits = self._limits, touched
        for now, past, family in zip(touched, before, (errors.LIMIT_NEGATIVE, errors.LIMIT_POSITIVE), strict=True):
            if now and not past:
                return family
        return None

    @property
    def barred(self) -> tuple[bool, bool]:
        """Directions in which limit switches let nothing go on: negative, positive."""
        return self._limits

    def settle(self, *, may_run: bool, at_rest: bool, causes_gone: bool, position: float) -> None:
        """One step of the state machine; ``position`` is that of the closed loop."""
        before = self.states.state
        self.states.step(self.word, at_rest=at_rest, may_run=may_run, causes_gone=causes_gone)
        now = self.states.state
        if before in FAULTY and now not in FAULTY:
            self.errors.clear()
            self._late_ms = 0
        if now is not self._was:
            self._entered(now, position)
            self._was = now

    def _entered(self, state: State, position: float) -> None:
        opened = self._was not in CLOSED_LOOP and state in CLOSED_LOOP
        if opened or (state is State.FAULT_REACTION and self.states.holding):
            self.motion.begin(position)
            self.controller.reset()
        elif state is State.DEVICE_MODE_ACTIVE:
            self.motion.enter(self.word)
        self._late_ms = 0

    @property
    def closed(self) -> bool:
        """The loop is closed now."""
        state = self.state
        return state in CLOSED_LOOP and not (state is State.FAULT_REACTION and not self.states.holding)

    def watch_course(self, error_mm: float, params: Params) -> bool:
        """Following error: coarse at once, fine after its delay (OPEN: the manual only names both)."""
        size = abs(error_mm)
        self._late_ms = self._late_ms + 1 if size > params.fine else 0
        return size > params.coarse or self._late_ms > params.delay_ms

    def watch_window(self, mode: ControlMode, params: Params) -> None:
        """Bit 12: set inside the inner window, taken back outside the outer one."""
        if not self.closed or (mode is not ControlMode.POSITION and not self.motion.arrived):
            self.reached = False
            return
        distance = abs(self.motion.target - self.position)
        self.reached = distance <= (params.outer if self.reached else params.inner)

    def control(self, percent: float, params: Params) -> str | None:
        """Open the valve by so much; gives the family of an error where a magnet does not take its current."""
        self.drive = drive_of(percent, params.output, self.cylinder.bench)
        if self.drive.a_ma and self.surroundings.magnet_a_broken:
            self.drive.a_ma = 0.0
            return errors.MAGNET_A
        if self.drive.b_ma and self.surroundings.magnet_b_broken:
            self.drive.b_ma = 0.0
            return errors.MAGNET_B
        return None

    def close(self) -> None:
        """No current."""
        self.drive = _OFF

    def move(self, supply_bar: float, load_n: float) -> None:
        """Let the cylinder move."""
        if self.drive is not _OFF or not self.cylinder.asleep:
            self.cylinder.step(self.drive, supply_bar, load_n)
