"""Battery and gear are set up from the page as their users would; canopen's client reads back what was written."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.browser import SIZE, signed_in
from tests.e2e.conftest import site_for
from tests.e2e.processes import running
from tests.e2e.test_browser import hold
from tests.e2e.test_interoperation import EDS
from tests.e2e.test_page_motion import MOVE_MS, give_back, prepare, press, take_control
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
TEST_MS = 40_000
EXAMPLE = {0x608F: (1024, 1), 0x6091: (20313, 12), 0x6092: (36000, 1)}
"""The manual's pitch system (5.5): increments, gear 183 x 111/12, hundredths of a degree."""


def picture(context: BrowserContext, base: str, name: str, blade: int, search: str = "") -> Page:
    page = context.new_page()
    page.goto(f"{base.split('?')[0]}axis?tab=setup&picture={name}&blade={blade}&scene=off{search}")
    expect(page.get_by_test_id(f"{name}-picture")).to_be_visible()
    return page


def test_a_battery_is_tested_to_its_verdict(context: BrowserContext, demo: str) -> None:
    page = picture(context, demo, "battery", 1)
    for number in range(1, 7):
        expect(page.get_by_test_id(f"bloc-{number}")).to_contain_text(re.compile(r"\d\d\.\d\d V"))
    expect(page.get_by_test_id("bloc-7")).to_have_count(0)
    for need in ("answers", "charged", "mains", "stands", "nobody_moves", "no_restore"):
        expect(page.get_by_test_id(f"need-{need}")).to_have_attribute("data-bites", "false")
    page.get_by_test_id("begin-test").click()
    expect(page.get_by_test_id("test-running")).to_have_count(0)
    hold(page, "begin-test")
    expect(page.get_by_test_id("test-running")).to_contain_text("Begun by")
    expect(page.get_by_test_id("course")).to_be_visible()
    page.reload()
    expect(page.get_by_test_id("test-running")).to_contain_text("Begun by")
    expect(page.get_by_test_id("verdict")).to_have_attribute("data-verdict", "passed", timeout=TEST_MS)
    expect(page.get_by_test_id("verdict")).to_contain_text(re.compile(r"Passed.*lowest 2\d\d V.*weakest: bloc \d"))
    expect(page.get_by_test_id("earlier-tests").locator("tbody tr")).to_have_count(1)
    page.reload()
    expect(page.get_by_test_id("verdict")).to_have_attribute("data-verdict", "passed")
    page.close()


def test_a_battery_is_changed_step_by_step_over_a_reload(context: BrowserContext, demo: str) -> None:
    page = picture(context, demo, "battery", 2)
    expect(page.get_by_test_id("change-done")).to_be_disabled()
    expect(page.get_by_test_id("note-old")).to_be_disabled()
    page.get_by_test_id("old-serials").fill("   ")
    expect(page.get_by_test_id("note-old")).to_be_disabled()
    page.get_by_test_id("old-serials").fill("4711-1 to 6")
    page.get_by_test_id("note-old").click()
    expect(page.get_by_test_id("noted")).to_contain_text("4711-1 to 6")
    expect(page.get_by_test_id("noted")).to_contain_text("mAh")
    page.reload()
    expect(page.get_by_test_id("noted")).to_contain_text("4711-1 to 6")
    page.get_by_test_id("new-serials").fill("4812-1 to 6")
    page.get_by_test_id("change-remark").fill("leads renewed")
    hold(page, "change-done")
    expect(page.get_by_test_id("changed")).to_contain_text("saved", timeout=MOVE_MS)
    row = page.get_by_test_id("earlier-changes").locator("tbody tr")
    expect(row).to_have_count(1)
    for text in ("4711-1 to 6", "4812-1 to 6", "leads renewed"):
        expect(row).to_contain_text(text)
    expect(page.get_by_test_id("note-old")).to_be_visible()
    page.close()


def test_a_setting_of_the_battery_is_staged_and_what_is_wrong_is_not(context: BrowserContext, demo: str) -> None:
    page = picture(context, demo, "battery", 3)
    field = page.get_by_test_id("field-30E3")
    field.fill("30")
    expect(page.get_by_test_id("setting-30E3")).to_contain_text("Too small")
    expect(page.get_by_test_id("pending-count")).to_have_count(0)
    field.fill("120")
    expect(page.get_by_test_id("pending-count")).to_contain_text("1")
    page.reload()
    expect(page.get_by_test_id("field-30E3")).to_have_value("120")
    page.get_by_test_id("discard").click()
    expect(page.get_by_test_id("field-30E3")).to_have_value("")
    page.close()


@pytest.fixture
def empty(browser: Browser, tmp_path: Path) -> Iterator[tuple[BrowserContext, str, int]]:
    """A bench at twins whose first axis holds what its description gives as defaults."""
    with running("twin", "oat", "--can", "socketcand:127.0.0.1:0", "--json") as twins:
        address = json.loads(twins.wait_for('"address"'))["address"]
        port = int(address.rsplit(":", 1)[1])
        network = canopen.Network()
        network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
        pmc = network.add_node(11, str(EDS / "oat_pmc.eds"))
        pmc.sdo.RESPONSE_TIMEOUT = 5.0
        pmc.nmt.wait_for_heartbeat(timeout=10)
        for index, pair in {0x608F: (512, 1), 0x6091: (1, 1)}.items():
            for sub, value in enumerate(pair, 1):
                pmc.sdo[index][sub].raw = value
        pmc.sdo[0x607F].raw = 20000
        network.disconnect()
        site = site_for(address, tmp_path)
        data = str(tmp_path / "data")
        with running("--data", data, "serve", "--site", str(site), "--port", "0", "--json") as served:
            url = json.loads(served.wait_for('"url"'))["url"]
            with signed_in(browser, url) as context:
                yield context, url, port


def witnessed(pmc: Any, index: int, sub: int) -> int:
    """What another client reads."""
    return int.from_bytes(pmc.sdo.upload(index, sub), "little")


def test_the_manuals_example_is_typed_staged_and_written(empty: tuple[BrowserContext, str, int]) -> None:
    context, url, port = empty
    page = picture(context, url, "gear", 1)
    expect(page.get_by_test_id("increments-motor")).to_have_value("512")
    page.get_by_test_id("increments-motor").fill("1024")
    page.get_by_test_id("driving-motor-1").fill("1")
    page.get_by_test_id("driven-motor-1").fill("183")
    page.get_by_test_id("add-motor").click()
    page.get_by_test_id("driving-motor-2").fill("")
    expect(page.get_by_test_id("fault-motor-gear")).to_contain_text("above 0")
    expect(page.get_by_test_id("stage-train-motor")).to_be_disabled()
    page.get_by_test_id("driving-motor-2").fill("12")
    page.get_by_test_id("driven-motor-2").fill("40009")
    expect(page.get_by_test_id("fault-motor-gear")).to_contain_text("cannot hold")
    page.get_by_test_id("driven-motor-2").fill("111")
    expect(page.get_by_test_id("gear-motor")).to_have_text("20313 / 12")
    expect(page.get_by_test_id("resolution-motor")).to_have_text("1024 / 1")
    expect(page.get_by_test_id("feed-motor").and_(page.locator("dd"))).to_have_text("36000 / 1")
    expect(page.get_by_test_id("per_turn-motor")).to_have_text("1733376")
    expect(page.get_by_test_id("per_unit-motor")).to_have_text("48.14933")
    expect(page.get_by_test_id("velocity")).to_have_attribute("data-fits", "false")
    page.get_by_test_id("stage-velocity").click()
    expect(page.get_by_test_id("velocity")).to_have_attribute("data-fits", "true")
    page.wait_for_url("**gear=1024/1**")
    page.reload()
    expect(page.get_by_test_id("driven-motor-2")).to_have_value("111")
    page.get_by_test_id("stage-train-motor").click()
    expect(page.get_by_test_id("stage-train-motor")).to_be_disabled()
    expect(page.get_by_test_id("pending-count")).to_contain_text("4")
    page.get_by_test_id("review").click()
    hold(page, "write-hold")
    expect(page.get_by_test_id("pending-count")).to_have_count(0, timeout=MOVE_MS)
    # There is one SDO channel to a node: the bench ends its connection first.
    assert context.request.post(f"{url.split('?')[0]}api/live/disconnect", data={}).ok
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
    try:
        pmc = network.add_node(11, str(EDS / "oat_pmc.eds"))
        pmc.sdo.RESPONSE_TIMEOUT = 5.0
        found = {index: (witnessed(pmc, index, 1), witnessed(pmc, index, 2)) for index in EXAMPLE}
        velocity = witnessed(pmc, 0x607F, 0)
    finally:
        network.disconnect()
    assert found == EXAMPLE
    assert velocity == 1063
    page.close()


def move_whole(page: Page, tries: int = 5) -> None:
    """Hold until the blade stands. A page that the machine starves is stopped, as it must be, and pressed again."""
    for _ in range(tries):
        press(page, "check-run")
        expect(page.get_by_test_id("check-ended")).to_contain_text("Move:", timeout=MOVE_MS)
        page.mouse.up()
        if page.get_by_test_id("check-ended").inner_text() == "Move: done":
            return
    raise AssertionError(page.get_by_test_id("check-ended").inner_text())


def test_a_slow_move_tells_the_ratio_that_would_be_right(context: BrowserContext, demo: str) -> None:
    page = picture(context, demo, "gear", 3)
    take_control(page)
    prepare(page)
    expect(page.get_by_test_id("scale")).to_be_disabled()
    move_whole(page)
    expect(page.get_by_test_id("verdict-encoders")).to_have_attribute("data-verdict", "agrees")
    page.get_by_test_id("scale").fill("ten")
    expect(page.get_by_test_id("verdict-motor")).to_have_count(0)
    page.get_by_test_id("scale").fill("10.0")
    for name in ("motor", "blade"):
        expect(page.get_by_test_id(f"verdict-{name}")).to_have_attribute("data-verdict", "agrees")
    page.get_by_test_id("scale").fill("9.1")
    expect(page.get_by_test_id("verdict-motor")).to_have_attribute("data-verdict", "off")
    expect(page.get_by_test_id("verdict-motor")).to_contain_text(
        re.compile(r"would have to be 18\d\d\.\d+, not 20313/12")
    )
    page.get_by_test_id("scale").fill("-10")
    expect(page.get_by_test_id("verdict-motor")).to_have_attribute("data-verdict", "reversed")
    expect(page.get_by_test_id("pending-count")).to_have_count(0)
    give_back(page)
    page.close()


@pytest.mark.parametrize("name", ["battery", "gear"])
@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("language", ["en", "de"])
def test_axe_finds_nothing_serious_and_nothing_is_cut(
    context: BrowserContext, demo: str, name: str, theme: str, language: str
) -> None:
    page = picture(context, demo, name, 1, f"&theme={theme}&lang={language}")
    page.set_viewport_size(SIZE)
    if name == "battery":
        expect(page.get_by_test_id("need-answers")).to_be_visible()
    else:
        expect(page.get_by_test_id("facts-motor")).to_be_visible()
    page.add_script_tag(path=AXE)
    result = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
    assert result["passes"], "axe has looked at something"
    found = [
        f"{one['impact']} {one['id']}: {node['html'][:160]}"
        for one in result["violations"]
        if one["impact"] in ("serious", "critical")
        for node in one["nodes"]
    ]
    assert found == []
    assert page.evaluate("() => document.documentElement.scrollWidth") <= SIZE["width"]
    page.close()
