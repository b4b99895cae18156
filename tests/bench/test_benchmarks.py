"""Every benchmark of the live path runs, in a tiny form, and says what it must; how fast it is, is not judged here."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from bench import __main__ as command
from bench import fc101, fleet, latency, record, scope
from bench._cpu import tree_cpu_s
from bench._load import PMC_NODES, frames, position_of
from bench._result import Result

CLOSING = re.compile(r"^BENCH \w+ ratio=\d+\.\d\d target=[\d.]+ (ok|short)$")


def test_record_loses_no_frame_of_a_calm_bus() -> None:
    done = record.measure(windows=1, seconds=1.0, rate_hz=1000)
    assert done.ratio > 0
    assert not [shortfall for shortfall in done.shortfalls if "lost" in shortfall or "order" in shortfall]
    assert "sent 2500 frames, in our file 2500, in the peer's 2500" in done.lines


def test_the_scope_and_its_peer_catch_the_same_and_all_of_it() -> None:
    done = scope.measure(rounds=1, seconds=1.5)
    assert done.ratio > 0
    assert not done.shortfalls
    assert "16 signals" in done.lines[0]


def test_a_fleet_is_compared_alike_by_both(tmp_path: Path) -> None:
    done = fleet.measure(sets=60, parameters=40, rounds=1, cache=tmp_path)
    assert not done.shortfalls
    assert done.lines[0].startswith("60 sets of 40 parameters, ")
    assert " 0 differences" not in done.lines[0]
    again = fleet.measure(sets=60, parameters=40, rounds=1, cache=tmp_path)
    assert len(list(tmp_path.iterdir())) == 1, "what was generated is kept"
    assert again.lines[0] == done.lines[0]


def test_a_dictionary_is_read_alike_by_fc_101_and_one_by_one() -> None:
    done = fc101.measure(rounds=1)
    assert not done.shortfalls
    objects, single, whole = done.lines
    count, requests = found(r"^(\d+) objects", objects), found(r"in (\d+) requests", single)
    assert count == requests > 20 * found(r"in (\d+) requests", whole)


def found(pattern: str, line: str) -> int:
    """The number that a line tells."""
    match = re.search(pattern, line)
    assert match is not None, line
    return int(match[1])


def test_every_position_on_the_bus_reaches_the_client() -> None:
    done = latency.measure(rounds=1, seconds=1.0, limits_s={0.1: 60.0})
    assert done.ratio > 1  # not one came later than a minute, and none never
    assert [line for line in done.lines if line.startswith("values at 10% load")]
    assert [line for line in done.lines if line.startswith("axes at 10% load")]


def test_a_position_counts_from_its_frame_to_the_first_message_with_it_or_a_later_one() -> None:
    sent = [(11, 1, 0), (11, 2, 10), (11, 3, 20), (12, 1, 5), (12, 2, 15)]
    arrivals = [latency.Arrival(30, 11, 2), latency.Arrival(35, 12, 1), latency.Arrival(50, 11, 3)]
    found = latency.latencies(sent, arrivals)
    assert found.times_s == [each / 1e9 for each in (20, 30, 30, 30)]
    assert found.unseen == 1
    assert found.percentile(0.5) == 30 / 1e9
    assert found.percentile(1.0) == float("inf")


def test_the_load_is_always_the_same_and_no_position_comes_twice() -> None:
    load = frames(4000, first_cycle=1000)
    assert load == frames(4000, first_cycle=1000)
    seen = [position for position in map(position_of, load) if position is not None]
    assert len(seen) == len(set(seen))
    assert {node for node, _ in seen} == set(PMC_NODES)
    assert min(position for _, position in seen) == 1000


@pytest.mark.parametrize(
    ("result", "word", "code"),
    [
        (Result(1.25, 1.0), "ok", 0),
        (Result(0.5, 0.67), "short", 1),
        (Result(2.0, 1.0, ("a figure",), ("frames lost",)), "short", 1),
    ],
)
def test_the_last_line_gives_the_verdict(
    result: Result, word: str, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(record, "run", lambda full: result)
    monkeypatch.setattr("sys.argv", ["bench", "record"])
    assert command.main() == code
    last = capsys.readouterr().out.splitlines()[-1]
    assert CLOSING.match(last)
    assert last.endswith(word)


def test_the_processor_time_of_a_process_counts_what_it_started() -> None:
    burn = "import time\nwhile time.process_time() < 0.3: pass\nprint(flush=True)\ninput()"
    outer = f"import subprocess, sys\nsubprocess.run([sys.executable, '-c', {burn!r}])"
    with subprocess.Popen([sys.executable, "-c", outer], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        times = tree_cpu_s(process.pid)
        process.communicate(b"\n", timeout=30)
    assert len(times) == 2
    assert sum(times.values()) - times[process.pid] >= 0.25
