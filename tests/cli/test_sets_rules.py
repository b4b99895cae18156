"""``hubside sets rules`` and ``sets check``: the list, set files of one station together, and connected devices."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from pathlib import Path

import pytest

from app.cli.main import main
from app.model.description_file import load_builtin
from app.model.rules.all_rules import ALL
from app.model.rules.look import PMC, PMM
from app.model.set_dcf import dump_dcf
from app.model.sets import Identity, Origin, ParameterSet, dump_set
from app.model.station import StationValues
from tests.e2e.conftest import site_for
from tests.e2e.processes import hubside
from tests.model.rules.stations import SLUGS, healthy
from tests.service.conftest import Served, served

__all__ = ["served"]

Captured = pytest.CaptureFixture[str]


def write(folder: Path, station: StationValues, kind: str, suffix: str = "json") -> str:
    """One device of a station as a file; gives its path."""
    device = station.of_kind(kind)
    assert device is not None
    origin = Origin("wtg-07", device.slug, 2, "2026-05-04T08:00:00Z", "Anna", "as found", "hubside")
    made = ParameterSet(kind, device.description.version, Identity(), origin, device.values)
    path = folder / f"{kind}.{suffix}"
    path.write_text(dump_set(made) if suffix == "json" else dump_dcf(made, device.description), encoding="utf-8")
    return str(path)


def test_the_list_is_complete_in_every_format(capsys: Captured) -> None:
    assert main(["sets", "rules", "--format", "csv"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [row["id"] for row in rows] == [rule.id for rule in ALL]
    ladder = rows[0]
    assert (ladder["severity"], ladder["stepwise"], ladder["section"]) == ("error", "1", "4.2.2")
    assert "oat-pmc/6510:04" in ladder["objects"].split()
    assert main(["sets", "rules", "--format", "json"]) == 0
    assert [one["title"] for one in json.loads(capsys.readouterr().out)] == [row["title"] for row in rows]
    assert main(["sets", "rules"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(ALL) + 1


def test_files_of_one_station_are_judged_together(tmp_path: Path, capsys: Captured) -> None:
    sound = healthy()
    files = [write(tmp_path, sound, PMM), write(tmp_path, sound, PMC, "dcf")]
    assert main(["sets", "check", *files]) == 0
    assert capsys.readouterr().out == "wtg-07/blade-2: 0 errors, 0 warnings, 0 notes, 0 rules not checked\n"

    write(tmp_path, healthy(pmc={"6510:04": 400}), PMC, "dcf")
    assert main(["sets", "check", *files]) == 3, "a rule of weight error is broken"
    out = capsys.readouterr().out
    assert "6510:04 = 400 V must lie below 30FA:03 = 400 V" in out
    assert f"{SLUGS[PMC]} 6510:04, {SLUGS[PMM]} 30FA:03" in out


def test_without_its_partner_the_file_says_what_was_not_checked(tmp_path: Path, capsys: Captured) -> None:
    assert main(["sets", "check", write(tmp_path, healthy(), PMM), "--json"]) == 0
    (judged,) = json.loads(capsys.readouterr().out)
    assert judged["devices"] == [SLUGS[PMM]]
    unchecked = {one["rule"]: one for one in judged["findings"] if one["verdict"] == "not-checked"}
    assert unchecked["oat.dc_link_ladder"]["text"] == "Not checked: OAT PMC not known"


def test_a_note_or_warning_is_told_and_is_no_error(tmp_path: Path, capsys: Captured) -> None:
    station = healthy(pmm={"30E3": 0})
    files = [write(tmp_path, station, kind) for kind in (PMM, PMC)]
    assert main(["sets", "check", *files]) == 0
    assert "The cycle is 0: no automatic test (30E3 still holds its default)" in capsys.readouterr().out


@pytest.mark.parametrize("given", ([], ["a.json", "--can", "socketcand:127.0.0.1:1"]), ids=("neither", "both"))
def test_it_asks_for_files_or_a_connection(given: list[str], capsys: Captured) -> None:
    assert main(["sets", "check", *given]) == 2
    assert "name set files to check, or a connection" in capsys.readouterr().err


def test_a_damaged_file_or_one_of_an_unknown_device_is_refused(tmp_path: Path, capsys: Captured) -> None:
    path = Path(write(tmp_path, healthy(), PMM))
    path.write_text(path.read_text().replace('"30FA:01": 560', '"30FA:01": 561'))
    assert main(["sets", "check", str(path)]) != 0
    assert "the hash does not fit" in capsys.readouterr().err
    foreign = replace(load_builtin(PMM), id="somebody-elses")
    origin = Origin("a", "a/b/c", 2, "2026-05-04T08:00:00Z", "", "", "")
    path.write_text(dump_set(ParameterSet(foreign.id, "1", Identity(), origin, {})))
    assert main(["sets", "check", str(path)]) != 0
    assert "somebody-elses" in capsys.readouterr().err


def test_connected_devices_are_read_and_judged(served: Served, tmp_path: Path) -> None:
    """Twins as delivered break no rule of weight error; those of a blade whose value was changed do."""
    site, data = str(site_for(served.address, tmp_path)), tmp_path / "data"
    assert hubside("write", "--site", site, SLUGS[PMC], "6510:04", "300 V", data=data).code == 0
    done = hubside("sets", "check", "--site", site, "--json", data=data)
    assert done.code == 3, done.err
    broken = {one["station"]: {found["rule"] for found in one["findings"]} for one in done.json}
    delivered = {
        "oat.difference_off",
        "oat.connection_loss",
        "oat.self_test_off",
        "oat.motor_fan_off",
        "oat.mirror_overflow",
    }
    assert broken == {
        "wtg-07/blade-1": delivered,
        "wtg-07/blade-2": delivered | {"oat.pmc_minimum_below_battery"},
        "wtg-07/blade-3": delivered,
    }
