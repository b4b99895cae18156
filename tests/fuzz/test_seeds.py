"""Every file that once did harm, and what no file of bearable size can hold."""

from __future__ import annotations

import zlib
from pathlib import Path

import pytest

from app.recording.content import MAX_ATTACHMENT_BYTES, AttachedFile, from_stored, to_stored
from tests.fuzz.targets import Name, target
from tests.fuzz.worker import fault_of

SEEDS = sorted((Path(__file__).parent / "seeds").iterdir())


@pytest.mark.parametrize("seed", SEEDS, ids=lambda seed: seed.name)
def test_a_file_that_once_did_harm(seed: Path, tmp_path: Path) -> None:
    """The name of a seed begins with its format."""
    chosen = target(Name(seed.name.split("-")[0]))
    assert fault_of(chosen, seed.read_bytes(), tmp_path) is None


def test_there_are_seeds() -> None:
    assert len(SEEDS) >= 2


def packed(size: int) -> bytes:
    packer = zlib.compressobj(1, zlib.DEFLATED, 31)
    return b"".join([packer.compress(bytes(size)), packer.flush()])


def test_an_attachment_that_unpacks_to_too_much_is_damaged() -> None:
    largest = AttachedFile("a.bin", "x/y", bytes(MAX_ATTACHMENT_BYTES))
    assert from_stored(to_stored(largest)) == largest
    for size in (MAX_ATTACHMENT_BYTES + 1, MAX_ATTACHMENT_BYTES * 4):
        with pytest.raises(ValueError, match="larger"):
            from_stored(AttachedFile("a.bin.gz", "application/gzip; content=x/y", packed(size)))
    with pytest.raises(ValueError, match="end"):
        from_stored(AttachedFile("a.bin.gz", "application/gzip; content=x/y", packed(1000)[:-9]))
