"""The charger: voltage, thresholds and currents that fit the battery (manual 4.3.3); the 24 V supply (4.2.3)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.model.rules.look import Found, Look, make_rule, pmm
from app.model.rules.rule import Rule, Severity

CAPACITY: Final = pmm("3020:02")
CHARGING_CURRENT: Final = pmm("3020:03")
BLOCS: Final = pmm("3020:04")
MAXIMUM_BLOC: Final = pmm("3020:06")
SUPPLY_LIMIT: Final = pmm("30F0:03")
CHARGING_VOLTAGE: Final = pmm("30F1:04")
RECHARGE: Final = pmm("30F1:05")
SWITCH_OFF: Final = pmm("30F1:06")
SUPPLY_WARNING: Final = pmm("30C0")
SUPPLY_ERROR_MA: Final = 8000
"""Above it the 24 V supply reports an overload, 2210h (manual, table 15)."""
SWITCH_OFF_RANGE: Final = (0.05, 0.2)
"""Of the capacity: "about" a tenth, within a factor of two."""
_CHARGING: Final = (CHARGING_VOLTAGE, BLOCS, MAXIMUM_BLOC)


def _charging_voltage(look: Look) -> Iterator[Found]:
    voltage_v, blocs, bloc_mv = look(*_CHARGING)
    if voltage_v * 1000 > blocs * bloc_mv:
        yield _charging(voltage_v, blocs, bloc_mv)


def _charging_voltage_low(look: Look) -> Iterator[Found]:
    """A whole volt less is no more than rounding."""
    voltage_v, blocs, bloc_mv = look(*_CHARGING)
    if voltage_v * 1000 <= blocs * bloc_mv - 1000:
        yield _charging(voltage_v, blocs, bloc_mv)


def _charging(voltage_v: int, blocs: int, bloc_mv: int) -> Found:
    details = {
        "voltage_v": voltage_v,
        "blocs": blocs,
        "bloc_v": bloc_mv / 1000,
        "expected_v": blocs * bloc_mv / 1000,
    }
    return Found(_CHARGING, details)


def _recharge(look: Look) -> Iterator[Found]:
    threshold_v, voltage_v = look(RECHARGE, CHARGING_VOLTAGE)
    if threshold_v >= voltage_v:
        yield Found((RECHARGE, CHARGING_VOLTAGE), {"threshold_v": threshold_v, "voltage_v": voltage_v})


def _switch_off(look: Look) -> Iterator[Found]:
    current_ma, capacity_mah = look(SWITCH_OFF, CAPACITY)
    low, high = (share * capacity_mah for share in SWITCH_OFF_RANGE)
    if not low <= current_ma <= high:
        details = {"current_ma": current_ma, "capacity_mah": capacity_mah, "expected_ma": round(capacity_mah / 10)}
        yield Found((SWITCH_OFF, CAPACITY), details)


def _ends_at_once(look: Look) -> Iterator[Found]:
    off_ma, charging_ma = look(SWITCH_OFF, CHARGING_CURRENT)
    if off_ma >= charging_ma:
        yield Found((SWITCH_OFF, CHARGING_CURRENT), {"off_ma": off_ma, "charging_ma": charging_ma})


def _beyond_supply(look: Look) -> Iterator[Found]:
    charging_ma, limit_ma = look(CHARGING_CURRENT, SUPPLY_LIMIT)
    if charging_ma >= limit_ma:
        yield Found((CHARGING_CURRENT, SUPPLY_LIMIT), {"charging_ma": charging_ma, "limit_ma": limit_ma})


def _supply_warning(look: Look) -> Iterator[Found]:
    (warning_ma,) = look(SUPPLY_WARNING)
    if not 0 < warning_ma < SUPPLY_ERROR_MA:
        yield Found((SUPPLY_WARNING,), {"warning_ma": warning_ma, "error_ma": SUPPLY_ERROR_MA})


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.charging_voltage", "4.3.3.2", Severity.ERROR, _CHARGING, _charging_voltage),
    make_rule("oat.charging_voltage_low", "4.3.3.2", Severity.NOTE, _CHARGING, _charging_voltage_low),
    # Stepwise: an order of two. Else the charger would begin anew with every end of a charge.
    make_rule(
        "oat.recharge_threshold", "4.3.3.2", Severity.ERROR, (RECHARGE, CHARGING_VOLTAGE), _recharge, stepwise=True
    ),
    make_rule("oat.switch_off_current", "4.3.3.2", Severity.WARNING, (SWITCH_OFF, CAPACITY), _switch_off),
    make_rule("oat.charge_ends_at_once", "4.3.3.2", Severity.ERROR, (SWITCH_OFF, CHARGING_CURRENT), _ends_at_once),
    make_rule(
        "oat.charging_current_beyond_supply",
        "4.3.3.1",
        Severity.WARNING,
        (CHARGING_CURRENT, SUPPLY_LIMIT),
        _beyond_supply,
    ),
    make_rule("oat.supply_warning", "4.2.3.4", Severity.WARNING, (SUPPLY_WARNING,), _supply_warning),
)
