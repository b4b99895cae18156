"""Sets out of recordings: what SDO traffic showed, when, by whom; restarts, refusals, damage and foreign files."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader

from app.errors import RecordingError
from app.model.address import Address
from app.model.sets import ParameterSet, load_set
from app.model.site import load_site
from app.recording.reader import open_recording
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
