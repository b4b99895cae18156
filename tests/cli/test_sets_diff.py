"""``hubside sets diff``: files of any kind, the library, connected devices; text, JSON, CSV, HTML; exit codes."""

from __future__ import annotations

import asyncio
import csv
import io
import json
import re
import time
from dataclasses import replace
from pathlib import Path

import pytest

from app.cli.main import main
from app.model.address import Address
from app.model.description_file import load_builtin
from app.model.set_dcf import dump_dcf
from app.model.set_record import Source, Tag
from app.model.sets import Identity, Origin, ParameterSet, dump_set
from app.service.compare.known import defaults_of
from app.service.library.library import Library
from app.service.office.audit import AuditLog
from app.store.store import Store
from tests.e2e.conftest import site_for
from tests.e2e.processes import hubside
from tests.service.conftest import Served, served

__all__ = ["served"]

Captured = pytest.CaptureFixture[str]
PMM = load_builtin("oat-pmm")
SLUG = "wtg-07/blade-1/pmm"
LIMIT = Address(0x3110, 1)
CHARGED = Address(0x3050)
ORIGIN = Origin("wtg-07", SLUG, 1, "2026-05-04T08:00:00Z", "Anna", "as found", "hubside")
BEFORE = ParameterSet("oat-pmm", PMM.version, Identity(serial=7), ORIGIN, {**defaults_of(PMM, 1), CHARGED: 100})


def changed(**values: int) -> ParameterSet:
    found = dict(BEFORE.values) | {LIMIT: values.get("limit", BEFORE.values[LIMIT])}
    return replace(BEFORE, values={**found, CHARGED: values.get("charged", 100)})


def file(folder: Path, parameters: ParameterSet, name: str) -> str:
    path = folder / name
    path.write_text(dump_dcf(parameters, PMM) if name.endswith("dcf") else dump_set(parameters), encoding="utf-8")
    return str(path)


def test_files_of_any_kind_are_compared(tmp_path: Path, capsys: Captured) -> None:
    before, after = file(tmp_path, BEFORE, "before.json"), file(tmp_path, changed(limit=490), "after.dcf")
    assert main(["sets", "diff", before, f"file:{after}"]) == 1
    first, second, head, row, *_, summary = capsys.readouterr().out.splitlines()
    assert first.startswith(f"(1) {SLUG}, file {before}: 2026-05-04 08:00 UTC, Anna, as found, oat-pmm")
    assert second.startswith(f"(2) {SLUG}, file {after}")
    assert head.split() == ["ADDRESS", "NAME", "STATE", "(1)", "(2)"]
    assert row.startswith("3110:01")
    assert row.endswith("49.0 °C")
    assert summary.startswith("1 differs, ")


def test_what_is_bound_to_the_unit_is_no_difference_that_counts(tmp_path: Path, capsys: Captured) -> None:
    files = [file(tmp_path, BEFORE, "before.json"), file(tmp_path, changed(charged=222), "after.json")]
    assert main(["sets", "diff", *files, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [(one["address"], one["state"], one["class"]) for one in found["rows"]] == [("3050", "unit", "unit")]
    assert found["summary"]["unit"] == 1
    assert main(["sets", "diff", files[0], files[0]]) == 0


def test_it_is_written_as_csv_and_as_html(tmp_path: Path, capsys: Captured) -> None:
    files = [file(tmp_path, BEFORE, "before.json"), file(tmp_path, changed(limit=490), "after.json")]
    assert main(["sets", "diff", *files, "--csv"]) == 1
    (row,) = csv.DictReader(io.StringIO(capsys.readouterr().out))
    assert (row["address"], row[f"{SLUG}, file {files[1]}: raw"]) == ("3110:01", "490")
    page = tmp_path / "page.html"
    assert main(["sets", "diff", *files, "--html", str(page), "--same"]) == 1
    assert capsys.readouterr().out.startswith("1 differs, ")
    assert page.read_text(encoding="utf-8").count('<tr class="same">') > 50


def test_objects_that_nothing_describes_are_told_and_count(tmp_path: Path, capsys: Captured) -> None:
    names, unknown = ("before.json", "after.json", "more.json"), Address(0x2FFF)
    files = [
        file(tmp_path, replace(BEFORE, values={**BEFORE.values, unknown: raw, Address(0x2FFE): 1}), name)
        for name, raw in zip(names, (1, 1, 2), strict=True)
    ]
    assert main(["sets", "diff", *files[:2]]) == 0
    assert capsys.readouterr().out.rstrip().endswith(", 2 objects are not described here (different: 0)")
    assert main(["sets", "diff", files[0], files[2]]) == 1
    told = capsys.readouterr().out.splitlines()[-1]
    assert told.startswith("0 differ, ")
    assert told.endswith(", 2 objects are not described here (different: 1)")
    page = tmp_path / "page.html"
    assert main(["sets", "diff", files[0], files[2], "--html", str(page)]) == 1
    assert "(different: 1)" in page.read_text(encoding="utf-8")


def test_no_head_of_the_csv_file_is_a_formula(tmp_path: Path, capsys: Captured) -> None:
    """A file that somebody sent says itself which device it is of."""
    files = [
        file(tmp_path, replace(BEFORE, origin=replace(ORIGIN, device=device)), f"{number}.json")
        for number, device in enumerate(("=HYPERLINK(A1)/b/c", "@x/b/c"))
    ]
    assert main(["sets", "diff", *files, "--csv", "--same"]) == 0
    head, *rows = csv.reader(io.StringIO(capsys.readouterr().out))
    assert sum(cell.startswith(("'=HYPERLINK", "'@x")) for cell in head) == 4
    assert not [cell for row in (head, *rows) for cell in row if cell.startswith(("=", "@", "+"))]


@pytest.mark.parametrize(
    ("columns", "named"),
    [
        (["set:0000000000"], "set:0000000000"),
        (["golden:oat-pmm"], "golden:oat-pmm"),
        (["year:wtg-07/blade-1/pmm"], "year:wtg-07/blade-1/pmm"),
        (["default:wtg-07/blade-1/pmm"], "default:wtg-07/blade-1/pmm"),
        (["nothing.json"], "nothing.json"),
        (["live:1"], "--site"),
        (["editor:wtg-07/blade-1/pmm"], "The editor is in the page"),
        ([], "2 to 12"),
    ],
)
def test_a_column_that_is_not_there_is_named(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, columns: list[str], named: str
) -> None:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    there = file(tmp_path, BEFORE, "before.json")
    assert main(["--data", str(tmp_path / "data"), "sets", "diff", there, *columns]) == 2
    assert named in capsys.readouterr().err


def test_sets_of_the_library_are_columns(tmp_path: Path, capsys: Captured) -> None:
    data = tmp_path / "data"

    async def fill() -> str:
        store = Store.open(data)
        audit = AuditLog(store)
        library = Library(store, audit, time.time_ns)
        golden, old = await library.put([BEFORE, replace(changed(limit=470), origin=OLD)], Source.FILE)
        await library.tag(golden.id, Tag.GOLDEN, "Eva")
        await audit.close()
        store.close()
        return old.id

    old = asyncio.run(fill())
    there = ("--data", str(data), "sets", "diff", "--json")
    assert main([*there, "golden:oat-pmm", f"set:{BEFORE.hash[:10]}"]) == 0
    capsys.readouterr()
    assert main([*there, f"set:{old}", f"year:{SLUG}", "golden:oat-pmm"]) == 1
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert [cell["raw"] for cell in row["cells"]] == [470, 470, 500]


OLD = replace(ORIGIN, time="2025-11-20T08:00:00Z")


def test_a_device_is_held_against_a_file(served: Served, tmp_path: Path) -> None:
    there = file(tmp_path, changed(limit=480), "before.json")
    site = ("--site", str(site_for(served.address, tmp_path)))
    done = hubside("sets", "diff", "live:1", there, f"stored:{SLUG}", *site, "--json")
    assert done.code == 1, done.err
    assert [one["spec"] for one in done.json["columns"]] == [f"live:{SLUG}", f"file:{there}", f"stored:{SLUG}"]
    assert done.json["columns"][0]["twin"] is True
    row = next(one for one in done.json["rows"] if one["address"] == "3110:01")
    assert [cell["raw"] for cell in row["cells"]] == [500, 480, None]
    assert row["cells"][2]["state"] == "unread", "nobody has seen the device boot: what is stored is not known"
    notes = [one["note"] for one in done.json["columns"]]
    assert notes[:2] == [None, None]
    assert re.fullmatch(r"No device tells .*: of [1-9]\d+ saved values 0 are known, from a save or .*", notes[2])
    page = tmp_path / "page.html"
    told = hubside("sets", "diff", "live:1", f"stored:{SLUG}", *site, "--html", str(page))
    assert told.code == 1 and notes[2] in page.read_text(encoding="utf-8")
    told = hubside("sets", "diff", "live:1", f"stored:{SLUG}", *site)
    assert told.out.splitlines()[2].strip() == notes[2], "below its column"
