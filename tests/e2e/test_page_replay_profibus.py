"""A recording of a bench on PROFIBUS in a real browser: its trace, a telegram part by part, a plot of process data."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from typing import Final

import pytest
from playwright.sync_api import Browser, expect

from tests.e2e.test_page_replay import WAIT_MS, Home, S, serving
from tests.recording.make_ed2 import SAMPLE, SLUG

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

NAME: Final = SAMPLE.stem
MOVING_S: Final = 1.6


@pytest.fixture(scope="module")
def home(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Home]:
    data = tmp_path_factory.mktemp("data")
    (data / "recordings").mkdir()
    shutil.copy(SAMPLE, data / "recordings")
    with serving(browser, data, command="serve") as served:
        yield served
        served.context.close()


def test_trace_and_plot_of_axes_on_profibus(home: Home) -> None:
    _, doc = home.call("POST", "replay", {"recording": SAMPLE.name})
    at_ns = doc["from_ns"] + round(MOVING_S * S)
    home.call("POST", f"replay/{NAME}/cursor", {"action": "seek", "t_ns": at_ns})
    page = home.open(f"bus?replay={NAME}&lang=en")
    rows = page.get_by_test_id("trace-row")
    expect(rows.last).to_contain_text("Data_Exchange", timeout=WAIT_MS)
    expect(rows.last).to_contain_text(re.compile("2→6|6→2"))

    page.goto(page.url + "&services=profibus")
    expect(rows.filter(has_text="DP unchanged")).to_have_count(0, timeout=WAIT_MS)
    page.get_by_test_id("trace-q").fill("12/61")
    asked = rows.filter(has_text="PKW writes").first
    expect(asked).to_contain_text("5000.0", timeout=WAIT_MS)
    asked.click()
    detail = page.get_by_test_id("frame-detail")
    expect(detail).to_contain_text("from station 2 to station 6")
    parts = detail.get_by_test_id("fdl-parts")
    expect(parts).to_contain_text("SD2")
    expect(parts).to_contain_text(re.compile(r"PKW\s*30 3D 0C 00 00 00 C3 50"))
    expect(parts).to_contain_text("PZD")

    page.get_by_test_id("tab-load").click()
    expect(page.get_by_test_id("load-view")).to_contain_text("500 kbit/s")

    page.goto(f"{home.address}recordings?scene=off&replay={NAME}&at={at_ns}&plots=bench/axes/12/100&lang=en")
    plot = page.get_by_role("region", name=re.compile("^Plot: "))
    expect(plot).to_contain_text("mm", timeout=WAIT_MS)
    page.close()

    code, series = home.call("GET", f"replay/{NAME}/series?signal={SLUG}/12/100&points=400")
    assert code == 200
    assert max(high for high in series[0]["high"] if high is not None) > 299
