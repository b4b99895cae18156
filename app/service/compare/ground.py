"""What a comparison can draw on: the server's bench, or what one command has at hand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from app.errors import HubsideError
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.sets import ParameterSet
from app.model.site import Device
from app.model.station import station_slug
from app.service.bench import Bench
from app.service.devices import Target
from app.service.library.library import Library
from app.service.office.visits import Visits
from app.service.replay.moments import Moments
from app.service.sites import Sites


@dataclass(frozen=True, slots=True)
class Ground:
    """``targets`` are the connected devices, ``read`` what was read of them just now, by slug, where it was.

    ``files``: columns may be files, as a person names them who sits at this computer.
    """

    stamp: Callable[[], int]
    targets: tuple[Target, ...] = ()
    sites: Sites | None = None
    library: Library | None = None
    visits: Visits | None = None
    read: Mapping[str, ParameterSet] = field(default_factory=dict)
    known: tuple[Description, ...] = ()
    files: bool = False
    moments: Moments | None = None

    def target(self, slug: str) -> Target | None:
        """A connected device."""
        return next((one for one in self.targets if one.slug == slug), None)

    def device(self, slug: str) -> tuple[Device, Description] | None:
        """A device of any turbine that is known. Raises DescriptionError."""
        target = self.target(slug)
        if target is not None:
            return target.device, target.description
        for turbine in () if self.sites is None else self.sites.turbines.values():
            for device in turbine.devices:
                if device.slug == slug and self.sites is not None:
                    return device, self.sites.describe(turbine)[device.description_id]
        return None

    def partners(self, slug: str) -> tuple[str, ...]:
        """The other devices of its station."""
        turbines = () if self.sites is None else self.sites.turbines.values()
        known = [target.slug for target in self.targets] + [one.slug for each in turbines for one in each.devices]
        station = station_slug(slug)
        return tuple(dict.fromkeys(one for one in known if one != slug and station_slug(one) == station))

    def description(self, description_id: str) -> Description | None:
        """What describes that kind of device."""
        return next((one for one in self.descriptions() if one.id == description_id), None)

    def descriptions(self) -> Iterator[Description]:
        """All that are known: those of the connected devices, then the sites', then ours."""
        yield from (target.description for target in self.targets)
        yield from self.known
        for turbine in () if self.sites is None else self.sites.turbines.values():
            yield from _described(self.sites, turbine.slug)
        yield from (load_builtin(name) for name in BUILTIN)


def _described(sites: Sites | None, turbine: str) -> Iterable[Description]:
    if sites is None:
        return ()
    try:
        return tuple(sites.describe(sites.turbine(turbine)).values())
    except HubsideError:
        return ()  # a file of another turbine is wrong or gone: not what is asked for here


def ground_of(bench: Bench) -> Ground:
    """What a server has now."""
    connection = bench.connection
    return Ground(
        stamp=bench.stamper,
        targets=() if connection is None else tuple(connection.targets),
        sites=bench.sites,
        library=bench.office.library,
        visits=bench.office.visits,
        moments=bench.moments,
    )
