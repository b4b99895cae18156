"""Recordings in a real browser: what runs, what was kept, its bytes, and the sets that are recovered from it."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.e2e.processes import ROOT, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
WAIT_MS = 60_000
expect.set_options(timeout=20_000)


@pytest.fixture(scope="module")
def home(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Page]]:
    data = tmp_path_factory.mktemp("data")
    (data / "recordings").mkdir()
    shutil.copy(ROOT / "recordings" / "oat-six-nodes.mcap", data / "recordings" / "sample.mcap")
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        context = browser.new_context(viewport={"width": 1366, "height": 768}, locale="en-GB", accept_downloads=True)
        page = context.new_page()
        page.goto(f"{url}&scene=off")
        expect(page.get_by_test_id("mode")).to_be_visible(timeout=WAIT_MS)
        yield url.split("?")[0], page
        context.close()


def test_the_running_recording_is_marked_and_a_finished_one_is_opened_and_downloaded(
    home: tuple[str, Page], tmp_path: Path
) -> None:
    address, page = home
    page.goto(f"{address}recordings?scene=off")
    expect(page.get_by_text("recording", exact=True)).to_be_visible(timeout=WAIT_MS)
    expect(page.get_by_test_id("running")).to_contain_text("REC")
    row = page.get_by_test_id("row-sample.mcap")
    expect(row).to_contain_text("finished")
    row.focus()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("file=sample.mcap"))
    details = page.get_by_test_id("recording-details")
    expect(details).to_contain_text("/can0")
    expect(details).to_contain_text("sample.mcap")
    with page.expect_download() as download:
        details.get_by_text("Download", exact=True).click()
    target = tmp_path / "got.mcap"
    download.value.save_as(target)
    assert target.read_bytes() == (ROOT / "recordings" / "oat-six-nodes.mcap").read_bytes()
    page.get_by_test_id("find").fill("nothing like that")
    expect(page.get_by_text("Nothing matches")).to_be_visible()


def test_sets_are_recovered_from_a_recording_and_each_value_tells_when_it_was_seen(home: tuple[str, Page]) -> None:
    address, page = home
    page.goto(f"{address}recordings?scene=off&file=sample.mcap")
    page.get_by_test_id("recover-sets").click()
    found = page.get_by_test_id("recovered-sets")
    expect(found.locator("li")).to_have_count(6)
    expect(found).to_contain_text("wtg-07/blade-1/pmm: 287 values read, 0 written")
    found.locator("li", has_text="wtg-07/blade-1/pmm").get_by_role("link").click()
    details = page.get_by_test_id("set-details")
    expect(details).to_contain_text("Seen in sample.mcap")
    expect(details.get_by_test_id("set-3110:01")).to_contain_text("50.0 °C")
    expect(details.get_by_test_id("set-3110:01")).to_contain_text("read 20")
