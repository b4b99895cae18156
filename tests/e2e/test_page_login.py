"""Signing in, in a real browser: the first user ends the launch session, a viewer changes nothing and is told why."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, ViewportSize, expect, sync_playwright

from tests.e2e.browser import CHROMIUM, FLAGS
from tests.e2e.processes import running

pytestmark = [pytest.mark.browser, pytest.mark.timeout(180)]

SIZE: ViewportSize = {"width": 1366, "height": 768}
WAIT_MS = 30_000
EXPERT, VIEWER = ("Edda Expert", "wind turns blades"), ("Vera Viewer", "only looking here")
expect.set_options(timeout=15_000)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """One tab on a demo of its own, in order."""
    data = tmp_path_factory.mktemp("data")
    with running("demo", "--port", "0", "--data", str(data), "--json") as process, sync_playwright() as playwright:
        url = json.loads(process.wait_for('"url"'))["url"]
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        context = chromium.new_context(viewport=SIZE, color_scheme="dark", locale="en-GB", base_url=url.split("?")[0])
        context.set_default_timeout(WAIT_MS)
        tab = context.new_page()
        tab.goto(url)
        tab.goto("/settings?section=users&scene=off")
        yield tab
        context.close()
        chromium.close()


def sign_in(page: Page, name: str, password: str) -> None:
    page.get_by_test_id("login-name").fill(name)
    page.get_by_test_id("login-password").fill(password)
    page.get_by_test_id("login-submit").click()


def sign_out(page: Page) -> None:
    page.get_by_test_id("user").click()
    page.get_by_test_id("logout").click()
    expect(page.get_by_test_id("login")).to_be_visible()


def test_the_first_user_ends_what_the_launch_token_opened(page: Page) -> None:
    expect(page.get_by_test_id("first-user")).to_contain_text("from then on everybody signs in", timeout=WAIT_MS)
    page.get_by_test_id("new-name").fill(EXPERT[0])
    page.get_by_test_id("new-password").fill("short")
    expect(page.get_by_test_id("make-user")).to_be_disabled()
    page.get_by_test_id("new-password").fill(EXPERT[1])
    page.get_by_test_id("make-user").click()
    expect(page.get_by_test_id("login")).to_be_visible()
    page.reload()
    expect(page.get_by_test_id("login")).to_be_visible()


def test_a_wrong_password_says_so_in_the_language_chosen(page: Page) -> None:
    sign_in(page, EXPERT[0], "this is not it")
    expect(page.get_by_test_id("login-error")).to_have_text("Name or password is wrong.")
    page.get_by_test_id("login-language").click()
    expect(page.get_by_test_id("login-error")).to_have_text("Name oder Passwort ist falsch.")
    page.get_by_test_id("login-language").click()


def test_an_expert_adds_a_viewer(page: Page) -> None:
    sign_in(page, *EXPERT)
    expect(page.get_by_test_id("user-Edda Expert")).to_be_visible(timeout=WAIT_MS)
    expect(page.get_by_test_id("mode")).to_contain_text("TWIN")
    page.get_by_test_id("add-user").click()
    form = page.get_by_test_id("new-user")
    form.get_by_test_id("new-name").fill(VIEWER[0])
    form.get_by_test_id("new-password").fill(VIEWER[1])
    form.get_by_role("combobox", name="Role").click()
    page.get_by_role("option", name="viewer").click()
    page.get_by_test_id("make-user").click()
    expect(page.get_by_test_id("user-Vera Viewer")).to_be_visible()
    sign_out(page)


def test_a_viewer_sees_all_but_changes_nothing_and_is_told_why(page: Page) -> None:
    sign_in(page, *VIEWER)
    expect(page.get_by_test_id("users-locked")).to_contain_text("You are signed in as viewer", timeout=WAIT_MS)
    page.goto("/settings?section=polling&scene=off")
    page.get_by_test_id("polling-period_s").fill("500")
    expect(page.get_by_test_id("save-polling")).to_be_disabled()
    page.get_by_test_id("save-polling").hover(force=True)
    expect(page.get_by_role("tooltip")).to_contain_text("needs the role technician")
    page.get_by_test_id("connect-menu").click()
    expect(page.get_by_test_id("disconnect")).to_be_disabled()
    page.keyboard.press("Escape")
    status = page.evaluate(
        """async () => (await fetch("/api/settings/polling", {method: "PUT",
        headers: {"content-type": "application/json"}, body: JSON.stringify(
        {period_s: 1, slow_every: 10, rare_every: 100, load_cap: 0.6, devices: {}})})).status"""
    )
    assert status == 403, "the server refuses what the page does not offer"
    expect(page.get_by_test_id("stop")).to_be_enabled()


def test_a_session_that_ends_elsewhere_leads_to_the_login(page: Page) -> None:
    page.evaluate(
        """() => fetch("/api/logout", {method: "POST", headers: {"content-type": "application/json"}, body: "{}"})"""
    )
    expect(page.get_by_test_id("login")).to_be_visible()


def test_failures_in_a_row_must_wait(page: Page) -> None:
    for _ in range(12):
        if page.get_by_test_id("login-submit").inner_text().startswith("Wait"):
            break
        sign_in(page, EXPERT[0], "wrong again and again")
        expect(page.get_by_test_id("login-error")).to_be_visible()
        expect(page.get_by_test_id("login-password")).to_have_value("")
    expect(page.get_by_test_id("login-submit")).to_contain_text("Wait")
    expect(page.get_by_test_id("login-submit")).to_be_disabled()
    expect(page.get_by_test_id("login-error")).to_contain_text("Too many failed attempts")
