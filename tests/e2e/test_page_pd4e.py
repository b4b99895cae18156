"""A drive on Modbus TCP is moved from the page: in its own units, by its own homing, with nothing but what it has."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.browser import signed_in
from tests.e2e.processes import running
from tests.e2e.test_page_motion import press, stands_still
from tests.service.motion.pd4e_rig import SITE, Bench, served

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
MOVE_MS = 30_000
OVER_VOLTAGE_MV, SUPPLY_MV = 60_000, 48_000
STATUS, CONTROL, MODE, POSITION, METHOD = 0x6041, 0x6040, 0x6060, 0x6064, 0x6098


@pytest.fixture(scope="module")
def bench() -> Iterator[Bench]:
    with served() as one:
        yield one


@pytest.fixture(scope="module")
def url(bench: Bench, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder: Path = tmp_path_factory.mktemp("bench")
    (folder / "site.toml").write_text(SITE.format(port=bench.server.port, more=""), encoding="utf-8")
    arguments = ("--site", str(folder / "site.toml"), "--port", "0", "--data", str(folder))
    with running("serve", *arguments, "--json") as process:
        yield json.loads(process.wait_for('"url"'))["url"]


@pytest.fixture(scope="module")
def at_bench(browser: Browser, url: str) -> Iterator[BrowserContext]:
    with signed_in(browser, url) as context:
        yield context


def state(bench: Bench) -> int:
    return bench.witness(STATUS, size=2, signed=False) & 0x6F


def ended(page: Page, text: str) -> None:
    expect(page.get_by_test_id("motion-ended")).to_contain_text(text, timeout=MOVE_MS)


def further_than(page: Page, deg: float) -> None:
    page.wait_for_function(
        "to => parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) > to",
        arg=deg,
        timeout=MOVE_MS,
    )


def test_a_drive_is_prepared_moved_stopped_homed_and_its_fault_reset(
    at_bench: BrowserContext, url: str, bench: Bench
) -> None:
    """What comes of each step is asked of the drive by a client of somebody else's."""
    page = at_bench.new_page()
    page.goto(f"{url.split('?')[0]}axis?scene=off")
    expect(page.get_by_test_id("axis-angle")).to_have_text(re.compile(r"\d"), timeout=MOVE_MS)
    expect(page.get_by_test_id("axis-state")).to_have_text(re.compile("switch on", re.IGNORECASE))
    for lacking in (
        "rotor-locked",
        "try-feather",
        "brake-test",
        "signal",
        "probe",
        "home",
        "bits-30FD",
        "external-stop",
    ):
        expect(page.get_by_test_id(lacking)).to_have_count(0)
    for drawn in ("position", "velocity", "torque"):
        expect(page.get_by_test_id(f"plot-{drawn}").locator("canvas")).to_be_visible()
    for there in ("bits-6041", "bits-6040", "bits-60FD", "bits-60FE:01", "routing-3252", "history-SERVO"):
        expect(page.get_by_test_id(there)).to_be_visible()

    page.get_by_test_id("take-control").click()
    page.get_by_test_id("people-out").check()
    expect(page.get_by_test_id("interlock-zone_clear")).to_have_attribute("data-bites", "false")
    expect(page.get_by_test_id("interlock-self_stop")).to_contain_text("says that it is a twin")
    press(page, "prepare")
    expect(page.get_by_test_id("proof")).to_contain_text("Prepared", timeout=MOVE_MS)
    page.mouse.up()

    press(page, "hold")
    expect(page.get_by_test_id("state-diagram")).to_have_attribute(
        "data-state", re.compile("operation_enabled"), timeout=MOVE_MS
    )
    assert state(bench) == 0x27
    page.mouse.up()
    ended(page, "Enabled and standing: let go")

    page.get_by_test_id("speed").fill("30")
    press(page, "jog-plus")
    further_than(page, 30)
    assert bench.witness(0x60FF) == 30, "in the unit of the drive, 1/min"
    page.mouse.up()
    ended(page, "Jog: let go")
    rest = stands_still(page)
    assert bench.witness(POSITION) == round(10 * rest)
    assert state(bench) in (0x21, 0x40)

    page.get_by_test_id("angle").fill("180")
    press(page, "move-to")
    ended(page, "Move: done")
    page.mouse.up()
    assert abs(bench.witness(POSITION) - 1800) <= 10
    assert (bench.witness(0x607A), bench.witness(0x6081)) == (1800, 30)

    press(page, "jog-plus")
    further_than(page, 190)
    page.keyboard.press("Escape")
    # The key lets go as well: whichever is heard first ends the order, and STOP is what stays.
    told = page.get_by_test_id("motion-ended")
    expect(told).to_have_text(re.compile("^Jog: (stopped by the drive, or by STOP|let go)"), timeout=MOVE_MS)
    expect(page.get_by_text("STOP: all axes confirmed")).to_be_visible()
    page.mouse.up()
    assert bench.witness(CONTROL, size=2) == 0x010B, "nothing came after STOP"
    assert state(bench) in (0x07, 0x40)

    page.get_by_test_id("homing-method").click()
    page.get_by_role("option", name=re.compile("^33:")).click()
    press(page, "search-home")
    ended(page, "Homing: done")
    page.mouse.up()
    assert abs(bench.witness(POSITION)) <= 20
    assert bench.witness(METHOD, size=1) == 35, "the method that stood there"

    press(page, "hold")
    bench.on_thread(lambda: setattr(bench.device.drive.conditions, "supply_mv", OVER_VOLTAGE_MV))
    expect(page.get_by_test_id("axis-state")).to_have_text("Fault", timeout=MOVE_MS)
    page.mouse.up()
    expect(page.get_by_test_id("error-now-SERVO")).to_contain_text("3100h")
    bench.on_thread(lambda: setattr(bench.device.drive.conditions, "supply_mv", SUPPLY_MV))
    page.get_by_test_id("reset-fault").click()
    expect(page.get_by_test_id("axis-state")).not_to_have_text("Fault", timeout=MOVE_MS)
    assert state(bench) in (0x21, 0x40)

    page.get_by_test_id("put-back").click()
    expect(page.get_by_test_id("prepare")).to_be_visible()
    assert bench.witness(MODE, size=1) == 0
    page.get_by_test_id("give-back").click()
    page.close()
