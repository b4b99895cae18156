"""Types of battery test and battery change."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from app.service.battery.conditions import Need
from app.service.battery.desk import Running
from app.service.battery.records import ChangeRecord, Noted, Sample, TestRecord

Serials = Annotated[str, Field(min_length=1, max_length=200, pattern=r"\S")]
"""Serial numbers as they stand on the blocs, separated as a person likes."""


class NeedDoc(BaseModel):
    """A condition of a battery test; ``details`` fill its texts ``page.setup.battery.need.…``."""

    name: str
    holds_back: bool
    details: dict[str, Any]

    @classmethod
    def of(cls, need: Need) -> NeedDoc:
        """The document of one."""
        return cls(name=need.condition.value, holds_back=need.holds_back, details=dict(need.details))


class RunningTestDoc(BaseModel):
    """A test under way: who began it, where it stands, for how long it loads the battery, and what was measured."""

    person: str
    t_ns: int
    step: str
    took_ms: int
    course: list[Sample]

    @classmethod
    def of(cls, running: Running) -> RunningTestDoc:
        """The document of one."""
        sequence = running.sequence
        return cls(
            person=running.person,
            t_ns=running.t_ns,
            step=sequence.step.value,
            took_ms=sequence.took_ms,
            course=list(sequence.course),
        )


class BatteryDoc(BaseModel):
    """The battery of a device.

    The conditions of its test (none are asked while one runs), the test that runs, and the old battery where its change
    has begun.
    """

    needs: list[NeedDoc]
    running: RunningTestDoc | None
    noted: Noted | None


class BatteryHistory(BaseModel):
    """The latest tests and changes of a device, newest first."""

    tests: list[TestRecord]
    changes: list[ChangeRecord]


class OldBatteryRequest(BaseModel):
    """The battery that is taken out."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"serials": "4711-1 to 4711-6"}]})

    serials: Serials


class NewBatteryRequest(BaseModel):
    """The battery that was put in."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"serials": "4812-1 to 4812-6", "remark": "leads renewed"}]}
    )

    serials: Serials
    remark: Annotated[str, Field(max_length=500)]
