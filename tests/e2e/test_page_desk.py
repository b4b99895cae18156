"""The desk of a replay in a real browser: trips by the event key, first-out words, values at the cursor, signals, sets.

What the page shows at a moment is held against the decoder, fed with the same file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from itertools import chain
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Locator, Page, expect

from app.model.address import Address
from app.model.description_file import load_builtin
from app.recording.reader import open_recording
from app.wire.decoder import CanOpenDecoder
from app.wire.records import ValueSeen
from tests.e2e.processes import ROOT
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
expect.set_options(timeout=30_000)

SCENARIOS = ROOT / "recordings" / "scenarios"
S = 1_000_000_000
TRUTH = {
    "2-mains-failure": "Safety chain opened, 3003 ms after mains failure",
    "3-following-error": "Blade 2 PMC: following error too large (8611h)",
    "4-blade-encoder-slip": "Blade 3 PMC: motor encoder and blade encoder differ too much (8620h)",
    "5-bloc-ageing": "Blade 1 PMM: battery voltage too low (3280h), 943 ms after mains failure",
    "6-node-drops-out": "1027 ms after blade 3 PMC: the unit is silent",
    "7-service-visit": "Safety chain opened, 10 ms after blade 2 PMC: NMT command: Reset node",
    "8-foreign-master": "Safety chain opened, 625 ms after blade 3 PMC: NMT command: Enter pre-operational",
}
"""Of each sample the trip in words, as its script makes it happen; the first has none."""
SHOWN = (
    *((f"blade-{n}/pmc/6064", 10 + n, Address(0x6064), 100, 2) for n in (1, 2, 3)),
    *((f"blade-{n}/pmm/3063", n, Address(0x3063), 1, 0) for n in (1, 2, 3)),
    *((f"blade-{n}/pmc/60F4", 10 + n, Address(0x60F4), 100, 2) for n in (1, 2, 3)),
)
"""Line of a legend, node, object, raw steps of a unit, decimals."""


@pytest.fixture
def opened(page: Page, demo: str) -> Iterator[Any]:
    """Opens a recording on the desk."""

    def desk(name: str, at_s: float | None = None, **search: str) -> Page:
        search = {"scene": "off", "replay": name, **search}
        if at_s is not None:
            search["at"] = str(begin(name) + round(at_s * S))
        page.goto(f"{demo.split('?')[0]}recordings?" + "&".join(f"{key}={text}" for key, text in search.items()))
        expect(page.get_by_test_id("desk")).to_be_visible()
        expect(page.get_by_test_id("plots")).to_be_visible()
        return page

    yield desk


@cache
def begin(name: str) -> int:
    with open_recording(SCENARIOS / f"{name}.mcap") as recording:
        span = recording.span_ns
    assert span is not None
    return span[0]


def decoded(name: str, t_ns: int) -> dict[tuple[int, Address], int]:
    """The last raw value of every object in the two seconds until a time, as the decoder says.

    It has to see how the PDOs are set up in the first seconds; what lies between is left out, for the sake of time.
    """
    known = {node: load_builtin("oat-pmm" if node < 10 else "oat-pmc") for node in (1, 2, 3, 11, 12, 13)}
    decoder = CanOpenDecoder("can0", known)
    found: dict[tuple[int, Address], int] = {}
    with open_recording(SCENARIOS / f"{name}.mcap") as recording:
        set_up = recording.frames(None, begin(name) + 3 * S)
        for frame in chain(set_up, recording.frames(t_ns - 2 * S, t_ns + 1)):
            for record in decoder.feed(frame):
                if isinstance(record, ValueSeen):
                    found[record.node, record.address] = int.from_bytes(record.data, "little", signed=True)
    return found


def cursor_ns(page: Page) -> int:
    """Where the cursor stands, by the address of the page."""
    expect(page).to_have_url(re.compile(r"[?&]at=\d+"))
    return int(parse_qs(urlsplit(page.url).query)["at"][0])


def value_of(page: Page, signal: str) -> Locator:
    return page.get_by_test_id(f"line-{signal}").get_by_test_id("at-cursor").first


@pytest.mark.parametrize("name", TRUTH)
def test_the_event_key_leads_to_the_trip_and_what_is_shown_there_is_what_the_decoder_says(
    opened: Any, name: str
) -> None:
    page = opened(name)
    headline = page.get_by_test_id("headline").first
    expect(headline).to_contain_text(TRUTH[name])
    t0_ns = t0_of(page, name)
    at = begin(name)
    while at < t0_ns:
        at = next_event(page, at)
    assert at == t0_ns
    assert_shown_as_decoded(page, name, at)


def test_in_normal_operation_no_trip_is_found_and_the_event_key_leads_nowhere(opened: Any) -> None:
    name = "1-normal-operation"
    page = opened(name, 46.0)
    expect(page.get_by_text("No trip in this recording").first).to_be_visible()
    at = cursor_ns(page)
    assert_shown_as_decoded(page, name, at)
    page.get_by_test_id("key-after").click()
    page.wait_for_timeout(1000)
    assert cursor_ns(page) == at


def next_event(page: Page, at: int) -> int:
    """Where the event key leads from the cursor, which is later."""
    page.get_by_test_id("key-after").click()
    page.wait_for_function("before => !location.search.includes('at=' + before)", arg=str(at))
    found = cursor_ns(page)
    assert found > at
    return found


def assert_shown_as_decoded(page: Page, name: str, t_ns: int) -> None:
    truth = decoded(name, t_ns)
    for signal, node, address, steps, decimals in SHOWN:
        expect(value_of(page, signal)).to_have_text(f"{truth[node, address] / steps:.{decimals}f}".replace("-", "−"))


def t0_of(page: Page, name: str) -> int:
    answer = page.request.get(f"{page.url.split('/recordings')[0]}/api/recordings/{name}.mcap/trips")
    trip: int = answer.json()["trips"][0]["t0_ns"]
    return trip


def test_a_signal_is_dragged_into_a_plot_and_the_view_is_kept_under_a_name(opened: Any) -> None:
    page = opened("3-following-error", 26.5, tab="signals")
    page.get_by_test_id("signal-filter").fill("blade 2 pmc 606C")
    expect(page.get_by_test_id("signal-count")).to_contain_text("1 of")
    signal = page.get_by_test_id("signal-blade-2/pmc/606C")
    signal.drag_to(page.get_by_test_id("plot-1").locator("[data-plot]"))
    expect(page.get_by_test_id("plot-1").get_by_test_id("line-blade-2/pmc/606C")).to_be_visible()
    expect(signal).to_have_attribute("aria-selected", "true")
    truth = decoded("3-following-error", cursor_ns(page))[12, Address(0x606C)]
    expect(value_of(page, "blade-2/pmc/606C")).to_have_text(re.compile(r"[−\d.]+"))
    assert value_of(page, "blade-2/pmc/606C").get_attribute("title").split("raw ")[1].startswith(f"{truth} ")  # type: ignore[union-attr]
    expect(page).to_have_url(re.compile("plots=.*blade-2/pmc/606C"))
    page.get_by_test_id("views").click()
    page.get_by_test_id("view-name").fill("velocity")
    page.get_by_test_id("view-keep").click()
    expect(page.get_by_test_id("views")).to_contain_text("velocity")
    page.goto(re.sub(r"[?&]plots=[^&]*", "", page.url))
    expect(page.get_by_test_id("plot-1")).to_be_visible()
    expect(page.get_by_test_id("line-blade-2/pmc/606C")).to_have_count(0)
    page.get_by_test_id("views").click()
    page.get_by_test_id("view-velocity").click()
    expect(page.get_by_test_id("plot-1").get_by_test_id("line-blade-2/pmc/606C")).to_be_visible()


def test_the_pointer_marks_a_moment_everywhere_and_a_click_takes_the_cursor_there(opened: Any) -> None:
    page = opened("3-following-error", 10.0, tab="events")
    expect(page.get_by_test_id("desk-event").first).to_be_visible()
    expect(value_of(page, "blade-2/pmc/6064")).to_have_text(re.compile(r"\d"))
    before = cursor_ns(page)
    area = page.get_by_test_id("plot-3").locator("[data-plot]")
    box = area.bounding_box()
    assert box is not None
    place = {"x": box["width"] * 0.7, "y": box["height"] / 2}
    area.hover(position=place)
    expect(page.get_by_test_id("hover-line")).to_be_visible()
    expect(page.get_by_test_id("time-at-pointer")).to_have_text(re.compile(r"\d\d:\d\d:\d\d\.\d{3}"))
    for signal in ("blade-2/pmc/6064", "blade-1/pmm/3063"):
        pointed = page.get_by_test_id(f"line-{signal}").get_by_test_id("at-pointer")
        expect(pointed).to_have_text(re.compile(r"\d"))
    expect(page.locator("[data-near=true]")).to_have_count(1)
    assert cursor_ns(page) == before, "the pointer moves no cursor"
    marked = page.get_by_test_id("time-at-pointer").inner_text()
    area.click(position=place)
    page.wait_for_function("before => !location.search.includes('at=' + before)", arg=str(before))
    moment_s = (cursor_ns(page) - begin("3-following-error")) / S
    assert marked.endswith(f"{moment_s + 0.0001:06.3f}"[:6]) or abs(float(marked[-6:]) - moment_s) < 0.01
    truth = decoded("3-following-error", cursor_ns(page))
    expect(value_of(page, "blade-2/pmc/6064")).to_have_text(f"{truth[12, Address(0x6064)] / 100:.2f}")


def test_zooming_is_shared_by_a_link_and_all_is_back_by_a_double_click(opened: Any) -> None:
    page = opened("3-following-error", 26.0)
    page.get_by_test_id("zoom-in").click()
    page.get_by_test_id("zoom-in").click()
    expect(page).to_have_url(re.compile(r"window=[\d.]+-[\d.]+"))
    first, last = map(float, parse_qs(urlsplit(page.url).query)["window"][0].split("-"))
    assert first < 26 < last
    assert last - first == pytest.approx(15, abs=0.1)
    page.reload()
    expect(page.get_by_test_id("zoom-all")).to_be_enabled()
    page.get_by_test_id("plot-0").locator("[data-plot]").dblclick(position={"x": 200, "y": 40})
    expect(page.get_by_test_id("zoom-all")).to_be_disabled()
    expect(page).not_to_have_url(re.compile("window="))
    assert abs(cursor_ns(page) - begin("3-following-error") - 26 * S) < 1000, "a double click moves no cursor"


def test_parameters_before_and_after_a_foreign_write_differ_and_are_kept_as_a_set(opened: Any) -> None:
    name, device = "8-foreign-master", "wtg-07/blade-2/pmc"
    page = opened(name, 33.0, tab="parameters", device=device)
    page.get_by_test_id("only-changed").click()
    window = page.get_by_test_id("moment-6065")
    expect(window).to_contain_text("20.00")
    window.focus()
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("history").get_by_role("button").last).to_contain_text("20.00 °written by SDO")
    with open_recording(SCENARIOS / f"{name}.mcap") as recording:
        decoder = CanOpenDecoder("can0")
        records = (record for frame in recording.frames(begin(name) + 27 * S) for record in decoder.feed(frame))
        read = next(one for one in records if isinstance(one, ValueSeen) and one.address == Address(0x6065))
    page = opened(name, 33.0, tab="parameters", device=device, against=str(read.t_ns))
    row = page.get_by_test_id("different-6065")
    expect(row.locator("td").nth(1)).to_contain_text("20.00")
    expect(row.locator("td").nth(2)).to_contain_text("1.00")
    expect(page.get_by_test_id("open-compare")).to_have_attribute("href", re.compile("columns=moment:8-foreign-master"))
    page.get_by_test_id("save-moment").click()
    page.get_by_test_id("keep-reason").fill("after the foreign master")
    page.get_by_test_id("keep-now").click()
    kept = page.get_by_test_id("kept")
    expect(kept).to_contain_text(f"{device}:")
    link = kept.get_by_role("link").get_attribute("href") or ""
    assert "tab=restore" in link
    assert "replay=" not in link, "a restore happens live"


def test_by_keyboard_alone_a_signal_is_found_and_shown_and_an_event_reached(opened: Any) -> None:
    page = opened("3-following-error", 5.0, tab="signals", lang="de")
    expect(page.get_by_test_id("tab-first_out")).to_have_text("Erstursache")
    find = page.get_by_test_id("signal-filter")
    find.focus()
    page.keyboard.type("6078")
    expect(page.get_by_test_id("signal-count")).to_contain_text("3 von")
    for _ in range(2):
        page.keyboard.press("Tab")
    for _ in range(2):
        page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("line-blade-1/pmc/6078")).to_be_visible()
    page.get_by_test_id("tab-events").focus()
    page.keyboard.press("Enter")
    last = page.get_by_test_id("desk-event").last
    expect(last).to_be_visible()
    last.focus()
    page.keyboard.press("End")
    page.keyboard.press("Enter")
    page.wait_for_function(
        "after => Number(new URLSearchParams(location.search).get('at') ?? 0) > after",
        arg=begin("3-following-error") + 20 * S,
    )


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_no_tab_has_a_serious_finding_or_anything_clipped(opened: Any, theme: str) -> None:
    page = opened("3-following-error", 26.6, theme=theme)
    found: list[str] = []
    for tab in ("first_out", "events", "signals", "parameters", "noted"):
        page.get_by_test_id(f"tab-{tab}").click()
        expect(page.get_by_test_id(f"tab-{tab}")).to_have_attribute("aria-selected", "true")
        page.add_script_tag(path=AXE)
        result: dict[str, Any] = page.evaluate("() => axe.run('main', {resultTypes: ['violations']})")
        found += [
            f"{tab} {one['impact']} {one['id']}: {node['html'][:160]}"
            for one in result["violations"]
            if one["impact"] in ("serious", "critical")
            for node in one["nodes"][:3]
        ]
    assert found == [], "\n".join(found)
    sizes = page.evaluate(
        """() => [...document.querySelectorAll('main [data-testid=desk], main [data-testid=plots], main button')].map(
            one => { const {right, left} = one.getBoundingClientRect(); return [left, right, one.textContent] })"""
    )
    assert [one for one in sizes if one[0] < 0 or one[1] > 1366] == []
