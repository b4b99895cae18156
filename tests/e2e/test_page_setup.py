"""An axis is set up in pictures as its user would: dragged, typed, reviewed, written; canopen's own client reads it."""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterator
from typing import Any

import canopen
import pytest
from playwright.sync_api import Browser, BrowserContext, Locator, Page, TimeoutError, expect

from app.model.description_file import builtin_folder
from tests.e2e.browser import WAIT_MS, signed_in
from tests.e2e.processes import running
from tests.e2e.test_page_frame import hold
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

EDS = builtin_folder() / "eds"
PICTURES = ("temperatures", "masks", "ladder")
SCALE_C = 200
"""What the scale of the temperatures spans, in °C."""
SCALE_V = 900


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, int]]:
    """A demo with fresh twins: the address that it prints, and the port of their wire."""
    data = tmp_path_factory.mktemp("data")
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        site = (data / "demo-site.toml").read_text(encoding="utf-8")
        port = re.search(r"socketcand:127\.0\.0\.1:(\d+)", site)
        assert port is not None
        yield url, int(port[1])


@pytest.fixture(scope="module")
def demo(bench: tuple[str, int]) -> str:
    return bench[0]


@pytest.fixture(scope="module")
def context(browser: Browser, demo: str) -> Iterator[BrowserContext]:
    """Signed in. The content security policy is passed by, because axe is put into pages."""
    with signed_in(browser, demo, reduced_motion="reduce", bypass_csp=True) as context:
        yield context


def picture(page: Page, demo: str, name: str, blade: int = 1, **search: str) -> Locator:
    """Open a picture and read what is not known yet."""
    more = "".join(f"&{key}={value}" for key, value in search.items())
    page.goto(f"{demo.split('?')[0]}axis?tab=setup&picture={name}&blade={blade}&scene=off{more}")
    shown = page.get_by_test_id(f"picture-{name}")
    expect(shown).to_be_visible()
    expect(shown.locator("[data-testid^=mark-]").or_(shown.get_by_test_id("read-oat-pmm")).first).to_be_visible()
    for unit in ("oat-pmm", "oat-pmc"):
        button = page.get_by_test_id(f"read-{unit}")
        with contextlib.suppress(TimeoutError):  # what is known comes with the socket, a moment after the page
            button.click(timeout=1500)
        expect(page.get_by_test_id(f"unknown-{unit}")).to_have_count(0, timeout=WAIT_MS)
    return shown


def pending(page: Page, count: int) -> None:
    if count == 0:
        expect(page.get_by_test_id("pending-count")).to_have_count(0)
    else:
        expect(page.get_by_test_id("pending-count")).to_contain_text(f"{count} pending")


def mark(page: Page, address: str) -> Locator:
    return page.get_by_test_id(f"mark-{address}")


def drag(page: Page, address: str, by: float, span: float) -> None:
    """Drag a mark by so much of its unit, on a scale that spans ``span``."""
    handle = mark(page, address)
    handle.scroll_into_view_if_needed()
    box, track = handle.bounding_box(), handle.locator("xpath=..").bounding_box()
    assert box is not None and track is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + by / span * track["width"], y, steps=8)


def typed(page: Page, address: str, text: str) -> Locator:
    field = page.get_by_test_id(f"typed-{address}")
    field.fill(text)
    field.press("Enter")
    return field


def test_what_does_not_fit_is_refused_with_the_reason(page: Page, demo: str) -> None:
    picture(page, demo, "temperatures", blade=2)
    lane = page.get_by_test_id("lane-3110")
    for text, reason in (("55", "Stops at 54.9 °C: next comes “Error from”"), ("warm", "number"), ("50.05", "0.1")):
        field = typed(page, "3110:01", text)
        expect(field).to_have_attribute("aria-invalid", "true")
        expect(lane).to_contain_text(reason)
    expect(mark(page, "3110:01")).to_have_attribute("aria-valuetext", "50.0 °C")

    mark(page, "3201:01").focus()
    page.keyboard.press("End")
    expect(mark(page, "3201:01")).to_have_attribute("aria-valuetext", re.compile(r"^39\.9 °C, pending"))
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("stopped-3201")).to_contain_text("Stops at 39.9 °C: next comes “Cooling from”")
    page.get_by_test_id("discard").click()
    pending(page, 0)

    picture(page, demo, "ladder", blade=2)
    field = typed(page, "30FB:07", "650")
    expect(field).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_test_id("lane-30FB:07")).to_contain_text("Stops at 649 V: next comes “Chopper off”")
    expect(typed(page, "6510:04", "216")).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_test_id("lane-6510:04")).to_contain_text("Stops at 215 V: next comes “Battery, nominal”")
    pending(page, 0)


def test_conflicts_of_outputs_are_marked_with_word_and_reason(page: Page, demo: str) -> None:
    picture(page, demo, "masks", blade=2)
    page.get_by_test_id("cell-3201:04-0").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowRight")
    expect(page.get_by_test_id("cell-3201:05-1")).to_be_focused()
    page.keyboard.press("Space")
    expect(page.get_by_test_id("cell-3201:05-1")).to_have_attribute("aria-checked", "true")
    page.get_by_test_id("cell-3203:05-1").click()
    cell = page.get_by_test_id("cell-3203:05-1")
    expect(cell).to_contain_text("twice")
    expect(cell).to_have_accessible_name(re.compile("X14.2.*Conflict.*3201:05"))
    page.get_by_test_id("cell-30FE:02-6").click()
    expect(page.get_by_test_id("setup-rule-oat.outputs_of_controller")).to_contain_text("X16.1/X16.2")
    pending(page, 3)
    page.reload()
    expect(page.get_by_test_id("cell-3203:05-1")).to_have_attribute("aria-checked", "true")
    pending(page, 3)
    page.get_by_test_id("discard").click()
    pending(page, 0)
    expect(page.get_by_test_id("cell-3203:05-1")).to_have_attribute("aria-checked", "false")


def test_the_pulse_test_is_shown_and_nothing_drives_it(page: Page, demo: str) -> None:
    picture(page, demo, "masks", blade=2)
    pulse = page.get_by_test_id("pulse-test")
    expect(pulse).to_contain_text("never drives these inputs")
    expect(pulse).to_contain_text("2000 ms")
    for name in ("efc", "efc_direct", "x13_7"):
        expect(page.get_by_test_id(f"pulse-{name}")).to_have_text("24 V")
        expect(page.get_by_test_id(f"pulse-{name}_feedback")).to_contain_text(re.compile(r"^[01]"))
    assert pulse.locator("button, input, [role=slider], [role=checkbox]").count() == 0


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_in_the_pictures(page: Page, demo: str, theme: str) -> None:
    found: list[str] = []
    for name in PICTURES:
        for language in ("en", "de"):
            shown = picture(page, demo, name, blade=2, theme=theme, lang=language)
            shown.locator("[role=slider]:not([aria-disabled=true])").first.press("PageUp")
            expect(page.get_by_test_id("pending-count")).to_be_visible()
            page.add_script_tag(path=AXE)
            result: dict[str, Any] = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
            assert result["passes"], "axe has looked at something"
            found += [
                f"{name} {language} {one['impact']} {one['id']}: {node['target']} {node['html'][:200]}"
                for one in result["violations"]
                if one["impact"] in ("serious", "critical")
                for node in one["nodes"][:3]
            ]
            page.get_by_test_id("discard").click()
    assert found == [], "\n".join(found)


def test_no_order_is_said_before_anything_is_sent(page: Page, demo: str) -> None:
    """From the parameters one can still ask for a ladder that is out of order: the review says that it has no order."""
    home = demo.split("?")[0]
    picture(page, demo, "ladder", blade=2)
    page.goto(f"{home}parameters?device=wtg-07/blade-2/pmm&q=30FA:02&edit=30FA:02&scene=off")
    page.get_by_test_id("new-value").fill("780")
    page.get_by_test_id("stage").click()
    page.goto(f"{home}axis?tab=setup&picture=ladder&blade=2&scene=off")
    expect(page.get_by_test_id("setup-rule-oat.dc_link_ladder")).to_be_visible()
    page.get_by_test_id("review").click()
    expect(page.get_by_test_id("order-none")).to_contain_text("Blade 2 PMM 30FA:02")
    expect(page.get_by_test_id("write-hold")).to_be_disabled()
    page.get_by_test_id("order-accept").check()
    expect(page.get_by_test_id("order-none")).to_have_count(0)
    expect(page.get_by_test_id("write-hold")).to_be_enabled()
    page.get_by_test_id("drop-30FA:02").click()
    expect(page.get_by_test_id("review-dialog")).to_contain_text("Nothing is pending")


def test_unknown_values_are_a_dash_until_they_are_read(page: Page, demo: str) -> None:
    """After a restart nobody knows what RAM holds."""
    home = demo.split("?")[0]
    picture(page, demo, "temperatures", blade=3)
    headers = {"content-type": "application/json"}
    done = page.request.post(f"{home}api/live/devices/wtg-07/blade-3/pmm/restart", data="{}", headers=headers)
    assert done.ok, done.text()
    unknown = page.get_by_test_id("unknown-oat-pmm")
    expect(unknown).to_contain_text("not known yet", timeout=WAIT_MS)
    expect(mark(page, "3110:01")).to_have_count(0)
    expect(page.get_by_test_id("typed-3110:01")).to_be_disabled()
    page.get_by_test_id("read-oat-pmm").click()
    expect(unknown).to_have_count(0, timeout=WAIT_MS)
    expect(mark(page, "3110:01")).to_have_attribute("aria-valuetext", "50.0 °C")


def test_an_axis_is_set_up_and_canopen_reads_it_back(page: Page, bench: tuple[str, int]) -> None:
    """Last: the bench ends its connection, for there is one SDO channel to a node."""
    demo, port = bench
    picture(page, demo, "temperatures")
    drag(page, "3110:01", -2, SCALE_C)
    page.mouse.up()
    expect(mark(page, "3110:01")).to_have_attribute(
        "aria-valuetext", re.compile(r"^48\.0 °C, pending; it was 50\.0 °C")
    )
    drag(page, "3110:01", 60, SCALE_C)
    expect(page.get_by_test_id("stopped-3110")).to_contain_text("Stops at 54.9 °C")
    page.mouse.up()
    mark(page, "3110:01").focus()
    page.keyboard.press("PageDown")
    for _ in range(9):
        page.keyboard.press("ArrowLeft")
    expect(mark(page, "3110:01")).to_have_attribute("aria-valuetext", re.compile(r"^49\.0 °C"))
    typed(page, "3201:03", "4.0")
    pending(page, 2)

    picture(page, demo, "masks")
    page.get_by_test_id("cell-3204:03-3").click()
    page.get_by_test_id("alarm-input-1-9").click()
    page.get_by_test_id("alarm-kind-1").get_by_text("fault").click()
    expect(page.get_by_test_id("alarm-words-1")).to_contain_text("X14.11, low-active, fault gives 4200h")
    expect(page.get_by_test_id("alarm-then-1")).to_have_text("Once written: not raised")
    mark(page, "3220:01").focus()
    page.keyboard.press("PageUp")
    pending(page, 5)

    picture(page, demo, "ladder")
    drag(page, "30FB:07", 120, SCALE_V)
    expect(page.get_by_test_id("stopped-30FB:07")).to_contain_text("Stops at 649 V: next comes “Chopper off”")
    page.mouse.up()
    for address, text in (("6510:05", "820"), ("30FA:02", "800"), ("30FC:01", "760"), ("30FC:02", "740")):
        typed(page, address, text)
    typed(page, "30FB:07", "690")
    pending(page, 10)
    expect(page.get_by_test_id("voltage-3063")).to_contain_text(re.compile(r"5\d\d V"))
    expect(page.get_by_test_id("ladder-zone")).to_contain_text("above “Nominal voltage”, below “Booster target”")

    page.reload()
    pending(page, 10)
    page.get_by_test_id("review").click()
    expect(page.get_by_test_id("review-order")).to_have_attribute("data-known", "true")
    turns = [
        int(page.get_by_test_id(f"turn-{address}").inner_text().rstrip("."))
        for address in ("6510:05", "30FA:02", "30FC:01", "30FC:02", "30FB:07")
    ]
    assert turns == sorted(turns), "what rises makes room from the top downwards, over both units"
    hold(page, "write-hold", page.get_by_test_id("write-verified"))
    expect(page.get_by_test_id("progress-wtg-07/blade-1/pmc-6510:05")).to_have_attribute("data-state", "saved")
    page.get_by_test_id("review-close").click()
    pending(page, 0)
    expect(mark(page, "30FB:07")).to_have_attribute("aria-valuetext", "690 V")

    ended = page.request.post(f"{demo.split('?')[0]}api/live/disconnect", data={})
    assert ended.ok, ended.text()
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=port, channel="can0")
    try:
        pmm = network.add_node(1, str(EDS / "oat_pmm.eds"))
        pmc = network.add_node(11, str(EDS / "oat_pmc.eds"))
        for node in (pmm, pmc):
            node.sdo.RESPONSE_TIMEOUT = 5.0
        read = {
            "3110": [pmm.sdo[0x3110][sub].raw for sub in (1, 2, 3)],
            "3201": [pmm.sdo[0x3201][sub].raw for sub in (1, 2, 3, 4, 5, 6)],
            "3204": pmm.sdo[0x3204][3].raw,
            "3300": [pmm.sdo[0x3300][sub].raw for sub in (1, 2)],
            "3220": [pmm.sdo[0x3220][sub].raw for sub in (1, 2)],
            "30FA": [pmm.sdo[0x30FA][sub].raw for sub in (1, 2, 3)],
            "30FB": [pmm.sdo[0x30FB][sub].raw for sub in (7, 8)],
            "30FC": [pmm.sdo[0x30FC][sub].raw for sub in (1, 2)],
            "6510": [pmc.sdo[0x6510][sub].raw for sub in (4, 5)],
        }
    finally:
        network.disconnect()
    assert read == {
        "3110": [490, 550, 0],
        "3201": [0, 450, 40, 0x0040, 0, 0x0010],
        "3204": 0x0008,
        "3300": [0x4200, 0],
        "3220": [-8200, 8700],
        "30FA": [560, 800, 400],
        "30FB": [690, 420],
        "30FC": [760, 740],
        "6510": [100, 820],
    }
