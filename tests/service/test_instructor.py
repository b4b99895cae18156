"""The instructor's desk on real twins: what acts, who ordered it, what is refused, what comes and goes by itself."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest

from app.errors import FaultOrderError, FaultValueError, TwinsGoneError
from app.model.fault import CATALOGUE, FaultOrder
from app.model.site import load_site
from app.model.texts import LANGUAGES, load_texts
from app.service.bench import Bench
from app.service.connection import Connection
from app.service.instructor import InjectedLine, InstructorDesk, watched
from app.service.journal import Entry, Journal, Kind
from app.service.link import bench_line
from app.service.sites import Sites
from app.service.views import event_of_journal
from app.twins.control_server import ControlServer
from app.wire.frame import Stamper
from tests.e2e.conftest import site_for
from tests.e2e.processes import ROOT
from tests.service.conftest import Served
from tests.service.instructor_rig import DEADLINE_S, TOKEN, Control, controlled
from tests.service.test_visits import describe, options
from tests.web.rig import make_connection

MAINS = FaultOrder("mains_failure", blade=2)


@pytest.fixture
async def control(served: Served, tmp_path: Path) -> AsyncIterator[Control]:
    async with controlled(served, tmp_path) as started:
        yield started


@pytest.fixture
def journal() -> Journal:
    return Journal(Stamper(time.time_ns(), time.monotonic_ns), "the bench")


@pytest.fixture
def desk(control: Control, journal: Journal) -> InstructorDesk:
    return InstructorDesk(control.client, journal, Stamper(time.time_ns(), time.monotonic_ns), {12: "b2/pmc"}.get)


async def until(holds: Callable[[], bool]) -> None:
    async with asyncio.timeout(DEADLINE_S):
        while not holds():  # noqa: ASYNC110  what is waited for has no event
            await asyncio.sleep(0.02)


def kinds(journal: Journal) -> list[Kind]:
    return [entry.kind for entry in journal.latest()]


def last(journal: Journal) -> Entry:
    return journal.latest()[-1]


def acting(desk: InstructorDesk) -> list[InjectedLine]:
    return list(desk.line.faults)


def desk_of(bench: Bench) -> InstructorDesk | None:
    return bench.instructor


def mains(control: Control) -> list[bool]:
    return [blade.power.mains_present for blade in control.served.turbine.blades]


async def test_a_fault_acts_is_shown_and_goes_and_the_journal_knows_who(
    control: Control, desk: InstructorDesk, journal: Journal
) -> None:
    before_ns = time.time_ns()
    line = await desk.inject(MAINS, "anna")
    assert mains(control) == [True, False, True]
    assert acting(desk) == [line]
    assert (line.kind, line.blade, line.node, line.values) == ("mains_failure", 2, None, {"remaining_percent": 0.0})
    assert (line.seconds, line.until_ns) == (None, None)
    assert abs(line.since_ns - before_ns) < 5e9
    entry = last(journal)
    assert (entry.kind, entry.person, entry.device) == (Kind.FAULT_SET, "anna", None)
    assert entry.details["fault_key"] == "fault.mains_failure.name"
    assert entry.details["target_key"] == "fault_target.blade_2"
    assert entry.details["values"] == "remaining_percent=0"
    assert event_of_journal(entry).person == "anna"
    await desk.clear(line.id, "bert")
    assert mains(control) == [True, True, True]
    assert acting(desk) == []
    assert (last(journal).kind, last(journal).person) == (Kind.FAULT_CLEARED, "bert")
    await desk.clear(line.id, "carl")
    assert kinds(journal) == [Kind.FAULT_SET, Kind.FAULT_CLEARED], "two pages may clear it; one of them did"


@pytest.mark.parametrize(
    ("order", "device", "where"),
    [
        (FaultOrder("node_gone", node=12), "b2/pmc", {"target": "b2/pmc"}),
        (FaultOrder("node_gone", node=3), None, {"target": "3"}),
        (FaultOrder("phase_loss"), None, {"target_key": "fault_target.turbine"}),
        (FaultOrder("frames_lost"), None, {"target_key": "fault_target.bus"}),
    ],
)
async def test_the_journal_says_where(
    desk: InstructorDesk, journal: Journal, order: FaultOrder, device: str | None, where: dict[str, str]
) -> None:
    await desk.inject(order, "anna")
    told = last(journal)
    assert told.device == device
    assert {name: detail for name, detail in told.details.items() if name.startswith("target")} == where


@pytest.mark.parametrize(
    ("order", "field", "limits"),
    [
        (FaultOrder("mains_failure", values={"remaining_percent": 300.0}), "remaining_percent", "0 … 130 %"),
        (FaultOrder("phase_loss", values={"phase": 4}), "phase", "1 … 3"),
    ],
)
async def test_a_value_beyond_its_limits_is_refused_with_them(
    control: Control, desk: InstructorDesk, journal: Journal, order: FaultOrder, field: str, limits: str
) -> None:
    with pytest.raises(FaultValueError) as caught:
        await desk.inject(order, "anna")
    details = caught.value.details
    assert (details["field"], details["limits"], details["value"]) == (field, limits, order.values[field])
    assert (await control.client.situation()).faults == ()
    assert kinds(journal) == []


@pytest.mark.parametrize(
    ("order", "field"),
    [
        (FaultOrder("flood"), "kind"),
        (FaultOrder("brake_stuck"), "blade"),
        (FaultOrder("brake_stuck", blade=4), "blade"),
        (FaultOrder("phase_loss", values={"phase": 1.5}), "phase"),
        (FaultOrder("phase_loss", values={"depth": 1}), "depth"),
        (FaultOrder("gust", seconds=3.0), "for_s"),
        (FaultOrder("node_gone", node=99), "node"),  # only the twins know who is there
    ],
)
async def test_an_order_that_makes_no_sense_is_refused_by_the_name_of_the_field(
    desk: InstructorDesk, journal: Journal, order: FaultOrder, field: str
) -> None:
    with pytest.raises(FaultOrderError) as caught:
        await desk.inject(order, "anna")
    assert not isinstance(caught.value, FaultValueError)
    assert caught.value.details["field"] == field
    assert kinds(journal) == []


async def test_what_ends_or_comes_without_us_is_seen_and_is_nobodys(
    control: Control, desk: InstructorDesk, journal: Journal
) -> None:
    async with watched(desk):
        short = await desk.inject(FaultOrder("brake_stuck", blade=1, seconds=0.2), "anna")
        assert short.until_ns == short.since_ns + 200_000_000
        await until(lambda: desk.line.faults == ())
        assert last(journal).kind is Kind.FAULT_ENDED
        assert event_of_journal(last(journal)).person is None
        control.from_elsewhere(MAINS)
        await until(lambda: desk.line.faults != ())
    (line,) = desk.line.faults
    assert (line.kind, line.blade) == ("mains_failure", 2)
    assert last(journal).kind is Kind.FAULT_SEEN
    assert event_of_journal(last(journal)).person is None
    await desk.clear_all("anna")
    assert acting(desk) == []
    assert (last(journal).kind, last(journal).person) == (Kind.FAULT_CLEARED, "anna")


async def test_what_ends_of_itself_says_when(desk: InstructorDesk) -> None:
    line = await desk.inject(FaultOrder("power_cut", node=11, values={"off_s": 30.0}), "anna")
    assert line.until_ns is not None
    assert line.until_ns - line.since_ns == 30_000_000_000


async def test_all_faults_are_cleared_at_once(control: Control, desk: InstructorDesk, journal: Journal) -> None:
    await desk.inject(MAINS, "anna")
    await desk.inject(FaultOrder("node_gone", node=12), "anna")
    assert len(acting(desk)) == 2
    await desk.clear_all("anna")
    assert acting(desk) == []
    assert not control.instructor.active
    assert kinds(journal)[-2:] == [Kind.FAULT_CLEARED, Kind.FAULT_CLEARED]


async def test_a_scenario_is_played_to_its_end(desk: InstructorDesk, journal: Journal) -> None:
    assert {(one.name, one.title, one.seed, one.note) for one in await desk.scenarios()} == {
        ("short", "Short", 0, ""),
        ("long", "Long", 7, "Watch the brake."),
    }
    async with watched(desk):
        line = await desk.play("short", "anna")
        assert line.playing is not None
        assert (line.playing.scenario, line.playing.title) == ("short", "Short")
        assert line.playing.until_ns - line.playing.since_ns == 300_000_000
        await until(lambda: desk.line.playing is None)
    started = next(entry for entry in journal.latest() if entry.kind is Kind.SCENARIO_STARTED)
    assert (started.person, started.details["title"]) == ("anna", "Short")
    ended = next(entry for entry in journal.latest() if entry.kind is Kind.SCENARIO_ENDED)
    assert event_of_journal(ended).person is None
    assert acting(desk) == [], "its faults end with it"


async def test_a_scenario_is_stopped_and_another_takes_its_place(desk: InstructorDesk, journal: Journal) -> None:
    await desk.play("long", "anna")
    with pytest.raises(FaultOrderError) as caught:
        await desk.play("none", "bert")
    assert caught.value.details["field"] == "scenario"
    assert desk.line.playing is not None, "a scenario that does not exist ends nothing"
    await desk.play("long", "bert")
    assert [(one.kind, one.person) for one in journal.latest()] == [
        (Kind.SCENARIO_STARTED, "anna"),
        (Kind.SCENARIO_STOPPED, "bert"),
        (Kind.SCENARIO_STARTED, "bert"),
    ]
    assert (await desk.stop("carl")).playing is None
    assert (last(journal).kind, last(journal).person) == (Kind.SCENARIO_STOPPED, "carl")
    await desk.stop("carl")
    assert len(journal.latest()) == 4, "there was nothing to stop"


async def test_twins_that_are_gone_are_told_so_and_asked_until_they_are_back(
    control: Control, desk: InstructorDesk, journal: Journal
) -> None:
    await desk.inject(MAINS, "anna")
    port = control.server.port
    control.server.stop()
    with pytest.raises(TwinsGoneError):
        await desk.inject(MAINS, "anna")
    assert desk.line.answering is False
    assert len(acting(desk)) == 1, "what was known is still shown"
    async with watched(desk):
        with ControlServer(control.served.thread, control.instructor, TOKEN, port=port):
            await until(lambda: desk.line.answering)
    assert kinds(journal) == [Kind.FAULT_SET]


async def test_the_catalogue_is_that_of_the_twins(desk: InstructorDesk) -> None:
    assert {kind.id: kind for kind in await desk.catalogue()} == CATALOGUE


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_scenario_that_comes_along_is_told_in_both_languages(language: str) -> None:
    files = {path.stem for path in (ROOT / "recordings" / "scenarios").glob("*.toml")}
    assert len(files) >= 8
    told = {key for key in load_texts(language)._texts if key.startswith("scenario.")}
    assert told == {f"scenario.{file}.{part}" for file in files for part in ("title", "about", "watch")}


async def test_only_our_own_twins_have_an_instructor_and_they_are_twins_from_the_start(
    control: Control, served: Served, tmp_path: Path
) -> None:
    other = make_connection()  # its bus is at the usual address
    (turbine,) = load_site(site_for(f"{served.address}@500000", tmp_path))
    ours = Connection(turbine, describe(turbine), options())
    bench = Bench(Sites((turbine,), describe), options(), instructor=control.client)
    try:
        assert desk_of(bench) is bench.desk is not None, "nothing real is connected"
        bench.show(other)
        assert desk_of(bench) is None
        assert bench_line(bench).mode == "live"
        bench.show(ours)
        assert desk_of(bench) is bench.desk
        assert bench_line(bench).mode == "twin", "before any device has said so"
    finally:
        bench.connection = None
        await bench.close()
