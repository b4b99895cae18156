"""What is kept of batteries: tests with their course and verdict, and changes of a battery."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any


class Verdict(Enum):
    """How a test ended; the value is the end of its text keys ``page.setup.battery.verdict.…``."""

    PASSED = "passed"
    FAILED = "failed"
    """The drive says that the battery fell below its minimum."""
    REFUSED = "refused"
    """The drive would not begin."""
    BROKEN_OFF = "broken_off"
    """The drive broke it off: motor or mains."""
    UNWATCHED = "unwatched"
    """A person stopped watching; the drive ends its test by itself."""
    LOST = "lost"
    """The unit was not heard any more."""
    TIMED_OUT = "timed_out"
    """It did not end in time."""


@dataclass(frozen=True, slots=True)
class Sample:
    """What was measured ``t_ms`` after the beginning; None is not known.

    Battery voltage (3060h), charger voltage (3064h), lowest voltage (3068h) in V; battery current (3070h, positive
    discharges) in mA; booster current (3073h) in A; blocs (3061h) in mV.
    """

    t_ms: int
    battery_v: int | None
    charger_v: int | None
    lowest_v: int | None
    current_ma: int | None
    booster_a: int | None
    blocs_mv: tuple[int | None, ...]


@dataclass(frozen=True, slots=True)
class Figures:
    """A battery in figures; None is not known.

    Total charged (3050h) in mAh, health (3081h) and charge (3080h) in %, voltage without load (3067h) in V, internal
    resistance (30B4h) in mOhm.
    """

    charged_mah: int | None
    health_percent: int | None
    charge_percent: int | None
    off_load_v: int | None
    resistance_mohm: int | None


@dataclass(frozen=True, slots=True)
class TestRecord:
    """One test. ``serial`` is that of the unit; ``before`` and ``after`` the battery's figures."""

    __test__ = False

    id: str
    device: str
    serial: int | None
    person: str
    t_ns: int
    took_ms: int
    verdict: Verdict
    lowest_v: int | None
    before: Figures
    after: Figures
    course: tuple[Sample, ...]


@dataclass(frozen=True, slots=True)
class Noted:
    """The old battery, as it was noted before it was taken out; ``serials`` as a person typed them."""

    device: str
    person: str
    t_ns: int
    serials: str
    figures: Figures


@dataclass(frozen=True, slots=True)
class ChangeRecord:
    """A change of the battery: the old one as it was noted, the serial numbers of the new one, a remark.

    ``counter_mah`` is what 3050h held after it was set to 0.
    """

    id: str
    device: str
    serial: int | None
    person: str
    t_ns: int
    old: Noted
    serials: str
    remark: str
    counter_mah: int


def dump(record: TestRecord | ChangeRecord | Noted) -> str:
    """The record as JSON."""
    return json.dumps(asdict(record), default=lambda one: one.value, ensure_ascii=False)


def load_test(text: str) -> TestRecord:
    """A test of its JSON."""
    found = json.loads(text)
    course = tuple(Sample(**{**one, "blocs_mv": tuple(one["blocs_mv"])}) for one in found["course"])
    figures = {name: Figures(**found[name]) for name in ("before", "after")}
    return TestRecord(**{**found, **figures, "verdict": Verdict(found["verdict"]), "course": course})


def load_noted(found: dict[str, Any]) -> Noted:
    """A note of its JSON object."""
    return Noted(**{**found, "figures": Figures(**found["figures"])})


def load_change(text: str) -> ChangeRecord:
    """A change of its JSON."""
    found = json.loads(text)
    return ChangeRecord(**{**found, "old": load_noted(found["old"])})
