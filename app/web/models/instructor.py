"""Types of the instructor: kinds of fault, what acts now, and scenarios."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, StrictInt

from app.model.fault import FaultKind, FaultOrder
from app.service.instructor import ScenarioRef


class FaultParameterDoc(BaseModel):
    """A number that an order may give. Its name for people is the text ``fault_parameter.<name>``."""

    name: str
    unit: str
    low: float
    high: float
    default: float
    integer: bool


class FaultKindDoc(BaseModel):
    """A kind of fault; its texts are ``fault.<id>.name`` and ``fault.<id>.hint``.

    ``target``: "blade" and "node" must be named in the order; with "turbine" a blade may be, with "bus" a node.
    ``momentary``: it ends of itself, so no duration can be given.
    """

    id: str
    level: Literal["device", "wire"]
    target: Literal["turbine", "blade", "node", "bus"]
    momentary: bool
    parameters: list[FaultParameterDoc]

    @classmethod
    def of(cls, kind: FaultKind) -> FaultKindDoc:
        """As the page gets it."""
        return cls(
            id=kind.id,
            level=kind.level.value,
            target=kind.target.value,
            momentary=kind.momentary,
            parameters=[
                FaultParameterDoc(
                    name=one.name,
                    unit=one.unit,
                    low=one.low,
                    high=one.high,
                    default=one.default,
                    integer=one.integer,
                )
                for one in kind.parameters
            ],
        )


class FaultOrderDoc(BaseModel):
    """What is wanted: a kind, where, with which values (the others are the defaults), and for how many seconds.

    ``seconds`` null: until it is cleared.
    """

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={"examples": [{"kind": "mains_failure", "blade": 2, "seconds": 30.0}]},
    )

    kind: Annotated[str, Field(max_length=100)]
    blade: StrictInt | None = None
    node: StrictInt | None = None
    values: Annotated[dict[Annotated[str, Field(max_length=100)], FiniteFloat], Field(max_length=50)] = {}
    seconds: FiniteFloat | None = None

    def order(self) -> FaultOrder:
        """As the use case takes it."""
        return FaultOrder(self.kind, self.blade, self.node, self.values, self.seconds)


class ScenarioDoc(BaseModel):
    """A scenario that can be played. ``note`` says what it shows, as its file does; it may be empty."""

    name: str
    title: str
    duration_s: float
    seed: int
    note: str

    @classmethod
    def of(cls, scenario: ScenarioRef) -> ScenarioDoc:
        """As the page gets it."""
        return cls(
            name=scenario.name,
            title=scenario.title,
            duration_s=scenario.duration_s,
            seed=scenario.seed,
            note=scenario.note,
        )


class PlayRequest(BaseModel):
    """``scenario`` is the name of one that is known."""

    model_config = ConfigDict(extra="forbid", json_schema_extra={"examples": [{"scenario": "mains_failure"}]})

    scenario: Annotated[str, Field(max_length=200)]
