"""The tab of motors: marked examples, a motor of a device, its form, versions, comparison, files, a restore."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.e2e.browser import SIZE, WAIT_MS

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

EXAMPLE = "0197a000-0000-7000-8000-00000000e003"
DRIVE = "wtg-07/blade-1/pmc"


@pytest.fixture(scope="module")
def page(browser: Browser, demo: str) -> Iterator[Page]:
    context = browser.new_context(viewport=SIZE, locale="en-GB", reduced_motion="reduce", accept_downloads=True)
    context.set_default_timeout(WAIT_MS)
    page = context.new_page()
    page.goto(demo)
    expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
    yield page
    context.close()


def go(page: Page, demo: str, search: str = "") -> None:
    page.goto(f"{demo.split('?')[0]}sets?tab=motors&scene=off{search}")
    expect(page.get_by_test_id("table-motor").get_by_test_id("invented").first).to_be_visible(timeout=WAIT_MS)


def fill(page: Page, **texts: str) -> None:
    for name, text in texts.items():
        page.get_by_test_id(f"motor-field-{name.removeprefix('_')}").fill(text)


def test_examples_are_marked_and_only_serve_as_templates(page: Page, demo: str) -> None:
    go(page, demo)
    rows = page.get_by_test_id("table-motor").locator("[data-testid^='motor-0197']")
    expect(rows).to_have_count(3)
    for row in rows.all():
        expect(row).to_contain_text("example (invented)")
    page.get_by_test_id(f"motor-{EXAMPLE}").click()
    expect(page.get_by_test_id("motor-pane")).to_contain_text("no such motor exists")
    expect(page.get_by_test_id("motor-value-6410:03")).to_contain_text("330.0 V")
    expect(page.get_by_test_id("motor-value-6410:02")).to_contain_text("this machine only")
    expect(page.get_by_test_id("motor-delete")).to_have_count(0)
    page.get_by_test_id("motor-edit").click()
    expect(page.get_by_test_id("motor-field-power_kw")).to_have_value("4.2")
    expect(page.get_by_test_id("motor-field-maker")).to_have_value("")
    page.get_by_test_id("motor-save").click()
    expect(page.get_by_test_id("motor-form")).to_contain_text("it must not be empty")


def test_a_motor_of_a_device_is_changed_compared_and_led_to_a_restore(page: Page, demo: str) -> None:
    go(page, demo)
    page.get_by_test_id("motor-from-device").click()
    fill(page, maker="Lorentz", type="PM 5.5-2", speed_rpm="2900")
    page.get_by_test_id("motor-read").click()
    expect(page.get_by_test_id("motor-title")).to_have_text("Lorentz PM 5.5-2")
    expect(page.get_by_test_id("motor-value-6073")).to_contain_text("200.0 %")
    expect(page.get_by_test_id("motor-disagrees")).to_contain_text("Rated speed")

    page.get_by_test_id("motor-edit").click()
    fill(page, _6073="210")
    expect(page.get_by_test_id("motor-form")).to_contain_text("Too large. Allowed: 0.0 … 200.0 %")
    fill(page, _6073="150", speed_rpm="2920")
    page.get_by_test_id("motor-save").click()
    expect(page.get_by_test_id("motor-value-6073")).to_contain_text("150.0 %")
    page.get_by_test_id("motor-versions").click()
    page.get_by_role("option", name="Version 1").click()
    expect(page.get_by_test_id("motor-value-6073")).to_contain_text("200.0 %")
    expect(page.get_by_test_id("motor-edit")).to_be_disabled()
    page.get_by_test_id("motor-versions").click()
    page.get_by_role("option", name="Version 2").click()
    expect(page.get_by_test_id("motor-value-6073")).to_contain_text("150.0 %")

    page.get_by_test_id("motor-compare-this").click()
    page.get_by_test_id("motor-right").click()
    page.get_by_role("option", name="Blade 1 PMC").click()
    expect(page.get_by_test_id("motor-sentence")).to_have_text(
        "1 different, 25 the same, 1 bound to the machine, 0 known on one side only"
    )
    row = page.get_by_test_id("compared-6073")
    expect(row).to_contain_text("150.0 %")
    expect(row).to_contain_text("differs")
    expect(page.get_by_test_id("compared-6076")).to_have_count(0)
    page.reload()  # the comparison is in the address
    expect(page.get_by_test_id("compared-6073")).to_contain_text("200.0 %")
    page.get_by_test_id("motor-all-rows").check()
    expect(page.get_by_test_id("compared-6076")).to_contain_text("same")

    page.get_by_test_id("table-motor").get_by_text("PM 5.5-2").click()
    page.get_by_test_id("motor-apply").click()
    expect(page.get_by_test_id("sets-tab-restore")).to_have_attribute("aria-selected", "true")
    expect(page.get_by_test_id("given-motor").first).to_have_text(
        "Motor Lorentz PM 5.5-2, version 2, for Blade 1 PMC", timeout=WAIT_MS
    )
    expect(page.locator("main")).to_contain_text("1 value is written to Blade 1 PMC", timeout=WAIT_MS)


def test_files_go_out_and_a_damaged_one_names_line_and_column(page: Page, demo: str, tmp_path: Path) -> None:
    go(page, demo)
    count = page.get_by_test_id("table-count").inner_text()
    bad = tmp_path / "bad.csv"
    bad.write_text("maker,type,6073\nA,one,100\nA,two,500\n", encoding="utf-8")
    page.get_by_test_id("motor-import").set_input_files(bad)
    expect(page.get_by_test_id("problem")).to_contain_text(
        "bad.csv, line 3, column 6073: it must be from 0.0 to 200.0 %"
    )
    expect(page.get_by_test_id("table-count")).to_have_text(count)
    bad.write_text("maker;type;6073 max current [%]\nA;one;100,5\n", encoding="utf-8")
    page.get_by_test_id("motor-import").set_input_files(bad)
    expect(page.get_by_test_id("table-motor")).to_contain_text("one")
    with page.expect_download() as waiting:
        page.get_by_test_id("motor-export").click()
    out = tmp_path / "out.csv"
    waiting.value.save_as(out)
    with out.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["6073 max current [%]"] for row in rows if row["type"] == "one"} == {"100.5"}
    assert all(row["source"] != "example" for row in rows)


def test_the_list_and_the_form_work_by_keyboard_alone(page: Page, demo: str) -> None:
    go(page, demo)
    page.get_by_test_id("find").focus()
    page.keyboard.type("servo")
    page.keyboard.press("Enter")
    expect(page.get_by_role("row", name=re.compile("servo"))).to_be_focused()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("motor-title")).to_contain_text("SM 4.2-8 servo")
    page.get_by_test_id("motor-edit").focus()
    page.keyboard.press("Enter")
    page.get_by_test_id("motor-field-maker").focus()
    page.keyboard.type("Keys")
    page.keyboard.press("Tab")
    page.keyboard.type("K1")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("motor-title")).to_have_text("Keys K1")
    expect(page.get_by_test_id("invented").first).to_be_visible()
    expect(page.get_by_test_id("motor-pane").get_by_test_id("invented")).to_have_count(0)
