"""``hubside restore``: what makes no sense is said before anything is done; one document for machines; records."""

from __future__ import annotations

import json
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from app.store.restore_rows import RestoreRow, RestoreState, add_restore
from app.store.store import Store
from tests.e2e.conftest import site_for
from tests.service.conftest import Served, served

__all__ = ["served"]

PMM = "wtg-07/blade-1/pmm"

WRONG = (
    ((), "usage"),
    (("set.json",), "usage"),
    (("--list", "set.json"), "usage"),
    (("--resume", "--can", "virtual:x", "set.json"), "usage"),
    (("set.json", "--can", "virtual:x", "--confirm-within", "1"), "usage"),
    (("set.json", "--can", "virtual:x", "--other-blades-confirmed"), "usage"),
    (("set.json", "--can", "virtual:x", "--accept", "oat.dc_link_ladder"), "usage"),
    (("set.json", "--can", "virtual:x", "--record-file", "record.txt"), "usage"),
    (("set.json", "--can", "virtual:x", "--record-file", "no/such/folder/record.pdf"), "usage"),
    (("set.json", "--can", "virtual:x", "--record-file", "record.pdf", "--plan"), "usage"),
    (("--list", "--record-file", "record.pdf"), "usage"),
    (("--record-of", "0195f3a2"), "usage"),
    (("--record-of", "0195f3a2", "--record-file", "record.pdf", "set.json"), "usage"),
)


@pytest.mark.parametrize(("arguments", "code"), WRONG)
def test_arguments_that_do_not_go_together(
    arguments: tuple[str, ...], code: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["restore", *arguments, "--json", "--data", str(tmp_path / "data")]) == 2
    assert json.loads(capsys.readouterr().err.splitlines()[-1])["error"] == code
    assert not (tmp_path / "data").exists(), "nothing was opened"


def test_a_record_is_never_written_over_and_nothing_is_begun_for_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    there, gone = tmp_path / "there.pdf", tmp_path / "gone.pdf"
    there.write_bytes(b"an older record")
    gone.symlink_to(tmp_path / "no" / "where")
    for target in (there, gone):
        words = ("set.json", "--can", "virtual:x", "--record-file", str(target), "--data", str(tmp_path / "data"))
        assert main(["restore", *words]) == 2
        assert f"{target} is there already" in capsys.readouterr().err
    assert not (tmp_path / "data").exists(), "nothing was opened"
    assert there.read_bytes() == b"an older record"


def test_only_one_way_at_a_time(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["restore", "--resume", "--roll-back", "--can", "virtual:x"])
    assert caught.value.code == 2
    assert "not allowed with" in capsys.readouterr().err


def test_an_empty_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["restore", "--list", "--json", "--data", str(tmp_path / "data")]) == 0
    assert json.loads(capsys.readouterr().out) == []


@dataclass
class Command:
    """``hubside`` on a data folder of its own."""

    data: Path
    capsys: pytest.CaptureFixture[str]

    def __call__(self, *words: object) -> tuple[int, str, str]:
        code = main(["--data", str(self.data), *map(str, words)])
        told = self.capsys.readouterr()
        return code, told.out, told.err


@pytest.fixture
def hubside(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    return Command(tmp_path / "data", capsys)


def other_set(hubside: Command, site: tuple[object, ...]) -> str:
    """The set of a PMM whose limit is 49.0 °C; the device has 50.0 °C again."""
    assert hubside("write", *site, PMM, "3110:01", "49")[0] == 0
    file: str = json.loads(hubside("backup", *site, PMM, "--json")[1])["file"]
    assert hubside("write", *site, PMM, "3110:01", "50")[0] == 0
    return file


def test_a_restore_writes_its_record_and_later_others_of_it(served: Served, tmp_path: Path, hubside: Command) -> None:
    site = ("--site", site_for(served.address, tmp_path), "--listen-s", "0.1")
    file, record = other_set(hubside, site), tmp_path / "now.pdf"
    code, out, err = hubside("restore", file, *site, "--yes", "--record-file", record, "--json")
    assert code == 0, err
    told: dict[str, Any] = json.loads(out)
    assert [(row["address"], row["wanted"]) for row in told["plan"]["rows"] if row["why"] is None] == [("3110:01", 490)]
    result = told["result"]
    assert (result["end"], result["record_file"]) == ("new", str(record))
    made = [record]
    for name in ("later.html", "later.json"):
        made.append(tmp_path / name)
        assert hubside("restore", "--record-of", result["restore"], "--record-file", made[-1])[0] == 0
    code, out, err = hubside("verify", *made, "--json")
    assert code == 0, out + err
    assert [json.loads(line)["form"] for line in out.splitlines()] == ["pdf", "html", "record"]
    assert {json.loads(line)["record"]["id"] for line in out.splitlines()} == {result["restore"]}
    before = record.read_bytes()
    assert hubside("restore", "--record-of", result["restore"], "--record-file", record)[0] == 2
    assert record.read_bytes() == before, "a file is never written over"

    code, out, err = hubside("restore", file, *site, "--yes", "--record-file", tmp_path / "none.pdf", "--json")
    assert (code, json.loads(err.splitlines()[-1])["error"]) == (3, "restore_refused")
    told = json.loads(out)
    assert [one["code"] for one in told["plan"]["refusals"]] == ["nothing-to-do"]
    assert told["result"] is None
    assert not (tmp_path / "none.pdf").exists()


def test_a_record_that_cannot_be_written_leaves_the_restore_as_it_ended(
    served: Served, tmp_path: Path, hubside: Command
) -> None:
    site = ("--site", site_for(served.address, tmp_path), "--listen-s", "0.1")
    file, record = other_set(hubside, site), tmp_path / ("x" * 250 + ".json")
    code, out, err = hubside("restore", file, *site, "--yes", "--record-file", record, "--json")
    result = json.loads(out)["result"]
    assert (code, result["end"], result["record_file"]) == (2, "new", None)
    assert f"--record-of {result['restore']}" in json.loads(err.splitlines()[-1])["text"]
    assert not [path for path in tmp_path.iterdir() if "xxx" in path.name]


def test_what_has_no_record_is_told_and_no_file_is_made(tmp_path: Path, hubside: Command) -> None:
    details = {"devices": [{"slug": PMM, "description": ["of-a-file-that-is-gone", "1.0.0"]}]}
    row = RestoreRow(
        "r-1", "wtg-07", "wtg-07/blade-1", RestoreState.DONE, "Anna", "", "", 1, json.dumps(details), ended_ns=2
    )
    with closing(Store.open(hubside.data)) as store:
        store.call(lambda connection: add_restore(connection, row, []))
    for restore, code in (("r-1", "restore_record"), ("r-2", "restore_unknown")):
        got, out, err = hubside("restore", "--record-of", restore, "--record-file", tmp_path / "r.html", "--json")
        assert (got, out, json.loads(err)["error"]) == (3, "", code)
    assert list(tmp_path.glob("*r.html*")) == []
