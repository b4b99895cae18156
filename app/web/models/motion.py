"""Types of the desk from which axes are moved."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from app.service.motion.brake_test import BrakeTest
from app.service.motion.interlocks import Standing

Page = Annotated[str, Field(min_length=1, max_length=64)]
"""Name that a page gives itself, new each time it is loaded."""
Position = Annotated[float, Field(ge=-2e9, le=2e9, allow_inf_nan=False)]
"""In the unit of 607Ah: degrees at a blade."""
Speed = Annotated[float, Field(ge=-2e9, le=2e9, allow_inf_nan=False)]
"""In the unit of 60FFh: degrees a second at a blade."""
Slug = Annotated[str, Field(min_length=1, max_length=200)]


class LeaseRequest(BaseModel):
    """Who wants the lease."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"page": "5f2c1d"}]})

    page: Page


class LeaseDoc(BaseModel):
    """The lease of the page that asks: ``fence`` goes with every order and beat. None: it was asked for."""

    fence: int | None


class FenceRequest(BaseModel):
    """What the holder of lease ``fence`` asks."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"fence": 1764029382123456}]})

    fence: int


class AnswerRequest(FenceRequest):
    """The holder's answer to who asks for the lease."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"fence": 1764029382123456, "hand_over": True}]})

    hand_over: bool


class ConfirmRequest(FenceRequest):
    """What the holder has looked at. ``external_stops``: devices whose stop by hand an expert answers for."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"fence": 1764029382123456, "rotor_locked": True, "people_out": True, "external_stops": []}]
        }
    )

    rotor_locked: bool
    people_out: bool
    external_stops: list[Slug] = Field(default=[], max_length=64)


class OrderRequest(FenceRequest):
    """An order to an axis; ``order`` rises with each one of a page, so that an old one does nothing."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"fence": 1764029382123456, "order": 1}]})

    order: int


class JogRequest(OrderRequest):
    """Turn the axis at a speed while it is held; at a blade negative is towards 0 degrees."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"fence": 1764029382123456, "order": 2, "speed": -2.0}]})

    speed: Speed


class ManualRequest(OrderRequest):
    """Manual control of a hydraulic axis: to which side, by rapid or by creep."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"fence": 1764029382123456, "order": 2, "positive": True, "rapid": False}]}
    )

    positive: bool
    rapid: bool


class OperationRequest(OrderRequest):
    """Whether both cylinders of a hydraulic axis go by themselves; ``aligned``: they stand at the same place."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"fence": 1764029382123456, "order": 2, "single": False, "aligned": True}]}
    )

    single: bool
    aligned: bool


class MoveRequest(OrderRequest):
    """Move the axis to a position while it is held."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"fence": 1764029382123456, "order": 3, "position": 45.0, "speed": 2.0}]}
    )

    position: Position
    speed: Speed


class HomeRequest(OrderRequest):
    """Take the present position for this one."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"fence": 1764029382123456, "order": 4, "position": 90.0}]}
    )

    position: Position


class SearchHomeRequest(OrderRequest):
    """Home by a method of 6098h while it is held."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"fence": 1764029382123456, "order": 5, "method": 17}]})

    method: int = Field(ge=-128, le=127)


class InterlockDoc(BaseModel):
    """How an interlock stands; ``details`` fill its texts ``interlock.<name>.clear`` and ``.bites``."""

    name: str
    holds_back: bool
    details: dict[str, Any]

    @classmethod
    def of(cls, standing: Standing) -> InterlockDoc:
        """The document of one."""
        return cls(name=standing.interlock.value, holds_back=standing.holds_back, details=dict(standing.details))


class PreparedDoc(BaseModel):
    """The proof: so long after our last heartbeat the axis had stopped by itself; null where its bus has none."""

    proof_ms: int | None


class MovedDoc(BaseModel):
    """How it ended; the end of a text key ``motion.ended``."""

    why: str


class HomedDoc(MovedDoc):
    """Where the axis stands after homing, in the unit of 6064h."""

    position: float


class FeatheredDoc(MovedDoc):
    """The EFC drive of one axis: from where to where, its target (567Ah), and how long it took."""

    from_deg: float
    to_deg: float
    target_deg: float
    took_s: float


class BrakeTestDoc(MovedDoc):
    """What the brake did; null for what the test did not come to. ``verdict``: end of a text key ``brake_verdict``."""

    verdict: str | None
    lifted_s: float | None
    turned_deg: float | None
    engaged_s: float | None
    drift_deg: float | None

    @classmethod
    def of(cls, why: str, found: BrakeTest) -> BrakeTestDoc:
        """The document of one that ended so."""
        return cls(
            why=why,
            verdict=None if found.verdict is None else found.verdict.value,
            lifted_s=_rounded(found.lifted_s),
            turned_deg=_rounded(found.turned_deg),
            engaged_s=_rounded(found.engaged_s),
            drift_deg=_rounded(found.drift_deg),
        )


def _rounded(number: float | None) -> float | None:
    return None if number is None else round(number, 3)
