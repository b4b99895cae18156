"""Device state machine of one axis (ED2 manual, 4.2.2), with its transitions TR_0 to TR_12. Pure.

The manual's figure is not known: the pattern of the bits R M H D in each state is that of the profile DSP-408, where
the bits of the states below stay set. OPEN whether the ED2 sets only the bit of its state, as 4.8.3 can be read.
"""

from __future__ import annotations

from enum import Enum, IntFlag
from typing import Final


class Control(IntFlag):
    """Bits of the control word (4.8.2); those from 9 on mean what the control mode makes of them."""

    DISABLE = 1 << 0
    """Named after the state DISABLED: it is set while the axis runs."""
    HOLD = 1 << 1
    ACTIVE = 1 << 2
    RESET = 1 << 3
    POSITIVE = 1 << 9
    NEGATIVE = 1 << 10
    FORCE_SETPOINT = 1 << 10
    START = 1 << 13
    NEW_SETPOINT = 1 << 13
    RAPID = 1 << 13
    STOP = 1 << 14


class Status(IntFlag):
    """Bits of the status word (4.8.3)."""

    DISABLED = 1 << 0
    HOLD = 1 << 1
    ACTIVE = 1 << 2
    READY = 1 << 3
    LOCAL = 1 << 4
    WARNING = 1 << 5
    LIMIT_TOUCHED = 1 << 10
    CONTROL_ERROR = 1 << 11
    TARGET_REACHED = 1 << 12
    ACKNOWLEDGE = 1 << 13


class State(Enum):
    """States; the value is bits 0 to 3 of the status word."""

    NOT_READY = 0x0
    INIT = 0x8
    DISABLED = 0x9
    HOLD = 0xB
    DEVICE_MODE_ACTIVE = 0xF
    FAULT_HOLD = 0x3
    FAULT = 0x1
    FAULT_REACTION = 0x7


class Reaction(Enum):
    """What an error does (4.8.1)."""

    FAULT = "ed2_fault"
    FAULT_HOLD = "ed2_fault_hold"


CLOSED_LOOP: Final = frozenset({State.HOLD, State.DEVICE_MODE_ACTIVE, State.FAULT_HOLD, State.FAULT_REACTION})
FAULTY: Final = frozenset({State.FAULT, State.FAULT_HOLD, State.FAULT_REACTION})
ADJUSTABLE: Final = frozenset({State.INIT, State.DISABLED})
"""Here modes may be chosen (5.2)."""
_RUN: Final = Control.DISABLE | Control.HOLD | Control.ACTIVE


class States:
    """The state of one axis; a step is one transition at most."""

    def __init__(self) -> None:
        self.state = State.NOT_READY
        self._reaction = Reaction.FAULT
        self._word = 0

    def power_on(self) -> None:
        """TR_0: the self test begins."""
        self.state = State.NOT_READY
        self._word = 0

    def booted(self) -> None:
        """TR_1: parameters are as they were saved."""
        self.state = State.INIT

    def fail(self, reaction: Reaction) -> None:
        """TR_8: an error. A worse reaction overtakes the one that runs.

        An axis that is not held does not begin to be held by an error: then it ends in FAULT (OPEN).
        """
        if self.state is State.NOT_READY or self.state is State.FAULT:
            return
        holds = reaction is Reaction.FAULT_HOLD and self.state in CLOSED_LOOP
        if self.state in FAULTY:
            holds = holds and self._reaction is Reaction.FAULT_HOLD
            if holds:
                return
        self._reaction = Reaction.FAULT_HOLD if holds else Reaction.FAULT
        self.state = State.FAULT_REACTION

    @property
    def holding(self) -> bool:
        """The reaction that runs, or has ended, keeps the axis in its closed loop."""
        return self._reaction is Reaction.FAULT_HOLD

    def step(self, word: int, *, at_rest: bool, may_run: bool, causes_gone: bool) -> None:
        """Obey the control word. ``may_run``: what HOLD and DEVICE_MODE_ACTIVE need beyond the word is there."""
        rising, self._word = word & ~self._word, word
        if self.state is State.FAULT_REACTION:
            if at_rest:
                self.state = State.FAULT_HOLD if self.holding else State.FAULT  # TR_9, TR_12
        elif self.state in FAULTY:
            if rising & Control.RESET and causes_gone:
                self._reset(word)
        elif self.state is not State.NOT_READY:
            self._obey(word, may_run)

    def _reset(self, word: int) -> None:
        """TR_10 and TR_11. OPEN what FAULT does while the hold bit is set; here it stays, for nothing is held."""
        if not word & Control.HOLD:
            self.state = State.DISABLED
        elif self.state is State.FAULT_HOLD:
            self.state = State.HOLD

    def _obey(self, word: int, may_run: bool) -> None:
        wanted = word & _RUN
        if self.state is State.INIT:
            if wanted & Control.DISABLE:
                self.state = State.DISABLED  # TR_2
        elif self.state is State.DISABLED:
            if not wanted:
                self.state = State.INIT  # TR_7
            elif may_run and wanted & 0x3 == 0x3:
                self.state = State.HOLD  # TR_3
        elif not may_run:
            self.state = State.DISABLED
        elif self.state is State.HOLD:
            if not wanted & (Control.HOLD | Control.ACTIVE):
                self.state = State.DISABLED  # TR_6
            elif wanted == _RUN:
                self.state = State.DEVICE_MODE_ACTIVE  # TR_4
        elif not wanted & Control.ACTIVE:
            self.state = State.HOLD  # TR_5
