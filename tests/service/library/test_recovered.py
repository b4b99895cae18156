"""Sets out of recordings: what SDO traffic showed, when, by whom; restarts, refusals, damage and foreign files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader

from app.errors import RecordingError
from app.model.address import Address
from app.model.sets import ParameterSet, load_set
from app.model.site import load_site
from app.recording.content import RecorderClock
from app.recording.reader import open_recording
from app.recording.writer import RecorderCore, RecorderSettings
from app.service.as_found import read_as_found
from app.service.connection import Connection
from app.service.library.recovered import Doubt, Named, Recovered, RecoveredSet, recover_sets
from app.service.options import Options
from app.wire.decoder import CanOpenDecoder
from app.wire.records import BootUpSeen, Outcome, SdoAccess, SdoSeen
from tests.e2e.conftest import site_for
from tests.model.set_rig import DESCRIPTIONS
from tests.recording.rig import files
from tests.service.conftest import Served
from tests.web.rig import ROOT

VISIT = ROOT / "recordings" / "scenarios" / "7-service-visit.mcap"
SCENARIOS = [VISIT, VISIT.with_name("8-foreign-master.mcap")]


def of(found: Recovered, slug: str) -> RecoveredSet:
    return next(one for one in found.sets if one.parameters.origin.device == slug)


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_every_value_is_the_last_that_a_transfer_showed(path: Path) -> None:
    """Against all finished transfers of the file, gone through backwards."""
    found = recover_sets(path, DESCRIPTIONS)
    assert len(found.sets) == 6
    last: dict[tuple[int, Address], SdoSeen] = {}
    with open_recording(path) as recording:
        decoder = CanOpenDecoder("can0")
        for record in (each for frame in recording.frames() for each in decoder.feed(frame)):
            if isinstance(record, SdoSeen) and record.outcome is Outcome.DONE:
                last[record.node, record.address] = record
    for one in found.sets:
        node = one.parameters.origin.node
        assert one.seen.keys() == one.parameters.values.keys()
        for address, look in one.seen.items():
            record = last[node, address]
            assert (look.t_ns, look.access) == (record.t_ns, record.access)
        description = DESCRIPTIONS[one.parameters.description_id]
        readable = {entry.address for entry in description if entry.access.readable}
        told = {*one.parameters.values, *one.parameters.unread, *one.parameters.empty}
        assert readable <= told, "every object that was not seen is named"


def test_the_service_visit_shows_what_was_written_and_what_a_restart_left_in_doubt() -> None:
    found = recover_sets(VISIT, DESCRIPTIONS)
    blade = of(found, "wtg-07/blade-2/pmc")
    doubts = {look.doubt for look in blade.seen.values()}
    assert doubts == {None, Doubt.BOOT_UP}
    with open_recording(VISIT) as recording:
        decoder = CanOpenDecoder("can0")
        seen = [each for frame in recording.frames() for each in decoder.feed(frame)]
    boots = [one.t_ns for one in seen if isinstance(one, BootUpSeen) and one.node == 12]
    assert all((look.t_ns < boots[-1]) == (look.doubt is Doubt.BOOT_UP) for look in blade.seen.values())
    assert {look.access for look in blade.seen.values()} == {SdoAccess.READ, SdoAccess.WRITE}
    assert of(found, "wtg-07/blade-1/pmc").parameters.unread[Address(0x1008)] == "not seen"


def test_a_recording_without_its_end_gives_the_same_sets(tmp_path: Path) -> None:
    cut = tmp_path / VISIT.name
    cut.write_bytes(VISIT.read_bytes()[:-300])
    found, whole = recover_sets(cut, DESCRIPTIONS), recover_sets(VISIT, DESCRIPTIONS)
    assert [one.parameters for one in found.sets] == [one.parameters for one in whole.sets]
    nothing = tmp_path / "no.mcap"
    nothing.write_bytes(b"no recording at all")
    for path in (nothing, tmp_path / "none.mcap"):
        with pytest.raises(RecordingError):
            recover_sets(path, DESCRIPTIONS)


def test_what_the_recording_does_not_tell_is_named_by_the_reader() -> None:
    blind = recover_sets(VISIT, {})
    assert blind.sets == ()
    assert set(blind.nameless) == {("can0", node) for node in (1, 2, 3, 11, 12, 13)}
    named = recover_sets(VISIT, {}, {12: Named("wtg-99/blade-9/pmc", DESCRIPTIONS["oat-pmc"])})
    (one,) = named.sets
    assert one.parameters.origin.device == "wtg-99/blade-9/pmc"
    assert one.parameters.values == of(recover_sets(VISIT, DESCRIPTIONS), "wtg-07/blade-2/pmc").parameters.values
    assert ("can0", 12) not in named.nameless


def in_parts(folder: Path, *, cut_s: float, later_ns: int = 0, turbine: str = "wtg-07") -> list[Path]:
    """The recording of the visit once more, in files of ``cut_s`` each; all of it later by so much."""
    with open_recording(VISIT) as recording:
        info, frames = replace(recording.info, turbine=turbine), list(recording.frames())
    now_ns = frames[0].t_ns + later_ns
    clock = RecorderClock(lambda: now_ns, lambda: now_ns, lambda: now_ns)
    settings = RecorderSettings(min_free_bytes=0, max_file_s=cut_s)
    core = RecorderCore(folder, info, clock, (), settings)
    for number, frame in enumerate(frames):
        now_ns = frame.t_ns + later_ns
        core.write([frame._replace(t_ns=now_ns)])
        if number % 50 == 0:
            core.cycle()
    core.shut()
    return files(folder)


def test_the_parts_of_a_recording_give_what_the_whole_gives_in_whatever_order_they_are_named(tmp_path: Path) -> None:
    parts = in_parts(tmp_path, cut_s=20)
    assert len(parts) >= 3
    whole = recover_sets(VISIT, DESCRIPTIONS)
    shares: list[float] = []
    found = recover_sets([parts[-1], *parts[:-1]], DESCRIPTIONS, on_progress=shares.append)
    assert found.name == f"{parts[0].name} … {parts[-1].name} ({len(parts)})"
    assert [one.seen for one in found.sets] == [one.seen for one in whole.sets]
    for one, other in zip(found.sets, whole.sets, strict=True):
        assert one.parameters.values == other.parameters.values
        assert one.parameters.unread == other.parameters.unread
        assert one.parameters.origin == replace(other.parameters.origin, reason=one.parameters.origin.reason)
        assert one.parameters.origin.reason.startswith(f"{found.name}: ")
    assert shares[0] < 0.1 and shares[-1] == 1.0 and shares == sorted(shares)
    assert recover_sets(parts[:1], DESCRIPTIONS).sets != found.sets


def test_where_a_part_is_missing_what_was_seen_before_is_in_doubt(tmp_path: Path) -> None:
    parts = in_parts(tmp_path, cut_s=20)
    begun_ns = []
    for path in (parts[0], parts[2]):
        with open_recording(path) as recording:
            assert recording.span_ns is not None
            begun_ns.append(recording.span_ns[0])
    found = recover_sets([parts[0], parts[2]], DESCRIPTIONS)
    looks = [look for one in found.sets for look in one.seen.values()]
    before = [look for look in looks if look.t_ns < begun_ns[1]]
    assert before and all(look.doubt is not None for look in before)
    assert Doubt.GAP in {look.doubt for look in before}
    alone = {one.parameters.origin.device: one for one in recover_sets(parts[0], DESCRIPTIONS).sets}
    for one in found.sets:
        for address, look in one.seen.items():
            if look.t_ns < begun_ns[1]:
                assert one.parameters.values[address] == alone[one.parameters.origin.device].parameters.values[address]


def test_recordings_one_after_another_are_one_story_with_a_gap(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    (first,) = in_parts(tmp_path / "a", cut_s=3600)
    (second,) = in_parts(tmp_path / "b", cut_s=3600, later_ns=24 * 3600 * 10**9)
    found = recover_sets([second, first], DESCRIPTIONS)
    alone = recover_sets(second, DESCRIPTIONS)
    assert [one.seen for one in found.sets] == [one.seen for one in alone.sets], "the same was seen again, later"
    assert [one.parameters.values for one in found.sets] == [one.parameters.values for one in alone.sets]


def test_files_that_are_no_series_are_refused_with_their_name(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    (whole,) = in_parts(tmp_path, cut_s=3600)
    other = in_parts(tmp_path / "other", cut_s=3600, later_ns=24 * 3600 * 10**9, turbine="wtg-99")
    with pytest.raises(RecordingError, match="at the same time"):
        recover_sets([VISIT, whole], DESCRIPTIONS)
    with pytest.raises(RecordingError, match="at the same time"):
        recover_sets([VISIT, VISIT], DESCRIPTIONS)
    with pytest.raises(RecordingError, match="other turbine"):
        recover_sets([VISIT, *other], DESCRIPTIONS)
    with pytest.raises(RecordingError, match=r"none\.mcap"):
        recover_sets([VISIT, tmp_path / "none.mcap"], DESCRIPTIONS)


async def test_a_recorded_first_look_gives_the_very_values_that_were_kept_as_found(
    served: Served, tmp_path: Path
) -> None:
    """And of the file with a hole, and without its second half, only values that were in it."""
    (turbine,) = load_site(site_for(served.address, tmp_path))
    async with Connection(turbine, DESCRIPTIONS, Options("tester", tmp_path / "rec", listen_s=0.2)) as connection:
        await read_as_found(connection, "tester")
    (path,) = files(tmp_path / "rec")
    found = recover_sets(path, DESCRIPTIONS)
    with open_recording(path) as recording:
        attached = [one for one in recording.attachments() if one.name.startswith("sets/")]
    kept = {one.origin.device: one for one in (load_set(file.data.decode(), file.name) for file in attached)}
    assert len(kept) == len(found.sets) == 6
    for one in found.sets:
        assert_equal_but_for_process_values(kept[one.parameters.origin.device], one.parameters)
        assert {look.access for look in one.seen.values()} == {SdoAccess.READ}
        assert all(look.ours for look in one.seen.values())
    data, middle = path.read_bytes(), middle_of_frames(path)
    path.with_name("cut.mcap").write_bytes(data[:middle])
    path.with_name("hole.mcap").write_bytes(data[: middle - 2000] + b"\x5a" * 4000 + data[middle + 2000 :])
    for name in ("cut.mcap", "hole.mcap"):
        left = recover_sets(path.with_name(name), DESCRIPTIONS)
        assert left.damages > 0
        assert 0 < sum(len(one.seen) for one in left.sets) < sum(len(one.seen) for one in found.sets)
        for one in left.sets:
            whole = of(found, one.parameters.origin.device)
            for address, look in one.seen.items():
                if look.t_ns == whole.seen[address].t_ns:
                    assert one.parameters.values[address] == whole.parameters.values[address]


def middle_of_frames(path: Path) -> int:
    """An offset within a chunk of frames, about half of them before it: the sets lie apart from them."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    chunks = sorted(summary.chunk_indexes, key=lambda one: one.chunk_start_offset)
    frames = [one for one in chunks if one.chunk_length > 4000]
    middle = frames[len(frames) // 2]
    return middle.chunk_start_offset + middle.chunk_length // 2


def assert_equal_but_for_process_values(kept: ParameterSet, found: ParameterSet) -> None:
    """Process values are polled after the first look and may have changed since."""
    description = DESCRIPTIONS[kept.description_id]
    assert (found.values.keys(), found.empty) == (kept.values.keys(), kept.empty)
    saved = [entry.address for entry in description if entry.saved]
    assert {address: found.values.get(address) for address in saved} == {
        address: kept.values.get(address) for address in saved
    }
    assert found.identity == kept.identity
