"""Types of test signals and of the touch probe."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.service.motion.runs import SignalRun
from app.service.motion.signals import Shape, Signal
from app.web.models.motion import OrderRequest

ShapeName = Literal["sine", "step", "ramp"]
_Number = Annotated[float, Field(ge=-1000, le=1000, allow_inf_nan=False)]
_Positive = Annotated[float, Field(gt=0, le=1000, allow_inf_nan=False)]


class SignalSettings(BaseModel):
    """A signal: degrees, negative towards 0; Hz for a sine; degrees per second and s of standing for step and ramp."""

    model_config = ConfigDict(extra="forbid")

    shape: ShapeName
    amplitude_deg: _Number
    frequency_hz: _Positive
    cycles: Annotated[int, Field(ge=1, le=100)]
    speed_dps: _Positive
    hold_s: _Positive


class SignalRequest(OrderRequest):
    """Run a test signal while it is held."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "fence": 1764029382123456,
                    "order": 5,
                    "signal": {
                        "shape": "sine",
                        "amplitude_deg": 1.0,
                        "frequency_hz": 0.5,
                        "cycles": 3,
                        "speed_dps": 2.0,
                        "hold_s": 1.0,
                    },
                }
            ]
        }
    )

    signal: SignalSettings

    def wanted(self) -> Signal:
        """The signal."""
        return Signal(
            Shape(self.signal.shape),
            self.signal.amplitude_deg,
            self.signal.frequency_hz,
            self.signal.cycles,
            self.signal.speed_dps,
            self.signal.hold_s,
        )


class SineDoc(BaseModel):
    """Actual position over set-point; ``delay_ms`` positive: it is behind."""

    frequency_hz: float
    ratio: float
    phase_deg: float
    delay_ms: float
    rest_deg: float


class StepDoc(BaseModel):
    """Times from the target on; ``band_deg``: in which it counts as settled."""

    dead_ms: float | None
    rise_ms: float | None
    overshoot_percent: float
    settling_ms: float | None
    error_deg: float
    band_deg: float


class RampDoc(BaseModel):
    """Lag at constant speed; ``gain_per_s`` is speed / lag."""

    speed_dps: float
    lag_deg: float
    gain_per_s: float | None


class SignalResults(BaseModel):
    """What the response says; None where it does not show it."""

    sine: SineDoc | None
    step: StepDoc | None
    ramp: RampDoc | None
    lag_ms: float | None
    most_following_deg: float | None


class HeldDoc(BaseModel):
    """A parameter as it stood before the run."""

    address: str
    name: str
    raw: int
    shown: str
    unit: str


class ProposedDoc(BaseModel):
    """A raw value that should become another one."""

    address: str
    old: int
    new: int


class ReasonDoc(BaseModel):
    """Text key ``page.setup.controller.reason.<key>``, filled with ``details``."""

    key: str
    details: dict[str, Any]


class ProposalDoc(BaseModel):
    """No values: it is well as it is."""

    values: list[ProposedDoc]
    reasons: list[ReasonDoc]


class CourseDoc(BaseModel):
    """Times in ms from the first target on, and values."""

    t_ms: list[float]
    y: list[float]


class SignalRunLine(BaseModel):
    """A run in the list. ``why`` is the end of a text key ``motion.ended``."""

    id: str
    device: str
    t_ns: int
    person: str
    why: str
    error: str | None
    signal: SignalSettings
    results: SignalResults

    @classmethod
    def of(cls, run: SignalRun) -> SignalRunLine:
        """The line of a run."""
        return cls.model_validate({**run.content, **_head(run)})


class SignalRunDoc(SignalRunLine):
    """A run with its courses: demand, set_point, position, expected, following (degrees), velocity, current (%)."""

    transport: Literal["pdo", "sdo"]
    period_ms: int
    interpolation_ms: int
    sent: int
    late: int
    start_deg: float
    in_force: list[HeldDoc]
    proposal: ProposalDoc | None
    courses: dict[str, CourseDoc]

    @classmethod
    def of(cls, run: SignalRun) -> SignalRunDoc:
        """The document of a run."""
        return cls.model_validate({**run.content, **_head(run)})


def _head(run: SignalRun) -> dict[str, Any]:
    return {"id": run.id, "device": run.device, "t_ns": run.t_ns, "person": run.person, "why": run.why}
