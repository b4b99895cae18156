"""What a visit keeps as found and as left, where links break, devices are silent, and connections are short."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from app.model.address import Address
from app.model.set_record import Tag
from app.model.sets import ParameterSet, load_set
from app.model.site import load_site
from app.recording.reader import Recording
from app.service.backup import read_device
from app.service.bench import Bench
from app.service.compare.ground import ground_of
from app.service.compare.sources import Columns
from app.service.link import DEVICE_NAME
from app.service.office.visit_changes import compare
from app.service.sites import Sites
from app.store.set_rows import Filter
from app.store.store import Store
from app.store.visit_rows import Phase
from app.twins.line import Fault, drop
from tests.e2e.conftest import site_for
from tests.service.conftest import Served
from tests.service.test_visits import LIMIT, PMM, describe, options, until, write

PMC = "wtg-07/blade-1/pmc"


@pytest.fixture
async def bench(served: Served, tmp_path: Path) -> AsyncIterator[Bench]:
    """Not connected."""
    site = load_site(site_for(served.address, tmp_path))
    made = Bench(Sites(site, describe), options(), store=Store.open(tmp_path))
    yield made
    await made.close()


async def kept(bench: Bench, phase: Phase) -> dict[str, ParameterSet]:
    return await bench.office.visits.sets(bench.office.visits.require(), phase)


async def connected(bench: Bench) -> None:
    await bench.connect("wtg-07", "anna")
    await until(lambda: bench.office.visits.looked)


async def test_a_short_connection_does_not_replace_what_was_known_better(bench: Bench) -> None:
    await connected(bench)
    await bench.disconnect("anna")
    whole = await kept(bench, Phase.LEFT)
    assert len(whole) == 6
    assert all(not one.unread for one in whole.values()), "what is empty is not unread"
    assert any(one.empty for one in whole.values())
    await bench.connect("wtg-07", "anna")
    await bench.disconnect("anna")
    assert await kept(bench, Phase.LEFT) == whole
    found = bench.office.visits.found
    connection = await bench.connect("wtg-07", "anna")
    await bench._end_look()
    await write(connection, LIMIT, 490, bench.journal.by("anna"))
    await bench.disconnect("anna")
    changed = await kept(bench, Phase.LEFT)
    assert changed[PMM].values == {**whole[PMM].values, **changed[PMM].values, LIMIT: 490}
    assert (changed[PMM].unread, changed[PMM].empty) == ({}, whole[PMM].empty)
    assert {device: one for device, one in changed.items() if device != PMM} == {
        device: one for device, one in whole.items() if device != PMM
    }
    assert await kept(bench, Phase.FOUND) == found, "what was found first stays"
    assert len(await bench.office.library.records(Filter(device=PMM, tag=Tag.AS_LEFT))) == 1


async def test_of_a_device_of_which_nothing_was_read_nothing_is_kept(bench: Bench) -> None:
    connection = await bench.connect("wtg-07", "anna")
    await bench._end_look()
    target = connection.target(PMM)
    await connection.driver(target).read(target.node, DEVICE_NAME)
    assert target.lookup(DEVICE_NAME) is not None
    await bench.disconnect("anna")
    assert await kept(bench, Phase.LEFT) == {}


async def test_a_look_that_lost_the_bus_is_repeated_and_its_fragment_is_kept_nowhere(
    served: Served, tmp_path: Path
) -> None:
    site = load_site(site_for(served.address, tmp_path))
    recorded = replace(options(), recordings=tmp_path / "rec")
    bench = Bench(Sites(site, describe), recorded, store=Store.open(tmp_path))
    try:
        connection = await bench.connect("wtg-07", "anna")
        await until(lambda: connection.target(PMM).lookup(DEVICE_NAME) is not None)
        assert not bench.office.visits.looked
        served.cut()
        await until(lambda: connection.buses["can0"].status.reconnects == 1)
        await until(lambda: bench.office.visits.looked)
        found = await kept(bench, Phase.FOUND)
        assert [len(one.unread) for one in found.values()] == [0] * 6
        tagged = await bench.office.library.records(Filter(tag=Tag.AS_FOUND))
        assert [(one.unread, one.values > 100) for one in tagged] == [(0, True)] * 6
    finally:
        await bench.close()
    (file,) = (tmp_path / "rec").rglob("*.mcap")
    with Recording(file) as recording:
        sets = [
            load_set(one.data.decode(), one.name) for one in recording.attachments() if one.name.startswith("sets/")
        ]
    assert [len(one.unread) for one in sets] == [0] * 6


async def test_a_device_that_was_silent_is_found_when_it_first_answers(served: Served, bench: Bench) -> None:
    node = next(one.node for one in bench.sites.turbine("wtg-07").devices if one.slug == PMM)
    fault = Fault(lambda can: can.can_id == 0x580 + node, drop, times=None)
    served.spoil(fault)
    await connected(bench)
    visits = bench.office.visits
    assert (len(visits.found), PMM in visits.found) == (5, False)
    served.thread.call_soon(lambda: served.line.withdraw(fault))
    await until(lambda: PMM in visits.found)
    assert visits.found[PMM].unread == {}
    assert (await kept(bench, Phase.FOUND)).keys() == visits.found.keys()


async def test_a_complete_read_finds_a_device_that_the_look_did_not(bench: Bench) -> None:
    connection = await bench.connect("wtg-07", "anna")
    await bench._end_look()
    target = connection.target(PMM)
    report = await read_device(connection.driver(target), target)
    await bench.keep_found([report], "anna")
    assert bench.office.visits.found.keys() == {PMM}
    assert not bench.office.visits.looked
    live = await Columns(ground_of(bench)).resolve(f"live:{PMM}")
    assert live.complete
    assert live.column.empty == set(bench.office.visits.found[PMM].empty) != set()


async def test_a_change_of_a_value_that_has_a_name_is_told_by_it(bench: Bench) -> None:
    connection = await bench.connect("wtg-07", "anna")
    await until(lambda: bench.office.visits.looked)
    found, target = bench.office.visits.found[PMC], connection.target(PMC)
    reaction, gear = Address(0x6007), Address(0x6065)
    then = replace(found, values={**found.values, reaction: 0, gear: 99})
    now = replace(found, values={**found.values, reaction: 2, gear: 100})
    rows = {row.address: (row.was_key, row.now_key) for row in compare(target, then, now, {}).rows}
    assert rows == {
        reaction: ("enum.abort_connection.no_action", "enum.abort_connection.disable_voltage"),
        gear: (None, None),
    }
