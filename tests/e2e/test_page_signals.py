"""A test signal, a step with its proposal, and the touch probe, as their user would run them from the page."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import BrowserContext, Page, expect

from tests.e2e.browser import SIZE
from tests.e2e.test_page_motion import MOVE_MS, axis_page, give_back, prepare, press, stands_still, take_control
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]


def move_away(page: Page, angle_deg: str) -> None:
    """Away from the 90 degree switch, which ends a motion."""
    page.get_by_test_id("angle").fill(angle_deg)
    page.get_by_test_id("speed").fill("5")
    expect(page.get_by_test_id("move-to")).to_have_attribute("aria-disabled", "false", timeout=MOVE_MS)
    page.get_by_test_id("move-to").focus()
    page.keyboard.down("Enter")
    expect(page.get_by_test_id("motion-ended")).to_contain_text("Move: done", timeout=MOVE_MS)
    page.keyboard.up("Enter")


def ready(page: Page) -> None:
    take_control(page)
    prepare(page)
    move_away(page, "75")


def run_held(page: Page, button: str) -> None:
    """Hold until it has ended by itself."""
    press(page, button)
    expect(page.get_by_test_id(button)).to_have_attribute("data-active", "true", timeout=MOVE_MS)
    expect(page.get_by_test_id(button)).to_have_attribute("data-active", "false", timeout=MOVE_MS)
    page.mouse.up()


def problems(page: Page) -> list[str]:
    found: list[str] = page.get_by_test_id("problem").all_inner_texts()
    return found


def test_a_sine_is_held_let_go_and_shown(context: BrowserContext, demo: str) -> None:
    page = axis_page(context, demo, 1)
    expect(page.get_by_test_id("signal-run")).to_have_attribute("aria-disabled", "true")
    ready(page)
    page.get_by_test_id("signal-frequency_hz").fill("0.5")
    page.get_by_test_id("signal-amplitude_deg").fill("-1")
    before = stands_still(page)
    press(page, "signal-run")
    page.wait_for_function(
        "from => Math.abs(parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) - from) > 0.5",
        arg=before,
    )
    page.mouse.up()
    expect(page.get_by_test_id("signal-response")).to_be_visible(timeout=MOVE_MS)
    expect(page.get_by_test_id("signal-results")).to_contain_text("let go")
    assert abs(stands_still(page) - before) < 1.2

    page.get_by_test_id("signal-cycles").fill("2")
    run_held(page, "signal-run")
    assert problems(page) == []
    results = page.get_by_test_id("signal-results")
    expect(results).to_contain_text("done", timeout=MOVE_MS)
    ratio = re.search(r"Amplitude ratio\s*([\d.]+)", results.inner_text())
    assert ratio is not None
    assert 0.9 < float(ratio[1]) < 1.1
    expect(page.get_by_test_id("signal-plot-angle").locator("canvas")).to_be_visible()
    page.get_by_test_id("lay-over").last.click()
    expect(page.get_by_test_id("signal-response")).to_contain_text("earlier run")
    assert "over=" in page.url, "what is laid over can be shared"
    give_back(page)
    page.close()


def test_a_step_proposes_a_gain_that_is_staged(context: BrowserContext, demo: str) -> None:
    page = axis_page(context, demo, 2)
    ready(page)
    stands_still(page)
    page.get_by_test_id("axis-tab-setup").click()
    pick = page.get_by_test_id("choose-picture")
    pick.get_by_text("Position controller").click()
    expect(page.get_by_test_id("structure")).to_contain_text("17 1/s")
    run_held(page, "controller-run")
    assert problems(page) == []
    expect(page.get_by_test_id("controller-response").locator("canvas")).to_be_visible(timeout=MOVE_MS)
    expect(page.get_by_test_id("signal-results")).to_contain_text("Overshoot")
    proposal = page.get_by_test_id("proposal")
    expect(proposal).to_contain_text("1 / (4 × lag)")
    staged = page.get_by_test_id("stage-proposal")
    if staged.count() == 0:  # the lag was measured such that the gain is well as it is
        expect(proposal).to_contain_text("leave it as it is")
    else:
        staged.first.click()
        expect(proposal).to_contain_text("Added")
        expect(page.get_by_test_id("pending-count")).to_contain_text("1")
    page.get_by_test_id("axis-tab-move").click()
    give_back(page)
    page.close()


def test_the_probe_marks_the_first_capture_after_arming(context: BrowserContext, demo: str) -> None:
    page = axis_page(context, demo, 3)
    page.get_by_test_id("probe-open").click()
    expect(page.get_by_test_id("probe-armed")).to_contain_text("Not armed")
    page.get_by_test_id("probe-arm").click()
    expect(page.get_by_test_id("probe-armed")).to_contain_text("Armed at")
    answer = page.evaluate(
        """async () => (await fetch("/api/instructor/faults", {
            method: "POST", headers: {"Content-Type": "application/json"},
            body: JSON.stringify({kind: "touch_probe", blade: 3, seconds: 0.4}),
        })).status"""
    )
    assert answer < 300
    expect(page.get_by_test_id("probe-rising")).to_have_attribute("data-first", "true", timeout=10_000)
    expect(page.get_by_test_id("probe-falling")).to_have_attribute("data-new", "true", timeout=10_000)
    expect(page.get_by_test_id("probe-apart")).to_have_text(re.compile(r"0\.0\d°"))
    page.close()


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("search", ["", "&tab=setup&picture=controller"])
@pytest.mark.parametrize("language", ["en", "de"])
def test_axe_finds_nothing_serious_and_nothing_is_cut(
    context: BrowserContext, demo: str, theme: str, search: str, language: str
) -> None:
    page = context.new_page()
    page.goto(f"{demo.split('?')[0]}axis?blade=1&scene=off&theme={theme}&lang={language}{search}")
    page.set_viewport_size(SIZE)
    expect(page.get_by_test_id("controller" if search else "signal")).to_be_visible()
    if not search:
        page.get_by_test_id("probe-open").click()
        expect(page.get_by_test_id("probe-arm")).to_be_visible()
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
