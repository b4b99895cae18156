"""Mains, DC link, booster, chopper and 24 V of the PMM: what it watches, decides and shows (manual, 4.2, 4.4, 4.5)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Final

from app.model.datatypes import Raw
from app.twins import supply_kernel
from app.twins.canopen_device import MS, SECOND
from app.twins.object_store import Guard, ObjectStore, RefusedAccessError
from app.twins.plant_power import PowerPlant, Stage
from app.twins.pmm_errors import PmmErrors
from app.wire.sdo import Abort

MAINS_HIGH, MAINS_LOW, PHASE_FAILED = 0x3110, 0x3120, 0x3130
DC_LINK_HIGH, DC_LINK_LOW = 0x3211, 0x3220
BOOSTER_SHORT, CHOPPER_SHORT = 0x2260, 0x5420
SUPPLY_OVERLOAD, SUPPLY_LOW, SUPPLY_HIGH = 0x2210, 0x5112, 0x5100

_MAINS_LOW_SHARE: Final = 0.8
_MAINS_HIGH_SHARE: Final = 1.15
"""Of the nominal mains. OPEN: 3120h and 3110h have no printed threshold. 320 V still gives 450 V of DC link, above the
booster's start; 460 V gives 650 V, where the chopper would begin to burn the mains."""
_PHASE_SHARE: Final = 0.75
"""OPEN when a phase counts as lost (3130h): one line voltage below this share of the highest. With a phase open the
others float at half of it; an uneven mains stays within some percent."""
_BOOSTER_START_NS: Final = 10 * SECOND
"""Table 17, bit 2."""
BATTERY_LEAST_SHARE: Final = 0.75
"""OPEN: the battery voltage below which the booster may not draw it is not printed; 27 V of a bloc's nominal 36 V are
2.7 V a cell, at which lithium ion takes no harm yet."""
_CHOPPER_FULL_W: Final = 300.0
"""100 % of 30B1h (4.5.2.1)."""
_CHOPPER_MEAN_S: Final = 10.0
"""Time over which its utilisation is averaged (estimate: so long a resistor of that size takes to warm up)."""
_SUPPLY_MOST_MA: Final = 8000
_SUPPLY_LOW_MV: Final = 18000
_SUPPLY_HIGH_MV: Final = 28000
"""Table 15, bits 4 to 6."""
_ORDER: Final = ((0x30FA, 3), (0x30FB, 8), (0x30FA, 1), (0x30FB, 7), (0x30FC, 2), (0x30FC, 1), (0x30FA, 2))
"""Table 19: voltages of the DC link from the lowest to the highest."""


class PmmSupply:
    """``test_loads`` tells whether a battery test draws on booster and chopper. ``tick`` moves it on."""

    def __init__(
        self, store: ObjectStore, power: PowerPlant, errors: PmmErrors, test_loads: Callable[[], bool]
    ) -> None:
        self._store = store
        self._power = power
        self._errors = errors
        self._test_loads = test_loads
        self._now_ns = self._boost_until_ns = 0
        self._failed_since_ns: int | None = None
        self._chopper_mean_w = self._chopper_j = 0.0
        # Looked at in every tick: what it costs to find them counts.
        self._most_v, self._least_v = store.cell(0x30FA, 2), store.cell(0x30FA, 3)
        self._limit_a, self._target_v, self._start_v = (store.cell(0x30FB, sub) for sub in (3, 7, 8))
        self._chopper_on_v, self._chopper_off_v = store.cell(0x30FC, 1), store.cell(0x30FC, 2)
        self._blocs, self._bloc_mv = store.cell(0x3020, 4), store.cell(0x3020, 5)
        for low, high in pairwise(_ORDER):
            store.cell(*high).guard = _all_of(store.cell(*high).guard, _above(store, *low))
            store.cell(*low).guard = _all_of(store.cell(*low).guard, _below(store, *high))

    # -- the unit comes and goes -----------------------------------------------------------

    def end(self, t_ns: int) -> None:
        """The unit controls nothing: it boots, or has no supply."""
        self._now_ns = self._boost_until_ns = t_ns
        self._failed_since_ns = None
        self._chopper_mean_w = 0.0
        commands = self._power.commands
        commands.enabled = commands.mains_failed = commands.booster_on = commands.chopper_on = False

    def begin(self, t_ns: int) -> None:
        """It works by itself from now on."""
        self._now_ns = t_ns
        self._chopper_j = self._power.s[supply_kernel.CHOPPER_J]
        self._power.commands.enabled = True
        self.tick(t_ns)

    def tick(self, t_ns: int) -> None:
        """Watch the mains, hand thresholds and commands to the power stages, watch voltages."""
        dt_s = (t_ns - self._now_ns) / SECOND
        self._now_ns = t_ns
        self._watch_mains()
        self._command()
        self._average(dt_s)
        self._watch_voltages()

    def boost(self, on: bool) -> None:
        """Controlword bit 2: the booster runs for 10 s, or ends early (table 17)."""
        self._boost_until_ns = self._now_ns + _BOOSTER_START_NS if on else self._now_ns
        self._command()
        if not self._power.commands.booster_on and not self.failed:
            self._power.stop_booster()

    # -- mains and timers --------------------------------------------------------------------

    @property
    def mains_back(self) -> bool:
        """The mains is high enough to live on."""
        return self._power.mains_now_v >= self._power.constants.mains_v * _MAINS_LOW_SHARE

    @property
    def failed(self) -> bool:
        """The mains has failed."""
        return self._failed_since_ns is not None

    @property
    def hold_up_ms(self) -> int:
        """30B2h: what is left of 30E0h until the emergency mode."""
        return self._left_ms(self._store.number(0x30E0))

    @property
    def power_down_ms(self) -> int:
        """What is left of 30E1h until the unit switches itself off; 30B3h shows it in seconds."""
        return self._left_ms(self._store.number(0x30E1) * 1000)

    def _left_ms(self, most_ms: int) -> int:
        """OPEN what is shown with the mains present, and when it returns: the full time, at once."""
        if self._failed_since_ns is None:
            return most_ms
        return max(0, most_ms - (self._now_ns - self._failed_since_ns) // MS)

    def _watch_mains(self) -> None:
        """Both timers begin with the failure.

        OPEN whether a poor mains is an error; it is a warning, since the unit goes on with its battery, or with what
        two phases give. The highest line voltage counts: the DC link lives on it, so a lost phase is no failure.
        """
        power, errors = self._power, self._errors
        line_v = power.mains.line_v
        highest_v, nominal_v = max(line_v), power.constants.mains_v
        failed = highest_v < nominal_v * _MAINS_LOW_SHARE
        if not failed:
            self._failed_since_ns = None
        elif self._failed_since_ns is None:
            self._failed_since_ns = self._now_ns
        errors.warning(MAINS_LOW, failed)
        errors.warning(MAINS_HIGH, highest_v > nominal_v * _MAINS_HIGH_SHARE)
        errors.warning(PHASE_FAILED, not failed and min(line_v) < _PHASE_SHARE * highest_v)

    # -- power stages ------------------------------------------------------------------------

    def _command(self) -> None:
        """Thresholds of 30FBh and 30FCh; the stages themselves act on them within a cycle."""
        commands = self._power.commands
        commands.mains_failed = self._failed_since_ns is not None
        commands.booster_start_v = self._start_v.number
        commands.booster_target_v = self._target_v.number
        commands.booster_limit_a = self._limit_a.number
        commands.battery_least_v = BATTERY_LEAST_SHARE * self._bloc_mv.number / 1000 * self._blocs.number
        commands.chopper_on_v = self._chopper_on_v.number
        commands.chopper_off_v = self._chopper_off_v.number
        commands.chopper_on = self._test_loads()
        commands.booster_on = commands.chopper_on or self._now_ns < self._boost_until_ns

    def _average(self, dt_s: float) -> None:
        burnt_j = self._power.s[supply_kernel.CHOPPER_J] - self._chopper_j
        if dt_s > 0:
            self._chopper_mean_w += (burnt_j / dt_s - self._chopper_mean_w) * min(1.0, dt_s / _CHOPPER_MEAN_S)
            self._chopper_j += burnt_j

    def _watch_voltages(self) -> None:
        power, errors = self._power, self._errors
        dc_link_v, supply_mv, supply_ma = power.dc_link_v, power.supply_v * 1000, power.supply_a * 1000
        errors.error(DC_LINK_LOW, dc_link_v < self._least_v.number)
        errors.error(DC_LINK_HIGH, dc_link_v > self._most_v.number)
        errors.error(BOOSTER_SHORT, Stage.BOOSTER in power.shorted)
        errors.error(CHOPPER_SHORT, Stage.CHOPPER in power.shorted)
        errors.error(SUPPLY_OVERLOAD, supply_ma > _SUPPLY_MOST_MA)
        errors.error(SUPPLY_LOW, supply_mv < _SUPPLY_LOW_MV)
        errors.error(SUPPLY_HIGH, supply_mv > _SUPPLY_HIGH_MV)

    # -- objects -----------------------------------------------------------------------------

    @property
    def mains_bits(self) -> int:
        """Bits 4 to 7 of 3000h (table 11)."""
        warnings = self._errors.warnings
        return (
            (self.failed and self.power_down_ms > 0) << 4
            | self.failed << 5
            | (MAINS_HIGH in warnings) << 6
            | (PHASE_FAILED in warnings) << 7
        )

    def sources(self) -> dict[int, Callable[[], Raw]]:
        """Live objects by index."""
        power = self._power
        return {
            0x3002: self._booster_status,
            0x3003: self._chopper_status,
            0x3004: self._supply_status,
            0x3062: lambda: round(power.mains_now_v),
            0x3063: lambda: round(power.dc_link_v),
            0x3065: lambda: round(power.supply_v * 1000),
            0x3066: lambda: round((power.external_v or 0.0) * 1000),
            0x3073: lambda: round(power.booster_a),
            0x3075: self._supply_ma,
            0x30B0: self._booster_percent,
            0x30B1: lambda: min(100, round(self._chopper_mean_w / _CHOPPER_FULL_W * 100)),
            0x30B2: lambda: self.hold_up_ms,
            0x30B3: lambda: -(-self.power_down_ms // 1000),
        }

    def _booster_status(self) -> int:
        """3002h (table 13).

        OPEN what "threshold voltage" of bit 3 is: a voltage governs the booster, be it the target that it holds or the
        least battery voltage; bit 2 where the current limit does.
        """
        power, pending = self._power, self._errors.pending
        short, over_voltage = BOOSTER_SHORT in pending, DC_LINK_HIGH in pending
        at_current = power.booster_on and power.booster_current_limited
        at_voltage = power.booster_on and not at_current
        status = power.booster_on << 1 | at_current << 2 | at_voltage << 3 | short << 4 | over_voltage << 5
        return status | (not short and not over_voltage)

    def _booster_percent(self) -> int:
        """30B0h: share of the time for which the switch of a step-up converter is on, 1 - U_battery / U_DC-link."""
        power = self._power
        if not power.booster_on or power.booster_a == 0.0 or power.dc_link_v <= power.battery_v:
            return 0
        return min(round(100 * (1 - power.battery_v / power.dc_link_v)), self._store.number(0x30FB, 6))

    def _chopper_status(self) -> int:
        """3003h (table 14)."""
        short = CHOPPER_SHORT in self._errors.pending
        return (not short) | self._power.chopper_on << 1 | short << 4

    def _supply_status(self) -> int:
        """3004h (table 15)."""
        pending = self._errors.pending
        faults = sum(
            (code in pending) << bit for bit, code in ((4, SUPPLY_OVERLOAD), (5, SUPPLY_LOW), (6, SUPPLY_HIGH))
        )
        external = self._power.external_v is not None
        return (not faults) | external << 1 | (self._supply_ma() > self._store.number(0x30C0)) << 2 | faults

    def _supply_ma(self) -> int:
        return round(self._power.supply_a * 1000)


def _all_of(first: Guard | None, second: Guard) -> Guard:
    def look(raw: Raw) -> None:
        if first is not None:
            first(raw)
        second(raw)

    return look


def _above(store: ObjectStore, index: int, sub: int) -> Guard:
    """OPEN what a value out of the order of table 19 does. The limits refuse it; here also one that is equal."""

    def look(raw: Raw) -> None:
        if isinstance(raw, int) and raw <= store.number(index, sub):
            raise RefusedAccessError(Abort.VALUE_TOO_LOW)

    return look


def _below(store: ObjectStore, index: int, sub: int) -> Guard:
    def look(raw: Raw) -> None:
        if isinstance(raw, int) and raw >= store.number(index, sub):
            raise RefusedAccessError(Abort.VALUE_TOO_HIGH)

    return look
