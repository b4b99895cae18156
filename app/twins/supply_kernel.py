"""One cycle of 1 ms of a blade's supply: rectifier, DC link, booster, chopper, battery clamps. SI units.

Written so that it runs as it stands and compiled, with equal bits: floats in flat sequences, ``math.sqrt`` and the four
operations, no objects (``plant_kernel`` compiles it). ``s`` is the state, ``p`` holds parameters and commands; both are
numbered by the constants below (places 80 to 159 of each are the supply's). ``PowerPlant`` is its face.

The DC link is an energy balance, E = C V^2 / 2: motor, chopper, 24 V adapter, charger and electronics take from it,
rectifier and booster give. Every joule that moves is booked in a meter, so that the books can be audited.
"""

from __future__ import annotations

from math import sqrt
from typing import Final

DT_S: Final = 0.001
"""Length of a cycle."""

# -- state, shared with the axis -----------------------------------------------------
MOTOR_DC_W: Final = 0
"""What the inverter takes from the DC link; negative: it feeds back."""
DC_LINK_V: Final = 1

# -- state of the supply ---------------------------------------------------------------
CYCLE: Final = 80
"""Cycles since the beginning."""
BOOSTER_ON: Final = 81
"""1.0 while the booster works."""
BOOSTER_GOVERNOR: Final = 82
"""What governs the booster: 0.0 its output voltage, 1.0 its current limit, 2.0 the least battery voltage."""
CHOPPER_ON: Final = 83
BATTERY_A: Final = 84
"""Positive: discharge."""
BATTERY_V: Final = 85
"""At the clamps."""
POLARISATION_V: Final = 86
"""Voltage over the RC member of the battery; positive while it is discharged."""
BOOSTER_A: Final = 87
"""Output current, on the DC link's side."""
CHOPPER_W: Final = 88
MAINS_A: Final = 89
"""Current out of the rectifier."""
LOWEST_BATTERY_V: Final = 90
"""Since somebody last set it (the battery test does)."""
IDLE_W: Final = 91
"""Electronics on the DC link."""
ADAPTER_W: Final = 92
"""Input of the 24 V adapter: from the DC link, in a mains failure from the battery."""
BOOSTER_W: Final = 93
"""Into the DC link."""
CHARGER_W: Final = 94
"""Out of the DC link."""

# Meters, in joule, except the two of charge, in ampere seconds. They only rise, except those of what may flow back.
MAINS_J: Final = 100
"""From the mains, at the rectifier's source voltage."""
LINE_LOSS_J: Final = 101
BATTERY_J: Final = 102
"""From the open-circuit voltage; falls while charging."""
BATTERY_LOSS_J: Final = 103
"""In internal and lead resistance and the RC member."""
BOOSTER_LOSS_J: Final = 104
CHARGER_LOSS_J: Final = 105
CHOPPER_J: Final = 106
IDLE_J: Final = 107
ADAPTER_J: Final = 108
INVERTER_IN_J: Final = 109
"""Into the inverter; falls while it feeds back."""
MISSING_J: Final = 110
"""Asked of an empty DC link and not given."""
DISCHARGED_AS: Final = 111
CHARGED_AS: Final = 112
TURNOVER_J: Final = 113
"""What has passed the inverter, either way: its losses rest on it."""
BATTERY_A2S: Final = 114
"""Square of the battery current over time: what warms the blocs."""

# -- parameters and commands -------------------------------------------------------------
MAINS_PEAK_V: Final = 80
"""Peak of the line voltage; 0 without mains."""
LINE_TABLE: Final = 81
"""20 places: highest rectified line voltage in each millisecond of a mains period, as a share of the peak."""
TABLE_LENGTH: Final = 20
RECTIFIER_SHARE: Final = 101
"""1 - exp(-DT_S / (R C)): share of the voltage difference that the capacitor makes up in a cycle."""
CAPACITY_F: Final = 102
ELECTRONICS_W: Final = 103
SUPPLY_W: Final = 104
"""What the 24 V adapter needs."""
CHOPPER_OHM: Final = 105
CHOPPER_ON_V: Final = 106
CHOPPER_OFF_V: Final = 107
CHOPPER_FORCED: Final = 108
MAINS_FAILED: Final = 109
"""The PMM's finding, not the mains itself."""
BOOSTER_FORCED: Final = 110
BOOSTER_START_V: Final = 111
BOOSTER_TARGET_V: Final = 112
BOOSTER_LIMIT_A: Final = 113
"""On the battery's side."""
BATTERY_LEAST_V: Final = 114
BOOSTER_EFFICIENCY: Final = 115
BOOSTER_LOOP_S: Final = 116
"""Time in which the booster's voltage controller makes up for a difference."""
OPEN_CIRCUIT_V: Final = 117
BATTERY_OHM: Final = 118
"""Internal resistance of all blocs and leads."""
POLARISATION_OHM: Final = 119
POLARISATION_SHARE: Final = 120
"""DT_S over the time constant of the RC member."""
CHARGE_A: Final = 121
CHARGER_EFFICIENCY: Final = 122
UNIT_ON: Final = 123
"""The PMM works: booster and charger may."""
LOCKOUT_V: Final = 124
"""Below it the electronics on the DC link fade out."""


def supply_cycle(s: list[float], p: list[float]) -> None:
    """Move the supply on by one cycle: decide, draw on the battery, balance the DC link, let the rectifier lift it."""
    feed_consumers(s, p)
    switch_chopper(s, p)
    battery_w = boost(s, p)
    load_battery(s, p, battery_w)
    balance(s, p)
    rectify(s, p)
    s[CYCLE] += 1.0


def feed_consumers(s: list[float], p: list[float]) -> None:
    """Electronics and 24 V adapter. An empty DC link gives nothing: below the lockout they fade out."""
    fade = 1.0
    if s[DC_LINK_V] < p[LOCKOUT_V]:
        fade = s[DC_LINK_V] / p[LOCKOUT_V]
        fade *= fade
    s[IDLE_W] = p[ELECTRONICS_W] * fade
    s[ADAPTER_W] = p[SUPPLY_W] * fade
    if p[MAINS_FAILED] != 0.0:
        s[ADAPTER_W] = p[SUPPLY_W] if p[UNIT_ON] != 0.0 else 0.0
    s[IDLE_J] += s[IDLE_W] * DT_S
    s[ADAPTER_J] += s[ADAPTER_W] * DT_S


def switch_chopper(s: list[float], p: list[float]) -> None:
    """On from the upper threshold, off below the lower one (manual, 4.5); what it burns is V^2 / R.

    It lives on the DC link and goes on without the unit's processor, as brake choppers do (estimate).
    """
    voltage = s[DC_LINK_V]
    if p[CHOPPER_FORCED] != 0.0 or voltage >= p[CHOPPER_ON_V]:
        s[CHOPPER_ON] = 1.0
    elif voltage < p[CHOPPER_OFF_V]:
        s[CHOPPER_ON] = 0.0
    s[CHOPPER_W] = voltage * voltage / p[CHOPPER_OHM] if s[CHOPPER_ON] != 0.0 else 0.0
    s[CHOPPER_J] += s[CHOPPER_W] * DT_S


def boost(s: list[float], p: list[float]) -> float:
    """Power that booster and 24 V adapter take at the battery's clamps, in W.

    The booster starts by itself in a mains failure from the starting voltage down, and stays until the mains is back
    (manual, 4.4). It gives what the DC link is drawn for and what it lacks to the target voltage, as far as current
    limit and least battery voltage allow: with U - i R at the clamps, most power is had at i = U / 2 R.
    """
    voltage = s[DC_LINK_V]
    failed = p[MAINS_FAILED] != 0.0
    s[BOOSTER_GOVERNOR] = s[BOOSTER_W] = s[BOOSTER_A] = 0.0
    if p[UNIT_ON] == 0.0:
        s[BOOSTER_ON] = 0.0
        return 0.0
    adapter_w = s[ADAPTER_W] if failed else 0.0
    starts = failed and (s[BOOSTER_ON] != 0.0 or voltage < p[BOOSTER_START_V])
    if p[BOOSTER_FORCED] == 0.0 and not starts:
        s[BOOSTER_ON] = 0.0
        return adapter_w
    s[BOOSTER_ON] = 1.0
    target_v = p[BOOSTER_TARGET_V]
    missing_j = 0.5 * p[CAPACITY_F] * (target_v * target_v - voltage * voltage)
    drawn_w = s[MOTOR_DC_W] + s[IDLE_W] + s[CHOPPER_W] + (0.0 if failed else s[ADAPTER_W])
    wanted_w = drawn_w + missing_j / p[BOOSTER_LOOP_S]
    if wanted_w <= 0.0:
        return adapter_w
    rest_v = p[OPEN_CIRCUIT_V] - s[POLARISATION_V]
    ohm = p[BATTERY_OHM]
    most_a = p[BOOSTER_LIMIT_A]
    governor = 1.0
    if (rest_v - p[BATTERY_LEAST_V]) / ohm < most_a:
        most_a = (rest_v - p[BATTERY_LEAST_V]) / ohm
        governor = 2.0
    if most_a > 0.5 * rest_v / ohm:
        most_a = 0.5 * rest_v / ohm
    most_w = most_a * (rest_v - most_a * ohm) - adapter_w if most_a > 0.0 else 0.0
    most_w = most_w * p[BOOSTER_EFFICIENCY] if most_w > 0.0 else 0.0
    if wanted_w > most_w:
        wanted_w = most_w
        s[BOOSTER_GOVERNOR] = governor
    s[BOOSTER_W] = wanted_w
    if voltage > 1.0:
        s[BOOSTER_A] = wanted_w / voltage
    taken_w = wanted_w / p[BOOSTER_EFFICIENCY]
    s[BOOSTER_LOSS_J] += (taken_w - wanted_w) * DT_S
    return adapter_w + taken_w


def load_battery(s: list[float], p: list[float], battery_w: float) -> None:
    """Battery current: from the power P = (U - i R) i that is taken, or what the charger drives into it.

    U is the open-circuit voltage less that of the RC member, which follows the current with its time constant.
    """
    rest_v = p[OPEN_CIRCUIT_V] - s[POLARISATION_V]
    ohm = p[BATTERY_OHM]
    current = s[CHARGER_W] = 0.0
    if battery_w > 0.0:
        inside = rest_v * rest_v - 4.0 * ohm * battery_w
        current = (rest_v - sqrt(inside if inside > 0.0 else 0.0)) / (2.0 * ohm)
    elif p[CHARGE_A] > 0.0 and p[MAINS_FAILED] == 0.0 and p[UNIT_ON] != 0.0:
        current = -p[CHARGE_A]
        s[CHARGER_W] = (rest_v - current * ohm) * p[CHARGE_A] / p[CHARGER_EFFICIENCY]
        s[CHARGER_LOSS_J] += s[CHARGER_W] * (1.0 - p[CHARGER_EFFICIENCY]) * DT_S
    s[BATTERY_A] = current
    s[BATTERY_V] = rest_v - current * ohm
    if s[BATTERY_V] < s[LOWEST_BATTERY_V]:
        s[LOWEST_BATTERY_V] = s[BATTERY_V]
    s[BATTERY_J] += p[OPEN_CIRCUIT_V] * current * DT_S
    s[BATTERY_LOSS_J] += current * (current * ohm + s[POLARISATION_V]) * DT_S
    s[POLARISATION_V] += (current * p[POLARISATION_OHM] - s[POLARISATION_V]) * p[POLARISATION_SHARE]
    s[BATTERY_A2S] += current * current * DT_S
    if current > 0.0:
        s[DISCHARGED_AS] += current * DT_S
    else:
        s[CHARGED_AS] -= current * DT_S


def balance(s: list[float], p: list[float]) -> None:
    """Energy of the DC link after what it gave and took."""
    taken_w = s[MOTOR_DC_W] + s[IDLE_W] + s[CHOPPER_W] + s[CHARGER_W] - s[BOOSTER_W]
    if p[MAINS_FAILED] == 0.0:
        taken_w += s[ADAPTER_W]
    energy_j = 0.5 * p[CAPACITY_F] * s[DC_LINK_V] * s[DC_LINK_V] - taken_w * DT_S
    if energy_j < 0.0:
        s[MISSING_J] -= energy_j
        energy_j = 0.0
    s[DC_LINK_V] = sqrt(2.0 * energy_j / p[CAPACITY_F])
    s[INVERTER_IN_J] += s[MOTOR_DC_W] * DT_S
    s[TURNOVER_J] += (s[MOTOR_DC_W] if s[MOTOR_DC_W] > 0.0 else -s[MOTOR_DC_W]) * DT_S


def rectify(s: list[float], p: list[float]) -> None:
    """Charge that the rectifier pushes through its line while the highest line voltage is above the DC link."""
    voltage = s[DC_LINK_V]
    source_v = p[MAINS_PEAK_V] * p[LINE_TABLE + int(s[CYCLE]) % TABLE_LENGTH]
    s[MAINS_A] = 0.0
    if source_v > voltage:
        rise_v = (source_v - voltage) * p[RECTIFIER_SHARE]
        moved_as = p[CAPACITY_F] * rise_v
        s[MAINS_A] = moved_as / DT_S
        s[MAINS_J] += source_v * moved_as
        s[LINE_LOSS_J] += moved_as * (source_v - voltage - 0.5 * rise_v)
        s[DC_LINK_V] = voltage + rise_v
