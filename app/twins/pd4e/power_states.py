"""Power state machine of the PD4-E (CiA 402; manual, 5.2) with its option codes. Pure: no dictionary, no motor.

States, commands and bits are those of ``twins.cia402``; what differs from the OAT drive: no enable input, no brake that
delays a state, stops by option codes, and a quick stop that may stay energised.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

from app.twins.cia402 import Command, State


class How(Enum):
    """How the motor comes to rest."""

    AT_ONCE = "no set-point velocity at once"
    SLOW = "slow down ramp"
    QUICK = "quick stop ramp"


_BY_CODE: Final = {0: How.AT_ONCE, 1: How.SLOW, 2: How.QUICK, 5: How.SLOW, 6: How.QUICK}
_STAYS: Final = (5, 6)
ENERGISED: Final = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)
"""States in which the motor has current. OPEN for Switched on; CiA 402 lets the drive function begin at Operation
enabled."""
UNDER_VOLTAGE_BIT: Final = (State.SWITCHED_ON, *ENERGISED)
"""States with bit 4 of the statusword: the auto set-up's check has it in Switched on, but not before."""


def stop_by(code: int) -> How:
    """What an option code asks for. OPEN for reserved codes; they count as the quick stop ramp."""
    return _BY_CODE.get(code, How.QUICK)


@dataclass(frozen=True, slots=True)
class Options:
    """Option codes: 605Ah, 605Bh, 605Ch and 605Eh."""

    quick_stop: int
    shutdown: int
    disable: int
    fault: int


class Axis(Protocol):
    """What the state machine commands."""

    @property
    def at_rest(self) -> bool:
        """A commanded stop has ended."""

    def operate(self) -> None:
        """Current on, set-points at the actual values."""

    def stop(self, how: How) -> None:
        """Come to rest."""

    def release(self) -> None:
        """Current off."""


class PowerStates:
    """The state of one drive."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self.state = State.NOT_READY
        self._leaving: State | None = None
        """Where a stop that has begun leads to."""
        self._stays = False

    def restart(self) -> None:
        """Power-on."""
        self._axis.release()
        self.state = State.NOT_READY
        self._leaving = None

    def booted(self) -> None:
        """The controller is ready."""
        if self.state is State.NOT_READY:
            self.state = State.SWITCH_ON_DISABLED

    @property
    def obeying(self) -> bool:
        """Set-points are followed: no stop runs."""
        return self.state is State.OPERATION_ENABLED and self._leaving is None

    def fault(self, how: How) -> None:
        """An error arose."""
        if self.state in (State.FAULT, State.FAULT_REACTION_ACTIVE, State.NOT_READY):
            return
        energised = self.state in ENERGISED
        self.state, self._leaving = State.FAULT_REACTION_ACTIVE, State.FAULT
        if energised:
            self._axis.stop(how)
        else:
            self._finish(State.FAULT)

    def reset_fault(self, gone: bool) -> None:
        """Bit 7 of the controlword rose; ``gone``: no cause holds any more."""
        if self.state is State.FAULT and gone:
            self.state = State.SWITCH_ON_DISABLED

    def obstruct(self, how: How) -> None:
        """A limit switch asks for a stop (3701h). OPEN where it leads; taken as a quick stop that switches off."""
        if self.obeying:
            self._stays = False
            self._leave(how, State.SWITCH_ON_DISABLED, State.QUICK_STOP_ACTIVE)

    def evaluate(self, command: Command, options: Options, may_operate: bool = True) -> None:
        """Take the transitions that are due. ``may_operate`` is False while a save runs."""
        before = None
        while before is not self.state:
            before = self.state
            self._step(command, options, may_operate)

    def _step(self, command: Command, options: Options, may_operate: bool) -> None:
        if self.state in (State.NOT_READY, State.FAULT):
            return
        if self.state is State.FAULT_REACTION_ACTIVE:
            if self._axis.at_rest:
                self._finish(State.FAULT)
        elif command is Command.DISABLE_VOLTAGE:
            if self.state is not State.SWITCH_ON_DISABLED:
                self._finish(State.SWITCH_ON_DISABLED)
        elif self.state is State.QUICK_STOP_ACTIVE:
            self._quick_stopping(command)
        elif self.state is State.OPERATION_ENABLED:
            self._operating(command, options)
        else:
            self._idle(command, may_operate)

    def _idle(self, command: Command, may_operate: bool) -> None:
        if self.state is State.SWITCH_ON_DISABLED:
            if command is Command.SHUTDOWN:
                self.state = State.READY
        elif command is Command.QUICK_STOP:
            self.state = State.SWITCH_ON_DISABLED
        elif self.state is State.READY:
            if command in (Command.SWITCH_ON, Command.ENABLE_OPERATION):
                self.state = State.SWITCHED_ON
        elif command is Command.SHUTDOWN:
            self.state = State.READY
        elif command is Command.ENABLE_OPERATION and may_operate:
            self._axis.operate()
            self.state = State.OPERATION_ENABLED

    def _operating(self, command: Command, options: Options) -> None:
        if command is Command.QUICK_STOP:
            code = options.quick_stop
            self._stays = code in _STAYS
            self._leave(stop_by(code), State.SWITCH_ON_DISABLED, State.QUICK_STOP_ACTIVE)
        elif self._leaving is not None:
            # A stop that has begun is not taken back: only a quick stop or switching off overtakes it.
            if self._axis.at_rest:
                self._finish(self._leaving)
        elif command is Command.SHUTDOWN:
            self._leave(stop_by(options.shutdown), State.READY, State.OPERATION_ENABLED)
        elif command is Command.SWITCH_ON:
            # The manual's 605Ch names Switch on disabled as the state after the slow down ramp, not Switched on.
            then = State.SWITCHED_ON if options.disable == 0 else State.SWITCH_ON_DISABLED
            self._leave(stop_by(options.disable), then, State.OPERATION_ENABLED)

    def _quick_stopping(self, command: Command) -> None:
        if self._stays:
            if command is Command.ENABLE_OPERATION and self._axis.at_rest:
                self._leaving = None
                self._axis.operate()
                self.state = State.OPERATION_ENABLED
        elif self._axis.at_rest:
            self._finish(State.SWITCH_ON_DISABLED)

    def _leave(self, how: How, then: State, meanwhile: State) -> None:
        self._axis.stop(how)
        self._leaving = then
        self.state = meanwhile

    def _finish(self, state: State) -> None:
        self._axis.release()
        self._leaving = None
        self.state = state
