"""``hubside backup``: what its sets carry, nameplates typed twice, and stores that are in use or damaged."""

from __future__ import annotations

import json
import os
import pty
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from app.model.sets import ParameterSet, load_set
from app.store.database import FILE
from app.store.store import Store
from tests.e2e.conftest import site_for
from tests.service.conftest import Served, served

__all__ = ["served"]

PMM = "wtg-07/blade-1/pmm"


@dataclass
class Backup:
    """``hubside`` on a data folder and a site of its own."""

    data: Path
    site: tuple[str, ...]
    capsys: pytest.CaptureFixture[str]

    def run(self, *words: object) -> tuple[int, str, str]:
        code = main(["--data", str(self.data), *map(str, words)])
        told = self.capsys.readouterr()
        return code, told.out, told.err

    def __call__(self, *words: object) -> tuple[int, ParameterSet | None, str]:
        """A backup of the PMM of blade 1: exit code, the set in its file, standard error."""
        code, out, err = self.run("backup", *self.site, PMM, *words, "--json")
        return code, load_set(Path(json.loads(out)["file"]).read_text(), "set") if out else None, err

    def listed(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = json.loads(self.run("sets", "list", "--json")[1])
        return found


@pytest.fixture
def backup(
    served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Backup:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    monkeypatch.setenv("HUBSIDE_PERSON", "Anna")
    say_serial(served, 0)  # as of units whose maker left it out
    site = ("--site", str(site_for(served.address, tmp_path)), "--listen-s", "0.1")
    return Backup(tmp_path / "data", site, capsys)


def say_serial(served: Served, serial: int) -> None:
    """What the PMM of blade 1 tells of itself; 0 is none."""
    served.turbine.devices[1].store.cell(0x1018, 4).source = lambda: serial


def plate(*serials: str) -> list[str]:
    return [word for serial in serials for word in ("--nameplate", f"{PMM}={serial}")]


def test_a_set_carries_who_why_which_order_and_which_unit(backup: Backup) -> None:
    code, found, err = backup("--reason", "yearly", "--work-order", "WO-7", *plate("SN 4711", " SN  4711 "))
    assert (code, found is not None) == (0, True), err
    assert found is not None
    origin = found.origin
    assert (origin.turbine, origin.device, origin.person) == ("wtg-07", PMM, "Anna")
    assert (origin.reason, origin.work_order) == ("yearly", "WO-7")
    assert origin.tool.startswith("hubside ")
    assert found.identity.nameplate == "SN 4711"
    assert "No serial number" not in err
    assert [(one["source"], one["work_order"]) for one in backup.listed()] == [("backup", "WO-7")], (
        "the file is the same"
    )
    _code, again, _err = backup()
    assert again is not None and again.identity.nameplate == "SN 4711", "the plate is known from now on"


def test_what_nothing_identifies_is_said_and_what_tells_its_number_needs_no_plate(
    backup: Backup, served: Served
) -> None:
    code, found, err = backup()
    assert code == 0 and found is not None and found.identity.nameplate is None
    assert f"--nameplate {PMM}=SERIAL" in err
    say_serial(served, 77)
    code, found, err = backup(*plate("SN 1", "SN 1"))
    assert code == 0 and found is not None
    assert (found.identity.serial, found.identity.nameplate) == (77, None)
    assert "tells its serial number itself (77)" in err


@pytest.mark.parametrize(
    ("words", "code", "named"),
    [
        (plate("SN 1", "SN 2"), 3, "the two entries differ"),
        (plate("", ""), 3, "1 to 40 letters"),
        (plate("SN 1"), 2, "twice"),
        (plate("SN 1", "SN 1", "SN 1"), 2, "twice"),
        (["--nameplate", PMM], 2, "DEVICE=SERIAL"),
        (["--nameplate", "wtg-99/a/b=1", "--nameplate", "wtg-99/a/b=1"], 2, "no device"),
    ],
)
def test_a_plate_that_is_not_typed_twice_alike_stops_the_backup(
    backup: Backup, words: list[str], code: int, named: str
) -> None:
    got, found, err = backup(*words)
    assert (got, found) == (code, None)
    assert named in err
    assert not list(backup.data.glob("sets/*/*"))


def test_a_plate_needs_a_device_with_a_name(backup: Backup) -> None:
    code, out, err = backup.run("backup", "--can", "virtual:x", "1", "--nameplate", "1=SN", "--nameplate", "1=SN")
    assert (code, out) == (2, "")
    assert "--site" in err


@pytest.mark.parametrize(("second", "code"), [("SN 4711", 0), ("SN 4712", 3)])
def test_a_terminal_asks_for_the_plate_once_more(
    backup: Backup, monkeypatch: pytest.MonkeyPatch, second: str, code: int
) -> None:
    near, far = pty.openpty()
    with os.fdopen(near, "w") as keyboard, os.fdopen(far) as terminal:
        monkeypatch.setattr("sys.stdin", terminal)
        keyboard.write(f"{second}\n")
        keyboard.flush()
        got, found, err = backup(*plate("SN 4711"))
    assert got == code
    assert f"plate of {PMM}, once more" in err
    assert (found is not None and found.identity.nameplate == "SN 4711") is (code == 0)


def test_a_reading_is_kept_although_the_store_is_not_to_be_had(backup: Backup) -> None:
    assert backup(*plate("SN 1", "SN 1"))[0] == 0
    with closing(Store.open(backup.data)):
        code, found, _err = backup("--reason", "beside a server")
        assert code == 0
        assert found is not None and found.identity.nameplate == "SN 1", "it is looked up all the same"
        assert backup(*plate("SN 2", "SN 2"))[:2] == (2, None), "a plate cannot be kept: nothing is sent"
    assert {one["reason"] for one in backup.listed()} == {"", "beside a server"}
    (backup.data / FILE).write_bytes(b"no store " * 1000)
    code, found, err = backup()
    assert (code, found is not None) == (2, True)
    assert json.loads(err.splitlines()[0])["error"] == "store_damaged"
