"""``hubside twin record``: scenarios in, recordings out, beside them or where it is said."""

from __future__ import annotations

import json
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import build_parser
from app.cli.output import Output
from app.errors import UsageError
from app.model.texts import load_texts
from app.recording.reader import open_recording

SCRIPT = """
title = "A short one"
seed = 3
duration_s = 1.0

[start]
operational = true

[[event]]
at_s = 0.8
master = { do = "read", node = 1, address = "3000" }
"""


def record(*arguments: str | Path) -> list[dict[str, Any]]:
    """Run the command; what it told as JSON."""
    words = ["twin", "record", "--json", *map(str, arguments)]
    parsed, out = build_parser(words).parse_args(words), StringIO()
    assert parsed.run(parsed, Output(load_texts("en"), parsed.json, out)) == 0
    return [json.loads(line) for line in out.getvalue().splitlines()]


@pytest.fixture
def scripts(tmp_path: Path) -> list[Path]:
    paths = [tmp_path / "one.toml", tmp_path / "two.toml"]
    for path in paths:
        path.write_text(SCRIPT, encoding="utf-8")
    return paths


def test_recordings_lie_beside_their_scripts_and_take_the_place_of_old_ones(scripts: list[Path]) -> None:
    old = scripts[0].with_suffix(".mcap")
    old.write_bytes(b"old")
    told = record(*scripts)
    assert [one["file"] for one in told] == [str(path.with_suffix(".mcap")) for path in scripts]
    with open_recording(old, strict=True) as recording:
        assert sum(1 for _ in recording.frames()) == told[0]["frames"] > 20
        assert recording.info.turbine == "wtg-07"
    assert sorted(path.suffix for path in old.parent.iterdir()) == [".mcap", ".mcap", ".toml", ".toml"]


def test_several_scripts_need_a_folder(scripts: list[Path]) -> None:
    out = scripts[0].parent / "all.mcap"
    with pytest.raises(UsageError, match="no folder"):
        record(*scripts, "--out", out)
    assert not out.exists()


def test_a_script_that_is_wrong_leaves_the_old_recording(scripts: list[Path]) -> None:
    old = scripts[0].with_suffix(".mcap")
    old.write_bytes(b"old")
    scripts[0].write_text(SCRIPT.replace("node = 1", "node = 77"), encoding="utf-8")
    with pytest.raises(UsageError, match="77"):
        record(scripts[0])
    assert old.read_bytes() == b"old"
