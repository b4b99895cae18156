"""A PD4-E in a real browser: its set taken, compared, restored, saved by categories, and proven by a restart."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from pyModbusTCP.client import ModbusClient

from app.model.address import Address, parse_address
from app.model.description_file import load_builtin
from app.model.sets import ParameterSet, load_set
from app.wire.modbus.answers import ObjectRead, decode_answer
from app.wire.modbus.requests import ReadObject
from tests.e2e.browser import WAIT_MS, answer_of, signed_in
from tests.e2e.processes import running
from tests.e2e.test_browser import hold
from tests.e2e.test_page_restore import api
from tests.service.pd4e.conftest import SERVO, STATION, site_of

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

RUN_MS = 60_000
PD4E = load_builtin("nanotec-pd4e")
CHANGES = {"2031": 1500, "6065": 300, "6073": 1200}
"""Tuning, application, drive."""


@contextmanager
def bench(data: Path) -> Iterator[tuple[str, str]]:
    """Address of the page, which works once, and of a twin that it is connected to."""
    with running("twin", "pd4e", "--modbus", "127.0.0.1:0", "--json") as twin:
        at = json.loads(twin.wait_for('"address"'))["address"]
        site = data / "bench.toml"
        site.write_text(site_of(at), encoding="utf-8")
        with running("--data", str(data), "serve", "--site", str(site), "--port", "0", "--record", "--json") as served:
            yield json.loads(served.wait_for('"url"'))["url"], at


@pytest.fixture(scope="module")
def home(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, str, Page]]:
    with bench(tmp_path_factory.mktemp("data")) as (url, twin), signed_in(browser, url) as context:
        yield url.split("?")[0], twin, context.new_page()


def test_a_set_is_compared_restored_saved_by_categories_and_found_after_a_restart(
    home: tuple[str, str, Page],
) -> None:
    address, twin, page = home
    page.goto(f"{address}sets?scene=off")
    page.get_by_test_id("reason").fill("as delivered")
    page.get_by_test_id("back-up").click()
    row = page.locator("[data-testid^='row-']").filter(has_text="as delivered")
    expect(row).to_contain_text("complete", timeout=RUN_MS)
    record = kept_set(page)
    row.focus()
    page.keyboard.press("Enter")
    details = page.get_by_test_id("set-details")
    expect(details).to_contain_text("TWIN-0001")
    expect(details.get_by_test_id("set-2031")).to_contain_text("Tuning")

    for at, raw in CHANGES.items():
        api(page, "POST", f"/api/live/devices/{SERVO}/write", {"address": at, "raw": raw})
    page.goto(f"{address}sets?tab=compare&columns=set:{record},live:{SERVO}&scene=off")
    for at, category in (("2031", "Tuning"), ("6065", "Application"), ("6073", "Drive")):
        line = page.get_by_test_id(f"compared-{at}")
        expect(line).to_have_attribute("data-state", "different", timeout=RUN_MS)
        expect(line).to_contain_text(category)

    page.goto(f"{address}sets?tab=restore&station={STATION}&sets={record}&scene=off")
    expect(page.get_by_test_id("precheck-passed")).to_be_visible(timeout=RUN_MS)
    expect(page.get_by_test_id(f"plan-{SERVO} 6073")).to_contain_text("Drive")
    expect(page.get_by_test_id("what-happens")).to_contain_text("save Application, Drive, Tuning")
    hold(page, "restore-hold")
    expect(page.get_by_test_id("restore-confirm")).to_be_visible(timeout=RUN_MS)
    hold(page, "confirm-hold")
    expect(page.get_by_test_id("restore-end-new")).to_be_visible(timeout=RUN_MS)
    for at in CHANGES:
        expect(page.get_by_test_id(f"run-{SERVO} {at}")).to_contain_text("proven")
    fetched = "async (id) => (await fetch(`/api/sets/${id}/download?format=json`)).text()"
    found = load_set(page.evaluate(fetched, record), "set")
    assert differing(found, twin) == []


def test_one_category_is_saved_and_the_restart_proves_it(home: tuple[str, str, Page]) -> None:
    address, twin, page = home
    page.goto(f"{address}parameters?device={SERVO}&scene=off")
    for at, raw in CHANGES.items():
        api(page, "POST", f"/api/live/devices/{SERVO}/write", {"address": at, "raw": raw})
    page.get_by_test_id("save").click()
    expect(page.get_by_test_id("save-category")).to_contain_text("Tuning1 unsaved")
    page.get_by_test_id("save-category-tuning").check()
    hold(page, "save-hold")
    expect(page.get_by_test_id("save-done")).to_be_visible(timeout=RUN_MS)
    page.get_by_test_id("save-close").click()
    page.get_by_test_id("restart").click()
    hold(page, "restart-hold")
    expect(page.get_by_test_id("restart-proof")).to_contain_text("it is in force", timeout=RUN_MS)
    values = {at: object_of(twin, parse_address(at)) for at in CHANGES}
    assert values == {"2031": 1500, "6065": 256, "6073": 1000}


def kept_set(page: Page) -> str:
    """Id of the set that was backed up."""
    found = answer_of(
        page,
        """async () => (await (await fetch("/api/sets")).json()).records
            .find((one) => one.origin.reason === "as delivered")?.id""",
        None,
        WAIT_MS,
    )
    return str(found)


def differing(found: ParameterSet, twin: str) -> list[str]:
    """Numbers of the set that an independent client does not find in the device."""
    wanted = {at: raw for at, raw in found.values.items() if PD4E.entry(at).is_parameter and isinstance(raw, int)}
    assert len(wanted) > 400
    with_client = client(twin)
    try:
        return [at.short for at, raw in wanted.items() if object_of(twin, at, with_client) != raw]
    finally:
        with_client.close()


def client(twin: str) -> ModbusClient:
    host, _, port = twin.rpartition(":")
    return ModbusClient(host, int(port), unit_id=0, timeout=10)


def object_of(twin: str, address: Address, own: ModbusClient | None = None) -> int:
    """One object by FC 43, asked by another library than our driver."""
    asking = own or client(twin)
    size = PD4E.entry(address).type.size
    assert size is not None
    answer = decode_answer(asking.custom_request(ReadObject(address, size).pdu()))
    assert isinstance(answer, ObjectRead), answer
    if own is None:
        asking.close()
    signed = (PD4E.entry(address).type.range or (0, 0))[0] < 0
    return int.from_bytes(answer.data, "little", signed=signed)
