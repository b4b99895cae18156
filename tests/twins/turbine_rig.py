"""A whole turbine on a line with a virtual clock: wind, instructor, and a master that listens to everything."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from app.model.description_file import load_builtin
from app.model.fault import ActiveFault, FaultOrder
from app.twins.faults import Instructor
from app.twins.line import CanLine
from app.twins.rotor import Rotor
from app.twins.surroundings import Surroundings
from app.twins.turbine import Settings, Turbine
from tests.twins.harness import MS, SECOND, Master

PMMS, PMCS = (1, 2, 3), (11, 12, 13)


class TurbineRig:
    """Three blades, powered and booted, whatever interferes later; ``seed`` is the instructor's."""

    def __init__(self, state_dir: Path | None = None, seed: int = 1, **settings: object) -> None:
        self.line = CanLine(500_000)
        self.master = Master(self.line)
        made = replace(Settings(state_dir=state_dir, boot_ns=10 * MS), **settings)  # type: ignore[arg-type]
        self.turbine = Turbine(self.line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), made)
        self.turbine.power_on(0)
        axes = [blade.axis for blade in self.turbine.blades]
        self.surroundings = Surroundings(self.line, Rotor(seed=7), axes)
        self.surroundings.start(0)
        self.instructor = Instructor(self.turbine, self.line, self.surroundings, seed)
        self.run(0.1)

    def run(self, seconds: float) -> None:
        self.master.run(round(seconds * SECOND))

    def fault(self, kind: str, *, seconds: float | None = None, blade: int | None = None, node: int | None = None,
              **values: float) -> ActiveFault:  # fmt: skip
        """Put a fault in now."""
        return self.instructor.inject(FaultOrder(kind, blade, node, values, seconds))

    def number(self, node: int, where: str, *, signed: bool = False) -> int:
        return self.master.number(node, where, signed=signed)

    def errors(self, node: int) -> list[int]:
        """Codes of the emergency messages heard from a node, "no error" left out."""
        codes = (int.from_bytes(heard.can.data[:2], "little") for heard in self.master.all_of(0x80 + node))
        return [code for code in codes if code]

    def heard_since(self, t_ns: int, can_id: int) -> int:
        return len(self.master.all_of(can_id, t_ns))
