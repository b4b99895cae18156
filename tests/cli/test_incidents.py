"""``hubside incident``: list, show, export, open, report, and what is refused."""

from __future__ import annotations

import asyncio
import json
import zipfile
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from tests.service.incidents.rig import MINE, place


class Command:
    """The command on a data folder."""

    def __init__(self, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.data = data
        self._capsys = capsys

    def run(self, *words: str) -> tuple[int, str, str]:
        """Exit code, standard output and standard error."""
        code = main(["--data", str(self.data), "incident", *words])
        told = self._capsys.readouterr()
        return code, told.out, told.err

    def json(self, *words: str) -> Any:
        """What it tells machines."""
        code, out, err = self.run(*words, "--json")
        assert code == 0, err
        return json.loads(out.splitlines()[-1])


@pytest.fixture
def command(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    asyncio.run(marked(tmp_path / "data"))
    return Command(tmp_path / "data", capsys)


async def marked(folder: Path) -> None:
    async with place(folder) as here:
        await here.mark()


def test_an_incident_is_listed_shown_exported_and_opened_elsewhere(
    command: Command, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (one,) = command.json("list")
    assert (one["title"], one["recording"], one["plots"][0][0]) == (
        "Blade 2 trips",
        MINE,
        "wtg-07/blade-2/pmc/6064",
    )
    assert command.json("list", "--search", "nothing") == []
    code, out, _ = command.run("show", one["code"])
    assert code == 0 and "The recording is there." in out and "Grease on the gear." in out
    bundle = tmp_path / "trip.hubside-incident"
    assert command.json("export", one["code"], "--output", str(bundle))["file"] == str(bundle)
    assert command.run("export", one["code"], "--output", str(bundle))[0] == 2
    other = Command(tmp_path / "other", capsys)
    opened = other.json("open", str(bundle))
    assert (opened["code"], opened["flaws"]) == (one["code"], 0)
    assert (tmp_path / "other" / "recordings" / opened["recording"]).is_file()
    assert other.json("show", one["code"])["recording_state"] == "there"


def test_a_damaged_bundle_is_told_and_ends_with_an_error(
    command: Command, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (one,) = command.json("list")
    bundle = tmp_path / "trip.hubside-incident"
    command.json("export", one["id"], "--output", str(bundle))
    spoilt = tmp_path / "spoilt"
    with zipfile.ZipFile(bundle) as source, zipfile.ZipFile(spoilt, "w") as target:
        for info in source.infolist():
            if info.filename != "notes.md":
                target.writestr(info.filename, source.read(info))
    other = Command(tmp_path / "other", capsys)
    code, out, err = other.run("open", str(spoilt))
    assert code == 1 and "notes.md is missing" in err and one["code"] in out
    (tmp_path / "no").write_bytes(b"no zip")
    code, _, err = other.run("open", str(tmp_path / "no"))
    assert code == 2 and "it is no zip file" in err
    assert command.run("show", "zzzzzzz")[0] == 3


def test_a_report_is_written_once(command: Command, tmp_path: Path) -> None:
    (one,) = command.json("list")
    target = tmp_path / "report.html"
    told = command.json("report", one["code"], "--output", str(target))
    assert told["size"] == target.stat().st_size
    assert "following error too large (8611h)" in target.read_text()
    assert command.run("report", one["code"], "--output", str(target))[0] == 2
