"""Physics of the supply alone: rectifier, DC link, chopper, booster, battery, 24 V; and its books."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.twins import supply_kernel as k
from app.twins.plant_kernel import run_compiled
from app.twins.plant_power import PowerPlant

Cycles = Callable[[PowerPlant, int], None]


def plain(power: PowerPlant, cycles: int) -> None:
    for _ in range(cycles):
        k.supply_cycle(power.s, power.p)


def _ignore(_: int) -> None:
    """The number of cycles run is known."""


def drive(power: PowerPlant, cycles: Cycles) -> list[list[float]]:
    """20 s with a mains failure, a lost phase, booster and chopper; the state every 100 ms."""
    states = []
    for tenth in range(200):
        power.mains_present = not 20 <= tenth < 120
        power.phases[1] = 0.0 if tenth >= 160 else 1.0
        power.commands.mains_failed = 20 <= tenth < 121
        power.commands.charge_a = 1.0 if tenth < 15 else 0.0
        power.motor_power_w = (6000.0, -7000.0, 0.0, 48000.0)[tenth // 5 % 4]
        power.prepare()
        cycles(power, 100)
        power.settle()
        states.append(list(power.s))
    return states


def test_compiled_and_plain_cycles_are_equal_to_the_last_bit() -> None:
    run = run_compiled()
    compiled = drive(PowerPlant(seed=2), lambda power, cycles: _ignore(run(power.s, power.p, cycles)))
    states = drive(PowerPlant(seed=2), plain)
    assert compiled == states
    assert {state[k.BOOSTER_GOVERNOR] for state in states} == {0.0, 1.0}
    assert any(state[k.CHOPPER_ON] for state in states)
