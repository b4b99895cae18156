"""The instructor's room in a real browser on a real demo: faults go in, show where they act, and come out again."""

from __future__ import annotations

import json
import os
import re
import signal
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, expect

from tests.e2e.conftest import Twins
from tests.e2e.processes import Process, running
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
WAIT_MS = 30_000
START_S = 90.0
expect.set_options(timeout=20_000)


@dataclass(frozen=True)
class Demo:
    """A running demo with a browser profile that is let in."""

    home: str
    context: BrowserContext
    process: Process

    def open(self, path: str = "instructor") -> Page:
        """A tab, without the 3D view: software rendering would hold up everything else."""
        page = self.context.new_page()
        page.goto(f"{self.home}{path}{'&' if '?' in path else '?'}scene=off")
        return page

    def status(self, method: str, path: str, body: object = None) -> tuple[int, dict[str, object]]:
        """What the API answers to this browser's session."""
        answer = self.context.request.fetch(f"{self.home}api/instructor{path}", method=method, data=body)
        return answer.status, answer.json()


def let_in(browser: Browser, process: Process, ready: str) -> Demo:
    """The server's page, opened by the address that it prints."""
    url = json.loads(process.wait_for('"url"', START_S))["url"]
    context = browser.new_context(
        viewport={"width": 1366, "height": 768},
        color_scheme="dark",
        locale="en-GB",
        reduced_motion="reduce",
        bypass_csp=True,  # axe is put into the page
    )
    context.set_default_timeout(WAIT_MS)
    first = context.new_page()
    first.goto(f"{url}&scene=off")
    expect(first.get_by_test_id(ready)).to_be_visible(timeout=WAIT_MS)
    first.close()
    return Demo(url.split("?")[0], context, process)


@pytest.fixture(scope="module")
def started(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    with running("demo", "--port", "0", "--data", str(tmp_path_factory.mktemp("data")), "--json") as process:
        demo = let_in(browser, process, "blade-1")
        yield demo
        demo.context.close()


@pytest.fixture
def demo(started: Demo) -> Iterator[Demo]:
    """The demo with healthy twins, before and after."""
    yield started
    for page in started.context.pages:
        page.close()
    assert started.status("POST", "/stop", {})[0] == 200
    assert started.status("DELETE", "/faults")[0] == 200


def row(page: Page, kind: str) -> Locator:
    """The line of a fault that acts."""
    return page.get_by_test_id(f"fault-{kind}")


def test_a_mains_failure_of_one_blade_shows_in_the_overview_and_goes(demo: Demo) -> None:
    page = demo.open("instructor?blade=2")
    expect(page.get_by_test_id("no-fault")).to_contain_text("the twins are healthy")
    expect(page.get_by_test_id("injected")).to_have_count(0)
    page.get_by_test_id("kind-mains_failure").click()
    page.get_by_test_id("inject").click()
    expect(page.get_by_test_id("injected-told")).to_contain_text("Injected: Mains failure, Blade 2")
    expect(row(page, "mains_failure")).to_contain_text("Blade 2")
    expect(row(page, "mains_failure")).to_contain_text("until cleared")

    page.get_by_role("navigation", name="Rooms").get_by_role("link", name="Overview").click()
    expect(page.get_by_test_id("injected")).to_contain_text("1 fault injected")
    card = page.get_by_test_id("blade-2")
    expect(card.get_by_test_id("reading-3062")).to_have_text("0 V")
    expect(card).to_contain_text("3120h")
    # The capacitors run down to where the booster holds them; the hold-up timer runs out: all blades feather.
    expect(card.get_by_test_id("reading-3063")).to_have_text("600 V", timeout=WAIT_MS)
    for blade in (1, 2, 3):
        expect(page.get_by_test_id(f"blade-{blade}").get_by_test_id("angle")).to_contain_text(
            re.compile(r"^9\d\."), timeout=WAIT_MS
        )
        expect(page.get_by_test_id(f"blade-{blade}").get_by_test_id("efc-chain")).to_have_attribute(
            "data-state", "open"
        )
    expect(page.get_by_test_id("blade-1").get_by_test_id("reading-3062")).not_to_have_text("0 V")
    expect(page.get_by_test_id("events-toggle")).to_contain_text(re.compile(r"Events \(\d+\)"))

    page.get_by_test_id("injected").click()
    row(page, "mains_failure").get_by_role("button", name="Clear: Mains failure, Blade 2").click()
    expect(page.get_by_test_id("no-fault")).to_be_visible()
    page.get_by_role("navigation", name="Rooms").get_by_role("link", name="Overview").click()
    expect(card.get_by_test_id("reading-3062")).to_have_text(re.compile(r"^[34]\d\d V$"))
    expect(card).not_to_contain_text("3120h", timeout=WAIT_MS)
    expect(page.get_by_test_id("injected")).to_have_count(0)
    page.get_by_test_id("events-toggle").click()
    page.get_by_test_id("event-filter").fill("mains failure")
    expect(page.get_by_text(re.compile("Fault cleared: Mains failure, blade 2"))).to_be_visible()
    expect(page.get_by_text(re.compile("Fault injected: Mains failure, blade 2"))).to_be_visible()


def test_a_value_out_of_range_is_refused_with_the_limits(demo: Demo) -> None:
    page = demo.open("instructor?kind=mains_failure")
    value = page.get_by_test_id("value-remaining_percent")
    value.fill("300")
    expect(page.get_by_text("Allowed: 0 … 130 %")).to_be_visible()
    expect(page.get_by_test_id("inject")).to_be_disabled()
    value.press("Enter")
    value.fill("a lot")
    expect(page.get_by_text("This is no number.")).to_be_visible()
    expect(page.get_by_test_id("inject")).to_be_disabled()
    value.fill("50,5")
    expect(page.get_by_test_id("inject")).to_be_enabled()
    expect(page).to_have_url(re.compile(r"set=remaining_percent:50,5"))
    expect(page.get_by_test_id("no-fault")).to_be_visible()
    order = {"kind": "mains_failure", "values": {"remaining_percent": 300}}
    status, problem = demo.status("POST", "/faults", order)
    assert (status, problem["code"]) == (422, "fault_value")
    assert "0 … 130 %" in str(problem["text"])


def test_a_refusal_of_the_twins_stands_in_the_form(demo: Demo) -> None:
    page = demo.open("instructor?kind=brake_stuck&blade=1")
    expect(page.get_by_test_id("inject")).to_be_enabled()
    for _ in range(64):  # as many as act at a time
        assert demo.status("POST", "/faults", {"kind": "frames_lost", "values": {"percent": 0.1}})[0] == 201
    expect(page.get_by_test_id("injected")).to_contain_text("64 faults injected")
    page.get_by_test_id("inject").click()
    problem = page.get_by_test_id("problem")
    expect(problem).to_contain_text("Brake stuck was not injected")
    expect(problem).to_contain_text("64 faults act already")
    expect(problem).to_contain_text("Nothing was changed")
    page.get_by_test_id("clear-all").click()
    expect(page.get_by_test_id("no-fault")).to_be_visible()


def test_two_pages_agree_on_what_acts(demo: Demo) -> None:
    first, second = demo.open("instructor?kind=node_gone&node=12"), demo.open("axis?lang=de&blade=2")
    expect(first.get_by_test_id("target")).to_have_value("Blade 2 PMC (node 12)")
    first.get_by_test_id("value-for").fill("600")
    first.get_by_test_id("inject").click()
    expect(row(first, "node_gone")).to_contain_text("Blade 2 PMC")
    expect(row(first, "node_gone")).to_contain_text("left")
    expect(second.get_by_test_id("injected")).to_contain_text("1 Fehler eingebracht")
    second.get_by_test_id("injected").click()
    expect(row(second, "node_gone")).to_contain_text("Blatt 2 PMC")
    second.get_by_role("button", name="Aufheben: Knoten weg, Blatt 2 PMC").click()
    expect(first.get_by_test_id("no-fault")).to_be_visible()


def test_a_momentary_fault_says_so_and_ends_by_itself(demo: Demo) -> None:
    page = demo.open("instructor?kind=power_cut&device=wtg-07/blade-3/pmm&set=off_s:3")
    expect(page.get_by_test_id("target")).to_have_value("Blade 3 PMM (node 3)")
    expect(page.get_by_test_id("momentary")).to_contain_text("ends by itself")
    expect(page.get_by_test_id("value-for")).to_have_count(0)
    page.get_by_test_id("inject").click()
    expect(row(page, "power_cut")).to_contain_text("left")
    expect(page.get_by_test_id("no-fault")).to_be_visible()


def test_the_filter_is_instant_and_lives_in_the_url(demo: Demo) -> None:
    page = demo.open()
    expect(page.get_by_test_id("kind-second_master")).to_be_visible()
    page.get_by_test_id("find-fault").fill("encoder blade")
    kinds = page.locator("[data-kind][data-testid^=kind-]")
    expect(kinds).to_have_text(["Blade encoder slips", "Blade encoder failed"])
    expect(page).to_have_url(re.compile("find=encoder"))
    page.get_by_test_id("find-fault").fill("no such thing")
    expect(page.get_by_text("No fault fits.")).to_be_visible()
    page.get_by_role("button", name="Clear the filter").click()
    expect(page.get_by_test_id("kind-mains_failure")).to_be_visible()


def test_by_keyboard_alone_a_fault_goes_in_and_out(demo: Demo) -> None:
    page = demo.open("instructor?lang=de")
    expect(page.get_by_test_id("kind-mains_failure")).to_be_visible()
    tab_to(page, "[data-testid=find-fault]")
    page.keyboard.type("Bremse")
    expect(page.locator("[data-kind][data-testid^=kind-]")).to_have_count(1)
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("fault-form")).to_have_attribute("data-kind", "brake_stuck")
    tab_to(page, "[data-testid=value-for]")
    page.keyboard.type("60")
    page.keyboard.press("Enter")
    expect(row(page, "brake_stuck")).to_contain_text("Bremse klemmt")
    expect(page.get_by_test_id("injected-told")).to_contain_text("Eingebracht: Bremse klemmt, Blatt 1")
    tab_to(page, "[data-testid=fault-brake_stuck] button")
    outline = page.evaluate("() => getComputedStyle(document.activeElement).outlineStyle")
    assert outline != "none", "nobody sees where the focus is"
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("no-fault")).to_contain_text("Kein Fehler wirkt")


def tab_to(page: Page, selector: str) -> None:
    """Press Tab until the focus stands on what ``selector`` names."""
    for _ in range(90):
        page.keyboard.press("Tab")
        if page.evaluate("(selector) => document.activeElement.matches(selector)", selector):
            return
    raise AssertionError(f"Tab never came to {selector}")


def test_a_scenario_is_played_with_its_progress_and_stopped(demo: Demo) -> None:
    page, other = demo.open("instructor?tab=scenarios"), demo.open("bus")
    play = page.get_by_test_id("play")
    expect(play).to_be_enabled()
    title = page.get_by_test_id("scenario").get_by_role("heading").inner_text()
    play.click()
    expect(page.get_by_test_id("playing")).to_contain_text(f"Plays: {title}")
    expect(page.get_by_test_id("playing")).to_contain_text(re.compile(r"00:00:0[1-9] / 00:0"))
    expect(other.get_by_test_id("injected")).to_contain_text("Scenario plays")
    expect(play).to_be_disabled()
    page.get_by_test_id("stop-scenario").click()
    expect(page.get_by_test_id("playing")).to_have_count(0)
    expect(other.get_by_test_id("injected")).to_have_count(0)
    expect(play).to_be_enabled()


def test_stop_and_feather_keep_their_place_beside_the_mark(demo: Demo) -> None:
    assert demo.status("POST", "/faults", {"kind": "phase_loss"})[0] == 201
    for language in ("de", "en"):
        page = demo.open(f"?lang={language}")
        expect(page.get_by_test_id("injected")).to_be_visible()
        expect(page.get_by_test_id("recording")).to_be_attached()
        for facts in ("as they are", "an hour of two full buses"):
            if facts != "as they are":  # digits come and go with the traffic; the longest there can be must not matter
                page.locator("[data-testid=bus] strong, [data-testid=recording] strong").evaluate_all(
                    "found => found.forEach(one => one.append(' 1.234.567,8 MB · 98.765 Frames/s'))"
                )
            for width, height in ((1920, 1080), (1366, 768), (1341, 768), (1241, 768), (1024, 768), (820, 1180)):
                page.set_viewport_size({"width": width, "height": height})
                for name in ("stop", "feather", "injected"):
                    box = page.get_by_test_id(name).bounding_box()
                    assert box is not None
                    assert box["x"] >= 0 and box["x"] + box["width"] <= width, (language, facts, width, name)
                    assert box["height"] >= 40
        page.close()


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_serious(demo: Demo, theme: str) -> None:
    assert demo.status("POST", "/faults", {"kind": "bloc_weak", "blade": 3})[0] == 201
    found: list[str] = []
    for place in ("kind=over_temperature", "kind=second_master&set=raw:x", "kind=brake_stuck", "tab=scenarios"):
        page = demo.open(f"instructor?theme={theme}&{place}")
        expect(row(page, "bloc_weak")).to_be_visible()
        expect(page.get_by_test_id("inject").or_(page.get_by_test_id("play"))).to_be_visible()
        page.add_script_tag(path=AXE)
        result = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
        assert result["passes"], "axe has looked at something"
        found += [
            f"{place} {one['impact']} {one['id']}: {node['target']} {node['html'][:160]}"
            for one in result["violations"]
            if one["impact"] in ("serious", "critical")
            for node in one["nodes"][:3]
        ]
        page.close()
    assert found == [], "\n".join(found)


def test_twins_that_others_started_have_no_such_room(browser: Browser, twins: Twins, tmp_path: Path) -> None:
    data = ("--data", str(tmp_path / "data"))
    with running("serve", *data, "--port", "0", "--site", str(twins.site), "--no-record", "--json") as process:
        served = let_in(browser, process, "blade-1")
        page = served.open("")
        expect(page.get_by_test_id("mode")).to_contain_text("TWIN")
        expect(page.get_by_role("navigation", name="Rooms").get_by_role("link", name="Settings")).to_be_visible()
        expect(page.get_by_role("navigation", name="Rooms").get_by_role("link", name="Instructor")).to_have_count(0)
        page.goto(f"{served.home}instructor?scene=off")
        expect(page.get_by_test_id("not-ours")).to_contain_text("hubside demo")
        expect(page.get_by_test_id("inject")).to_have_count(0)
        for method, path in (("GET", ""), ("POST", "/faults"), ("DELETE", "/faults")):
            body = {"kind": "mains_failure"} if method == "POST" else None
            status, problem = served.status(method, path, body)
            assert (status, problem["code"]) == (409, "no_instructor")
        served.context.close()


def test_twins_that_end_are_told_as_such(browser: Browser, tmp_path: Path) -> None:
    with running("demo", "--port", "0", "--data", str(tmp_path), "--json") as process:
        demo = let_in(browser, process, "blade-1")
        page = demo.open("instructor?kind=phase_loss")
        expect(page.get_by_test_id("inject")).to_be_enabled()
        (twins,) = blades(process.popen.pid)
        os.kill(twins, signal.SIGKILL)
        expect(page.get_by_test_id("twins-silent")).to_contain_text("The twins do not answer")
        expect(page.get_by_test_id("inject")).to_be_disabled()
        demo.context.close()


def blades(pid: int) -> list[int]:
    """The processes with twins of blades that a demo has started; that of the servo drive is none."""
    tasks = Path(f"/proc/{pid}/task").iterdir()
    started = [int(child) for task in tasks for child in (task / "children").read_text().split()]
    return [child for child in started if b"\0oat\0" in Path(f"/proc/{child}/cmdline").read_bytes()]
