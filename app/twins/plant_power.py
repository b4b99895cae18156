"""Physics of one blade's supply: mains, DC link, chopper, booster, battery of blocs, 24 V, temperatures. SI units.

No protocol and no clock: ``step`` moves it on by ``dt_s``. A plain model; what a controller decides (booster, charger,
chopper) is set from outside.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import exp, pi, sin, sqrt
from random import Random
from typing import Final

BLOCS: Final = 6
"""Battery blocs in series (manual, 3020h/4)."""


@dataclass(frozen=True, slots=True)
class PowerConstants:
    """What the supply is made of."""

    mains_v: float = 400.0
    """Three-phase mains (manual, 30FAh: 560 V DC link from it)."""
    mains_swing_v: float = 3.0
    mains_period_s: float = 47.0
    """Slow swing of a turbine's auxiliary supply (estimate)."""
    capacity_f: float = 0.003
    """DC link capacitor of a 9 kW drive (typical, 330 uF per kW)."""
    rectifier_s: float = 0.005
    """Time constant of charging the DC link from the mains: the capacitor over about 1.7 ohm of line and rectifier, so
    that a healthy mains holds the link within some 20 V while all of the motor's power is drawn (estimate)."""
    idle_load_w: float = 60.0
    """Electronics and 24 V adapters (estimate)."""
    chopper_ohm: float = 100.0
    """Brake resistor: 4.5 kW at 670 V for short (estimate)."""
    bloc_capacity_as: float = 3.0 * 3600
    """3000 mAh (manual, 3020h/2)."""
    battery_ohm: float = 0.150
    """All blocs, new (manual, 3020h/8)."""
    lead_ohm: float = 0.100
    """Battery leads (manual, 3020h/7)."""
    supply_v: float = 24.3
    supply_a: float = 0.85
    """24 V output and own consumption without the brake (estimate, below the 1 A of 30C0h)."""
    brake_a: float = 0.75
    """Coil of the lifted holding brake (estimate)."""
    heat_sink_k_per_w: float = 0.08
    heat_sink_s: float = 400.0
    motor_k_per_w: float = 0.09
    motor_s: float = 1500.0
    """Thermal resistances and time constants (estimate)."""
    motor_loss_share: float = 0.13
    """Of the power the motor takes (efficiency 0.87, as in the axis' rated torque)."""
    ambient_swing_c: float = 0.4
    ambient_period_s: float = 900.0
    """Slow change of the temperature in the hub (estimate)."""
    battery_settle_s: float = 3600.0
    loss_share: float = 0.04
    """Losses of output stage and rectifier, of the power that passes (estimate)."""


_OPEN_CIRCUIT_V: Final = ((0.0, 31.0), (0.1, 34.2), (0.5, 36.4), (0.9, 39.4), (1.0, 41.0))
"""Bloc voltage without load over the state of charge; lithium, 36 V nominal, 41 V at most (manual, 3020h/5 and /6)."""


def open_circuit_v(charge: float) -> float:
    """Voltage of one bloc without load at a state of charge of 0..1."""
    for (low, low_v), (high, high_v) in pairwise(_OPEN_CIRCUIT_V):
        if charge <= high:
            return low_v + (max(charge, low) - low) / (high - low) * (high_v - low_v)
    return _OPEN_CIRCUIT_V[-1][1]


@dataclass(slots=True)
class Bloc:
    """One bloc of the battery: its state of charge and what is its own."""

    charge: float
    offset_v: float
    temperature_c: float
    warmer_c: float


@dataclass(slots=True)
class PowerCommands:
    """What the controllers of the PMM have decided."""

    booster_target_v: float | None = None
    """Voltage to which the booster regulates the DC link; None: off."""
    booster_limit_a: float = 90.0
    chopper_on: bool = False
    charge_a: float = 0.0
    """Charge current into the battery."""


@dataclass(slots=True)
class PowerPlant:
    """State of one supply. ``seed`` makes the units differ, always in the same way."""

    seed: int = 0
    constants: PowerConstants = field(default_factory=PowerConstants)
    mains_present: bool = True
    mains_factor: float = 1.0
    ambient_c: float = 22.0
    commands: PowerCommands = field(default_factory=PowerCommands)
    motor_power_w: float = 0.0
    brake_lifted: bool = False
    dc_link_v: float = 0.0
    battery_a: float = 0.0
    booster_a: float = 0.0
    booster_limited: bool = False
    chopper_w: float = 0.0
    heat_sink_c: float = 0.0
    motor_c: float = 0.0
    sensor_warmer_c: list[float] = field(default_factory=list)
    blocs: list[Bloc] = field(default_factory=list)
    battery_ohm: float = 0.0
    """Internal resistance of all blocs, as it has become."""
    _age_s: float = 0.0
    _phase: float = 0.0

    def __post_init__(self) -> None:
        """Begin warm and charged, slightly different for each seed."""
        random = Random(self.seed)
        self._phase = random.uniform(0.0, 2 * pi)
        self.ambient_c += random.uniform(-1.5, 1.5)
        charge = random.uniform(0.955, 0.985)
        self.blocs = [
            Bloc(charge + random.uniform(-0.004, 0.004), random.uniform(-0.03, 0.03), 0.0, random.uniform(1.0, 2.6))
            for _ in range(BLOCS)
        ]
        self.battery_ohm = self.constants.battery_ohm * random.uniform(1.0, 1.08)
        for bloc in self.blocs:
            bloc.temperature_c = self.ambient_c + bloc.warmer_c
        self.heat_sink_c = self.ambient_c + self.constants.heat_sink_k_per_w * self.constants.idle_load_w
        self.motor_c = self.ambient_c + random.uniform(0.0, 2.0)
        self.sensor_warmer_c = [random.uniform(2.0, 5.0), random.uniform(1.0, 3.0)]
        self.dc_link_v = self.mains_now_v * sqrt(2)

    # -- values -----------------------------------------------------------------------

    @property
    def mains_now_v(self) -> float:
        """Mains voltage, phase to phase."""
        if not self.mains_present:
            return 0.0
        constants = self.constants
        swing = constants.mains_swing_v * sin((2 * pi) * self._age_s / constants.mains_period_s + self._phase)
        return constants.mains_v * self.mains_factor + swing

    @property
    def open_circuit_v(self) -> float:
        """Battery voltage without load."""
        return sum(self._bloc_rest_v(bloc) for bloc in self.blocs)

    @property
    def battery_v(self) -> float:
        """Voltage at the battery clamps; positive current discharges."""
        return self.open_circuit_v - self.battery_a * (self.battery_ohm + self.constants.lead_ohm)

    @property
    def charge(self) -> float:
        """Mean state of charge, 0..1."""
        return sum(bloc.charge for bloc in self.blocs) / len(self.blocs)

    @property
    def supply_v(self) -> float:
        """24 V supply, internal."""
        return self.constants.supply_v - 0.1 * self.supply_a

    @property
    def supply_a(self) -> float:
        """Current out of the 24 V supply, own consumption included."""
        return self.constants.supply_a + (self.constants.brake_a if self.brake_lifted else 0.0)

    def bloc_v(self, number: int) -> float:
        """Voltage of a bloc, counted from 0."""
        drop = self.battery_a * self.battery_ohm / len(self.blocs)
        return self._bloc_rest_v(self.blocs[number]) - drop

    @property
    def hub_c(self) -> float:
        """Air temperature in the hub."""
        constants = self.constants
        return self.ambient_c + constants.ambient_swing_c * sin(
            (2 * pi) * self._age_s / constants.ambient_period_s + self._phase
        )

    def sensor_c(self, number: int) -> float:
        """Temperature at an external sensor, counted from 0."""
        return self.hub_c + self.sensor_warmer_c[number]

    # -- motion -----------------------------------------------------------------------

    def step(self, dt_s: float) -> None:
        """Move on by ``dt_s``."""
        self._age_s += dt_s
        self._step_dc_link(dt_s)
        self._step_battery(dt_s)
        self._step_heat(dt_s)

    @staticmethod
    def _bloc_rest_v(bloc: Bloc) -> float:
        return open_circuit_v(bloc.charge) + bloc.offset_v

    def _step_dc_link(self, dt_s: float) -> None:
        constants, commands = self.constants, self.commands
        voltage = self.dc_link_v
        self.chopper_w = voltage * voltage / constants.chopper_ohm if commands.chopper_on else 0.0
        power_w = -(constants.idle_load_w + self.motor_power_w + self.chopper_w)
        booster_w = self._booster_power_w(dt_s, -power_w)
        self.booster_a = booster_w / voltage if voltage > 1.0 else 0.0
        self.battery_a = booster_w / max(self.battery_v, 1.0) - (commands.charge_a if booster_w == 0.0 else 0.0)
        energy_j = 0.5 * constants.capacity_f * voltage * voltage + (power_w + booster_w) * dt_s
        voltage = sqrt(max(energy_j, 0.0) * 2 / constants.capacity_f)
        source_v = self.mains_now_v * sqrt(2)
        if voltage < source_v:
            voltage += (source_v - voltage) * (1 - exp(-dt_s / constants.rectifier_s))
        elif self.mains_present and self.motor_power_w >= 0 and not commands.booster_target_v:
            voltage += (source_v - voltage) * min(1.0, dt_s)  # what the swing of the mains left above
        self.dc_link_v = voltage

    def _booster_power_w(self, dt_s: float, load_w: float) -> float:
        target_v = self.commands.booster_target_v
        self.booster_limited = False
        if target_v is None:
            return 0.0
        missing_j = 0.5 * self.constants.capacity_f * (target_v**2 - self.dc_link_v**2)
        wanted_w = max(load_w + missing_j / max(dt_s, 0.02), 0.0)
        most_w = self.commands.booster_limit_a * max(self.battery_v, 0.0)
        self.booster_limited = wanted_w > most_w
        return min(wanted_w, most_w)

    def _step_battery(self, dt_s: float) -> None:
        change = self.battery_a * dt_s / self.constants.bloc_capacity_as
        for bloc in self.blocs:
            bloc.charge = min(max(bloc.charge - change, 0.0), 1.0)

    def _step_heat(self, dt_s: float) -> None:
        constants = self.constants
        loss_w = constants.idle_load_w + constants.loss_share * abs(self.motor_power_w)
        hub_c = self.hub_c
        heat_sink_c = hub_c + constants.heat_sink_k_per_w * loss_w
        self.heat_sink_c += (heat_sink_c - self.heat_sink_c) * dt_s / constants.heat_sink_s
        motor_loss_w = constants.motor_loss_share * max(self.motor_power_w, 0.0)
        motor_c = hub_c + 1.0 + constants.motor_k_per_w * motor_loss_w
        self.motor_c += (motor_c - self.motor_c) * dt_s / constants.motor_s
        for bloc in self.blocs:
            bloc.temperature_c += (hub_c + bloc.warmer_c - bloc.temperature_c) * dt_s / constants.battery_settle_s
