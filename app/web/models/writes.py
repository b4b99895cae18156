"""A batch of changes, as the page sends it once it was reviewed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, StrictInt, StrictStr

RawIn = StrictInt | StrictFloat | Annotated[StrictStr, Field(max_length=60_000)]


class WritesRow(BaseModel):
    """One object. ``expected_raw`` is what RAM held when the change was made; null leaves that unchecked."""

    model_config = ConfigDict(extra="forbid")

    device: Annotated[str, Field(max_length=200)]
    address: Annotated[str, Field(max_length=40)]
    raw: RawIn
    expected_raw: RawIn | None = None


class WritesRequest(BaseModel):
    """``save`` names the devices whose verified values are made permanent; with "stop" nothing follows a failure.

    ``accepted``: rules that hold after every write elsewhere may be broken on the way where they are broken in the end.
    ``address_confirmed``: the person knows that the device will be found at another address (``address_changes`` of the
    plan); without it what decides the address is refused.
    """

    model_config = ConfigDict(extra="forbid")

    rows: Annotated[list[WritesRow], Field(min_length=1, max_length=500)]
    save: Annotated[list[Annotated[str, Field(max_length=200)]], Field(max_length=100)]
    on_failure: Literal["stop", "go-on"] = "stop"
    accepted: bool = False
    address_confirmed: bool = False
