"""Site files."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.errors import SiteError
from app.model.site import load_site

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "sites" / "example.toml"


def test_the_example_is_a_turbine_of_three_blades() -> None:
    (turbine,) = load_site(EXAMPLE)
    assert [device.slug for device in turbine.devices][:2] == ["wtg-07/blade-1/pmm", "wtg-07/blade-1/pmc"]
    assert [device.node for device in turbine.devices] == [1, 11, 2, 12, 3, 13]
    assert turbine.buses[0].bitrate == 500_000
    assert turbine.device("blade-2/pmc") is turbine.device("12")
    assert turbine.device("wtg-07/blade-2/pmc") is turbine.device("12")
    assert turbine.device("wtg-08/blade-2/pmc") is None


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ("schema = 1", "schema = 9", "schema"),
        ("bitrate = 500000", "bitrate = 500000\nfoo = 1", "turbine.wtg-07.bus.can0.foo"),
        ("blade = 1", "blad = 1", "turbine.wtg-07.station.blade-1.blad"),
        ("node = 11", "node = 12", "wtg-07/blade-2/pmc.node"),
        ("node = 11", "node = 0", "turbine.wtg-07.station.blade-1.device.pmc.node"),
        ("node = 11", 'node = "11"', "turbine.wtg-07.station.blade-1.device.pmc.node"),
        ("blade = 1", "blade = 4", "turbine.wtg-07.station.blade-1.blade"),
        ("bitrate = 500000", "bitrate = true", "turbine.wtg-07.bus.can0.bitrate"),
        ('description = "oat-pmm", node = 1 ', "node = 1 ", "turbine.wtg-07.station.blade-1.device.pmm.description"),
        ("[turbine.wtg-07.station.blade-1]", "[turbine.wtg-07.station.Blade_1]", "turbine.wtg-07.station.Blade_1"),
        ("[turbine.wtg-07.bus.can0]", "[turbine.wtg-07.bus.", "*"),
    ],
)
def test_a_wrong_site_names_the_place(tmp_path: Path, old: str, new: str, key: str) -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "site.toml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(SiteError) as caught:
        load_site(path)
    assert caught.value.details["key"] == key
    assert caught.value.details["file"] == str(path)
