"""What browser and command-line tests share: twins and the demo as processes of their own, and Chromium."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from tests.e2e.browser import CHROMIUM, FLAGS, signed_in
from tests.e2e.processes import ROOT, Process, running


@dataclass(frozen=True)
class Twins:
    """Running twins: where they answer, and a site file that names them."""

    address: str
    site: Path
    state: Path
    process: Process

    @property
    def port(self) -> int:
        """The TCP port."""
        return int(self.address.rsplit(":", 1)[1])


@pytest.fixture
def twins(tmp_path: Path) -> Iterator[Twins]:
    """Three blades at 500 kbit/s, 1 ms turnaround, saved values kept in a folder."""
    state = tmp_path / "state"
    with running("twin", "oat", "--can", "socketcand:127.0.0.1:0", "--state", str(state), "--json") as process:
        address = json.loads(process.wait_for('"address"'))["address"]
        yield Twins(address, site_for(address, tmp_path), state, process)


def site_for(address: str, folder: Path) -> Path:
    """The example site with the address of these twins."""
    text = (ROOT / "docs" / "sites" / "example.toml").read_text(encoding="utf-8")
    path = folder / "site.toml"
    path.write_text(text.replace("socketcand:127.0.0.1:29536", address), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """``hubside demo`` on a free port: the address that it prints."""
    data = tmp_path_factory.mktemp("data")
    with running("demo", "--port", "0", "--data", str(data), "--json") as process:
        yield json.loads(process.wait_for('"url"'))["url"]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Headless Chromium."""
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def context(browser: Browser, demo: str) -> Iterator[BrowserContext]:
    """Signed in. The content security policy is passed by, because axe is put into pages."""
    with signed_in(browser, demo, reduced_motion="reduce", bypass_csp=True) as context:
        yield context


@pytest.fixture
def page(context: BrowserContext) -> Iterator[Page]:
    """A page of its own, on which no script fails."""
    page = context.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    page.close()
    assert errors == []
