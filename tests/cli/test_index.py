"""``hubside index`` makes indexes and tells what is in them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from app.cli.main import main
from app.recording.index import index_path, open_index
from tests.recording.index_rig import SCENARIOS
from tests.recording.rig import Bench


def test_it_makes_the_index_once_and_tells_what_is_in_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "trip.mcap"
    shutil.copy(SCENARIOS[2], path)
    assert main(["--data", str(tmp_path / "data"), "--json", "index", str(path)]) == 0
    told = json.loads(capsys.readouterr().out)
    index = open_index(path)
    assert index is not None
    with index:
        assert told["index"] == str(index.path)
        assert (told["frames"], told["signals"]) == (index.frames, len(index.signals()))
        assert (told["events"], told["signs"]) == (len(index.events()), len(index.signs()))
        assert told["gaps"] == {"restart": len(index.gaps())}
    made_ns = index_path(path).stat().st_mtime_ns
    assert main(["index", str(path)]) == 0
    assert f"{told['frames']} frames" in capsys.readouterr().out
    assert index_path(path).stat().st_mtime_ns == made_ns
    assert main(["index", "--again", str(path)]) == 0
    assert index_path(path).stat().st_mtime_ns > made_ns


def test_it_names_gaps_and_goes_on_behind_a_file_that_it_cannot_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = Bench(tmp_path)
    bench.run(0.5, per_step=5)
    bench.core.count_lost("can0", 7, bench.clock.monotonic, bench.clock.monotonic + 5)
    bench.run(3)
    bench.core.shut()
    path = next(tmp_path.glob("*.mcap"))
    assert main(["index", str(tmp_path / "none.mcap"), str(path)]) == 2
    printed = capsys.readouterr()
    assert "none.mcap" in printed.err
    assert "frames lost, 0.000 s: 7 frames" in printed.out
