"""Temperatures of a blade's supply: heat sink, motor, battery box with its blocs, two places with sensors. SI units.

Bodies with a heat capacity, joined by thermal conductances: C dT/dt = P - G (T - T of the surroundings). Explicit steps
of 0.1 s are small beside every time constant. Heaters, coolers and fans do what the outputs of the PMM say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from app.twins.plant_battery import Bloc


@dataclass(frozen=True, slots=True)
class ThermalConstants:
    """Estimates throughout, made from size and mass of what is common in a hub; each says its ground."""

    heat_sink_k_per_w: float = 0.08
    """An aluminium profile with forced air for some 10 kW."""
    heat_sink_j_per_k: float = 5000.0
    """5.5 kg of aluminium."""
    motor_k_per_w: float = 0.09
    """A 9 kW motor that loses 1.2 kW settles 110 K above the air."""
    motor_j_per_k: float = 16700.0
    """35 kg of iron and copper; time constant 25 minutes."""
    motor_fan_factor: float = 2.0
    """What an external fan makes of its conductance."""
    bloc_j_per_k: float = 750.0
    """108 Wh at 150 Wh/kg, 1000 J/(kg K)."""
    bloc_w_per_k: float = 0.2
    """Bloc to air in the box; time constant an hour."""
    box_j_per_k: float = 3000.0
    """Air, sheet and frame."""
    box_w_per_k: float = 1.5
    """A closed box of about half a square metre at 3 W/(m2 K)."""
    fan_factor: float = 3.0
    """What moving air makes of the conductance of the blocs."""
    wall_fan_factor: float = 1.3
    """The same for the walls of box and places, where the outer side stays still."""
    box_heater_w: float = 80.0
    box_cooler_w: float = 80.0
    """A small mat, a small thermoelectric cooler."""
    place_j_per_k: float = 4000.0
    place_w_per_k: float = 6.0
    """A small cabinet; time constant 11 minutes."""
    place_heater_w: float = 60.0
    place_cooler_w: float = 60.0


@dataclass(slots=True)
class Climate:
    """What is switched on at a place."""

    heater: bool = False
    cooler: bool = False
    fan: bool = False

    def power_w(self, heater_w: float, cooler_w: float) -> float:
        """Heat put in."""
        return heater_w * self.heater - cooler_w * self.cooler


@dataclass(slots=True)
class Losses:
    """Heat of the last interval, in W."""

    heat_sink_w: float = 0.0
    motor_w: float = 0.0
    blocs_w: Sequence[float] = ()


@dataclass(slots=True)
class ThermalPlant:
    """All bodies of one blade. ``hub_c`` of ``step`` is the air around them."""

    constants: ThermalConstants = field(default_factory=ThermalConstants)
    heat_sink_c: float = 0.0
    motor_c: float = 0.0
    box_c: float = 0.0
    places_c: list[float] = field(default_factory=lambda: [0.0, 0.0])
    places_warmer_c: list[float] = field(default_factory=lambda: [0.0, 0.0])
    """Above the air of the hub, by what stands beside the sensor."""
    battery_climate: Climate = field(default_factory=Climate)
    place_climates: tuple[Climate, Climate] = field(default_factory=lambda: (Climate(), Climate()))
    motor_fan: bool = False
    extra_heat_sink_w: float = 0.0
    extra_motor_w: float = 0.0
    extra_battery_w: float = 0.0

    @property
    def fans(self) -> int:
        """How many fans run."""
        climates = (self.battery_climate, *self.place_climates)
        return sum(climate.fan for climate in climates) + self.motor_fan

    def step(self, dt_s: float, hub_c: float, losses: Losses, blocs: Sequence[Bloc]) -> None:
        """Move all temperatures on."""
        constants = self.constants
        heat_w = losses.heat_sink_w + self.extra_heat_sink_w - (self.heat_sink_c - hub_c) / constants.heat_sink_k_per_w
        self.heat_sink_c += heat_w / constants.heat_sink_j_per_k * dt_s
        motor_w_per_k = (constants.motor_fan_factor if self.motor_fan else 1.0) / constants.motor_k_per_w
        heat_w = losses.motor_w + self.extra_motor_w - (self.motor_c - hub_c) * motor_w_per_k
        self.motor_c += heat_w / constants.motor_j_per_k * dt_s
        self._step_box(dt_s, hub_c, losses, blocs)
        self._step_places(dt_s, hub_c)

    def _step_box(self, dt_s: float, hub_c: float, losses: Losses, blocs: Sequence[Bloc]) -> None:
        constants, climate = self.constants, self.battery_climate
        stir = constants.fan_factor if climate.fan else 1.0
        box_w = climate.power_w(constants.box_heater_w, constants.box_cooler_w)
        box_w -= (self.box_c - hub_c) * constants.box_w_per_k * (constants.wall_fan_factor if climate.fan else 1.0)
        for bloc, loss_w in zip(blocs, losses.blocs_w, strict=True):
            out_w = (bloc.temperature_c - bloc.warmer_c - self.box_c) * constants.bloc_w_per_k * stir
            bloc_w = loss_w + self.extra_battery_w / len(blocs) - out_w
            bloc.temperature_c += bloc_w / constants.bloc_j_per_k * dt_s
            box_w += out_w
        self.box_c += box_w / constants.box_j_per_k * dt_s

    def _step_places(self, dt_s: float, hub_c: float) -> None:
        constants = self.constants
        for number, climate in enumerate(self.place_climates):
            above_c = self.places_c[number] - hub_c - self.places_warmer_c[number]
            heat_w = climate.power_w(constants.place_heater_w, constants.place_cooler_w)
            heat_w -= above_c * constants.place_w_per_k * (constants.wall_fan_factor if climate.fan else 1.0)
            self.places_c[number] += heat_w / constants.place_j_per_k * dt_s
