"""Clamps of the PMC: levels, edges, and the words 60FDh and 60FEh/3 that show them (manual, 5.16, tables 72 and 73)."""

from __future__ import annotations

from collections.abc import Callable
from math import copysign

from app.twins.axis_drive import AxisDrive
from app.twins.plant import AxisPlant


def _nothing() -> None:
    """Nobody waits for the probe."""


class AxisInputs:
    """Levels at the clamps that no part of the plant drives (table 72); ``efc`` and ``enable``: True is healthy.

    ``on_probe`` is called at each change of the measuring input, at the moment at which it changes.
    """

    def __init__(self, on_probe: Callable[[], None] = _nothing) -> None:
        self.enable = True
        self.efc = True
        self.reference = False
        self.reset = False
        self.free = False
        self._probe = False
        self._on_probe = on_probe

    @property
    def probe(self) -> bool:
        """Level at the measuring input X4.7."""
        return self._probe

    @probe.setter
    def probe(self, level: bool) -> None:
        if level is not self._probe:
            self._probe = level
            self._on_probe()


def input_word(plant: AxisPlant, inputs: AxisInputs) -> int:
    """60FDh. The 0 and 95 degree switches and the EFC input are low-active, the 90 degree switch is high-active."""
    levels = {
        0: not plant.at_0,
        1: not plant.at_95,
        2: inputs.reference,
        3: inputs.enable,
        16: plant.at_90,
        17: inputs.probe,
        18: inputs.efc,
        19: inputs.reset,
        20: inputs.free,
    }
    return sum(1 << bit for bit, level in levels.items() if level)


def output_word(plant: AxisPlant, *, watchdog: bool, booted: bool, fault: bool, operational: bool) -> int:
    """60FEh/3. OPEN what the LEDs 24 to 27 tell; booted, failure, watchdog contact, node operational."""
    levels = {
        0: plant.brake_lifted,
        16: watchdog,
        24: booted,
        25: fault,
        26: watchdog,
        27: operational,
    }
    return sum(1 << bit for bit, level in levels.items() if level)


class Edges:
    """What has arrived at the clamps since it was last asked for: limit switches reached, reset pressed."""

    def __init__(self, plant: AxisPlant, drive: AxisDrive, inputs: AxisInputs) -> None:
        self._plant = plant
        self._drive = drive
        self._inputs = inputs
        self.hit_0 = self.hit_90 = self.reset = False
        self._was = (False, False, False)
        self._was_reset = False

    def restart(self) -> None:
        """Forget; levels of now are no edges."""
        self.forget()
        self._was = self._switches()
        self._was_reset = self._inputs.reset

    def forget(self) -> None:
        """What had arrived was dealt with."""
        self.hit_0 = self.hit_90 = self.reset = False

    def look(self, beyond: bool) -> bool:
        """Note what is new; True where the state machine has to see it. ``beyond``: limit switches may be passed."""
        was, now = self._was, self._switches()
        self._was = now
        if not beyond:
            self.hit_0 = self.hit_0 or (now[0] and (not was[0] or self._drives_into_0()))
            self.hit_90 = self.hit_90 or (now[1] and not was[1])
        pressed = self._inputs.reset and not self._was_reset
        self._was_reset = self._inputs.reset
        self.reset = self.reset or pressed
        return now != was or pressed

    def _switches(self) -> tuple[bool, bool, bool]:
        plant = self._plant
        return plant.at_0, plant.at_90, plant.at_95

    def _drives_into_0(self) -> bool:
        """The set-point leads further below an actuated 0 degree switch.

        OPEN what the switch does while it stays actuated, for the axis must be able to drive out of it. A motion
        further into it is a quick stop again; the motion out of it is free.
        """
        drive = self._drive
        return drive.energised and drive.profile.velocity * copysign(1.0, drive.scaling.units_per_rad) < 0.0
