"""One blade's supply: mains, DC link, chopper, booster, battery of blocs, 24 V, temperatures. SI units.

No protocol and no clock. What is fast runs in cycles of 1 ms in ``supply_kernel``; ``prepare`` hands it commands and
slow values, ``settle`` takes over what it counted: charge and age of the blocs, temperatures, swing of the mains. The
slow part rests on the number of cycles alone, so that it is the same however time is cut into calls.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from math import exp, pi, sin
from random import Random
from typing import Final

from app.twins import supply_kernel as k
from app.twins.axis_kernel import COPPER_J, INVERTER_J
from app.twins.plant_battery import BLOCS, Bloc, in_series_ohm, in_series_v, open_circuit_v
from app.twins.plant_mains import Mains
from app.twins.plant_thermal import Losses, ThermalPlant

__all__ = ["BLOCS", "Bloc", "PowerCommands", "PowerConstants", "PowerPlant", "Stage", "open_circuit_v"]

STATE_LENGTH: Final = 160
"""Places of the state and of the parameters, those of the axis included."""
_SLOW_CYCLES: Final = 100
"""Slow values move on every 100 ms."""


class Stage(Enum):
    """Power stages of the PMM."""

    CHARGER = "charger"
    BOOSTER = "booster"
    CHOPPER = "chopper"


@dataclass(frozen=True, slots=True)
class PowerConstants:
    """What the supply is made of."""

    mains_v: float = 400.0
    """Three-phase mains (manual, 30FAh: 560 V DC link from it)."""
    mains_swing_v: float = 3.0
    mains_period_s: float = 47.0
    """Slow swing of a turbine's auxiliary supply (estimate)."""
    line_ohm: float = 0.5
    """Of two lines, slip rings and rectifier in series: 2 % of the voltage at rated power (estimate, usual layout)."""
    capacity_f: float = 0.003
    """DC link capacitor of a 9 kW drive (typical, 330 uF per kW)."""
    idle_load_w: float = 30.0
    """Electronics and discharge resistors on the DC link (estimate: 20 kOhm take 16 W at 565 V)."""
    lockout_v: float = 100.0
    """Where the electronics' converters stop (typical: a fifth of the nominal DC link)."""
    adapter_efficiency: float = 0.85
    """Of the 24 V adapter (typical for 50 W)."""
    charger_efficiency: float = 0.90
    """Of the charger's two stages (typical for 250 W)."""
    chopper_ohm: float = 100.0
    """Brake resistor: 4.5 kW at 670 V for short, 300 W for ever (estimate; manual, 30B1h: 100 % = 300 W)."""
    booster_efficiency: float = 0.93
    """From 240 V to 600 V at some kW (typical for a hard-switched booster)."""
    booster_loop_s: float = 0.02
    """Time constant of its voltage controller (estimate; 30FBh/1 and /2 have no printed unit)."""
    battery_ohm: float = 0.150
    """All blocs, new (manual, 3020h/8)."""
    lead_ohm: float = 0.100
    """Battery leads (manual, 3020h/7)."""
    polarisation_share: float = 0.4
    """Slow part of the internal resistance, of the quick one (typical for lithium ion)."""
    polarisation_s: float = 20.0
    """Its time constant (typical for lithium ion: 10 to 60 s)."""
    bloc_capacity_as: float = 3.0 * 3600
    """3000 mAh (manual, 3020h/2)."""
    supply_v: float = 24.3
    supply_ohm: float = 0.1
    """Internal 24 V supply and what it gives way by (estimate)."""
    supply_a: float = 0.85
    """Own consumption without the brake (estimate, below the 1 A of 30C0h)."""
    brake_a: float = 0.75
    """Coil of the lifted holding brake (estimate: 18 W at 24 V)."""
    fan_a: float = 0.06
    """Each fan that runs (estimate: 1.5 W)."""
    diode_v: float = 0.7
    """Between the external 24 V and the rail (manual, 4.2.3.1)."""
    iron_loss_share: float = 0.03
    """Of what passes the inverter, lost in the motor beside its windings (typical for its class)."""
    ambient_swing_c: float = 0.4
    ambient_period_s: float = 900.0
    """Slow change of the temperature in the hub (estimate)."""


@dataclass(slots=True)
class PowerCommands:
    """What the controllers of the PMM have decided. Thresholds in V and A; the kernel acts on them in its cycle."""

    enabled: bool = True
    """The unit works: booster and charger may."""
    mains_failed: bool = False
    booster_on: bool = False
    """By command or for a test, whatever the mains does."""
    booster_start_v: float = 420.0
    booster_target_v: float = 600.0
    booster_limit_a: float = 90.0
    battery_least_v: float = 162.0
    chopper_on: bool = False
    """For a test, whatever the voltage is."""
    chopper_on_v: float = 670.0
    chopper_off_v: float = 650.0
    charge_a: float = 0.0
    """Charge current into the battery."""


@dataclass(slots=True)
class PowerPlant:
    """State of one supply. ``seed`` makes the units differ, always in the same way.

    ``s`` and ``p`` are the vectors of ``supply_kernel``; a blade shares them with its axis.
    """

    seed: int = 0
    constants: PowerConstants = field(default_factory=PowerConstants)
    s: list[float] = field(default_factory=lambda: [0.0] * STATE_LENGTH, repr=False)
    p: list[float] = field(default_factory=lambda: [0.0] * STATE_LENGTH, repr=False)
    ambient_c: float = 22.0
    commands: PowerCommands = field(default_factory=PowerCommands)
    brake_lifted: bool = False
    extra_load_w: float = 0.0
    """What else is drawn from the DC link; negative: fed into it."""
    external_v: float | None = None
    """External 24 V feed-in at its clamp; None: not fitted."""
    extra_supply_a: float = 0.0
    """What else hangs on the 24 V."""
    supply_drop_v: float = 0.0
    """What is wrong with the internal 24 V."""
    shorted: set[Stage] = field(default_factory=set)
    """Power stages whose fault output reports a short circuit."""
    blocs_silent: bool = False
    """The interface to the blocs tells nothing."""
    blocs: list[Bloc] = field(default_factory=list)
    mains: Mains = field(init=False)
    thermal: ThermalPlant = field(default_factory=ThermalPlant)
    _phase: float = 0.0
    _slow_cycle: float = 0.0
    _booked: tuple[float, ...] = (0.0,) * 6
    _phases_seen: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Begin warm and charged, slightly different for each seed."""
        random = Random(self.seed)
        constants = self.constants
        self._phase = random.uniform(0.0, 2 * pi)
        self.ambient_c += random.uniform(-1.5, 1.5)
        charge = random.uniform(0.955, 0.985)
        self.blocs = [
            Bloc(charge + random.uniform(-0.004, 0.004), random.uniform(-0.03, 0.03), 0.0, random.uniform(1.0, 2.6))
            for _ in range(BLOCS)
        ]
        ohm = constants.battery_ohm * random.uniform(1.0, 1.08)
        thermal = self.thermal
        thermal.box_c = thermal.heat_sink_c = self.ambient_c
        for bloc in self.blocs:
            bloc.temperature_c = self.ambient_c + bloc.warmer_c
            bloc.new_ohm, bloc.capacity_as = ohm / BLOCS, constants.bloc_capacity_as
        thermal.heat_sink_c += thermal.constants.heat_sink_k_per_w * constants.idle_load_w
        thermal.motor_c = self.ambient_c + random.uniform(0.0, 2.0)
        thermal.places_warmer_c = [random.uniform(2.0, 5.0), random.uniform(1.0, 3.0)]
        thermal.places_c = [self.ambient_c + warmer_c for warmer_c in thermal.places_warmer_c]
        self.mains = Mains(constants.mains_v)
        self._swing()
        self.dc_link_v = self.mains.peak_v
        self.reset_lowest()
        self._write_constants()
        self._write_battery()

    # -- motion -----------------------------------------------------------------------

    def step(self, dt_s: float) -> None:
        """Move the supply alone on by whole cycles."""
        self.prepare()
        for _ in range(round(dt_s / k.DT_S)):
            k.supply_cycle(self.s, self.p)
        self.settle()

    def prepare(self) -> None:
        """Hand commands and slow values to the kernel, before it runs."""
        p, commands = self.p, self.commands
        p[k.MAINS_PEAK_V] = self.mains.peak_v
        if self.mains.phases != self._phases_seen:
            self._phases_seen = list(self.mains.phases)
            p[k.LINE_TABLE : k.LINE_TABLE + k.TABLE_LENGTH] = self.mains.table()
        p[k.SUPPLY_W] = self.adapter_w
        p[k.ELECTRONICS_W] = self.constants.idle_load_w + self.extra_load_w
        p[k.UNIT_ON] = float(commands.enabled)
        p[k.MAINS_FAILED] = float(commands.mains_failed)
        p[k.BOOSTER_FORCED] = float(commands.booster_on)
        p[k.BOOSTER_START_V] = commands.booster_start_v
        p[k.BOOSTER_TARGET_V] = commands.booster_target_v
        p[k.BOOSTER_LIMIT_A] = commands.booster_limit_a
        p[k.BATTERY_LEAST_V] = commands.battery_least_v
        p[k.CHOPPER_FORCED] = float(commands.chopper_on)
        p[k.CHOPPER_ON_V] = commands.chopper_on_v
        p[k.CHOPPER_OFF_V] = commands.chopper_off_v
        p[k.CHARGE_A] = commands.charge_a
        if self.shorted:
            self._block(self.shorted)

    def _block(self, stages: set[Stage]) -> None:
        """A power stage that reports a short circuit switches no more."""
        p = self.p
        if Stage.BOOSTER in stages:
            p[k.BOOSTER_FORCED] = self.s[k.BOOSTER_ON] = 0.0
            p[k.BOOSTER_START_V] = -1.0
        if Stage.CHOPPER in stages:
            p[k.CHOPPER_FORCED] = self.s[k.CHOPPER_ON] = 0.0
            p[k.CHOPPER_ON_V] = 1e9
        if Stage.CHARGER in stages:
            p[k.CHARGE_A] = 0.0

    def settle(self) -> None:
        """Take over what the kernel counted, after it ran; the slow part moves on every 100 ms."""
        cycle = self.s[k.CYCLE]
        if cycle - self._slow_cycle >= _SLOW_CYCLES:
            dt_s = (cycle - self._slow_cycle) * k.DT_S
            self._slow_cycle = cycle
            self._settle_slow(dt_s)

    def _settle_slow(self, dt_s: float) -> None:
        s, constants, blocs = self.s, self.constants, self.blocs
        booked = (
            s[k.DISCHARGED_AS] - s[k.CHARGED_AS],
            s[k.BATTERY_A2S],
            s[COPPER_J],
            s[INVERTER_J],
            s[k.TURNOVER_J],
            s[k.BOOSTER_LOSS_J],
        )
        flowed_as, square_a2s, copper_j, inverter_j, turnover_j, booster_j = (
            now - before for now, before in zip(booked, self._booked, strict=True)
        )
        self._booked = booked
        losses = Losses(
            heat_sink_w=constants.idle_load_w + (inverter_j + booster_j) / dt_s,
            motor_w=(copper_j + constants.iron_loss_share * turnover_j) / dt_s,
            blocs_w=[square_a2s * bloc.ohm * (1 + constants.polarisation_share) / dt_s for bloc in blocs],
        )
        for bloc in blocs:
            bloc.flow(flowed_as, dt_s)
        self.thermal.step(dt_s, self.hub_c, losses, blocs)
        self._swing()
        self._write_battery()

    def _swing(self) -> None:
        constants = self.constants
        self.mains.swing_v = constants.mains_swing_v * sin(
            (2 * pi) * self.age_s / constants.mains_period_s + self._phase
        )

    def _write_constants(self) -> None:
        p, constants = self.p, self.constants
        p[k.RECTIFIER_SHARE] = 1.0 - exp(-k.DT_S / (constants.line_ohm * constants.capacity_f))
        p[k.CAPACITY_F] = constants.capacity_f
        p[k.LOCKOUT_V] = constants.lockout_v
        p[k.CHOPPER_OHM] = constants.chopper_ohm
        p[k.BOOSTER_EFFICIENCY] = constants.booster_efficiency
        p[k.BOOSTER_LOOP_S] = constants.booster_loop_s
        p[k.CHARGER_EFFICIENCY] = constants.charger_efficiency
        p[k.POLARISATION_SHARE] = k.DT_S / constants.polarisation_s

    def _write_battery(self) -> None:
        p = self.p
        ohm = self.battery_ohm
        p[k.OPEN_CIRCUIT_V] = self.open_circuit_v
        p[k.BATTERY_OHM] = ohm + self.constants.lead_ohm
        p[k.POLARISATION_OHM] = ohm * self.constants.polarisation_share

    # -- values: time, mains, DC link ---------------------------------------------------

    @property
    def age_s(self) -> float:
        """Time that the supply has run."""
        return self.s[k.CYCLE] * k.DT_S

    @property
    def mains_present(self) -> bool:
        """The mains is there at all."""
        return self.mains.present

    @mains_present.setter
    def mains_present(self, present: bool) -> None:
        self.mains.present = present

    @property
    def mains_factor(self) -> float:
        """The mains against its nominal voltage."""
        return self.mains.factor

    @mains_factor.setter
    def mains_factor(self, factor: float) -> None:
        self.mains.factor = factor

    @property
    def phases(self) -> list[float]:
        """Share of each phase, 1.0 sound, 0.0 lost."""
        return self.mains.phases

    @phases.setter
    def phases(self, phases: list[float]) -> None:
        self.mains.phases = phases

    @property
    def mains_now_v(self) -> float:
        """Mains voltage, phase to phase, the highest of the three."""
        return self.mains.highest_v

    @property
    def dc_link_v(self) -> float:
        """Voltage of the DC link."""
        return self.s[k.DC_LINK_V]

    @dc_link_v.setter
    def dc_link_v(self, voltage: float) -> None:
        self.s[k.DC_LINK_V] = voltage

    @property
    def mains_a(self) -> float:
        """Current that the rectifier gives."""
        return self.s[k.MAINS_A]

    @property
    def motor_power_w(self) -> float:
        """What the inverter takes from the DC link; negative: it feeds back."""
        return self.s[k.MOTOR_DC_W]

    @motor_power_w.setter
    def motor_power_w(self, power_w: float) -> None:
        self.s[k.MOTOR_DC_W] = power_w

    @property
    def chopper_on(self) -> bool:
        """The brake resistor is on the DC link."""
        return self.s[k.CHOPPER_ON] != 0.0

    @property
    def chopper_w(self) -> float:
        """What it burns."""
        return self.s[k.CHOPPER_W]

    @property
    def booster_on(self) -> bool:
        """The booster works."""
        return self.s[k.BOOSTER_ON] != 0.0

    @property
    def booster_a(self) -> float:
        """Its output current."""
        return self.s[k.BOOSTER_A]

    @property
    def booster_limited(self) -> bool:
        """Its current limit or the least battery voltage keeps it from giving what is wanted."""
        return self.s[k.BOOSTER_GOVERNOR] != 0.0

    @property
    def booster_current_limited(self) -> bool:
        """It is its current limit that does so."""
        return self.s[k.BOOSTER_GOVERNOR] == 1.0

    def stop_booster(self) -> None:
        """Off at once, not only with the next cycle."""
        self.s[k.BOOSTER_ON] = self.s[k.BOOSTER_GOVERNOR] = self.s[k.BOOSTER_A] = 0.0

    # -- values: battery -------------------------------------------------------------------

    @property
    def open_circuit_v(self) -> float:
        """Battery voltage without load."""
        return in_series_v(self.blocs)

    @property
    def battery_ohm(self) -> float:
        """Internal resistance of all blocs, as it has become."""
        return in_series_ohm(self.blocs)

    @property
    def battery_a(self) -> float:
        """Battery current; positive discharges."""
        return self.s[k.BATTERY_A]

    @property
    def battery_v(self) -> float:
        """Voltage at the battery clamps."""
        drop_v = self.battery_a * self.p[k.BATTERY_OHM]
        return self.open_circuit_v - self.s[k.POLARISATION_V] - drop_v

    @property
    def lowest_battery_v(self) -> float:
        """The lowest since ``reset_lowest``."""
        return min(self.s[k.LOWEST_BATTERY_V], self.battery_v)

    def reset_lowest(self) -> None:
        """Begin to look for the lowest battery voltage."""
        self.s[k.LOWEST_BATTERY_V] = 1e9

    @property
    def charge(self) -> float:
        """Mean state of charge, 0..1."""
        return sum(bloc.charge for bloc in self.blocs) / len(self.blocs)

    def bloc_v(self, number: int) -> float:
        """Voltage of a bloc, counted from 0, at its own clamps."""
        bloc = self.blocs[number]
        slow_v = self.s[k.POLARISATION_V] / len(self.blocs)
        return max(bloc.rest_v - slow_v - self.battery_a * bloc.ohm, 0.0)

    # -- values: 24 V -----------------------------------------------------------------------

    @property
    def supply_v(self) -> float:
        """The 24 V rail: an external feed-in less its diode, else the internal supply."""
        constants = self.constants
        if self.external_v is not None:
            return self.external_v - constants.diode_v
        return constants.supply_v - self.supply_drop_v - constants.supply_ohm * self.supply_a

    @property
    def supply_a(self) -> float:
        """Current out of the 24 V supply, own consumption included."""
        constants = self.constants
        brake_a = constants.brake_a if self.brake_lifted else 0.0
        return constants.supply_a + brake_a + constants.fan_a * self.thermal.fans + self.extra_supply_a

    @property
    def adapter_w(self) -> float:
        """Input of the internal 24 V adapter; it rests while the rail is fed from outside."""
        if self.external_v is not None:
            return 0.0
        return self.supply_v * self.supply_a / self.constants.adapter_efficiency

    # -- values: temperatures ------------------------------------------------------------------

    @property
    def hub_c(self) -> float:
        """Air temperature in the hub."""
        constants = self.constants
        return self.ambient_c + constants.ambient_swing_c * sin(
            (2 * pi) * self.age_s / constants.ambient_period_s + self._phase
        )

    @property
    def heat_sink_c(self) -> float:
        """Temperature of the heat sink."""
        return self.thermal.heat_sink_c

    @heat_sink_c.setter
    def heat_sink_c(self, temperature_c: float) -> None:
        self.thermal.heat_sink_c = temperature_c

    @property
    def motor_c(self) -> float:
        """Temperature of the motor's windings."""
        return self.thermal.motor_c

    @motor_c.setter
    def motor_c(self, temperature_c: float) -> None:
        self.thermal.motor_c = temperature_c

    @property
    def extra_heat_sink_w(self) -> float:
        """Heat put into the heat sink from outside."""
        return self.thermal.extra_heat_sink_w

    @extra_heat_sink_w.setter
    def extra_heat_sink_w(self, power_w: float) -> None:
        self.thermal.extra_heat_sink_w = power_w

    @property
    def extra_motor_w(self) -> float:
        """The same for the motor."""
        return self.thermal.extra_motor_w

    @extra_motor_w.setter
    def extra_motor_w(self, power_w: float) -> None:
        self.thermal.extra_motor_w = power_w

    @property
    def extra_battery_w(self) -> float:
        """The same for the blocs together."""
        return self.thermal.extra_battery_w

    @extra_battery_w.setter
    def extra_battery_w(self, power_w: float) -> None:
        self.thermal.extra_battery_w = power_w

    def sensor_c(self, number: int) -> float:
        """Temperature at an external sensor, counted from 0."""
        return self.thermal.places_c[number]
