"""A turbine's twins as a process of their own, on a free port of 127.0.0.1."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

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
