"""Restores in a real browser, on running twins: planned, run, confirmed, proven, refused, put back by themselves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.browser import SIZE, WAIT_MS, answer_of
from tests.e2e.conftest import Twins
from tests.e2e.processes import running
from tests.e2e.test_browser import hold
from tests.e2e.test_page_quality import AXE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

RUN_MS = 60_000
"""A restore with two saves, two restarts and three readings of a whole station, on a busy machine."""
SOURCE, TARGET = "wtg-07/blade-1", "wtg-07/blade-2"
PMM, PMC = f"{TARGET}/pmm", f"{TARGET}/pmc"
CHANGED = ((PMM, "3110:01", 470), (PMM, "30FA:02", 740), (PMC, "6065", 200))


@pytest.fixture(scope="module")
def sets(context: BrowserContext, demo: str) -> str:
    """Ids of the sets of blade 1 as it was found when the visit began."""
    page = context.new_page()
    page.goto(f"{demo.split('?')[0]}?scene=off")
    found = found_sets(page)
    page.close()
    return found


def tab(demo: str, search: str = "") -> str:
    return f"{demo.split('?')[0]}sets?tab=restore&scene=off&{search}"


def api(page: Page, method: str, path: str, body: object = None) -> Any:
    """What the server answers to the page."""
    status, answer = page.evaluate(
        """async ([method, path, body]) => {
            const headers = { "content-type": "application/json" };
            const sent = body === null ? {} : { body: JSON.stringify(body) };
            const answer = await fetch(path, { method, headers, ...sent });
            return [answer.status, await answer.json()];
        }""",
        [method, path, body],
    )
    assert status == 200, answer
    return answer


def found_sets(page: Page) -> str:
    """Ids of the sets of blade 1, once they are in the library."""
    found: list[str] = answer_of(
        page,
        """async (station) => {
            const records = (await (await fetch("/api/sets")).json()).records;
            const own = ["pmm", "pmc"].map((name) => records.find((one) => one.origin.device === `${station}/${name}`));
            return own.every(Boolean) && own.map((one) => one.id);
        }""",
        SOURCE,
        RUN_MS,
    )
    return ",".join(found)


def passing_plan(page: Page, order: dict[str, Any]) -> dict[str, Any]:
    """The plan, once nothing speaks against it any more."""
    for _ in range(20):
        plan: dict[str, Any] = api(page, "POST", "/api/live/restore/plan", order)
        if not plan["refusals"]:
            return plan
    raise AssertionError(plan["refusals"])


def disturb(page: Page, changes: tuple[tuple[str, str, int], ...] = CHANGED) -> None:
    """Other values in the RAM of blade 2 than the sets hold."""
    for slug, address, raw in changes:
        api(page, "POST", f"/api/live/devices/{slug}/write", {"address": address, "raw": raw})


def ram(page: Page, slug: str, address: str) -> object:
    """What the device answers when it is read now."""
    job = api(page, "POST", f"/api/live/devices/{slug}/read", {"addresses": [address]})
    answer_of(page, "async (id) => (await (await fetch(`/api/live/jobs/${id}`)).json()).state !== 'running'", job["id"])
    both = api(page, "POST", "/api/compare", {"columns": [f"live:{slug}", f"default:{slug}"]})
    return next(row["cells"][0]["raw"] for row in both["rows"] if row["address"] == address)


def test_a_drive_that_is_on_is_refused_with_the_reason_until_it_is_off(page: Page, demo: str, sets: str) -> None:
    page.goto(tab(demo))
    disturb(page)
    api(page, "POST", "/api/live/feather", {})
    page.goto(tab(demo, f"station={TARGET}&sets={sets}"))
    expect(page.get_by_test_id("refusal-drive-enabled")).to_contain_text("Blade 2 PMC", timeout=RUN_MS)
    expect(page.get_by_test_id("restore-hold")).to_be_disabled()
    assert problems(page) == []
    page.get_by_test_id("stop").click()
    expect(page.get_by_test_id("plan-again")).to_be_enabled(timeout=RUN_MS)

    def passes() -> bool:
        page.get_by_test_id("plan-again").click()
        expect(page.get_by_test_id("restore-plan")).to_have_attribute("aria-busy", "false", timeout=RUN_MS)
        return page.get_by_test_id("precheck-passed").is_visible()

    assert any(passes() for _ in range(10))
    expect(page.get_by_test_id("restore-hold")).to_be_enabled()


def test_a_station_gets_the_values_of_another_one_saved_and_proven(page: Page, demo: str, sets: str) -> None:
    """Planned, one object left out and put back, run, found again after a reload, confirmed, proven, on record."""
    page.goto(tab(demo))
    disturb(page)
    page.goto(tab(demo, f"station={TARGET}&sets={sets}"))
    expect(page.get_by_test_id("precheck-passed")).to_be_visible(timeout=RUN_MS)
    expect(page.get_by_test_id("pick-groups")).to_contain_text("3 of 3")
    expect(page.get_by_test_id("what-happens")).to_contain_text("2 values are written to Blade 2 PMM")
    offset = page.get_by_test_id(f"plan-{PMC} 607C")
    expect(offset).to_contain_text("of another machine")
    assert problems(page) == []

    page.get_by_test_id(f"pick-{PMC} 6065").click()
    expect(page.get_by_test_id("pick-groups")).to_contain_text("2 of 3")
    expect(page.get_by_test_id("restore-hold")).to_contain_text("Restore 2 values to Blade 2")
    row = page.get_by_test_id(f"plan-{PMC} 6065")
    row.focus()
    row.press("Enter")
    expect(page.get_by_test_id("restore-hold")).to_contain_text("Restore 3 values to Blade 2")

    page.get_by_test_id("work-order").fill("WO-20417")
    page.get_by_test_id("restore-reason").fill("as blade 1")
    expect(page.get_by_test_id("restore-hold")).to_be_enabled(timeout=RUN_MS)
    hold(page, "restore-hold")
    expect(page.get_by_test_id("restore-confirm")).to_be_visible(timeout=RUN_MS)
    page.reload()
    expect(page.get_by_test_id("restore-confirm")).to_contain_text("Keep the new values of Blade 2?")
    expect(page.get_by_test_id("run-" + f"{PMM} 3110:01")).to_contain_text("read back")
    assert problems(page) == []

    page.get_by_role("link", name="Overview").click()
    banner = page.get_by_test_id("restore-banner-awaiting-confirmation")
    expect(banner).to_contain_text("Restore of Blade 2")
    banner.get_by_test_id("restore-banner-open").click()
    hold(page, "confirm-hold")
    expect(page.get_by_test_id("restore-end-new")).to_be_visible(timeout=RUN_MS)
    for slug, address, _ in CHANGED:
        expect(page.get_by_test_id(f"run-{slug} {address}")).to_contain_text("proven")
    assert ram(page, PMM, "3110:01") == 500
    assert ram(page, PMC, "6065") == 100

    with page.expect_download() as downloading:
        page.get_by_test_id("record-html").click()
    assert "WO-20417" in downloading.value.path().read_text("utf-8")
    page.get_by_test_id("restore-undo").click()
    expect(page.get_by_test_id(f"plan-{PMM} 3110:01")).to_contain_text("47.0", timeout=RUN_MS)
    page.get_by_test_id("restore-leave").click()
    expect(page.get_by_test_id("table-restore")).to_contain_text("WO-20417")


def test_what_nobody_confirms_is_put_back_and_said_so_in_german(page: Page, demo: str, sets: str) -> None:
    page.goto(tab(demo))
    api(page, "POST", "/api/live/stop", {})
    disturb(page, ((PMM, "3110:01", 480),))
    order = {"station": TARGET, "sets": sets.split(","), "selected": [{"device": PMM, "address": "3110:01"}]}
    plan = passing_plan(page, order)
    begun = api(page, "POST", "/api/live/restore", {**order, "plan_hash": plan["hash"], "confirm_s": 5})
    page.goto(tab(demo, f"restore={begun['id']}&lang=de"))
    expect(page.get_by_test_id("restore-confirm")).to_contain_text("Neue Werte von Blatt 2 behalten?", timeout=RUN_MS)
    expect(page.get_by_test_id("restore-end-old")).to_contain_text("Blatt 2 hat die alten Werte", timeout=RUN_MS)
    expect(page.get_by_test_id("restore-cause")).to_contain_text("niemand")
    expect(page.get_by_test_id(f"run-{PMM} 3110:01")).to_contain_text("alter Wert zurückgeschrieben")
    assert ram(page, PMM, "3110:01") == 480
    assert problems(page) == []


def test_an_expert_restores_as_one_only_by_choice_and_what_is_mended_is_told(page: Page, demo: str, sets: str) -> None:
    """From here on there is a user, and the session of the launch is over."""
    page.goto(tab(demo))
    api(page, "POST", "/api/live/stop", {})
    disturb(page, ((PMC, "6510:04", 410),))
    plan = tab(demo, f"station={TARGET}&sets={sets}")
    page.goto(plan)
    expect(page.get_by_test_id("findings-mended")).to_contain_text("6510:04 = 410 V", timeout=RUN_MS)
    expect(page.get_by_test_id("findings-standing")).to_contain_text("the axis goes on")
    expect(page.get_by_test_id("findings-new")).to_have_count(0)
    switch = page.get_by_test_id("restore-expert")
    expect(switch).to_have_count(0)
    anna = {"name": "Anna", "password": "pitch and yaw 7"}
    assert api(page, "POST", "/api/users", anna)["role"] == "expert"
    assert api(page, "POST", "/api/login", anna)["role"] == "expert"
    with page.expect_request("**/restore/plan") as asked:
        page.goto(plan)
    assert json.loads(asked.value.post_data or "")["expert"] is False
    expect(switch).not_to_be_checked(timeout=RUN_MS)
    with page.expect_request("**/restore/plan") as asked:
        switch.check()
    assert json.loads(asked.value.post_data or "")["expert"] is True
    expect(switch).to_be_checked()
    assert problems(page) == []


def test_a_stop_halts_a_restore_and_an_expert_gives_it_up(page: Page, demo: str, sets: str) -> None:
    """Pressed while the devices save: nothing is restarted, nothing rolled back, until a person decides."""
    page.goto(tab(demo))
    api(page, "POST", "/api/live/stop", {})
    disturb(page, ((PMM, "3110:01", 480),))
    order = {"station": TARGET, "sets": sets.split(","), "restart": True}
    plan = passing_plan(page, order)
    begun = api(page, "POST", "/api/live/restore", {**order, "plan_hash": plan["hash"]})
    page.goto(tab(demo, f"restore={begun['id']}"))
    expect(page.get_by_test_id("restore-confirm")).to_be_visible(timeout=RUN_MS)
    path = f"/api/live/restores/{begun['id']}"
    api(page, "POST", f"{path}/confirm", {})
    api(page, "POST", "/api/live/stop", {})
    expect(page.get_by_test_id("restore-end-incomplete")).to_be_visible(timeout=RUN_MS)
    expect(page.get_by_test_id("restore-cause")).to_contain_text("STOP or FEATHER")
    page.get_by_test_id("give-up-open").click()
    expect(page.get_by_test_id("give-up-hold")).to_be_disabled()
    page.get_by_test_id("give-up-reason").fill("PMM exchanged")
    assert problems(page) == []
    hold(page, "give-up-hold")
    expect(page.get_by_test_id("restore-end-given-up")).to_contain_text("may hold old and new values")
    assert api(page, "GET", path)["blocks"] is False
    disturb(page, ((PMM, "3110:01", 490),))


def problems(page: Page) -> list[str]:
    """Serious findings of axe on the page as it stands."""
    page.add_script_tag(path=str(AXE))
    found: list[dict[str, Any]] = page.evaluate(
        """async () => (await axe.run(document, { resultTypes: ["violations"] })).violations
            .filter((one) => ["serious", "critical"].includes(one.impact))
            .map((one) => ({ id: one.id, nodes: one.nodes.map((node) => node.html.slice(0, 200)) }))"""
    )
    return [f"{one['id']}: {one['nodes']}" for one in found]


def test_a_restore_that_was_cut_off_is_told_on_every_page_and_taken_back(
    browser: Browser, twins: Twins, tmp_path: Path
) -> None:
    """The server is killed while new values stand in RAM unconfirmed; the next one blocks the blade and tells of it."""
    arguments = ("serve", "--site", str(twins.site), "--port", "0", "--data", str(tmp_path / "data"), "--json")
    with running(*arguments) as server:
        page = browser.new_page(viewport=SIZE, locale="en-GB", reduced_motion="reduce", bypass_csp=True)
        page.set_default_timeout(WAIT_MS)
        page.goto(json.loads(server.wait_for('"url"'))["url"] + "&scene=off")
        expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
        order = {"station": TARGET, "sets": found_sets(page).split(",")}
        disturb(page, ((PMM, "3110:01", 480),))
        plan = passing_plan(page, order)
        begun = api(page, "POST", "/api/live/restore", {**order, "plan_hash": plan["hash"]})
        answer_of(
            page,
            "async (id) => (await (await fetch(`/api/live/restores/${id}`)).json()).state === 'awaiting-confirmation'",
            begun["id"],
            RUN_MS,
        )
        server.popen.kill()
        server.popen.wait()
        page.close()
    with running(*arguments) as server:
        page = browser.new_page(viewport=SIZE, locale="en-GB", reduced_motion="reduce", bypass_csp=True)
        page.set_default_timeout(WAIT_MS)
        page.goto(json.loads(server.wait_for('"url"'))["url"] + "&scene=off")
        banner = page.get_by_test_id("restore-banner-incomplete")
        expect(banner).to_contain_text("Restore of Blade 2 incomplete: motion is blocked", timeout=RUN_MS)
        expect(banner).to_contain_text("STOP and FEATHER work")
        expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
        assert problems(page) == []
        page.get_by_role("link", name="Bus").click()
        expect(banner.get_by_test_id("resume-hold")).to_be_enabled()
        banner.get_by_test_id("restore-banner-open").click()
        expect(page.get_by_test_id("restore-end-incomplete")).to_contain_text("Blade 2 is incomplete")
        assert problems(page) == []
        hold(page, "roll-back-hold")
        expect(page.get_by_test_id("restore-end-old")).to_be_visible(timeout=RUN_MS)
        assert ram(page, PMM, "3110:01") == 480
        page.close()
