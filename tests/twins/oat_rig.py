"""One blade of a turbine on a line with a virtual clock, and a master that commands its PMC."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.twins.cia402 import State
from app.twins.line import CanLine
from app.twins.turbine import Blade, Settings
from app.wire.nmt import NmtCommand
from tests.twins.harness import MS, SECOND, Master

PMM, PMC = 1, 11
SHUTDOWN, SWITCH_ON, ENABLE, START, NEW_TARGET = 0x0106, 0x0107, 0x010F, 0x000F, 0x001F
DISABLE_VOLTAGE, QUICK_STOP, FAULT_RESET, EFC = 0x010C, 0x010B, 0x0186, 0x080F
_MASKS = ((0x4F, State.NOT_READY), (0x4F, State.SWITCH_ON_DISABLED), (0x6F, State.READY), (0x6F, State.SWITCHED_ON),
          (0x6F, State.OPERATION_ENABLED), (0x6F, State.QUICK_STOP_ACTIVE), (0x4F, State.FAULT_REACTION_ACTIVE),
          (0x4F, State.FAULT))  # fmt: skip
"""Masks of table 49, in its order."""


class BladeRig:
    """Blade 1, powered and booted."""

    def __init__(self, angle_deg: float = 80.0, state_dir: Path | None = None, **settings: object) -> None:
        self.line = CanLine(500_000)
        self.master = Master(self.line)
        made = replace(Settings(state_dir=state_dir, angle_deg=angle_deg, boot_ns=10 * MS), **settings)  # type: ignore[arg-type]
        self.blade = Blade(self.line, 1, load_builtin("oat-pmm"), load_builtin("oat-pmc"), made)
        self.pmm, self.pmc = self.blade.pmm, self.blade.pmc
        self.blade.power_on(0)
        self.master.wait_id(0x700 + PMC, since=0)
        self.master.run(10 * MS)

    # -- objects ---------------------------------------------------------------------

    def get(self, where: str, node: int = PMC) -> int:
        """An integer object, as the device holds it."""
        device = self.pmc.device if node == PMC else self.pmm.device
        signed = device.store.at(parse_address(where)).entry.type.is_signed
        return self.master.number(node, where, signed=signed)

    def put(self, where: str, number: int, node: int = PMC) -> None:
        """Write an integer object."""
        device = self.pmc.device if node == PMC else self.pmm.device
        kind = device.store.at(parse_address(where)).entry.type
        assert kind.size is not None
        self.master.put(node, where, number, kind.size, signed=kind.is_signed)

    def refused(self, where: str, number: int, node: int = PMC) -> int:
        """The abort code of a write that must be refused."""
        return self.master.refused(lambda: self.put(where, number, node))

    # -- axis --------------------------------------------------------------------------

    @property
    def transitions(self) -> list[int]:
        """Numbers of the transitions since power-on."""
        return list(self.pmc.machine.history)

    def command(self, *words: int) -> None:
        """Write controlwords, one after the other."""
        for word in words:
            self.put("6040", word)

    def status(self) -> int:
        return self.get("6041")

    def state(self) -> State:
        word = self.status()
        return next(state for mask, state in _MASKS if word & mask == state.value)

    def bit(self, number: int) -> bool:
        return bool(self.status() >> number & 1)

    def wait_state(self, state: State, timeout_ns: int = 20 * SECOND) -> None:
        self.master.until(lambda: self.state() is state, timeout_ns)

    def wait_bit(self, number: int, level: bool = True, timeout_ns: int = 60 * SECOND) -> None:
        self.master.until(lambda: self.bit(number) is level, timeout_ns)

    def enable(self, mode: int = 1, velocity: int = 800) -> None:
        """Operation enabled with halt set."""
        self.put("6060", mode)
        self.put("6081", velocity)
        self.command(ENABLE)
        assert self.state() is State.OPERATION_ENABLED

    def go(self, position: int) -> None:
        """Hand a target over and start."""
        self.put("607A", position)
        self.command(START, NEW_TARGET)
        self.command(START)

    def move(self, position: int) -> None:
        """Drive to a target and wait until it is reached."""
        self.go(position)
        self.wait_bit(10)

    @property
    def angle_deg(self) -> float:
        return self.blade.axis.angle_deg

    def operational(self, *nodes: int) -> None:
        for node in nodes or (PMC,):
            self.master.nmt(NmtCommand.START, node)
        self.master.run(2 * MS)

    def restart(self, node: int = PMC) -> None:
        self.master.nmt(NmtCommand.RESET_NODE, node)
        self.master.wait_id(0x700 + node)
        self.master.run(5 * MS)

    def save(self, node: int = PMC) -> None:
        self.master.put(node, "1010:03", 0x65766173, 4)

    def run_until(self, condition: Callable[[], bool], timeout_ns: int = 60 * SECOND) -> None:
        self.master.until(condition, timeout_ns)

    def errors(self, node: int = PMC) -> Iterable[int]:
        """Codes of the emergency messages heard, "no error" left out."""
        codes = (int.from_bytes(heard.can.data[:2], "little") for heard in self.master.all_of(0x80 + node))
        return [code for code in codes if code]
