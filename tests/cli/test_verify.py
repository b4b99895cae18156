"""``hubside verify``: what it says of whole, changed, unsealed and foreign files, and its exit codes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from app.cli import main
from app.service.records.files import html_file, pdf_file, seal_record
from app.service.records.signing import FILE, SigningKey
from tests.service.records.sample import record


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data folder, asked in English."""
    monkeypatch.setenv("HUBSIDE_LANGUAGE", "en")
    monkeypatch.setenv("HUBSIDE_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


def written(folder: Path, owner: Path) -> list[Path]:
    """The three files of a record, sealed by the key of ``owner``."""
    key = SigningKey.of(owner)
    sealed = seal_record(record(), key)
    folder.mkdir(exist_ok=True)
    contents = {
        "r.json": sealed.json.encode(),
        "r.html": html_file(sealed, "en", key),
        "r.pdf": pdf_file(sealed, "de", key),
    }
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in contents]


def verify(*arguments: object) -> int:
    return main(["verify", *map(str, arguments)])


def test_our_own_records_are_whole(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = written(tmp_path / "files", data)
    assert verify(*files) == 0
    said = capsys.readouterr().out
    for piece in ("r.json: whole", "r.html: whole", "r.pdf: whole", "this installation", "wtg-07/blade-2, by anna"):
        assert piece in said
    assert "2026-11-22T10:00:31.500Z" in said
    assert "New: every value that was to be restored" in said
    assert "digital twins" in said
    assert said.count("made again, it is the same") == 2


def test_a_machine_gets_one_line_a_file(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = written(tmp_path / "files", data)
    assert verify(*files, "--json") == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["verdict"] for one in told] == ["good"] * 3
    assert [one["form"] for one in told] == ["record", "html", "pdf"]
    assert told[2]["record"]["outcome"] == "new"
    assert told[2]["fingerprint"] == SigningKey.of(data).public.fingerprint


@pytest.mark.parametrize("name", ["r.json", "r.html", "r.pdf"])
def test_a_changed_file_is_not_verified(
    name: str, data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = written(tmp_path / "files", data)
    path = next(one for one in files if one.name == name)
    content = path.read_bytes()
    middle = len(content) // 2
    path.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
    assert verify(*files) == 6
    said = capsys.readouterr().out
    assert said.count(": whole") == 2
    assert f"{name}: CHANGED" in said or f"{name}: DAMAGED" in said


def test_a_file_without_a_seal_is_not_verified(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "r.json").write_text(seal_record(record(), SigningKey.of(data)).text, encoding="utf-8")
    assert verify(tmp_path / "r.json") == 6
    assert "NOT SEALED" in capsys.readouterr().out


def test_a_stranger_is_known_once_his_key_is(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    theirs = tmp_path / "theirs"
    files = written(tmp_path / "files", theirs)
    assert verify(*files) == 6
    assert capsys.readouterr().out.count("UNKNOWN KEY") == 3
    key = SigningKey.of(theirs).public
    (tmp_path / "known").mkdir()
    (tmp_path / "known" / "berta.pub").write_text(key.text + "\n")
    (tmp_path / "known" / "note.txt").write_bytes(b"\xff no key")
    assert verify(*files, "--key", tmp_path / "known" / "berta.pub") == 0
    assert verify(*files, "--known", tmp_path / "known") == 0
    assert capsys.readouterr().out.count("– berta.pub") == 6
    for text in (key.fingerprint, key.fingerprint.replace(" ", ""), key.fingerprint.replace(" ", ":").upper()):
        assert verify(*files, "--key", text) == 0
    assert verify(*files, "--key", "0" * 32) == 6
    assert not (data / FILE).exists(), "looking makes no key"


def test_what_is_no_record_is_told_apart(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.txt").write_text("hello")
    assert verify(tmp_path / "a.txt") == 2
    assert "no record" in capsys.readouterr().out
    assert verify(tmp_path / "missing.pdf") == 2
    assert "missing.pdf" in capsys.readouterr().err
    changed = tmp_path / "b.json"
    changed.write_bytes(written(tmp_path / "files", data)[0].read_bytes()[:-3])
    assert verify(tmp_path / "a.txt", changed) == 6, "a changed record weighs more"


def test_our_key_is_printed_to_hand_out(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert verify("--public-key") == 0
    told = capsys.readouterr()
    assert told.out == SigningKey.of(data).public.text + "\n"
    assert SigningKey.of(data).public.fingerprint in told.err
    (tmp_path / "key.pub").write_text(told.out)
    assert verify("--public-key", "--json") == 0
    assert json.loads(capsys.readouterr().out)["key"] == told.out.strip()


@pytest.mark.parametrize(
    "wrong",
    [[], ["--public-key", "x.pdf"], ["x.pdf", "--key", "nonsense"], ["x.pdf", "--known", "nonsense"]],
    ids=["no file", "both", "no such key", "no such folder"],
)
def test_wrong_use_is_told(wrong: list[str], data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert verify(*wrong) == 2
    assert capsys.readouterr().err.startswith("hubside: ")


def test_keys_that_are_none_are_told(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.pub").write_text("ssh-ed25519 AAAA")
    assert verify("x.pdf", "--key", tmp_path / "x.pub") == 2
    assert verify("x.pdf", "--known", tmp_path) == 2
    assert capsys.readouterr().err.count("holds no key") == 2


def test_a_terminal_obeys_nothing_of_a_record(data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    key = SigningKey.of(tmp_path / "theirs")
    nasty = replace(record(), person="\x1b]0;owned\x07\x1b[2J", station="a\nr.json: whole")
    (tmp_path / "r.json").write_text(seal_record(nasty, key).json, encoding="utf-8")
    assert verify(tmp_path / "r.json") == 6
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert "\nr.json: whole" not in said
