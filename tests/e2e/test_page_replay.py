"""A recording in every room of the page, in a real browser: opened, moved, shared, and never written through."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect

from tests.e2e.browser import answer_of
from tests.e2e.processes import ROOT, Process, running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

WAIT_MS: Final = 60_000
TRIP: Final = "3-following-error"
PMC_2: Final = "wtg-07/blade-2/pmc"
AXE: Final = ROOT / "frontend" / "node_modules" / "axe-core" / "axe.min.js"
SAMPLES: Final = sorted(path.stem for path in (ROOT / "recordings" / "scenarios").glob("[0-9]-*.mcap"))
S: Final = 1_000_000_000
CLOCK: Final = "Number(document.querySelector('[data-testid=replay-clock]')?.dataset.ns)"
expect.set_options(timeout=30_000)


@dataclass
class Home:
    """A served demo and a profile that is signed in."""

    process: Process
    address: str
    context: BrowserContext

    def open(self, path: str) -> Page:
        """A tab without the 3D view."""
        page = self.context.new_page()
        page.goto(f"{self.address}{path}{'&' if '?' in path else '?'}scene=off")
        return page

    def call(self, method: str, path: str, body: object = None, **headers: str) -> tuple[int, Any]:
        """Status and document of a request of the page's session."""
        answer = self.context.request.fetch(
            f"{self.address}api/{path}",
            method=method,
            data=json.dumps(body),
            headers={"content-type": "application/json", **headers},
        )
        return answer.status, answer.json()


@contextmanager
def serving(
    browser: Browser, data: Path, *, command: str = "demo", port: str = "0", context: BrowserContext | None = None
) -> Iterator[Home]:
    """``hubside demo``, or ``serve`` without any turbine; the session outlives it where a context is given."""
    with running(command, "--port", port, "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"', WAIT_MS / 1000))["url"]
        own = context or browser.new_context(
            viewport={"width": 1366, "height": 768},
            locale="en-GB",
            timezone_id="Europe/Berlin",
            reduced_motion="reduce",
            bypass_csp=True,
        )
        own.set_default_timeout(WAIT_MS)
        first = own.new_page()
        first.goto(f"{url}&scene=off")
        expect(first.get_by_test_id("mode")).to_contain_text("TWIN" if command == "demo" else "NOT", timeout=WAIT_MS)
        first.close()
        yield Home(process, url.split("?")[0], own)


@pytest.fixture(scope="module")
def home(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Home]:
    with serving(browser, tmp_path_factory.mktemp("data")) as served:
        yield served
        served.context.close()


@pytest.fixture(scope="module")
def start_ns(home: Home) -> int:
    """When the trip's recording begins."""
    return int(home.call("POST", "replay", {"recording": f"{TRIP}.mcap"})[1]["from_ns"])


@pytest.fixture
def pages(home: Home) -> Iterator[list[Page]]:
    """Tabs that are closed at the end; on none of them a script failed."""
    opened: list[Page] = []
    errors: list[str] = []
    home.context.on("weberror", lambda error: errors.append(str(error.error)))
    yield opened
    for page in opened:
        page.close()
    assert errors == []


def clock_ns(page: Page) -> int:
    """Where the page says the cursor is."""
    return int(page.get_by_test_id("replay-clock").get_attribute("data-ns") or 0)


def expect_at(page: Page, t_ns: int) -> None:
    """The page's clock stands there; a browser's numbers hold no single nanoseconds."""
    page.wait_for_function(
        f"(wanted) => Math.abs({CLOCK} - wanted) < 2000",
        arg=t_ns,
        timeout=WAIT_MS,
    )


def seek(home: Home, t_ns: int) -> None:
    """Move the cursor as another page would."""
    home.call("POST", f"replay/{TRIP}/cursor", {"action": "pause"})
    home.call("POST", f"replay/{TRIP}/cursor", {"action": "seek", "t_ns": t_ns})


def at_rest(place: Locator) -> str:
    """What it says once it says the same for some frames: the clock is drawn before the blades are."""
    says, same = "", 0
    while same < 20:
        place.page.evaluate("() => new Promise((drawn) => requestAnimationFrame(drawn))")
        before, says = says, place.text_content() or ""
        same = same + 1 if says == before else 0
    return says


def angle(page: Page, blade: int) -> Locator:
    return page.get_by_test_id(f"blade-{blade}").get_by_test_id("angle")


# -- opening --------------------------------------------------------------------------------


def test_each_sample_is_opened_from_the_list_and_the_frame_says_that_it_is_recorded(
    home: Home, pages: list[Page]
) -> None:
    assert len(SAMPLES) == 8
    page = home.open("recordings")
    pages.append(page)
    for sample in SAMPLES:
        row = page.get_by_test_id(f"row-{sample}.mcap")
        expect(row).to_contain_text("sample")
        row.get_by_test_id(f"replay-{sample}.mcap").click()
        expect(page).to_have_url(re.compile(f"replay={sample}"))
        badge = page.get_by_test_id("replay-badge")
        expect(badge).to_contain_text(re.compile(r"REPLAY\s*RECORDED\s*WTG-07 · 2026-03-02"))
        expect(page.get_by_test_id("replay-clock")).to_contain_text("2026-03-02 UTC+1")
        expect(page.get_by_test_id("mode")).to_contain_text("TWIN")
        expect(page.get_by_test_id("stop-on")).to_contain_text("WTG-07")
        expect(page.get_by_test_id("stop")).to_be_enabled()
        page.go_back()
        expect(badge).to_have_count(0)
        expect(page).not_to_have_url(re.compile("replay="))


def test_a_row_opens_by_enter_and_by_a_double_click_and_leaving_leads_back(home: Home, pages: list[Page]) -> None:
    page = home.open("recordings?find=following")
    pages.append(page)
    row = page.get_by_test_id(f"row-{TRIP}.mcap")
    row.focus()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(f"file={TRIP}.mcap"))
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("replay-badge")).to_be_visible()
    page.get_by_role("navigation", name="Rooms").get_by_role("link", name="Axis").click()
    expect(page).to_have_url(re.compile(f"/axis.*replay={TRIP}"))
    expect(page).to_have_title("Axis · REPLAY WTG-07 · Hubside")
    page.get_by_test_id("leave-replay").click()
    expect(page).to_have_url(re.compile("/recordings.*find=following"))
    expect(page.get_by_test_id("replay-badge")).to_have_count(0)
    row.dblclick()
    expect(page.get_by_test_id("replay-badge")).to_be_visible()


def test_what_cannot_be_replayed_says_why_and_what_next(home: Home, pages: list[Page]) -> None:
    page = home.open("recordings")
    pages.append(page)
    running_one = page.get_by_role("button", name=re.compile("Cannot be replayed: It is still being written"))
    expect(running_one).to_be_disabled()
    page.goto(f"{home.address}?scene=off&replay=none-of-this-name")
    failed = page.get_by_test_id("replay-failed")
    expect(failed).to_contain_text("none-of-this-name cannot be replayed")
    failed.get_by_role("button", name="Leave replay").click()
    expect(angle(page, 2)).to_contain_text("°")


# -- the cursor -----------------------------------------------------------------------------


def test_the_cursor_is_moved_by_timeline_and_keys_and_two_pages_see_the_same(
    home: Home, pages: list[Page], start_ns: int
) -> None:
    seek(home, start_ns)
    one, two = home.open(f"?replay={TRIP}"), home.open(f"axis?blade=2&replay={TRIP}")
    pages += [one, two]
    for page in pages:
        expect_at(page, start_ns)
    timeline = one.get_by_test_id("timeline")
    box = timeline.bounding_box()
    assert box is not None
    one.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(angle(one, 1)).to_contain_text(re.compile(r"\d°"))
    one.wait_for_function(
        "(from) => Number(document.querySelector('[data-testid=replay-clock]').dataset.ns) > from",
        arg=start_ns + 20 * S,
    )
    middle = clock_ns(one)
    assert abs(middle - start_ns - 30 * S) < S
    expect_at(two, middle)
    one.locator("main").click(position={"x": 3, "y": 3})
    one.keyboard.press("ArrowRight")
    expect_at(two, middle + S)
    one.keyboard.press("Shift+ArrowLeft")
    expect_at(two, middle + S - S // 10)
    one.keyboard.press("Home")
    expect_at(two, start_ns)
    one.keyboard.press(".")
    one.wait_for_function(
        "(from) => Number(document.querySelector('[data-testid=replay-clock]').dataset.ns) > from", arg=start_ns
    )
    assert clock_ns(one) < start_ns + S // 10
    timeline.focus()
    one.keyboard.press("PageUp")
    expect(timeline).to_have_attribute("aria-valuetext", re.compile(r"2026-03-02 10:00:1\d\.\d{3}"))
    one.keyboard.press("+")
    expect(one.get_by_test_id("zoom-out")).to_be_enabled()
    one.get_by_test_id("zoom-out").click()


def test_it_plays_at_a_speed_and_a_selected_stretch_is_looped(home: Home, pages: list[Page], start_ns: int) -> None:
    seek(home, start_ns + 10 * S)
    page = home.open(f"?replay={TRIP}")
    pages.append(page)
    expect_at(page, start_ns + 10 * S)
    page.get_by_test_id("loop").click()
    box = page.get_by_test_id("timeline").bounding_box()
    assert box is not None
    lane = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] * 0.5, lane)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.55, lane, steps=3)
    page.mouse.up()
    expect(page.get_by_test_id("loop")).to_have_attribute("aria-label", "End the loop")
    loop = home.call("GET", f"replay/{TRIP}")[1]["cursor"]["loop"]
    assert 2 * S < loop["to_ns"] - loop["from_ns"] < 4 * S
    page.get_by_test_id("speed").click()
    page.get_by_test_id("speed-10").click()
    expect(page.get_by_test_id("speed")).to_contain_text("10×")
    seek(home, loop["from_ns"])
    page.get_by_test_id("play").click()
    expect(page.get_by_test_id("play")).to_have_attribute("data-playing", "true")
    # Twice around takes less than a second at this speed.
    page.wait_for_function(
        """() => {
          const now = Number(document.querySelector('[data-testid=replay-clock]').dataset.ns);
          window.rounds = (window.rounds ?? 0) + (now < window.before ? 1 : 0);
          window.before = now;
          return window.rounds >= 2;
        }""",
        timeout=WAIT_MS,
    )
    page.locator("main").click(position={"x": 3, "y": 3})
    page.keyboard.press("Space")
    expect(page.get_by_test_id("play")).to_have_attribute("data-playing", "false")
    page.get_by_test_id("loop").click()
    expect(page.get_by_test_id("loop")).to_have_attribute("aria-pressed", "false")
    home.call("POST", f"replay/{TRIP}/cursor", {"action": "speed", "speed": 1})


def test_a_link_and_a_reload_come_back_to_the_same_moment(home: Home, pages: list[Page], start_ns: int) -> None:
    at = start_ns + 27 * S
    page = home.open(f"parameters?device={PMC_2}&replay={TRIP}&at={at}")
    pages.append(page)
    expect_at(page, at)
    page.get_by_test_id("step-time-on").click()
    expect_at(page, at + S)
    expect(page).to_have_url(re.compile(r"at=\d+"))
    page.wait_for_function("(before) => !location.search.includes(before)", arg=f"at={at}")
    link = page.url
    page.reload()
    expect_at(page, at + S)
    # Others look now: theirs is not moved unasked.
    other = home.open(f"?replay={TRIP}&at={start_ns + 5 * S}")
    pages.append(other)
    expect(other.get_by_test_id("moment-offer")).to_contain_text("10:00:05.000")
    expect_at(other, at + S)
    other.get_by_test_id("take-moment").click()
    expect_at(page, start_ns + 5 * S)
    page.close()
    other.close()
    pages.clear()
    again = home.open(link.removeprefix(home.address))
    pages.append(again)
    expect_at(again, at + S)


# -- the rooms ------------------------------------------------------------------------------


def test_every_room_shows_what_was_recorded_and_nothing_can_be_written(
    home: Home, pages: list[Page], start_ns: int
) -> None:
    seek(home, start_ns + 27 * S)
    page = home.open(f"?replay={TRIP}")
    pages.append(page)
    rooms = page.get_by_role("navigation", name="Rooms")
    expect(page.get_by_test_id("blade-2").get_by_test_id("fault")).to_contain_text("8611h")
    expect(page.get_by_test_id("attention")).not_to_contain_text("Nothing is being recorded")
    expect(page.get_by_test_id("since-last-visit")).to_have_count(0)
    recorded = angle(page, 2).text_content() or ""
    rooms.get_by_role("link", name="Axis").click()
    page.get_by_test_id("choose-blade").get_by_text("Blade 2").click()
    expect(page.get_by_test_id("axis-angle")).to_have_text(recorded)
    rooms.get_by_role("link", name="Bus").click()
    expect(page.get_by_test_id("trace-row").first).to_be_visible()
    page.get_by_test_id("tab-emcy").click()
    expect(page.get_by_test_id("table-emcy")).to_contain_text("8611h")

    page.goto(f"{home.address}parameters?device={PMC_2}&edit=6065&scene=off&replay={TRIP}")
    expect(page.get_by_test_id("replay-lock")).to_contain_text("locked")
    for button in ("read-all", "save", "restart"):
        expect(page.get_by_test_id(button)).to_be_disabled()
    expect(page.get_by_test_id("locked")).to_contain_text("This is a recording")
    expect(page.get_by_test_id("stage")).to_have_count(0)
    refused = page.evaluate(
        """async () => {
          const answer = await fetch('/api/live/devices/wtg-07/blade-2/pmc/save', {method: 'POST', body: '{}',
            headers: {'content-type': 'application/json', 'x-hubside-context': 'replay/x'}});
          return [answer.status, (await answer.json()).code];
        }"""
    )
    assert refused == [409, "replay_only"]

    rooms.get_by_role("link", name="Sets").click()
    expect(page.get_by_test_id("live-room")).to_contain_text("WTG-07 as it is now")
    expect(page.get_by_test_id("back-up").first).to_be_disabled()
    page.goto(f"{home.address}settings?section=polling&scene=off&replay={TRIP}")
    expect(page.locator("[data-locked=replay]").get_by_test_id("save-polling")).to_be_disabled()
    page.goto(f"{home.address}instructor?tab=scenarios&scene=off&replay={TRIP}")
    page.get_by_test_id(f"scenario-{TRIP}").click()
    expect(page.locator("[data-locked=replay]").get_by_test_id("play")).to_be_disabled()


def test_the_3d_view_is_that_of_the_recording(home: Home, pages: list[Page], start_ns: int) -> None:
    seek(home, start_ns + 40 * S)
    page = home.context.new_page()
    pages.append(page)
    with page.expect_websocket(lambda socket: socket.url.endswith(f"/viser/replay/{TRIP}")) as opened:
        page.goto(f"{home.address}axis?blade=2&replay={TRIP}")
        expect(page.get_by_test_id("axis-angle")).to_have_text(re.compile(r"^8\d\.\d\d°"))
    with opened.value.expect_event("framereceived"):
        expect(page.get_by_test_id("scene-label-2")).to_have_count(1)
    expect(page.get_by_test_id("scene-label-2")).to_contain_text(
        page.get_by_test_id("axis-angle").text_content() or "–"
    )


def test_it_is_german_and_axe_has_no_complaints(home: Home, pages: list[Page], start_ns: int) -> None:
    seek(home, start_ns + 27 * S)
    page = home.open(f"?replay={TRIP}&lang=de&theme=light")
    pages.append(page)
    expect(page.get_by_test_id("replay-badge")).to_contain_text("AUFGEZEICHNET")
    expect(page.get_by_role("button", name="Wiedergabe verlassen")).to_be_visible()
    expect(page.get_by_test_id("timeline")).to_have_attribute("data-ready", "true", timeout=WAIT_MS)
    page.get_by_test_id("replay-help").click()
    expect(page.get_by_test_id("replay-keys")).to_contain_text("Leertaste")
    page.get_by_test_id("replay-help").click()
    expect(page.get_by_test_id("replay-keys")).to_have_count(0)
    page.add_script_tag(path=str(AXE))
    for theme in ("light", "dark"):
        if theme == "dark":
            page.get_by_test_id("theme").click()
            expect(page.locator("html")).to_have_attribute("data-mantine-color-scheme", "dark")
        result = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
        assert result["passes"], "axe has looked at something"
        found = [
            f"{one['id']}: {node['target']} {node['html'][:160]}"
            for one in result["violations"]
            if one["impact"] in ("serious", "critical")
            for node in one["nodes"][:3]
        ]
        assert found == [], theme


# -- the server -----------------------------------------------------------------------------


def test_after_a_restart_of_the_server_it_is_open_again_at_the_same_moment(browser: Browser, tmp_path: Path) -> None:
    """Without any turbine: what was recorded needs none, and STOP has nothing to act on."""
    with serving(browser, tmp_path, command="serve") as first:
        start = int(first.call("POST", "replay", {"recording": f"{TRIP}.mcap"})[1]["from_ns"])
        page = first.open(f"?replay={TRIP}")
        seek(first, start + 33 * S)
        expect_at(page, start + 33 * S)
        expect(angle(page, 2)).to_contain_text("°")
        expect(page.get_by_test_id("stop-on")).to_have_text("No turbine is connected")
        expect(page.get_by_test_id("stop")).to_be_disabled()
        shown = at_rest(angle(page, 2))
        first.process.popen.kill()
        expect(page.get_by_test_id("deaf")).to_be_visible()
    port = first.address.rsplit(":", 1)[1].strip("/")
    with serving(browser, tmp_path, command="serve", port=port, context=first.context) as second:
        expect(page.get_by_test_id("deaf")).to_be_hidden(timeout=WAIT_MS)
        answer_of(
            page,
            """(wanted) => fetch('/api/replay').then((answer) => answer.json()).then(
              (all) => all.length === 1 && Math.abs(all[0].cursor.t_ns - wanted) < 2000)""",
            start + 33 * S,
            WAIT_MS,
        )
        expect_at(page, start + 33 * S)
        expect(angle(page, 2)).to_have_text(shown)
        page.get_by_test_id("step-time-on").click()
        expect_at(page, start + 34 * S)
        second.context.close()
