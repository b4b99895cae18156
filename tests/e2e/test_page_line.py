"""The bus room shows a PROFIBUS line and its station, proves the order of bytes, and notes it in the site file."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, expect

from app.model.site import load_site
from tests.drivers.profibus_rig import Wire, wire
from tests.e2e.browser import signed_in
from tests.e2e.processes import running
from tests.service.lines_rig import site_text

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]
SLOW_MS = 30_000


@pytest.fixture(scope="module")
def line() -> Iterator[Wire]:
    with wire() as one:
        yield one


@pytest.fixture(scope="module")
def site(line: Wire, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file: Path = tmp_path_factory.mktemp("line") / "site.toml"
    file.write_text(site_text(line), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def url(site: Path) -> Iterator[str]:
    with running("serve", "--site", str(site), "--port", "0", "--data", str(site.parent), "--json") as process:
        yield json.loads(process.wait_for('"url"'))["url"]


@pytest.fixture(scope="module")
def at_bench(browser: Browser, url: str) -> Iterator[BrowserContext]:
    with signed_in(browser, url) as context:
        yield context


def test_a_line_is_looked_at_and_its_order_of_bytes_proven_and_noted(
    at_bench: BrowserContext, url: str, site: Path, line: Wire
) -> None:
    page = at_bench.new_page()
    page.goto(f"{url.split('?')[0]}bus?tab=line&scene=off&lang=en")
    expect(page.get_by_test_id("line-state")).to_have_text(re.compile("Connected"), timeout=SLOW_MS)
    expect(page.get_by_test_id("dp-state")).to_have_text("Data_Exchange")
    expect(page.get_by_test_id("diagnosis")).to_contain_text("00 0C 00 02 0E D2")
    actual = page.get_by_test_id("signal-dpc_ActualVal")
    expect(actual).to_contain_text("00 03 D0 90")
    expect(actual).not_to_contain_text("mm")
    page.get_by_test_id("order-check").click()
    expect(page.get_by_test_id("order-evidence")).to_contain_text("250000", timeout=SLOW_MS)
    expect(page.get_by_test_id("order-stand")).to_contain_text("proven: high byte, high word first")
    expect(actual).to_contain_text("250.000 mm")
    page.get_by_test_id("order-keep-high-high").click()
    expect(page.get_by_test_id("order-verdict")).to_contain_text("Noted in the site file", timeout=SLOW_MS)
    assert load_site(site)[0].devices[0].slave.pzd_order == "high-high"

    line.power_off()
    expect(page.get_by_test_id("station-state")).to_contain_text("Does not answer", timeout=SLOW_MS)
    expect(page.get_by_test_id("words-sent")).to_have_count(0)
    line.power_on()
    expect(page.get_by_test_id("station-state")).to_contain_text("Exchanges data", timeout=SLOW_MS)
    expect(page.get_by_test_id("order-stand")).to_contain_text("not proven yet")


def test_a_line_is_edited_in_the_settings(at_bench: BrowserContext, url: str, site: Path) -> None:
    page = at_bench.new_page()
    page.goto(f"{url.split('?')[0]}settings?section=turbines&scene=off&lang=en")
    page.get_by_test_id("turbine-bench-ed2").click()
    expect(page.get_by_test_id("bus-kind-dp0")).to_have_value("PROFIBUS-DP", timeout=SLOW_MS)
    port = load_site(site)[0].buses[0].connection.removeprefix("profibus:")
    expect(page.get_by_test_id("line-port")).to_have_value(port)
    expect(page.get_by_test_id("line-rate")).to_have_value("500 kbit/s")
    expect(page.get_by_test_id("line-master")).to_have_value("2")
    expect(page.get_by_test_id("slave-cylinders")).to_be_visible()
