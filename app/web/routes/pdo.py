"""PDOs of a device: how they are set up, what an edit would do, applying it, and putting the last change back."""

from __future__ import annotations

from typing import Annotated, Final

from fastapi import APIRouter, Depends

from app.model.pdo.findings import is_stop_path
from app.model.pdo.load import estimate
from app.model.pdo.setup import PdoPlace, PdoSetup, objects_of, places_of
from app.model.roles import Role
from app.service.bench import Bench
from app.service.devices import Target
from app.service.pdo.desk import Worker, preview
from app.service.pdo.look import Seen, is_operational, mappable, measured_hz, seen_on, setups_of
from app.service.stage import Stage
from app.web.deps import (
    DEVICE,
    BenchOf,
    ConnectionOf,
    JobsOf,
    JournalOf,
    PersonOf,
    StageOf,
    TargetOf,
    needs,
    reads_both,
)
from app.web.models import JobDoc
from app.web.models.pdo import (
    PdoApply,
    PdoCost,
    PdoDoc,
    PdoEdits,
    PdoFinding,
    PdoLoadDoc,
    PdoMappable,
    PdoPreview,
    PdosDoc,
    PdoSetupDoc,
    PdoUndo,
    PdoUndoRequest,
    PdoWriteDoc,
)
from app.web.problem import NotFoundError
from app.web.routes.jobs import job_doc
from app.web.routes.motion import DeskOf

router = APIRouter()
TECHNICIAN = needs(Role.TECHNICIAN)
SOUND_LOAD: Final = 0.6
"""Above this share of the bit rate frames of low priority come noticeably late."""
PDOS = DEVICE + "/pdos"


def get_worker(
    bench: BenchOf, connection: ConnectionOf, motion: DeskOf, person: PersonOf, journal: JournalOf, jobs: JobsOf
) -> Worker:
    """Who asks; the page is filled in by the route. Raises NotConnectedError."""
    return Worker(person.person, "", connection, motion, journal, jobs)


WorkerOf = Annotated[Worker, Depends(get_worker)]


async def device_pdos(bench: BenchOf, stage: StageOf, turbine: str, station: str, device: str) -> PdosDoc:
    """How the PDOs of a device are set up, as far as the wire has told; nothing is sent."""
    slug = f"{turbine}/{station}/{device}"
    target = next((one for one in stage.targets if one.slug == slug), None)
    if target is None:
        raise NotFoundError(what=slug)
    return _pdos_doc(bench, stage, target, is_live=stage is bench.connection)


reads_both(router, "devices/{turbine}/{station}/{device}/pdos", device_pdos)


@router.post(f"{PDOS}/preview", dependencies=[TECHNICIAN])
async def preview_pdos(bench: BenchOf, connection: ConnectionOf, target: TargetOf, given: PdoEdits) -> PdoPreview:
    """What an edit would do: findings, the writes in their order, and the load of the bus. Nothing is sent."""
    found = preview(connection, target, [edit.edit() for edit in given.edits])
    return PdoPreview(
        findings=[PdoFinding.of(one) for one in found.findings],
        writes=[PdoWriteDoc.of(one) for one in found.writes],
        cost=PdoCost.of(found.cost, bench.polling.plan.load_cap, SOUND_LOAD),
    )


@router.post(f"{PDOS}/apply", dependencies=[TECHNICIAN])
async def apply_pdos(bench: BenchOf, worker: WorkerOf, target: TargetOf, given: PdoApply) -> JobDoc:
    """Write an edit in the background: all of it, or, where anything fails, what stood before stands again."""
    edits = [edit.edit() for edit in given.edits]
    return job_doc(await bench.pdos.apply(worker.at(given.page), target, edits))


@router.post(f"{PDOS}/undo", dependencies=[TECHNICIAN])
async def undo_pdos(bench: BenchOf, worker: WorkerOf, target: TargetOf, given: PdoUndoRequest) -> JobDoc:
    """Put the last change of the device back, in the background."""
    return job_doc(await bench.pdos.undo(worker.at(given.page), target))


def _pdos_doc(bench: Bench, stage: Stage, target: Target, is_live: bool) -> PdosDoc:
    places, setups = places_of(target.description), setups_of(target)
    feed, seen = stage.buses[target.device.bus], seen_on(stage, target.device.bus)
    runs = is_operational(target)
    objects = [address for place in places for address in objects_of(place)]
    change = bench.pdos.kept.of(target.slug) if is_live else None
    stand = bench.pdos.undo_stand(target) if is_live else None
    return PdosDoc(
        device=target.slug,
        operational=runs,
        keeps=bool(objects) and all(target.entry(address).saved for address in objects),
        unread=[address.short for address in objects if target.lookup(address) is None],
        pdos=[_pdo_doc(place, setups.get(place.id), seen, feed.bitrate, runs is True) for place in places],
        mappable=[
            PdoMappable(object=one.address.short, bits=one.bits, rpdo=one.receive, tpdo=one.transmit)
            for one in mappable(target.description)
        ],
        sync_per_second=seen.sync_hz,
        bitrate=feed.bitrate,
        bus_load=round(feed.bus_load(stage.stamper()), 5),
        undo=None if change is None or stand is None else PdoUndo.of(change, stand),
    )


def _pdo_doc(place: PdoPlace, setup: PdoSetup | None, seen: Seen, bitrate: int, runs: bool) -> PdoDoc:
    key = None if setup is None else (setup.parameters.can_id, setup.parameters.extended)
    heard = setup is not None and setup.enabled and key in seen.latest_ns
    load = None
    if setup is not None:
        load = estimate(setup, bitrate, seen.sync_hz, measured_hz(setup, seen) if runs else None)
    return PdoDoc(
        direction=place.id.direction.value,
        number=place.id.number,
        subs=sorted(place.subs),
        room=place.room,
        setup=None if setup is None else PdoSetupDoc.of(setup),
        load=None if load is None else PdoLoadDoc.of(load),
        seen_t_ns=seen.latest_ns[key] if heard and key is not None else None,
        per_second=seen.per_second[key] if heard and key is not None else None,
        stop_path=setup is not None and is_stop_path(setup),
    )
