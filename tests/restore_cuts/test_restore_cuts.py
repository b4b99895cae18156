"""A restore that is cut at any instant ends old, new or incomplete, and never says another of these than is true.

Cut is the power of the devices, the process of the tool, the cable, or one answer alone, which comes too late; after
every single SDO of a whole restore of one station; with devices that answer at once, that save slowly and that
acknowledge late. What is true is looked up in the twins: in RAM and in the files of their memories. From every restore
that is left incomplete both ways out are taken.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Final

import pytest

from app.service.records.restore_record import Outcome
from app.service.restore.order import Cause
from app.service.restore.transaction import End
from app.service.stop import Command, command_all
from app.store.restore_rows import RestoreState, put_state
from tests.restore_cuts.cuts import Bench, Cut, Kind, Result, is_recorded
from tests.restore_cuts.station import Station
from tests.restore_cuts.tool import hurry
from tests.restore_cuts.trigger import Manner

SAMPLE: Final = 60
SEED: Final = 1010
FEATHERED_DEG: Final = 90.0
ON_THE_WAY_DEG: Final = 84.0
IN_THE_MIDST: Final = 30
"""SDOs behind the first write, of which there are some seventy."""
NEVER: Final = 1 << 40
BEFORE_BEGIN: Final = 5
"""Cuts before the restore begins: it only reads then."""
BEHIND_END: Final = 3
WHOLE_STEP: Final = int(os.environ.get("HUBSIDE_CUTS_STEP", "45"))
"""Of the SDOs of whole devices every so manieth is a cut point, each kind and manner at others."""
CUTS: Final = (Kind.POWER, Kind.PROCESS, Kind.CABLE)
COMBINATIONS: Final = [*((kind, manner) for manner in Manner for kind in CUTS), (Kind.ANSWER, Manner.LATE)]


@pytest.fixture
async def bench(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Bench]:
    """A station with the objects that matter here."""
    async with _benched(monkeypatch, whole=False) as one:
        yield one


@pytest.fixture
async def whole_bench(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Bench]:
    """A station with all objects of its devices."""
    async with _benched(monkeypatch, whole=True) as one:
        yield one


@asynccontextmanager
async def _benched(
    monkeypatch: pytest.MonkeyPatch, whole: bool, angle_deg: float = FEATHERED_DEG
) -> AsyncIterator[Bench]:
    hurry(monkeypatch.setattr)
    with TemporaryDirectory(dir=_folder_in_memory()) as folder, Station(Path(folder) / "state", angle_deg) as station:
        one = Bench(station, Path(folder), whole)
        await one.prepare()
        try:
            yield one
        finally:
            await one.close()


def _folder_in_memory() -> str | None:
    """No cut is one of our own computer: its disk need not be waited for a thousand times."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


@pytest.mark.timeout(900)
async def test_sixty_cuts(bench: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    """Spread over the whole restore by a seed; each kind and manner at its beginning, in its midst and at its end."""
    before, after = await bench.sdos_before(), await _sdos_of(bench, Manner.PLAIN)
    assert after - before > 60, "reads, writes, verifies, saves, restarts and proves"
    first, chance = before - BEFORE_BEGIN, Random(SEED)
    width = (after + BEHIND_END - first) / SAMPLE
    cuts = []
    for n in range(SAMPLE):
        turn, combination = divmod(n, len(COMBINATIONS))
        at = first + int((n + chance.random()) * width) + 1
        cuts.append(Cut(*COMBINATIONS[combination], at, stays_off=turn % 3 == 2))
    cuts.sort(key=lambda cut: cut.kind is not Kind.PROCESS)  # all others share a connection
    results = [await bench.run(cut) for cut in cuts]
    _tell(capsys, "sample", results)
    assert sum(one.happened for one in results) > SAMPLE * 0.9
    ends = Counter((one.cut.kind, one.end) for one in results)
    for kind in CUTS:
        assert ends[kind, End.INCOMPLETE] > 0, f"{kind.value}: no way out was taken"


async def test_who_feathers_a_blade_that_is_left_incomplete_stops_it_before_a_way_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """An axis that follows a command is not written to, and nothing but STOP may take the command back."""
    async with _benched(monkeypatch, whole=False, angle_deg=ON_THE_WAY_DEG) as bench:
        at = await bench.sdos_before() + IN_THE_MIDST
        async with bench.left_incomplete(at) as (one, restore_id):
            axes, journal, stamper = one.connection.axes(), one.connection.journal, one.connection.stamper
            (feathered,) = await command_all(axes, Command.FEATHER, journal, stamper)
            assert feathered.confirmed_t_ns is not None
            await one.desk.resume(one.connection, restore_id, "tester")
            assert await one.desk.wait(restore_id) is End.INCOMPLETE
            assert (await one.desk.get(restore_id)).outcome["cause"] == Cause.DRIVE_ENABLED.value
            (stopped,) = await command_all(axes, Command.STOP, journal, stamper)
            assert stopped.confirmed_t_ns is not None
            await one.desk.resume(one.connection, restore_id, "tester")
            assert await one.desk.wait(restore_id) is End.NEW
            assert bench.truth() is End.NEW


async def test_a_restore_whose_tool_was_killed_has_its_record(bench: Bench) -> None:
    """Of each of its ends, also of those that nobody lived to seal."""
    at = await bench.sdos_before() + IN_THE_MIDST
    async with bench.left_incomplete(at) as (one, restore_id):
        await is_recorded(one.desk, restore_id, Outcome.INCOMPLETE)
        # As if the next tool had rolled back, and had been killed before it sealed that.
        put = partial(put_state, restore_id=restore_id, state=RestoreState.ROLLED_BACK, outcome="{}", ended_ns=1)
        await one.office.store.run(put)
        await is_recorded(one.desk, restore_id, Outcome.OLD)


@pytest.mark.soak
@pytest.mark.timeout(2 * 3600)
@pytest.mark.parametrize(("kind", "manner"), COMBINATIONS, ids=lambda one: one.value)
async def test_every_cut(kind: Kind, manner: Manner, bench: Bench, capsys: pytest.CaptureFixture[str]) -> None:
    """After every single SDO, from the first that is read to the last proof, and behind it."""
    count = await _sdos_of(bench, manner)
    results = []
    for at in range(1, count + BEFORE_BEGIN):
        for stays_off in (False, True) if kind is Kind.POWER else (False,):
            results.append(await bench.run(Cut(kind, manner, at, stays_off)))
    _tell(capsys, "every SDO", results)
    assert sum(one.happened for one in results) > len(results) * 0.9


@pytest.mark.soak
@pytest.mark.timeout(2 * 3600)
@pytest.mark.parametrize(("kind", "manner"), COMBINATIONS, ids=lambda one: one.value)
async def test_cuts_of_whole_devices(
    kind: Kind, manner: Manner, whole_bench: Bench, capsys: pytest.CaptureFixture[str]
) -> None:
    """With every object that the devices have: hundreds are read before, in between and in the end."""
    count = await _sdos_of(whole_bench, manner)
    assert count > 1000
    first = 1 + COMBINATIONS.index((kind, manner)) * WHOLE_STEP // len(COMBINATIONS)
    cuts = (Cut(kind, manner, at, at % 2 == 0) for at in range(first, count, WHOLE_STEP))
    _tell(capsys, "whole devices", [await whole_bench.run(cut) for cut in cuts])


async def _sdos_of(bench: Bench, manner: Manner) -> int:
    """How many SDOs a restore takes that nothing cuts; it ends with the new values."""
    done = await bench.run(Cut(Kind.CABLE, manner, NEVER))
    assert done.end is End.NEW
    assert not done.happened
    return done.sdos


def _tell(capsys: pytest.CaptureFixture[str], title: str, results: Iterable[Result]) -> None:
    """The numbers, for whoever runs it."""
    ends: dict[tuple[str, str], Counter[End]] = {}
    for one in results:
        ends.setdefault((one.cut.kind.value, one.cut.manner.value), Counter())[one.end] += 1
    with capsys.disabled():
        whole = sum((counted for counted in ends.values()), Counter[End]())
        print(f"\n{whole.total()} cuts ({title}); each incomplete one resumed to new and rolled back to old:")
        for (kind, manner), counted in [*ends.items(), (("all", ""), whole)]:
            numbers = ", ".join(f"{counted[end]} {end.value}" for end in End)
            print(f"  {kind:8} {manner:18} {numbers}")
