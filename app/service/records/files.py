"""The files of a record: JSON, HTML and PDF. Each holds the sealed record, and is sealed itself as the file that it is.

The record is sealed once, when the restore ends: that seal covers its canonical JSON. A file made of it, then or later,
carries the record with that seal, and ends with a second seal, which covers every byte before it. So a changed byte is
found wherever it stands, in what a machine reads as in what a person sees.
"""

from __future__ import annotations

import base64
import hashlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from app.model.texts import load_texts
from app.service.records.html import render_html
from app.service.records.pdf import render_pdf
from app.service.records.plain_json import canonical
from app.service.records.restore_record import RestoreRecord, dump_record, load_record
from app.service.records.signing import Form, PublicKey, Seal, SigningKey
from app.service.records.view import view_of

SIGNED: Final = "hubside-signed-record/1"
HTML_RECORD: Final = ("<!-- hubside-record ", " -->\n")
HTML_SEAL: Final = ("<!-- ", " -->\n")
PDF_SEAL: Final = ("\n%", "\n")
_RENDERER: Final = ("view.py", "html.py", "pdf.py", "record.typ")


@dataclass(frozen=True, slots=True)
class SealedRecord:
    """What is kept of a restore: the canonical JSON of its record, and the line of the seal over it."""

    text: str
    seal: str

    @property
    def record(self) -> RestoreRecord:
        """The record itself. Raises RecordShapeError."""
        return load_record(self.text)

    @property
    def json(self) -> str:
        """The JSON file: record and seal, canonical."""
        return canonical({"format": SIGNED, "record": self.text, "seal": self.seal}) + "\n"


def seal_record(record: RestoreRecord, key: SigningKey) -> SealedRecord:
    """Seal a record, at the end of its restore."""
    text = dump_record(record)
    return SealedRecord(text, key.seal(Form.RECORD, text.encode()).line)


def html_file(sealed: SealedRecord, language: str, key: SigningKey) -> bytes:
    """The HTML file. Raises RecordShapeError."""
    body = html_body(sealed, language, key.public)
    return _closed(body, key.seal(Form.HTML, body, language, renderer_id()), HTML_SEAL)


def pdf_file(sealed: SealedRecord, language: str, key: SigningKey) -> bytes:
    """The PDF file; its seal is a comment behind the end of the document. Raises RecordShapeError."""
    body = pdf_body(sealed, language, key.public)
    return _closed(body, key.seal(Form.PDF, body, language, renderer_id()), PDF_SEAL)


def html_body(sealed: SealedRecord, language: str, key: PublicKey) -> bytes:
    """The HTML file but for its seal. Raises RecordShapeError."""
    page = render_html(view_of(sealed.record, load_texts(language), language, key))
    begin, end = HTML_RECORD
    return f"{page}{begin}{base64.b64encode(sealed.json.encode()).decode('ascii')}{end}".encode()


def pdf_body(sealed: SealedRecord, language: str, key: PublicKey) -> bytes:
    """The PDF file but for its seal. Raises RecordShapeError."""
    return render_pdf(view_of(sealed.record, load_texts(language), language, key), sealed.json)


@cache
def renderer_id() -> str:
    """Names what makes the visible part of a file: templates and texts. The same id makes the same bytes."""
    digest = hashlib.sha256()
    for name in _RENDERER:
        digest.update(Path(__file__).with_name(name).read_bytes())
    for language in ("en", "de"):
        digest.update(canonical(dict(load_texts(language).flat)).encode())
    return digest.hexdigest()[:16]


def _closed(body: bytes, seal: Seal, around: tuple[str, str]) -> bytes:
    begin, end = around
    return body + f"{begin}{seal.line}{end}".encode("ascii")
