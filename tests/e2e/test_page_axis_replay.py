"""The axis room while a recording is shown: what was recorded at the cursor, nothing of now, nothing that acts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.test_page_replay import AXE, PMC_2, TRIP, WAIT_MS, Home, S, at_rest, home, pages, seek, serving, start_ns

__all__ = ["home", "pages", "serving", "start_ns"]

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

PMM_2: Final = "wtg-07/blade-2/pmm"
AT_S: Final = 27
"""By then blade 2 has tripped; the twins of the demo stand at 80 degrees, without a fault."""
PICTURES: Final = ("temperatures", "masks", "ladder", "battery", "gear", "controller")
VIEWS: Final = ("", *(f"&tab=setup&picture={one}" for one in PICTURES), "&tab=scope", "&tab=pdo", "&tab=pdo&pdo=rpdo1")
READY: Final = {
    "": "axis-angle",
    "temperatures": "place-battery",
    "masks": "pulse-test",
    "ladder": "picture-ladder",
    "battery": "battery-picture",
    "gear": "gear-picture",
    "controller": "controller",
    "scope": "scope-lock",
    "pdo": "pdo-rpdo1",
}
HARMLESS: Final = re.compile(
    r"axis-tab-|scope-side-|edit-[rt]pdo|look-|open-parameter|choose-|picture|stage-name|span|close|capture-|reference-"
    r"|^pause$|^Choose outputs$|^Probable causes|^Present now"
)
"""Controls that only choose what is looked at."""
ENABLED: Final = """() => [...document.querySelectorAll(
    'main button, main select, main textarea, main [role=slider], main [role=switch], main input')]
  .filter((one) => one.offsetParent !== null && !one.disabled && !one.readOnly)
  .filter((one) => one.getAttribute('aria-disabled') !== 'true' && one.closest('fieldset:disabled') === null)
  .filter((one) => one.closest('[role=radiogroup]') === null)
  .map((one) => one.dataset.testid || one.getAttribute('aria-label') || one.textContent || one.type)"""
ACTS: Final[tuple[tuple[str, str, dict[str, object]], ...]] = (
    ("POST", f"live/devices/{PMC_2}/motion/jog", {"fence": 1, "order": 1, "speed": 1.0}),
    ("POST", f"live/devices/{PMC_2}/motion/prepare", {"fence": 1, "order": 1}),
    ("POST", "live/motion/lease", {"page": "of the test"}),
    ("POST", f"live/devices/{PMM_2}/battery/test", {}),
    ("POST", f"live/devices/{PMM_2}/battery/charge", {}),
    ("POST", f"live/devices/{PMM_2}/battery/change", {"serials": "1"}),
    ("POST", "live/scope/arm", {}),
    ("POST", f"live/devices/{PMC_2}/save", {}),
)


def view_of(path: str) -> str:
    """What is shown: a tab, or one of its pictures."""
    return re.split(r"[=&]", path.removeprefix("&tab=setup&picture=").removeprefix("&tab="))[0]


@pytest.fixture
def at_trip(home: Home, start_ns: int) -> Iterator[int]:
    """The cursor, behind the trip of blade 2."""
    t_ns = start_ns + AT_S * S
    seek(home, t_ns)
    yield t_ns


def opened(home: Home, pages: list[Page], path: str) -> Page:
    page = home.open(f"axis?blade=2&replay={TRIP}{path}")
    pages.append(page)
    expect(page.get_by_test_id("replay-badge")).to_contain_text(re.compile("REPLAY|WIEDERGABE"))
    expect(page.get_by_test_id(READY[view_of(path)]).first).to_be_visible(timeout=WAIT_MS)
    return page


@pytest.mark.parametrize("path", VIEWS)
def test_nothing_in_it_acts_and_axe_has_no_complaints(home: Home, pages: list[Page], at_trip: int, path: str) -> None:
    assert at_trip
    page = opened(home, pages, path)
    found = [one for one in page.evaluate(ENABLED) if not HARMLESS.search(one)]
    assert found == [], "each control that is not locked only chooses what is looked at"
    locks = page.locator("[data-testid=replay-lock], [data-testid=scope-lock], [data-testid=recorded-note]")
    expect(locks.first).to_be_visible()
    page.add_style_tag(content="*, *::before, *::after { transition: none !important; animation: none !important }")
    page.add_script_tag(path=str(AXE))
    for theme in ("light", "dark"):
        if page.locator("html").get_attribute("data-mantine-color-scheme") != theme:
            page.get_by_test_id("theme").click()
        expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", theme)
        result = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
        assert result["passes"], "axe has looked at something"
        assert [f"{one['id']}: {one['nodes'][0]['html'][:160]}" for one in result["violations"]] == [], theme


def test_what_would_act_is_refused_by_the_server_with_its_reason(home: Home, at_trip: int) -> None:
    assert at_trip
    for method, path, body in ACTS:
        status, document = home.call(method, path, body, **{"x-hubside-context": f"replay/{TRIP}"})
        assert (status, document["code"]) == (409, "replay_only"), path
    for language, words in (("en", "This is a recording"), ("de", "Das ist eine Aufzeichnung")):
        asked = {"x-hubside-context": f"replay/{TRIP}", "accept-language": language}
        _, document = home.call("POST", f"live/devices/{PMC_2}/motion/jog", {}, **asked)
        assert words in document["text"]


def test_it_shows_what_stood_at_the_cursor_and_not_the_twins_of_today(
    home: Home, pages: list[Page], at_trip: int
) -> None:
    """The recorded blade 2 has tripped; that of the demo is well, and its unit would tell what nobody had read then."""
    live = home.open("axis?blade=2")
    pages.append(live)
    expect(live.get_by_test_id("axis-angle")).to_have_text(re.compile("°$"), timeout=WAIT_MS)
    expect(live.locator("main")).not_to_contain_text("8611h")
    expect(live.get_by_test_id("motion")).to_be_visible()
    page = opened(home, pages, "")
    expect(page.locator("main")).to_contain_text("8611h")
    expect(page.get_by_test_id("recorded-note")).to_contain_text("this is a recording")
    expect(page.get_by_test_id("motion")).to_have_count(0)
    tripped = at_rest(page.get_by_test_id("axis-angle"))
    assert tripped != live.get_by_test_id("axis-angle").text_content()
    seek(home, at_trip - 15 * S)
    expect(page.get_by_test_id("axis-angle")).not_to_have_text(tripped)
    expect(page.locator("main")).not_to_contain_text("8611h")


def test_what_nobody_had_read_is_not_known_although_the_twins_would_tell_it(
    home: Home, pages: list[Page], at_trip: int
) -> None:
    assert at_trip
    live = home.open("axis?blade=2&tab=setup&picture=gear")
    pages.append(live)
    expect(live.get_by_test_id("increments-motor")).not_to_have_value("", timeout=WAIT_MS)
    page = opened(home, pages, "&tab=setup&picture=gear")
    expect(page.get_by_test_id("increments-motor")).to_have_value("")
    expect(page.get_by_test_id("not-recorded-motor")).to_contain_text("Not known as of the cursor")
    expect(page.get_by_role("alert")).to_have_count(0)
    page.goto(f"{home.address}axis?blade=2&tab=setup&picture=battery&scene=off&replay={TRIP}")
    expect(page.get_by_test_id("battery-picture")).to_contain_text("How many blocs there are (3020h:04) is not known")
    expect(page.get_by_test_id("battery-test")).to_have_count(0)


def test_the_scope_of_the_bench_goes_on_and_is_not_shown_as_recorded(
    home: Home, pages: list[Page], at_trip: int
) -> None:
    assert at_trip
    live = home.open("axis?blade=2&tab=scope&channels=blade-2/pmc/6064")
    pages.append(live)
    live.get_by_test_id("arm").click()
    expect(live.get_by_test_id("scope-state")).to_have_attribute("data-phase", "waiting", timeout=WAIT_MS)
    expect(live.get_by_test_id("scope-live")).to_be_visible(timeout=WAIT_MS)
    page = opened(home, pages, "&tab=scope")
    expect(page.get_by_test_id("scope-replayed")).to_contain_text("does not run in a recording")
    expect(page.get_by_test_id("scope-lock")).to_contain_text("cannot be armed")
    expect(page.get_by_test_id("scope-live")).to_have_count(0)
    expect(page.get_by_test_id("scope-state")).to_have_count(0)
    live.get_by_test_id("trigger-now").click()
    expect(live).to_have_url(re.compile("capture="), timeout=WAIT_MS)
    expect(page).not_to_have_url(re.compile("capture="))


def test_it_is_german_too(home: Home, pages: list[Page], at_trip: int) -> None:
    assert at_trip
    page = opened(home, pages, "&tab=setup&picture=controller&lang=de")
    expect(page.get_by_test_id("recorded-note")).to_contain_text("Dies ist eine Aufzeichnung")
    page.goto(f"{home.address}axis?blade=2&tab=scope&lang=de&scene=off&replay={TRIP}")
    expect(page.get_by_test_id("scope-replayed")).to_contain_text("läuft daher in einer Aufzeichnung nicht")
