"""The site file of the demo: its twins wherever they answer, and what was added to it stays."""

from __future__ import annotations

from pathlib import Path

from app.cli.demo import _site
from app.model.site import load_site
from app.model.site_write import with_turbine

FIRST = "socketcand:127.0.0.1:29536"
LATER = "socketcand:127.0.0.1:40001"


def test_the_twins_are_found_wherever_they_answer(tmp_path: Path) -> None:
    for address in (FIRST, LATER):
        (turbine,) = load_site(_site(tmp_path, address))
        assert [bus.connection for bus in turbine.buses] == [address]


def test_what_was_added_in_the_page_stays(tmp_path: Path) -> None:
    path = _site(tmp_path, FIRST)
    (turbine,) = load_site(path)
    text = path.read_text(encoding="utf-8").replace("wtg-07", "wtg-08").replace("WTG-07", "WTG-08")
    other = tmp_path / "other.toml"
    other.write_text(text, encoding="utf-8")
    path.write_text(with_turbine(path.read_text(encoding="utf-8"), load_site(other)[0], str(path)), encoding="utf-8")
    known = {one.slug: one for one in load_site(_site(tmp_path, LATER))}
    assert list(known) == [turbine.slug, "wtg-08"]
    assert known["wtg-07"].buses[0].connection == LATER
    assert known["wtg-08"].buses[0].connection == FIRST, "another turbine's adapter is its own affair"


def test_a_file_without_the_demos_turbine_is_made_anew(tmp_path: Path) -> None:
    (tmp_path / "demo-site.toml").write_text("schema = 1\n", encoding="utf-8")
    (turbine,) = load_site(_site(tmp_path, LATER))
    assert turbine.slug == "wtg-07"
