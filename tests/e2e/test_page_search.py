"""Searching the recordings in a real browser: as it is typed, found, and opened at the place."""

from __future__ import annotations

import re
import time

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.browser import WAIT_MS
from tests.e2e.test_page_replay import AXE, TRIP, Home, home, serving

__all__ = ["home", "serving"]

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
SEARCH = "recordings?tab=search"


@pytest.fixture
def page(home: Home) -> Page:
    """Of the recordings one has its index."""
    home.call("POST", "replay", {"recording": f"{TRIP}.mcap"})
    until = time.monotonic() + 120
    while home.call("GET", f"replay/{TRIP}")[1]["index"]["state"] != "ready":
        assert time.monotonic() < until
        time.sleep(0.2)
    return home.open(SEARCH)


def test_a_signature_is_searched_in_all_recordings_and_leads_to_the_moment(page: Page) -> None:
    page.get_by_label("Examples").click()
    page.get_by_role("menuitem", name="Following error grows").click()
    expect(page.get_by_label("What is looked for")).to_have_value("60F4 > 0.8 deg within 5 s before emcy 8611")
    page.get_by_test_id("search-start").click()
    progress = page.get_by_test_id("search-progress")
    expect(progress).to_have_attribute("data-state", "done", timeout=WAIT_MS)
    expect(progress).to_contain_text("11 of 11 recordings")
    row = page.get_by_role("row").filter(has_text="3-following-error.mcap")
    expect(row).to_contain_text("> 0.8 ° for at least 93 ms, up to")
    expect(row).to_contain_text("93 ms later: blade 2 PMC: following error too large (8611h)")
    skipped = page.get_by_test_id("search-skipped")
    expect(skipped).to_contain_text("10 recordings were not looked into")
    skipped.locator("summary").click()
    expect(skipped).to_contain_text("1-normal-operation.mcap")
    row.click()
    expect(page).to_have_url(re.compile(r"/recordings\?.*replay=3-following-error"))
    expect(page.get_by_test_id("replay-badge")).to_contain_text("REPLAY")
    clock = page.get_by_test_id("replay-clock")
    expect(clock).to_have_attribute("data-ns", re.compile(r"^17724420(2[4-9]|3[01])"), timeout=WAIT_MS)
    page.go_back()
    expect(page.get_by_test_id("search-start")).to_be_visible()


def test_what_is_not_understood_is_marked_where_it_is(page: Page) -> None:
    page.get_by_label("What is looked for").fill("60F4 > two within 5 s before trip")
    expect(page.get_by_text("a number is expected here")).to_be_visible()
    expect(page.locator("mark")).to_have_text("two within 5 s before trip")
    expect(page.get_by_test_id("search-start")).to_be_disabled()
    page.get_by_label("What is looked for").fill("trip")
    expect(page.get_by_test_id("search-start")).to_be_enabled()
    expect(page).to_have_url(re.compile(r"q=trip"))


def test_it_is_in_german_by_keyboard_and_without_complaints_of_axe(home: Home) -> None:
    page = home.open(f"{SEARCH}&lang=de&q=trip")
    field = page.get_by_label("Was in allen Aufzeichnungen gesucht wird")
    expect(field).to_have_value("trip")
    expect(page.get_by_test_id("search-start")).to_be_enabled()
    field.press("Enter")
    expect(page.get_by_test_id("search-progress")).to_have_attribute("data-state", "done", timeout=WAIT_MS)
    expect(page.get_by_test_id("search-progress")).to_contain_text("von 11 Aufzeichnungen")
    page.evaluate(AXE.read_text(encoding="utf-8"))
    complaints = page.evaluate("axe.run().then(r => r.violations.map(v => v.id + ': ' + v.nodes[0].html))")
    assert complaints == []
