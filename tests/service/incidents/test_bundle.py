"""Bundles: exported on one computer, opened on another, damaged on the way, and made by hostile hands."""

from __future__ import annotations

import asyncio
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from app.errors import BundleError
from app.model.incident import Note, Span
from app.model.set_record import Source
from app.recording.reader import open_recording
from app.service.incidents.annotations import Mark
from app.service.incidents.form import MANIFEST
from app.service.incidents.identity import RecordingState, sha256_of
from app.store.set_rows import Filter
from tests.service.incidents.rig import MINE, PMC_2, T0, S, place

Members = dict[str, bytes]


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An exported incident with annotations, sets of the moment and of before, and all else."""
    return asyncio.run(exported_in(tmp_path_factory.mktemp("from")))


async def exported_in(folder: Path) -> Path:
    async with place(folder) as here:
        incident = await here.mark()
        path = here.folder / "recordings" / MINE
        mark = Mark(Span(T0 + 26 * S, T0 + 27 * S), "brake late", Note.ERROR, "#ff0000", incident.id)
        await here.office.annotations.add(MINE, path, mark, "Anna")
        await here.office.annotations.add(MINE, path, Mark(Span(T0, T0), "far away"), "Anna")
        moment = await here.desk.moments.at("trip", T0 + 5 * S)
        await here.office.library.put([moment.parameters(PMC_2, "Anna", "as new")], Source.FILE)
        exported = await here.desk.export(incident.code, folder / "out" / "x.hubside-incident", "Anna")
        assert exported.manifest.lacking == ()
        assert "incident_exported" in await here.kinds()
        assert [one.name for one in (folder / "out").iterdir()] == ["x.hubside-incident"]
        return exported.path


def members_of(file: Path) -> Members:
    with zipfile.ZipFile(file) as archive:
        return {info.filename: archive.read(info) for info in archive.infolist()}


def repacked(target: Path, members: Members) -> Path:
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    return target


def frames(path: Path, from_ns: int, to_ns: int) -> list[Any]:
    with open_recording(path) as recording:
        return list(recording.frames(from_ns, to_ns))


async def test_another_computer_opens_it_with_all_that_it_holds(bundle: Path, tmp_path: Path) -> None:
    async with place(tmp_path, recording=False) as there:
        taken = await there.desk.take(bundle, "Ben")
        assert (taken.flaws, taken.lacking, taken.new, taken.annotations) == ((), (), True, 1)
        incident = taken.incident
        assert incident is not None and incident.origin is not None and taken.recording is not None
        assert (incident.author, incident.draft.title, incident.draft.tags) == ("Anna", "Blade 2 trips", ("8611h",))
        assert (incident.origin.recording, incident.origin.opened_by) == (MINE, "Ben")
        assert incident.origin.sha256 == sha256_of(bundle.parent.parent / "recordings" / MINE)
        standing = await there.office.incidents.standing(there.recordings, incident)
        assert standing.state is RecordingState.THERE and standing.path is not None
        source = bundle.parent.parent / "recordings" / MINE
        begin, end = T0 + 12 * S, T0 + 40 * S
        assert len(frames(standing.path, 0, 1 << 62)) > 1000
        assert frames(standing.path, begin, end) == frames(source, begin, end)
        (mark,) = (await there.office.annotations.of(taken.recording, standing.path)).annotations
        assert (mark.text, mark.incident) == ("brake late", incident.id)
        records = await there.office.library.records(Filter(device=PMC_2))
        assert {record.source for record in records} == {Source.RECORDING, Source.FILE}
        assert "incident_opened" in await there.kinds()


async def test_the_cut_replays_by_itself_with_the_state_of_before(bundle: Path, tmp_path: Path) -> None:
    async with place(tmp_path) as there:
        taken = await there.desk.take(bundle, "Ben")
        assert taken.recording is not None
        whole = await there.desk.moments.at("trip", T0 + 27 * S)
        cut = await there.desk.moments.at(taken.recording.removesuffix(".mcap"), T0 + 27 * S)
        for target in whole.targets:
            mine, theirs = (one.parameters(target.slug, "", "").values for one in (whole, cut))
            assert mine == theirs and len(mine) > 10


async def test_opened_again_nothing_is_there_twice_and_what_is_younger_counts(bundle: Path, tmp_path: Path) -> None:
    async with place(tmp_path, recording=False) as there:
        first = await there.desk.take(bundle, "Ben")
        again = await there.desk.take(bundle, "Ben")
        assert first.incident is not None and again.incident == first.incident
        assert (again.new, again.annotations, again.recording) == (False, 0, first.recording)
        assert len(list((tmp_path / "recordings").glob("trip-*.mcap"))) == 2  # with its annotations
        changed = first.incident.draft
        mine = await there.office.incidents.edit(
            first.incident.id, 1, type(changed)(**{**_fields(changed), "title": "mine"}), "Ben"
        )
        third = await there.desk.take(bundle, "Ben")
        assert third.incident == mine


async def test_a_hidden_incident_is_listed_again_once_its_bundle_is_opened(bundle: Path, tmp_path: Path) -> None:
    async with place(tmp_path, recording=False) as there:
        taken = await there.desk.take(bundle, "Ben")
        assert taken.incident is not None
        await there.office.incidents.hide(taken.incident.id, "Eva")
        assert await there.office.incidents.all() == []
        await there.desk.take(bundle, "Ben")
        assert [one.draft for one in await there.office.incidents.all()] == [taken.incident.draft]


async def test_a_recording_that_is_there_is_never_overwritten_and_a_lost_one_comes_back(
    bundle: Path, tmp_path: Path
) -> None:
    async with place(tmp_path, recording=False) as there:
        taken = await there.desk.take(bundle, "Ben")
        assert taken.recording is not None
        path = tmp_path / "recordings" / taken.recording
        path.unlink()
        path.write_bytes(b"somebody else's")
        again = await there.desk.take(bundle, "Ben")
        assert path.read_bytes() == b"somebody else's"
        assert again.recording == f"{path.stem}-2.mcap"
        assert again.incident is not None and again.incident.draft.recording == again.recording
        standing = await there.office.incidents.standing(there.recordings, again.incident)
        assert standing.state is RecordingState.THERE


@pytest.mark.parametrize("kind", ["recording/", "annotations/", "sets/", "incident.json", "notes.md"])
@pytest.mark.parametrize("how", ["changed", "missing"])
async def test_a_damaged_member_is_told_and_the_rest_is_taken(
    bundle: Path, tmp_path: Path, kind: str, how: str
) -> None:
    members = members_of(bundle)
    name = next(one for one in members if one.startswith(kind))
    if how == "missing":
        del members[name]
    else:
        data = members[name]
        members[name] = data[:-10] + bytes((data[-10] ^ 1,)) + data[-9:]
    async with place(tmp_path, recording=False) as there:
        taken = await there.desk.take(repacked(tmp_path / "spoilt", members), "Ben")
        assert [(flaw.member, flaw.reason_key) for flaw in taken.flaws] == [(name, f"incident.flawed.{how}")]
        assert (taken.incident is None) == (kind == "incident.json")
        assert (taken.recording is None) == (kind == "recording/")
        assert (taken.annotations == 0) == (kind == "annotations/")
        if kind == "recording/" and taken.incident is not None:
            standing = await there.office.incidents.standing(there.recordings, taken.incident)
            assert standing.state is RecordingState.GONE


async def test_bytes_that_flip_on_the_way_are_found_wherever_they_stand(bundle: Path, tmp_path: Path) -> None:
    whole = await asyncio.to_thread(bundle.read_bytes)
    async with place(tmp_path, recording=False) as there:
        for at in range(0, len(whole), len(whole) // 25):
            spoilt = tmp_path / "spoilt"
            spoilt.write_bytes(whole[:at] + bytes((whole[at] ^ 0x55,)) + whole[at + 1 :])
            try:
                taken = await there.desk.take(spoilt, "Ben")
            except BundleError:
                continue
            if not taken.flaws:  # a byte that means nothing, such as a time in the zip's own heads
                assert taken.incident is not None and taken.recording is not None
                path = tmp_path / "recordings" / taken.recording
                assert f"recording/{taken.recording}" in members_of(bundle)
                assert path.read_bytes() == members_of(bundle)[f"recording/{taken.recording}"]


@pytest.mark.parametrize(
    "name",
    ["../evil.mcap", "/etc/evil", "recording/../../evil", "recording\\evil", "C:evil", "recording/a\x00b", "x/y", ""],
)
def test_names_that_lead_elsewhere_are_refused_and_nothing_is_written(bundle: Path, tmp_path: Path, name: str) -> None:
    data = tmp_path / "data"
    file = tmp_path / "evil.hubside-incident"
    members = members_of(bundle)
    with zipfile.ZipFile(file, "w") as archive:
        for one, content in members.items():
            archive.writestr(one, content)
        info = zipfile.ZipInfo("placeholder")
        info.filename = name
        archive.writestr(info, b"evil")
    assert asyncio.run(refused(file, data)) == "incident.bundle.name"
    assert list((data / "recordings").iterdir()) == []
    assert sorted(one.name for one in tmp_path.iterdir()) == ["data", "evil.hubside-incident"]


async def refused(file: Path, data: Path) -> str:
    """Why a file is refused."""
    async with place(data, recording=False) as there:
        with pytest.raises(BundleError) as caught:
            await there.desk.take(file, "Ben")
        return str(caught.value.details["reason_key"])


def _manifest(change: Callable[[dict[str, Any]], None]) -> Callable[[Members], None]:
    def spoil(members: Members) -> None:
        content = json.loads(members[MANIFEST])
        change(content)
        members[MANIFEST] = json.dumps(content).encode()

    return spoil


def _deep(members: Members) -> None:
    members[MANIFEST] = b"[" * 100_000


HOSTILE: dict[str, tuple[Callable[[Members], Any], str]] = {
    "schema": (_manifest(lambda m: m.update(schema=2)), "schema"),
    "format": (_manifest(lambda m: m.update(format="zip")), "format"),
    "no manifest": (lambda members: members.pop(MANIFEST), "manifest"),
    "no JSON": (lambda members: members.update({MANIFEST: b"\xff{"}), "manifest"),
    "deep JSON": (_deep, "manifest"),
    "member elsewhere": (_manifest(lambda m: m["members"][0].update(name="../x")), "manifest"),
    "negative size": (_manifest(lambda m: m["members"][0].update(size_bytes=-1)), "manifest"),
    "member twice": (_manifest(lambda m: m["members"].append(m["members"][0])), "swells"),
    "bomb": (lambda members: members.update({"sets/bomb.json": b"\0" * (64 << 20)}), "swells"),
    "crowd": (lambda members: members.update({f"sets/{n}.json": b"{}" for n in range(500)}), "swells"),
}


@pytest.mark.parametrize("case", HOSTILE)
async def test_what_no_bundle_is_is_refused_with_its_reason(bundle: Path, tmp_path: Path, case: str) -> None:
    spoil, reason = HOSTILE[case]
    members = members_of(bundle)
    spoil(members)
    async with place(tmp_path, recording=False) as there:
        with pytest.raises(BundleError) as caught:
            await there.desk.take(repacked(tmp_path / "hostile", members), "Ben")
        assert caught.value.details["reason_key"] == f"incident.bundle.{reason}"
        assert await there.office.incidents.all() == []


async def test_a_member_that_claims_to_be_small_writes_no_byte_more(bundle: Path, tmp_path: Path) -> None:
    members = members_of(bundle)
    name = next(one for one in members if one.startswith("sets/"))
    content = json.loads(members[MANIFEST])
    next(one for one in content["members"] if one["name"] == name)["size_bytes"] = 5
    members[MANIFEST] = json.dumps(content).encode()
    async with place(tmp_path, recording=False) as there:
        taken = await there.desk.take(repacked(tmp_path / "small", members), "Ben")
        assert [(flaw.member, flaw.reason_key) for flaw in taken.flaws] == [(name, "incident.flawed.changed")]


async def test_what_is_no_zip_at_all_is_refused(tmp_path: Path) -> None:
    async with place(tmp_path, recording=False) as there:
        for data in (b"", b"PK\x03\x04", b"MCAP" * 100):
            (tmp_path / "x").write_bytes(data)
            with pytest.raises(BundleError):
                await there.desk.take(tmp_path / "x", "Ben")


async def test_an_incident_without_its_recording_goes_out_and_says_so(tmp_path: Path) -> None:
    async with place(tmp_path / "a") as here:
        incident = await here.mark()
        (here.folder / "recordings" / MINE).unlink()
        exported = await here.desk.export(incident.id, tmp_path / "x.hubside-incident", "Anna")
        assert exported.manifest.lacking == ("incident.recording.gone",)
    async with place(tmp_path / "b", recording=False) as there:
        taken = await there.desk.take(exported.path, "Ben")
        assert taken.incident is not None and taken.lacking == ("incident.recording.gone",)


def _fields(one: Any) -> dict[str, Any]:
    return {name: getattr(one, name) for name in one.__dataclass_fields__}
