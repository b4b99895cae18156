"""Searching recordings: what is found and what not, levels against the values themselves, 200 files as a job."""

from __future__ import annotations

import os
import shutil
import time
from bisect import bisect_left
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.model.address import Address, parse_address
from app.recording.index import index_path
from app.service.analysis.search.levels import find_levels
from app.service.analysis.search.match import Found, find
from app.service.analysis.search.parser import parse_query
from app.service.analysis.search.query import Comparison, Level, Scope
from app.service.analysis.search.search import Hit, Search, Skipped, Unsearched, run_search, search_one
from app.service.analysis.search.stretches import SHORT_NS, Held
from app.service.indexing import Indexing
from app.service.jobs import Job, Jobs, JobState
from app.wire.signs import SignKind
from tests.service.analysis.rig import BUS, S, at_s, look, scenario, the_trip
from tests.web.rig import wait_until

EVERY = range(1, 9)


def hits(number: int, text: str) -> list[Found]:
    return find(look(number), parse_query(text))


def files(text: str) -> list[int]:
    return [number for number in EVERY if hits(number, text)]


# -- events and their order ------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("trip", [2, 3, 4, 5, 6, 7, 8]),
        ("not trip", [1]),
        ("emcy 8611", [3, 5]),
        ("emcy 8611 on blade 2", [3]),
        ("emcy 8611 on node 11", [5]),
        ("emcy 8611 on pmm", []),
        ("emcy 8611 on bus can1", []),
        ("mains_low", [2, 5]),
        ("trip and not mains_low", [3, 4, 6, 7, 8]),
        ("emcy 8620 or emcy 3221", [4, 6]),
        ("mains_low then trip within 2 s", [5]),
        ("mains_low then trip within 4 s", [2, 5]),
        ("trip then mains_low within 60 s", []),
        ("mains_low then emcy 3280 within 2 s on same node", [5]),
        ("mains_low then emcy 8611 within 5 s on same node", []),
        ("mains_low then emcy 8611 within 5 s on same blade", [5]),
        ("mains_low without trip within 2 s", [2]),
        ("silent within 2 s before emcy 3221", [6]),
        ("nmt_command then trip within 1 s", [7, 8]),
        ("boot_up then error within 5 s on same node", [7]),
        ("ended chain_open", [2, 6, 7]),
        ("battery_test then mains_low within 60 s then emcy 3280 within 1 s", [5]),
        ("write_aborted on blade 3", [8]),
    ],
)
def test_which_scenarios_match(text: str, expected: list[int]) -> None:
    assert files(text) == expected


def test_a_following_error_before_its_emergency_is_found_with_the_moment_to_jump_to() -> None:
    assert files("60F4 > 0.5 deg within 5 s before emcy 8611") == [3, 5]
    (found,) = hits(3, "60F4 > 0.5 deg within 5 s before emcy 8611")
    emergency = next(one for one in look(3).signs if one.details.get("code") == 0x8611)
    assert (found.t_ns, found.key) == (emergency.t_ns, (BUS, 12))
    assert found.t_ns - 5 * S <= found.from_ns < found.t_ns
    assert files("60F4 > 2 deg within 5 s before emcy 8611") == [], "8611h comes at one degree"
    assert files("60F4 > 2 deg within 20 s before emcy 3220 on pmc") == [5]
    assert [one.t_ns for one in hits(3, "trip")] == [the_trip(3).t0_ns]


def test_a_condition_that_lasts_and_ends_where_its_node_falls_silent() -> None:
    found = hits(2, "3062 < 300 V for 25 s")
    assert sorted(one.key for one in found if one.key) == [(BUS, 1), (BUS, 2), (BUS, 3)]
    for one in found:
        assert (one.to_ns - one.from_ns) / S == pytest.approx(30, abs=0.1), "switched off by then: nobody knows"
    assert hits(2, "3062 < 300 V for 31 s") == []
    assert files("3062 < 300000 mV for 10 s") == [2, 5], "units of the same kind fit"


# -- levels against the values ------------------------------------------------------


def values(number: int, node: int, address: Address) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    one = look(number)
    series = one.index.series((BUS, node, address), one.span_ns[0], one.span_ns[1] + 1, 1 << 30)
    return series.t_ns.astype(np.int64), series.low.astype(np.float64)


EXACT = {
    (number, node, text): values(number, node, parse_address(text))
    for number, node, text in ((3, 12, "60F4"), (3, 11, "6064"), (2, 1, "3062"))
}
_TESTS = {
    Comparison.ABOVE: np.greater, Comparison.FROM: np.greater_equal, Comparison.BELOW: np.less,
    Comparison.UP_TO: np.less_equal, Comparison.EQUAL: np.equal, Comparison.OTHER: np.not_equal,
}  # fmt: skip


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(sorted(EXACT)), st.sampled_from(Comparison), st.integers(0, 99), st.booleans(), st.data())
def test_levels_are_found_where_the_values_are(
    which: tuple[int, int, str], comparison: Comparison, percentile: int, amount: bool, data: st.DataObject
) -> None:
    size = len(EXACT[which][0])
    first = data.draw(st.integers(0, size - 2))
    last = data.draw(st.integers(first + 1, size - 1))
    hold_to_the_values(which, comparison, percentile, amount, first, last)


@pytest.mark.parametrize(
    ("comparison", "percentile", "amount", "last"),
    [(Comparison.BELOW, 40, False, 91), (Comparison.UP_TO, 3, True, 1482)],
    ids=["the last bucket reaches beyond the span", "least and greatest lie on both sides of 0"],
)
def test_levels_that_were_found_where_no_value_fits(
    comparison: Comparison, percentile: int, amount: bool, last: int
) -> None:
    hold_to_the_values((3, 12, "60F4"), comparison, percentile, amount, 0, last)


def hold_to_the_values(
    which: tuple[int, int, str], comparison: Comparison, percentile: int, amount: bool, first: int, last: int
) -> None:
    """What is found from the ``first`` value to the ``last`` is what a walk over all values finds, to the value."""
    number, node, text = which
    t_ns, raw = EXACT[which]
    shown = np.abs(raw) if amount else raw
    bound = float(np.percentile(shown, percentile, method="nearest"))
    entry = look(number).entry((BUS, node), parse_address(text))
    assert entry is not None
    scale = float(entry.quantity.scale)
    level = Level(parse_address(text), comparison, bound * scale, "", 0, amount, Scope(node=node))
    span = (int(t_ns[first]), int(t_ns[last]) + 1)
    found = list(find_levels(look(number), level, [span]))
    held = _TESTS[comparison](shown, bound)
    assert [(one.from_ns, one.to_ns, one.open, one.interrupted) for one in found] == walked(which, held, first, last)
    for one in found:
        from_ns = one.from_ns - (SHORT_NS if one.open else 0)
        assert one.extreme in raw[(t_ns >= from_ns) & (t_ns < one.to_ns) & held].tolist()


def walked(
    which: tuple[int, int, str], held: np.ndarray[Any, Any], first: int, last: int
) -> list[tuple[int, int, bool, bool]]:
    """Begin, end, whether open and whether interrupted, of each stretch: value by value, from the one before on."""
    t_ns = EXACT[which][0].tolist()
    begin, end = t_ns[first] >> 26 << 26, t_ns[last] + 1
    looked_from = bisect_left(t_ns, begin)
    before = max(0, looked_from - 1)
    breaks = breaks_of(which)
    found: list[list[Any]] = []
    running = False
    for at in range(before, last + 1):
        broken = at > before and any(t_ns[at - 1] < one <= t_ns[at] for one in breaks)
        if running and broken:
            found[-1][1:3] = min(one for one in breaks if t_ns[at - 1] < one), True
            running = False
        if held[at] and not running:
            whole = any(found and found[-1][1] <= one <= t_ns[at] for one in breaks)
            if found and not whole and t_ns[at] - found[-1][1] <= SHORT_NS:
                found[-1][3] = True
            else:
                found.append([max(t_ns[at], begin), end, at == before or at < looked_from or broken, False])
            running = True
        elif not held[at] and running:
            found[-1][1] = t_ns[at]
            running = False
    later = [one for one in breaks if t_ns[last] < one < end]
    if running and later:
        found[-1][1:3] = min(later), True
    elif running:
        found[-1][1:3] = end, True
    return [(begin, stop, is_open, cut) for begin, stop, is_open, cut in found if stop > t_ns[first]]


def breaks_of(which: tuple[int, int, str]) -> list[int]:
    number, node, text = which
    one = look(number)
    silent = [x.since_ns + 1 for x in one.signs if x.kind is SignKind.SILENT and not x.ends and x.node == node]
    return sorted([*one.index.breaks(BUS, node, parse_address(text)).tolist(), *silent])


def test_a_condition_that_was_interrupted_has_not_lasted() -> None:
    t_ns, raw = EXACT[3, 12, "60F4"]
    level = Level(parse_address("60F4"), Comparison.ABOVE, 0.0, "", 0, False, Scope(node=12))
    longest = 0
    start = None
    for t, value in zip(t_ns.tolist(), raw.tolist(), strict=True):
        start = (start or t) if value > 0 else None
        longest = max(longest, t - start if start else 0)
    for lasting, expected in ((longest - 1, True), (longest + S, False)):
        exact = list(find_levels(look(3), Level(*_fields(level, lasting))))
        assert bool(exact) is expected, lasting


def _fields(level: Level, lasting_ns: int) -> tuple[Any, ...]:
    return (level.address, level.comparison, level.number, level.unit, lasting_ns, level.amount, level.scope)


def test_nothing_is_read_of_a_signal_that_never_went_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    one = look(3)
    reads: list[Any] = []
    series = one.index.series

    def counted(*given: Any) -> Any:
        reads.append(given)
        return series(*given)

    monkeypatch.setattr(one.index, "series", counted)
    assert list(find_levels(one, Level(parse_address("60F4"), Comparison.ABOVE, 500))) == []
    assert reads == []
    assert any(isinstance(held, Held) for held in find_levels(one, Level(parse_address("60F4"), Comparison.ABOVE, 1)))
    assert 0 < len(reads) < 20


# -- 200 files -----------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path: Path) -> list[Path]:
    """200 indexed recordings: each scenario 25 times, as links."""
    for number in EVERY:
        source = look(number).path
        for copy in range(25):
            name = tmp_path / f"{copy:02}-{source.name}"
            os.link(source, name)
            os.link(index_path(source), index_path(name))
    return sorted(tmp_path.glob("*.mcap"))


async def searched(paths: list[Path], text: str, **more: Any) -> tuple[Job, Search, list[tuple[int, int]]]:
    search, jobs, progress = Search(parse_query(text)), Jobs(), [(0, 0)]

    async def work(job: Job) -> None:
        await run_search(job, search, paths, **more)

    job = jobs.start("search", "", work)

    def reached(share: float) -> bool:
        if progress[-1] != (job.done, len(search.hits)):
            progress.append((job.done, len(search.hits)))
        return job.state is not JobState.RUNNING or (share < 1 and job.done >= share * len(paths))

    for share in (0.25, 0.5, 0.75, 1):
        await wait_until(partial(reached, share))
    return job, search, progress


@pytest.mark.parametrize("text", ["60F4 > 0.5 deg within 5 s before emcy 8611", "6079 > 700 V"])
async def test_200_recordings_are_searched_in_seconds_with_progress_and_hits_as_they_come(
    folder: list[Path], text: str
) -> None:
    assert len(folder) == 200
    begun_s = time.process_time()
    job, search, progress = await searched(folder, text)
    took_s = time.process_time() - begun_s
    assert (job.state, job.done, job.total, search.searched, search.skipped) == (JobState.DONE, 200, 200, 200, [])
    each = {number: len(hits(number, text)) for number in EVERY}
    counted = {number: sum(hit.file.endswith(look(number).name) for hit in search.hits) for number in EVERY}
    assert counted == {number: 25 * count for number, count in each.items()}
    assert len(progress) > 10, "it tells how far it is"
    assert sum(each.values()) == 0 or any(0 < found < len(search.hits) for _, found in progress)
    assert took_s < 6, "seconds of the processor"


async def test_a_search_ends_when_it_is_cancelled_and_keeps_what_it_has_found(folder: list[Path]) -> None:
    search, jobs = Search(parse_query("trip")), Jobs()

    async def work(job: Job) -> None:
        await run_search(job, search, folder)

    job = jobs.start("search", "", work)
    await wait_until(lambda: len(search.hits) >= 3)
    jobs.cancel(job.id)
    await jobs.close()
    assert job.state is JobState.CANCELLED
    assert 3 <= len(search.hits) < 100
    assert job.done < 200


async def test_what_could_not_be_searched_is_told(tmp_path: Path) -> None:
    plain = tmp_path / "1-plain.mcap"
    shutil.copy(scenario(3), plain)
    (tmp_path / "2-broken.mcap").write_bytes(b"this is no recording at all, and it is not even long")
    live = tmp_path / "3-live.mcap"
    shutil.copy(scenario(3), live)
    gone = tmp_path / "4-gone.mcap"
    ready = tmp_path / "5-ready.mcap"
    os.link(look(3).path, ready)
    os.link(index_path(look(3).path), index_path(ready))
    cut = tmp_path / "6-stale.mcap"
    cut.write_bytes(look(3).path.read_bytes()[:-100])
    os.link(index_path(look(3).path), index_path(cut))
    _, search, _ = await searched([plain, tmp_path / "2-broken.mcap", live, gone, ready, cut], "trip", live=live)
    assert [hit.file for hit in search.hits] == ["5-ready.mcap"]
    assert [(one.file[0], one.reason) for one in search.skipped] == [
        ("1", Unsearched.NO_INDEX), ("2", Unsearched.BROKEN), ("3", Unsearched.LIVE), ("4", Unsearched.BROKEN),
        ("6", Unsearched.NO_INDEX),
    ]  # fmt: skip


def test_a_missing_index_is_made_where_that_is_wanted(tmp_path: Path) -> None:
    path = tmp_path / "plain.mcap"
    shutil.copy(scenario(3), path)
    indexing = Indexing()
    try:
        found = search_one(path, parse_query("trip"), None, indexing)
    finally:
        indexing.close()
    assert isinstance(found, list)
    (hit,) = found
    assert isinstance(hit, Hit)
    assert "8611h" in hit.words.en
    assert "8611h" in hit.words.de
    assert index_path(path).exists()


def test_a_unit_that_does_not_fit_is_told_for_the_recording() -> None:
    told = search_one(look(3).path, parse_query("3062 < 300 deg"))
    assert isinstance(told, Skipped)
    assert told.reason is Unsearched.NOT_FITTING


def test_what_matched_is_told_in_words_to_the_value() -> None:
    found = search_one(look(3).path, parse_query("60F4 > 0.5 deg within 5 s before emcy 8611"))
    assert isinstance(found, list)
    (place,), words = [one.found for one in found], found[0].words
    t_ns, raw = EXACT[3, 12, "60F4"]
    before = t_ns < place.t_ns
    first_ns = t_ns[before][np.flatnonzero(raw[before] <= 50)[-1] + 1]
    ms = round((place.t_ns - first_ns) / 1e6)
    assert (place.from_ns, ms) == (first_ns, 293)
    name = "Blade 2 PMC: actual following error (60F4)"
    assert words.en.startswith(f"{name} > 0.5 ° for at least {ms} ms, up to ")
    assert words.en.endswith(f"; {ms} ms later: blade 2 PMC: following error too large (8611h)")
    assert words.de.startswith(f"Blatt 2 PMC: aktueller Schleppfehler (60F4) > 0,5 °, mindestens {ms} ms lang, bis ")
    assert at_s(3, place.t_ns) == pytest.approx(26.515, abs=0.01)


def test_a_stretch_that_was_interrupted_for_moments_is_one_and_says_so() -> None:
    told = search_one(look(3).path, parse_query("60F4 > 0.01 deg on node 12"))
    assert isinstance(told, list)
    interrupted = [one for one in told for _, what in one.found.what if isinstance(what, Held) and what.interrupted]
    assert interrupted
    assert all("with interruptions of 67 ms at most, up to" in one.words.en for one in interrupted)
    assert all("lang mit Unterbrechungen von höchstens 67 ms, bis" in one.words.de for one in interrupted)


def test_what_has_lasted_for_longer_than_the_time_before_the_event_counts() -> None:
    for seconds, expected in ((1, 1), (2, 1), (20, 1), (25, 1), (26, 0)):
        found = hits(3, f"6079 > 100 V for {seconds} s within 1 s before emcy 8611 on same node")
        assert len(found) == expected, f"measured since 0.7 s, and the emergency comes after 26.5 s: {seconds} s"
