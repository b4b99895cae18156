"""What the frame of every page must survive: server and bus going away and coming back, other people, no turbine."""

from __future__ import annotations

import json
import re
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, ViewportSize, expect

from tests.e2e.conftest import Twins
from tests.e2e.processes import HUBSIDE, ROOT, Process, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

SIZE: ViewportSize = {"width": 1366, "height": 768}
WAIT_MS = 60_000
DEAF_S = 2.0
"""The page knows after 1 s; the rest is for a host that has other work."""
ANNA, BEN = ("Anna", "pitch and yaw 7"), ("Ben", "hub and nacelle 8")
ROOMS = ("", "axis", "parameters", "sets", "recordings", "bus", "procedures", "settings")
NEEDS_TURBINE = ("", "axis", "parameters", "bus")
expect.set_options(timeout=30_000)


@dataclass
class Served:
    """A running server with its address."""

    process: Process
    url: str
    errors: list[str] = field(default_factory=list)

    @property
    def home(self) -> str:
        """The address without the token."""
        return self.url.split("?")[0]

    @property
    def port(self) -> str:
        """The TCP port."""
        return self.home.rsplit(":", 1)[1].strip("/")

    def open(self, context: BrowserContext, path: str = "") -> Page:
        """A tab without the 3D view: software rendering would hold up everything else."""
        page = context.new_page()
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.goto(f"{self.home}{path}{'&' if '?' in path else '?'}scene=off")
        return page

    def let_in(self, context: BrowserContext) -> BrowserContext:
        """Exchange the printed token for a session."""
        page = context.new_page()
        page.goto(f"{self.url}&scene=off")
        expect(page.get_by_test_id("mode")).to_be_visible(timeout=WAIT_MS)
        page.close()
        return context


@contextmanager
def serving(data: Path, *arguments: str, port: str = "0") -> Iterator[Served]:
    """``hubside serve``; at the end no page had an error."""
    with running("serve", "--data", str(data), "--port", port, "--json", *arguments) as process:
        served = Served(process, json.loads(process.wait_for('"url"', WAIT_MS / 1000))["url"])
        yield served
        assert served.errors == []


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    yield from profile(browser)


def profile(browser: Browser) -> Iterator[BrowserContext]:
    context = browser.new_context(viewport=SIZE, color_scheme="dark", locale="en-GB")
    context.set_default_timeout(WAIT_MS)
    yield context
    context.close()


def angle(page: Page, blade: int) -> Locator:
    return page.get_by_test_id(f"blade-{blade}").get_by_test_id("angle")


def events(page: Page) -> Locator:
    return page.get_by_role("region", name="Events")


def hold(page: Page, test_id: str, until: Locator) -> None:
    """Press a hold-to-confirm button until what it brings is seen."""
    button = page.get_by_test_id(test_id)
    button.scroll_into_view_if_needed()
    button.hover()
    page.mouse.down()
    expect(until).to_be_visible(timeout=WAIT_MS)
    page.mouse.up()


# -- server and bus ----------------------------------------------------------------------


def test_a_page_survives_the_restart_of_its_server(context: BrowserContext, twins: Twins, tmp_path: Path) -> None:
    """Deaf at once and seen to be; then it hears again by itself, signed in as before."""
    site = ("--site", str(twins.site))
    with serving(tmp_path / "data", *site) as first:
        page = first.open(first.let_in(context))
        expect(angle(page, 2)).to_contain_text("80.00°", timeout=WAIT_MS)
        page.evaluate(
            """() => new MutationObserver(() => {
              if (document.querySelector('[data-mode=deaf]')) window.deafAtMs ??= Date.now();
            }).observe(document.body, {subtree: true, attributes: true, childList: true})"""
        )
        killed_s = time.time()
        first.process.popen.kill()
        expect(page.get_by_test_id("deaf")).to_contain_text("No connection to the bench since")
        expect(page.get_by_test_id("mode")).to_have_attribute("data-mode", "deaf")
        assert page.evaluate("() => window.deafAtMs") / 1000 - killed_s < DEAF_S
    with serving(tmp_path / "data", *site, port=first.port) as second:
        expect(page.get_by_test_id("deaf")).to_be_hidden(timeout=WAIT_MS)
        expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
        page.get_by_test_id("feather").click()
        expect(angle(page, 2)).to_contain_text(re.compile(r"^(89\.9|90\.0)"), timeout=WAIT_MS)
        expect(page.get_by_test_id("blade-2")).to_have_attribute("data-stale", "false")
        page.goto(f"{second.home}?scene=off")
        expect(angle(page, 2)).to_contain_text(re.compile(r"^(89\.9|90\.0)"), timeout=WAIT_MS)
    assert first.errors == []


def test_a_bus_that_is_pulled_is_told_and_all_is_fresh_once_it_is_back(
    context: BrowserContext, twins: Twins, tmp_path: Path
) -> None:
    with serving(tmp_path / "data", "--site", str(twins.site)) as served:
        page = served.open(served.let_in(context), "?events=open")
        card = page.get_by_test_id("blade-1")
        battery = card.get_by_test_id("reading-3060")
        expect(battery).to_have_attribute("data-stale", "false", timeout=WAIT_MS)

        twins.process.popen.kill()
        expect(page.get_by_test_id("bus")).to_contain_text("Bus lost")
        expect(page.get_by_test_id("mode")).to_have_attribute("data-mode", "none")
        expect(events(page).get_by_text(re.compile("Connection to can0 lost")).first).to_be_visible()
        expect(page.get_by_test_id("attention")).to_contain_text("The bus is lost")
        expect(card).to_have_attribute("data-stale", "true")
        expect(battery).to_have_attribute("data-stale", "true")
        expect(battery).to_contain_text(re.compile(r"\d+ V\s*\d+ s"))

        with running("twin", "oat", "--can", twins.address, "--state", str(twins.state), "--json") as again:
            again.wait_for('"address"')
            expect(page.get_by_test_id("bus")).to_contain_text(re.compile(r"Bus\s+\d+ %"), timeout=WAIT_MS)
            expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
            expect(events(page).get_by_text(re.compile("Connection to can0 is back")).first).to_be_visible()
            expect(card).to_have_attribute("data-stale", "false", timeout=WAIT_MS)
            expect(battery).to_have_attribute("data-stale", "false", timeout=WAIT_MS)
            expect(angle(page, 1)).to_contain_text("80.00°")


# -- people ------------------------------------------------------------------------------


def sign_in(served: Served, context: BrowserContext, person: tuple[str, str], path: str) -> Page:
    page = served.open(context, path)
    page.get_by_test_id("login-name").fill(person[0])
    page.get_by_test_id("login-password").fill(person[1])
    page.get_by_test_id("login-submit").click()
    return page


def test_what_one_writes_another_sees_with_the_name_and_a_refusal_leaves_the_value(
    browser: Browser, context: BrowserContext, twins: Twins, tmp_path: Path
) -> None:
    data = tmp_path / "data"
    for name, password in (ANNA, BEN):
        command = [*HUBSIDE, "--data", str(data), "users", "add", name, "--role", "expert"]
        subprocess.run(command, input=f"{password}\n", check=True, capture_output=True, text=True, cwd=ROOT, timeout=60)
    where = "parameters?device=wtg-07/blade-1/pmm&events=open"
    other = browser.new_context(viewport=SIZE, locale="en-GB")
    with serving(data, "--site", str(twins.site)) as served:
        ben = sign_in(served, other, BEN, f"{where}&q=3110:01")
        expect(ben.get_by_test_id("value-3110:01")).to_contain_text("50.0", timeout=WAIT_MS)
        anna = sign_in(served, context, ANNA, f"{where}&q=3110:01&edit=3110:01")
        expect(anna.get_by_test_id("new-value")).to_have_value("50.0", timeout=WAIT_MS)
        anna.get_by_test_id("new-value").fill("48.5")
        anna.get_by_test_id("stage").click()
        anna.get_by_test_id("review").click()
        anna.get_by_test_id("save-after-wtg-07/blade-1/pmm").uncheck()
        hold(anna, "write-hold", anna.get_by_test_id("write-verified"))
        anna.get_by_test_id("review-close").click()
        expect(ben.get_by_test_id("value-3110:01")).to_contain_text("48.5")
        told = events(ben).get_by_text(re.compile(r"3110:01 .*50\.0.*48\.5.* · Anna"))
        expect(told.first).to_be_visible()

        refused(anna, served)
    other.close()


def refused(page: Page, served: Served) -> None:
    """The twin charges lithium batteries only: it aborts a type that the manual lists all the same."""
    page.goto(f"{served.home}parameters?device=wtg-07/blade-1/pmm&q=3020:01&edit=3020:01&scene=off")
    value = page.get_by_test_id("value-3020:01")
    expect(value).to_contain_text("Lithium-ion", timeout=WAIT_MS)
    page.get_by_test_id("new-value").click()
    page.get_by_role("option", name=re.compile("AGM")).click()
    page.get_by_test_id("stage").click()
    page.get_by_test_id("review").click()
    hold(page, "write-hold", page.get_by_test_id("write-incomplete"))
    row = page.get_by_test_id("progress-wtg-07/blade-1/pmm-3020:01")
    expect(row).to_have_attribute("data-state", "refused")
    expect(row).to_contain_text("kept its old value")
    row.get_by_text("Details").click()
    expect(row).to_contain_text("06090030h")
    expect(row).to_contain_text("Ready to switch on")
    page.get_by_test_id("review-close").click()
    expect(value).to_contain_text("✕")
    page.get_by_test_id("unstage").click()
    expect(value).to_contain_text("Lithium-ion")
    expect(value).not_to_contain_text("AGM")


# -- no turbine --------------------------------------------------------------------------


def test_a_turbine_is_left_and_taken_up_again_and_every_room_says_so(
    context: BrowserContext, twins: Twins, tmp_path: Path
) -> None:
    with serving(tmp_path / "data", "--site", str(twins.site)) as served:
        page = served.open(served.let_in(context), "parameters?device=wtg-07/blade-2/pmm&q=3110:01&view=side")
        expect(page.get_by_test_id("value-wtg-07/blade-2/pmm-3110:01")).to_contain_text("50.0", timeout=WAIT_MS)
        expect(page).to_have_title("Parameters · WTG-07 · Hubside")
        page.get_by_test_id("connect-menu").click()
        page.get_by_test_id("disconnect").click()
        expect(page.get_by_test_id("unconnected")).to_be_visible()
        expect(page).to_have_title("Parameters · Hubside")
        expect(page.get_by_test_id("stop")).to_be_disabled()
        expect(page.get_by_test_id("feather")).to_be_disabled()
        expect(page.get_by_test_id("turbine")).to_have_text("No turbine")
        every_room_leads_on(page)

        page.get_by_role("navigation", name="Rooms").get_by_role("link", name="Axis").click()
        expect(page).to_have_url(re.compile(r"/axis\?(?=.*device=)(?!.*(q=|view=|edit=))"))
        page.get_by_test_id("unconnected-wtg-07").click()
        expect(page.get_by_test_id("axis-angle")).to_have_text("80.00°", timeout=WAIT_MS)
        expect(page.get_by_test_id("stop")).to_be_enabled()
        page.get_by_test_id("connect-menu").click()
        page.get_by_test_id("disconnect").click()
        expect(page.get_by_test_id("unconnected")).to_be_visible()
        page.get_by_test_id("connect-menu").click()
        page.get_by_test_id("connect-wtg-07").click()
        expect(page.get_by_test_id("axis-angle")).to_have_text("80.00°", timeout=WAIT_MS)


def every_room_leads_on(page: Page) -> None:
    """No room shows an error; each that needs a turbine says so and what to do."""
    for room in ROOMS:
        name = {"": "Overview"}.get(room, room.capitalize())
        page.get_by_role("navigation", name="Rooms").get_by_role("link", name=name).click()
        expect(page).to_have_title(f"{name} · Hubside")
        shown = 1 if room in NEEDS_TURBINE else 0
        expect(page.get_by_test_id("unconnected")).to_have_count(shown)
        expect(page.locator("main")).to_contain_text(re.compile(r"\w"))
        expect(page.get_by_test_id("problem")).to_have_count(0)
        if shown:
            expect(page.get_by_test_id("unconnected-settings")).to_have_attribute(
                "href", re.compile(r"^/settings\?.*section=turbines")
            )


def test_an_empty_bench_opens_every_room_and_leads_to_the_settings(context: BrowserContext, tmp_path: Path) -> None:
    with serving(tmp_path / "data") as served:
        page = served.open(served.let_in(context))
        answers: list[str] = []
        page.on("response", lambda answer: answers.append(f"{answer.status} {answer.url}"))
        expect(page.get_by_test_id("unconnected")).to_contain_text("No turbine is known yet")
        every_room_leads_on(page)
        for tab in ("ids", "nodes", "sdo", "emcy", "load"):
            page.goto(f"{served.home}bus?scene=off&tab={tab}")
            expect(page.get_by_test_id("unconnected")).to_be_visible()
        page.get_by_test_id("unconnected-settings").click()
        expect(page.get_by_test_id("add-turbine")).to_be_visible()
        assert [answer for answer in answers if not answer.startswith(("200", "304"))] == []
