"""The whole twin of an ED2: two axes behind one slave on the bus; time passes in steps of a millisecond."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Final

from app.model.datatypes import Raw
from app.model.description import Description
from app.twins.ed2.channel import SAVE_NS, Channel
from app.twins.ed2.delivered import SSI_GRAY
from app.twins.ed2.dp_slave import DpSlave
from app.twins.object_store import Deferred, RefusedAccessError
from app.wire.profibus.configuration import Module
from app.wire.profibus.pzd import AS_PKW, Order
from app.wire.profibus.telegrams import TELEGRAM_TYPES, Signal, TelegramType, assumed_modules
from app.wire.sdo import Abort

CYCLE_NS: Final = 1_000_000
WAKE_NS: Final = 10_000_000
"""How often the device wants to be run where nobody asks it; a request lets it come to the present anyway."""
IDENT_EXAMPLE: Final = 0x0ED2
"""An example: nobody has given it out, and the real one is not printed in the manual."""
ADDRESS: Final = 6
"""As delivered (manual, 5.4)."""
AXES: Final = 2
_STORE: Final = (0, 51)


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
    """How a twin is set up. ``state`` is the folder of its memory, None forgets everything at the end."""

    address: int = ADDRESS
    transducer: int = SSI_GRAY
    order: Order = AS_PKW
    state: Path | None = None


class Ed2:
    """One device, the application of its slave. Nothing in it reads a clock."""

    def __init__(self, description: Description, settings: Settings) -> None:
        self.settings = settings
        self.now_ns = 0
        self.slave = DpSlave(settings.address, IDENT_EXAMPLE, self)
        save = description.save[0]
        self._signature = save.signature
        self.channels = tuple(
            Channel(description, axis, settings.transducer, self._file(axis), {}, self._live(axis - 1))
            for axis in range(1, AXES + 1)
        )
        for channel in self.channels:
            cell = channel.store.cell(*_STORE)
            cell.guard = self._check_save
            cell.effect = self._save

    @property
    def problems(self) -> list[str]:
        """What could not be used of the stored state."""
        return [channel.memory.problem for channel in self.channels if channel.memory.problem is not None]

    def _file(self, axis: int) -> Path | None:
        state = self.settings.state
        return None if state is None else state / f"ed2-{self.settings.address}-axis-{axis}.json"

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
        for channel in self.channels:
            channel.pkw.run_until(self.now_ns)

    def restart(self) -> None:
        """Power off and on."""
        self.slave.power_off()
        for channel in self.channels:
            channel.recall()
        self.slave.power_on()

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
                channel.received = channel.outputs(self.now_ns, outputs[at : at + size], self.settings.order)
                at += size

    def clear(self) -> None:
        """No outputs are in force any more."""
        for channel in self.channels:
            channel.pkw.reset()
            channel.received = {}

    def transmit(self) -> bytes:
        """The inputs of this moment."""
        order = self.settings.order
        return b"".join(channel.inputs(order) for channel in self.channels if channel.telegram is not None)

    def outputs_of(self, axis: int) -> dict[Signal, int]:
        """Process data of an axis (1 or 2) that are in force; empty where none are."""
        return dict(self.channels[axis - 1].received)

    # -- inside ------------------------------------------------------------------------------

    def _live(self, _axis: int) -> Callable[[Signal], int]:
        def tell(_signal: Signal) -> int:
            return 0

        return tell

    def _check_save(self, raw: Raw) -> None:
        if raw not in (0, self._signature):
            raise RefusedAccessError(Abort.VALUE_RANGE)

    def _save(self, raw: Raw) -> Deferred | None:
        """All parameters of both axes. OPEN when it is answered: here, once it is done."""
        if raw != self._signature:
            return None

        def finish(_now_ns: int) -> None:
            for channel in self.channels:
                channel.memory.save(lambda _entry: True)

        return Deferred(SAVE_NS, finish)
