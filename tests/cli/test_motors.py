"""``hubside motors``: what is kept, told and refused, and motors of real twins."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from app.cli.main import main
from tests.e2e.conftest import site_for
from tests.service.conftest import Served, served

__all__ = ["served"]

PMC = "wtg-07/blade-1/pmc"
NEW = ("add", "Lorentz", "PM 5.5-2", "--plate", "power_kw=5,5", "--set", "6410:03=400 V", "--set", "6402=asynchronous")


@dataclass
class Motors:
    """The command on a data folder of its own."""

    data: Path
    capsys: pytest.CaptureFixture[str]

    def run(self, *words: str) -> tuple[int, str, str]:
        """Exit code, standard output and standard error."""
        code = main(["--data", str(self.data), "motors", *words])
        told = self.capsys.readouterr()
        return code, told.out, told.err

    def json(self, *words: str) -> Any:
        """What it tells machines."""
        code, out, err = self.run(*words, "--json")
        assert code == 0, err
        return json.loads(out.splitlines()[-1])


@pytest.fixture
def motors(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Motors:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    return Motors(tmp_path / "data", capsys)


def test_a_motor_is_added_changed_shown_and_deleted(motors: Motors) -> None:
    added = motors.json(*NEW)
    assert (added["version"], added["plate"]["power_kw"], added["values"]) == (1, 5.5, {"6402": 7, "6410:03": 4000})
    changed = motors.json("edit", "PM 5.5-2", "--set", "6410:03=390", "--set", "6402=", "--remarks", "rewound")
    assert (changed["version"], changed["values"], changed["remarks"]) == (2, {"6410:03": 3900}, "rewound")
    assert motors.json("show", "PM 5.5-2@1") == added
    assert [one["version"] for one in motors.json("show", added["id"], "--versions")] == [2, 1]
    _code, out, _err = motors.run("show", "PM 5.5-2")
    assert "390.0 V" in out and "5.5 kW" in out and "rho offset" in out
    assert motors.json("delete", "PM 5.5-2") == {"id": added["id"], "deleted": True}
    assert [one["invented"] for one in motors.json("list")] == [True] * 3


def test_the_list_is_searched_and_marks_what_is_invented(motors: Motors) -> None:
    motors.json(*NEW)
    _code, out, _err = motors.run("list")
    assert len(out.splitlines()) == 5 and out.count("example (invented)") == 3
    assert [one["type"] for one in motors.json("list", "--search", "LORENTZ 5.5")] == ["PM 5.5-2"]
    assert motors.json("list", "--search", "nothing") == []


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("add", "A", "B", "--set", "6073=210"), 3, "it must be from 0.0 to 200.0 %"),
        (("add", "A", "B", "--set", "6410:03=much"), 3, "does not fit"),
        (("add", "A", "B", "--set", "6410:03"), 2, "has no ="),
        (("add", "A", "B", "--plate", "power=3"), 2, "no plate field"),
        (("add", "A", "B", "--plate", "power_kw=x"), 3, "Rated power: this is no number"),
        (("add", " ", "B"), 3, "Maker: it must not be empty"),
        (("show", "nothing"), 3, "no motor nothing"),
        (("edit", "SM 4.2-8 servo", "--remarks", "mine"), 3, "invented example"),
        (("delete", "SM 4.2-8 servo"), 3, "invented example"),
        (("compare", "SM 4.2-8 servo"), 2, "two motors"),
        (("import", "no-such-file.csv"), 2, "no-such-file.csv"),
        (("apply", "SM 4.2-8 servo", "--device", "pmc", "--can", "socketcan:can9"), 2, "node number"),
    ],
)
def test_what_makes_no_sense_is_refused_with_its_exit_code(
    motors: Motors, words: tuple[str, ...], code: int, told: str
) -> None:
    found, _out, err = motors.run(*words)
    assert (found, told in err) == (code, True), err


def test_files_are_taken_whole_or_not_at_all(motors: Motors, tmp_path: Path) -> None:
    motors.json(*NEW)
    file = tmp_path / "motors.csv"
    assert motors.run("export", "--file", str(file))[0] == 0
    assert motors.run("export")[1] == file.read_bytes().decode(), "the same on stdout"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("400.0", "380.0"), encoding="utf-8")
    assert motors.json("import", str(file)) == {"added": 0, "changed": 1, "unchanged": 0}
    file.write_text("maker,type,6073\nA,one,100\nA,two,300\n", encoding="utf-8")
    code, _out, err = motors.run("import", str(file))
    assert code == 2 and "motors.csv, line 3, column 6073" in err and "No motor was taken" in err
    assert [one["version"] for one in motors.json("list") if not one["invented"]] == [2]


def test_two_motors_are_compared(motors: Motors) -> None:
    motors.json(*NEW)
    code, out, _err = motors.run("compare", "PM 5.5-2", "AC 5.5-2 cage rotor")
    assert code == 0
    assert out.splitlines()[-1].startswith("0 different, 3 the same, ")
    told = motors.json("compare", "AC 5.5-2 cage rotor", "AC 7.5-4 cage rotor")
    assert told["values"]["6076"] == {"state": "different", "left": 11_300, "right": 15_200}


def test_a_motor_is_read_from_a_device_compared_with_it_and_put_into_another(
    motors: Motors, served: Served, tmp_path: Path
) -> None:
    site = ("--site", str(site_for(served.address, tmp_path)), "--listen-s", "0.2")
    read = motors.json("add", "Lorentz", "PM", "--device", PMC, *site)
    assert (read["source"], read["origin"], read["values"]["6073"]) == ("device", PMC, 2000)
    same = motors.json("compare", "--device", PMC, *site)
    assert (same["different"], same["missing"], same["right"]) == (0, 0, PMC), "with the motor that it was read as"
    motors.json("edit", "PM", "--set", "6073=150")
    differs = motors.json("compare", "PM", "--device", PMC, *site)
    assert differs["different"] == 1
    assert differs["values"]["6073"] == {"state": "different", "left": 1500, "right": 2000}
    code, out, err = motors.run("apply", "PM", "--device", PMC, *site, "--yes", "--reason", "new motor")
    assert code == 0, out + err
    assert motors.json("compare", "--device", PMC, *site)["different"] == 0
    stored = served.turbine.devices[11].memory.memory.saved
    assert 1500 in [int.from_bytes(data, "little") for at, data in stored.items() if at.short == "6073"]
