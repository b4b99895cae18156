"""``hubside trips`` and ``hubside search`` on the scenarios."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from app.cli.main import main
from app.recording.index import index_path
from tests.recording.make_pd4e import SAMPLE
from tests.service.analysis.rig import look, scenario, the_trip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for number in (1, 3, 5):
        source = look(number).path
        os.link(source, tmp_path / source.name)
        os.link(index_path(source), index_path(tmp_path / source.name))
    return tmp_path


def test_trips_are_told_with_their_steps(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(path) for path in sorted(folder.glob("*.mcap"))]
    assert main(["--data", str(folder / "data"), "trips", "--steps", *files]) == 0
    out = capsys.readouterr().out
    assert "1-normal-operation.mcap: no trip" in out
    assert "2026-03-02T09:00:26.515Z: Blade 2 PMC: following error too large (8611h)" in out
    assert "  T0    945 ms  Blade 1 PMM: the safety relay X13.11/X13.12 opens\n" in out
    assert "because a unit in fault opens its contact: blade 1 PMM: battery voltage too low (3280h)" in out
    assert main(["--json", "--data", str(folder / "data"), "trips", files[2]]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["t0_ns"], told["first"], told["nodes"][0]) == (the_trip(5).t0_ns, "mains_low", "can0/1")


def test_a_recording_that_begins_in_a_trip_names_who_was_tripped(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    left = tmp_path / "left.mcap"
    assert main(["cut", str(look(3).path), "--from", "26.7", "--output", str(left)]) == 0
    capsys.readouterr()
    assert main(["--data", str(tmp_path / "data"), "trips", str(left)]) == 0
    out = capsys.readouterr().out
    assert "left.mcap: no trip\n  Tripped already before the recording: blades 1, 2, 3 PMM, blades 1, 2, 3 PMC" in out


def test_a_folder_is_searched_and_what_has_no_index_is_told_or_gets_one(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = [
        "--json",
        "--data",
        str(folder / "data"),
        "search",
        "60F4 > 0.5 deg within 5 s before emcy 8611",
        str(folder),
    ]
    assert main(asked) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(one["file"][0], one["node"]) for one in lines] == [("3", "can0/12"), ("5", "can0/11")]
    (folder / "4-plain.mcap").write_bytes(scenario(3).read_bytes())
    assert main(asked) == 2
    printed = capsys.readouterr()
    assert "4-plain.mcap was not searched. It has no index yet." in printed.err
    assert len(printed.out.splitlines()) == 2
    assert main([*asked, "--index"]) == 0
    assert [json.loads(line)["file"][0] for line in capsys.readouterr().out.splitlines()] == ["3", "4", "5"]


def test_a_signature_that_is_not_understood_names_the_character(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["search", "60F4 > > 2"]) == 2
    assert "at character 8 (>)" in capsys.readouterr().err


def test_a_recording_of_modbus_is_searched_by_levels_and_its_trip_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / SAMPLE.name
    shutil.copy(SAMPLE, path)
    data = ["--data", str(tmp_path / "data")]
    assert main([*data, "index", str(path)]) == 0
    capsys.readouterr()

    def found(text: str) -> int:
        assert main(["--json", *data, "search", text, str(path)]) == 0
        return len(capsys.readouterr().out.splitlines())

    assert found("6064 > 700 deg on node 1") == 1, "one stretch at two turns"
    assert found("6064 > 730 deg") == 0
    assert found("60F4 < -20 deg within 1 s before axis_fault") == 1, "the shaft blocks on the way back"
    assert found("60F4 > 20 deg within 1 s before axis_fault") == 0
    assert main(["--json", *data, "trips", str(path)]) == 0
    assert "axis_fault" in capsys.readouterr().out
