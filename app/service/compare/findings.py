"""Which rules the columns of a comparison break: each is judged beside its partner at the same station."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from app.errors import ColumnError
from app.model.address import Address
from app.model.rules.check import check_station
from app.model.rules.rule import Verdict
from app.model.station import DeviceValues, StationValues
from app.service.compare.sources import Columns, Pending, Shown
from app.service.compare.spec import ColumnKind, ColumnSpec

Findings = Mapping[Address, Mapping[str, Sequence[int]]]
"""The rules that are broken at each address, the gravest first, and in which columns."""


async def findings_of(columns: Columns, shown: Sequence[Shown], pending: Pending | None = None) -> Findings:
    """Judge every column. A set stands for itself: a rule that needs its partner finds nothing."""
    found: dict[Address, dict[str, list[int]]] = {}
    for number, one in enumerate(shown):
        own = _values(one)
        station = StationValues((own, *[_values(other) for other in await _partners(columns, one, pending)]))
        for finding in check_station(station):
            if finding.verdict is Verdict.BROKEN:
                for place in finding.places:
                    if place.slug == own.slug:
                        numbers = found.setdefault(place.address, {}).setdefault(finding.rule_id, [])
                        numbers += [number] if number not in numbers else []
    return found


async def _partners(columns: Columns, shown: Shown, pending: Pending | None) -> list[Shown]:
    """The same column of the other devices of the station, where there is such a one.

    Of what stands in RAM, or did at one time, that is what they had then; defaults and model sets go together.
    """
    spec = shown.spec
    if not spec.kind.of_device or (spec.kind is ColumnKind.GOLDEN and "/" not in spec.of):
        return []
    found = []
    for slug in columns.ground.partners(spec.of):
        try:
            found.append(await columns.resolve(str(ColumnSpec(spec.kind, slug)), pending))
        except ColumnError:
            continue  # of the partner there is no such column: what needs it is not checked
    return found


def _values(shown: Shown) -> DeviceValues:
    """A column as rules see it, with the slug of the device that it is asked for: a model set may be of another."""
    slug = shown.spec.of if shown.spec.kind.of_device else shown.column.slug
    return DeviceValues(slug, shown.column.description, shown.column.values)
