"""What is run once more, and what is not."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.standstill import STANDSTILL_S, Watcher

ROOT = Path(__file__).parents[1]
FAILS_ONCE = """
import os, pathlib, signal, time
from tests.standstill import _WATCHER

def test_it(request, tmp_path_factory):
    before = pathlib.Path(__file__).with_name("before")
    if before.exists():
        return
    before.touch()
    if {stands}:
        pid = request.config.stash[_WATCHER].process.pid
        time.sleep(0.2)
        os.kill(pid, signal.SIGSTOP)
        time.sleep(0.5)
        os.kill(pid, signal.SIGCONT)
        time.sleep(0.2)
    assert False
"""


@pytest.fixture
def watcher() -> Iterator[Watcher]:
    opened = Watcher()
    yield opened
    opened.close()


def test_a_standstill_is_seen_until_the_next_test_begins(watcher: Watcher) -> None:
    time.sleep(0.3)
    os.kill(watcher.process.pid, signal.SIGSTOP)
    time.sleep(2 * STANDSTILL_S)
    os.kill(watcher.process.pid, signal.SIGCONT)
    time.sleep(0.3)
    assert watcher.longest_s() > STANDSTILL_S
    watcher.begun_s = time.monotonic()
    assert watcher.longest_s() < STANDSTILL_S


def test_what_holds_up_our_own_code_is_none(watcher: Watcher) -> None:
    time.sleep(0.3)
    watcher.begun_s = end_s = time.monotonic()
    end_s += 3 * STANDSTILL_S
    while time.monotonic() < end_s:
        pass
    assert watcher.longest_s() < STANDSTILL_S


@pytest.mark.parametrize(("stands", "passes"), [(True, True), (False, False)])
def test_only_a_failure_with_a_standstill_is_run_once_more(tmp_path: Path, stands: bool, passes: bool) -> None:
    (tmp_path / "test_once.py").write_text(FAILS_ONCE.format(stands=stands))
    command = [sys.executable, "-m", "pytest", "-p", "tests.standstill", "-p", "no:cacheprovider", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode == 0) is passes, done.stdout
    assert ("1 rerun" in done.stdout) is passes
