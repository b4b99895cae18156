"""The library in a real browser: a backup, tags, picking and comparing, files in and out, a nameplate, leaving."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from app.model.sets import load_set
from tests.e2e.processes import running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
WAIT_MS = 60_000
expect.set_options(timeout=20_000)
WRITE = """async (body) => (await fetch("/api/live/devices/wtg-07/blade-1/pmm/write",
    { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) })).status"""
IMPORT = """async (body) => (await (await fetch("/api/sets/import", { method: "POST",
    headers: { "content-type": "application/json" }, body: JSON.stringify(body) })).json()).record.id"""
FOREIGN = "address,name,raw\n6065,window,1234\n2FFF,of another maker,1\n"


@pytest.fixture(scope="module")
def home(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Page]]:
    data = tmp_path_factory.mktemp("data")
    (data / "sets" / "wtg-09").mkdir(parents=True)
    (data / "sets" / "wtg-09" / "torn.json").write_text('{"format": "hubside-set/1",\n "values": {')
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        context = browser.new_context(viewport={"width": 1366, "height": 768}, locale="en-GB", accept_downloads=True)
        page = context.new_page()
        page.goto(f"{url}&scene=off")
        expect(page.get_by_test_id("mode")).to_be_visible(timeout=WAIT_MS)
        yield url.split("?")[0], page
        context.close()


def rows(page: Page) -> Locator:
    return page.locator("[data-testid^='row-']")


def backup_of(page: Page, device: str, reason: str = "before the test") -> Locator:
    return rows(page).filter(has_text=device).filter(has_text=reason)


def test_a_turbine_is_backed_up_and_as_found_was_taken_by_itself(home: tuple[str, Page]) -> None:
    address, page = home
    page.goto(f"{address}sets?scene=off")
    expect(page.get_by_test_id("bad-files")).to_contain_text("is no usable set")
    page.get_by_test_id("bad-files").locator("summary").click()
    expect(page.get_by_test_id("bad-files")).to_contain_text("wtg-09/torn.json, line 2")
    page.locator("label").filter(has_text="as found").click()
    expect(rows(page).filter(has_text="as found")).to_have_count(6, timeout=WAIT_MS)
    expect(page).to_have_url(re.compile("only=as-found"))
    page.locator("label").filter(has_text="all").click()
    page.get_by_test_id("reason").fill("before the test")
    page.get_by_test_id("back-up").click()
    row = backup_of(page, "blade-1 / pmm")
    expect(row).to_contain_text("complete", timeout=WAIT_MS)
    row.focus()
    page.keyboard.press("Enter")
    details = page.get_by_test_id("set-details")
    expect(details.get_by_test_id("set-3110:01")).to_contain_text("50.0 °C")
    expect(details).to_contain_text("Everything was read")


def test_sets_are_tagged_found_by_their_tag_and_compared(home: tuple[str, Page]) -> None:
    address, page = home
    page.goto(f"{address}sets?scene=off&find=before+the+test")
    for device in ("blade-1 / pmm", "blade-2 / pmm"):
        backup_of(page, device).get_by_role("checkbox").check()
    expect(page).to_have_url(re.compile(r"sets=[0-9a-f-]{36},[0-9a-f-]{36}"))
    expect(page.get_by_test_id("restore-sets")).to_be_disabled()
    page.get_by_test_id("tag-menu").click()
    expect(page.get_by_test_id("give-golden")).to_be_disabled()
    page.get_by_test_id("give-as-delivered").click()
    expect(backup_of(page, "blade-2 / pmm").get_by_test_id("tag-as-delivered")).to_be_visible()
    page.get_by_test_id("clear-picked").click()
    page.locator("label").filter(has_text="as delivered").click()
    expect(rows(page)).to_have_count(2)
    for box in rows(page).get_by_role("checkbox").all():
        box.check()
    page.get_by_test_id("compare-sets").click()
    expect(page).to_have_url(re.compile(r"tab=compare&columns=set:[0-9a-f-]{36},set:[0-9a-f-]{36}"))
    expect(page.get_by_test_id("sets-tab-compare")).to_have_attribute("aria-selected", "true")


def test_a_set_of_each_device_of_a_station_leads_to_its_restore(home: tuple[str, Page]) -> None:
    address, page = home
    page.goto(f"{address}sets?scene=off&find=before+the+test")
    for device in ("blade-3 / pmm", "blade-3 / pmc"):
        backup_of(page, device).get_by_role("checkbox").check()
    page.get_by_test_id("restore-sets").click()
    expect(page).to_have_url(re.compile(r"tab=restore"))
    expect(page).to_have_url(re.compile(r"station=wtg-07/blade-3"))


def test_a_set_leaves_as_a_file_and_comes_back_and_errors_name_the_line(home: tuple[str, Page], tmp_path: Path) -> None:
    address, page = home
    page.goto(f"{address}sets?scene=off&find=before+the+test")
    backup_of(page, "blade-1 / pmc").click()
    page.get_by_test_id("export-set").click()
    expect(page.get_by_test_id("export-dcf")).to_be_visible()
    with page.expect_download() as download:
        page.get_by_test_id("export-json").click()
    target = tmp_path / "set.json"
    download.value.save_as(target)
    text = target.read_text()
    assert load_set(text, "set.json").origin.device == "wtg-07/blade-1/pmc"

    target.write_text(text.replace('"6866:00": 0', '"6866:00": 1'))
    page.get_by_test_id("import-set").click()
    page.locator("input[type=file]").set_input_files(target)
    page.get_by_test_id("import-take").click()
    expect(page.get_by_test_id("problem")).to_contain_text("was changed")
    foreign = tmp_path / "axis.csv"
    foreign.write_text(FOREIGN)
    page.locator("input[type=file]").set_input_files(foreign)
    page.get_by_test_id("import-take").click()
    expect(page.get_by_test_id("problem")).to_contain_text("name the device")
    page.get_by_test_id("import-device").fill("wtg-09/blade-1/pmc")
    page.get_by_test_id("import-take").click()
    expect(page.get_by_test_id("import-taken")).to_contain_text("1 values of wtg-09/blade-1/pmc")
    expect(page.get_by_test_id("import-taken")).to_contain_text("2FFF")
    page.get_by_test_id("import-open").click()
    page.get_by_test_id("find").fill("")
    details = page.get_by_test_id("set-details")
    expect(details.get_by_test_id("set-6065")).to_contain_text("12.34 °")
    details.get_by_test_id("set-unread").locator("summary").click()
    expect(details.get_by_test_id("set-unread")).to_contain_text("not in the file")
    expect(rows(page).filter(has_text="wtg-09")).to_have_count(1)


def test_a_dcf_is_offered_of_canopen_devices_alone(home: tuple[str, Page]) -> None:
    address, page = home
    page.goto(f"{address}sets?scene=off")
    data = base64.b64encode(b"address,name,raw\n2030,,1\n").decode()
    servo = {"name": "servo.csv", "data": data, "device": "wtg-09/hub/servo", "description_id": "nanotec-pd4e"}
    opened = page.evaluate(IMPORT, servo)
    page.goto(f"{address}sets?scene=off&file={opened}")
    page.get_by_test_id("export-set").click()
    expect(page.get_by_test_id("export-csv")).to_be_visible()
    expect(page.get_by_test_id("export-dcf")).to_have_count(0)


def test_a_nameplate_is_typed_twice(home: tuple[str, Page]) -> None:
    address, page = home
    page.goto(f"{address}sets?scene=off&find=before+the+test")
    backup_of(page, "blade-2 / pmc").click()
    page.get_by_test_id("set-facts").locator("summary").click()
    plate = page.get_by_test_id("nameplate")
    plate.get_by_test_id("plate-serial").fill("P-20417")
    plate.get_by_test_id("plate-again").fill("P-20471")
    expect(plate.get_by_text("The two differ")).to_be_visible()
    expect(plate.get_by_test_id("plate-keep")).to_be_disabled()
    plate.get_by_test_id("plate-again").fill("P-20417")
    plate.get_by_test_id("plate-keep").click()
    expect(plate).to_contain_text("Serial number P-20417, typed by")


def test_before_leaving_it_is_said_what_is_kept_and_then_it_is_there(home: tuple[str, Page]) -> None:
    address, page = home
    page.goto(f"{address}sets?scene=off&only=as-left")
    for raw in (510, 500):
        assert page.evaluate(WRITE, {"address": "3110:01", "raw": raw}) == 200
    page.get_by_test_id("connect-menu").click()
    page.get_by_test_id("visit").click()
    expect(page.get_by_test_id("as-left")).to_contain_text("of 6 devices go into the library")
    written = page.get_by_test_id("left-wtg-07/blade-1/pmm")
    expect(written).to_have_text(re.compile(r"^Blade 1 PMM read .* ago, 2 writes since$"), timeout=WAIT_MS)
    expect(page.get_by_test_id("left-wtg-07/blade-3/pmc")).to_contain_text("no write since")
    page.get_by_test_id("read-before-leaving").click()
    expect(written).to_contain_text("no write since", timeout=WAIT_MS)
    expect(page.get_by_test_id("read-before-leaving")).to_be_enabled()
    page.get_by_test_id("end-visit").click()
    expect(rows(page).filter(has_text="as left")).to_have_count(6, timeout=WAIT_MS)
