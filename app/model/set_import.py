"""A file of any kind that holds a parameter set: which kind it is, and the set in it."""

from __future__ import annotations

from typing import Final

from app.errors import SetFileError
from app.model.set_csv import load_csv
from app.model.set_dcf import load_dcf
from app.model.set_head import Imported, Taking
from app.model.sets import load_set

LARGEST: Final = 8 * 1024 * 1024
"""Bytes; the DCF of the largest device has about 0.3 million."""


def read_set_file(data: bytes, file: str, taking: Taking) -> Imported:
    """Read a JSON set, a DCF or a CSV, by how it begins; where that says nothing, by how its name ends.

    Raises SetFileError; then nothing is taken.
    """
    if len(data) > LARGEST:
        raise SetFileError(file=file, line=1, reason=f"is larger than {LARGEST >> 20} MiB")
    start = data[:4096].removeprefix(b"\xef\xbb\xbf").lstrip()
    if not start:
        raise SetFileError(file=file, line=1, reason="it is empty")
    if start.startswith((b"[", b";")) and not file.lower().endswith((".json", ".csv")):
        return load_dcf(data, file, taking)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise SetFileError(file=file, line=line, reason="bytes that are no UTF-8") from error
    if start.startswith((b"{", b"[")) or file.lower().endswith(".json"):
        return Imported(load_set(text, file))
    return load_csv(text, file, taking)
