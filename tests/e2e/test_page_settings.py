"""The settings in a real browser: an adapter is tested, a turbine found and made, polling changed, the log verified."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect, sync_playwright

from tests.e2e.browser import CHROMIUM, FLAGS
from tests.e2e.processes import running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(180)]

SIZE: ViewportSize = {"width": 1366, "height": 768}
WAIT_MS = 30_000
expect.set_options(timeout=15_000)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def page(data: Path) -> Iterator[Page]:
    """One tab on a demo of its own, in order; the 3D view stays closed."""
    with running("demo", "--port", "0", "--data", str(data), "--json") as process, sync_playwright() as playwright:
        url = json.loads(process.wait_for('"url"'))["url"]
        chromium: Browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        context = chromium.new_context(viewport=SIZE, color_scheme="dark", locale="en-GB", base_url=url.split("?")[0])
        context.set_default_timeout(WAIT_MS)
        tab = context.new_page()
        errors: list[str] = []
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.goto(url)
        yield tab
        context.close()
        chromium.close()
        assert errors == []


def show(page: Page, section: str) -> None:
    page.goto(f"/settings?section={section}&scene=off")
    expect(page.get_by_test_id(f"settings-{section}")).to_be_visible(timeout=WAIT_MS)


def twins(data: Path) -> str:
    """Where the demo's twins answer."""
    site = tomllib.loads((data / "demo-site.toml").read_text(encoding="utf-8"))
    return str(site["turbine"]["wtg-07"]["bus"]["can0"]["connection"])


def test_the_adapter_in_use_is_tested_without_being_opened_again(page: Page, data: Path) -> None:
    show(page, "buses")
    row = page.get_by_test_id(f"adapter-{twins(data)}")
    expect(row).to_contain_text("connected")
    page.get_by_test_id(f"check-{twins(data)}").click()
    page.get_by_test_id("start-test").click()
    heard = page.get_by_test_id("heard")
    expect(heard).to_have_attribute("data-verdict", "listening")
    expect(heard).to_have_attribute("data-verdict", "fits")
    expect(page.get_by_test_id("heard-nodes")).to_have_text("1, 2, 3, 11, 12, 13")
    expect(heard).to_contain_text("open connection")


def test_a_search_for_the_bit_rate_is_refused_with_the_reason(page: Page, data: Path) -> None:
    page.get_by_test_id("start-search").click()
    expect(page.get_by_test_id("problem")).to_contain_text("in use by the connection")
    page.get_by_test_id("other-adapter").fill("ixxat:0")
    page.get_by_test_id("add-adapter").click()
    expect(page.get_by_test_id("start-test")).to_be_disabled()
    page.get_by_test_id("start-search").click()
    expect(page.get_by_test_id("problem")).to_contain_text("no silent mode")


def test_nodes_are_found_and_taken_over_into_a_new_turbine(page: Page, data: Path) -> None:
    show(page, "turbines")
    page.get_by_test_id("add-turbine").click()
    page.get_by_test_id("turbine-name").fill("WTG-08")
    page.get_by_test_id("turbine-slug").fill("WTG 08")
    expect(page.get_by_text("Small letters, digits and single hyphens only.")).to_be_visible()
    expect(page.get_by_test_id("save-turbine")).to_be_disabled()
    page.get_by_test_id("turbine-slug").fill("wtg-08")
    page.get_by_test_id("bus-connection").fill(twins(data))
    page.keyboard.press("Escape")
    page.get_by_test_id("scan-can0").click()
    page.get_by_test_id("start-scan").click()
    expect(page.get_by_test_id("found-13")).to_contain_text("HUBSIDE TWIN", timeout=WAIT_MS)
    page.get_by_test_id("found-3").get_by_role("checkbox").uncheck()
    page.get_by_test_id("take-over").click()
    expect(page.get_by_test_id("station-blade-3").get_by_test_id("device-pmc")).to_be_visible()

    # Node 2 twice on one bus is said at the field, before anything is sent.
    node = page.get_by_test_id("station-blade-1").get_by_test_id("device-pmm").get_by_test_id("device-node")
    node.fill("2")
    expect(page.get_by_text("Node 2 is", exact=False).first).to_be_visible()
    node.fill("1")
    page.get_by_test_id("save-turbine").click()
    expect(page.get_by_test_id("turbine-wtg-08")).to_be_visible()

    written = (data / "demo-site.toml").read_text(encoding="utf-8")
    assert "# This is the turbine of the demo" in written, "comments stay"
    stations = tomllib.loads(written)["turbine"]["wtg-08"]["station"]
    assert {name: sorted(one["device"]) for name, one in stations.items()} == {
        "blade-1": ["pmc", "pmm"],
        "blade-2": ["pmc", "pmm"],
        "blade-3": ["pmc"],
    }
    assert (data / "demo-site.previous.toml").exists()


def test_slugs_stay_and_the_connected_turbine_cannot_be_taken_out(page: Page) -> None:
    show(page, "turbines")
    page.get_by_test_id("turbine-wtg-07").click()
    expect(page.get_by_test_id("turbine-slug")).to_have_attribute("readonly", "")
    expect(page.get_by_test_id("remove-turbine")).to_be_disabled()


def test_another_turbine_is_connected_and_the_first_one_again(page: Page) -> None:
    for slug, name in (("wtg-08", "WTG-08"), ("wtg-07", "WTG-07")):
        page.get_by_test_id("connect-menu").click()
        page.get_by_test_id(f"connect-{slug}").click()
        expect(page.get_by_test_id("turbine")).to_have_text(name, timeout=WAIT_MS)
        expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)


def test_a_change_of_polling_is_in_force_at_once(page: Page) -> None:
    show(page, "polling")
    load = page.get_by_test_id("load-wtg-07")
    before = load.inner_text()
    page.get_by_test_id("polling-period_s").fill("20")
    expect(page.get_by_text("50 to 10000 ms")).to_be_visible()
    expect(page.get_by_test_id("save-polling")).to_be_disabled()
    page.get_by_test_id("polling-period_s").fill("1000")
    expect(load).not_to_have_text(before)
    page.get_by_test_id("save-polling").click()
    expect(page.get_by_text("The polling list is in force")).to_be_visible()
    # Ten times as slow: the bus carries heartbeats and little else.
    show(page, "buses")
    page.locator("[data-testid^=check-socketcand]").click()
    page.get_by_test_id("start-test").click()
    expect(page.get_by_test_id("heard")).to_have_attribute("data-verdict", "fits")
    assert float(page.get_by_test_id("heard-frames").inner_text().replace(",", "")) < 150


def test_the_head_of_the_log_moves_on_and_the_chain_is_intact(page: Page) -> None:
    show(page, "audit")
    head = page.get_by_test_id("audit-head")
    expect(head).to_have_text(re.compile(r"^[0-9a-f]{64}$"))
    before = head.inner_text()
    rows = page.get_by_test_id("audit-rows")
    expect(rows).to_contain_text("period_s 0.1 → 1")
    show(page, "polling")
    page.get_by_test_id("polling-period_s").fill("100")
    page.get_by_test_id("save-polling").click()
    expect(page.get_by_text("The polling list is in force")).to_be_visible()
    show(page, "audit")
    expect(head).to_have_text(re.compile(r"^[0-9a-f]{64}$"))
    expect(head).not_to_have_text(before)
    page.get_by_test_id("verify").click()
    expect(page.get_by_test_id("audit-verdict")).to_have_attribute("data-good", "true")
    page.get_by_test_id("audit-text").fill("wtg-08")
    expect(rows).not_to_contain_text("period_s")
    expect(rows).to_contain_text("wtg-08")
    expect(page).to_have_url(re.compile(r"q=wtg-08"))
    with page.expect_download() as download:
        page.get_by_test_id("audit-export").click()
    exported = Path(download.value.path()).read_text(encoding="utf-8-sig").splitlines()
    assert exported[0] == "seq,time,person,device,address,kind,text,hash"
    assert len(exported) > 1 and all("wtg-08" in line.lower() for line in exported[1:])


def test_a_visit_is_ended_with_reason_and_order(page: Page) -> None:
    show(page, "about")
    expect(page.get_by_test_id("settings-about")).to_contain_text("tomlkit")
    page.get_by_test_id("connect-menu").click()
    page.get_by_test_id("visit").click()
    page.get_by_test_id("visit-reason").fill("battery of blade 2 replaced")
    page.get_by_test_id("visit-order").fill("WO-20417")
    page.get_by_test_id("end-visit").click()
    expect(page.get_by_test_id("turbine")).to_have_text("No turbine", timeout=WAIT_MS)
    expect(page.get_by_test_id("mode")).to_contain_text("NOT CONNECTED")
