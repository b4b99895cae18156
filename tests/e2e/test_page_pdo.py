"""PDOs are changed from the page as its user would: edit, review, apply, see it on the bus, put it back."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import can
import pytest
from playwright.sync_api import BrowserContext, Page, expect

from app.wire.nmt import NMT_COB_ID, NmtCommand, nmt_message
from tests.e2e.browser import SIZE
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
NODE = 11
LIVE_MS = 20_000


def pdo_page(context: BrowserContext, demo: str, search: str = "") -> Page:
    page = context.new_page()
    page.goto(f"{demo.split('?')[0]}axis?tab=pdo&blade=1&scene=off{search}")
    expect(page.get_by_test_id("pdo-bar")).to_be_visible()
    expect(page.get_by_test_id("pdo-unread")).to_have_count(0, timeout=LIVE_MS)
    return page


@contextmanager
def controller(page: Page) -> Iterator[can.BusABC]:
    """Another participant of the demo's bus, at the address that the page tells."""
    told = page.get_by_text(re.compile(r"socketcand:127\.0\.0\.1:\d+")).first.inner_text()
    match = re.search(r"127\.0\.0\.1:(\d+)", told)
    assert match is not None
    bus = can.Bus(interface="socketcand", host="127.0.0.1", port=int(match[1]), channel="can0")
    try:
        yield bus
    finally:
        bus.shutdown()


def command(page: Page, what: NmtCommand) -> None:
    with controller(page) as bus:
        bus.send(can.Message(arbitration_id=NMT_COB_ID, data=nmt_message(what, NODE), is_extended_id=False))


def entries(page: Page) -> list[str]:
    return [text.split("\n")[0] for text in page.locator("[data-testid^='mapped-']").all_inner_texts()]


def test_an_object_is_mapped_seen_on_the_bus_and_taken_out_again(context: BrowserContext, demo: str) -> None:
    page = pdo_page(context, demo, "&events=open&eventq=socketcand")
    row = page.get_by_test_id("pdo-tpdo2")
    expect(row).to_have_attribute("data-enabled", "false")
    command(page, NmtCommand.START)
    expect(page.get_by_test_id("pdo-not-operational")).to_have_count(0, timeout=LIVE_MS)

    page.get_by_test_id("edit-tpdo2").click()
    page.get_by_test_id("pdo-enabled").check()
    page.get_by_test_id("pdo-event").fill("100")
    page.get_by_label("Add an object TPDO2").fill("6061")
    page.get_by_role("option").first.click()
    assert entries(page) == ["6041", "6064", "6061"]
    page.get_by_label("Move mode of operation display up").press("Enter")
    assert entries(page) == ["6041", "6061", "6064"]
    expect(page.get_by_test_id("pdo-changes")).to_have_text("1 changed")
    expect(page.get_by_test_id("pdo-load")).to_have_text(re.compile(r"Bus load .*% → .*%"))

    page.get_by_test_id("axis-tab-move").click()
    expect(page.get_by_test_id("axis-angle")).to_be_visible()
    page.get_by_test_id("axis-tab-pdo").click()
    expect(page.get_by_test_id("pdo-changes")).to_have_text("1 changed")

    page.get_by_test_id("pdo-review").click()
    dialog = page.get_by_test_id("pdo-dialog")
    expect(dialog).to_contain_text("4000028Bh")
    page.get_by_test_id("pdo-apply").click()
    expect(page.get_by_test_id("pdo-done")).to_be_visible(timeout=LIVE_MS)
    page.get_by_test_id("pdo-close").click()
    expect(row).to_have_attribute("data-edited", "false")
    expect(row).to_have_attribute("data-enabled", "true")
    expect(page.get_by_test_id("rate-tpdo2")).to_have_attribute(
        "data-rate", re.compile(r"^([8-9]|\d{2,})$"), timeout=LIVE_MS
    )
    expect(row.get_by_test_id("pdo-value-6064")).to_have_attribute("data-stale", "false")
    expect(row.get_by_test_id("pdo-value-6064")).to_have_text(re.compile(r"^\d+\.\d\d °$"))

    page.reload()
    expect(row).to_have_attribute("data-enabled", "true")
    expect(page.get_by_test_id("pdo-undo-ready")).to_contain_text("TPDO2")
    page.get_by_test_id("pdo-undo").click()
    expect(page.get_by_test_id("pdo-done")).to_be_visible(timeout=LIVE_MS)
    page.get_by_test_id("pdo-close").click()
    expect(row).to_have_attribute("data-enabled", "false")
    expect(page.get_by_test_id("rate-tpdo2")).to_have_text("–")
    expect(page.get_by_test_id("pdo-undo")).to_have_count(0)
    command(page, NmtCommand.PRE_OPERATIONAL)
    page.close()


def test_what_cannot_be_is_refused_with_its_reason(context: BrowserContext, demo: str) -> None:
    page = pdo_page(context, demo, "&pdo=tpdo3")
    page.get_by_test_id("pdo-cob-id").fill("581")
    page.get_by_test_id("pdo-cob-id").press("Enter")
    expect(page.get_by_test_id("pdo-finding-restricted")).to_contain_text("581h is reserved")
    expect(page.get_by_test_id("pdo-review")).to_be_disabled()
    page.get_by_label("Add an object TPDO3").fill("6064")
    page.get_by_role("option").first.click()
    expect(page.get_by_test_id("pdo-finding-too_many_bits")).to_contain_text("80 bits")
    page.get_by_test_id("pdo-discard").click()
    expect(page.get_by_test_id("pdo-changes")).to_have_text("No change")

    page.get_by_test_id("edit-rpdo1").click()
    page.get_by_test_id("pdo-enabled").uncheck()
    expect(page.get_by_test_id("pdo-finding-stop_path")).to_contain_text("STOP and FEATHER would lose")
    expect(page.get_by_test_id("pdo-review")).to_be_disabled()
    page.get_by_test_id("pdo-discard").click()
    page.close()


def test_what_the_unit_refuses_is_put_back_and_told(context: BrowserContext, demo: str) -> None:
    page = pdo_page(context, demo, "&pdo=tpdo4")
    page.get_by_test_id("pdo-enabled").check()
    page.get_by_test_id("pdo-cob-id").fill("12345")
    page.get_by_test_id("pdo-cob-id").press("Enter")
    expect(page.get_by_test_id("pdo-finding-extended")).to_be_visible()
    page.get_by_test_id("pdo-review").click()
    page.get_by_test_id("pdo-apply").click()
    expect(page.get_by_test_id("pdo-failed")).to_contain_text("the unit refused a write", timeout=LIVE_MS)
    expect(page.get_by_test_id("pdo-failed")).to_contain_text("what stood before stands again")
    page.get_by_test_id("pdo-close").click()
    page.get_by_test_id("pdo-discard").click()
    expect(page.get_by_test_id("pdo-tpdo4")).to_have_attribute("data-enabled", "false")
    expect(page.get_by_test_id("pdo-undo")).to_have_count(0)
    page.close()


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_nothing_serious_is_found_by_axe_and_nothing_is_clipped(context: BrowserContext, demo: str, theme: str) -> None:
    page = pdo_page(context, demo, f"&pdo=tpdo2&theme={theme}&lang=de")
    page.set_viewport_size(SIZE)
    page.get_by_test_id("pdo-enabled").check()
    expect(page.get_by_test_id("pdo-load")).to_contain_text("→")
    page.add_script_tag(path=str(AXE))
    found = page.evaluate(
        "async () => (await axe.run()).violations.filter(v => ['serious', 'critical'].includes(v.impact))"
        ".map(v => v.id + ': ' + v.nodes.map(n => n.html.slice(0, 160)).join(' | '))"
    )
    assert found == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    page.get_by_test_id("pdo-discard").click()
    page.close()
