"""The blades of one turbine side by side: each kind of device that several blades have, one column a blade."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.errors import ColumnError
from app.model.site import Turbine
from app.service.compare.comparison import Compared, compare_columns
from app.service.compare.sources import Columns
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
        found = [
            (station.blade, device)
            for station in turbine.stations
            for device in station.devices
            if station.blade is not None and device.description_id == description_id
        ]
        specs = {blade: str(ColumnSpec(kind, device.slug)) for blade, device in found}
        there = await _there(columns, list(specs.values()))
        blades = tuple(blade for blade, spec in specs.items() if spec in there)
        if len(blades) > 1:
            compared = await compare_columns(columns, [specs[blade] for blade in blades], everything=everything)
            without = tuple(blade for blade in specs if blade not in blades)
            name = compared.columns[0].column.description.name
            parts.append(Part(description_id, name, blades, without, compared))
    return tuple(parts)


async def _there(columns: Columns, specs: Sequence[str]) -> set[str]:
    """The columns that can be shown."""
    found = set()
    for spec in specs:
        try:
            await columns.resolve(spec)
        except ColumnError:
            continue
        found.add(spec)
    return found
