"""The site file is edited while the bench runs: whose file, which slugs, what is refused, what is noted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.drivers.contract import FoundNode, Identity
from app.errors import SettingsError, SiteError
from app.model.description_file import load_builtin
from app.model.site import Turbine, load_site
from app.service.journal import Entry, Journal
from app.service.site_edit import SiteEditor, propose
from app.service.sites import Sites
from tests.model.test_site_write import EXAMPLE, TEXT, other

KNOWN = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc", "nanotec-pd4e")}


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "site.toml"
    path.write_text(TEXT, encoding="utf-8")
    return path


@pytest.fixture
def sites(file: Path) -> Sites:
    return Sites(load_site(file), lambda _turbine: KNOWN, file)


@pytest.fixture
def editor(sites: Sites) -> SiteEditor:
    return SiteEditor(sites)


@pytest.fixture
def noted() -> list[Entry]:
    return []


@pytest.fixture
def journal(noted: list[Entry]) -> Journal:
    journal = Journal(lambda: 1, "tester")
    journal.listen(noted.append)
    return journal


def turbine() -> Turbine:
    return load_site(EXAMPLE)[0]


def text_of(file: Path) -> str:
    return file.read_text(encoding="utf-8")


def write(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")


def reason(caught: pytest.ExceptionInfo[SettingsError]) -> str:
    return str(caught.value.details["reason_key"]).removeprefix("settings.refused.")


async def test_a_turbine_is_added_changed_and_taken_out(
    editor: SiteEditor, sites: Sites, journal: Journal, noted: list[Entry]
) -> None:
    await editor.add(other(turbine(), "wtg-08"), editor.state().revision, journal)
    assert list(sites.turbines) == ["wtg-07", "wtg-08"]
    await editor.change("wtg-07", replace(turbine(), name="North"), editor.state().revision, journal)
    assert sites.turbine("wtg-07").name == "North"
    await editor.remove("wtg-08", editor.state().revision, None, journal)
    assert list(sites.turbines) == ["wtg-07"]
    assert [entry.details["what_key"] for entry in noted] == [
        "settings.turbine_added", "settings.turbine_changed", "settings.turbine_removed",
    ]  # fmt: skip
    assert noted[1].details["changes"] == "name WTG-07 → North"
    assert "station.blade-1.pmm – → PMM, oat-pmm, can0 node 1" in noted[0].details["changes"]


async def test_slugs_are_permanent(editor: SiteEditor, file: Path, journal: Journal) -> None:
    revision = editor.state().revision
    with pytest.raises(SettingsError) as caught:
        await editor.change("wtg-07", other(turbine(), "wtg-09"), revision, journal)
    assert reason(caught) == "slug_permanent"
    first = turbine().stations[0]
    renamed = replace(first.devices[0], slug="wtg-07/blade-1/other")
    again = replace(turbine(), stations=(replace(first, devices=(renamed, first.devices[1])), *turbine().stations[1:]))
    with pytest.raises(SettingsError) as caught:
        await editor.change("wtg-07", again, revision, journal)
    assert reason(caught) == "slug_permanent"
    assert text_of(file) == TEXT


async def test_what_would_lose_something_is_refused(editor: SiteEditor, journal: Journal) -> None:
    revision = editor.state().revision
    for refused, why in (
        (editor.remove("wtg-07", revision, turbine(), journal), "turbine_connected"),
        (editor.remove("wtg-07", revision, None, journal), "last_turbine"),
        (editor.remove("wtg-99", revision, None, journal), "no_turbine"),
        (editor.add(turbine(), revision, journal), "slug_taken"),
        (editor.change("wtg-99", turbine(), revision, journal), "no_turbine"),
        (editor.change("wtg-07", turbine(), "another", journal), "site_changed"),
    ):
        with pytest.raises(SettingsError) as caught:
            await refused
        assert reason(caught) == why


async def test_a_change_by_hand_meanwhile_is_not_overwritten(editor: SiteEditor, file: Path, journal: Journal) -> None:
    revision = editor.state().revision
    by_hand = TEXT.replace('name = "WTG-07"', 'name = "By hand"')
    write(file, by_hand)
    with pytest.raises(SettingsError) as caught:
        await editor.change("wtg-07", replace(turbine(), name="Page"), revision, journal)
    assert reason(caught) == "site_changed"
    assert text_of(file) == by_hand
    assert editor.state().turbines[0].name == "By hand"


async def test_errors_name_the_key(editor: SiteEditor, journal: Journal) -> None:
    bus, station = turbine().buses[0], turbine().stations[0]
    device = station.devices[0]

    def with_device(**change: Any) -> Turbine:
        devices = (replace(device, **change), *station.devices[1:])
        return replace(turbine(), stations=(replace(station, devices=devices), *turbine().stations[1:]))

    for wrong, key in (
        (replace(turbine(), name=" "), "turbine.wtg-07.name"),
        (replace(turbine(), buses=(replace(bus, connection="nothing"),)), "turbine.wtg-07.bus.can0.connection"),
        (
            replace(turbine(), buses=(replace(bus, connection="slcan:/dev/x", bitrate=123_456),)),
            "turbine.wtg-07.bus.can0.bitrate",
        ),
        (with_device(description_id="nobody"), "turbine.wtg-07.station.blade-1.device.pmm.description"),
        (with_device(description_id="nanotec-pd4e"), "turbine.wtg-07.station.blade-1.device.pmm.description"),
        (with_device(bus="can9"), "turbine.wtg-07.station.blade-1.device.pmm.bus"),
        (with_device(node=11), "wtg-07/blade-1/pmc.node"),
    ):
        with pytest.raises(SiteError) as caught:
            await editor.change("wtg-07", wrong, editor.state().revision, journal)
        assert caught.value.details["key"] == key


async def test_without_a_site_file_the_first_change_makes_one(tmp_path: Path, journal: Journal) -> None:
    home = tmp_path / "data" / "site.toml"
    sites = Sites((turbine(),), lambda _turbine: KNOWN, None, home)
    editor = SiteEditor(sites)
    state = editor.state()
    assert (state.file, state.made, state.problem, state.revision) == (home, False, None, "")
    await editor.add(other(turbine(), "wtg-08"), "", journal)
    assert [one.slug for one in load_site(home)] == ["wtg-07", "wtg-08"]
    assert sites.file == home and editor.state().made


async def test_without_a_folder_nothing_can_be_changed(journal: Journal) -> None:
    editor = SiteEditor(Sites((turbine(),), lambda _turbine: KNOWN))
    assert editor.state().problem == "settings.refused.no_site_file"
    with pytest.raises(SettingsError) as caught:
        await editor.add(other(turbine(), "wtg-08"), "", journal)
    assert reason(caught) == "no_site_file"


def test_found_devices_get_the_place_of_their_node() -> None:
    def found(node: int, description: str | None) -> FoundNode:
        return FoundNode(node, None, None, None, None, Identity(), description)

    proposed = propose(
        [found(2, "oat-pmm"), found(12, "oat-pmc"), found(5, "oat-pmm"), found(1, "oat-pmc"), found(60, None)]
    )
    assert [(one.station, one.blade, one.device) for one in proposed] == [
        ("blade-2", 2, "pmm"),
        ("blade-2", 2, "pmc"),
        ("bench", None, "pmm-5"),
        ("bench", None, "pmc-1"),
        ("bench", None, "node-60"),
    ]
