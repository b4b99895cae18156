"""Overview, axis and procedures in a real browser, and the frame around them: tablets, German, two pages at once."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.processes import running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
WAIT_MS = 30_000
expect.set_options(timeout=20_000)


@dataclass(frozen=True)
class Demo:
    """A running demo with a browser profile that is let in."""

    home: str
    context: BrowserContext

    def open(self, path: str) -> Page:
        """A tab, without the 3D view: software rendering would hold up everything else."""
        page = self.context.new_page()
        page.goto(f"{self.home}{path}{'&' if '?' in path else '?'}scene=off")
        return page


@pytest.fixture(scope="module")
def demo(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    with running("demo", "--port", "0", "--data", str(tmp_path_factory.mktemp("data")), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        context = browser.new_context(viewport={"width": 1366, "height": 768}, color_scheme="dark", locale="en-GB")
        context.set_default_timeout(WAIT_MS)
        first = context.new_page()
        first.goto(f"{url}&scene=off")
        expect(first.get_by_test_id("blade-1")).to_be_visible(timeout=WAIT_MS)
        first.close()
        yield Demo(url.split("?")[0], context)
        context.close()


def test_a_blade_shows_power_temperatures_and_its_feather_chain_with_raw_values(demo: Demo) -> None:
    page = demo.open("")
    card = page.get_by_test_id("blade-2")
    expect(card.get_by_test_id("reading-3080")).to_have_text(re.compile(r"^\d+ %$"), timeout=WAIT_MS)
    expect(card.get_by_test_id("reading-3060")).to_have_text(re.compile(r"^\d+ V$"))
    expect(card.get_by_test_id("reading-6410:09")).to_have_text(re.compile(r"^\d+\.\d °C$"))
    expect(card.get_by_test_id("reading-3010")).to_have_attribute("title", re.compile(r"3010.*raw \d+", re.DOTALL))
    expect(card.get_by_test_id("efc-chain")).to_have_attribute("data-state", "closed")
    expect(page.get_by_test_id("since-last-visit")).to_contain_text(re.compile("First visit|still being read|No param"))
    card.get_by_test_id("reading-3010").click()
    expect(page).to_have_url(re.compile(r"/parameters\?.*device=wtg-07/blade-2/pmm"))
    page.close()


def test_a_value_that_is_written_and_not_saved_needs_attention_on_every_page_that_is_open(demo: Demo) -> None:
    """Two pages at once; the write is made by a third program on the same bus of twins."""
    first, second = demo.open(""), demo.open("?lang=de")
    for page in (first, second):
        expect(page.get_by_test_id("blade-1").get_by_test_id("reading-3080")).to_be_visible(timeout=WAIT_MS)
    answer = first.evaluate(
        """async () => (await fetch('/api/live/devices/wtg-07/blade-1/pmc/write', {method: 'POST',
        headers: {'content-type': 'application/json'}, body: JSON.stringify({address: '6065', raw: 123})})).status"""
    )
    assert answer == 200
    expect(first.get_by_test_id("attention")).to_contain_text("Blade 1 PMC: 1 values stand in RAM only")
    expect(second.get_by_test_id("attention")).to_contain_text("Blatt 1 PMC: 1 Werte stehen nur im RAM")
    expect(first.get_by_test_id("attention")).to_contain_text("differ between the blades (6065)")
    first.close()
    second.close()


def test_the_axis_room_follows_the_blade_of_the_url_and_lights_its_state(demo: Demo) -> None:
    page = demo.open("axis?blade=3&span=120")
    expect(page.get_by_test_id("axis-angle")).to_have_text("80.00°", timeout=WAIT_MS)
    expect(page.get_by_test_id("state-diagram")).to_have_attribute("data-state", "ready_to_switch_on")
    expect(page.get_by_test_id("bits-6041").get_by_test_id("bit-ready_to_switch_on")).to_have_attribute(
        "data-state", "set"
    )
    expect(page.get_by_test_id("bits-60FD").get_by_test_id("bit-efc")).to_contain_text("X2.3")
    expect(page.get_by_test_id("history-PMC")).to_contain_text("empty")
    expect(page.get_by_test_id("plot-velocity").locator("canvas")).to_be_visible()
    page.get_by_test_id("pause").click()
    expect(page.get_by_test_id("pause")).to_have_text("Go on")
    page.get_by_test_id("choose-blade").get_by_text("Blade 1").click()
    expect(page).to_have_url(re.compile("blade=1"))
    page.close()


def test_procedures_tick_by_what_is_so(demo: Demo) -> None:
    page = demo.open("procedures")
    for step in ("bus_heard", "alone", "nodes_alive", "known_kind", "as_found"):
        expect(page.get_by_test_id(f"step-{step}")).to_have_attribute("data-tick", "done", timeout=WAIT_MS)
    page.get_by_test_id("procedure-back_up").click()
    expect(page.get_by_test_id("step-sets_fresh")).to_have_attribute("data-tick", "open")
    expect(page).to_have_url(re.compile("procedure=back_up"))
    page.close()


def test_stop_and_feather_are_whole_at_every_size_in_both_languages(demo: Demo) -> None:
    page = demo.open("?lang=de&events=open")
    for width, height in ((1366, 768), (1024, 768), (820, 1180)):
        page.set_viewport_size({"width": width, "height": height})
        for name in ("stop", "feather"):
            box = page.get_by_test_id(name).bounding_box()
            assert box is not None
            assert box["x"] >= 0 and box["x"] + box["width"] <= width, (width, name)
            assert box["height"] >= 40
    page.close()


def test_the_event_drawer_keeps_its_filter_in_the_url(demo: Demo) -> None:
    page = demo.open("?events=open&eventq=connected&drawer=tall")
    expect(page.get_by_test_id("event-filter")).to_have_value("connected")
    expect(page.get_by_text(re.compile("Connected to can0")).first).to_be_visible(timeout=WAIT_MS)
    page.get_by_test_id("event-severity").get_by_text("errors").click()
    expect(page).to_have_url(re.compile("severity=error"))
    expect(page.get_by_text(re.compile("Connected to can0"))).to_have_count(0)
    page.close()
