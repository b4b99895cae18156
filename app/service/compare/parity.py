"""The blades of one turbine side by side: each kind of device that several blades have, one column a blade."""

from __future__ import annotations

from dataclasses import dataclass

from app.errors import ColumnError
from app.model.site import Device, Turbine
from app.service.compare.comparison import Compared, compare_shown
from app.service.compare.sources import Columns, Shown
from app.service.compare.spec import ColumnKind, ColumnSpec


@dataclass(frozen=True, slots=True)
class Part:
    """One kind of device: the blades in the order of the columns, and what differs between them.

    ``without`` are the blades of which there is no such column, as of those that no visit has seen.
    """

    description_id: str
    name: str
    blades: tuple[int, ...]
    without: tuple[int, ...]
    compared: Compared


async def compare_blades(
    columns: Columns, turbine: Turbine, kind: ColumnKind, everything: bool = False
) -> tuple[Part, ...]:
    """Compare the blades of ``turbine``. Raises StoreError, SetFileError, DescriptionError.

    A blade without a column is left out of its part; a part of fewer than two blades is not there.
    """
    parts = []
    for description_id in dict.fromkeys(device.description_id for device in turbine.devices):
        shown: list[tuple[int, Shown]] = []
        without: list[int] = []
        for blade, device in _devices(turbine, description_id):
            try:
                shown.append((blade, await columns.resolve(str(ColumnSpec(kind, device.slug)))))
            except ColumnError:
                without.append(blade)
        if len(shown) > 1:
            compared = await compare_shown(columns, [one for _blade, one in shown], everything=everything)
            name = compared.columns[0].column.description.name
            blades = tuple(blade for blade, _one in shown)
            parts.append(Part(description_id, name, blades, tuple(without), compared))
    return tuple(parts)


def _devices(turbine: Turbine, description_id: str) -> list[tuple[int, Device]]:
    """The devices of that kind at the blades."""
    return [
        (station.blade, device)
        for station in turbine.stations
        for device in station.devices
        if station.blade is not None and device.description_id == description_id
    ]
