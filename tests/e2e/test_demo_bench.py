"""The demo's other turbines, chosen, read and left again, and what the page shows of the drive on Modbus TCP."""

from __future__ import annotations

import contextlib
import json
import socket
import time
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from tests.e2e.browser import WAIT_MS, signed_in
from tests.e2e.processes import START_S, running

pytestmark = [pytest.mark.timeout(240)]

BENCH = "bench-pd4e"
SERVO = f"{BENCH}/bench/servo"
USUAL_PORT = 1502
LINE_BENCH = "bench-ed2"
expect.set_options(timeout=20_000)


@dataclass(frozen=True)
class Demo:
    """A running demo: the address that it printed, and its data folder."""

    url: str
    data: Path

    @property
    def home(self) -> str:
        return self.url.partition("?")[0]

    @property
    def servo(self) -> str:
        """Where the site file says that the drive is."""
        site = tomllib.loads((self.data / "demo-site.toml").read_text(encoding="utf-8"))
        address: str = site["turbine"][BENCH]["station"]["bench"]["device"]["servo"]["address"]
        return address


@contextlib.contextmanager
def started(data: Path) -> Iterator[Demo]:
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        yield Demo(json.loads(process.wait_for('"url"'))["url"], data)


def until(client: httpx.Client, path: str, holds: Any) -> Any:
    """The first answer for which ``holds``."""
    end_s = time.monotonic() + START_S
    while True:
        answer = client.get(path)
        if answer.status_code == 200 and holds(answer.json()):
            return answer.json()
        if time.monotonic() > end_s:
            raise AssertionError(f"{path}: {answer.text[:500]}")
        time.sleep(0.05)  # the API has no event for it


def test_one_turbine_after_the_other(tmp_path: Path) -> None:
    """Also where the usual port is taken: then the drive is on another one, and the site file says on which."""
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):  # somebody has it already: as good
            stack.enter_context(contextlib.closing(socket.create_server(("127.0.0.1", USUAL_PORT))))
        demo = stack.enter_context(started(tmp_path))
        assert demo.servo.startswith("127.0.0.1:") and demo.servo != f"127.0.0.1:{USUAL_PORT}"
        page = stack.enter_context(httpx.Client(base_url=demo.home, follow_redirects=True, timeout=30))
        assert page.get(f"?{demo.url.partition('?')[2]}").status_code == 200
        known = {one["slug"]: one["connected"] for one in page.get("api/turbines").json()}
        assert known == {"wtg-07": True, BENCH: False, LINE_BENCH: False}, "the blades are connected at first"
        assert page.get("api/instructor").json()["available"] is True

        assert page.post("api/live/connect", json={"turbine": BENCH}).status_code == 200
        turbine = until(page, "api/live/turbine", lambda shown: shown["mode"] == "twin")
        assert (turbine["slug"], turbine["bus"]["interface"]) == (BENCH, "modbus-tcp")
        refused = page.get("api/instructor")
        assert (refused.status_code, refused.json()["code"]) == (409, "no_instructor"), "it reaches the blades only"
        job = page.post(f"api/live/devices/{SERVO}/read", json={"addresses": ["1008", "6041", "6064"]}).json()
        read = until(page, f"api/live/jobs/{job['id']}", lambda shown: shown["state"] != "running")
        assert (read["state"], read["failed"]) == ("done", [])

        assert page.post("api/live/disconnect", json={}).status_code == 200
        assert page.get("api/live/turbine").json() is None
        assert page.post("api/live/connect", json={"turbine": "wtg-07"}).status_code == 200
        until(page, "api/live/turbine", lambda shown: shown["slug"] == "wtg-07" and shown["mode"] == "twin")
        assert page.get("api/instructor").json()["available"] is True


def test_the_cylinders_are_connected_and_read(tmp_path: Path) -> None:
    with started(tmp_path) as demo, httpx.Client(base_url=demo.home, follow_redirects=True, timeout=30) as page:
        page.get(f"?{demo.url.partition('?')[2]}")
        assert page.post("api/live/connect", json={"turbine": LINE_BENCH}).status_code == 200
        turbine = until(page, "api/live/turbine", lambda shown: shown["slug"] == LINE_BENCH)
        assert turbine["bus"]["interface"].startswith("profibus:/dev/")
        device = f"{LINE_BENCH}/bench/cylinders"
        job = page.post(f"api/live/devices/{device}/read", json={"addresses": ["0/38", "12/61", "12/100"]}).json()
        read = until(page, f"api/live/jobs/{job['id']}", lambda shown: shown["state"] != "running")
        assert (read["state"], read["failed"]) == ("done", [])


def test_where_the_extra_is_missing_the_cylinders_say_how_to_get_it(tmp_path: Path) -> None:
    """An interpreter without pyprofibus: the demo runs, and only this turbine cannot be connected."""
    without = tmp_path / "without"
    without.mkdir()
    (without / "sitecustomize.py").write_text("import sys\nsys.modules['pyprofibus'] = None\n", encoding="utf-8")
    with running("demo", "--port", "0", "--data", str(tmp_path / "data"), "--json", PYTHONPATH=str(without)) as process:
        url = json.loads(process.wait_for('"url"'))["url"]
        with httpx.Client(base_url=url.partition("?")[0], follow_redirects=True, timeout=30) as page:
            page.get(f"?{url.partition('?')[2]}")
            until(page, "api/live/turbine", lambda shown: shown["slug"] == "wtg-07" and shown["mode"] == "twin")
            assert LINE_BENCH in {one["slug"] for one in page.get("api/turbines").json()}
            refused = page.post("api/live/connect", json={"turbine": LINE_BENCH})
            assert refused.status_code >= 400
            assert "pip install 'hubside[profibus]'" in refused.json()["text"]


# -- in the page ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demo]:
    with started(tmp_path_factory.mktemp("data")) as demo:
        yield demo


@pytest.fixture(scope="module")
def let_in(browser: Browser, bench: Demo) -> Iterator[BrowserContext]:
    with signed_in(browser, bench.url, reduced_motion="reduce") as context:
        yield context


@pytest.fixture
def page(let_in: BrowserContext) -> Iterator[Page]:
    page = let_in.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert errors == []


@pytest.mark.browser
def test_the_page_goes_over_to_the_bench(page: Page, bench: Demo) -> None:
    page.goto(f"{bench.home}parameters?scene=off")
    expect(page.get_by_test_id("turbine")).to_have_text("WTG-07")
    expect(page.get_by_role("link", name="Instructor")).to_be_visible()
    page.get_by_test_id("connect-menu").click()
    page.get_by_test_id(f"connect-{BENCH}").click()
    expect(page.get_by_test_id("turbine")).to_have_text("Bench PD4-E", timeout=WAIT_MS)
    expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
    expect(page.get_by_role("link", name="Instructor")).to_be_hidden()
    page.goto(f"{bench.home}parameters?device={SERVO}&edit=6041&scene=off")
    expect(page.get_by_test_id("value-6041")).to_contain_text("0640h", timeout=WAIT_MS)


@pytest.mark.browser
def test_the_scope_takes_the_signals_of_its_axis(page: Page, bench: Demo) -> None:
    page.goto(f"{bench.home}axis?tab=scope&scene=off")
    expect(page.get_by_test_id("turbine")).to_have_text("Bench PD4-E", timeout=WAIT_MS)
    expect(page.get_by_test_id("axis-tab-scope")).to_be_visible()
    expect(page.get_by_test_id("axis-tab-pdo")).to_have_count(0)  # its bus has none
    page.get_by_test_id("preset-motion").click()
    signals = page.get_by_test_id("chosen-signals").get_by_role("listitem")
    expect(signals).to_have_count(5)
    page.get_by_test_id("arm").click()
    for number in range(5):
        expect(signals.nth(number)).to_contain_text("polled, about", timeout=WAIT_MS)
    page.get_by_role("button", name="Trigger now").click()
    expect(page.get_by_test_id("scope-plot-bits").locator("canvas")).to_be_visible(timeout=WAIT_MS)


@pytest.mark.browser
def test_a_drive_is_asked_and_added_by_its_address(page: Page, bench: Demo) -> None:
    """A bus is made, its range saved; only then the address is asked, and what answered is taken into the turbine."""
    page.goto(f"{bench.home}settings?section=turbines&scene=off")
    page.get_by_test_id("add-turbine").click()
    page.get_by_test_id("turbine-name").fill("Other bench")
    page.get_by_test_id("turbine-slug").fill("other-bench")
    page.get_by_test_id("bus-kind-can0").click()
    page.get_by_role("option", name="Modbus TCP").click()
    ranges = page.get_by_test_id("bus-ranges")
    ranges.fill("nobody")
    ranges.press("Enter")
    expect(page.get_by_text("“nobody” is no address")).to_be_visible()
    expect(page.get_by_test_id("save-turbine")).to_be_disabled()
    ranges.press("Backspace")
    ranges.fill(bench.servo)
    ranges.press("Enter")
    page.get_by_test_id("by-address-lan").click()
    address = page.get_by_test_id("new-address")
    address.fill("127.0.0.1:7")
    expect(page.get_by_text("Not within the ranges of bus lan.")).to_be_visible()
    expect(page.get_by_test_id("ask-address")).to_be_disabled()
    page.get_by_test_id("save-turbine").click()
    expect(page.get_by_test_id("turbine-other-bench")).to_be_visible()

    page.get_by_test_id("by-address-lan").click()
    address.fill(bench.servo)
    page.get_by_test_id("ask-address").click()
    told = page.get_by_test_id("identified")
    expect(told).to_contain_text("HUBSIDE TWIN PD4-E591L42-E-65-4", timeout=WAIT_MS)
    expect(told).to_contain_text("Nanotec PD4-E591L42-E-65-4")
    expect(told).to_contain_text("TWIN-0001")
    page.get_by_test_id("new-node").fill("200")
    page.get_by_test_id("add-by-address").click()
    row = page.get_by_test_id("address-of-drive")
    expect(row.get_by_test_id("device-address")).to_have_value(bench.servo)
    expect(row.get_by_test_id("external-stop")).to_be_disabled()  # this session is a technician's
    with page.expect_response("**/api/settings/site/turbines/other-bench") as saved:
        page.get_by_test_id("save-turbine").click()
    assert saved.value.ok

    site = tomllib.loads((bench.data / "demo-site.toml").read_text(encoding="utf-8"))["turbine"]["other-bench"]
    assert site["bus"]["lan"] == {"connection": "modbus-tcp", "ranges": [bench.servo]}
    drive = site["station"]["bench"]["device"]["drive"]
    assert drive == {"description": "nanotec-pd4e", "node": 200, "address": bench.servo}

    page.get_by_test_id("connect-menu").click()
    page.get_by_test_id("connect-other-bench").click()
    expect(page.get_by_test_id("turbine")).to_have_text("Other bench", timeout=WAIT_MS)
    expect(page.get_by_test_id("mode")).to_contain_text("TWIN", timeout=WAIT_MS)
