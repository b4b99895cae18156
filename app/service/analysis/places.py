"""Where a node stands: which blade, which unit, what kind of device."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from app.model.station import station_slug
from app.recording.content import RecordingInfo
from app.recording.node_table import NodeKey, read_nodes


@dataclass(frozen=True, slots=True)
class Place:
    """A device of the recorded turbine. ``slug``: turbine/station/device."""

    slug: str
    description_id: str

    @property
    def station(self) -> str:
        """The station's slug, turbine included: what devices of one blade have in common."""
        return station_slug(self.slug)

    @property
    def blade(self) -> int | None:
        """Number of the blade; None at a bench or anywhere else."""
        name = self.station.rpartition("/")[2]
        number = name.removeprefix("blade-")
        return int(number) if number != name and number.isdecimal() else None

    @property
    def device(self) -> str:
        """The device's own slug: pmm, pmc."""
        return self.slug.rpartition("/")[2]


Places = Mapping[NodeKey, Place]


def places_of(info: RecordingInfo) -> dict[NodeKey, Place]:
    """The devices that a recording names. What it does not name is just a node number."""
    return {key: Place(*name) for key, name in read_nodes(info.nodes).items() if name.slug}


def stations_of(nodes: Iterable[NodeKey], places: Places) -> set[str]:
    """The stations of these nodes."""
    return {place.station for key in nodes if (place := places.get(key)) is not None}
