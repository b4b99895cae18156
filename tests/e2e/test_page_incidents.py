"""Incidents in a real browser: a moment is marked, shared, carried away and opened again; recordings are laid over."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pyarrow.parquet as parquet
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.recording.reader import open_recording
from app.wire.decoder import CanOpenDecoder
from app.wire.records import ValueSeen
from tests.e2e.browser import signed_in
from tests.e2e.processes import ROOT, running
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

WAIT_MS: Final = 60_000
TRIP: Final = "3-following-error"
S: Final = 1_000_000_000
DEGREES: Final = 0.01
"""Of one step of a position."""
expect.set_options(timeout=30_000)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("data")


@pytest.fixture(scope="module")
def home(browser: Browser, data: Path) -> Iterator[tuple[str, BrowserContext]]:
    """Address of a served demo, and a profile that is signed in."""
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"', WAIT_MS / 1000))["url"]
        with signed_in(browser, url, reduced_motion="reduce", bypass_csp=True, accept_downloads=True) as context:
            context.set_default_timeout(WAIT_MS)
            yield url.split("?")[0], context


@pytest.fixture
def page(home: tuple[str, BrowserContext]) -> Iterator[Page]:
    page = home[1].new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert errors == []


def call(home: tuple[str, BrowserContext], method: str, path: str, body: object = None) -> Any:
    """The document that the page's session gets."""
    headers = {"content-type": "application/json"}
    answer = home[1].request.fetch(f"{home[0]}api/{path}", method=method, data=json.dumps(body), headers=headers)
    assert answer.ok, answer.text()
    return answer.json()


def replayed(home: tuple[str, BrowserContext], name: str) -> dict[str, Any]:
    """The replay of a recording, opened."""
    doc: dict[str, Any] = call(home, "POST", "replay", {"recording": f"{name}.mcap"})
    return doc


def seek(home: tuple[str, BrowserContext], t_ns: int) -> None:
    call(home, "POST", f"replay/{TRIP}/cursor", {"action": "seek", "t_ns": t_ns})


def expect_at(page: Page, t_ns: int) -> None:
    """The clock of the page stands there, as exact as the numbers of a browser are."""
    page.wait_for_function(
        "(at) => Math.abs(Number(document.querySelector('[data-testid=replay-clock]')?.dataset.ns) - at) < 2000",
        arg=t_ns,
    )


# -- marking --------------------------------------------------------------------------------


def test_a_moment_is_marked_from_another_room_and_its_link_leads_there(
    home: tuple[str, BrowserContext], page: Page
) -> None:
    begin = replayed(home, TRIP)["from_ns"]
    seek(home, begin + 20 * S)
    page.goto(f"{home[0]}axis?blade=2&camera=blade-2&replay={TRIP}&scene=off")
    expect_at(page, begin + 20 * S)
    page.locator("main").click(position={"x": 3, "y": 3})
    page.keyboard.press("m")
    form = page.get_by_test_id("mark-form")
    expect(form.get_by_test_id("mark-before")).to_have_value("10")
    form.get_by_test_id("mark-title").fill("Blade 2 trips")
    form.get_by_test_id("mark-notes").fill("grease <b>on</b> the gear")
    form.get_by_test_id("mark-after").fill("5.5")
    expect(form).to_contain_text("Keep the plots of the desk (4)")
    form.get_by_test_id("mark-keep").click()
    notice = page.get_by_role("status").filter(has_text="Marked: Blade 2 trips")
    link = notice.get_by_text(re.compile(r"/i/")).inner_text()
    (kept,) = call(home, "GET", "incidents")
    assert link == f"{home[0].rstrip('/')}{kept['link']}"
    assert (kept["title"], kept["notes"], kept["camera"]) == ("Blade 2 trips", "grease <b>on</b> the gear", "blade-2")
    at = kept["at_ns"]
    assert abs(at - begin - 20 * S) < 2000
    assert (round((at - kept["from_ns"]) / S, 3), round((kept["to_ns"] - at) / S, 3)) == (10.0, 5.5)
    assert "wtg-07/blade-2/pmc/6064" in kept["plots"][0]


def test_a_link_shows_the_same_in_another_browser_and_leads_to_what_was_written(
    home: tuple[str, BrowserContext], browser: Browser
) -> None:
    begin = replayed(home, TRIP)["from_ns"]
    kept = marked(home, begin, title="Blade 2 shared", tags=["8611h"])
    other = browser.new_context(storage_state=home[1].storage_state(), viewport={"width": 1366, "height": 768})
    page = other.new_page()
    page.goto(home[0].rstrip("/") + kept["link"])
    expect_at(page, kept["at_ns"])
    expect(page.get_by_test_id("plot-0").get_by_test_id("line-blade-2/pmc/60F4")).to_be_visible(timeout=WAIT_MS)
    expect(page.get_by_test_id("plot-1")).to_have_count(0)
    expect(page.get_by_test_id("loop")).to_have_attribute("aria-pressed", "true")
    loop = call(home, "GET", f"replay/{TRIP}")["cursor"]["loop"]
    assert abs(loop["from_ns"] - begin - 15 * S) < 2000
    assert "camera=blade-2" in page.url
    leave = page.get_by_test_id("leave-replay").bounding_box()
    assert leave is not None
    assert leave["x"] + leave["width"] <= 1366
    page.get_by_test_id("opened-incident").click()
    expect(page.get_by_test_id("incident-details")).to_contain_text("Blade 2 shared")
    expect(page.get_by_test_id("replay-badge")).to_have_count(0)
    page.get_by_test_id("open-incident").click()
    expect_at(page, kept["at_ns"])
    other.close()


def test_a_note_is_kept_at_the_recording_and_changed_in_the_incident(
    home: tuple[str, BrowserContext], page: Page
) -> None:
    begin = replayed(home, TRIP)["from_ns"]
    kept = marked(home, begin, title="With a note")
    page.goto(f"{home[0]}recordings?incident={kept['code']}&scene=off")
    details = page.get_by_test_id("incident-details")
    details.get_by_test_id("add-annotation").click()
    page.get_by_test_id("note-text").fill("brake closes late")
    page.get_by_test_id("annotation-keep").click()
    note = details.get_by_test_id("annotations").locator("li", has_text="brake closes late")
    note.get_by_role("button", name="Edit note: brake closes late").click()
    page.get_by_test_id("note-text").fill("brake closes much too late")
    page.get_by_test_id("annotation-keep").click()
    note = details.get_by_test_id("annotations").locator("li", has_text="brake closes much too late")
    expect(note).to_be_visible()
    (listed,) = call(home, "GET", f"recordings/{TRIP}.mcap/annotations")["annotations"]
    assert (listed["text"], listed["incident"]) == ("brake closes much too late", kept["id"])
    note.get_by_role("button", name=re.compile("Delete note")).click()
    expect(note).to_have_count(0)


def test_what_is_marked_stands_on_the_timeline_and_among_the_notes_of_the_desk(
    home: tuple[str, BrowserContext], page: Page
) -> None:
    begin = replayed(home, TRIP)["from_ns"]
    incident = marked(home, begin, title="Flagged on the timeline")
    call(
        home, "POST", f"recordings/{TRIP}.mcap/annotations",
        {"from_ns": begin + 40 * S, "to_ns": begin + 41 * S, "text": "grease seen", "severity": "warning"},
    )  # fmt: skip
    page.goto(f"{home[0]}recordings?replay={TRIP}&tab=noted&scene=off")
    notes = page.get_by_test_id("noted")
    notes.get_by_test_id("noted-annotation").filter(has_text="grease seen").click()
    expect_at(page, begin + 40 * S)
    notes.get_by_test_id("noted-incident").filter(has_text="Flagged on the timeline").click()
    expect_at(page, incident["at_ns"])
    timeline = page.get_by_test_id("timeline")
    expect(timeline).to_have_attribute("data-marked", str(notes.locator("li").count()))
    box, length = timeline.bounding_box(), replayed(home, TRIP)["to_ns"] - begin
    assert box is not None
    page.mouse.move(box["x"] + box["width"] * 40.5 * S / length, box["y"] + box["height"] / 2)
    expect(page.get_by_test_id("timeline-hover")).to_contain_text("Note: grease seen")
    line = notes.locator("li").filter(has_text="Flagged on the timeline")
    line.get_by_test_id("noted-open").click()
    expect(page.get_by_test_id("opened-incident")).to_contain_text("Flagged on the timeline")


# -- what was marked ------------------------------------------------------------------------


def test_an_incident_is_edited_reported_and_carried_away_as_a_bundle(
    home: tuple[str, BrowserContext], page: Page, tmp_path: Path
) -> None:
    begin = replayed(home, TRIP)["from_ns"]
    kept = marked(home, begin, title="Before the edit")
    page.goto(f"{home[0]}recordings?tab=incidents&scene=off")
    page.get_by_test_id("incident-" + kept["code"]).click()
    details = page.get_by_test_id("incident-details")
    details.get_by_test_id("edit-incident").click()
    form = page.get_by_test_id("edit-form")
    form.get_by_test_id("mark-title").fill("After the edit")
    form.get_by_test_id("edit-keep").click()
    expect(form).to_have_count(0)
    expect(details.get_by_role("heading", name="After the edit")).to_be_visible()
    versions = details.get_by_test_id("versions")
    expect(versions.locator("li")).to_have_count(2)
    versions.locator("li").nth(1).get_by_role("button").click()
    expect(versions).to_contain_text("Before the edit")
    with page.expect_download(timeout=WAIT_MS) as download:
        details.get_by_test_id("report").click()
    download.value.save_as(tmp_path / "report.html")
    report = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "After the edit" in report
    assert "following error too large (8611h)" in report
    with page.expect_download(timeout=WAIT_MS) as download:
        details.get_by_test_id("bundle").click()
    bundle = tmp_path / download.value.suggested_filename
    download.value.save_as(bundle)
    take(page, bundle)
    expect(page.get_by_test_id("taken")).to_contain_text("Known here already: After the edit")
    page.get_by_role("dialog").get_by_role("button").first.click()
    bundle.write_bytes(bundle.read_bytes()[:2000])
    take(page, bundle)
    expect(page.get_by_role("dialog")).to_contain_text("The bundle could not be opened")
    expect(page.get_by_role("dialog")).to_contain_text("no zip file, or its directory is damaged")


def take(page: Page, bundle: Path) -> None:
    """Open a bundle as a person does."""
    with page.expect_file_chooser() as chooser:
        page.get_by_test_id("take-bundle").click()
    chooser.value.set_files(bundle)


def marked(home: tuple[str, BrowserContext], begin: int, **changes: Any) -> dict[str, Any]:
    """An incident 20 s after the beginning, with one plot, a camera and a loop."""
    words = {
        "recording": f"{TRIP}.mcap",
        "from_ns": begin + 10 * S,
        "to_ns": begin + 30 * S,
        "at_ns": begin + 20 * S,
        "title": "Blade 2",
        "plots": [["wtg-07/blade-2/pmc/60F4"]],
        "camera": "blade-2",
        "loop": {"from_ns": begin + 15 * S, "to_ns": begin + 25 * S},
    }
    doc: dict[str, Any] = call(home, "POST", "incidents", {**words, **changes})
    return doc


# -- laying over ----------------------------------------------------------------------------


def test_two_trips_are_laid_over_each_other_and_say_what_the_decoder_says(
    home: tuple[str, BrowserContext], page: Page
) -> None:
    second = "2-mains-failure"
    replayed(home, TRIP)
    page.goto(f"{home[0]}recordings?tab=overlay&curves=6064*2&window=5-5&scene=off")
    for name in (TRIP, second):
        find = page.get_by_test_id(f"index-{name}")
        chosen = page.get_by_test_id(f"overlay-{name}")
        row = page.locator("li").filter(has=chosen)
        expect(row).to_contain_text(re.compile("trips: |Find trips"))
        if find.count():
            find.click()
        expect(row).to_contain_text("trips: 1", timeout=WAIT_MS)
        chosen.check()
        expect(page).to_have_url(re.compile(rf"{name}(~|%7E)0"))
    expect(page.get_by_test_id("overlay-at")).to_contain_text("Values at zero, the chosen moment of each")
    for name in (TRIP, second):
        t0 = call(home, "GET", f"recordings/{name}.mcap/trips")["trips"][0]["t0_ns"]
        expected = position(name, 12, t0)
        shown = page.get_by_test_id(f"overlay-value-{name}.mcap-wtg-07/blade-2/pmc-6064")
        expect(shown).to_contain_text("°", timeout=WAIT_MS)
        text = shown.inner_text().removesuffix("°").strip().replace("−", "-")
        low, high = (float(one) for one in (text.split(" … ") if "…" in text else (text, text)))
        assert low - 0.01 <= expected <= high + 0.01, name
        assert high - low < 0.5, name
    page.get_by_test_id(f"overlay-open-{second}.mcap").click()
    expect_at(page, t0)
    page.go_back()
    expect(page.get_by_test_id(f"overlay-open-{TRIP}.mcap")).to_be_visible()


def position(name: str, node: int, t_ns: int) -> float:
    """The last position before a time, in degrees, as the decoder says."""
    description, address, raw = load_builtin("oat-pmc"), parse_address("6064"), 0
    decoder = CanOpenDecoder("can0", {node: description})
    with open_recording(ROOT / "recordings" / "scenarios" / f"{name}.mcap") as recording:
        for frame in recording.frames(None, t_ns + 1):
            for record in decoder.feed(frame):
                if isinstance(record, ValueSeen) and (record.node, record.address) == (node, address):
                    raw = int.from_bytes(record.data, "little", signed=True)
    return raw * DEGREES


# -- looks ----------------------------------------------------------------------------------


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_incidents_overlay_and_marking_are_german_accessible_and_fit(
    home: tuple[str, BrowserContext], page: Page, theme: str
) -> None:
    page.set_viewport_size({"width": 1366, "height": 768})
    begin = replayed(home, TRIP)["from_ns"]
    kept = marked(home, begin, title="Blatt 2", tags=["8611h"])
    look = f"scene=off&lang=de&theme={theme}"
    page.goto(f"{home[0]}recordings?tab=incidents&incident={kept['code']}&{look}")
    expect(page.get_by_test_id("incident-details")).to_contain_text("Schlagwörter")
    assert_looks_well(page)
    page.goto(f"{home[0]}recordings?tab=overlay&overlay={TRIP}~0&curves=6064*2&{look}")
    expect(page.get_by_test_id("overlay-at")).to_contain_text("Nullpunkt")
    expect(page.get_by_test_id(f"overlay-value-{TRIP}.mcap-wtg-07/blade-2/pmc-6064")).to_contain_text("°")
    assert_looks_well(page)
    page.goto(f"{home[0]}recordings?replay={TRIP}&tab=noted&{look}")
    expect(page.get_by_test_id("noted")).to_contain_text("Blatt 2")
    assert_looks_well(page)
    page.get_by_test_id("mark").click()
    expect(page.get_by_role("dialog")).to_contain_text("Diesen Moment markieren")
    assert_looks_well(page)


def assert_looks_well(page: Page) -> None:
    """Nothing serious that axe finds, nothing wider than the page, no key in place of a text."""
    page.wait_for_function(
        "document.getAnimations().every((one) => one.playState !== 'running' || "
        "one.effect.getComputedTiming().endTime === Infinity)"
    )
    page.add_script_tag(path=AXE)
    found = page.evaluate("() => axe.run({resultTypes: ['violations']})")["violations"]
    assert [
        f"{one['id']}: {node['html'][:160]}"
        for one in found
        if one["impact"] in ("serious", "critical")
        for node in one["nodes"][:3]
    ] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= page.evaluate("innerWidth")
    assert not re.search(r"\b(page|desk)\.\w+\.", page.locator("body").inner_text())


# -- files of other tools -------------------------------------------------------------------


def test_a_recording_is_exported_and_what_others_wrote_is_imported(
    home: tuple[str, BrowserContext], page: Page, tmp_path: Path
) -> None:
    page.goto(f"{home[0]}recordings?file={TRIP}.mcap&scene=off")
    page.get_by_test_id("export-format").click()
    page.get_by_role("option", name="candump log").click()
    expect(page.get_by_test_id("losses")).to_contain_text("events stay behind", timeout=WAIT_MS)
    with page.expect_download(timeout=WAIT_MS) as download:
        page.get_by_test_id("export").click()
    log = tmp_path / "others.log"
    download.value.save_as(log)
    frames = len(log.read_text().splitlines())
    assert frames > 10_000
    page.get_by_test_id("import-recording").click()
    page.locator("input[type=file]").set_input_files(log)
    page.get_by_test_id("import-now").click()
    made = page.get_by_test_id("made")
    expect(made).to_have_attribute("data-state", "done", timeout=WAIT_MS)
    expect(made).to_contain_text(re.compile(rf"{frames // 1000}\D?{frames % 1000:03d} frames"))
    name = made.get_by_test_id("made-file").inner_text()
    made.get_by_test_id("made-file").click()
    expect(page.get_by_test_id("recording-details")).to_contain_text(name)


def test_a_recording_is_taken_as_a_table_and_joined_with_another(
    home: tuple[str, BrowserContext], page: Page, tmp_path: Path
) -> None:
    page.goto(f"{home[0]}recordings?file={TRIP}.mcap&scene=off")
    page.get_by_test_id("export-format").click()
    page.get_by_role("option", name="Parquet, decoded signals").click()
    with page.expect_download(timeout=WAIT_MS) as download:
        page.get_by_test_id("export").click()
    table = tmp_path / "signals.parquet"
    download.value.save_as(table)
    assert download.value.suggested_filename == f"{TRIP}.parquet"
    assert parquet.read_metadata(table).num_rows > 10_000
    page.get_by_test_id("join-with").fill("2-mains")
    page.get_by_role("option", name="2-mains-failure.mcap").click()
    page.get_by_test_id("join-with").press("Escape")
    page.get_by_test_id("join").click()
    made = page.get_by_test_id("made")
    expect(made).to_have_attribute("data-state", "done", timeout=WAIT_MS)
    name = made.get_by_test_id("made-file").inner_text()
    spans = [replayed(home, one) for one in (TRIP, "2-mains-failure")]
    joined = replayed(home, name.removesuffix(".mcap"))
    assert joined["from_ns"] == min(one["from_ns"] for one in spans)
    assert joined["to_ns"] == max(one["to_ns"] for one in spans)
