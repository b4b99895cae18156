"""Settings: adapters of this machine, the site file, what is polled, what the program is made of."""

from __future__ import annotations

import asyncio
from collections import Counter

from fastapi import APIRouter

from app.drivers.adapters import Place
from app.drivers.can_config import BITRATES_OF
from app.errors import HubsideError, RestoreOpenError, SiteError, UsageError
from app.model.address import Address, parse_address
from app.model.description import Bus, Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.roles import Role, SignedIn
from app.model.servers import Server, parse_server
from app.model.site import MAX_NODE, BusConfig, Device, Turbine
from app.model.slaves import PROFIBUS, SlaveSetup
from app.service import about as about_program
from app.service.adapters import (
    Heard,
    NamedAdapter,
    ScanResult,
    SearchResult,
    configured,
    find_bitrate,
    in_use,
    listen_to,
    overview,
    scan_adapter,
)
from app.service.bench import Bench
from app.service.identify import Asked, ask_address
from app.service.jobs import Job
from app.service.line_scan import scan_line
from app.service.polling import PollPlan, Rate, read_bits, usual_list
from app.service.site_check import changes_a_stop
from app.service.site_edit import propose, turbine_of
from app.web.deps import BenchOf, JobsOf, JournalOf, Needs, PersonOf, needs
from app.web.models.settings import (
    AboutDoc,
    AdapterDoc,
    AdaptersDoc,
    BusDoc,
    DescriptionRef,
    FoundDoc,
    HeardDoc,
    IdentifiedDoc,
    IdentifyRequest,
    LibraryDoc,
    MasterDoc,
    PlaceDoc,
    PollBus,
    PollChoice,
    PollDevice,
    PollingChange,
    PollingDoc,
    PollItem,
    RateTriedDoc,
    ScanDoc,
    ScanRequest,
    SearchDoc,
    SearchRequest,
    SettingsJobDoc,
    SiteDeviceDoc,
    SiteDoc,
    SiteStationDoc,
    SiteTurbineDoc,
    TestRequest,
    TurbineChange,
)
from app.web.problem import NotFoundError, failure

router = APIRouter(prefix="/settings")
KINDS = ("adapter_test", "bitrate_search", "adapter_scan", "address_identify")


# -- adapters -------------------------------------------------------------------------


@router.get("/adapters")
async def adapters(bench: BenchOf) -> AdaptersDoc:
    """The adapters of this machine and of the site. Nothing is opened."""
    seen = await overview(bench.sites.turbines.values(), bench.connection)
    return AdaptersDoc(
        adapters=[_adapter_doc(one) for one in seen.adapters], places=[_place_doc(one) for one in seen.places]
    )


def _adapter_doc(named: NamedAdapter) -> AdapterDoc:
    one = named.adapter
    return AdapterDoc(
        connection=one.connection,
        interface=one.interface.value,
        title=one.title,
        silent=one.silent,
        sets_bitrate=one.sets_bitrate,
        bitrates=sorted(BITRATES_OF.get(one.interface, ())),
        found=named.found,
        turbines=list(named.turbines),
        in_use=named.in_use,
    )


def _place_doc(place: Place) -> PlaceDoc:
    return PlaceDoc(
        interface=place.interface.value, health=place.health.value, reason=place.reason, found=len(place.adapters)
    )


@router.post("/adapters/test", dependencies=[needs(Role.TECHNICIAN)])
async def start_test(bench: BenchOf, jobs: JobsOf, request: TestRequest) -> SettingsJobDoc:
    """Listen with an adapter for some seconds; nothing is sent."""
    config = configured(request.connection, request.bitrate)
    link = in_use(bench.connection, request.connection)
    return _job_doc(jobs.start(KINDS[0], "", lambda job: listen_to(job, config, request.sure, link)))


@router.post("/adapters/bitrate", dependencies=[needs(Role.TECHNICIAN)])
async def start_search(bench: BenchOf, jobs: JobsOf, request: SearchRequest) -> SettingsJobDoc:
    """Find the bit rate by listening at one after the other, with an adapter that can be silent."""
    link = in_use(bench.connection, request.connection)
    return _job_doc(jobs.start(KINDS[1], "", lambda job: find_bitrate(job, request.connection, link)))


@router.post("/scan", dependencies=[needs(Role.TECHNICIAN)])
async def start_scan(bench: BenchOf, jobs: JobsOf, request: ScanRequest) -> SettingsJobDoc:
    """Ask every node of a bus what it is, or every address of a PROFIBUS line."""
    if request.connection.startswith(PROFIBUS):
        line = BusConfig("line", request.connection, request.bitrate, master=request.master)
        stations = [one for one in _known(bench).values() if one.bus is Bus.PROFIBUS_DP]
        return _job_doc(jobs.start(KINDS[2], "", lambda job: scan_line(job, line, stations, bench.connection)))
    config = configured(request.connection, request.bitrate)
    link = in_use(bench.connection, request.connection)
    known = _known(bench).values()
    can = [one for one in known if one.bus is Bus.CANOPEN]
    return _job_doc(jobs.start(KINDS[2], "", lambda job: scan_adapter(job, config, can, request.consent, link)))


@router.post("/identify", dependencies=[needs(Role.TECHNICIAN)])
async def start_identify(bench: BenchOf, jobs: JobsOf, request: IdentifyRequest) -> SettingsJobDoc:
    """Ask exactly this address of Modbus TCP who is there; a bus of the site must allow it."""
    try:
        server = parse_server(request.address)
    except ValueError as error:
        raise UsageError(reason=str(error)) from error
    turbines = tuple(bench.sites.turbines.values())
    known = [one for one in _known(bench).values() if one.bus is Bus.MODBUS_TCP]
    connection = bench.connection
    return _job_doc(jobs.start(KINDS[3], "", lambda job: ask_address(job, server, turbines, known, connection)))


@router.get("/jobs/{job_id}")
async def settings_job(jobs: JobsOf, job_id: str) -> SettingsJobDoc:
    """How the work on an adapter stands, with what it has found so far."""
    job = jobs.get(job_id)
    if job is None or job.kind not in KINDS:
        raise NotFoundError(what=job_id)
    return _job_doc(job)


def _job_doc(job: Job) -> SettingsJobDoc:
    result = job.result
    return SettingsJobDoc(
        id=job.id,
        kind=job.kind,
        state=job.state.value,
        done=job.done,
        total=job.total,
        error=None if job.error is None else failure("", job.error),
        heard=_heard_doc(result) if isinstance(result, Heard) else None,
        search=_search_doc(result) if isinstance(result, SearchResult) else None,
        scan=_scan_doc(result) if isinstance(result, ScanResult) else None,
        identified=_identified_doc(result) if isinstance(result, Asked) else None,
    )


def _identified_doc(asked: Asked) -> IdentifiedDoc | None:
    found = asked.found
    if found is None:
        return None
    return IdentifiedDoc(
        address=str(Server(*asked.peer[1:])),
        description_id=found.description_id,
        variant=asked.variant,
        device_name=found.device_name or None,
        hardware=found.hardware or None,
        software=found.software or None,
        serial=asked.serial,
        twin=found.is_twin,
    )


def _heard_doc(heard: Heard) -> HeardDoc:
    masters = [MasterDoc(sign=one.sign.value, can_id=one.can_id, times=one.times) for one in heard.masters]
    return HeardDoc(
        connection=heard.connection,
        bitrate=heard.bitrate,
        shared=heard.shared,
        silent=heard.silent,
        heard_s=heard.heard_s,
        frames=heard.frames,
        errors=heard.errors,
        frames_per_s=heard.frames / heard.heard_s if heard.heard_s else 0.0,
        load=heard.load,
        nodes=list(heard.nodes),
        masters=masters,
        verdict=heard.verdict.value,
    )


def _search_doc(search: SearchResult) -> SearchDoc:
    return SearchDoc(
        connection=search.connection,
        rates=list(search.rates),
        tried=[RateTriedDoc(bitrate=one.bitrate, frames=one.frames, errors=one.errors) for one in search.tried],
        trying=search.trying,
        bitrate=search.bitrate,
    )


def _scan_doc(scan: ScanResult) -> ScanDoc:
    found = [
        FoundDoc(
            node=one.found.node,
            device_type=one.found.device_type,
            device_name=one.found.device_name,
            hardware=one.found.hardware,
            software=one.found.software,
            vendor=one.found.identity.vendor,
            product=one.found.identity.product,
            revision=one.found.identity.revision,
            serial=one.found.identity.serial,
            description_id=one.found.description_id,
            twin=one.found.is_twin,
            station=one.station,
            blade=one.blade,
            device=one.device,
        )
        for one in propose(list(scan.found))
    ]
    return ScanDoc(connection=scan.connection, bitrate=scan.bitrate, found=found)


# -- the site -------------------------------------------------------------------------


@router.get("/site")
async def site(bench: BenchOf) -> SiteDoc:
    """The site file: turbines, buses, stations, devices."""
    return _site_doc(bench)


@router.post("/site/turbines", dependencies=[needs(Role.TECHNICIAN)])
async def add_turbine(bench: BenchOf, person: PersonOf, journal: JournalOf, request: TurbineChange) -> SiteDoc:
    """Add a turbine to the site file; one that says what stops an axis from outside is an expert's."""
    turbine = _turbine(request.turbine)
    _require_stops(bench, person, turbine)
    await bench.site_editor.add(turbine, request.revision, journal)
    return _site_doc(bench)


@router.put("/site/turbines/{slug}", dependencies=[needs(Role.TECHNICIAN)])
async def change_turbine(
    bench: BenchOf, person: PersonOf, journal: JournalOf, slug: str, request: TurbineChange
) -> SiteDoc:
    """Change a turbine of the site file; slugs are permanent. What stops an axis from outside is changed by experts."""
    turbine = _turbine(request.turbine)
    _require_stops(bench, person, turbine)
    await bench.site_editor.change(slug, turbine, request.revision, journal)
    return _site_doc(bench)


def _require_stops(bench: Bench, person: SignedIn, after: Turbine) -> None:
    """Raises RoleError. A revision that is another one by then is refused by the editor."""
    before = next((one for one in bench.site_editor.state().turbines if one.slug == after.slug), None)
    if changes_a_stop(before, after):
        Needs(Role.EXPERT)(person)


@router.delete("/site/turbines/{slug}", dependencies=[needs(Role.TECHNICIAN)])
async def remove_turbine(bench: BenchOf, journal: JournalOf, slug: str, revision: str) -> SiteDoc:
    """Take a turbine out of the site file; not the one that is connected, nor one with a restore to be finished."""
    for row in bench.restores.open:
        if row.turbine == slug:
            raise RestoreOpenError(station=row.station, restore=row.id, device=slug)
    connected = None if bench.connection is None else bench.connection.turbine
    await bench.site_editor.remove(slug, revision, connected, journal)
    return _site_doc(bench)


def _site_doc(bench: Bench) -> SiteDoc:
    state = bench.site_editor.state()
    known = _known(bench)
    return SiteDoc(
        file=None if state.file is None else str(state.file),
        made=state.made,
        problem=state.problem,
        revision=state.revision,
        connected=None if bench.connection is None else bench.connection.turbine.slug,
        turbines=[_turbine_doc(one) for one in state.turbines],
        descriptions=[_ref(key, one) for key, one in known.items() if one.bus in MAX_NODE],
    )


def _ref(key: str, description: Description) -> DescriptionRef:
    return DescriptionRef(id=key, name=description.name, bus=description.bus.value)


def _turbine_doc(turbine: Turbine) -> SiteTurbineDoc:
    # Not validated again: a file that was written by hand may hold more than the page would send.
    return SiteTurbineDoc.model_construct(
        slug=turbine.slug,
        name=turbine.name,
        buses=[
            BusDoc.model_construct(
                name=bus.name,
                connection=bus.connection,
                bitrate=bus.bitrate,
                heartbeat_node=bus.heartbeat_node,
                ranges=list(bus.ranges),
                master=bus.master,
            )
            for bus in turbine.buses
        ],
        stations=[
            SiteStationDoc.model_construct(
                slug=station.slug.split("/", 1)[1],
                name=station.name,
                blade=station.blade,
                devices=[
                    SiteDeviceDoc.model_construct(
                        slug=device.slug.rsplit("/", 1)[1],
                        name=device.name,
                        description_id=device.description_id,
                        bus=device.bus,
                        node=device.node,
                        address=device.address,
                        external_stop=device.external_stop,
                        telegram=device.slave.telegram,
                        pzd_order=device.slave.pzd_order,
                        gsd=device.slave.gsd,
                        modules=list(device.slave.modules),
                    )
                    for device in station.devices
                ],
            )
            for station in turbine.stations
        ],
    )


def _turbine(doc: SiteTurbineDoc) -> Turbine:
    _once("bus", [bus.name for bus in doc.buses])
    _once("station", [station.slug for station in doc.stations])
    for station in doc.stations:
        _once(f"station.{station.slug}.device", [device.slug for device in station.devices])
    buses = [
        BusConfig(bus.name, bus.connection, bus.bitrate, bus.heartbeat_node, tuple(bus.ranges), bus.master)
        for bus in doc.buses
    ]
    stations = [
        (
            station.slug,
            station.name,
            station.blade,
            [_device(one) for one in station.devices],
        )
        for station in doc.stations
    ]
    return turbine_of(doc.slug, doc.name, buses, stations)


def _device(doc: SiteDeviceDoc) -> Device:
    stop = doc.external_stop.strip()
    slave = SlaveSetup(doc.telegram, doc.pzd_order, doc.gsd.strip(), tuple(doc.modules))
    return Device(doc.slug, doc.name, doc.description_id, doc.bus, doc.node, doc.address.strip(), stop, slave)


def _once(key: str, slugs: list[str]) -> None:
    """A table of the file holds a name once; a list could name it twice. Raises SiteError."""
    twice = [slug for slug, times in Counter(slugs).items() if times > 1]
    if twice:
        raise SiteError(file="", key=f"{key}.{twice[0]}", reason="is named twice")


# -- polling --------------------------------------------------------------------------


@router.get("/polling")
async def polling(bench: BenchOf) -> PollingDoc:
    """What is polled, how often, and how much of each known bus that takes."""
    return _polling_doc(bench, bench.polling.plan)


@router.put("/polling", dependencies=[needs(Role.TECHNICIAN)])
async def change_polling(bench: BenchOf, journal: JournalOf, request: PollingChange) -> PollingDoc:
    """Change what is polled; in force with the next round."""
    lists = {
        name: {parse_address(address): Rate(rate) for address, rate in items.items()}
        for name, items in request.devices.items()
    }
    plan = PollPlan(request.period_s, request.slow_every, request.rare_every, request.load_cap, lists)
    await bench.polling.change(plan, _known(bench), journal)
    return _polling_doc(bench, bench.polling.plan)


@router.get("/polling/choices/{description_id}")
async def poll_choices(bench: BenchOf, description_id: str) -> list[PollChoice]:
    """What can be read of such a device."""
    description = _known(bench).get(description_id)
    if description is None:
        raise NotFoundError(what=description_id)
    return [
        PollChoice(address=address.short, name=entry.name, group=entry.group, bits=read_bits(entry))
        for address, entry in description.entries.items()
        if entry.access.readable
    ]


def _known(bench: Bench) -> dict[str, Description]:
    """Every description that the program or a turbine of the site has, by id."""
    known = {name: load_builtin(name) for name in BUILTIN}
    for turbine in bench.sites.turbines.values():
        try:
            known.update(bench.sites.describe(turbine))
        except HubsideError:
            continue  # an EDS file of another turbine that is gone: connecting to it will say so
    return known


def _polling_doc(bench: Bench, plan: PollPlan) -> PollingDoc:
    known = _known(bench)
    counts = {
        (turbine.slug, bus.name): (
            _bitrate(bus),
            Counter(device.description_id for device in turbine.devices if device.bus == bus.name),
        )
        for turbine in bench.sites.turbines.values()
        for bus in turbine.buses
    }
    used = {name for _rate, here in counts.values() for name in here}
    used |= plan.lists.keys()
    shown = {name: one for name, one in known.items() if name in used or (one.bus is Bus.CANOPEN and plan.of(one))}
    return PollingDoc(
        period_s=plan.period_s,
        slow_every=plan.slow_every,
        rare_every=plan.rare_every,
        load_cap=plan.load_cap,
        devices=[_poll_device(one, plan) for one in shown.values()],
        buses=[
            PollBus(
                turbine=turbine,
                bus=bus,
                bitrate=bitrate,
                counts=dict(here),
                load=plan.load([known[name] for name in here.elements() if name in known], bitrate)
                if bitrate
                else None,
            )
            for (turbine, bus), (bitrate, here) in counts.items()
        ],
    )


def _bitrate(bus: BusConfig) -> int:
    """In bit/s; 0 for a bus that has none."""
    return bus.bitrate or (500_000 if bus.kind is Bus.CANOPEN else 0)


def _poll_device(description: Description, plan: PollPlan) -> PollDevice:
    usual, items = usual_list(description), plan.of(description)

    def item(address: Address, rate: Rate) -> PollItem:
        entry = description.entries[address]
        at = usual.get(address)
        return PollItem(
            address=address.short,
            name=entry.name,
            rate=rate.value,
            usual=None if at is None else at.value,
            bits=read_bits(entry),
        )

    return PollDevice(
        description_id=description.id,
        name=description.name,
        items=[item(address, rate) for address, rate in items.items() if address in description.entries],
        usual=[item(address, rate) for address, rate in usual.items()],
    )


# -- about ----------------------------------------------------------------------------


@router.get("/about")
async def about(bench: BenchOf) -> AboutDoc:
    """The program: version, data folder, libraries with their licences."""
    known = await asyncio.to_thread(about_program.describe, bench.sites.home)
    libraries = [LibraryDoc(name=one.name, version=one.version, licence=one.licence) for one in known.libraries]
    return AboutDoc(
        version=known.version,
        python=known.python,
        system=known.system,
        data=None if known.data is None else str(known.data),
        free_bytes=known.free_bytes,
        libraries=libraries,
    )
