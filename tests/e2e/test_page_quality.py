"""What holds in every room: no serious finding of axe in either theme, a small script, and work by keyboard alone."""

from __future__ import annotations

import gzip
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.browser import SIZE, WAIT_MS
from tests.e2e.processes import ROOT

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

AXE = ROOT / "frontend" / "node_modules" / "axe-core" / "axe.min.js"
BUDGET = 350_000
"""Compressed script of the first load, in bytes."""
PLACES = (
    "",
    "axis?blade=2",
    "parameters?device=wtg-07/blade-1/pmm",
    "parameters?device=wtg-07/blade-1/pmm&view=side&edit=3110:01",
    "sets",
    "sets?tab=restore",
    "sets?tab=compare",
    "sets?tab=compare&columns=live:wtg-07/blade-1/pmm,default:wtg-07/blade-1/pmm&rows=all&edit=3201:04",
    "sets?tab=blades&device=wtg-07/blade-1/pmc",
    "sets?tab=fleet&rows=map",
    "sets?tab=motors",
    "sets?tab=motors&motor=0197a000-0000-7000-8000-00000000e001",
    "sets?tab=motors&motor=new",
    "sets?tab=motors&columns=motor:0197a000-0000-7000-8000-00000000e001,live:wtg-07/blade-1/pmc",
    "recordings",
    "bus",
    "bus?tab=ids",
    "bus?tab=nodes",
    "bus?tab=sdo",
    "bus?tab=load",
    "procedures",
    "settings",
    "settings?section=turbines",
    "settings?section=polling",
    "settings?section=users",
    "settings?section=audit",
    "settings?section=about",
    "instructor",
    "instructor?tab=scenarios",
)
ROOMS = ("Axis", "Parameters", "Sets", "Recordings", "Bus", "Procedures", "Settings", "Instructor", "Overview")


def address(demo: str, place: str, **search: str) -> str:
    joint = "&" if "?" in place else "?"
    return f"{demo.split('?')[0]}{place}{joint}scene=off&" + "&".join(f"{k}={v}" for k, v in search.items())


def settle(page: Page) -> None:
    """Until the room is there and no loader turns."""
    expect(page.locator("main")).not_to_be_empty()
    expect(page.locator("main .mantine-Loader-root")).to_have_count(0)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_no_room_has_a_serious_finding_of_axe(context: BrowserContext, demo: str, theme: str) -> None:
    page = context.new_page()
    found: list[str] = []
    for place in PLACES:
        page.goto(address(demo, place, theme=theme))
        settle(page)
        page.add_script_tag(path=AXE)
        result: dict[str, Any] = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")
        assert result["passes"], "axe has looked at something"
        found += [
            f"/{place} {one['impact']} {one['id']}: {node['target']} {node['html'][:160]}"
            for one in result["violations"]
            if one["impact"] in ("serious", "critical")
            for node in one["nodes"][:3]
        ]
    page.close()
    assert found == [], "\n".join(found)


def test_axe_would_find_what_is_wrong(context: BrowserContext, demo: str) -> None:
    page = context.new_page()
    page.goto(address(demo, ""))
    settle(page)
    page.evaluate("() => document.querySelector('main').append(document.createElement('button'))")
    page.add_script_tag(path=AXE)
    result = page.evaluate("() => axe.run(document)")
    page.close()
    assert "button-name" in {one["id"] for one in result["violations"]}


def test_the_first_load_stays_within_the_budget_of_script(browser: Browser, context: BrowserContext, demo: str) -> None:
    fresh = browser.new_context(viewport=SIZE, storage_state=context.storage_state())
    page = fresh.new_page()
    scripts: dict[str, int] = {}
    page.on(
        "response",
        lambda answer: (
            scripts.update({answer.url: len(gzip.compress(answer.body(), 9))})
            if answer.request.resource_type == "script"
            else None
        ),
    )
    page.goto(address(demo, ""))
    expect(page.get_by_test_id("blade-1").get_by_test_id("angle")).to_contain_text("°", timeout=WAIT_MS)
    fresh.close()
    assert scripts, "the page has scripts"
    print(f"first load: {sum(scripts.values()) / 1000:.0f} kB of compressed script in {len(scripts)} files")
    assert sum(scripts.values()) < BUDGET, scripts


def test_every_room_is_reached_and_shows_its_focus_by_keyboard_alone(context: BrowserContext, demo: str) -> None:
    page = context.new_page()
    page.goto(address(demo, ""))
    settle(page)
    for room in ROOMS:
        tab_to(page, room)
        page.keyboard.press("Enter")
        expect(page.get_by_role("navigation", name="Rooms").locator("[aria-current=page]")).to_have_text(room)
        settle(page)
        outline = page.evaluate("() => getComputedStyle(document.activeElement).outlineStyle")
        assert outline != "none", f"nobody sees where the focus is on {room}"
    page.close()


def test_a_parameter_is_found_and_staged_by_keyboard_alone(context: BrowserContext, demo: str) -> None:
    page = context.new_page()
    page.goto(address(demo, "parameters?device=wtg-07/blade-1/pmm"))
    expect(
        page.get_by_test_id("value-wtg-07/blade-1/pmm-3110:01").or_(page.get_by_test_id("filter")).first
    ).to_be_visible()
    page.keyboard.press("/")
    expect(page.get_by_test_id("filter")).to_be_focused()
    page.keyboard.type("3110:01")
    cell = page.locator("[data-testid^='value-'][data-testid$='3110:01']")
    expect(cell).to_contain_text("50.0", timeout=WAIT_MS)
    page.keyboard.press("ArrowDown")  # into the table, where the group stands first
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    page.keyboard.press("Control+a")
    page.keyboard.type("49")
    page.keyboard.press("Enter")
    expect(cell).to_contain_text("50.0 → 49.0")
    expect(page.get_by_test_id("review")).to_be_visible()
    page.close()


def tab_to(page: Page, name: str) -> None:
    """Press Tab until the focus stands on the link ``name`` of the navigation."""
    for _ in range(80):
        page.keyboard.press("Tab")
        at = page.evaluate(
            "() => document.activeElement.closest('nav') ? document.activeElement.textContent.trim() : ''"
        )
        if at == name:
            return
    raise AssertionError(f"Tab never came to {name}")
