"""What a restore will do, row by row and step by step, as a person reviews it and the machine follows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from app.model.datatypes import Raw
from app.model.rules.rule import Finding
from app.model.station import Place


class Treatment(Enum):
    """What becomes of one object of the set. Every object is listed with one of them."""

    WRITE = "write"
    EQUAL = "equal"
    SKIP = "skip"


class Why(Enum):
    """Why an object is not restored; the value is the end of its text key ``restore.why.…``."""

    NOT_SELECTED = "not-selected"
    LEFT_BY_FEATHER = "left-by-feather"
    """Not selected, and RAM may hold what an emergency feather command has put there: a save makes that permanent."""
    NOT_IN_SET = "not-in-set"
    NOT_ON_DEVICE = "not-on-device"
    NEVER = "never"
    COUNTS = "counts"
    """The device counts on by itself: an old value would be false, and could not be proven."""
    OTHER_UNIT = "other-unit"
    """Bound to a machine, and it is not proven that this is the same one."""
    NETWORK = "network"
    """Decides at which address the device is found: it goes along only where a person chose that."""
    NEEDS_EXPERT = "needs-expert"
    CONDITION = "condition"
    """The device takes it only while an object that nobody can write holds another value; ``details`` say which."""
    NOT_SAVABLE = "not-savable"
    """With this value the device takes no save: nothing that is written could be kept."""
    READ_ONLY = "read-only"
    UNREADABLE = "unreadable"
    """The device did not tell its present value, so that nothing could be undone."""
    IRREVOCABLE = "irrevocable"
    """The present value is out of its limits: the device would not take it back, so that nothing could be undone."""
    MISFIT = "misfit"
    """Outside of type, limits or enumeration; ``details`` say which."""


@dataclass(frozen=True, slots=True)
class PlanRow:
    """One object: what stands in RAM now, what the set holds, and what is done. ``why`` only where it is SKIP."""

    place: Place
    treatment: Treatment
    now: Raw | None
    wanted: Raw | None
    why: Why | None = None
    details: Mapping[str, str] = field(default_factory=dict)


class StepKind(Enum):
    """``WRITE``: a value, written and verified. ``AUXILIARY``: written only so that others can be, and put back later.

    ``CONFIRM``: a person confirms within a set time. ``SAVE`` and ``RESTART``: a device; ``PROVE``: read it again.
    """

    WRITE = "write"
    AUXILIARY = "auxiliary"
    CONFIRM = "confirm"
    SAVE = "save"
    RESTART = "restart"
    PROVE = "prove"


@dataclass(frozen=True, slots=True)
class Step:
    """One step. ``place`` and ``raw`` for writes, ``device`` (its slug) for the others; none of them for CONFIRM.

    ``until``: the step is done only when this object shows ``raw``; where it is None, reading ``place`` back proves it.
    ``category``: what a SAVE makes permanent, None for all.
    """

    kind: StepKind
    device: str
    place: Place | None = None
    raw: Raw | None = None
    until: Place | None = None
    category: str | None = None


class Need(Enum):
    """What must hold at a device while it is restored; the value is the end of its text key ``restore.need.…``."""

    AXIS_DISABLED = "axis-disabled"
    HOMING_MODE = "homing-mode"


@dataclass(frozen=True, slots=True)
class Plan:
    """A restore of one station.

    ``restarts``: devices that must restart before all of it takes effect, because of the places ``after_restart``.
    ``new_address``: written places that decide at which address the device is found after its next restart.
    ``findings``: what the rules say of the station as it will be; ``blockers``: those of them that forbid the restore;
    ``unordered``: places for which no order of writes keeps all stepwise rules and limits, in the station as it is
    with all other rows written.
    """

    station: str
    rows: tuple[PlanRow, ...]
    steps: tuple[Step, ...]
    needs: Mapping[str, tuple[Need, ...]]
    restarts: tuple[str, ...]
    findings: tuple[Finding, ...] = ()
    blockers: tuple[Finding, ...] = ()
    unordered: tuple[Place, ...] = ()
    after_restart: tuple[Place, ...] = ()
    new_address: tuple[Place, ...] = ()

    @property
    def gates(self) -> tuple[Place, ...]:
        """Objects that are written only so that others can be, and put back by a value of their own."""
        auxiliary = (step for step in self.steps if step.kind is StepKind.AUXILIARY and step.until is None)
        return tuple(dict.fromkeys(step.place for step in auxiliary if step.place is not None))

    @property
    def runnable(self) -> bool:
        """True where nothing speaks against running it."""
        return not self.blockers and not self.unordered
