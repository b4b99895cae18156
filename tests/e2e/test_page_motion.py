"""A blade is moved from the page as its user would: control, confirmations, proof, hold to run; else it stops."""

from __future__ import annotations

import contextlib
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import canopen
import pytest
from playwright.sync_api import Browser, BrowserContext, Error, Page, expect

from tests.e2e.browser import SIZE, signed_in
from tests.e2e.conftest import Twins, site_for
from tests.e2e.processes import running
from tests.e2e.test_interoperation import EDS
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
MOVE_MS = 30_000
HELD_BACK = ("rotor_locked", "people_out")


def axis_page(context: BrowserContext, demo: str, blade: int, search: str = "") -> Page:
    page = context.new_page()
    page.goto(f"{demo.split('?')[0]}axis?blade={blade}&scene=off{search}")
    expect(page.get_by_test_id("motion")).to_be_visible()
    expect(page.get_by_test_id("axis-angle")).to_have_text(re.compile(r"\d"))
    return page


def angle(page: Page) -> float:
    return float(page.get_by_test_id("axis-angle").inner_text().rstrip("°"))


def press(page: Page, test_id: str) -> None:
    """Press with the pointer and keep it down."""
    button = page.get_by_test_id(test_id)
    expect(button).to_have_attribute("aria-disabled", "false")
    button.hover()
    page.mouse.down()


def take_control(page: Page) -> None:
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control")).to_contain_text("You")
    for name in ("rotor-locked", "people-out"):
        page.get_by_test_id(name).check()
    for name in HELD_BACK:
        expect(page.get_by_test_id(f"interlock-{name}")).to_have_attribute("data-bites", "false")


def prepare(page: Page) -> None:
    press(page, "prepare")
    expect(page.get_by_test_id("proof")).to_contain_text("Proven", timeout=MOVE_MS)
    page.mouse.up()


def give_back(page: Page) -> None:
    page.get_by_test_id("give-back").click()
    expect(page.get_by_test_id("control")).to_have_count(0)


def stands_still(page: Page) -> float:
    """Where the blade stands, once it does."""
    before = angle(page)
    deadline = time.monotonic() + MOVE_MS / 1000
    while time.monotonic() < deadline:
        page.wait_for_timeout(400)
        now = angle(page)
        if now == before:
            return now
        before = now
    raise AssertionError("the blade goes on")


def test_a_blade_is_moved_as_long_as_the_button_is_held(context: BrowserContext, demo: str) -> None:
    page = axis_page(context, demo, 1)
    for name in HELD_BACK:
        expect(page.get_by_test_id(f"interlock-{name}")).to_have_attribute("data-bites", "true")
    expect(page.get_by_test_id("jog-minus")).to_have_attribute("aria-disabled", "true")
    take_control(page)
    prepare(page)
    start = stands_still(page)

    press(page, "jog-minus")
    page.wait_for_function(
        "from => parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) < from - 2", arg=start
    )
    page.mouse.up()
    expect(page.get_by_test_id("motion-ended")).to_contain_text("Jog: let go", timeout=MOVE_MS)
    rest = stands_still(page)
    assert start - 8 < rest < start - 2
    expect(page.get_by_test_id("state-diagram")).to_have_attribute(
        "data-state", re.compile("ready_to_switch_on|switch_on_disabled")
    )

    page.get_by_test_id("angle").fill("80")
    page.get_by_test_id("speed").fill("5")
    page.get_by_test_id("move-to").focus()
    page.keyboard.down("Enter")
    expect(page.get_by_test_id("motion-ended")).to_contain_text("Move: done", timeout=MOVE_MS)
    page.keyboard.up("Enter")
    assert abs(stands_still(page) - 80) < 0.3

    page.get_by_test_id("put-back").click()
    expect(page.get_by_test_id("prepare")).to_be_visible()
    give_back(page)
    page.close()


def state(page: Page, name: str) -> None:
    expect(page.get_by_test_id("state-diagram")).to_have_attribute("data-state", re.compile(name), timeout=MOVE_MS)


def out_of_feather(page: Page, by_deg: float) -> None:
    start = stands_still(page)
    press(page, "jog-minus")
    page.wait_for_function(
        "to => parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) < to",
        arg=start - by_deg,
        timeout=MOVE_MS,
    )
    page.mouse.up()
    stands_still(page)


def test_an_axis_is_enabled_tried_stopped_and_its_fault_reset(context: BrowserContext, demo: str) -> None:
    page, other = axis_page(context, demo, 2), axis_page(context, demo, 2)
    take_control(page)
    prepare(page)
    press(page, "hold")
    state(page, "operation_enabled")
    expect(page.get_by_test_id("allowed-commands")).to_contain_text("Quick stop")
    page.mouse.up()
    expect(page.get_by_test_id("motion-ended")).to_contain_text("Enabled and standing: let go")
    expect(page.get_by_test_id("allowed-commands")).not_to_contain_text("Quick stop")

    out_of_feather(page, 5)
    press(page, "try-feather")
    expect(page.get_by_test_id("feather-result")).to_contain_text("(target 90.00°)", timeout=MOVE_MS)
    page.mouse.up()
    assert abs(stands_still(page) - 90) < 0.5
    out_of_feather(page, 2)
    press(page, "brake-test")
    expect(page.get_by_test_id("brake-result")).to_have_attribute("data-verdict", "holds", timeout=MOVE_MS)
    page.mouse.up()

    press(page, "hold")
    state(other, "operation_enabled")
    expect(other.get_by_test_id("halt")).to_be_disabled()
    other.get_by_test_id("quick-stop").click()  # without control of the axes
    expect(page.get_by_test_id("motion-ended")).to_contain_text("stopped by the drive, or by STOP")
    page.mouse.up()
    other.close()

    page.get_by_test_id("put-back").click()
    expect(page.get_by_test_id("prepare")).to_be_visible()
    faults = f"{demo.split('?')[0]}api/instructor/faults"
    assert context.request.post(faults, data={"kind": "encoder_data", "blade": 2, "values": {}}).ok
    state(page, "^fault$")
    assert context.request.delete(faults).ok
    page.get_by_test_id("reset-fault").click()
    state(page, "ready_to_switch_on|switch_on_disabled")
    give_back(page)
    page.close()


def test_a_move_beyond_the_limits_is_seen_before_and_refused(context: BrowserContext, demo: str) -> None:
    page = axis_page(context, demo, 1)
    preview = page.get_by_test_id("preview")
    page.get_by_test_id("angle").fill("60")
    expect(preview).to_contain_text(re.compile(r"\d+\.\d s: "))
    expect(preview).to_have_attribute("data-beyond", "false")
    page.get_by_test_id("angle").fill("361")
    expect(preview).to_have_attribute("data-beyond", "true")
    expect(preview).to_contain_text("it is refused")
    take_control(page)
    prepare(page)
    before = stands_still(page)
    press(page, "move-to")
    expect(page.get_by_test_id("problem")).to_contain_text("361")
    page.mouse.up()
    assert abs(stands_still(page) - before) < 0.1
    give_back(page)
    page.close()


def test_a_tab_that_is_killed_stops_its_blade(context: BrowserContext, demo: str) -> None:
    page, other = axis_page(context, demo, 2), axis_page(context, demo, 2)
    take_control(page)
    expect(other.get_by_test_id("take-control")).to_have_text("Ask for control")
    prepare(page)
    start = stands_still(other)
    press(page, "jog-minus")
    other.wait_for_function(
        "from => parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) < from - 1", arg=start
    )
    with contextlib.suppress(Error):
        page.goto("chrome://crash")
    expect(other.get_by_test_id("motion-ended")).to_contain_text("quick stop, the page was silent", timeout=MOVE_MS)
    rest = stands_still(other)
    assert rest > start - 8
    page.close()
    expect(other.get_by_test_id("control")).to_have_count(0, timeout=MOVE_MS)
    expect(other.get_by_test_id("take-control")).to_have_text("Take control")
    other.close()


def home_at(page: Page, angle_deg: str) -> None:
    """Type the angle and hold the button long enough."""
    page.get_by_test_id("home-angle").fill(angle_deg)
    button = page.get_by_test_id("home")
    expect(button).to_be_enabled()
    button.hover()
    page.mouse.down()
    done = page.get_by_test_id("axis-angle").get_by_text(f"{float(angle_deg):.2f}°")
    expect(done.or_(page.get_by_test_id("problem"))).to_be_visible(timeout=MOVE_MS)
    page.mouse.up()
    assert page.get_by_test_id("problem").all_inner_texts() == []


def test_the_present_position_is_called_an_angle(context: BrowserContext, demo: str) -> None:
    page = axis_page(context, demo, 3)
    expect(page.get_by_test_id("home")).to_be_disabled()
    take_control(page)
    prepare(page)
    before = stands_still(page)
    home_at(page, "45")
    expect(page.get_by_test_id("motion-ended")).to_contain_text("Homing: done")
    home_at(page, f"{before:.2f}")
    give_back(page)
    page.close()


def test_control_is_asked_for_and_handed_over(context: BrowserContext, demo: str) -> None:
    first, second = axis_page(context, demo, 3), axis_page(context, demo, 3)
    first.get_by_test_id("take-control").click()
    expect(first.get_by_test_id("control")).to_contain_text("You")
    second.get_by_test_id("take-control").click()
    expect(first.get_by_test_id("asked")).to_contain_text("asks for control")
    first.get_by_role("button", name="Keep it").click()
    expect(second.get_by_text("keeps control for now")).to_be_visible()
    second.get_by_test_id("take-control").click()
    first.get_by_role("button", name="Hand over").click()
    expect(second.get_by_test_id("control")).to_contain_text("You")
    expect(first.get_by_test_id("take-control")).to_have_text("Ask for control")
    give_back(second)
    expect(first.get_by_test_id("take-control")).to_have_text("Take control")
    first.close()
    second.close()


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("language", ["en", "de"])
def test_axe_finds_nothing_serious_and_nothing_is_cut(
    context: BrowserContext, demo: str, theme: str, language: str
) -> None:
    page = axis_page(context, demo, 1, f"&theme={theme}&lang={language}")
    page.set_viewport_size(SIZE)
    page.get_by_test_id("take-control").click()
    expect(page.get_by_test_id("control")).to_be_visible()
    stop = page.get_by_test_id("stop").bounding_box()
    assert stop is not None
    assert stop["x"] + stop["width"] <= SIZE["width"]
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
    wide = page.evaluate("() => document.documentElement.scrollWidth")
    assert wide <= SIZE["width"]
    page.get_by_test_id("give-back").click()
    expect(page.get_by_test_id("control")).to_have_count(0)
    page.close()


PROFILE_VELOCITY = 3
ENABLED = (0x06, 0x07, 0x0F)


@pytest.fixture
def foreign(twins: Twins, browser: Browser, tmp_path: Path) -> Iterator[tuple[BrowserContext, str]]:
    """A bench beside an axis that another tool has enabled, and that turns by its word alone."""
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=twins.port, channel="can0")
    try:
        pmc = network.add_node(11, str(EDS / "oat_pmc.eds"))
        pmc.sdo.RESPONSE_TIMEOUT = 5.0
        pmc.nmt.wait_for_heartbeat(timeout=10)
        pmc.sdo[0x6060].raw = PROFILE_VELOCITY
        pmc.sdo[0x60FF].raw = -100
        for word in ENABLED:
            pmc.sdo[0x6040].raw = word
        assert pmc.sdo[0x6041].raw & 0x6F == 0x27, "operation enabled"
    finally:
        network.disconnect()
    serving = ("--data", str(tmp_path / "data"), "serve", "--site", str(twins.site), "--port", "0", "--json")
    with running(*serving) as served:
        url = json.loads(served.wait_for('"url"'))["url"]
        with signed_in(browser, url) as context:
            yield context, url


def test_escape_inside_the_3d_view_stops_what_another_tool_has_moved(foreign: tuple[BrowserContext, str]) -> None:
    """The key goes to the frame, not to the page: nobody holds a button here, and nothing else ends this motion."""
    context, url = foreign
    page = context.new_page()
    page.goto(f"{url.split('?')[0]}axis?blade=1")
    state(page, "operation_enabled")
    canvas = page.frame_locator("iframe").locator("canvas").first
    expect(canvas).to_be_visible(timeout=MOVE_MS)
    before = angle(page)
    page.wait_for_function(
        "to => parseFloat(document.querySelector('[data-testid=axis-angle]').textContent) < to",
        arg=before - 0.5,
        timeout=MOVE_MS,
    )
    page.locator("iframe").click(position={"x": 20, "y": 120}, force=True)
    assert page.evaluate("document.activeElement.tagName") == "IFRAME"
    page.keyboard.press("Escape")
    state(page, "ready_to_switch_on|switch_on_disabled|quick_stop_active")
    stands_still(page)
    page.close()


SAVE_MS = 10_000
SAVES = """() => {
  for (const blade of [1, 2, 3]) for (const unit of ["pmm", "pmc"]) {
    fetch(`/api/live/devices/wtg-07/blade-${blade}/${unit}/save`, {
      method: "POST", headers: { "content-type": "application/json" }, body: "{}",
    });
  }
}"""
SAVE_REQUEST, CONTROLWORD_REQUEST = b"\x10\x10", b"\x40\x60"


class Seen:
    """When a first request of each kind went to the first axis, in ms since 1970."""

    def __init__(self, network: canopen.Network) -> None:
        self.at_ms: dict[bytes, float] = {}
        network.subscribe(0x60B, self.hear)

    def hear(self, _can_id: int, data: bytearray, _t_s: float) -> None:
        self.at_ms.setdefault(bytes(data[1:3]), time.time() * 1000)

    def until(self, page: Page, request: bytes) -> float:
        deadline = time.monotonic() + MOVE_MS / 1000
        while request not in self.at_ms:
            assert time.monotonic() < deadline, "no such request"
            page.wait_for_timeout(20)
        return self.at_ms[request]


def test_stop_does_not_wait_for_the_requests_of_its_own_page(browser: Browser, tmp_path: Path) -> None:
    """A browser has six connections to a server; all of them wait for saves of ten seconds."""
    slow = [f"eeprom_slow@0s,node={node},save_ms={SAVE_MS}" for node in (1, 2, 3, 11, 12, 13)]
    faults = [part for fault in slow for part in ("--fault", fault)]
    with running("twin", "oat", "--can", "socketcand:127.0.0.1:0", "--json", *faults) as twins:
        address = json.loads(twins.wait_for('"address"'))["address"]
        network = canopen.Network()
        network.connect(interface="socketcand", host="127.0.0.1", port=int(address.rsplit(":", 1)[1]), channel="can0")
        serving = ("--data", str(tmp_path / "data"), "serve", "--port", "0", "--json")
        with (
            contextlib.closing(SimpleNamespace(close=network.disconnect)),
            running(*serving, "--site", str(site_for(address, tmp_path))) as served,
        ):
            url = json.loads(served.wait_for('"url"'))["url"]
            with signed_in(browser, url) as context:
                page = context.new_page()
                page.goto(f"{url.split('?')[0]}axis?blade=1&scene=off")
                expect(page.get_by_test_id("axis-angle")).to_have_text(re.compile(r"\d"))
                seen = Seen(network)
                page.evaluate(SAVES)
                saving_ms = seen.until(page, SAVE_REQUEST)
                page.get_by_test_id("stop").click()
                waited_ms = seen.until(page, CONTROLWORD_REQUEST) - saving_ms
                assert waited_ms < SAVE_MS / 2, "not until the first of them has ended"
