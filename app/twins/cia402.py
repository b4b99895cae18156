"""State machine of the axis (CiA 402 as the OAT manual prints it in 5.8, tables 49 to 53). Pure: no protocol, no plant.

Numbers T0 to T16 are those of table 50. Its figure is lost, so some readings are judgements; each is marked OPEN.
An action of a transition is carried out before the new status shows (manual, below table 50): switching off waits for
the brake, and the old state shows until then.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import Final, Protocol


class State(Enum):
    """States by their statusword bits (table 49)."""

    NOT_READY = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


class Command(Enum):
    """Commands of the controlword (table 52)."""

    DISABLE_VOLTAGE = "disable voltage"
    QUICK_STOP = "quick stop"
    SHUTDOWN = "shutdown"
    SWITCH_ON = "switch on or disable operation"
    ENABLE_OPERATION = "enable operation"


class Control(IntEnum):
    """Bits of the controlword 6040h (table 51)."""

    SWITCH_ON = 1 << 0
    ENABLE_VOLTAGE = 1 << 1
    QUICK_STOP = 1 << 2
    ENABLE_OPERATION = 1 << 3
    NEW_SET_POINT = 1 << 4
    FAULT_RESET = 1 << 7
    HALT = 1 << 8
    EFC = 1 << 11
    MIRRORED = 1 << 14


class Status(IntEnum):
    """Bits of the statusword 6041h beyond the state (table 53)."""

    OPERATION_ENABLED = 1 << 2
    VOLTAGE_ENABLED = 1 << 4
    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    INTERNAL_LIMIT = 1 << 11
    MODE_12 = 1 << 12
    MODE_13 = 1 << 13
    MIRRORED = 1 << 14


class Stop(Enum):
    """How an axis comes to rest."""

    RAMP = "profile deceleration"
    QUICK = "current limit"
    COAST = "stage off"


def command_of(controlword: int) -> Command:
    """The command in a controlword; bit 2 is 0 for quick stop."""
    if not controlword & Control.ENABLE_VOLTAGE:
        return Command.DISABLE_VOLTAGE
    if not controlword & Control.QUICK_STOP:
        return Command.QUICK_STOP
    if not controlword & Control.SWITCH_ON:
        return Command.SHUTDOWN
    if not controlword & Control.ENABLE_OPERATION:
        return Command.SWITCH_ON
    return Command.ENABLE_OPERATION


@dataclass(frozen=True, slots=True)
class Signals:
    """What the state machine looks at. ``command`` is None before the first one and while an EFC input controls.

    ``feather``: an EFC is asked for and can be driven. ``hit_0``, ``hit_90``: a limit switch has just been reached.
    """

    booted: bool
    enable_input: bool
    command: Command | None
    feather: bool = False
    hit_0: bool = False
    hit_90: bool = False
    fault: Stop | None = None
    reset: bool = False
    errors_gone: bool = True
    autostart: bool = True
    brake_time_ns: int = 0


class Axis(Protocol):
    """What the state machine commands."""

    @property
    def energised(self) -> bool:
        """The output stage is on."""

    @property
    def at_rest(self) -> bool:
        """A commanded stop has ended."""

    def switch_on(self) -> None:
        """Output stage on, brake lifted, set-points at the actual values."""

    def engage_brake(self) -> None:
        """Open the brake contact; control stays on."""

    def switch_off(self) -> None:
        """Output stage off."""

    def operate(self, feather: bool) -> None:
        """Follow set-points, or drive to feather."""

    def stop(self, how: Stop) -> None:
        """Come to rest."""

    def watchdog(self, closed: bool) -> None:
        """Set the watchdog contact."""


@dataclass(frozen=True, slots=True)
class _SwitchingOff:
    transition: int
    then: State
    due_ns: int


_OFF_COMMANDS: Final = (Command.DISABLE_VOLTAGE, Command.QUICK_STOP)
_MOST_TRANSITIONS: Final = 12


class StateMachine:
    """State of one axis. ``history`` holds the last transitions, by their numbers."""

    def __init__(self, axis: Axis) -> None:
        self._axis = axis
        self.state = State.NOT_READY
        self.history: deque[int] = deque(maxlen=64)
        self._switching_off: _SwitchingOff | None = None
        self._autostart_armed = True
        self._enable_is_new = True
        self._feathering = False
        self._disabling = False
        self._reaction: Stop | None = None
        self._rules = {
            State.NOT_READY: self._not_ready,
            State.SWITCH_ON_DISABLED: self._disabled,
            State.READY: self._ready,
            State.SWITCHED_ON: self._switched_on,
            State.OPERATION_ENABLED: self._operating,
            State.QUICK_STOP_ACTIVE: self._quick_stopping,
            State.FAULT_REACTION_ACTIVE: self._reacting,
            State.FAULT: self._fault,
        }

    @property
    def feathering(self) -> bool:
        """An EFC drive is being executed."""
        return self._feathering

    def reset(self) -> None:
        """T0: power-on or restart."""
        self.state = State.NOT_READY
        self.history.clear()
        self.history.append(0)
        self._switching_off = None
        self._autostart_armed = True
        self._enable_is_new = True
        self._feathering = self._disabling = False

    def evaluate(self, t_ns: int, signals: Signals) -> None:
        """Take all transitions that are due. Edges in ``signals`` count for the state in which they arrive."""
        if signals.command is not Command.ENABLE_OPERATION:
            self._enable_is_new = True
        if not signals.feather:
            self._feathering = False
        if signals.fault is not None and self.state not in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            self._enter_fault(signals.fault)
        for _ in range(_MOST_TRANSITIONS):
            before = self.state
            if self._switching_off is None:
                self._rules[self.state](t_ns, signals)
            if self._switching_off is not None:
                self._finish_switching_off(t_ns)
            if self.state is before:
                return

    # -- one rule for each state ---------------------------------------------------

    def _not_ready(self, _t_ns: int, signals: Signals) -> None:
        if signals.booted:
            self._axis.watchdog(True)
            self._go(1, State.SWITCH_ON_DISABLED)

    def _disabled(self, _t_ns: int, signals: Signals) -> None:
        if signals.feather:
            self._feather(16)
            return
        # T2 wants both: the enable input and the command; with autostart (60FBh/3 bit 0) no command after power-on.
        autostart = signals.autostart and self._autostart_armed
        if signals.enable_input and (signals.command is Command.SHUTDOWN or autostart):
            self._autostart_armed = False
            self._go(2, State.READY)

    def _ready(self, _t_ns: int, signals: Signals) -> None:
        if signals.feather:
            self._switch_on()
        elif not signals.enable_input or signals.command in _OFF_COMMANDS:
            self._go(7, State.SWITCH_ON_DISABLED)
        elif signals.command in (Command.SWITCH_ON, Command.ENABLE_OPERATION):
            self._switch_on()

    def _switched_on(self, t_ns: int, signals: Signals) -> None:
        if signals.feather:
            self._feather(4)
        elif not signals.enable_input or signals.command in _OFF_COMMANDS or signals.hit_0:
            self._switch_off(10, State.SWITCH_ON_DISABLED, t_ns, signals)
        elif signals.command is Command.SHUTDOWN:
            self._switch_off(6, State.READY, t_ns, signals)
        elif signals.command is Command.ENABLE_OPERATION and self._enable_is_new:
            self._axis.operate(False)
            self._go(4, State.OPERATION_ENABLED)

    def _operating(self, t_ns: int, signals: Signals) -> None:
        if signals.hit_90:
            self._disable_operation()
        elif signals.feather:
            if not self._feathering:
                self._feathering, self._disabling = True, False
                self._axis.operate(True)
        elif not signals.enable_input or signals.command is Command.DISABLE_VOLTAGE:
            self._switch_off(9, State.SWITCH_ON_DISABLED, t_ns, signals)
        elif signals.hit_0 or signals.command is Command.QUICK_STOP:
            self._axis.stop(Stop.QUICK)
            self._go(11, State.QUICK_STOP_ACTIVE)
        elif signals.command is Command.SHUTDOWN:
            self._switch_off(8, State.READY, t_ns, signals)
        elif signals.command is Command.SWITCH_ON and not self._disabling:
            self._disable_operation()
        if self._disabling and self._switching_off is None and self._axis.at_rest:
            self._go(5, State.SWITCHED_ON)

    def _quick_stopping(self, t_ns: int, signals: Signals) -> None:
        if signals.feather:
            self._feather(16)
        elif self._axis.at_rest or not signals.enable_input or signals.command is Command.DISABLE_VOLTAGE:
            self._switch_off(12, State.SWITCH_ON_DISABLED, t_ns, signals)

    def _reacting(self, t_ns: int, signals: Signals) -> None:
        if self._reaction is Stop.COAST or self._axis.at_rest or not self._axis.energised:
            self._switch_off(14, State.FAULT, t_ns, signals)

    def _fault(self, _t_ns: int, signals: Signals) -> None:
        # OPEN how the two events of T15 join; either is enough, for an EFC runs with an error pending too.
        if signals.feather or (signals.reset and signals.errors_gone):
            self._axis.watchdog(True)
            self._go(15, State.SWITCH_ON_DISABLED)

    # -- actions -------------------------------------------------------------------

    def _go(self, transition: int, state: State) -> None:
        self.history.append(transition)
        self.state = state
        self._disabling = False

    def _switch_on(self) -> None:
        self._axis.switch_on()
        self._enable_is_new = True
        self._go(3, State.SWITCHED_ON)

    def _feather(self, transition: int) -> None:
        """T4 or T16 with an EFC: straight to an axis that drives to feather.

        OPEN from where T16 leads; taken from every state out of which no other transition brings the blade to feather.
        """
        if not self._axis.energised:
            self._axis.switch_on()
        self._feathering = True
        self._axis.operate(True)
        self._go(transition, State.OPERATION_ENABLED)

    def _disable_operation(self) -> None:
        """T5: stop by the ramp; the new state shows when the axis stands.

        OPEN what a standing "enable" does after the 90 degree switch; it counts only when given anew.
        """
        self._axis.stop(Stop.RAMP)
        self._enable_is_new = False
        self._feathering = False
        self._disabling = True

    def _switch_off(self, transition: int, then: State, t_ns: int, signals: Signals) -> None:
        """Let the brake engage, switch off after its time, only then show the new state."""
        self._axis.engage_brake()
        wait_ns = signals.brake_time_ns if self._axis.energised else 0
        self._switching_off = _SwitchingOff(transition, then, t_ns + wait_ns)

    def _finish_switching_off(self, t_ns: int) -> None:
        ending = self._switching_off
        if ending is not None and t_ns >= ending.due_ns:
            self._switching_off = None
            self._feathering = False
            self._axis.switch_off()
            self._go(ending.transition, ending.then)

    def _enter_fault(self, reaction: Stop) -> None:
        """T13: watchdog contact open, reaction by the error."""
        self._switching_off = None
        self._feathering = False
        self._reaction = reaction
        self._axis.watchdog(False)
        if reaction is Stop.COAST:
            self._axis.engage_brake()
            self._axis.switch_off()
        else:
            self._axis.stop(reaction)
        self._go(13, State.FAULT_REACTION_ACTIVE)
