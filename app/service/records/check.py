"""Is a file of a record whole, and by which key? Looks at nothing but its bytes and the keys that are known here."""

from __future__ import annotations

import base64
import binascii
import re
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from app.service.records.files import (
    HTML_RECORD,
    HTML_SEAL,
    PDF_SEAL,
    SIGNED,
    SealedRecord,
    html_body,
    pdf_body,
    renderer_id,
)
from app.service.records.plain_json import RecordShapeError, canonical, parsed
from app.service.records.restore_record import RestoreRecord
from app.service.records.signing import SEAL, Form, PublicKey, Seal, parse_seal

MAX_BYTES: Final = 64 * 1024 * 1024
"""No record is nearly as large; what is unpacked of a PDF ends here too."""
_PEEK: Final = 1024
_STREAM: Final = re.compile(rb"stream\r?\n")
Keys = Mapping[PublicKey, str]
"""The keys that are known, each with the name of its owner."""


class Verdict(Enum):
    """What a check comes to; the value is the end of its text key ``record.verdict.…``."""

    GOOD = "good"
    """Whole, and sealed by a key that is known."""
    CHANGED = "changed"
    """Bytes differ from those that were sealed, or what is seen was not made of the record."""
    UNSIGNED = "unsigned"
    """A record without a seal."""
    UNKNOWN_KEY = "unknown-key"
    """Whole, but anybody could have sealed it."""
    DAMAGED = "damaged"
    """A seal, but what it belongs to cannot be read."""
    NO_RECORD = "no-record"
    """Another kind of file."""

    @property
    def text_key(self) -> str:
        """Text key of its words."""
        return f"record.verdict.{self.value}"


class Remade(Enum):
    """Whether the visible part was made again from the record and compared; the value is as above."""

    EQUAL = "equal"
    OTHER_VERSION = "other-version"
    """Another version of the program made it: its bytes are sealed, but cannot be made again here."""
    NOTHING = "nothing"
    """There is no visible part, or no reason to look at it."""

    @property
    def text_key(self) -> str:
        """Text key of its words."""
        return f"record.remade.{self.value}"


@dataclass(frozen=True, slots=True)
class Checked:
    """What is known of a file. ``record`` is there from UNKNOWN_KEY on; ``reason`` is in English, for DAMAGED."""

    verdict: Verdict
    form: Form | None = None
    key: PublicKey | None = None
    owner: str = ""
    record: RestoreRecord | None = None
    remade: Remade = Remade.NOTHING
    reason: str = ""


class _CheckError(Exception):
    """Ends the check. Carries what it came to."""

    def __init__(self, checked: Checked) -> None:
        super().__init__(checked.verdict.value)
        self.checked = checked


def check_file(data: bytes, known: Keys) -> Checked:
    """Check the bytes of a file, whatever it is."""
    if len(data) > MAX_BYTES:
        return Checked(Verdict.NO_RECORD)
    try:
        if data.startswith(b"%PDF-"):
            return _check_shown(data, Form.PDF, known)
        if data.lstrip()[:1] == b"<":
            return _check_shown(data, Form.HTML, known)
        return _check_json(data, known)
    except _CheckError as fault:
        return fault.checked


def _check_json(data: bytes, known: Keys) -> Checked:
    sealed = _signed(data, Form.RECORD)
    seal = _record_seal(sealed, Form.RECORD)
    return _judged(sealed, seal, Form.RECORD, known, Remade.NOTHING)


def _check_shown(data: bytes, form: Form, known: Keys) -> Checked:
    body, seal = _split(data, form)
    if seal.form is not form or not seal.covers(body):
        raise _CheckError(Checked(Verdict.CHANGED, form, seal.key))
    find: Callable[[bytes], bytes] = _in_html if form is Form.HTML else _in_pdf
    sealed = _signed(find(body), form)
    inner = _record_seal(sealed, form)
    if inner.key != seal.key:
        raise _CheckError(Checked(Verdict.CHANGED, form, seal.key))
    # What a stranger made is not worth a look: it would only tell that he used our templates.
    remade = _remade(sealed, seal, body) if seal.key in known else Remade.NOTHING
    return _judged(sealed, seal, form, known, remade)


def _split(data: bytes, form: Form) -> tuple[bytes, Seal]:
    """The bytes before the seal that ends a file, and the seal."""
    begin, end = (part.encode("ascii") for part in (HTML_SEAL if form is Form.HTML else PDF_SEAL))
    at = data.rfind(begin + SEAL.encode("ascii"))
    if at < 0:
        ours = b"hubside-record " in data if form is Form.HTML else any(_attached(data))
        raise _CheckError(Checked(Verdict.UNSIGNED if ours else Verdict.NO_RECORD, form))
    line = data[at + len(begin) :]
    seal = parse_seal(line.removesuffix(end).decode("ascii", "replace")) if line.endswith(end) else None
    if seal is None:
        raise _CheckError(Checked(Verdict.CHANGED, form))
    return data[:at], seal


def _signed(data: bytes, form: Form) -> SealedRecord:
    """The record and its seal from the bytes of a JSON file, which must be canonical."""
    try:
        text = data.decode()
        content = parsed(text)
    except (UnicodeDecodeError, RecordShapeError) as error:
        ours = SIGNED.encode("ascii") in data
        checked = Checked(Verdict.DAMAGED, form, reason=str(error)) if ours else Checked(Verdict.NO_RECORD)
        raise _CheckError(checked) from error
    if not isinstance(content, dict) or not str(content.get("format", "")).startswith("hubside-"):
        raise _CheckError(Checked(Verdict.NO_RECORD, form))
    if content["format"] != SIGNED:
        raise _CheckError(_of_other_format(content, form))
    if not _is_signed_shape(content):
        raise _CheckError(Checked(Verdict.DAMAGED, form, reason="a part is missing or of another shape"))
    sealed = SealedRecord(content["record"], content["seal"])
    if sealed.json != text:
        raise _CheckError(Checked(Verdict.CHANGED, form))
    return sealed


def _of_other_format(content: Any, form: Form) -> Checked:
    name = str(content["format"])
    if name.startswith("hubside-restore-record/"):
        return Checked(Verdict.UNSIGNED, form)
    if name.startswith(SIGNED.partition("/")[0]):
        return Checked(Verdict.DAMAGED, form, reason=f"its format is {name}, this version reads {SIGNED}")
    return Checked(Verdict.NO_RECORD, form)


def _is_signed_shape(content: Mapping[str, Any]) -> bool:
    return set(content) == {"format", "record", "seal"} and all(isinstance(one, str) for one in content.values())


def _record_seal(sealed: SealedRecord, form: Form) -> Seal:
    """The seal over the record itself."""
    if not sealed.seal:
        raise _CheckError(Checked(Verdict.UNSIGNED, form))
    seal = parse_seal(sealed.seal)
    if seal is None:
        raise _CheckError(Checked(Verdict.DAMAGED, form, reason="its seal cannot be read"))
    if seal.form is not Form.RECORD or not seal.covers(sealed.text.encode("utf-8", "surrogatepass")):
        raise _CheckError(Checked(Verdict.CHANGED, form, seal.key))
    return seal


def _judged(sealed: SealedRecord, seal: Seal, form: Form, known: Keys, remade: Remade) -> Checked:
    try:
        record = sealed.record
    except RecordShapeError as error:
        raise _CheckError(Checked(Verdict.DAMAGED, form, seal.key, reason=str(error))) from error
    owner = known.get(seal.key, "")
    verdict = Verdict.GOOD if seal.key in known else Verdict.UNKNOWN_KEY
    return Checked(verdict, form, seal.key, owner, record, remade)


def _remade(sealed: SealedRecord, seal: Seal, body: bytes) -> Remade:
    """Make the file again and compare. Raises _CheckError where it is another."""
    if seal.renderer != renderer_id():
        return Remade.OTHER_VERSION
    make = html_body if seal.form is Form.HTML else pdf_body
    try:
        again = make(sealed, seal.language, seal.key)
    except RecordShapeError as error:
        raise _CheckError(Checked(Verdict.DAMAGED, seal.form, seal.key, reason=str(error))) from error
    if again != body:
        raise _CheckError(Checked(Verdict.CHANGED, seal.form, seal.key))
    return Remade.EQUAL


def _in_html(body: bytes) -> bytes:
    begin, end = (part.encode("ascii") for part in HTML_RECORD)
    at = body.rfind(begin)
    try:
        if at < 0 or not body.endswith(end):
            raise ValueError("it holds no record")
        return base64.b64decode(body[at + len(begin) : -len(end)], validate=True)
    except (ValueError, binascii.Error) as error:
        raise _CheckError(Checked(Verdict.DAMAGED, Form.HTML, reason=str(error))) from error


def _in_pdf(body: bytes) -> bytes:
    for found in _attached(body):
        return found
    raise _CheckError(Checked(Verdict.DAMAGED, Form.PDF, reason="it holds no record"))


def _attached(body: bytes) -> Iterator[bytes]:
    """Packed streams of a PDF that hold a record."""
    start = canonical({"format": SIGNED}).removesuffix("}").encode()
    for match in _STREAM.finditer(body):
        try:
            first = body[match.end() : match.end() + _PEEK]
            if zlib.decompressobj().decompress(first, len(start)) == start:
                yield zlib.decompressobj().decompress(body[match.end() :], MAX_BYTES)
        except zlib.error:
            continue
