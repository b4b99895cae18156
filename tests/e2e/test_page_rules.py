"""The rules in a real browser: what a typed value breaks is seen before anything is written, on both devices."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.browser import WAIT_MS, signed_in

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

LADDER = "oat.dc_link_ladder"
PMC = "wtg-07/blade-2/pmc"


@pytest.fixture(scope="module")
def context(browser: Browser, demo: str) -> Iterator[BrowserContext]:
    with signed_in(browser, demo, color_scheme="dark") as context:
        yield context


def test_a_value_that_breaks_the_ladder_is_told_before_it_is_written_and_leads_to_its_partner(
    page: Page, demo: str
) -> None:
    writes: list[str] = []
    # The plan of the writes is asked for while they are reviewed; it sends nothing.
    writing = re.compile(r"/writes?$")
    page.on("request", lambda sent: writes.append(sent.url) if writing.search(sent.url) else None)
    base = f"{demo.split('?')[0]}parameters?scene=off"
    page.goto(f"{base}&device={PMC}&edit=6510:04&q=6510:04")
    field = page.get_by_test_id("new-value")
    expect(field).to_have_value("100", timeout=WAIT_MS)
    panel = page.get_by_test_id("detail")
    button = page.get_by_test_id("stage")
    place = button.bounding_box()
    field.fill("410")
    finding = panel.get_by_test_id(f"rule-{LADDER}")
    expect(finding).to_contain_text("6510:04 = 410 V must lie below 30FA:03 = 400 V")
    expect(finding).to_contain_text("Order of the DC link voltages")
    assert button.bounding_box() == place, "what the rules say moves the button"
    field.fill("no number")
    expect(finding).to_have_count(0)
    assert button.bounding_box() == place, "an error moves the button"
    field.fill("120")
    expect(finding).to_have_count(0)
    field.fill("410")
    page.get_by_test_id("stage").click()
    expect(page.get_by_test_id("rule-mark-6510:04")).to_be_visible()
    panel.get_by_test_id("rule-jump-30FA:03").first.click()
    expect(page.get_by_test_id("new-value")).to_have_value("400")
    assert "blade-2/pmm" in page.url
    expect(page.get_by_test_id("detail").get_by_test_id(f"rule-{LADDER}")).to_be_visible()
    page.get_by_test_id("new-value").fill("411")
    expect(page.get_by_test_id("detail").get_by_test_id(f"rule-{LADDER}")).to_have_count(0)

    page.get_by_test_id("review").click()
    review = page.get_by_test_id("review-rules")
    expect(review.get_by_test_id(f"rule-{LADDER}")).to_be_visible()
    expect(review.get_by_test_id("rule-oat.pmc_minimum_below_battery")).to_contain_text("216")
    page.get_by_test_id("drop-all").click()
    assert writes == []


def test_the_list_of_all_stations_is_reached_and_leads_to_an_object(page: Page, demo: str) -> None:
    page.goto(f"{demo.split('?')[0]}parameters?scene=off&device={PMC}")
    expect(page.get_by_test_id("rules-warning")).to_contain_text("6", timeout=WAIT_MS)
    page.get_by_test_id("rules-open").click()
    for number in (1, 2, 3):
        station = page.get_by_test_id(f"rules-wtg-07/blade-{number}")
        expect(station.get_by_test_id("rule-oat.connection_loss")).to_contain_text("the axis goes on")
    page.get_by_test_id("rules-wtg-07/blade-3").get_by_test_id("rule-jump-30E3").click()
    expect(page.get_by_test_id("rules-dialog")).to_have_count(0)
    expect(page.get_by_test_id("new-value")).to_have_value("0")
    assert "device=wtg-07/blade-3/pmm" in page.url and "findings" not in page.url
