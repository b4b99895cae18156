"""Turbines that are known, the one that is connected, and the descriptions of its devices."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from app.model.od_export import description_dict
from app.model.roles import Role
from app.service.shown import LiveShown, Shown
from app.service.stage import Stage
from app.service.stop import is_axis
from app.service.verify import verifiable
from app.web.deps import BenchOf, PersonOf, ShownOf, StageOf, needs, reads_both
from app.web.models import BusRef, ConnectRequest, DeviceRef, KnownTurbine, Nothing, StationRef, Turbine
from app.web.problem import NotFoundError

router = APIRouter()


@router.get("/turbines")
async def turbines(bench: BenchOf) -> list[KnownTurbine]:
    """All turbines that the bench knows, and which of them is connected."""
    connected = None if bench.connection is None else bench.connection.turbine.slug
    return [
        KnownTurbine(
            slug=one.slug,
            name=one.name,
            buses=[bus.connection for bus in one.buses],
            blades=sum(station.blade is not None for station in one.stations),
            connected=slug == connected,
        )
        for slug, one in bench.sites.turbines.items()
    ]


@router.post("/live/connect", dependencies=[needs(Role.TECHNICIAN)])
async def connect(bench: BenchOf, person: PersonOf, request: ConnectRequest) -> Turbine:
    """Connect to a turbine; the connection that there is ends first."""
    if request.turbine not in bench.sites.turbines:
        raise NotFoundError(what=request.turbine)
    await bench.connect(request.turbine, person.person)
    return _turbine(LiveShown(bench), bench.require())


@router.post("/live/disconnect", dependencies=[needs(Role.TECHNICIAN)])
async def disconnect(bench: BenchOf, person: PersonOf, _request: Nothing) -> Nothing:
    """End the connection and its recording."""
    await bench.disconnect(person.person)
    return Nothing()


@router.post("/live/consent", dependencies=[needs(Role.TECHNICIAN)])
async def consent(bench: BenchOf, person: PersonOf, _request: Nothing) -> Nothing:
    """Consent to active access beside another master, as agreed with its operator."""
    await bench.consent(person.person)
    return Nothing()


async def turbine(shown: ShownOf) -> Turbine | None:
    """The turbine that is shown, with its stations and devices; null where none is connected."""
    return None if shown.stage is None else _turbine(shown, shown.stage)


def _turbine(shown: Shown, stage: Stage) -> Turbine:
    site, axes = stage.turbine, {target.slug for target in stage.targets if is_axis(target)}
    link, verifies = shown.link(), verifiable(stage)
    adapter = next((bus.connection for bus in site.buses if bus.name == link.bus), "")
    stations = [
        StationRef(
            slug=station.slug,
            name=station.name,
            blade=station.blade,
            devices=[
                DeviceRef(
                    slug=one.slug,
                    node=one.node,
                    description_id=one.description_id,
                    name=one.name,
                    axis=one.slug in axes,
                    verifies=one.slug in verifies,
                )
                for one in station.devices
            ],
        )
        for station in site.stations
    ]
    bus = BusRef(name=link.bus, bitrate=link.bitrate, interface=adapter)
    return Turbine(slug=site.slug, name=site.name, mode=link.mode, bus=bus, stations=stations)


async def description(stage: StageOf, description_id: str) -> dict[str, Any]:
    """Everything that is known of a device's objects."""
    found = next((one.description for one in stage.targets if one.description.id == description_id), None)
    if found is None:
        raise NotFoundError(what=description_id)
    return description_dict(found)


reads_both(router, "turbine", turbine)
reads_both(router, "descriptions/{description_id}", description)
