"""``@search`` on the command line and in a site file, on a serial adapter over a pty."""

from __future__ import annotations

import sys
from contextlib import closing
from pathlib import Path

import pytest

if sys.platform == "win32":
    pytest.skip("Windows has no pty", allow_module_level=True)

from tests.drivers.slcan_adapter import SlcanOnBus
from tests.e2e.processes import hubside

SITE = """schema = 1
[turbine.wtg-01.bus.can0]
connection = "{connection}"
"""


@pytest.mark.parametrize("by_site", [False, True])
def test_the_bit_rate_is_found_before_anything_else(by_site: bool, tmp_path: Path) -> None:
    tty, site = tmp_path / "tty", tmp_path / "site.toml"
    connection = f"slcan:{tty}@search"
    site.write_text(SITE.format(connection=connection), encoding="utf-8")
    where = ("--site", str(site)) if by_site else ("--can", connection)
    with closing(SlcanOnBus(tty, 250_000)) as adapter:
        done = hubside("record", *where, "--seconds", "0.5", "--json", data=tmp_path / "data")
    assert done.code == 0, done.err
    assert "Bit rate found: 250000 bit/s" in done.err
    assert done.json["frames"] > 10
    assert {rate for rate, command in adapter.opened if command == b"O"} == {250_000}
    assert adapter.tried == [500_000, 250_000]
    assert adapter.sent == []
