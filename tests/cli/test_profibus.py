"""``--profibus``: commands on a line of PROFIBUS-DP, against a twin in real time, with the exit codes of CAN."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from app.model.sets import load_set
from app.recording.reader import open_recording
from app.wire.frame import Fdl
from tests.drivers.profibus_rig import NODE, RAMP_VELOCITY, Wire, wire

pytestmark = [pytest.mark.alone, pytest.mark.timeout(120)]  # a serial line in its own time

VELOCITY = "12/61"


@dataclass
class Bench:
    """``hubside`` on a data folder of its own, and a line."""

    wire: Wire
    data: Path
    capsys: pytest.CaptureFixture[str]

    @property
    def port(self) -> str:
        return f"{self.wire.line.path}@{self.wire.baud}"

    def __call__(self, command: str, *words: object, at: str | None = None) -> tuple[int, Any, str]:
        """Exit code, the last result, and what was said."""
        where = ("--profibus", at or f"{self.port},{NODE}", "--listen-s", "0.1")
        code = main(["--data", str(self.data), command, *where, *map(str, words), "--json"])
        told = self.capsys.readouterr()
        lines = told.out.strip().splitlines()
        return code, json.loads(lines[-1]) if lines else None, told.err


@pytest.fixture
def bench(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    with wire() as line:
        yield Bench(line, tmp_path / "data", capsys)


def test_a_scan_finds_who_answers_on_the_line(bench: Bench) -> None:
    code, found, said = bench("scan", at=bench.port)
    assert code == 0, said
    (node,) = found
    assert (node["node"], node["description"], node["twin"]) == (NODE, "wandfluh-ed2", True)


def test_one_is_read_written_and_saved(bench: Bench) -> None:
    code, read, said = bench("read", NODE, VELOCITY)
    assert code == 0, said
    code, _, said = bench("write", NODE, VELOCITY, "120 mm/s", "--save")
    assert code == 0, said
    assert bench.wire.device.channels[0].number(*RAMP_VELOCITY[:2]) == 1200
    bench.wire.power_off()
    bench.wire.power_on()
    code, read, said = bench("read", NODE, VELOCITY)
    assert (code, read["values"][VELOCITY]["raw"]) == (0, 1200), said


def test_a_value_out_of_range_is_refused_before_it_is_sent(bench: Bench) -> None:
    code, _, said = bench("write", NODE, VELOCITY, "99999")
    assert code == 3
    assert VELOCITY in said and "10000" in said
    assert bench.wire.device.channels[0].number(*RAMP_VELOCITY[:2]) == 1000


def test_a_backup_is_a_set_of_all_it_holds(bench: Bench) -> None:
    code, told, said = bench("backup")
    assert told is not None, (code, said)
    kept = load_set(Path(told["file"]).read_text(encoding="utf-8"), "set")
    assert kept.origin.device == f"bus/nodes/{NODE}"
    assert kept.values[RAMP_VELOCITY] == 1000


def test_the_line_is_recorded_meanwhile(bench: Bench) -> None:
    assert bench("read", NODE, VELOCITY, "--record")[0] == 0
    (file,) = (bench.data / "recordings").glob("*.mcap")
    with open_recording(file) as recording:
        frames = list(recording.frames())
    assert frames and all(isinstance(one.payload, Fdl) for one in frames)


@pytest.mark.parametrize(
    ("where", "reason"),
    [
        ("{port}@500001,6", "no bit rate of PROFIBUS"),
        ("{port}", "is not PORT@BAUD"),
        ("{port}@500000,6,6", "two stations have the same address"),
        ("{port}@500000,6/3", "3 is no telegram type"),
        ("{port}@500000,2", "2 is our own address"),
    ],
)
def test_wrong_lines_are_usage_errors(bench: Bench, where: str, reason: str) -> None:
    code, _, said = bench("read", 6, VELOCITY, at=where.format(port=bench.wire.line.path))
    assert code == 2
    assert reason in said


def test_where_nobody_answers_the_code_is_5_and_a_port_that_is_not_there_is_named(bench: Bench) -> None:
    code, _, said = bench("read", 9, VELOCITY, at=f"{bench.port},9")
    assert code == 5, said
    code, _, said = bench("read", 6, VELOCITY, at="/dev/none@500000,6")
    assert code != 0 and "/dev/none" in said
