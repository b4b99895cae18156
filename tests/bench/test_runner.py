"""The benchmark runner: its last line and its exit code are what others read."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

from bench import __main__ as runner
from bench._result import Result


def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], result: Result) -> tuple[int, str]:
    module = ModuleType("bench.backup")
    module.run = lambda full: result  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "bench.backup", module)
    monkeypatch.setattr(sys, "argv", ["bench", "backup"])
    code = runner.main()
    return code, capsys.readouterr().out.splitlines()[-1]


def test_a_ratio_that_is_reached_is_ok(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(monkeypatch, capsys, Result(4.06, 4.0)) == (0, "BENCH backup ratio=4.06 target=4 ok")


@pytest.mark.parametrize("result", [Result(3.9, 4.0), Result(9.0, 4.0, shortfalls=("bus busy 80 %",))])
def test_a_ratio_or_a_condition_missed_is_short(
    result: Result, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, line = run(monkeypatch, capsys, result)
    assert code == 1
    assert line.endswith(" target=4 short")


def test_every_benchmark_has_a_name() -> None:
    assert "backup" in runner.NAMES
    assert not any(name.startswith("_") for name in runner.NAMES)
