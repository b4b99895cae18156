"""The oscilloscope as its user uses it: signals, trigger, arm, cursors, spectrum, XY, reference, files, a reload."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import BrowserContext, Download, Page, expect

from tests.e2e.browser import SIZE
from tests.e2e.test_page_motion import give_back, prepare, press, stands_still, take_control
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
AXIS = "wtg-07/blade-1/pmc"
POSITION = f"{AXIS}/6064"
WAIT_MS = 30_000
BLENDED = 34
"""So far a line of one and a half pixels is from its colour where it lies on two rows; two signals differ by more."""
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture
def scope(page: Page, demo: str) -> Iterator[Page]:
    """The tab of the scope; the wide window is a technician's laptop."""
    page.goto(f"{demo.split('?')[0]}axis?tab=scope&blade=1&scene=off")
    expect(page.get_by_test_id("scope-state")).to_be_visible()
    expect(page.get_by_test_id("preset-motion")).to_be_enabled()
    yield page
    if page.get_by_test_id("scope-stop").is_enabled():
        page.get_by_test_id("scope-stop").click()


def choose(page: Page, label: str, option: str) -> None:
    """Pick an option of a list."""
    page.get_by_test_id(label).click()
    page.get_by_role("option", name=option, exact=True).click()


def setting(page: Page, total_s: str = "1", pre_s: str = "0.4") -> None:
    page.get_by_test_id("scope-side-trigger").click()
    page.get_by_test_id("scope-total").fill(total_s)
    page.get_by_test_id("scope-pre").fill(pre_s)


def arm(page: Page) -> None:
    page.get_by_test_id("arm").click()
    expect(page.get_by_test_id("scope-state")).to_contain_text("Waiting for the trigger", timeout=WAIT_MS)
    expect(page.get_by_test_id("scope-live")).to_be_visible(timeout=WAIT_MS)


def captured(page: Page) -> str:
    """The name of the capture that the page shows by itself."""
    expect(page.get_by_test_id("scope-capture")).to_be_visible(timeout=WAIT_MS)
    return page.get_by_test_id("capture-name").inner_text()


def by_hand(page: Page) -> str:
    """Arm, wait until values come, trigger."""
    arm(page)
    page.get_by_test_id("scope-side-signals").click()
    expect(page.get_by_test_id("chosen-signals")).to_contain_text(re.compile(r"polled, about \d|by PDO"))
    page.wait_for_timeout(600)  # so that there is something before the trigger
    page.get_by_test_id("trigger-now").click()
    return captured(page)


def zoom_of(url: str) -> tuple[float, float]:
    """The stretch in view, s."""
    found = re.search(r"zoom=(-?[\d.]+?)\.\.(-?[\d.]+)", url)
    assert found is not None
    return float(found[1]), float(found[2])


def span(url: str) -> float:
    begin_s, end_s = zoom_of(url)
    return end_s - begin_s


def bytes_of(download: Download) -> bytes:
    return Path(download.path()).read_bytes()


def test_a_capture_from_the_signals_to_the_files(scope: Page) -> None:
    page = scope
    page.get_by_test_id("preset-motion").click()
    expect(page.get_by_test_id("chosen-signals").get_by_role("listitem")).to_have_count(6)
    page.get_by_test_id("find-signal").fill("dc link circuit voltage blade 1")
    page.get_by_test_id(f"add-{AXIS}/6079").click()
    expect(page.get_by_test_id(f"chosen-{AXIS}/6079")).to_be_visible()
    page.get_by_role("button", name=re.compile("^Remove .*current actual value")).click()
    expect(page.get_by_test_id("chosen-signals").get_by_role("listitem")).to_have_count(6)
    setting(page)
    first = by_hand(page)
    expect(page.get_by_test_id("capture-facts")).to_contain_text("triggered by hand · complete")

    # cursors, by button, by keyboard and by dragging
    page.get_by_test_id("cursors").click()
    page.get_by_test_id("cursor-a").fill("-0.1")
    page.get_by_test_id("cursor-b").fill("0.4")
    expect(page.get_by_test_id("delta-t")).to_contain_text("0.500000 s")
    expect(page.get_by_test_id("one-over-delta-t")).to_contain_text("2.000 Hz")
    row = page.get_by_test_id(f"trace-{POSITION}")
    expect(row.get_by_test_id("at-a")).to_have_text(re.compile(r"^\d+\.\d\d °$"))
    expect(row.get_by_test_id("delta")).to_have_text(re.compile(r"^−?\d\.\d\d °$"))

    head = page.get_by_test_id("scope-plots").get_by_text("position actual value").first
    expect(head).to_have_text(re.compile(r"A \d+\.\d\d B \d+\.\d\d Δ −?\d\.\d\d$"))
    expect(page.get_by_test_id("between")).to_contain_text("0.5000 s")

    # an axis for each signal, and back
    plots = page.locator("[data-plot]")
    expect(plots).to_have_count(4)
    page.get_by_test_id("axes-each").click()
    expect(plots).to_have_count(5)
    page.get_by_test_id("axes-each").click()
    expect(plots).to_have_count(4)

    # an axis of values that is set by hand, kept in the link, and automatic again
    page.get_by_test_id("scale-unit °").click()
    page.get_by_test_id("scale-low").fill("5")
    page.get_by_test_id("scale-high").fill("-5")
    expect(page.get_by_text("From must be below up to")).to_be_visible()
    expect(page.get_by_test_id("scale-set")).to_be_disabled()
    page.get_by_test_id("scale-low").fill("-40")
    page.get_by_test_id("scale-high").fill("120")
    page.get_by_test_id("scale-high").press("Enter")
    expect(page.get_by_test_id("scale-unit °")).to_contain_text("fixed")
    expect(page).to_have_url(re.compile(r"yscale=[^&]*-40\.\.120"))
    page.reload()
    page.get_by_test_id("scale-unit °").click()
    expect(page.get_by_test_id("scale-high")).to_have_value(re.compile(r"^120"))
    page.get_by_test_id("scale-auto").click()
    expect(page).not_to_have_url(re.compile("yscale="))

    # zoom by dragging, by keyboard, and back
    box = page.get_by_test_id("scope-plots").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.30 * box["width"], box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.45 * box["width"], box["y"] + 60, steps=4)
    page.mouse.up()
    expect(page).to_have_url(re.compile(r"zoom=-?0"))
    page.get_by_test_id("scope-plots").press("+")
    narrow = page.url
    page.keyboard.down("Shift")
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 60, steps=3)
    page.mouse.up()
    page.keyboard.up("Shift")
    assert zoom_of(page.url)[0] > zoom_of(narrow)[0], "moved to what comes later"
    assert span(page.url) == pytest.approx(span(narrow), abs=1e-4)
    page.get_by_test_id("scope-plots").press("0")
    expect(page).not_to_have_url(re.compile("zoom="))
    assert narrow != page.url

    # files
    with page.expect_download() as csv:
        page.get_by_test_id("scope-csv").click()
    lines = bytes_of(csv.value).decode("utf-8-sig").splitlines()
    assert lines[0].startswith("time since trigger [s],t_ns,blade-1/pmc position actual value [°]")
    times = [float(line.split(",")[0]) for line in lines[1:]]
    assert times == sorted(times)
    assert times[0] >= -0.4
    assert times[-1] <= 0.6
    with page.expect_download() as plain:
        page.get_by_test_id("scope-json").click()
    whole = json.loads(bytes_of(plain.value))
    assert whole["format"] == "hubside-capture/1"
    assert [one["count"] for one in whole["signals"]] == [len(one["raw"]) for one in whole["signals"]]
    assert len(whole["in_force"]) > 100
    for theme in ("dark", "light"):
        page.goto(with_theme(page.url, theme))
        expect(page.get_by_test_id("scope-plot-bits").locator("canvas")).to_be_visible()
        with page.expect_download() as picture:
            page.get_by_test_id("scope-png").click()
        assert_shows(bytes_of(picture.value), page, theme)

    # parameters in force
    page.get_by_test_id("in-force").click()
    expect(page.get_by_test_id("table-in-force").get_by_role("row").nth(1)).to_be_visible()

    # a name, a reload, and a second capture over which the first one lies
    page.get_by_test_id("edit-capture").click()
    page.get_by_test_id("capture-name-field").fill("first one")
    page.get_by_test_id("save-capture").click()
    expect(page.get_by_test_id("capture-name")).to_have_text("first one")
    page.reload()
    expect(page.get_by_test_id("capture-name")).to_have_text("first one")
    expect(page.get_by_test_id("delta-t")).to_contain_text("0.500000 s")
    assert first != "first one"
    setting(page)
    second = by_hand(page)
    assert second != "first one"
    page.get_by_test_id("scope-side-captures").click()
    page.get_by_label("Lay capture first one over as a reference").check()
    expect(page.get_by_test_id(f"reference-{POSITION}")).to_contain_text("dashed: first one")


def with_theme(url: str, theme: str) -> str:
    return re.sub(r"[?&]theme=\w+", "", url) + f"&theme={theme}"


def rgb(colour: str) -> tuple[int, int, int]:
    """Of ``#rrggbb`` or ``#rgb``."""
    colour = colour if len(colour) == len("#rrggbb") else "#" + "".join(2 * one for one in colour[1:])
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def assert_shows(data: bytes, page: Page, theme: str) -> None:
    """The picture has the plots, each trace in its colour, a line of the legend for each, and text above."""
    assert data.startswith(PNG)
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(np.int16)
    height, width, _ = picture.shape
    plots = page.get_by_test_id("scope-plots").bounding_box()
    assert plots is not None
    assert width == pytest.approx(plots["width"] + 2 * 16, abs=4), "as wide as the plots, with a margin"
    colours: list[str] = page.evaluate(
        """() => { const style = getComputedStyle(document.querySelector('[data-testid=scope-plots]'));
        return ['--hs-panel', ...Array.from({length: 6}, (_, at) => `--scope-${at}`)].map(
            (name) => style.getPropertyValue(name).trim()); }"""
    )
    ground, traces = rgb(colours[0]), [rgb(one) for one in colours[1:]]
    assert (sum(ground) > 3 * 200) is (theme == "light")
    assert tuple(picture[2, 2]) == ground, "the ground is that of the page"
    legend_px = 18
    legend = picture[-(6 * legend_px + 30) :, 16:38]
    shares = []
    for colour in traces:
        of_colour = (np.abs(picture - np.array(colour)).max(axis=2) <= BLENDED)[: height - 6 * legend_px - 30, 60:]
        shares.append(float(of_colour.any(axis=0).mean()))
        assert (np.abs(legend - np.array(colour)).max(axis=2) <= BLENDED).sum() > 20, "and in the legend"
    # Position and target lie on each other where the axis stands there; their colours are seen where values are dots.
    assert min(shares) > 0.1, shares
    assert min(shares[2:]) > 0.5, f"over most of the time axis: {shares}"
    for name, (top, bottom) in {"title": (12, 36), "about": (36, 56), "legend": (height - 120, height - 20)}.items():
        inked = np.abs(picture[top:bottom, 46:400] - np.array(ground)).max(axis=2) > 90
        assert inked.sum() > 150, name


def test_a_link_opens_the_same_setup(context: BrowserContext, scope: Page) -> None:
    page = scope
    page.get_by_test_id("preset-following").click()
    setting(page, "4", "1.5")
    choose(page, "trigger-kind", "Edge")
    expect(page.get_by_test_id("trigger-signal")).to_have_value("Blade 1 PMC actual following error")
    choose(page, "trigger-signal", "Blade 1 PMC position actual value")
    page.get_by_test_id("scope-level").fill("45.5")
    page.get_by_text("falling", exact=True).click()
    page.get_by_text("Normal", exact=True).click()
    page.get_by_test_id("scope-hold-off").fill("0.5")
    told = "edge;signal:blade-1/pmc/6064;level:45.5;total:4;pre:1.5;holdoff:0.5;slope:falling;mode:normal"
    expect(page).to_have_url(re.compile(f"trigger={re.escape(quote(told, safe='/:'))}"))

    def same(shown: Page) -> None:
        shown.get_by_test_id("scope-side-signals").click()
        expect(shown.get_by_test_id("chosen-signals").get_by_role("listitem")).to_have_count(4)
        shown.get_by_test_id("scope-side-trigger").click()
        expect(shown.get_by_test_id("trigger-kind")).to_have_value("Edge")
        expect(shown.get_by_test_id("trigger-signal")).to_have_value("Blade 1 PMC position actual value")
        for name, value in (("level", "45.5"), ("total", "4"), ("pre", "1.5"), ("hold-off", "0.5")):
            expect(shown.get_by_test_id(f"scope-{name}")).to_have_value(value)
        for name in ("falling", "Normal"):
            expect(shown.get_by_role("radio", name=name)).to_be_checked()

    same(page)
    page.reload()
    same(page)
    other = context.new_page()
    other.goto(page.url)
    same(other)
    # what a colleague arms meanwhile does not change what this link says
    other.get_by_test_id("scope-total").fill("2")
    other.get_by_test_id("arm").click()
    armed = re.compile("Armed, filling|Waiting for the trigger")
    expect(other.get_by_test_id("scope-state")).to_contain_text(armed)
    expect(other).to_have_url(re.compile("total:2"))
    expect(page.get_by_test_id("scope-state")).to_contain_text(armed, timeout=WAIT_MS)
    same(page)
    other.close()


def test_before_the_first_capture_the_page_says_what_is_missing(scope: Page) -> None:
    page = scope
    page.goto(re.sub(r"[&?](channels|trigger)=[^&]*", "", page.url) + "&channels=none")
    expect(page.get_by_test_id("scope-start")).to_contain_text("Nothing is chosen yet")
    page.get_by_test_id("preset-motion").click()
    expect(page.get_by_test_id("scope-start")).to_contain_text("Chosen, 6 of 16")
    page.get_by_test_id("step-trigger").click()
    setting(page, "5", "1")
    choose(page, "trigger-kind", "Level")
    page.get_by_test_id("scope-level").fill("12.5")
    expect(page.get_by_test_id("scope-start")).to_contain_text(
        "Level, Blade 1 PMC position actual value, above, 12.5 °. 5 s, of which 1 s before the trigger."
    )


def test_a_moving_axis_triggers_and_its_capture_shows_the_motion(
    context: BrowserContext, demo: str, scope: Page
) -> None:
    """Moved from another page, as a colleague does; spectrum and XY of what came."""
    mover = context.new_page()
    mover.goto(f"{demo.split('?')[0]}axis?blade=1&scene=off")
    expect(mover.get_by_test_id("axis-angle")).to_have_text(re.compile(r"\d"))
    take_control(mover)
    prepare(mover)
    start = stands_still(mover)
    page = scope
    page.get_by_test_id("preset-motion").click()
    setting(page, "3", "1")
    choose(page, "trigger-kind", "Edge")
    choose(page, "trigger-signal", "Blade 1 PMC position actual value")
    page.get_by_test_id("scope-level").fill(f"{start - 0.5:.2f}")
    page.get_by_text("falling", exact=True).click()
    arm(page)
    press(mover, "jog-minus")
    captured(page)
    mover.mouse.up()
    expect(page.get_by_test_id("capture-facts")).to_contain_text("by its trigger")
    page.get_by_test_id("cursors").click()
    # The axis may be there sooner than the time before the trigger is full.
    page.get_by_test_id("cursor-a").fill("-0.1")
    page.get_by_test_id("cursor-b").fill("0.9")
    delta = page.get_by_test_id(f"trace-{POSITION}").get_by_test_id("delta")
    expect(delta).to_have_text(re.compile(r"^−\d+\.\d\d °$"))

    page.get_by_test_id("scope-view").get_by_text("FFT").click()
    expect(page.get_by_test_id("fft-told")).to_contain_text("by holding the last value")
    expect(page.get_by_test_id("scope-fft")).to_be_visible()
    expect(page.get_by_test_id("peaks")).to_be_visible()
    expect(page.get_by_test_id("read-fft")).to_have_text("Hz")
    page.get_by_test_id("scope-fft").hover()
    expect(page.get_by_test_id("read-fft")).to_have_text(re.compile(r"^\d+(\.\d+)? Hz · \d+(\.\d+)?(e-\d+)? °$"))
    page.mouse.move(0, 0)
    page.get_by_test_id("scope-fft").focus()
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("read-fft")).to_have_text(re.compile(r"^0\.000 Hz · "))
    page.get_by_test_id("scope-view").get_by_text("XY").click()
    expect(page.get_by_test_id("xy-told")).to_contain_text("instants")
    page.get_by_test_id("scope-xy").hover()
    expect(page.get_by_test_id("read-xy")).to_have_text(re.compile(r": −?\d+(\.\d+)? · "))

    give_back(mover)
    mover.close()


def test_what_does_not_fit_is_told_and_nothing_is_armed(scope: Page) -> None:
    page = scope
    page.get_by_test_id("preset-supply").click()
    setting(page, "0.01", "0")
    page.get_by_test_id("arm").click()
    expect(page.get_by_text("The scope was not armed")).to_be_visible()
    expect(page.get_by_text("must lie between 0.1 and 120")).to_be_visible()
    page.get_by_test_id("scope-total").fill("1")
    choose(page, "trigger-kind", "Fault")
    page.get_by_test_id("trigger-code").fill("xyz")
    expect(page.get_by_text("One to four hexadecimal digits")).to_be_visible()
    expect(page.get_by_test_id("arm")).to_be_disabled()


def test_in_a_replay_the_scope_is_locked(page: Page, demo: str) -> None:
    page.goto(f"{demo.split('?')[0]}axis?tab=scope&scene=off&replay=3-following-error")
    expect(page.get_by_test_id("scope-lock")).to_be_visible()
    expect(page.get_by_test_id("arm")).to_have_count(0)
    page.get_by_test_id("scope-side-captures").click()
    page.get_by_test_id("open-capture").first.click()
    expect(page.get_by_test_id("scope-capture")).to_be_visible()


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("language", ["en", "de"])
def test_axe_finds_nothing_serious_and_nothing_is_cut(page: Page, demo: str, theme: str, language: str) -> None:
    page.set_viewport_size(SIZE)
    page.goto(f"{demo.split('?')[0]}axis?tab=scope&blade=1&scene=off&theme={theme}&lang={language}")
    page.get_by_test_id("scope-side-captures").click()
    page.get_by_test_id("open-capture").first.click()
    expect(page.get_by_test_id("scope-capture")).to_be_visible()
    page.get_by_test_id("cursors").click()
    page.get_by_test_id("in-force").click()
    for side in ("signals", "trigger", "captures"):
        page.get_by_test_id(f"scope-side-{side}").click()
        page.add_script_tag(path=AXE)
        result = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
        assert result["passes"], "axe has looked at something"
        found = [
            f"{one['impact']} {one['id']}: {node['html'][:160]}"
            for one in result["violations"]
            if one["impact"] in ("serious", "critical")
            for node in one["nodes"]
        ]
        assert found == []
    assert page.evaluate("() => document.documentElement.scrollWidth") <= SIZE["width"]
