"""The library of parameter sets: list, values, tags, files in and out, nameplates, and the backup of a turbine."""

from __future__ import annotations

import asyncio
import base64
import binascii
import time
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response

from app import __version__
from app.errors import HubsideError, UsageError
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.od_export import description_dict
from app.model.roles import Role
from app.model.set_csv import dump_csv
from app.model.set_dcf import dump_dcf
from app.model.set_head import Imported, Taking
from app.model.set_import import read_set_file
from app.model.set_record import SetRecord, Source, Tag
from app.model.sets import Origin, ParameterSet, dump_set, iso_time
from app.service.backup import ReadReport, read_devices, readable, whole_sets, write_sets
from app.service.bench import Bench
from app.service.devices import Target
from app.service.jobs import Job
from app.service.library.folder import Looked, SetFolder
from app.service.library.recovered import recover_sets
from app.service.views import raw_to_json
from app.store.set_rows import Filter
from app.web.attachment import as_attachment
from app.web.deps import BenchOf, ConnectionOf, JobsOf, Needs, PersonOf, needs
from app.web.models import JobDoc
from app.web.models.sets import (
    BackupRequest,
    BadSetFile,
    FormatName,
    NamelessNode,
    NameplateDoc,
    NameplateTyped,
    RecoveredSet,
    RecoveredSets,
    SeenDoc,
    SetDoc,
    SetImport,
    SetList,
    SetRecordDoc,
    SetTaken,
    TagChange,
    TagName,
    UnknownObject,
)
from app.web.problem import NotFoundError
from app.web.routes.jobs import job_doc
from app.web.routes.recordings import RecordingsOf
from app.wire.records import SdoAccess

router = APIRouter()


def get_folder(request: Request, bench: Bench) -> SetFolder | None:
    """The set files of this server's data folder; None where it has none."""
    if bench.options.data is None:
        return None
    state = request.app.state
    if not hasattr(state, "sets"):
        state.sets = SetFolder(bench.options.data / "sets", bench.office.store, bench.office.library)
    folder: SetFolder = state.sets
    return folder


def descriptions_of(bench: Bench) -> dict[str, Description]:
    """What is known of devices: our own descriptions, and those of the connected turbine."""
    live = () if bench.connection is None else bench.connection.targets
    return {name: load_builtin(name) for name in BUILTIN} | {one.description.id: one.description for one in live}


def described(bench: Bench, description_id: str) -> Description:
    """One description. Raises NotFoundError."""
    found = descriptions_of(bench).get(description_id)
    if found is None:
        raise NotFoundError(what=description_id)
    return found


@router.get("/sets")
async def sets(
    request: Request,
    bench: BenchOf,
    turbine: Annotated[str | None, Query(max_length=200)] = None,
    device: Annotated[str | None, Query(max_length=200)] = None,
    description_id: Annotated[str | None, Query(max_length=64)] = None,
    tag: TagName | None = None,
    limit: Annotated[int, Query(ge=1, le=20_000)] = 5000,
) -> SetList:
    """The library, latest first, after a look at the set files of the data folder."""
    library, folder = bench.office.library, get_folder(request, bench)
    looked = Looked((), 0) if folder is None else await folder.look()
    wanted = Filter(turbine, device, description_id, None if tag is None else Tag(tag), limit)
    tags = await library.tags()
    return SetList(
        folder=None if folder is None else str(folder.folder),
        records=[SetRecordDoc.of(one, tags.get(one.id, [])) for one in await library.records(wanted)],
        bad=[BadSetFile.of(row) for row in looked.bad],
        waiting=looked.waiting,
    )


@router.get("/sets/{key}")
async def parameter_set(bench: BenchOf, key: str) -> SetDoc:
    """One set with all its values; by its id, or by 8 or more digits of its hash."""
    library = bench.office.library
    record = await library.record(key)
    found, evidence = await library.set_of(record), await library.evidence(record)
    seen = {} if evidence is None else evidence[1]
    return SetDoc(
        record=await _doc(bench, record),
        values={address.short: raw_to_json(raw) for address, raw in found.values.items()},
        unread={address.short: why for address, why in found.unread.items()},
        empty=[address.short for address in found.empty],
        recording=None if evidence is None else evidence[0],
        seen=None
        if evidence is None
        else {one.short: SeenDoc.model_validate(seen[str(one)]) for one in found.values if str(one) in seen},
    )


@router.get("/sets/{key}/download")
async def download_set(bench: BenchOf, key: str, format: FormatName = "json") -> Response:
    """The set as a file: canonical JSON, DCF (CANopen devices only) or CSV."""
    library = bench.office.library
    found = await library.set_of(await library.record(key))
    text, name, media = await asyncio.to_thread(_file, found, format, descriptions_of(bench))
    return Response(text.encode(), media_type=f"{media}; charset=utf-8", headers=as_attachment(name))


@router.post("/sets/{key}/tags", dependencies=[needs(Role.TECHNICIAN)])
async def tag_set(bench: BenchOf, person: PersonOf, key: str, given: TagChange) -> SetRecordDoc:
    """Give a set a tag, or take it off; which set is golden is for experts to say."""
    tag = Tag(given.tag)
    if tag is Tag.GOLDEN:
        Needs(Role.EXPERT)(person)
    return await _doc(bench, await bench.office.library.tag(key, tag, person.person, given.on))


@router.post("/sets/import", dependencies=[needs(Role.TECHNICIAN)])
async def import_set(bench: BenchOf, person: PersonOf, given: SetImport) -> SetTaken:
    """Take a file into the library: JSON, DCF or CSV. A file that is damaged gives line and reason, and no set."""
    try:
        data = base64.b64decode(given.data, validate=True)
    except (ValueError, binascii.Error) as error:
        raise UsageError(reason="the file is no base64") from error
    origin = None if given.device is None else _origin(bench, given.device, person.person, given.reason)
    taking = Taking(descriptions_of(bench), origin, given.description_id, given.as_values)
    imported: Imported = await asyncio.to_thread(read_set_file, data, given.name, taking)
    record = await bench.office.library.take(imported, given.name, person.person)
    unknown = [UnknownObject.of(one) for one in imported.unknown]
    return SetTaken(record=await _doc(bench, record), unknown=unknown, foreign=imported.foreign)


@router.post("/recordings/{name}/recover-sets", dependencies=[needs(Role.TECHNICIAN)])
async def recover(bench: BenchOf, all_of_them: RecordingsOf, person: PersonOf, name: str) -> RecoveredSets:
    """Take what the SDO traffic of a recording showed of each device into the library."""
    path = all_of_them.path(name)
    if path is None:
        raise NotFoundError(what=name)
    found = await asyncio.to_thread(recover_sets, path, descriptions_of(bench))
    records = await bench.office.library.put_recovered(found, name, person.person)
    rows = []
    for one, record in zip(found.sets, records, strict=True):
        written = sum(look.access is SdoAccess.WRITE for look in one.seen.values())
        rows.append(
            RecoveredSet(
                record=await _doc(bench, record),
                read=len(one.seen) - written,
                written=written,
                doubtful=sum(look.doubt is not None for look in one.seen.values()),
                unknown=[address.short for address in one.unknown],
            )
        )
    nameless = [NamelessNode(bus=bus, node=node, values=count) for (bus, node), count in found.nameless.items()]
    return RecoveredSets(sets=rows, nameless=nameless, damages=found.damages)


@router.get("/nameplates")
async def nameplates(bench: BenchOf) -> list[NameplateDoc]:
    """The serial numbers that were typed, by device."""
    return [NameplateDoc.of(plate) for _, plate in sorted(bench.office.library.nameplates.items())]


@router.put("/nameplates", dependencies=[needs(Role.TECHNICIAN)])
async def put_nameplate(bench: BenchOf, person: PersonOf, given: NameplateTyped) -> NameplateDoc:
    """Keep the serial number on a device's plate; it must be the same twice."""
    library = bench.office.library
    return NameplateDoc.of(await library.set_nameplate(given.device, given.serial, given.again, person.person))


@router.get("/descriptions/{description_id}")
async def known_description(bench: BenchOf, description_id: str) -> dict[str, Any]:
    """The description of a kind of device, connected or not."""
    return description_dict(described(bench, description_id))


@router.post("/live/backup", dependencies=[needs(Role.TECHNICIAN)])
async def backup(
    request: Request, bench: BenchOf, connection: ConnectionOf, jobs: JobsOf, person: PersonOf, given: BackupRequest
) -> JobDoc:
    """Read every device of the turbine completely in the background, and keep a set of each."""
    pairs = [(connection.driver(target), target) for target in connection.targets]
    slug, folder = connection.turbine.slug, get_folder(request, bench)

    async def work(job: Job) -> None:
        done = dict.fromkeys((target.slug for _, target in pairs), 0)

        def progress(target: Target, count: int, _total: int) -> None:
            done[target.slug] = count
            job.done = sum(done.values())

        job.total = sum(len(readable(target.description)) for _, target in pairs)
        reports = await read_devices(pairs, progress)
        visit = bench.office.visits.current
        order = "" if visit is None else visit.work_order
        library = bench.office.library
        whole = whole_sets(reports, slug, person.person, given.reason, time.time_ns(), order)
        await bench.keep_found(reports, person.person)
        found = [library.identified(one) for one in whole]
        await library.put(found, Source.BACKUP)
        if folder is not None:
            await asyncio.to_thread(write_sets, folder.folder, found)
        job.failed = [failure for report in reports for failure in _failures(report)]
        job.done = job.total

    return job_doc(jobs.start("backup", slug, work))


def _failures(report: ReadReport) -> list[tuple[str, HubsideError]]:
    """What was not read of a device; one line where it is the device as a whole."""
    slug = report.target.slug
    if report.lost is not None:
        return [(slug, report.lost)]
    if not report.values:
        return [(slug, error) for error in list(report.failed.values())[:1]]
    return [(f"{slug} {address.short}", error) for address, error in report.errors.items()]


def _file(found: ParameterSet, kind: str, known: dict[str, Description]) -> tuple[str, str, str]:
    """Text, file name and media type. Raises NotFoundError where nothing describes the device, UsageError."""
    stem = f"{found.origin.device.replace('/', '_')}_{found.origin.time.replace(':', '').replace('-', '')}"
    if kind == "json":
        return dump_set(found), f"{stem}.json", "application/json"
    description = known.get(found.description_id)
    if kind == "csv":
        return dump_csv(found, description), f"{stem}.csv", "text/csv"
    if description is None:
        raise NotFoundError(what=found.description_id)
    return dump_dcf(found, description, f"{stem}.dcf"), f"{stem}.dcf", "text/plain"


def _origin(bench: Bench, device: str, person: str, reason: str) -> Origin:
    """Whose the values of a file are; the node's number of the site, where it knows the device."""
    turbine = device.partition("/")[0]
    known = bench.sites.turbines.get(turbine)
    found = None if known is None else known.device(device)
    node = 0 if found is None else found.node
    seconds_ns = time.time_ns() // 1_000_000_000 * 1_000_000_000
    return Origin(turbine, device, node, iso_time(seconds_ns), person, reason, f"hubside {__version__}")


async def _doc(bench: Bench, record: SetRecord) -> SetRecordDoc:
    tags = await bench.office.library.tags()
    return SetRecordDoc.of(record, tags.get(record.id, []))
