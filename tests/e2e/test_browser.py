"""The page in a real browser: the demo's own processes, headless Chromium, a person's path from token to proof."""

from __future__ import annotations

import io
import json
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.browser import SIZE, WAIT_MS
from tests.e2e.processes import Process, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or "/usr/bin/chromium"
FLAGS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
expect.set_options(timeout=15_000)


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Process, Path]]:
    """``hubside demo`` on a free port: the address that it prints."""
    data = tmp_path_factory.mktemp("data")
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        yield url, process, data


@pytest.fixture(scope="module")
def context(browser: Browser, demo: tuple[str, Process, Path]) -> Iterator[BrowserContext]:
    """A browser profile that has opened the printed address once."""
    context = browser.new_context(viewport=SIZE, color_scheme="dark", locale="en-GB")
    context.set_default_timeout(WAIT_MS)
    first = context.new_page()
    first.goto(demo[0])
    expect(first.get_by_test_id("blade-1")).to_be_visible(timeout=WAIT_MS)
    first.close()
    yield context
    context.close()


@pytest.fixture
def page(context: BrowserContext, demo: tuple[str, Process, Path]) -> Iterator[Page]:
    """A tab at the page's address, without the token."""
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(demo[0].split("?")[0])
    yield page
    page.close()
    assert errors == []


def test_the_token_works_once_and_without_it_the_page_is_closed(
    browser: Browser, context: BrowserContext, demo: tuple[str, Process, Path]
) -> None:
    assert context.cookies()[0]["httpOnly"]
    stranger = browser.new_context()
    try:
        tab = stranger.new_page()
        for address in (demo[0], demo[0].split("?")[0], demo[0].split("?")[0] + "api/live/turbine"):
            answer = tab.goto(address)
            assert answer is not None and answer.status == 401, address
    finally:
        stranger.close()


def test_three_blades_are_seen_live(page: Page) -> None:
    for blade in (1, 2, 3):
        card = page.get_by_test_id(f"blade-{blade}")
        expect(card).to_contain_text("80.00°", timeout=WAIT_MS)
        expect(card).to_contain_text(re.compile(r"\d+ %"), timeout=WAIT_MS)
    expect(page.get_by_test_id("mode")).to_contain_text("TWIN")


def test_the_3d_view_shows_the_hub(page: Page) -> None:
    """A picture of the 3D frame that is not blank: many shades, and blades brighter than the ground."""
    frame = page.locator("iframe")
    expect(frame).to_be_visible(timeout=WAIT_MS)
    canvas = page.frame_locator("iframe").locator("canvas").first
    expect(canvas).to_be_visible(timeout=WAIT_MS)
    shades = 0
    for _ in range(60):
        picture = np.asarray(Image.open(io.BytesIO(canvas.screenshot())).convert("L"))
        shades = len(np.unique(picture))
        if shades > 60 and (picture > 120).mean() > 0.01:
            return
        page.wait_for_timeout(500)
    raise AssertionError(f"the 3D view stayed blank: {shades} shades")


def hold(page: Page, test_id: str) -> None:
    """Press a hold-to-confirm button until it acts."""
    button = page.get_by_test_id(test_id)
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.wait_for_timeout(2500)
    page.mouse.up()


def test_a_limit_is_changed_written_saved_and_proven_by_a_restart(page: Page, demo: tuple[str, Process, Path]) -> None:
    home = demo[0].split("?")[0]
    page.goto(f"{home}parameters?device=wtg-07/blade-1/pmm&q=3110:01&edit=3110:01&scene=off")
    value, stored = page.get_by_test_id("value-3110:01"), page.get_by_test_id("stored-3110:01")
    field = page.get_by_test_id("new-value")
    expect(field).to_have_value("50.0", timeout=WAIT_MS)

    field.fill("9999999")
    expect(page.get_by_test_id("stage")).to_be_disabled()
    expect(page.get_by_text("3276.7").first).to_be_visible()

    field.fill("49.0")
    expect(page.get_by_test_id("preview")).to_contain_text("49.0")
    page.get_by_test_id("stage").click()
    expect(value).to_contain_text("50.0 → 49.0")
    page.get_by_test_id("review").click()
    page.get_by_test_id("save-after-wtg-07/blade-1/pmm").uncheck()
    hold(page, "write-hold")
    expect(page.get_by_test_id("write-verified")).to_be_visible()
    page.get_by_test_id("review-close").click()
    expect(value).to_contain_text("49.0")
    expect(value).not_to_contain_text("→")
    expect(stored).not_to_contain_text("49.0")

    page.get_by_test_id("save").click()
    hold(page, "save-hold")
    expect(page.get_by_test_id("save-done")).to_be_visible()
    page.keyboard.press("Escape")
    expect(stored).to_have_attribute("data-state", "saved")
    expect(stored).to_contain_text("49.0")

    page.get_by_test_id("restart").click()
    hold(page, "restart-hold")
    expect(page.get_by_test_id("restart-done")).to_be_visible()
    # Its contact in the safety chain was open meanwhile: the blades drive to feather, and Escape would stop them.
    page.get_by_test_id("restart-close").click()
    expect(value).to_contain_text("–")

    page.get_by_test_id("read-all").click()
    expect(value).to_contain_text("49.0")
    expect(stored).to_have_attribute("data-state", "proven")

    page.reload()
    expect(value).to_contain_text("49.0")


def test_stop_and_feather_move_the_blades_on_the_screen(page: Page) -> None:
    """FEATHER drives to 90 degrees, seen on the card and told in the drawer; STOP is confirmed."""
    page.get_by_test_id("feather").click()
    expect(page.get_by_test_id("blade-2").get_by_test_id("angle")).to_contain_text(
        re.compile(r"^(89\.9|90\.0)"), timeout=WAIT_MS
    )
    page.get_by_test_id("stop").click()
    page.get_by_test_id("events-toggle").click()
    expect(page.get_by_text("STOP sent to 3 axes").first).to_be_visible()


def test_german_and_the_url_keep_what_a_person_chose(page: Page, demo: tuple[str, Process, Path]) -> None:
    home = demo[0].split("?")[0]
    page.goto(f"{home}parameters?device=wtg-07/blade-2/pmc&q=6065&lang=de&theme=light&scene=off")
    expect(page.get_by_text("Schleppfehlerfenster").first).to_be_visible()
    expect(page.get_by_test_id("value-6065")).to_contain_text("1,00")
    page.reload()
    expect(page.get_by_test_id("value-6065")).to_contain_text("1,00")
    expect(page.get_by_test_id("filter")).to_have_value("6065")


def test_the_page_knows_that_it_is_deaf(browser: Browser, tmp_path: Path) -> None:
    """Last of all, with a server of its own that is killed. How soon it knows is measured by the test of the frame."""
    with running("demo", "--port", "0", "--data", str(tmp_path), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        context = browser.new_context(viewport=SIZE)
        try:
            page = context.new_page()
            page.goto(url)
            page.goto(url.split("?")[0] + "?scene=off")  # software rendering would hold up the page's one thread
            expect(page.get_by_test_id("blade-1")).to_contain_text("80.00°", timeout=WAIT_MS)
            process.popen.kill()
            expect(page.get_by_test_id("deaf")).to_be_visible(timeout=WAIT_MS)
            expect(page.get_by_test_id("mode")).to_have_attribute("data-mode", "deaf")
            expect(page.locator("[data-deaf=true]")).to_be_visible()
        finally:
            context.close()
