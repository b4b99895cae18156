"""Lists of recordings and sets: whole, unfinished and unreadable files, and folders that are larger than one look."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from app.recording.content import EventKind
from app.service.file_list import FileList
from app.service.recording_list import FileState, Recordings, attachment, details

SAMPLE = Path(__file__).resolve().parents[2] / "recordings" / "oat-six-nodes.mcap"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One whole recording, one that was cut off, and one that is none."""
    whole = SAMPLE.read_bytes()
    shutil.copy(SAMPLE, tmp_path / "whole.mcap")
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "none.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(500))
    (tmp_path / "other.txt").write_text("not listed")
    return tmp_path


def test_each_file_is_told_as_what_it_is(folder: Path) -> None:
    files = {one.name: one for one in Recordings(folder).files(None)}
    assert set(files) == {"whole.mcap", "cut.mcap", "none.mcap"}
    looks = {name: one.look for name, one in files.items()}
    assert looks["whole.mcap"] is not None and looks["whole.mcap"].state is FileState.FINISHED
    assert looks["cut.mcap"] is not None and looks["cut.mcap"].state is FileState.UNFINISHED
    assert looks["none.mcap"] is not None and looks["none.mcap"].state is FileState.UNFINISHED
    summary = looks["whole.mcap"].summary
    assert summary is not None
    assert summary.frames > 1000
    assert summary.first_ns is not None and summary.last_ns is not None and summary.last_ns > summary.first_ns
    assert files["whole.mcap"].size_bytes == SAMPLE.stat().st_size


def test_the_file_that_is_being_written_is_live(folder: Path) -> None:
    files = {one.name: one for one in Recordings(folder).files(folder / "cut.mcap")}
    live = files["cut.mcap"].look
    assert live is not None and live.state is FileState.LIVE


def test_details_agree_with_the_summary_and_name_damage(folder: Path) -> None:
    whole, cut = details(folder / "whole.mcap"), details(folder / "cut.mcap")
    assert whole.look.summary is not None and cut.look.summary is not None
    buses = sum(count for topic, count in whole.topics.items() if topic not in ("/clock", "/state", "/events"))
    assert buses == whole.look.summary.frames
    assert whole.damages == ()
    assert cut.look.state is FileState.UNFINISHED
    assert cut.look.summary.frames < whole.look.summary.frames
    assert cut.damages != ()
    assert all(kind in EventKind for _, kind, _, _ in whole.losses)


def test_files_inside_can_be_taken_out(folder: Path) -> None:
    name, media_type, size = details(folder / "whole.mcap").attachments[0]
    found = attachment(folder / "whole.mcap", name)
    assert found is not None and (found.media_type, len(found.data)) == (media_type, size)
    assert attachment(folder / "whole.mcap", "nothing") is None


def test_a_name_leads_to_no_other_file(folder: Path) -> None:
    recordings = Recordings(folder / "sub")
    (folder / "sub").mkdir()
    for name in ("../whole.mcap", str(folder / "whole.mcap"), "whole.mcap", ""):
        assert recordings.path(name) is None
    (folder / "sub" / "link.mcap").symlink_to(folder / "whole.mcap")
    assert recordings.path("link.mcap") is None
    assert Recordings(folder).path("whole.mcap") == folder / "whole.mcap"


def test_a_large_folder_is_listed_at_once_and_filled_by_later_looks(tmp_path: Path) -> None:
    for number in range(5):
        (tmp_path / f"{number}.txt").write_text(str(number))
        os.utime(tmp_path / f"{number}.txt", ns=(number, number))
    read: list[str] = []

    def look_at(path: Path) -> str:
        read.append(path.name)
        return path.read_text()

    listed = FileList(tmp_path, "*.txt", look_at)
    first = listed.look(budget_s=0)
    assert [one.name for one in first] == ["4.txt", "3.txt", "2.txt", "1.txt", "0.txt"]
    assert [one.content for one in first] == ["4", None, None, None, None]
    for _ in range(4):
        last = listed.look(budget_s=0)
    assert [one.content for one in last] == ["4", "3", "2", "1", "0"]
    listed.look()
    assert len(read) == 5
    (tmp_path / "2.txt").write_text("changed")
    assert "changed" in [one.content for one in listed.look()]
    assert len(read) == 6
    (tmp_path / "2.txt").unlink()
    assert len(listed.look()) == 4


def test_no_folder_is_an_empty_list(tmp_path: Path) -> None:
    recordings = Recordings(tmp_path / "nothing")
    assert recordings.files(None) == []
    assert recordings.free_bytes is None
