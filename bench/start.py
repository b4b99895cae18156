"""From ``hubside demo`` to the first page with live values in a browser, and what the demo takes while nobody acts.

A start is warm: the second one and later, Python's bytecode is there as after an installation. Time runs from starting
the process to the moment when the page shows the angles of all three blades; the browser runs already, with an empty
profile for each start, and opens the address as soon as it is printed. Idle is the demo's whole process tree, server
and twins, with one page open on it; the browser is not counted.

No peer does this: ratio = limit / ours, the worse of both.
"""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NamedTuple

from playwright.sync_api import Browser, Page, sync_playwright

from bench._chromium import CHROMIUM, FLAGS
from bench._cpu import tree_cpu_s
from bench._priority import preferred
from bench._process import Child
from bench._result import Result

START_LIMIT_S: Final = 3.0
IDLE_LIMIT: Final = 0.40
"""Of one core."""
SETTLE_S: Final = 2.0
"""After the first values: the first look at all parameters has passed."""
WAIT_MS: Final = 30_000
_LIVE: Final = (
    "() => [1, 2, 3].every(blade => /\\d\\d\\.\\d\\d°/.test("
    "document.querySelector(`[data-testid=blade-${blade}] [data-testid=angle]`)?.textContent ?? ''))"
)
"""All three blades show an angle."""


class Start(NamedTuple):
    """Times in s since the process was started: its address was printed, the page shows all angles."""

    printed_s: float
    live_s: float


class Idle(NamedTuple):
    """Processor time as a share of one core."""

    server: float
    twins: float

    @property
    def total(self) -> float:
        """Both processes."""
        return self.server + self.twins


def run(full: bool) -> Result:
    """Four warm starts and 8 s of idling; nine and 60 s in the long form. The median start counts."""
    return measure(9, 60.0) if full else measure(4, 8.0)


def measure(starts: int, idle_s: float) -> Result:
    """Start, open, wait for values, end; the last one is left alone for a while."""
    with preferred() as scheduling, tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        data = Path(name)
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=list(FLAGS))
        with _started(chromium, data):
            pass  # the first one is cold
        times = []
        for _ in range(starts - 1):
            with _started(chromium, data) as (_, _, start):
                times.append(start)
        with _started(chromium, data) as (demo, page, start):
            times.append(start)
            open_scene = _idle(demo, page, "/", idle_s)
            alone = _idle(demo, page, "/?scene=off", idle_s)
        chromium.close()
    live_s = statistics.median(each.live_s for each in times)
    printed_s = statistics.median(each.printed_s for each in times)
    return Result(
        min(START_LIMIT_S / live_s, IDLE_LIMIT / alone.total),
        1.0,
        (
            f"{starts} warm starts, {idle_s:g} s of idling; scheduling: {scheduling}",
            f"start to three blades with live angles: {live_s:.2f} s, limit {START_LIMIT_S:g} s "
            f"({' '.join(f'{each.live_s:.2f}' for each in times)}); address printed after {printed_s:.2f} s",
            f"idle, one page open: {_shares(alone)} of a core, limit {IDLE_LIMIT:.0%}",
            f"idle, one page and the 3D view open: {_shares(open_scene)} of a core",
        ),
    )


def _shares(idle: Idle) -> str:
    return f"{idle.total:.1%} (server {idle.server:.1%}, twins {idle.twins:.1%})"


@contextmanager
def _started(chromium: Browser, data: Path) -> Iterator[tuple[Child, Page, Start]]:
    """A demo, the page on it, and how long that took."""
    context = chromium.new_context(viewport={"width": 1366, "height": 768}, locale="en-GB")
    page = context.new_page()
    began_s = time.perf_counter()
    arguments = ("demo", "--json", "--port", "0", "--data", str(data))
    with Child("app.cli", *arguments, quiet=True, environment=_environment()) as demo:
        try:
            url = demo.hear()["url"]
            printed_s = time.perf_counter() - began_s
            page.goto(url, wait_until="commit")
            page.wait_for_function(_LIVE, timeout=WAIT_MS)
            yield demo, page, Start(printed_s, time.perf_counter() - began_s)
            context.close()
        finally:
            demo.terminate()


def _environment() -> dict[str, str]:
    """Ours, but Python keeps its bytecode, as it does unless told otherwise."""
    return {name: text for name, text in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def _idle(demo: Child, page: Page, path: str, seconds: float) -> Idle:
    """What the demo takes while a page stands at ``path`` and nobody acts."""
    page.goto(page.url.partition("?")[0].rstrip("/") + path, wait_until="commit")
    page.wait_for_function(_LIVE, timeout=WAIT_MS)
    page.wait_for_timeout(SETTLE_S * 1000)
    before, began_s = tree_cpu_s(demo.pid), time.perf_counter()
    page.wait_for_timeout(seconds * 1000)
    after, elapsed_s = tree_cpu_s(demo.pid), time.perf_counter() - began_s
    shares = {pid: (after[pid] - before.get(pid, 0.0)) / elapsed_s for pid in after}
    server = shares.pop(demo.pid)
    return Idle(server, sum(shares.values()))
