"""Annotations: the store and the file beside the recording say the same, whoever wrote last, and nothing is lost."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import pytest

from app.errors import AnnotationUnknownError, IncidentFieldError
from app.model.incident import Annotation, Note, Span
from app.recording.annotations import read_annotations, sidecar_of, write_annotations
from app.service.incidents.annotations import Mark
from tests.recording.test_annotations import event, foreign
from tests.service.incidents.rig import MINE, NOW, T0, Place, S, place

MARK = Mark(Span(T0, T0 + S), "first", Note.WARNING, "#ffcc00")


@pytest.fixture
async def here(tmp_path: Path) -> AsyncIterator[Place]:
    async with place(tmp_path) as opened:
        yield opened


def recording(here: Place) -> Path:
    return here.folder / "recordings" / MINE


async def texts(here: Place) -> list[str]:
    return [one.text for one in (await here.office.annotations.of(MINE, recording(here))).annotations]


def in_file(here: Place) -> list[Annotation]:
    return read_annotations(sidecar_of(recording(here)), MINE)


async def test_what_another_program_writes_is_merged_and_stays_merged(here: Place) -> None:
    marks = here.office.annotations
    first, _ = await marks.add(MINE, recording(here), MARK, "Anna")
    foreign(sidecar_of(recording(here)), event(T0 // S + 5, T0 // S + 6, title="theirs", ticket="4711"))
    assert await texts(here) == ["first", "theirs"]
    await marks.add(MINE, recording(here), replace(MARK, text="third"), "Anna")
    assert {one.text for one in in_file(here)} == {"first", "theirs", "third"}
    theirs = next(one for one in in_file(here) if one.text == "theirs")
    assert theirs.foreign and theirs.extra["ticket"] == "4711"
    assert "annotations_merged" in await here.kinds()
    foreign(sidecar_of(recording(here)), event(T0 // S + 5, T0 // S + 6, title="theirs", ticket="4711"))
    assert sorted(await texts(here)) == ["first", "theirs", "third"]
    assert (await marks.get(first.id)).person == "Anna"


async def test_of_two_versions_the_younger_counts_and_what_came_off_stays_off(here: Place) -> None:
    marks, path = here.office.annotations, recording(here)
    one, _ = await marks.add(MINE, path, MARK, "Anna")
    before = sidecar_of(path).read_bytes()
    write_annotations(sidecar_of(path), [replace(one, text="from elsewhere", t_ns=NOW + 10**17, person="Ben")])
    assert await texts(here) == ["from elsewhere"]
    sidecar_of(path).write_bytes(before)  # an old copy comes back
    assert await texts(here) == ["from elsewhere"]
    await marks.remove(one.id, path, "Anna")
    assert in_file(here) == []
    sidecar_of(path).write_bytes(before)
    assert await texts(here) == []
    with pytest.raises(AnnotationUnknownError):
        await marks.remove(one.id, path, "Anna")


async def test_a_file_that_cannot_be_read_is_told_and_never_overwritten(here: Place) -> None:
    marks, path = here.office.annotations, recording(here)
    sidecar_of(path).write_bytes(b"no MCAP")
    made, problem = await marks.add(MINE, path, MARK, "Anna")
    assert problem is not None
    assert sidecar_of(path).read_bytes() == b"no MCAP"
    listed = await marks.of(MINE, path)
    assert (listed.annotations, listed.problem is not None) == ((made,), True)
    sidecar_of(path).unlink()
    await marks.add(MINE, path, replace(MARK, text="second"), "Anna")
    assert sorted(one.text for one in in_file(here)) == ["first", "second"]


async def test_a_copy_of_a_recording_has_its_own_annotations(here: Place) -> None:
    marks, path = here.office.annotations, recording(here)
    await marks.add(MINE, path, MARK, "Anna")
    copy = path.with_name("copy.mcap")
    shutil.copy(path, copy)
    shutil.copy(sidecar_of(path), sidecar_of(copy))
    for _ in range(2):
        listed = await marks.of("copy.mcap", copy)
        assert [one.text for one in listed.annotations] == ["first"]
        sidecar_of(copy).write_bytes(sidecar_of(path).read_bytes())
    await marks.remove(listed.annotations[0].id, copy, "Ben")
    assert await texts(here) == ["first"]


@pytest.mark.parametrize(
    ("changes", "field"),
    [({"text": " "}, "text"), ({"colour": "red"}, "colour"), ({"span": Span(9, 3)}, "span"), ({"text": "\0"}, "text")],
)
async def test_what_makes_no_sense_is_refused(here: Place, changes: dict[str, object], field: str) -> None:
    with pytest.raises(IncidentFieldError) as caught:
        await here.office.annotations.add(MINE, recording(here), replace(MARK, **changes), "Anna")  # type: ignore[arg-type]
    assert caught.value.details["field"] == field
    assert await texts(here) == []
