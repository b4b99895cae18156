"""The bus room in a real browser: a decoded trace that filters, pauses and leads on, and stays smooth at full load."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect

from tests.e2e.conftest import site_for
from tests.e2e.processes import ROOT, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
WAIT_MS = 30_000
RATE = 8000
WATCHED_MS = 8000
LONGEST_MS = 50.0
expect.set_options(timeout=20_000)


def profile(browser: Browser, url: str) -> BrowserContext:
    """A browser profile that has opened the printed address once."""
    context = browser.new_context(
        viewport={"width": 1366, "height": 768}, color_scheme="dark", locale="en-GB", accept_downloads=True
    )
    context.set_default_timeout(WAIT_MS)
    first = context.new_page()
    first.goto(f"{url}&scene=off")
    expect(first.get_by_test_id("mode")).to_be_visible(timeout=WAIT_MS)
    first.close()
    return context


@pytest.fixture(scope="module")
def demo(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, BrowserContext]]:
    with running("demo", "--port", "0", "--data", str(tmp_path_factory.mktemp("data")), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        context = profile(browser, url)
        yield f"{url.split('?')[0]}bus?scene=off", context
        context.close()


@pytest.fixture
def page(demo: tuple[str, BrowserContext]) -> Iterator[Page]:
    page = demo[1].new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert errors == []


def test_frames_are_decoded_as_they_come_and_filters_combine(page: Page, demo: tuple[str, BrowserContext]) -> None:
    page.goto(demo[0])
    rows = page.get_by_test_id("trace-row")
    expect(rows.filter(has_text="position actual value").filter(has_text="80.00 °").first).to_be_visible()
    expect(page.get_by_test_id("trace-share")).to_contain_text("all are shown")
    page.get_by_test_id("trace-services").click()
    page.get_by_test_id("trace-services-heartbeat").click()
    page.keyboard.press("Escape")
    expect(rows.filter(has_text="Pre-operational").first).to_be_visible()
    expect(rows.filter(has_text="SDO")).to_have_count(0)
    page.goto(f"{demo[0]}&services=sdo&nodes=11&q=Statuswort&lang=de")
    expect(rows.filter(has_text="Lese-Antwort").first).to_be_visible()
    expect(rows.first).to_contain_text("6041")
    expect(rows.filter(has_not_text="11 Blatt 1 PMC")).to_have_count(0)


def test_a_pause_stands_still_counts_and_goes_on(page: Page, demo: tuple[str, BrowserContext]) -> None:
    page.goto(demo[0])
    rows = page.get_by_test_id("trace-row")
    expect(rows.first).to_be_visible()
    page.get_by_test_id("trace-pause").click()
    expect(page.get_by_test_id("trace-arrived")).to_contain_text(re.compile(r"[1-9]\d{2,} frames since"))
    before = rows.last.get_attribute("data-t")
    expect(page).to_have_url(re.compile("paused=1"))
    assert rows.last.get_attribute("data-t") == before
    rows.last.click()
    detail = page.get_by_test_id("frame-detail")
    expect(detail).to_contain_text(re.compile("(11|29) bit"))
    page.keyboard.press("ArrowUp")
    expect(page.locator("[data-testid=trace-row][data-picked=true]")).not_to_have_attribute("data-t", before or "")
    page.get_by_test_id("trace-pause").click()
    expect(page.get_by_test_id("trace-run")).to_contain_text("Live")
    expect(rows.last).not_to_have_attribute("data-t", before or "")


def rows_kept(page: Page) -> int:
    """How many rows the page has, seen or not."""
    return int(page.get_by_test_id("trace").get_attribute("aria-rowcount") or 0)


def until(page: Page, holds: Callable[[], bool]) -> None:
    """Wait until a condition holds."""
    for _ in range(WAIT_MS // 50):
        if holds():
            return
        page.wait_for_timeout(50)
    raise AssertionError("the condition did not come true in time")


def test_scrolling_up_stops_and_brings_older_frames(page: Page, demo: tuple[str, BrowserContext]) -> None:
    page.goto(demo[0])
    expect(page.get_by_test_id("trace-row").first).to_be_visible()
    until(page, lambda: rows_kept(page) > 200)
    page.get_by_test_id("trace").hover()
    page.mouse.wheel(0, -900)
    expect(page.get_by_test_id("trace-run")).to_contain_text("Paused")
    kept = rows_kept(page)
    page.get_by_test_id("trace").evaluate("(table) => { table.scrollTop = 0 }")
    until(page, lambda: rows_kept(page) > kept + 100)


def test_an_event_leads_to_its_frame_and_the_answer_to_its_request(
    page: Page, demo: tuple[str, BrowserContext]
) -> None:
    page.goto(f"{demo[0]}&tab=sdo&kind=failed&events=open")
    aborted = page.get_by_role("row").filter(has_text="aborted").first
    aborted.click()
    expect(page.get_by_test_id("trace-run")).to_contain_text("Paused")
    picked = page.locator("[data-testid=trace-row][data-picked=true]")
    expect(picked).to_contain_text("ABORT")
    expect(picked).to_have_attribute("data-tone", "error")
    page.get_by_test_id("frame-partner").click()
    expect(picked).to_contain_text("SDO req")
    page.get_by_test_id("event-frame").first.click()
    expect(page.get_by_test_id("frame-detail")).to_be_visible()
    expect(page).to_have_url(re.compile(r"frame=\d{19}"))
    shared = page.url
    page.goto("about:blank")
    page.goto(shared)
    expect(picked).to_be_visible()


def test_the_tables_say_who_is_there_and_how_loaded_the_bus_is(page: Page, demo: tuple[str, BrowserContext]) -> None:
    page.goto(f"{demo[0]}&tab=nodes")
    node = page.get_by_test_id("nodes-can0-11")
    expect(node).to_contain_text("HUBSIDE TWIN PMC")
    expect(node).to_contain_text("every 1000 ms")
    page.get_by_test_id("tab-ids").click()
    expect(page.get_by_test_id("ids-can0-58B")).to_contain_text("SDO resp")
    page.get_by_test_id("tab-load").click()
    expect(page.get_by_test_id("load-now")).to_contain_text("%")
    expect(page.get_by_test_id("load-nodes")).to_contain_text("Blade 1 PMC")


def test_a_table_is_filtered_sorted_cut_and_copied(page: Page, demo: tuple[str, BrowserContext]) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.goto(f"{demo[0]}&tab=ids")
    expect(page.get_by_test_id("ids-can0-70D")).to_be_visible()
    table = page.get_by_test_id("table-ids")
    rows = table.locator("[data-testid^='ids-can0-']")
    page.get_by_test_id("find").fill("heartbeat pmc")
    expect(rows).to_have_count(3)
    page.get_by_test_id("sort-id").click()
    expect(rows.first).to_contain_text("70B")
    page.get_by_test_id("sort-id").click()
    expect(rows.first).to_contain_text("70D")
    expect(table.get_by_role("columnheader", name="ID")).to_have_attribute("aria-sort", "descending")
    page.get_by_test_id("files-menu").click()
    page.get_by_test_id("column-range").click()
    expect(table.get_by_role("columnheader", name="Shortest")).to_have_count(0)
    page.get_by_test_id("table-copy").click()
    copied = [line.split("\t") for line in page.evaluate("navigator.clipboard.readText()").splitlines()]
    assert [line[0] for line in copied] == ["ID", "70D", "70C", "70B"]
    assert "Frames" in copied[0] and "Shortest – longest" not in copied[0]
    expect(page).to_have_url(re.compile(r"find=heartbeat.pmc&order=-id&less=range"))
    page.reload()
    expect(rows).to_have_count(3)
    expect(rows.first).to_contain_text("70D")


def test_a_live_table_keeps_the_focus_and_stands_still_under_it(page: Page, demo: tuple[str, BrowserContext]) -> None:
    page.goto(f"{demo[0]}&tab=ids&order=last")
    rows = page.get_by_test_id("table-ids").locator("[data-testid^='ids-can0-']")
    expect(rows.nth(5)).to_be_visible()
    page.get_by_test_id("find").press("ArrowDown")
    page.keyboard.press("ArrowDown")
    focused = page.get_by_test_id("table-ids").locator("[data-testid^='ids-can0-']:focus")
    expect(focused).to_have_count(1)
    order = rows.evaluate_all("(all) => all.map((row) => row.dataset.testid)")
    at, counted = focused.get_attribute("data-testid"), focused.locator("[data-column=count]").inner_text()
    expect(focused.locator("[data-column=count]")).not_to_have_text(counted)
    assert focused.get_attribute("data-testid") == at
    assert rows.evaluate_all("(all) => all.map((row) => row.dataset.testid)") == order


def test_the_rows_go_along_as_a_file(page: Page, demo: tuple[str, BrowserContext]) -> None:
    page.goto(f"{demo[0]}&services=sdo&q=6041")
    expect(page.get_by_test_id("trace-row").nth(3)).to_be_visible()
    page.get_by_test_id("trace-export").click()
    with page.expect_download() as download:
        page.get_by_test_id("trace-csv").click()
    text = Path(download.value.path()).read_text(encoding="utf-8-sig")
    assert text.startswith("t_ns,") and "6041 statusword" in text


# -- a full bus ---------------------------------------------------------------------------


@pytest.fixture
def flooded(browser: Browser, tmp_path: Path) -> Iterator[tuple[str, BrowserContext]]:
    """A server that listens to a bus of 1 Mbit/s at full load."""
    flood = subprocess.Popen(
        [sys.executable, "-m", "tests.e2e.flood", str(RATE)], stdout=subprocess.PIPE, text=True, cwd=ROOT
    )
    try:
        assert flood.stdout is not None
        port = json.loads(flood.stdout.readline())["port"]
        site = site_for(f"socketcand:127.0.0.1:{port}", tmp_path)
        site.write_text(site.read_text(encoding="utf-8").replace("500000", "1000000"), encoding="utf-8")
        arguments = ("serve", "--site", str(site), "--port", "0", "--json")
        with running("--data", str(tmp_path / "data"), *arguments) as process:
            url = json.loads(process.wait_for('"url"'))["url"]
            context = profile(browser, url)
            yield f"{url.split('?')[0]}bus?scene=off", context
            context.close()
    finally:
        flood.terminate()
        flood.wait(10)
        if flood.stdout is not None:
            flood.stdout.close()


class MainThread:
    """Tasks of the page's main thread, as the browser's own tracing has them: wall and processor time in ms."""

    def __init__(self, page: Page) -> None:
        self._page = page
        self._session = page.context.new_cdp_session(page)
        self._events: list[dict[str, Any]] = []
        self._done = False
        self._session.on("Tracing.dataCollected", lambda data: self._events.extend(data["value"]))

    def _complete(self, _told: object) -> None:
        self._done = True

    def watch(self, ms: int) -> list[tuple[float, float]]:
        """The tasks of the next ``ms``."""
        self._session.on("Tracing.tracingComplete", self._complete)
        self._session.send("Tracing.start", {"categories": "toplevel,__metadata", "transferMode": "ReportEvents"})
        self._page.wait_for_timeout(ms)
        self._session.send("Tracing.end")
        for _ in range(200):
            if self._done:
                break
            self._page.wait_for_timeout(50)
        main = {
            (one["pid"], one["tid"])
            for one in self._events
            if one["name"] == "thread_name" and one["args"]["name"] == "CrRendererMain"
        }
        return [
            (one["dur"] / 1000, one.get("tdur", one["dur"]) / 1000)
            for one in self._events
            if one["name"].endswith("RunTask") and "dur" in one and (one["pid"], one["tid"]) in main
        ]


def figures(share: Locator) -> list[int]:
    """Frames a second that are shown and that match, as the page says."""
    return [int(number) for number in re.findall(r"\d+", share.inner_text())] or [0, 0]


def test_at_full_load_no_task_of_the_page_takes_longer_than_50_ms(flooded: tuple[str, BrowserContext]) -> None:
    """The page shows a sample and says so. On a busy host a task stands still now and then: its own time counts."""
    page = flooded[1].new_page()
    page.add_init_script(
        "window.longTasks = []; new PerformanceObserver((list) => { for (const one of list.getEntries())"
        " window.longTasks.push(one.duration) }).observe({ type: 'longtask' })"
    )
    page.goto(flooded[0])
    share = page.get_by_test_id("trace-share")
    expect(share).to_contain_text("the recording has all")
    until(page, lambda: figures(share)[1] > 0.8 * RATE)
    assert figures(share)[0] < figures(share)[1]
    page.evaluate("window.longTasks.length = 0")
    tasks = MainThread(page).watch(WATCHED_MS)
    wall_ms, own_ms = (max(times) for times in zip(*tasks, strict=True))
    observed = page.evaluate("window.longTasks")
    print(
        f"{len(tasks)} tasks: longest {own_ms:.1f} ms of its own, {wall_ms:.1f} ms by the clock; long tasks {observed}"
    )
    assert len(tasks) > 100
    assert own_ms <= LONGEST_MS, "a task held up the page"
    lost = page.request.get(f"{flooded[0].split('/bus')[0]}/api/live/turbine")
    assert lost.ok
    page.close()
