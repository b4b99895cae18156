"""``hubside sets``: the library on the command line, with its exit codes."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from app.model.sets import dump_set, iso_time
from tests.model.set_rig import ORIGIN, whole_set
from tests.web.rig import ROOT

VISIT = ROOT / "recordings" / "scenarios" / "7-service-visit.mcap"


@dataclass
class Sets:
    """``hubside sets`` in a data folder of its own."""

    data: Path
    capsys: pytest.CaptureFixture[str]

    def __call__(self, *words: object) -> tuple[int, str, str]:
        code = main(["--data", str(self.data), "sets", *map(str, words)])
        told = self.capsys.readouterr()
        return code, told.out, told.err

    def json(self, *words: object) -> Any:
        code, out, err = self(*words, "--json")
        assert code == 0, err
        lines = out.splitlines()
        return json.loads(lines[0]) if len(lines) == 1 else [json.loads(line) for line in lines]


@pytest.fixture
def sets(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Sets:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    return Sets(tmp_path / "data", capsys)


@pytest.mark.parametrize("kind", ["json", "dcf", "csv"])
def test_a_set_goes_out_and_comes_in_as_the_same(sets: Sets, tmp_path: Path, kind: str) -> None:
    source = tmp_path / "in.json"
    source.write_text(dump_set(whole_set("oat-pmc")))
    first = sets.json("import", source)
    target = tmp_path / f"out.{kind}"
    assert sets("export", first["id"], "--format", kind, "--output", target)[0] == 0
    assert sets("export", first["id"], "--format", kind, "--output", target)[0] == 2, "a file is never replaced"
    assert sets.json("import", target)["id"] == first["id"]
    assert len(sets.json("list")) == 1
    assert json.loads(sets("show", first["id"], "--json")[1])["hash"] == f"sha256:{first['hash']}"


def test_one_bad_file_and_none_is_taken(sets: Sets, tmp_path: Path) -> None:
    good, bad = tmp_path / "good.json", tmp_path / "bad.csv"
    good.write_text(dump_set(whole_set("oat-pmc")))
    bad.write_text("address,raw\n6065,many\n")
    code, _out, err = sets("import", good, bad)
    assert code == 2
    assert "bad.csv, line 2: 'many' is no raw value" in err
    assert sets.json("list") == []
    bad.write_text("address,raw\n6065,1\n2FFF,1\n")
    code, _out, err = sets("import", bad, "--device", "wtg-07/blade-1/pmc")
    assert code == 0
    assert "2FFF" in err and "line 3" in err
    assert sets("import", bad, "--device", "pmc")[0] == 2


def test_tags_and_nameplates_and_what_is_refused(sets: Sets, tmp_path: Path) -> None:
    source = tmp_path / "in.json"
    source.write_text(dump_set(replace(whole_set("oat-pmc"), unread={})))
    key = sets.json("import", source)["id"]
    assert sets.json("tag", key, "golden")["tags"] == ["golden"]
    assert [one["id"] for one in sets.json("list", "--tag", "golden")] == [key]
    assert sets.json("tag", key, "golden", "--off")["tags"] == []
    assert sets("tag", "00000000", "golden")[0] == 3
    assert sets("nameplate", "wtg-07/blade-1/pmc", "P1", "P2")[0] == 3
    assert sets("nameplate", "wtg-07/blade-1/pmc", "P1")[0] == 2
    assert sets.json("nameplate", "wtg-07/blade-1/pmc", "P1", "P1")["serial"] == "P1"
    assert sets.json("nameplate", "wtg-07/blade-1/pmc")["serial"] == "P1"


def test_a_set_with_unread_objects_is_not_taken_as_golden(sets: Sets, tmp_path: Path) -> None:
    source = tmp_path / "in.json"
    source.write_text(dump_set(whole_set("oat-pmc")))
    key = sets.json("import", source)["id"]
    code, _out, err = sets("tag", key, "golden")
    assert code == 3
    assert "Back up the device again" in err
    assert sets.json("list", "--tag", "golden") == []


def test_sets_come_out_of_a_recording_with_the_instant_and_direction_of_each_value(sets: Sets) -> None:
    found = {one["device"]: one for one in sets.json("recover", VISIT)}
    assert len(found) == 6
    seen = found["wtg-07/blade-2/pmc"]["seen"]
    assert {one["access"] for one in seen.values()} == {"read", "write"}
    assert len(sets.json("list")) == 6
    assert_shown_as_seen(sets, found["wtg-07/blade-2/pmc"])
    assert sets("recover", VISIT.with_name("none.mcap"))[0] == 2
    assert sets("recover", VISIT, "--node", "12=nobody")[0] == 2
    code, _out, err = sets("recover", VISIT, VISIT)
    assert code == 2 and "at the same time" in err
    assert len(sets.json("list")) == 6


def test_a_set_from_a_time_to_come_is_taken_with_a_word_and_one_from_no_place_is_not(
    sets: Sets, tmp_path: Path
) -> None:
    ahead, naive = tmp_path / "ahead.json", tmp_path / "naive.json"
    ahead.write_text(dump_set(whole_set("oat-pmc", replace(ORIGIN, time="2199-01-01T00:00:00Z"))))
    naive.write_text(dump_set(whole_set("oat-pmc", replace(ORIGIN, time="2026-01-01T00:00:00"))))
    code, _out, err = sets("import", ahead)
    assert code == 0 and "2199-01-01T00:00:00Z" in err and "ahead of this computer" in err
    line = next(n for n, line in enumerate(naive.read_text().splitlines(), 1) if '"time"' in line)
    code, _out, err = sets("import", naive)
    assert code == 2 and f"naive.json, line {line}: " in err and "offset from UTC" in err
    assert len(sets.json("list")) == 1


def assert_shown_as_seen(sets: Sets, one: dict[str, Any]) -> None:
    """With instant, direction and doubt of each value: for people, for machines, and beside another set."""
    shown = json.loads(sets("show", one["id"], "--json")[1])
    assert shown["recording"] == VISIT.name
    assert {key.removesuffix(":00"): look for key, look in shown["seen"].items()} == one["seen"]
    written = next(key for key, look in one["seen"].items() if look["access"] == "write" and not look["ours"])
    doubtful = next(key for key, look in one["seen"].items() if look["doubt"] == "boot-up")
    text = sets("show", one["id"])[1]
    rows = {line.split()[0]: line for line in text.splitlines() if line}
    looked_at = iso_time(one["seen"][written]["t_ns"])[:19].replace("T", " ")
    assert f"  w* {looked_at}" in rows[written]
    assert "? 20" in rows[doubtful]
    assert f"Seen in {VISIT.name}: r read, w written" in text
    columns = ("diff", f"set:{one['id']}", f"set:{one['id']}", "--same", "--all")
    code, told, _err = sets(*columns)
    assert code == 1, "what nobody saw is missing in both"
    assert next(line for line in told.splitlines() if line.startswith(written)).count(f"[w* {looked_at}") == 2
    assert f"Seen in {VISIT.name}" in told
    row = next(row for row in json.loads(sets(*columns, "--json")[1])["rows"] if row["address"] == written)
    assert [cell["seen"] for cell in row["cells"]] == [one["seen"][written]] * 2
    head, *lines = csv.reader(io.StringIO(sets(*columns, "--csv")[1]))
    line = next(line for line in lines if line[0] == written)
    assert (
        line[head.index(next(cell for cell in head if cell.endswith(": seen")))]
        == f"written {looked_at} UTC, by another master"
    )
    html = sets(*columns, "--html", "-")[1]
    assert html.count(f'<small class="seen">written {looked_at} UTC, by another master</small>') >= 2


def test_a_set_that_comes_from_no_recording_has_no_marks(sets: Sets, tmp_path: Path) -> None:
    source = tmp_path / "in.json"
    source.write_text(dump_set(whole_set("oat-pmc")))
    key = sets.json("import", source)["id"]
    assert sets("show", key, "--json")[1] == source.read_text()
    assert "Seen in" not in sets("show", key)[1]
    head = next(csv.reader(io.StringIO(sets("diff", source, f"set:{key}", "--csv", "--same")[1])))
    assert not [cell for cell in head if cell.endswith(": seen")]
