"""The whole twin of an ED2: two axes behind one slave on the bus; time passes in steps of a millisecond."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Final

from app.model.description import Description
from app.twins.ed2.axis import Axis
from app.twins.ed2.channel import Channel
from app.twins.ed2.commands import Commands
from app.twins.ed2.delivered import SSI_GRAY
from app.twins.ed2.dp_slave import DpSlave
from app.twins.ed2.errors import Active, Catalogue
from app.twins.ed2.hydraulics import Bench, Cylinder
from app.twins.ed2.kernel import Kernel
from app.twins.ed2.params import Params
from app.twins.ed2.transducers import Transducer
from app.twins.ed2.wishes import Wishes
from app.wire.profibus.configuration import Module
from app.wire.profibus.pzd import AS_PKW, Order
from app.wire.profibus.telegrams import TELEGRAM_TYPES, Signal, TelegramType, assumed_modules

CYCLE_NS: Final = 1_000_000
WAKE_NS: Final = 10_000_000
"""How often the device wants to be run where nobody asks it; a request lets it come to the present anyway."""
BUS_NS: Final = 200_000_000
BOOT_NS: Final = 500_000_000
"""From power-on: the slave answers, the self test ends (assumed)."""
IDENT_EXAMPLE: Final = 0x0ED2
"""An example: nobody has given it out, and the real one is not printed in the manual."""
ADDRESS: Final = 6
"""As delivered (manual, 5.4)."""
DELIVERED: Final = TELEGRAM_TYPES[1]
"""As delivered (manual, 5.4)."""
START_MM: Final = 250.0
OWN_BENCH: Final = Bench()
_STIRRED: Final = 8
"""Cycles that are lived in full after something has come from the bus: as many as there are steps to any state."""
_LOOK: Final = 10
"""Of so many cycles one is lived in full while nothing moves."""


def _configurations() -> dict[tuple[Module, ...], tuple[TelegramType, ...]]:
    """What a master may configure: the telegram of axis 1, or that and the one of axis 2 after it.

    "One after another" is all that the manual tells of two axes (2.4); OPEN whether they share an address.
    """
    types = tuple(TELEGRAM_TYPES.values())
    chosen: list[tuple[TelegramType, ...]] = [(one,) for one in types]
    chosen += product(types, types)
    return {tuple(module for one in several for module in assumed_modules(one)): several for several in chosen}


CONFIGURATIONS: Final = _configurations()


@dataclass(frozen=True, slots=True)
class Settings:
    """How a twin is set up. ``state`` is the folder of its memory, None forgets everything at the end.

    ``places_mm`` are those of both cylinders at the start.
    """

    address: int = ADDRESS
    transducer: int = SSI_GRAY
    order: Order = AS_PKW
    state: Path | None = None
    bench: Bench = OWN_BENCH
    places_mm: tuple[float, float] = (START_MM, START_MM)


class Ed2:
    """One device, the application of its slave. Nothing in it reads a clock."""

    def __init__(self, description: Description, settings: Settings) -> None:
        self.settings = settings
        self.now_ns = 0
        catalogue = Catalogue(description)
        self.axes = (self._axis(1, catalogue), self._axis(2, catalogue))
        self.kernel = Kernel(self.axes, settings.transducer)
        self.commands = Commands(description, self.kernel, settings.address, settings.transducer, settings.state)
        self.channels: tuple[Channel, Channel] = self.commands.channels
        self.wishes = Wishes(self.channels, self.kernel)
        self._params: tuple[Params, Params] = (Params.of(self.channels[0]), Params.of(self.channels[1]))
        self._stirred = 0
        self._started_ns: int | None = None
        """When power came; None where the device is off."""
        self.slave = DpSlave(settings.address, IDENT_EXAMPLE, self, assumed_modules(DELIVERED))
        self.power_on()

    def _axis(self, number: int, catalogue: Catalogue) -> Axis:
        settings = self.settings
        cylinder = Cylinder(settings.bench, settings.places_mm[number - 1])
        return Axis(number, cylinder, Transducer(settings.transducer), Active(catalogue, number))

    @property
    def problems(self) -> list[str]:
        """What could not be used of the stored state."""
        return self.commands.problems

    # -- power -------------------------------------------------------------------------------

    def power_on(self) -> None:
        """TR_0: parameters are as they were saved, and the self test begins."""
        self.slave.power_off()
        self.commands.recall()
        for axis in self.axes:
            axis.power_on()
        self._started_ns = self.now_ns

    def power_off(self) -> None:
        """No current, nobody answers; the cylinders stay where they are."""
        self.slave.power_off()
        self._started_ns = None
        for axis in self.axes:
            axis.power_on()

    # -- simulation --------------------------------------------------------------------------

    def next_due_ns(self) -> int:
        """The device runs all the time."""
        return self.now_ns - self.now_ns % WAKE_NS + WAKE_NS

    def run_until(self, t_ns: int) -> None:
        """Let milliseconds pass."""
        while self.now_ns + CYCLE_NS <= t_ns:
            self.now_ns += CYCLE_NS
            self._cycle()

    def _cycle(self) -> None:
        if self._started_ns is None:
            self._run_out()
            return
        self._boot(self.now_ns - self._started_ns)
        for channel in self.channels:
            channel.pkw.run_until(self.now_ns)
        if any(channel.changed for channel in self.channels):
            self._look_at_parameters()
        if self._stirred:
            self._stirred -= 1
        elif self.kernel.asleep and self.now_ns // CYCLE_NS % _LOOK:
            return
        self.kernel.cycle(self.wishes.of(self._params), self._params)

    def _boot(self, since_ns: int) -> None:
        if since_ns == BUS_NS:
            self.slave.power_on()
        elif since_ns == BOOT_NS:
            for axis in self.axes:
                axis.states.booted()
            self._stirred = _STIRRED

    def _run_out(self) -> None:
        """Without power springs close the valves."""
        for axis in self.axes:
            axis.move(self.kernel.conditions.supply_bar, axis.surroundings.load_n)

    def _look_at_parameters(self) -> None:
        self._params = (Params.of(self.channels[0]), Params.of(self.channels[1]))
        for channel in self.channels:
            channel.changed = False
        self._stirred = _STIRRED

    # -- what the slave asks for -------------------------------------------------------------

    def configure(self, modules: tuple[Module, ...]) -> tuple[int, int] | None:
        """Take a configuration; gives the lengths of outputs and inputs, bytes."""
        telegrams = CONFIGURATIONS.get(modules)
        if telegrams is None:
            return None
        for channel in self.channels:
            channel.telegram = None
        for channel, telegram in zip(self.channels, telegrams, strict=False):
            channel.telegram = telegram
        return sum(one.output_size for one in telegrams), sum(one.input_size for one in telegrams)

    def receive(self, outputs: bytes) -> None:
        """Outputs of the master."""
        at = 0
        for channel in self.channels:
            if channel.telegram is not None:
                size = channel.telegram.output_size
                values = channel.outputs(self.now_ns, outputs[at : at + size], self.settings.order)
                if values != channel.received:
                    self._stirred = _STIRRED
                channel.received = values
                at += size
        self.wishes.take()

    def clear(self) -> None:
        """No outputs are in force any more. OPEN what axes do then; their control word counts as 0."""
        for channel in self.channels:
            channel.pkw.reset()
            channel.received = {}
        self._stirred = _STIRRED

    def transmit(self) -> bytes:
        """The inputs of this moment."""
        order = self.settings.order
        return b"".join(channel.inputs(order) for channel in self.channels if channel.telegram is not None)

    def outputs_of(self, axis: int) -> dict[Signal, int]:
        """Process data of an axis (1 or 2) that are in force; empty where none are."""
        return dict(self.channels[axis - 1].received)
