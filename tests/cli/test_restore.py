"""``hubside restore``: what makes no sense is said before anything is done."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from app.cli.main import main

WRONG = (
    ((), "usage"),
    (("set.json",), "usage"),
    (("--list", "set.json"), "usage"),
    (("--resume", "--can", "virtual:x", "set.json"), "usage"),
    (("set.json", "--can", "virtual:x", "--confirm-within", "1"), "usage"),
    (("set.json", "--can", "virtual:x", "--other-blades-confirmed"), "usage"),
    (("set.json", "--can", "virtual:x", "--accept", "oat.dc_link_ladder"), "usage"),
)


@pytest.mark.parametrize(("arguments", "code"), WRONG)
def test_arguments_that_do_not_go_together(
    arguments: tuple[str, ...], code: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["restore", *arguments, "--json", "--data", str(tmp_path / "data")]) == 2
    assert json.loads(capsys.readouterr().err.splitlines()[-1])["error"] == code
    assert not (tmp_path / "data").exists(), "nothing was opened"


def test_only_one_way_at_a_time(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["restore", "--resume", "--roll-back", "--can", "virtual:x"])
    assert caught.value.code == 2
    assert "not allowed with" in capsys.readouterr().err


def test_an_empty_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["restore", "--list", "--json", "--data", str(tmp_path / "data")]) == 0
    assert json.loads(capsys.readouterr().out) == []
