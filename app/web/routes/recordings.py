"""Recordings of the data folder: the list, one of them, its bytes."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Final

from fastapi import APIRouter, Depends, Response
from fastapi.responses import FileResponse, StreamingResponse

from app.service import recording_list
from app.service.bench import Bench
from app.service.recording_list import FileState, Look, RecordingFile, Recordings, Summary
from app.web.attachment import as_attachment
from app.web.deps import BenchOf
from app.web.models.recordings import (
    AttachmentRef,
    DamageRef,
    FileStateName,
    LossRef,
    RecordingDoc,
    RecordingList,
    RecordingRef,
    RecordingSummary,
)
from app.web.problem import NotFoundError, jsonable

MCAP: Final = "application/octet-stream"
PIECE: Final = 1 << 20
router = APIRouter()


def get_recordings(bench: BenchOf) -> Recordings:
    """The recordings that this server knows. Raises NotFoundError where it has no data folder."""
    if bench.recordings is None:
        raise NotFoundError(what="recordings")
    return bench.recordings


RecordingsOf = Annotated[Recordings, Depends(get_recordings)]


@router.get("/recordings")
async def recordings(bench: BenchOf, all_of_them: RecordingsOf) -> RecordingList:
    """The recordings, latest first. Those of state ``unread`` are filled in by the next requests."""
    files = await asyncio.to_thread(all_of_them.files, live_file(bench))
    return RecordingList(
        folder=str(all_of_them.folder), free_bytes=all_of_them.free_bytes, files=[_ref(one) for one in files]
    )


@router.get("/recordings/{name}")
async def recording(bench: BenchOf, all_of_them: RecordingsOf, name: str) -> RecordingDoc:
    """What one recording holds beside its frames; of the one that is being written only where it lies."""
    path = _known(all_of_them, name)
    if is_live(bench, path):
        return RecordingDoc(
            name=name, path=str(path), state="live", summary=None,
            metadata={}, topics={}, attachments=[], damages=[], losses=[],
        )  # fmt: skip
    found = await asyncio.to_thread(recording_list.details, path)
    return RecordingDoc(
        name=name,
        path=str(path),
        state=_state(found.look),
        summary=_summary(found.look.summary),
        metadata={title: dict(table) for title, table in found.metadata.items()},
        topics=dict(found.topics),
        attachments=[AttachmentRef(name=n, media_type=kind, size_bytes=size) for n, kind, size in found.attachments],
        damages=[DamageRef(offset=at, length=size, reason=why, detail=text) for at, size, why, text in found.damages],
        losses=[
            LossRef(t_ns=t_ns, text_key=f"recording.event.{kind.value}", details={"bus": bus, **_plain(more)})
            for t_ns, kind, bus, more in found.losses
        ],
    )


@router.get("/recordings/{name}/download", response_class=FileResponse)
async def download_recording(bench: BenchOf, all_of_them: RecordingsOf, name: str) -> Response:
    """The file; of the one that is being written what it holds now."""
    path = _known(all_of_them, name)
    if not is_live(bench, path):
        return FileResponse(path, media_type=MCAP, headers=as_attachment(path.name))
    size = path.stat().st_size
    headers = {**as_attachment(path.name), "Content-Length": str(size)}
    return StreamingResponse(_first_bytes(path, size), media_type=MCAP, headers=headers)


@router.get("/recordings/{name}/attachment", response_class=Response)
async def download_attachment(all_of_them: RecordingsOf, name: str, attachment: str) -> Response:
    """A file inside a recording, a parameter set for example."""
    path = _known(all_of_them, name)
    found = await asyncio.to_thread(recording_list.attachment, path, attachment)
    if found is None:
        raise NotFoundError(what=attachment)
    return Response(found.data, media_type=found.media_type, headers=as_attachment(attachment))


def _known(all_of_them: Recordings, name: str) -> Path:
    path = all_of_them.path(name)
    if path is None:
        raise NotFoundError(what=name)
    return path


def live_file(bench: Bench) -> Path | None:
    """The file that is being written now."""
    connection = bench.connection
    recording = None if connection is None else connection.recording
    return None if recording is None else recording.status().file


def is_live(bench: Bench, path: Path) -> bool:
    """Whether the file is being written now."""
    live = live_file(bench)
    return live is not None and live.name == path.name


def _first_bytes(path: Path, size: int) -> Iterator[bytes]:
    with path.open("rb") as file:
        while size > 0 and (piece := file.read(min(PIECE, size))):
            size -= len(piece)
            yield piece


def _ref(one: RecordingFile) -> RecordingRef:
    look = one.look
    return RecordingRef(
        name=one.name,
        size_bytes=one.size_bytes,
        modified_ns=one.modified_ns,
        state="unread" if look is None else _state(look),
        summary=None if look is None else _summary(look.summary),
        reason=None if look is None else look.reason,
        sample=one.sample,
    )


def _state(look: Look) -> FileStateName:
    names: dict[FileState, FileStateName] = {
        FileState.LIVE: "live",
        FileState.FINISHED: "finished",
        FileState.UNFINISHED: "unfinished",
        FileState.UNREADABLE: "unreadable",
    }
    return names[look.state]


def _summary(summary: Summary | None) -> RecordingSummary | None:
    return None if summary is None else RecordingSummary.model_validate(summary)


def _plain(details: Any) -> dict[str, Any]:
    plain: dict[str, Any] = jsonable(dict(details))
    return plain
