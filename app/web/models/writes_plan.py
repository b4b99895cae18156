"""The order in which a batch of changes would be written, as the page gets it for its review."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.model.restore.batch import Batch
from app.model.station import Place
from app.web.models.rules import RuleFinding, RulePlace
from app.web.models.writes import WritesRow


class WritesPlanRequest(BaseModel):
    """The changes of a batch that is not ordered yet."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [{"rows": [{"device": "wtg-07/blade-2/pmm", "address": "30FA:02", "raw": 780}]}],
        },
    )

    rows: Annotated[list[WritesRow], Field(min_length=1, max_length=500)]
    accepted: bool = False


class WritesPlan(BaseModel):
    """In which order a batch would be written, by what is known now.

    ``unordered``: no order keeps the rules that hold after every write; ``broken``: those of them that are broken once
    all is written. ``unknown``: not known yet, and read before the first write, so that the order may become another.
    """

    rows: list[RulePlace]
    unordered: list[RulePlace]
    unknown: list[RulePlace]
    broken: list[RuleFinding]

    @classmethod
    def of(cls, batch: Batch, unknown: Iterable[Place]) -> WritesPlan:
        """As the page gets it."""
        return cls(
            rows=_places(batch.places),
            unordered=_places(batch.unordered),
            unknown=_places(unknown),
            broken=[RuleFinding.of(one) for one in batch.broken],
        )


def _places(places: Iterable[Place]) -> list[RulePlace]:
    return [RulePlace(device=one.slug, address=one.address.short) for one in places]
