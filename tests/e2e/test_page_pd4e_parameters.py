"""The parameters room with a drive on Modbus TCP: what is written there another client reads from the drive itself."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect
from pyModbusTCP.client import ModbusClient

from app.model.address import Address
from app.wire.modbus.answers import ObjectRead, decode_answer
from app.wire.modbus.requests import ReadObject
from tests.e2e.browser import WAIT_MS, signed_in
from tests.e2e.processes import running
from tests.e2e.test_browser import hold

pytestmark = [pytest.mark.browser, pytest.mark.timeout(300)]

SERVO = "bench-pd4e/bench/servo"
WINDOW, STATIC = Address(0x6065), Address(0x2011)
IP = 0xC0A80115  # 192.168.1.21
SITE = """
schema = 1
[turbine.bench-pd4e.bus.lan]
connection = "modbus-tcp"
ranges = ["127.0.0.1:{port}"]
[turbine.bench-pd4e.station.bench.device.servo]
description = "nanotec-pd4e"
node = 1
address = "127.0.0.1:{port}"
"""


@dataclass(frozen=True)
class Bench:
    """A twin, the page that is connected to it, and a client of others beside it."""

    context: BrowserContext
    home: str
    port: int

    def open(self, search: str) -> Page:
        """The parameters of the drive."""
        page = self.context.new_page()
        page.goto(f"{self.home}parameters?scene=off&device={SERVO}&{search}")
        return page

    def holds(self, address: Address) -> int:
        """What the drive itself says, to a client of somebody else."""
        client = ModbusClient("127.0.0.1", self.port, unit_id=0, timeout=10.0)
        pdu = client.custom_request(ReadObject(address, 4).pdu())
        client.close()
        assert pdu is not None, client.last_error_as_txt
        answer = decode_answer(bytes(pdu))
        assert isinstance(answer, ObjectRead)
        return int.from_bytes(answer.data, "little")

    def write(self, address: str, raw: int, **more: object) -> tuple[int, str]:
        """Ask the server to write; its status and its problem's code."""
        answer = self.context.request.post(
            f"{self.home}api/live/devices/{SERVO}/write",
            data={"address": address, "raw": raw, **more},
            headers={"Origin": self.home.rstrip("/")},
        )
        return answer.status, answer.json().get("code", "")


@pytest.fixture(scope="module")
def bench(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    folder: Path = tmp_path_factory.mktemp("pd4e")
    with running("twin", "pd4e", "--modbus", "127.0.0.1:0", "--json") as twin:
        port = int(json.loads(twin.wait_for('"address"'))["address"].rpartition(":")[2])
        site = folder / "site.toml"
        site.write_text(SITE.format(port=port), encoding="utf-8")
        data = str(folder / "data")
        with running("serve", "--site", str(site), "--port", "0", "--json", "--data", data) as server:
            url = json.loads(server.wait_for('"url"', 60.0))["url"]
            with signed_in(browser, url) as context:
                yield Bench(context, url.split("?")[0], port)


def test_a_parameter_is_found_written_and_read_by_another_client_and_a_refusal_tells_its_code(bench: Bench) -> None:
    assert bench.write("3602", 6)[0] == 200
    tenths = bench.holds(WINDOW)
    page = bench.open("q=following error window&edit=6065")
    expect(page.get_by_test_id("value-6065")).to_contain_text(f"{tenths / 10:.1f}", timeout=WAIT_MS)
    expect(page.get_by_test_id("value-6065")).to_contain_text("°")
    expect(page.get_by_test_id("entry-category")).to_contain_text("Application")
    expect(page.get_by_test_id("inferred")).to_contain_text("Not printed in the manual: ")
    page.get_by_test_id("new-value").fill(f"{tenths / 10 + 5:.1f}")
    page.get_by_test_id("stage").click()
    page.get_by_test_id("review").click()
    page.get_by_test_id(f"save-after-{SERVO}").uncheck()
    hold(page, "write-hold")
    expect(page.get_by_test_id("write-verified")).to_contain_text("1 verified", timeout=WAIT_MS)
    assert bench.holds(WINDOW) == tenths + 50
    page.close()

    page = bench.open("lang=de&q=3602:01&edit=3602:01")
    expect(page.get_by_test_id("inferred")).to_contain_text("Nicht im Handbuch gedruckt: ", timeout=WAIT_MS)
    before = bench.holds(Address(0x3602, 1))
    page.get_by_test_id("new-value").fill("60410008h")
    page.get_by_test_id("stage").click()
    page.get_by_test_id("review").click()
    refused = page.get_by_test_id("review-row-3602:01")
    expect(refused).to_contain_text("Nur solange 3602", timeout=WAIT_MS)
    expect(page.get_by_test_id("write-hold")).to_be_disabled()
    # Once that holds the drive itself refuses: it has no such object of eight bits.
    assert bench.write("3602", 0)[0] == 200
    page.get_by_test_id(f"save-after-{SERVO}").uncheck()
    hold(page, "write-hold")
    row = page.get_by_test_id(f"progress-{SERVO}-3602:01")
    expect(row).to_contain_text("06040041h", timeout=WAIT_MS)
    assert bench.holds(Address(0x3602, 1)) == before
    page.close()


def test_a_change_of_the_address_is_told_beforehand_and_must_be_confirmed(bench: Bench) -> None:
    assert bench.write("2010", 1) == (422, "address_change")
    for address, raw in (("2010", 1), ("2012", 0xFFFFFF00)):
        assert bench.write(address, raw, address_confirmed=True)[0] == 200
    page = bench.open("q=2011&edit=2011")
    expect(page.get_by_test_id("value-2011")).to_be_visible(timeout=WAIT_MS)
    page.get_by_test_id("new-value").fill(f"{IP:X}h")
    page.get_by_test_id("stage").click()
    page.get_by_test_id("review").click()
    warning = page.get_by_test_id("address-change")
    expect(warning).to_contain_text(f"is reached through 127.0.0.1:{bench.port} now", timeout=WAIT_MS)
    expect(warning).to_contain_text(f'address = "192.168.1.21:{bench.port}"')
    page.get_by_test_id(f"save-after-{SERVO}").uncheck()
    expect(page.get_by_test_id("write-hold")).to_be_disabled()
    page.get_by_test_id("language").click(force=True)
    expect(warning).to_contain_text("Das Gerät wird unter einer anderen Adresse zu finden sein")
    page.get_by_test_id("address-confirm").check()
    hold(page, "write-hold")
    expect(page.get_by_test_id("write-verified")).to_be_visible(timeout=WAIT_MS)
    assert bench.holds(STATIC) == IP
    page.close()
