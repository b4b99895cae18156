"""What a person keeps of the replay desk: named views of plots."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class DeskView(BaseModel):
    """Plots under a name, as a link holds them: signals without their turbine, so that they fit any of the kind."""

    model_config = ConfigDict(extra="forbid")

    name: Annotated[str, Field(min_length=1, max_length=80)]
    plots: Annotated[str, Field(min_length=1, max_length=4000)]


class DeskViews(BaseModel):
    """The views of a person, in the person's own order; each name once."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [{"views": [{"name": "mains", "plots": "blade-1/pmm/3062,blade-2/pmm/3062;blade-1/pmm/3063"}]}]
        },
    )

    views: Annotated[list[DeskView], Field(max_length=100)]
