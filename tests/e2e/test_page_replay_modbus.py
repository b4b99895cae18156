"""A recording of a bench on Modbus TCP in a real browser: its plot and its trace, at the moment of a fault."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from typing import Final

import pytest
from playwright.sync_api import Browser, expect

from tests.e2e.test_page_replay import WAIT_MS, Home, S, serving
from tests.recording.make_pd4e import SAMPLE

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

NAME: Final = SAMPLE.stem
FAULT_S: Final = 4.9


@pytest.fixture(scope="module")
def home(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Home]:
    data = tmp_path_factory.mktemp("data")
    (data / "recordings").mkdir()
    shutil.copy(SAMPLE, data / "recordings")
    with serving(browser, data, command="serve") as served:
        yield served
        served.context.close()


def test_trace_and_plot_of_a_drive_on_modbus_tcp(home: Home) -> None:
    _, doc = home.call("POST", "replay", {"recording": SAMPLE.name})
    at_ns = doc["from_ns"] + round(FAULT_S * S)
    home.call("POST", f"replay/{NAME}/cursor", {"action": "seek", "t_ns": at_ns})
    page = home.open(f"bus?replay={NAME}&lang=en")
    rows = page.get_by_test_id("trace-row")
    expect(rows.last).to_contain_text("FC", timeout=WAIT_MS)

    page.get_by_test_id("trace-q").fill("603F")
    expect(rows.filter(has_not_text="603F")).to_have_count(0)
    answer = rows.filter(has_text="8611h").first
    expect(answer).to_contain_text("FC 43 resp")
    answer.click()
    detail = page.get_by_test_id("frame-detail")
    expect(detail).to_contain_text("192.168.2.10:49152")
    expect(detail).to_contain_text(re.compile(r"2B 0D 00 00 01 60 3F 00 00 00 00 02 11 86"))
    page.get_by_test_id("frame-partner").click()
    expect(detail).to_contain_text("FC 43 req")

    page.get_by_test_id("tab-load").click()
    expect(page.get_by_test_id("load-view")).to_contain_text("– kbit/s")

    page.goto(f"{home.address}recordings?scene=off&replay={NAME}&at={at_ns}&plots=bench/servo/6064&lang=en")
    plot = page.get_by_role("region", name="Plot: Position Actual Value")
    expect(plot).to_contain_text("684.0", timeout=WAIT_MS)  # ° where the blocked shaft stands, at the cursor
    page.close()

    code, series = home.call("GET", f"replay/{NAME}/series?signal=bench-pd4e/bench/servo/6064&points=400")
    assert code == 200
    assert max(series[0]["high"]) == pytest.approx(720.0)
