"""Inputs and outputs of the PMM: clamps, inputs of the safety chain, masks, alarms, position range (4.7, 4.8)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from app.twins.canopen_device import MS
from app.twins.object_store import ObjectStore
from app.twins.pmm_errors import PmmErrors
from app.twins.pmm_temperature import SensorState

EFC_INPUT, EFC_DIRECT_INPUT, THIRD_INPUT = 1 << 0, 1 << 2, 1 << 3
"""X13.10, X13.8 and X13.7: the inputs of the safety chain, 0 = feather."""
CHAIN_INPUTS: Final = EFC_INPUT | EFC_DIRECT_INPUT | THIRD_INPUT
SAFETY_RELAY: Final = 1 << 16
"""X13.11 and X13.12 in 30FEh/3: the PMM's contact in the safety chain."""
EXECUTE_NS: Final = 50 * MS
"""The chain's inputs act after this time at 0; up to 40 ms are a test of the wiring (4.7.1.3)."""
_CHAIN_BITS: Final = (0, 2, 3)
_FEEDBACK_SHIFT: Final = 16
_FEED_IN, _FEED_IN_SHOWN = 1 << 4, 1 << 20
_CLAMPS: Final = CHAIN_INPUTS | _FEED_IN | 0x0F00 | 1 << 12
"""Bits of table 34 that are clamps; all others but feedback, button and switch are always 0."""
_HEALTHY: Final = CHAIN_INPUTS | _FEED_IN | 1 << 9 | 1 << 12
_BUTTON_BIT, _SELECTOR_BIT = 27, 28
_ANALOG_STEP_MV: Final = 10000 / 1023
"""30A0h: 10 bits over 0 to 10 V."""
_ANALOG_MOST_MV: Final = 10000.0
_ALARM_INPUTS: Final = 0x3FFF
_ALARM_FAULT: Final = 1 << 14
_ALARM_HIGH: Final = 1 << 15
_OUTPUTS: Final = 0xFFFF
_LED_STATUS, _LED_FAULT, _LED_WATCHDOG, _LED_BUS = 1 << 24, 1 << 25, 1 << 26, 1 << 27


class PmmInputs:
    """Levels at the clamps as bits of 30FDh (table 34), and the sensors. ``now_ns`` is the line's time.

    Healthy: safety chain and 24 V feed-ins present, lightning protection in order.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._digital = _HEALTHY
        self._fell_ns: dict[int, int] = {}
        self._chain_closed = True
        self.analog_mv = 4900.0
        self.selector = 0
        """Selector switch for manual functions, 0..15."""
        self.key = False
        """Key button of the manual functions."""
        self.sensors = [SensorState.FITTED, SensorState.FITTED]

    @property
    def digital(self) -> int:
        """Levels at the clamps."""
        return self._digital

    @digital.setter
    def digital(self, levels: int) -> None:
        fallen = self._digital & ~levels
        self._digital = levels & _CLAMPS
        for bit in _CHAIN_BITS:
            if fallen >> bit & 1:
                self._fell_ns[bit] = self._now_ns()

    def chain(self, closed: bool) -> None:
        """The chain that feeds its three inputs has closed or opened; called again, it changes nothing."""
        if closed is not self._chain_closed:
            self._chain_closed = closed
            self.digital = self._digital | CHAIN_INPUTS if closed else self._digital & ~CHAIN_INPUTS

    def restart(self, t_ns: int) -> None:
        """The unit begins to look: what is at 0 counts from now on."""
        self._fell_ns = {bit: t_ns for bit in _CHAIN_BITS if not self._digital >> bit & 1}

    @property
    def feathers(self) -> bool:
        """An input of the chain has been at 0 for so long that the EFC is executed.

        OPEN what X13.7 does, and what is "direct" about X13.8: each of the three executes the EFC as X13.10 does.
        """
        if self._digital & CHAIN_INPUTS == CHAIN_INPUTS:
            return False
        now_ns = self._now_ns()
        low = (bit for bit in _CHAIN_BITS if not self._digital >> bit & 1)
        return any(now_ns - self._fell_ns.get(bit, now_ns) >= EXECUTE_NS for bit in low)

    @property
    def settled(self) -> int:
        """Levels without the test pulses: an input of the chain counts as 0 only once it acts."""
        now_ns = self._now_ns()
        levels = self._digital
        for bit in _CHAIN_BITS:
            if now_ns - self._fell_ns.get(bit, -EXECUTE_NS) < EXECUTE_NS:
                levels |= 1 << bit
        return levels

    def word(self, pulse_ms: int) -> int:
        """30FDh. ``pulse_ms``: 30E2h, for how long the fall of a chain input shows.

        OPEN the polarity of bits 16, 18 and 19: 1 where the input fell within that time, or still is at 0.
        """
        now_ns = self._now_ns()
        word = self._digital | (_FEED_IN_SHOWN if self._digital & _FEED_IN else 0)
        for bit in _CHAIN_BITS:
            recent = bit in self._fell_ns and now_ns - self._fell_ns[bit] < pulse_ms * MS
            if recent or not self._digital >> bit & 1:
                word |= 1 << bit + _FEEDBACK_SHIFT
        return word | self.key << _BUTTON_BIT | (self.selector & 0x0F) << _SELECTOR_BIT

    @property
    def analog_read_mv(self) -> int:
        """30A0h: 0 to 10 V in 1023 steps."""
        held_mv = min(max(self.analog_mv, 0.0), _ANALOG_MOST_MV)
        return round(round(held_mv / _ANALOG_STEP_MV) * _ANALOG_STEP_MV)


class PmmOutputs:
    """30FEh and the functions behind it: signalling outputs (30FFh), position range (3220h), the unit's own ones."""

    def __init__(self, store: ObjectStore, errors: PmmErrors) -> None:
        self._store = store
        self._errors = errors
        self._wanted, self._mask = store.cell(0x30FE, 1), store.cell(0x30FE, 2)

    def word(self, functions: int, position_cdeg: int | None, own: int) -> int:
        """30FEh/3. ``functions``: outputs that controllers set by their masks. ``own``: bits from 16 on.

        ``position_cdeg``: actual position of the axis; None: not known.
        """
        functions |= self._signals() | self._position_range(position_cdeg)
        mask = self._mask.number
        return (functions & ~mask | self._wanted.number & mask) & _OUTPUTS | own & ~_OUTPUTS

    def own(self, relay: bool, running: bool, operational: bool) -> int:
        """The safety relay with its watchdog LED, and the LEDs of status, fault and field bus."""
        own = SAFETY_RELAY | _LED_WATCHDOG if relay else 0
        own |= _LED_FAULT if self._errors.pending else 0
        own |= _LED_STATUS if running else 0
        return own | (_LED_BUS if operational else 0)

    def _signals(self) -> int:
        outputs = self._store.number(0x30FF, 1) if self._errors.pending else 0
        return outputs | (self._store.number(0x30FF, 2) if self._errors.warnings else 0)

    def _position_range(self, position_cdeg: int | None) -> int:
        """3220h. OPEN what an unknown position does; the output goes off, as it does beyond the limits."""
        store = self._store
        if position_cdeg is None or not store.number(0x3220, 1) < position_cdeg < store.number(0x3220, 2):
            return 0
        return store.number(0x3220, 3)


class AlarmInputs:
    """3300h/n: inputs that raise FFFnh (4.7.3)."""

    def __init__(self, store: ObjectStore, errors: PmmErrors) -> None:
        self._masks = tuple(store.cell(0x3300, number) for number in range(1, 9))
        self._errors = errors

    def watch(self, levels: int) -> None:
        """Look at the settled input levels. OPEN how several inputs of a mask join: one that alarms is enough."""
        for number, cell in enumerate(self._masks, 1):
            mask = cell.number
            alarming = levels if mask & _ALARM_HIGH else ~levels
            alarm = bool(alarming & mask & _ALARM_INPUTS)
            self._errors.error(0xFFF0 | number, alarm and bool(mask & _ALARM_FAULT))
            self._errors.warning(0xFFF0 | number, alarm and not mask & _ALARM_FAULT)
