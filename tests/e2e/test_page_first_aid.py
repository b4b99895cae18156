"""The error memory of the axis room in a real browser: cause, reaction and first aid of faults that twins have."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import BrowserContext, Locator, Page, expect

from tests.e2e.test_page_motion import axis_page
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
WAIT_MS = 30_000


@pytest.fixture(autouse=True)
def healthy_again(context: BrowserContext, demo: str) -> Iterator[None]:
    yield
    assert context.request.delete(f"{home(demo)}api/instructor/faults").ok


def home(demo: str) -> str:
    return demo.split("?")[0]


def inject(context: BrowserContext, demo: str, kind: str, blade: int, **values: float) -> None:
    order = {"kind": kind, "blade": blade, "values": values}
    answer = context.request.post(f"{home(demo)}api/instructor/faults", data=order)
    assert answer.status == 201, answer.text()


def memory(page: Page, device: str) -> Locator:
    return page.get_by_test_id(f"history-{device}")


def serious(page: Page) -> list[str]:
    """What axe finds in the error memories."""
    page.add_script_tag(path=AXE)
    result: dict[str, Any] = page.evaluate(
        "() => axe.run(document.querySelectorAll('[data-testid^=history-]'), {resultTypes: ['violations']})"
    )
    assert result["passes"], "axe has looked at something"
    bad = [one for one in result["violations"] if one["impact"] in ("serious", "critical")]
    return [f"{one['id']}: {node['html'][:160]}" for one in bad for node in one["nodes"]]


def test_an_encoder_fault_tells_its_cause_what_605e_makes_of_it_and_first_aid(
    context: BrowserContext, demo: str
) -> None:
    page = axis_page(context, demo, 2)
    pmc = memory(page, "PMC")
    expect(pmc).to_contain_text(re.compile("has not been read yet|is empty"))
    expect(pmc.get_by_test_id("error-now-PMC")).to_have_count(0)
    inject(context, demo, "encoder_data", 2)

    now = pmc.get_by_test_id("error-now-PMC")
    head = now.get_by_role("button")
    expect(head).to_contain_text("7320h", timeout=WAIT_MS)
    expect(head).to_contain_text("Present now · Error")
    expect(head).to_have_attribute("aria-expanded", "true")
    expect(now.get_by_test_id("aid-cause")).to_contain_text("data channel of the motor encoder (X5)")
    expect(now.get_by_test_id("aid-steps").get_by_role("listitem")).to_have_count(4)

    pmc.get_by_role("button", name="Read now").click()
    row = pmc.get_by_test_id("error-1")
    toggle = row.get_by_role("button", name="7320h")
    expect(toggle).to_have_attribute("aria-expanded", "false")
    expect(row).to_contain_text("Motor encoder, data channel")
    # It stands open above: nothing is told twice.
    reaction = now.get_by_test_id("aid-reaction")
    expect(reaction).to_contain_text("605Eh, the fault reaction option code, decides what the axis does.")
    expect(reaction).to_contain_text("It now holds 2: Brake on the quick stop ramp")
    written = context.request.post(
        f"{home(demo)}api/live/devices/wtg-07/blade-2/pmc/write", data={"address": "605E", "raw": 1}
    )
    assert written.ok, written.text()
    expect(reaction).to_contain_text("It now holds 1: Brake on the deceleration ramp (6084h)")

    # Without the other encoder nothing is left (7300h): the newest of the memory, while 603Fh still shows the first.
    inject(context, demo, "blade_encoder_failed", 2)
    expect(newest_is(pmc, "7300h")).to_have_attribute("aria-expanded", "true")
    expect(head).to_contain_text("7320h")
    newest = pmc.get_by_test_id("error-1")
    expect(newest.get_by_test_id("aid-cause")).to_contain_text("no usable position from an encoder")
    expect(newest.get_by_test_id("aid-reaction")).to_contain_text("The manual gives no reaction of the drive")
    expect(newest.get_by_test_id("aid-steps").get_by_role("listitem").first).to_contain_text("compare 6064h and 6864h")
    for at, code in ((2, "7321h"), (3, "7320h")):
        older = pmc.get_by_test_id(f"error-{at}").get_by_role("button", name=code)
        expect(older).to_have_attribute("aria-expanded", "false")
    page.close()


def newest_is(pmc: Locator, code: str) -> Locator:
    """Read the memory until the newest entry is this one; its button."""
    button = pmc.get_by_test_id("error-1").get_by_role("button", name=code)
    for _ in range(20):
        pmc.get_by_role("button", name="Read now").click()
        try:
            expect(button).to_be_visible(timeout=1500)
        except AssertionError:
            continue
        return button
    raise AssertionError(f"{code} never came")


def test_a_warning_of_the_pmm_is_told_with_the_objects_of_both_units(context: BrowserContext, demo: str) -> None:
    inject(context, demo, "phase_loss", 3)
    page = axis_page(context, demo, 3, "&lang=de")
    now = memory(page, "PMM").get_by_test_id("error-now-PMM")
    expect(now.get_by_role("button")).to_contain_text("3130h", timeout=WAIT_MS)
    expect(now.get_by_test_id("aid-cause")).to_contain_text("das Handbuch nennt keine Schwelle")
    expect(now.get_by_test_id("aid-reaction")).to_contain_text("Die PMM bewegt die Achse nicht.")
    steps = now.get_by_test_id("aid-steps")
    expect(steps).to_contain_text("3000h und 3062h aller Blätter vergleichen")
    expect(steps).to_contain_text("gegen Wiedereinschalten sichern")
    steps.get_by_role("link", name="3062h").click()
    expect(page).to_have_url(re.compile(r"/parameters\?.*device=wtg-07/blade-3/pmm.*edit=3062"))
    expect(page.get_by_test_id("detail")).to_contain_text("3062")
    page.close()


def test_by_keyboard_alone_an_error_is_opened_and_closed(context: BrowserContext, demo: str) -> None:
    inject(context, demo, "encoder_data", 1)
    page = axis_page(context, demo, 1)
    pmc = memory(page, "PMC")
    head = pmc.get_by_test_id("error-now-PMC").get_by_role("button")
    expect(head).to_have_attribute("aria-expanded", "true", timeout=WAIT_MS)
    read = pmc.get_by_role("button", name="Read now")
    read.focus()
    page.keyboard.press("Enter")
    toggle = pmc.get_by_test_id("error-1").get_by_role("button")
    expect(toggle).to_have_attribute("aria-expanded", "false")
    page.keyboard.press("Tab")
    expect(head).to_be_focused()
    page.keyboard.press("Space")
    expect(head).to_have_attribute("aria-expanded", "false")
    expect(pmc.get_by_test_id("aid")).to_have_count(0)
    page.keyboard.press("Tab")
    expect(toggle).to_be_focused()
    assert page.evaluate("() => getComputedStyle(document.activeElement).outlineStyle") != "none"
    page.keyboard.press("Enter")
    expect(toggle).to_have_attribute("aria-expanded", "true")
    page.keyboard.press("Tab")
    expect(pmc.get_by_test_id("error-1").get_by_role("link").first).to_be_focused()
    box = pmc.get_by_test_id("error-1").get_by_role("row").first.bounding_box()
    assert box is not None
    assert box["height"] >= 40
    page.close()


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_serious_in_what_is_told(context: BrowserContext, demo: str, theme: str) -> None:
    inject(context, demo, "encoder_data", 1)
    inject(context, demo, "phase_loss", 1)
    page = axis_page(context, demo, 1, f"&theme={theme}")
    pmc = memory(page, "PMC")
    expect(pmc.get_by_test_id("error-now-PMC")).to_be_visible(timeout=WAIT_MS)
    expect(memory(page, "PMM").get_by_test_id("error-now-PMM")).to_be_visible(timeout=WAIT_MS)
    pmc.get_by_role("button", name="Read now").click()
    toggle = pmc.get_by_test_id("error-1").get_by_role("button")
    if toggle.get_attribute("aria-expanded") == "false":
        toggle.click()
    expect(pmc.get_by_test_id("error-1").get_by_test_id("aid-steps")).to_be_visible()
    assert serious(page) == []
    page.close()
