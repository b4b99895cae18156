"""``hubside save``, ``backup``, ``sets diff``, ``restore`` with the site file of a device that saves by categories."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli.main import main
from app.model.sets import load_set
from tests.service.pd4e.conftest import SERVO, served_twin, site_of


def test_a_set_goes_back_and_is_saved_by_categories(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    monkeypatch.setenv("HUBSIDE_PERSON", "Anna")
    with served_twin() as served:
        site = tmp_path / "bench.toml"
        site.write_text(site_of(served.address), encoding="utf-8")

        def run(*words: str) -> tuple[int, str]:
            code = main(["--data", str(tmp_path / "data"), *words])
            return code, capsys.readouterr().out

        on_site = ("--site", str(site))
        code, out = run("backup", *on_site, SERVO, "--json")
        assert code == 0
        file = json.loads(out)["file"]
        assert load_set(Path(file).read_text(), "set").identity.drive_serial == "TWIN-0001"

        for address, value in (("2031", "raw:1500"), ("6073", "raw:1200")):
            assert run("write", *on_site, SERVO, address, value)[0] == 0
        code, out = run("save", *on_site, SERVO, "--category", "tuning", "--json")
        assert (code, json.loads(out)["category"], json.loads(out)["proven"]) == (0, "tuning", False)
        assert served.stored("2031") is not None and served.stored("6073") is None
        assert run("save", *on_site, SERVO, "--category", "blades")[0] == 3

        code, out = run("sets", "diff", *on_site, file, f"live:{SERVO}", "--json")
        assert code in (0, 1) and '"2031"' in out and '"6073"' in out
        code, out = run("restore", *on_site, "--plan", file)
        assert "Tuning" in out and "Drive" in out
        code, out = run("restore", *on_site, "--yes", "--restart", file)
        assert code == 0, out
        assert (served.holds("2031"), served.holds("6073")) == (2100, 1000)
        assert served.stored("6073") is not None
