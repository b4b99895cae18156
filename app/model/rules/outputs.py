"""Masks of the PMM: who drives which output, and which input raises which alarm (manual 4.7, 4.8)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Final

from app.model.rules.look import Found, Look, Object, make_rule, pmm
from app.model.rules.rule import Rule, Severity
from app.model.rules.units import SCALING, units_per_turn

OUTPUT_MASKS: Final = (
    *(pmm(f"{index}:0{sub}") for index in ("3201", "3202", "3203") for sub in (4, 5, 6)),
    *map(pmm, ("3204:03", "3220:03", "30FF:01", "30FF:02")),
)
"""Every function that can be given outputs, by the same table (35)."""
CLAMPS: Final = (
    "X14.1",
    "X14.2",
    "X14.3",
    "X14.4",
    "X14.5",
    "X14.6",
    "X16.1/X16.2",
    "X16.3/X16.4",
    "X13.1",
    "X13.2",
    "X13.3",
    "X13.4",
)
"""Outputs by their bit; bits 12 to 15 have no clamp (table 35)."""
CONTROLLER_MASK: Final = pmm("30FE:02")
FAULT_OUTPUT: Final = pmm("30FF:01")
ALARMS: Final = tuple(pmm(f"3300:0{number}") for number in range(1, 9))
INPUTS: Final = {0: "X13.10", 2: "X13.8", 3: "X13.7", 4: "X13.6"} | {
    bit: f"X14.{clamp}" for bit, clamp in zip(range(8, 13), (12, 11, 10, 9, 8), strict=True)
}
"""Inputs by their bit; the other ones of bits 0 to 13 are always 0 (table 36)."""
ALARM_INPUTS: Final = 0x3FFF
CHECK_PULSE: Final = pmm("30E2")
TEST_PULSE_MS: Final = 40
"""For so long the turbine controller may pull an input to 0 to check its wire."""
RANGE: Final = (pmm("3220:01"), pmm("3220:02"))
RANGE_MASK: Final = pmm("3220:03")
UNITS_PER_TURN: Final = 36000
"""The PMM compares hundredths of a degree."""


def _shared(look: Look) -> Iterator[Found]:
    known = [(one, raw) for one in OUTPUT_MASKS if (raw := look.maybe(one)) is not None]
    for (first, a), (second, b) in combinations(known, 2):
        if clamps := _clamps(a & b):
            yield Found((first, second), {"first": first.address, "second": second.address, "clamps": clamps})


def _also_controller(look: Look) -> Iterator[Found]:
    (given,) = look(CONTROLLER_MASK)
    for one in OUTPUT_MASKS:
        raw = look.maybe(one)
        if raw is not None and (clamps := _clamps(raw & given)):
            yield Found((CONTROLLER_MASK, one), {"object": one.address, "clamps": clamps})


def _no_clamp(look: Look) -> Iterator[Found]:
    for one in OUTPUT_MASKS:
        raw = look.maybe(one)
        if raw is not None and raw >> len(CLAMPS):
            yield Found((one,), {"object": one.address, "mask": f"{raw & 0xFFFF:04X}h"})


def _clamps(mask: int) -> str:
    return ", ".join(name for bit, name in enumerate(CLAMPS) if mask >> bit & 1)


def _fault_output(look: Look) -> Iterator[Found]:
    (mask,) = look(FAULT_OUTPUT)
    if mask == 0:
        yield Found((FAULT_OUTPUT,))


def _alarms(look: Look) -> Iterator[tuple[Object, int, int]]:
    """Each alarm that is known and set up: object, mask, and the bits of its inputs."""
    for one in ALARMS:
        raw = look.maybe(one)
        if raw:
            yield one, raw, raw & ALARM_INPUTS


def _alarm_without_input(look: Look) -> Iterator[Found]:
    for one, raw, inputs in _alarms(look):
        if not any(inputs >> bit & 1 for bit in INPUTS):
            yield Found((one,), {"object": one.address, "mask": f"{raw & 0xFFFF:04X}h"})


def _alarm_of_several(look: Look) -> Iterator[Found]:
    for one, _raw, inputs in _alarms(look):
        clamps = [clamp for bit, clamp in INPUTS.items() if inputs >> bit & 1]
        if len(clamps) > 1:
            yield Found((one,), {"object": one.address, "clamps": ", ".join(clamps)})


def _alarms_shared(look: Look) -> Iterator[Found]:
    for (first, _, a), (second, _, b) in combinations(list(_alarms(look)), 2):
        clamps = [clamp for bit, clamp in INPUTS.items() if a & b & 1 << bit]
        if clamps:
            details = {"first": first.address, "second": second.address, "clamps": ", ".join(clamps)}
            yield Found((first, second), details)


def _check_pulse(look: Look) -> Iterator[Found]:
    (pulse_ms,) = look(CHECK_PULSE)
    if pulse_ms <= TEST_PULSE_MS:
        yield Found((CHECK_PULSE,), {"pulse_ms": pulse_ms, "test_ms": TEST_PULSE_MS})


def _range(look: Look) -> Iterator[Found]:
    lower, upper = look(*RANGE)
    if lower >= upper:
        yield Found(RANGE, {"lower_deg": lower / 100, "upper_deg": upper / 100})


def _range_unit(look: Look) -> Iterator[Found]:
    (mask,) = look(RANGE_MASK)
    if mask == 0:
        return
    turn = units_per_turn(look)
    if turn is not None and turn != UNITS_PER_TURN:
        yield Found((RANGE_MASK, *RANGE), {"turn": round(float(turn), 2), "expected": UNITS_PER_TURN})


RULES: Final[tuple[Rule, ...]] = (
    make_rule("oat.outputs_shared", "4.7.1.4", Severity.WARNING, OUTPUT_MASKS, _shared),
    make_rule(
        "oat.outputs_of_controller", "4.7.1.4", Severity.ERROR, (CONTROLLER_MASK, *OUTPUT_MASKS), _also_controller
    ),
    make_rule("oat.outputs_without_clamp", "4.7.1.4", Severity.WARNING, OUTPUT_MASKS, _no_clamp),
    make_rule("oat.fault_output", "4.7.2.1", Severity.NOTE, (FAULT_OUTPUT,), _fault_output),
    make_rule("oat.alarm_without_input", "4.7.3.1", Severity.WARNING, ALARMS, _alarm_without_input),
    make_rule("oat.alarm_of_several_inputs", "4.7.3.1", Severity.NOTE, ALARMS, _alarm_of_several),
    make_rule("oat.alarms_shared", "4.7.3.1", Severity.NOTE, ALARMS, _alarms_shared),
    make_rule("oat.input_check_pulse", "4.7.1.3", Severity.NOTE, (CHECK_PULSE,), _check_pulse),
    # Stepwise: an order of two.
    make_rule("oat.position_range", "4.8.1.1", Severity.ERROR, RANGE, _range, stepwise=True),
    make_rule("oat.position_range_unit", "4.8.1.1", Severity.WARNING, (RANGE_MASK, *RANGE, *SCALING), _range_unit),
)
