"""The scope as the page gets and sends it. Times of orders are in s, of captures t_ns."""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.service.scope.capture import Head, InForce
from app.service.scope.captures import Listed
from app.service.scope.order import ScopeOrder, TriggerOrder

MAX_NAME: Final = 120
MAX_NOTE: Final = 4000
SignalName = Annotated[str, Field(min_length=1, max_length=250)]
_ARM: Final[dict[str, Any]] = {
    "signals": ["wtg-07/blade-1/pmc/6064", "wtg-07/blade-1/pmc/6041.3"],
    "trigger": {"kind": "edge", "signal": "wtg-07/blade-1/pmc/6064", "level": 45.0, "slope": "falling"},
    "total_s": 4.0,
    "pre_s": 1.0,
    "mode": "single",
}


class TriggerIn(BaseModel):
    """What is waited for; what a kind does not need is left out. ``level`` is in the unit of ``signal``."""

    model_config = ConfigDict(extra="forbid")

    kind: Literal["manual", "edge", "level", "event", "fault"]
    signal: SignalName | None = None
    level: float | None = None
    slope: Literal["rising", "falling", "either"] | None = None
    side: Literal["above", "below"] | None = None
    event: Literal["emcy", "boot_up", "nmt", "axis_state", "bit"] | None = None
    device: SignalName | None = None
    code: Annotated[int, Field(ge=1, le=0xFFFF)] | None = None


class ArmRequest(BaseModel):
    """Signals ``<device>/<address>`` or ``<device>/<address>.<bit>``; ``pre_s`` of ``total_s`` lie before the trigger.

    ``hold_off_s``: so long after a capture no trigger counts. ``auto_s``: in mode auto, how long one is waited for.
    """

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [_ARM]})

    signals: Annotated[list[SignalName], Field(max_length=64)]
    trigger: TriggerIn
    total_s: float
    pre_s: float
    mode: Literal["single", "normal", "auto"] = "single"
    hold_off_s: float = 0.0
    auto_s: float = 2.0

    def order(self) -> ScopeOrder:
        """As the use case takes it."""
        return ScopeOrder(
            signals=tuple(self.signals),
            trigger=TriggerOrder(**self.trigger.model_dump()),
            total_s=self.total_s,
            pre_s=self.pre_s,
            mode=self.mode,
            hold_off_s=self.hold_off_s,
            auto_s=self.auto_s,
        )


class CaptureChange(BaseModel):
    """Name and note of a capture; one that was not kept yet is kept by it."""

    model_config = ConfigDict(
        extra="forbid", json_schema_extra={"examples": [{"name": "blade 1, brake test", "note": "after greasing"}]}
    )

    name: Annotated[str, Field(min_length=1, max_length=MAX_NAME)]
    note: Annotated[str, Field(max_length=MAX_NOTE)] = ""


class CaptureDoc(BaseModel):
    """A capture without its values. Not ``kept``: it goes with the next one, or with the server."""

    head: Head
    kept: bool

    @classmethod
    def of(cls, listed: Listed) -> CaptureDoc:
        """Of a listed one."""
        return cls(head=listed.head, kept=listed.kept)


class InForceDoc(BaseModel):
    """A value that was in force, and what is known now; ``differs`` None: nothing is known now to compare it with."""

    was: InForce
    now_raw: str | None
    now_shown: str | None
    differs: bool | None
