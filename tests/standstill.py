"""A test that failed while the whole machine stood still is run once more: its times were not ours.

Drives, pages and the dead man miss each other after fractions of a second, and a virtual machine is sometimes left out
for one. A process of its own notices that: it sleeps 10 ms at a time and does nothing else, so that what our own code
holds up never counts. A failure without a standstill stays one.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

STANDSTILL_S = 0.2
RERUNS = 2
_SLEEP = f"""
import os, sys, time
parent, last = os.getppid(), time.monotonic()
while os.getppid() == parent:
    time.sleep(0.01)
    now = time.monotonic()
    if now - last > {STANDSTILL_S}:
        print(last, now, flush=True)
    last = now
"""


class Watcher:
    """Knows the standstills of the machine since it began."""

    def __init__(self) -> None:
        # Its whole life is the session's: it ends in ``close``, or with its parent.
        self.process = subprocess.Popen([sys.executable, "-S", "-E", "-c", _SLEEP], stdout=subprocess.PIPE)
        assert self.process.stdout is not None
        self._told = self.process.stdout.fileno()
        os.set_blocking(self._told, False)
        self._rest = b""
        self._seen: list[tuple[float, float]] = []
        self.begun_s = time.monotonic()

    def longest_s(self) -> float:
        """The longest standstill since ``begun_s``, 0 where there was none."""
        try:
            lines = (self._rest + os.read(self._told, 65536)).split(b"\n")
        except BlockingIOError:
            lines = [self._rest]
        self._rest = lines.pop()
        self._seen += [(float(begin), float(end)) for begin, end in (line.split() for line in lines)]
        return max((end - begin for begin, end in self._seen if end > self.begun_s), default=0.0)

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


_WATCHER = pytest.StashKey[Watcher]()


def pytest_sessionstart(session: pytest.Session) -> None:
    if not session.config.option.collectonly:
        session.config.stash[_WATCHER] = Watcher()


def pytest_sessionfinish(session: pytest.Session) -> None:
    watcher = session.config.stash.get(_WATCHER, None)
    if watcher is not None:
        watcher.close()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    def stood(error: BaseException | None) -> bool:
        longest_s = 0.0 if error is None else config.stash[_WATCHER].longest_s()
        if longest_s:
            print(f"the machine stood still for {longest_s:.2f} s: once more", file=sys.stderr)
        return longest_s > 0

    for item in items:
        item.add_marker(pytest.mark.flaky(reruns=RERUNS, condition=stood))


def pytest_runtest_setup(item: pytest.Item) -> None:
    item.config.stash[_WATCHER].begun_s = time.monotonic()
