"""The battery: its blocs, its test, what its state is judged by (manual 4.3.1, 4.3.2)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.model.rules.look import Found, Look, make_rule, pmm
from app.model.rules.rule import Rule, Severity

BATTERY_TYPE: Final = pmm("3020:01")
NOMINAL_BLOC: Final = pmm("3020:05")
MAXIMUM_BLOC: Final = pmm("3020:06")
INTERNAL_RESISTANCE: Final = pmm("3020:08")
TEST_CYCLE: Final = pmm("30E3")
LITHIUM_ION_1: Final = 0xA1
SHORTEST_TEST_CYCLE_MIN: Final = 60


def _type(look: Look) -> Iterator[Found]:
    (code,) = look(BATTERY_TYPE)
    if code != LITHIUM_ION_1:
        yield Found((BATTERY_TYPE,), {"type": f"{code:02X}h"})


def _blocs(look: Look) -> Iterator[Found]:
    nominal_mv, maximum_mv = look(NOMINAL_BLOC, MAXIMUM_BLOC)
    if nominal_mv >= maximum_mv:
        details = {"nominal_v": nominal_mv / 1000, "maximum_v": maximum_mv / 1000}
        yield Found((NOMINAL_BLOC, MAXIMUM_BLOC), details)


def _resistance(look: Look) -> Iterator[Found]:
    (resistance_mohm,) = look(INTERNAL_RESISTANCE)
    if resistance_mohm <= 0:
        yield Found((INTERNAL_RESISTANCE,))


def _test_cycle(look: Look) -> Iterator[Found]:
    (cycle_min,) = look(TEST_CYCLE)
    if 0 < cycle_min < SHORTEST_TEST_CYCLE_MIN:
        yield Found((TEST_CYCLE,), {"cycle_min": cycle_min, "shortest_min": SHORTEST_TEST_CYCLE_MIN})


def _test_off(look: Look) -> Iterator[Found]:
    (cycle_min,) = look(TEST_CYCLE)
    if cycle_min == 0:
        yield Found((TEST_CYCLE,))


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.battery_type", "4.3.1.1", Severity.WARNING, (BATTERY_TYPE,), _type),
    # Stepwise: an order of two.
    make_rule("oat.bloc_voltages", "4.3.1.1", Severity.ERROR, (NOMINAL_BLOC, MAXIMUM_BLOC), _blocs, stepwise=True),
    make_rule("oat.battery_resistance", "4.3.1.1", Severity.WARNING, (INTERNAL_RESISTANCE,), _resistance),
    make_rule("oat.self_test_time", "4.3.2.15", Severity.ERROR, (TEST_CYCLE,), _test_cycle),
    make_rule("oat.self_test_off", "4.3.2.15", Severity.NOTE, (TEST_CYCLE,), _test_off),
)
