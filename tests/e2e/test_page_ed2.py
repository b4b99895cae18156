"""Hydraulic cylinders on PROFIBUS are moved from the page: by the state machine of their description."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, expect

from app.twins.ed2.states import State
from app.wire.profibus.telegrams import CONTROL_WORD
from tests.e2e.browser import SIZE
from tests.e2e.processes import running
from tests.e2e.test_page_motion import press
from tests.service.motion.ed2_rig import ORDER, SITE, Cylinders, cylinders

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
MOVE_MS = 30_000


@pytest.fixture(scope="module")
def bench() -> Iterator[Cylinders]:
    with cylinders() as one:
        yield one


@pytest.fixture(scope="module")
def url(bench: Cylinders, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder: Path = tmp_path_factory.mktemp("bench")
    site = SITE.format(port=bench.wired.line.path, baud=bench.wired.baud, more=ORDER)
    (folder / "site.toml").write_text(site, encoding="utf-8")
    arguments = ("--site", str(folder / "site.toml"), "--port", "0", "--data", str(folder))
    with running("serve", *arguments, "--json") as process:
        yield json.loads(process.wait_for('"url"'))["url"]


@pytest.fixture(scope="module")
def at_bench(browser: Browser, url: str) -> Iterator[BrowserContext]:
    context = browser.new_context(viewport=SIZE, locale="en-GB")
    try:
        first = context.new_page()
        first.goto(url)
        expect(first.get_by_test_id("mode")).to_contain_text(re.compile("TWIN|LIVE"), timeout=MOVE_MS)
        yield context
    finally:
        context.close()


def test_cylinders_are_prepared_driven_by_hand_moved_and_stopped(
    at_bench: BrowserContext, url: str, bench: Cylinders
) -> None:
    """What comes of each step is asked of the twin itself."""
    page = at_bench.new_page()
    page.goto(f"{url.split('?')[0]}axis?scene=off")
    expect(page.get_by_test_id("axis-angle")).to_have_text(re.compile(r"250[.]000 mm"), timeout=MOVE_MS)
    diagram = page.get_by_test_id("state-diagram")
    expect(diagram).to_have_attribute("data-state", "init")
    expect(page.get_by_test_id("allowed-commands")).to_contain_text("0001h")
    for lacking in ("rotor-locked", "try-feather", "brake-test", "signal", "probe", "home", "jog-plus"):
        expect(page.get_by_test_id(lacking)).to_have_count(0)

    page.get_by_test_id("take-control").click()
    page.get_by_test_id("people-out").check()
    expect(page.get_by_test_id("interlock-self_stop")).to_contain_text("says that it is a twin")
    expect(page.get_by_test_id("interlock-pzd_order")).to_have_attribute("data-bites", "false")
    press(page, "prepare")
    expect(page.get_by_test_id("proof")).to_contain_text("Prepared", timeout=MOVE_MS)
    page.mouse.up()

    press(page, "hold")
    expect(diagram).to_have_attribute("data-state", "hold", timeout=MOVE_MS)
    assert bench.state is State.HOLD
    page.mouse.up()
    expect(diagram).to_have_attribute("data-state", "init", timeout=MOVE_MS)

    press(page, "manual-plus")
    expect(diagram).to_have_attribute("data-state", "device_mode_active", timeout=MOVE_MS)
    page.wait_for_function(
        "() => parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) > 253", timeout=MOVE_MS
    )
    page.mouse.up()
    expect(page.get_by_test_id("motion-ended")).to_contain_text("let go", timeout=MOVE_MS)
    assert bench.places_mm[0] > 253.0

    page.get_by_test_id("place").fill("240")
    press(page, "move-to")
    expect(page.get_by_test_id("motion-ended")).to_contain_text("Move: done", timeout=MOVE_MS)
    page.mouse.up()
    assert bench.places_mm == pytest.approx((240.0, 240.0), abs=1.0)

    press(page, "manual-plus")
    page.wait_for_function(
        "() => parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) > 242", timeout=MOVE_MS
    )
    page.keyboard.press("Escape")
    expect(diagram).to_have_attribute("data-state", "init", timeout=MOVE_MS)
    page.mouse.up()
    assert bench.wired.received[CONTROL_WORD] == 0
