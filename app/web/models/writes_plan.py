"""The order in which a batch of changes would be written, as the page gets it for its review."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.model.restore.batch import Batch
from app.model.station import Place
from app.service.address_change import AddressChange
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


class WritesAddressChange(BaseModel):
    """A device that will be found elsewhere once it was saved and restarted; its rows need a confirmation.

    ``connected``: where it is reached now. ``site_address``: what the site file must name then; null where nobody can
    tell beforehand (DHCP, or the bus itself is switched).
    """

    device: str
    addresses: list[str]
    connected: str
    site_address: str | None

    @classmethod
    def of(cls, change: AddressChange) -> WritesAddressChange:
        """As the page gets it."""
        addresses = [address.short for address in change.addresses]
        return cls(
            device=change.device, addresses=addresses, connected=change.connected, site_address=change.site_address
        )


class WritesPlan(BaseModel):
    """In which order a batch would be written, by what is known now.

    ``unordered``: no order keeps the rules that hold after every write; ``broken``: those of them that are broken once
    all is written. ``unknown``: not known yet, and read before the first write, so that the order may become another.
    """

    rows: list[RulePlace]
    unordered: list[RulePlace]
    unknown: list[RulePlace]
    broken: list[RuleFinding]
    address_changes: list[WritesAddressChange]

    @classmethod
    def of(cls, batch: Batch, unknown: Iterable[Place], moved: Iterable[AddressChange]) -> WritesPlan:
        """As the page gets it."""
        return cls(
            rows=_places(batch.places),
            unordered=_places(batch.unordered),
            unknown=_places(unknown),
            broken=[RuleFinding.of(one) for one in batch.broken],
            address_changes=[WritesAddressChange.of(one) for one in moved],
        )


def _places(places: Iterable[Place]) -> list[RulePlace]:
    return [RulePlace(device=one.slug, address=one.address.short) for one in places]
