"""The key of an installation: made once, for its owner's eyes only, never written over; and its seals."""

from __future__ import annotations

import os
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from app.errors import SigningKeyError
from app.service.records.signing import (
    FILE,
    Form,
    PublicKey,
    SigningKey,
    parse_public_key,
    parse_seal,
    public_key_of,
)


def test_the_key_is_made_once_and_stays(tmp_path: Path) -> None:
    assert public_key_of(tmp_path) is None, "looking makes none"
    first = SigningKey.of(tmp_path / "data")
    kept = (tmp_path / "data" / FILE).read_bytes()
    assert SigningKey.of(tmp_path / "data").public == first.public == public_key_of(tmp_path / "data")
    assert (tmp_path / "data" / FILE).read_bytes() == kept
    assert [path.name for path in (tmp_path / "data").iterdir()] == [FILE], "no draft is left"


@pytest.mark.skipif(os.name == "nt", reason="no such modes there")
def test_nobody_else_may_read_it(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        SigningKey.of(tmp_path)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / FILE).stat().st_mode) == 0o600


def test_many_at_once_get_the_same_key(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        keys = {key.public for key in pool.map(lambda _: SigningKey.of(tmp_path), range(32))}
    assert len(keys) == 1


def _of_another_kind() -> bytes:
    return ec.generate_private_key(ec.SECP256R1()).private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


@pytest.mark.parametrize("content", [b"", b"garbage", _of_another_kind()], ids=["empty", "garbage", "another kind"])
def test_a_key_that_cannot_be_used_is_told_and_kept(content: bytes, tmp_path: Path) -> None:
    (tmp_path / FILE).write_bytes(content)
    with pytest.raises(SigningKeyError, match=FILE):
        SigningKey.of(tmp_path)
    with pytest.raises(SigningKeyError, match=FILE):
        public_key_of(tmp_path)
    assert (tmp_path / FILE).read_bytes() == content


def test_a_folder_that_takes_nothing_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(SigningKeyError):
        SigningKey.of(tmp_path / "file")


def test_a_public_key_is_handed_out_as_a_line(tmp_path: Path) -> None:
    key = SigningKey.of(tmp_path).public
    assert parse_public_key(f"{key.text}\n") == key
    for wrong in ("", key.text[:-2], key.text.replace("key/1", "key/2"), key.text.replace(" ", "")):
        assert parse_public_key(wrong) is None
    assert PublicKey(bytes(32)).fingerprint == "6668 7aad f862 bd77 6c8f c18b 8e9f 8e20", "SHA-256 of 32 zeros"


def test_a_seal_holds_for_its_bytes_and_for_nothing_else(tmp_path: Path) -> None:
    seal = SigningKey.of(tmp_path / "a").seal(Form.HTML, b"data", "de", "0123456789abcdef")
    again = parse_seal(seal.line)
    assert again == seal
    assert again is not None
    assert again.covers(b"data")
    assert not again.covers(b"Data")


def test_no_digit_of_a_seal_may_change(tmp_path: Path) -> None:
    line = SigningKey.of(tmp_path).seal(Form.PDF, b"data", "en", "0123456789abcdef").line
    for at, digit in enumerate(line):
        for other in "0aAbZ+ =\n":
            if other != digit:
                changed = parse_seal(line[:at] + other + line[at + 1 :])
                assert changed is None or not changed.covers(b"data"), (at, digit, other)


def test_a_seal_of_one_form_is_none_of_another(tmp_path: Path) -> None:
    seal = SigningKey.of(tmp_path).seal(Form.RECORD, b"data")
    moved = parse_seal(seal.line.replace(" record ", " html "))
    assert moved is not None
    assert not moved.covers(b"data")
