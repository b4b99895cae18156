"""Comparisons in a real browser: two devices and sets, the blades side by side, and a fleet, over twins."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from app.model.address import Address
from app.model.datatypes import Raw
from app.model.sets import dump_set, load_set
from tests.e2e.browser import answer_of
from tests.e2e.processes import running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
WAIT_MS: Final = 60_000
ONE, TWO, THREE = (f"wtg-07/blade-{blade}/pmm" for blade in (1, 2, 3))
LIMIT: Final = Address(0x3110, 1)
MOST_ROWS: Final = 60
"""Rows in the document at a time, however many there are."""


@dataclass(frozen=True)
class Home:
    """The page, signed in, and where it is."""

    address: str
    page: Page

    def go(self, place: str) -> None:
        self.page.goto(f"{self.address}sets?scene=off&{place}")

    def ask(self, method: str, path: str, body: object = None) -> Any:
        """The API, as the page asks it."""
        script = """async ([method, path, body]) => {
            const headers = {"content-type": "application/json"};
            const answer = await fetch(path, body === null ? {method} : {method, headers, body: JSON.stringify(body)});
            const text = await answer.text();
            if (!answer.ok) throw new Error(`${method} ${path}: ${answer.status} ${text}`);
            return JSON.parse(text);
        }"""
        return self.page.evaluate(script, [method, path, body])

    def write(self, device: str, address: str, raw: int) -> None:
        self.ask("POST", f"/api/live/devices/{device}/write", {"address": address, "raw": raw})

    def record(self, device: str) -> dict[str, Any]:
        """The latest set of a device."""
        found: dict[str, Any] = self.ask("GET", f"/api/sets?device={device}")["records"][0]
        return found

    def download(self, device: str) -> str:
        """The latest set of a device as a file."""
        key = self.record(device)["id"]
        return self.page.request.get(f"{self.address}api/sets/{key}/download").text()

    def take(self, device: str, far: str = "wtg-99", **changes: Any) -> str:
        """Import the set of a device with ``changes``, as of a turbine far away; gives the record's id."""
        found = load_set(self.download(device), "downloaded.json")
        origin = replace(found.origin, turbine=far, device=f"{far}/blade-1/pmm")
        data = base64.b64encode(dump_set(replace(found, origin=origin, **changes)).encode()).decode()
        taken = self.ask("POST", "/api/sets/import", {"name": "far.json", "data": data})
        return str(taken["record"]["id"])

    def values(self, device: str) -> dict[Address, Raw]:
        """Those of the latest set of a device."""
        return dict(load_set(self.download(device), "downloaded.json").values)


@pytest.fixture(scope="module")
def home(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Home]:
    """A demo whose blade 2 has another warning limit and another mask, with the sets as found in its library."""
    data = tmp_path_factory.mktemp("data")
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        context = browser.new_context(viewport={"width": 1366, "height": 768}, locale="en-GB", accept_downloads=True)
        context.set_default_timeout(WAIT_MS)
        expect.set_options(timeout=30_000)
        page = context.new_page()
        page.goto(f"{url}&scene=off")
        expect(page.get_by_test_id("mode")).to_be_visible(timeout=WAIT_MS)
        home = Home(url.split("?")[0], page)
        answer_of(
            page,
            """async () => (await (await fetch("/api/sets?tag=as-found")).json()).records.length === 6""",
            timeout_ms=WAIT_MS,
        )
        home.write(TWO, "3110:01", 510)
        home.write(TWO, "3201:04", 0x0005)
        yield home
        context.close()


def cell(page: Page, address: str, column: int) -> Locator:
    return page.get_by_test_id(f"cell-{address}-{column}")


def test_two_devices_show_what_differs_in_units_and_bit_by_bit(home: Home) -> None:
    page = home.page
    home.go(f"tab=compare&columns=live:{ONE},live:{TWO}")
    verdict = page.get_by_test_id("verdict")
    expect(verdict).to_have_text(re.compile(r"^2 differ, \d+ match, \d bound to this unit, 0 not found$"))
    expect(page.get_by_test_id(f"head-live:{TWO}")).to_contain_text("≠ 2 differ")
    expect(cell(page, "3110:01", 0)).to_have_text("50.0 °C")
    expect(cell(page, "3110:01", 1)).to_contain_text("51.0 °C+1.0")
    expect(cell(page, "3110:01", 1)).to_contain_text("differs")
    expect(cell(page, "3110:01", 1)).to_have_attribute("title", re.compile("raw 510 · 01FEh"))
    expect(page.get_by_test_id("compared-30E1")).to_have_count(0)
    page.get_by_text("All", exact=True).click()
    expect(page.get_by_test_id("compared-30E1")).to_be_visible()
    expect(page).to_have_url(re.compile("rows=all"))
    page.get_by_test_id("compare-find").fill("heater 3201:04")
    expect(page.get_by_test_id("compare-count")).to_contain_text(re.compile(r"^1 of \d+"))
    page.get_by_test_id("expand-3201:04").click()
    bits = page.locator("[data-testid^='bit-3201:04#']")
    expect(bits).to_have_count(3)
    expect(bits.last).to_contain_text("X16.1/X16.2")
    expect(bits.last).to_contain_text(re.compile("on.*off"))
    expect(page).to_have_url(re.compile("find=heater"))  # follows when the typing pauses
    page.reload()
    expect(bits).to_have_count(3)
    page.get_by_test_id("parameter-3201:04").click()
    expect(page).to_have_url(re.compile(r"/parameters\?.*device=wtg-07/blade-1/pmm.*q=3201:04"))


def test_columns_are_chosen_by_keyboard_and_another_becomes_the_reference(home: Home) -> None:
    page = home.page
    home.go("tab=compare")
    page.get_by_test_id("start-oat-pmm").click()
    expect(page).to_have_url(re.compile(f"columns=live:{ONE},live:{TWO},live:{THREE}"))
    add = page.get_by_test_id("add-column")
    add.focus()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("column-search")).to_be_focused()
    page.keyboard.type("blade 2 default")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(f"live:{THREE},default:{TWO}"))
    page.keyboard.press("Escape")
    expect(add).to_be_focused()
    head = page.get_by_test_id(f"head-default:{TWO}")
    expect(head).not_to_contain_text("Reference")
    page.get_by_test_id(f"menu-default:{TWO}").click()
    page.get_by_test_id("column-reference").click()
    expect(page).to_have_url(re.compile(f"columns=default:{TWO},live:{ONE}"))
    expect(head).to_contain_text("Reference")
    expect(cell(page, "3110:01", 2)).to_contain_text("+1.0")
    expect(page.locator("[data-why='no-default']").first).to_have_text("no default given")
    expect(page.get_by_role("menu")).to_have_count(0)
    page.get_by_test_id(f"menu-live:{THREE}").click()
    page.get_by_test_id("column-remove").click()
    expect(page.get_by_test_id(f"head-live:{THREE}")).to_have_count(0)


def test_the_rows_are_walked_folded_and_picked_by_keyboard(home: Home) -> None:
    page = home.page
    home.go(f"tab=compare&columns=found:{TWO},live:{TWO}")
    page.get_by_test_id("compare-find").focus()
    page.keyboard.press("Enter")
    table = page.get_by_test_id("comparison")
    expect(table).to_be_focused()
    page.keyboard.press("ArrowDown")
    expect(table).to_have_attribute("aria-activedescendant", "compared-3110:01")
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("compared-3110:01")).to_have_attribute("aria-expanded", "true")
    page.keyboard.press("ArrowLeft")
    expect(page.get_by_test_id("compared-3110:01")).to_have_attribute("aria-expanded", "false")
    page.keyboard.press("Space")
    expect(page.get_by_test_id("compared-3110:01")).to_have_attribute("aria-selected", "true")
    page.get_by_test_id("restore-picked").click()
    page.get_by_test_id(f"restore-found:{TWO}").click()
    expect(page).to_have_url(re.compile("tab=restore"))
    expect(page).to_have_url(re.compile(f"sets={home.record(TWO)['id']}.*select=3110:01"))


def test_each_reason_for_no_value_has_its_own_words(home: Home) -> None:
    page = home.page
    some = {address: raw for address, raw in home.values(ONE).items() if address != LIMIT}
    part = home.take(ONE, values=some)
    silent = home.take(ONE, values={**some, Address(0x3110, 2): 560}, unread={LIMIT: "no answer"})
    other = home.take(ONE, description_version="9.0.0")
    home.go(f"tab=compare&columns=live:{ONE},set:{part},set:{silent},live:wtg-07/blade-1/pmc&rows=all")
    page.get_by_test_id("compare-find").fill("3110:01")
    row = page.get_by_test_id("compared-3110:01")
    expect(row).to_contain_text("not in this set")
    expect(row).to_contain_text("unread")
    expect(row).to_contain_text("not on this device")
    home.go(f"tab=compare&columns=live:{ONE},set:{other}")
    expect(page.get_by_test_id("verdict")).to_contain_text(re.compile(r"[1-9]\d* not comparable"))
    first = page.locator("[data-kind='row'][data-state='not-comparable']").first
    expect(first).to_contain_text("not comparable")


def test_a_file_is_put_into_a_column_and_a_bad_column_can_be_taken_out(home: Home, tmp_path: Path) -> None:
    page = home.page
    file = tmp_path / "blade-2.json"
    file.write_text(home.download(TWO))
    home.go(f"tab=compare&columns=live:{TWO},golden:{TWO}")
    expect(page.get_by_test_id("problem")).to_contain_text("No golden set")
    page.get_by_test_id(f"take-out-golden:{TWO}").click()
    expect(page.get_by_text("Choose one more column.")).to_be_visible()
    page.get_by_test_id("column-upload").set_input_files(file)
    expect(page).to_have_url(re.compile(f"columns=live:{TWO},set:"))
    expect(cell(page, "3110:01", 1)).to_contain_text("50.0 °C")


def test_a_finding_is_new_beside_the_reference_or_stands_in_it(home: Home) -> None:
    """What the rules say of a column is held against the first one, which another column can become."""
    one, two = "live:wtg-07/blade-1/pmc", "live:wtg-07/blade-2/pmc"
    home.write("wtg-07/blade-2/pmc", "6510:04", 410)
    try:
        page = home.page
        home.go(f"tab=compare&columns={one},{two}&edit=6510:04")
        standing = page.get_by_test_id("standing-6510:04!oat.dc_link_ladder")
        expect(standing).to_have_text("New in Blade 2 PMC now (RAM)")
        expect(page.get_by_test_id("compared-6510:04")).to_contain_text(re.compile(r"findings?new"))
        home.go(f"tab=compare&columns={two},{one}&edit=6510:04")
        expect(standing).to_have_text("In the reference alone")
        home.go("tab=blades&device=wtg-07/blade-1/pmc&edit=6510:04")
        expect(standing).to_have_text("In Blade 2 PMC")
    finally:
        home.write("wtg-07/blade-2/pmc", "6510:04", 100)


def test_the_odd_blade_is_named_and_followed_live(home: Home) -> None:
    page = home.page
    home.go("tab=blades")
    odd = page.get_by_test_id(f"parity-{TWO}")
    expect(odd).to_contain_text("differs from the others in 2 parameters")
    expect(page.get_by_test_id(f"parity-{ONE}")).to_contain_text("agrees with the others")
    home.write(TWO, "3110:01", 500)
    expect(odd).to_contain_text("differs from the others in 1 parameter")
    home.write(TWO, "3110:01", 510)
    expect(odd).to_contain_text("in 2 parameters")
    page.get_by_test_id("parity-kind").get_by_text("PMC").click()
    allowed = page.get_by_test_id("section-unit")
    expect(allowed).to_contain_text("may differ2")
    expect(page.get_by_test_id("compared-607C")).to_contain_text("this unit")
    allowed.click()
    expect(page.get_by_test_id("compared-607C")).to_have_count(0)


def test_a_fleet_is_ranked_against_a_chosen_set_and_leads_to_the_comparison(home: Home) -> None:
    page = home.page
    home.go("tab=fleet")
    expect(page.get_by_test_id("no-golden")).to_contain_text("marked golden yet")
    golden = home.take(ONE, values={**home.values(ONE), LIMIT: 520})
    home.go(f"tab=fleet&golden=oat-pmm:{golden}")
    expect(page.get_by_test_id("fleet-sentence")).to_contain_text("3 of 4 devices differ")
    row = page.get_by_test_id(f"fleet-{TWO}")
    expect(row).to_contain_text("3110:01 temperature supervisor battery: warning limit")
    page.get_by_test_id("fleet-view").get_by_text("Heat map").click()
    expect(row.locator("[data-column='group-temperatures']")).to_have_text("1")
    expect(row.locator("[data-column='group-mains']")).to_have_text("0")
    row.focus()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(f"tab=compare.*columns=set:{golden},set:"))
    expect(cell(page, "3110:01", 1)).to_contain_text("−2.0")


def test_a_fragment_is_shown_as_such_and_not_as_equal(home: Home) -> None:
    page = home.page
    few = {address: raw for address, raw in home.values(ONE).items() if address != LIMIT}
    home.take(ONE, far="wtg-98", values=few, unread={LIMIT: "no_answer"})
    home.go(f"tab=fleet&golden=oat-pmm:{home.record(ONE)['id']}")
    expect(page.get_by_test_id("fleet-incomplete")).to_have_text("1 set is incomplete: what it lacks is not compared")
    page.get_by_test_id("fleet-view").get_by_text("Heat map").click()
    row = page.get_by_test_id("fleet-wtg-98/blade-1/pmm")
    expect(row.locator("[data-column='group-temperatures']")).to_have_text("∅ 1")
    expect(row.locator("[data-column='group-mains']")).to_have_text("0")


def test_a_comparison_is_exported_in_the_language_of_the_page(home: Home) -> None:
    page = home.page
    home.go(f"tab=compare&lang=de&columns=live:{ONE},live:{TWO}")
    page.get_by_test_id("compare-export").click()
    with page.expect_download() as download:
        page.get_by_test_id("export-csv").click()
    text = Path(download.value.path()).read_text(encoding="utf-8")
    assert download.value.suggested_filename == "hubside-comparison.csv"
    assert "3110:01" in text
    assert "jetzt (RAM)" in text
    assert "30E1" not in text, "what matches is left out, as on the page"


def test_parameters_lead_to_comparisons(home: Home) -> None:
    page = home.page
    page.goto(f"{home.address}parameters?scene=off&device={TWO}")
    page.get_by_test_id("compare-with").click()
    page.get_by_test_id("compare-with-found").click()
    expect(page).to_have_url(re.compile(f"/sets\\?.*columns=found:{TWO},live:{TWO}"))
    expect(page.get_by_test_id("verdict")).to_contain_text("2 differ")


def test_many_columns_and_all_rows_stay_small_in_the_document(home: Home) -> None:
    page = home.page
    columns = [f"{kind}:{slug}" for slug in (ONE, TWO, THREE) for kind in ("live", "stored", "default", "found")]
    home.go(f"tab=compare&rows=all&columns={','.join(columns)}")
    expect(page.get_by_test_id("compare-count")).to_contain_text(re.compile(r"^(\d+) of \1"))
    rows = page.get_by_test_id("comparison").get_by_role("row")
    expect(rows.first).to_be_visible()
    page.get_by_test_id("comparison").focus()
    page.keyboard.press("End")
    last = page.get_by_test_id("comparison").get_attribute("aria-rowcount")
    expect(page.locator(f"[aria-rowindex='{last}']")).to_be_visible()
    assert rows.count() <= MOST_ROWS


def test_the_blades_are_compared_by_their_latest_sets_connected_or_not(home: Home) -> None:
    """The sets as found are older than what was written to blade 2: by them the blades agree."""
    page = home.page
    home.go(f"tab=blades&device={ONE}")
    page.get_by_test_id("parity-of").get_by_text("Latest sets").click()
    expect(page).to_have_url(re.compile("of=latest"))
    expect(page.get_by_test_id(f"parity-{TWO}")).to_contain_text("agrees with the others")
    head = page.get_by_test_id(f"head-latest:{TWO}")
    expect(head).to_contain_text(re.compile(r"latest set.*\d{4}-\d\d-\d\d \d\d:\d\d"))
    home.ask("POST", "/api/live/disconnect", {})
    try:
        home.go("tab=blades")
        expect(page.get_by_test_id(f"parity-{ONE}")).to_contain_text("agrees with the others")
        expect(page.get_by_test_id("parity-of")).to_have_count(0)
        expect(page.get_by_test_id("parity-turbine")).to_have_value("WTG-07")
    finally:
        home.ask("POST", "/api/live/connect", {"turbine": "wtg-07"})
