"""``hubside pdo``: shows what a device says, changes it by a file as a whole, puts it back; on a twin over a wire."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tomllib
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from app.store.store import Store
from app.twins.line import Fault, drop
from app.wire.frame import Can
from tests.e2e.conftest import site_for
from tests.service.conftest import MS, Served, served

__all__ = ["served"]

PMC = "wtg-07/blade-1/pmc"
FILE = """\
schema = 1

[tpdo2]
enabled = true
cob_id = "$NODEID+0x280"
inhibit_ms = 10
event_ms = 50
mapped = ["6064", "6041/16"]
"""
WRITES = [
    ("clear", "1A01:00", 0),
    ("map", "1A01:01", 0x60640020),
    ("map", "1A01:02", 0x60410010),
    ("count", "1A01:00", 2),
    ("parameter", "1801:03", 100),
    ("parameter", "1801:05", 50),
    ("enable", "1801:01", 0x4000028B),
]


@dataclass
class Pdo:
    """``hubside pdo`` on a data folder and a site of its own."""

    data: Path
    site: tuple[str, ...]
    capsys: pytest.CaptureFixture[str]
    file: Path

    def __call__(self, action: str, *words: object) -> tuple[int, str, str]:
        code = main(["--data", str(self.data), "pdo", action, PMC, *map(str, words), *self.site])
        told = self.capsys.readouterr()
        return code, told.out, told.err

    def json(self, action: str, *words: object) -> Any:
        code, out, err = self(action, *words, "--json")
        assert code == 0, err
        return json.loads(out)

    def shown(self, name: str) -> dict[str, Any]:
        found: dict[str, Any] = next(one for one in self.json("show")["pdos"] if one["pdo"] == name)
        return found


@pytest.fixture
def pdo(served: Served, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Pdo:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    monkeypatch.setenv("HUBSIDE_PERSON", "Anna")
    monkeypatch.setattr("app.cli.pdo.MEASURE_S", 0.0)  # no figure of these tests is a measured one
    file = tmp_path / "pdos.toml"
    file.write_text(FILE)
    site = ("--site", str(site_for(served.address, tmp_path)), "--listen-s", "0.1")
    return Pdo(tmp_path / "data", site, capsys, file)


def test_it_shows_what_every_pdo_carries(pdo: Pdo) -> None:
    code, out, err = pdo("show")
    assert code == 0, err
    lines = out.splitlines()
    assert re.match(r"RPDO1 +20Bh +on +At once \(255\) .* 6040 +controlword +16$", lines[1])
    at = next(number for number, line in enumerate(lines) if line.startswith("TPDO2"))
    assert re.match(r"TPDO2 +28Bh +off .* 6041 +statusword +16$", lines[at])
    assert re.match(r" +6064 +position actual value +32$", lines[at + 1])
    assert "STOP and FEATHER go by RPDO1" in err and "Bus load" in err
    assert not pdo.data.exists(), "showing needs no store"


def test_for_machines(pdo: Pdo) -> None:
    found = pdo.json("show")
    assert (found["device"], found["bitrate"]) == (PMC, 500_000)
    assert [one["pdo"] for one in found["pdos"]] == [f"{kind}{n}" for kind in ("RPDO", "TPDO") for n in range(1, 5)]
    first = found["pdos"][0]
    assert (first["enabled"], first["can_id"], first["type"], first["stop_path"]) == (True, 0x20B, 255, True)
    assert first["mapped"] == [{"object": "6040:00", "name": "controlword", "bits": 16}]


def test_what_it_prints_as_a_file_changes_nothing(pdo: Pdo) -> None:
    _, out, _ = pdo("show", "--toml")
    assert tomllib.loads(out)["tpdo1"]["cob_id"] == "$NODEID+0x180"
    pdo.file.write_text(out)
    code, out, _ = pdo("set", pdo.file, "--dry-run")
    assert code == 0 and "No change" in out
    code, _, err = pdo("set", pdo.file)
    assert code == 2 and "no PDO is to be changed" in err


def test_a_dry_run_tells_order_and_load_and_writes_nothing(pdo: Pdo) -> None:
    before = pdo.shown("TPDO2")
    found = pdo.json("set", pdo.file, "--dry-run")
    assert [(one["step"], one["address"], one["raw"]) for one in found["writes"]] == WRITES
    (changed,) = found["load"]["changed"]
    assert (changed["pdo"], changed["now"]["basis"], changed["after"]["per_second"]) == ("TPDO2", "off", 100.0)
    load = found["load"]
    share = 100 * (47 + 48 + (34 + 48 - 1) // 4) / 500_000
    assert load["pdos_after"] - load["pdos_now"] == pytest.approx(share, abs=2e-5)
    assert load["bus_after"] - load["bus_now"] == pytest.approx(share, abs=2e-5)
    code, out, err = pdo("set", pdo.file, "--dry-run")
    assert code == 0, err
    assert re.search(r"^7 +TPDO2 +enable +1801:01 +C000028Bh +4000028Bh$", out, re.MULTILINE)
    assert "PDOs, estimated:" in out
    assert pdo.shown("TPDO2") == before and not pdo.data.exists()


def test_a_change_and_its_undo(pdo: Pdo) -> None:
    before = pdo.shown("TPDO2")
    done = pdo.json("set", pdo.file)
    assert done["written"] == [address.removesuffix(":00") for _, address, _ in WRITES]
    after = pdo.shown("TPDO2")
    assert (after["enabled"], after["inhibit_ms"], after["event_ms"]) == (True, 10.0, 50)
    assert [one["object"] for one in after["mapped"]] == ["6064:00", "6041:00"]
    with closing(Store.open(pdo.data)) as store:
        rows = store.call(lambda kept: kept.exec_driver_sql("SELECT person, kind FROM audit").all())
    assert ("Anna", "pdo_changed") in [tuple(row) for row in rows]
    code, out, _ = pdo("undo", "--dry-run")
    assert code == 0 and "disable" in out
    assert pdo.shown("TPDO2") == after
    code, out, err = pdo("undo")
    assert code == 0 and "what stood before the change stands again" in out, err
    assert pdo.shown("TPDO2") == before
    assert pdo("undo")[0] == 3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "'schema = 1' is missing"),
        ("schema = 1\n", "names no PDO"),
        ("schema = 1\n[tpdo9]\n", "'tpdo9' is no PDO of the device"),
        ("schema = 1\n[tpdo2]\nevent = 5\n", "[tpdo2] 'event' is none of"),
        ("schema = 1\n[tpdo2]\nevent_ms = 70000\n", "'event_ms' is a whole number from 0 to 65535"),
        ("schema = 1\n[tpdo2]\nevent_ms = true\n", "'event_ms' is a whole number"),
        ("schema = 1\n[tpdo2]\ninhibit_ms = 0.05\n", "steps of 0.1 ms"),
        ("schema = 1\n[tpdo2]\nenabled = 1\n", "'enabled' is true or false"),
        ('schema = 1\n[tpdo2]\ncob_id = "280"\n', "'cob_id' is an identifier"),
        ("schema = 1\n[tpdo2]\ncob_id = 0x4000028B\n", "'cob_id' is an identifier"),
        ('schema = 1\n[tpdo2]\nmapped = ["606"]\n', "which is no object"),
        ('schema = 1\n[tpdo2]\nmapped = ["6064/0"]\n', "no number of bits"),
        ('schema = 1\n[tpdo2]\nmapped = ["7FFF"]\n', "of which no width is known"),
        ("schema = 1\n[tpdo2\n", "pdos.toml"),
    ],
)
def test_a_file_that_is_wrong_names_the_place(pdo: Pdo, text: str, said: str) -> None:
    pdo.file.write_text(text)
    code, _, err = pdo("set", pdo.file)
    assert code == 2 and said in err and "pdos.toml" in err


@pytest.mark.parametrize(
    ("table", "code"),
    [
        ("[rpdo1]\nenabled = false\n", "stop_path"),
        ("[rpdo1]\ntype = 1\n", "stop_path"),
        ('[tpdo2]\nenabled = true\nmapped = ["6065"]\n', "not_mappable"),
        ("[tpdo2]\nenabled = true\ncob_id = 0x58B\n", "restricted"),
        ("[tpdo2]\nenabled = true\ncob_id = 0x18C\n", "cob_id_taken"),
    ],
)
def test_what_the_rules_refuse_is_refused_with_nothing_written(pdo: Pdo, table: str, code: str) -> None:
    pdo.file.write_text(f"schema = 1\n{table}")
    exit_code, out, _ = pdo("set", pdo.file, "--dry-run", "--json")
    errors = [one["code"] for one in json.loads(out)["findings"] if one["severity"] == "error"]
    assert exit_code == 3 and code in errors
    before = pdo.json("show")["pdos"]
    exit_code, _, err = pdo("set", pdo.file, "--json")
    assert (exit_code, json.loads(err.splitlines()[-1])["error"]) == (3, "pdo_refused")
    assert [one["mapped"] for one in pdo.json("show")["pdos"]] == [one["mapped"] for one in before]


def test_what_the_device_refuses_is_put_back(pdo: Pdo) -> None:
    """29-bit identifiers are refused by the unit alone: all else is written by then."""
    before = pdo.shown("TPDO2")
    pdo.file.write_text(FILE.replace('"$NODEID+0x280"', "0x12345\nextended = true"))
    code, _, err = pdo("set", pdo.file)
    assert code == 6
    assert "1801:01" in err and "what stood before stands again" in err
    assert pdo.shown("TPDO2") == before


def test_while_another_process_has_the_store_nothing_is_changed_but_all_is_shown(pdo: Pdo) -> None:
    with closing(Store.open(pdo.data)):
        code, _, err = pdo("set", pdo.file, "--json")
        assert (code, json.loads(err.splitlines()[-1])["error"]) == (2, "store_in_use")
        assert pdo("set", pdo.file, "--dry-run")[0] == 0
        assert pdo("show")[0] == 0


def is_write_of(mux: bytes) -> Callable[[Can], bool]:
    return lambda can: can.can_id == 0x60B and can.data[0] >> 5 == 1 and can.data[1:4] == mux


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_who_ends_it_midway_has_everything_put_back_first(pdo: Pdo, served: Served, tmp_path: Path) -> None:
    before = pdo.shown("TPDO2")
    fifo = tmp_path / "begun"
    os.mkfifo(fifo)

    def begun(can: Can) -> tuple[tuple[int, Can], ...]:
        fd = os.open(fifo, os.O_WRONLY)
        os.write(fd, b".")
        os.close(fd)
        return ((400 * MS, can),)

    served.spoil(Fault(is_write_of(b"\x01\x1a\x01"), begun))
    words = (sys.executable, "-m", "app.cli", "--data", str(pdo.data), "pdo", "set", PMC, str(pdo.file), *pdo.site)
    with subprocess.Popen(words, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as command:
        fifo.read_bytes()
        command.send_signal(signal.SIGTERM)
        _, err = command.communicate(timeout=60)
    assert command.returncode == 143, err
    assert "being put back" in err
    assert pdo.shown("TPDO2") == before
    assert pdo("undo")[0] == 3, "nothing is left to be put back"


def test_a_neighbour_that_does_not_answer_is_named(pdo: Pdo, served: Served) -> None:
    served.spoil(Fault(lambda can: can.can_id == 0x602, drop, times=None))
    code, _, err = pdo("show")
    assert code == 0 and "wtg-07/blade-2/pmm: its PDOs could not be read" in err
