"""``hubside sets fleet`` and ``sets parity``: who stands out, as text, CSV and JSON; blades beside each other."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.sets import Identity, Origin, ParameterSet, dump_set
from app.service.compare.known import defaults_of
from tests.e2e.conftest import site_for
from tests.service.conftest import Served, served

__all__ = ["served"]

PMM = load_builtin("oat-pmm")
LIMIT, OTHER, CHARGED = Address(0x3110, 1), Address(0x3110, 2), Address(0x3050)


class Sets:
    """``hubside sets`` in a data folder of its own."""

    def __init__(self, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.data = data
        self._capsys = capsys

    def __call__(self, *words: object) -> tuple[int, str, str]:
        code = main(["--data", str(self.data), "sets", *map(str, words)])
        told = self._capsys.readouterr()
        return code, told.out, told.err


@pytest.fixture
def sets(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Sets:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    return Sets(tmp_path / "data", capsys)


def taken(number: int, blade: int, changes: dict[Address, int], lacks: tuple[Address, ...] = ()) -> ParameterSet:
    slug = f"wtg-{number:02}/blade-{blade}/pmm"
    origin = Origin(f"wtg-{number:02}", slug, blade, f"2026-05-{number:02}T08:00:00Z", "Anna", "yearly", "hubside")
    values = {**defaults_of(PMM, 1), CHARGED: 100, **changes}
    kept = {address: raw for address, raw in values.items() if address not in lacks}
    return ParameterSet("oat-pmm", PMM.version, Identity(serial=number), origin, kept)


def fleet(sets: Sets, folder: Path) -> str:
    """Four devices of three turbines; gives the golden set's id. Two differ, one only in what is bound to the unit."""
    golden = taken(1, 1, {})
    files = []
    for number, one in enumerate(
        (golden, taken(2, 1, {LIMIT: 480, OTHER: 1}), taken(2, 2, {CHARGED: 7}), taken(3, 1, {LIMIT: 490}, (OTHER,)))
    ):
        files.append(folder / f"{number}.json")
        files[-1].write_text(dump_set(one), encoding="utf-8")
    _code, out, _err = sets("import", *files, "--json")
    key: str = json.loads(out.splitlines()[0])["id"]
    assert sets("tag", key, "golden")[0] == 0
    return key


def told(sets: Sets, *words: object) -> Any:
    code, out, err = sets("fleet", *words, "--format", "json")
    assert code == 0, err
    return json.loads(out)


def test_outliers_are_ranked_and_turbines_counted(sets: Sets, tmp_path: Path) -> None:
    key = fleet(sets, tmp_path)
    (found,) = told(sets)
    assert found["golden"]["record"] == key
    assert (found["total"], found["equal"]) == (4, 2)
    assert [(one["device"], one["different"], one["missing"], one["unit"]) for one in found["devices"]] == [
        ("wtg-02/blade-1/pmm", 2, 0, 0),
        ("wtg-03/blade-1/pmm", 1, 1, 0),
        ("wtg-01/blade-1/pmm", 0, 0, 0),
        ("wtg-02/blade-2/pmm", 0, 0, 1),
    ]
    assert [one["rank"] for one in found["devices"]] == [1, 2, 3, 4]
    assert sum(found["devices"][0]["by_group"].values()) == 2
    assert found["turbines"][0] == {"turbine": "wtg-02", "devices": 2, "unlike": 1, "different": 2, "missing": 0}
    assert [one["turbine"] for one in found["turbines"]] == ["wtg-02", "wtg-03", "wtg-01"]
    assert [(one["address"], one["different"], one["missing"]) for one in found["parameters"]][:2] == [
        ("3110:01", 2, 0),
        ("3110:02", 1, 1),
    ]
    for named in (key, "oat-pmm", f"set:{key}", "golden:oat-pmm", tmp_path / "0.json"):
        assert told(sets, named)[0]["devices"] == found["devices"], named


def test_the_table_for_people_shows_those_that_stand_out(sets: Sets, tmp_path: Path) -> None:
    fleet(sets, tmp_path)
    code, out, err = sets("fleet")
    assert code == 0
    lines = out.splitlines()
    assert lines[0].startswith("wtg-01/blade-1/pmm, golden set: 2026-05-01 08:00 UTC")
    assert lines[1] == "Devices compared: 4 (turbines: 3); as the golden set: 2; not comparable: 0"
    rows = [line.split() for line in lines if line[:1].isdigit() and "/blade" in line]
    assert [row[:6] for row in rows] == [
        ["1", "wtg-02/blade-1/pmm", "2026-05-02", "2", "0", "0"],
        ["2", "wtg-03/blade-1/pmm", "2026-05-03", "1", "1", "0"],
    ]
    assert [line.split() for line in lines if line.startswith("wtg-0") and "/" not in line] == [
        ["wtg-02", "2", "1", "2", "0"],
        ["wtg-03", "1", "1", "1", "1"],
    ]
    assert "--limit 0" not in err
    _code, out, err = sets("fleet", "--limit", "1")
    assert "wtg-03" not in out and "--limit 0" in err


def test_the_csv_has_a_row_a_device(sets: Sets, tmp_path: Path) -> None:
    fleet(sets, tmp_path)
    rows = list(csv.DictReader(io.StringIO(sets("fleet", "oat-pmm", "--format", "csv")[1])))
    assert [(row["rank"], row["device"], row["different"], row["missing"], row["unit"]) for row in rows][:2] == [
        ("1", "wtg-02/blade-1/pmm", "2", "0", "0"),
        ("2", "wtg-03/blade-1/pmm", "1", "1", "0"),
    ]
    assert {row["golden"] for row in rows} == {"golden:oat-pmm"}
    group = PMM.entries[LIMIT].group
    assert rows[0][group] == "2"


def test_set_files_of_the_data_folder_belong_to_the_fleet(sets: Sets, tmp_path: Path) -> None:
    key = fleet(sets, tmp_path)
    folder = sets.data / "sets" / "wtg-04"
    folder.mkdir(parents=True)
    (folder / "new.json").write_text(dump_set(taken(4, 1, {LIMIT: 400})), encoding="utf-8")
    assert "wtg-04/blade-1/pmm" in [one["device"] for one in told(sets, key)[0]["devices"]]


@pytest.mark.parametrize(
    ("words", "code", "named"),
    [
        ((), 2, "no set is golden"),
        (("oat-pmc",), 2, "golden:oat-pmc"),
        (("0195f3a2",), 2, "set:0195f3a2"),
        (("live:1",), 2, "set that is kept"),
        (("editor:wtg-02/blade-1/pmm",), 2, "set that is kept"),
    ],
)
def test_what_a_fleet_cannot_be_held_against_is_named(
    sets: Sets, words: tuple[str, ...], code: int, named: str
) -> None:
    got, out, err = sets("fleet", *words)
    assert (got, out) == (code, "")
    assert named in err


def test_blades_of_the_library_are_put_side_by_side(sets: Sets, tmp_path: Path) -> None:
    site = ("--site", site_for("socketcand:127.0.0.1:1", tmp_path))
    files = []
    for blade, limit in ((1, 500), (2, 490)):
        one = taken(7, blade, {LIMIT: limit, CHARGED: blade})
        files.append(tmp_path / f"{blade}.json")
        files[-1].write_text(dump_set(replace(one, unread={})), encoding="utf-8")
    for line in sets("import", *files, "--json")[1].splitlines():
        assert sets("tag", json.loads(line)["id"], "as-delivered")[0] == 0
    code, out, err = sets("parity", "wtg-07", "--kind", "delivered", *site, "--json")
    assert code == 1, err
    (part,) = json.loads(out)["parts"]
    assert (part["description"], part["blades"], part["without"]) == ("oat-pmm", [1, 2], [3])
    states = {row["address"]: row["state"] for row in part["rows"]}
    assert (states["3110:01"], states["3050"]) == ("different", "unit")
    code, out, err = sets("parity", "--kind", "delivered", *site)
    assert code == 1
    row = next(line for line in out.splitlines() if line.startswith("3110:01"))
    assert row.endswith("50.0 °C  49.0 °C")
    assert "blade 3" in err
    assert sets("parity", "--kind", "left", *site)[0] == 2, "no visit has seen them"
    assert sets("parity", "wtg-99", *site)[0] == 2
    assert sets("parity")[0] == 2


def test_blades_as_they_are_now(sets: Sets, served: Served, tmp_path: Path) -> None:
    site = ("--site", site_for(served.address, tmp_path), "--listen-s", "0.1")
    served.turbine.devices[2].store.cell(0x3110, 1).raw = 470
    code, out, err = sets("parity", *site, "--json")
    assert code == 1, err
    parts = {one["description"]: one for one in json.loads(out)["parts"]}
    assert {name: one["blades"] for name, one in parts.items()} == {"oat-pmm": [1, 2, 3], "oat-pmc": [1, 2, 3]}
    row = next(row for row in parts["oat-pmm"]["rows"] if row["address"] == "3110:01")
    assert [cell["raw"] for cell in row["cells"]] == [500, 470, 500]
    assert not [row["address"] for row in parts["oat-pmc"]["rows"] if row["state"] == "different"]
