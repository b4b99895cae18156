"""The files: everything is in them, nothing in them runs, and whatever is changed is found."""

from __future__ import annotations

import base64
import copy
import json
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from app.model.texts import load_texts
from app.service.records import files
from app.service.records.check import Checked, Remade, Verdict, check_file
from app.service.records.files import HTML_RECORD, SealedRecord, html_file, pdf_file, seal_record
from app.service.records.plain_json import canonical
from app.service.records.restore_record import dump_record
from app.service.records.signing import Form, SigningKey, parse_seal
from tests.service.records.pdf_text import pdf_text
from tests.service.records.sample import REASON, failed, record
from tests.service.records.test_restore_record import parts

FORMS = ("json", "html", "pdf")


@cache
def key(name: str = "ours") -> SigningKey:
    with TemporaryDirectory() as folder:
        return SigningKey.of(Path(folder) / name)


@cache
def made(form: str, language: str = "en", short: bool = False) -> bytes:
    one = replace(record(), rows=record().rows[:3], steps=()) if short else record()
    return written(seal_record(one, key()), form, language)


def written(sealed: SealedRecord, form: str, language: str = "en", by: SigningKey | None = None) -> bytes:
    if form == "json":
        return sealed.json.encode()
    return (html_file if form == "html" else pdf_file)(sealed, language, by or key())


def check(data: bytes) -> Checked:
    return check_file(data, {key().public: "ours"})


class Page(HTMLParser):
    """Elements and text of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.text = ""
        self.loads: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.loads += [name for name, _ in attrs if name in ("src", "href", "srcset", "data") or name.startswith("on")]

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("form", FORMS)
def test_a_file_as_it_was_made_is_good(form: str, language: str) -> None:
    for one in (record(), failed()):
        checked = check(written(seal_record(one, key()), form, language))
        assert checked.verdict is Verdict.GOOD
        assert checked.record == one
        assert checked.owner == "ours"
        assert checked.remade is (Remade.NOTHING if form == "json" else Remade.EQUAL)


@pytest.mark.parametrize("language", ["en", "de"])
def test_the_page_shows_everything_and_runs_nothing(language: str) -> None:
    page = Page(made("html", language).decode())
    assert page.tags <= {
        *("html", "head", "meta", "title", "style", "body", "header", "h1", "p", "main", "section", "h2", "footer"),
        *("table", "colgroup", "col", "thead", "tbody", "tr", "th", "td"),
    }
    assert page.loads == []
    assert "url(" not in page.text
    assert REASON.replace("\u202e", "‹U+202E›").replace("\x07", "‹U+0007›") in page.text
    everything_is_in(page.text, language)


@pytest.mark.parametrize("language", ["en", "de"])
def test_the_pdf_prints_everything_and_obeys_nothing(language: str) -> None:
    text = pdf_text(made("pdf", language)).replace("\u200b", "").replace("\n", "").replace(" ", "")
    for piece in ('`#import"x"`*fett*<script>alert(1)</script>$x^2$\\u{41}//', "-->&é‹U+4E2D›‹U+202E›‹U+0007›"):
        assert piece in text
    everything_is_in(text, language, lambda piece: piece.replace(" ", ""))


def everything_is_in(text: str, language: str, squeezed: Any = str) -> None:
    texts = load_texts(language)
    one = record()
    wanted = [one.id, one.person, one.work_order, "berta", one.plan_hash, one.tool, "SN 12/345", "chef", "no.{such"]
    wanted += [texts(one.outcome.text_key), texts("record.twins"), key().public.fingerprint, key().public.text]
    wanted += [row.address for row in one.rows] + [texts.name(row.name) for row in one.rows]
    wanted += [
        "2026-11-22 10:00:30.000 UTC",
        "cut",
        "WO-1",
        "0202020202020202",
        texts("rule.not_checked", missing="6079"),
    ]
    missing = [piece for piece in wanted if squeezed(piece) not in text]
    assert missing == []


def test_the_same_record_gives_the_same_bytes() -> None:
    sealed = seal_record(record(), key())
    assert html_file(sealed, "de", key()) == made("html", "de")
    assert pdf_file(sealed, "de", key()) == made("pdf", "de")


@pytest.mark.parametrize("form", FORMS)
def test_no_byte_may_change(form: str) -> None:
    """Every byte of the seals and of the seams, every 13th elsewhere; changed, taken out and put in."""
    data = made(form, short=True)
    places = {*range(0, len(data), 13), *range(40), *range(len(data) - 700, len(data))}
    for at in sorted(places):
        for changed in (
            data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :],
            data[:at] + data[at + 1 :],
            data[:at] + b" " + data[at:],
        ):
            if changed != data:
                assert check(changed).verdict is not Verdict.GOOD, (at, data[at - 10 : at + 10])
    for more in (b"\n", b" ", b"x", data):
        assert check(data + more).verdict is not Verdict.GOOD


@pytest.mark.parametrize("form", FORMS)
def test_a_file_that_was_cut_off_is_not_good(form: str) -> None:
    data = made(form, short=True)
    for length in range(0, len(data), 97):
        assert check(data[:length]).verdict is not Verdict.GOOD


WHOLE = json.loads(dump_record(record()))


def changed_fields() -> list[str]:
    """The JSON of the record with one part changed, once for each part."""
    changed = []
    for path in parts(WHOLE):
        content = copy.deepcopy(WHOLE)
        parent = content
        for step in path[:-1]:
            parent = parent[step]
        old = parent[path[-1]]
        parent[path[-1]] = {str: f"{old}x", int: 77, bool: old is not True, type(None): "x"}.get(type(old))
        changed.append(canonical(content))
    return changed


def test_no_field_may_change() -> None:
    """A forger who packs everything anew but has no key."""
    sealed = seal_record(record(), key())
    begin, end = (part.encode() for part in HTML_RECORD)
    page = made("html")
    head, tail = page[: page.index(begin)], page[page.index(end, page.index(begin)) + len(end) :]
    texts = changed_fields()
    assert len(texts) > 80
    for text in texts:
        forged = SealedRecord(text, sealed.seal)
        assert check(forged.json.encode()).verdict is Verdict.CHANGED
        packed = begin + base64.b64encode(forged.json.encode()) + end
        assert check(head + packed + tail).verdict is Verdict.CHANGED


@pytest.mark.parametrize("form", ["html", "pdf"])
def test_a_page_that_was_not_made_of_its_record_is_found_whoever_sealed_it(form: str) -> None:
    """Even with our key: the page shows what its record does not say."""
    other = replace(record(), person="somebody else")
    sealed, shown = seal_record(record(), key()), seal_record(other, key())
    make = files.html_body if form == "html" else files.pdf_body
    body = make(sealed, "en", key().public)
    mixed = make(shown, "en", key().public)
    kind = Form.HTML if form == "html" else Form.PDF
    if form == "html":
        begin = HTML_RECORD[0].encode()
        mixed = mixed[: mixed.index(begin)] + body[body.index(begin) :]
    else:
        mixed = body.replace(b"%PDF-1.7", b"%PDF-1.8")
    around = files.HTML_SEAL if form == "html" else files.PDF_SEAL
    forged = files._closed(mixed, key().seal(kind, mixed, "en", files.renderer_id()), around)
    assert check(forged).verdict is Verdict.CHANGED
    older = files._closed(mixed, key().seal(kind, mixed, "en", "0" * 16), around)
    assert (check(older).verdict, check(older).remade) == (Verdict.GOOD, Remade.OTHER_VERSION), "and it says so"


@pytest.mark.parametrize("form", FORMS)
def test_a_stranger_is_told_apart(form: str) -> None:
    data = written(seal_record(record(), key("theirs")), form, "en", key("theirs"))
    checked = check(data)
    assert checked.verdict is Verdict.UNKNOWN_KEY
    assert checked.key == key("theirs").public
    assert checked.record == record()
    assert check_file(data, {key("theirs").public: "berta"}).owner == "berta"


@pytest.mark.parametrize("form", ["html", "pdf"])
def test_a_record_of_one_in_a_file_of_another_is_refused(form: str) -> None:
    ours = seal_record(record(), key())
    mixed = written(ours, form, "en", key("theirs"))
    known = {key().public: "ours", key("theirs").public: "theirs"}
    assert check_file(mixed, known).verdict is Verdict.CHANGED


def test_records_without_a_seal_are_told_as_such() -> None:
    sealed = seal_record(record(), key())
    assert check(sealed.text.encode()).verdict is Verdict.UNSIGNED
    assert check(replace(sealed, seal="").json.encode()).verdict is Verdict.UNSIGNED
    assert check(files.html_body(sealed, "en", key().public)).verdict is Verdict.UNSIGNED
    assert check(files.pdf_body(sealed, "en", key().public)).verdict is Verdict.UNSIGNED


def test_sealed_records_that_cannot_be_read_are_told_as_such() -> None:
    later = canonical({"format": "hubside-restore-record/2", "record": {}})
    seal = key().seal(Form.RECORD, later.encode()).line
    checked = check(SealedRecord(later, seal).json.encode())
    assert checked.verdict is Verdict.DAMAGED
    assert "hubside-restore-record/2" in checked.reason
    assert check(SealedRecord(dump_record(record()), "hubside-seal/2 x").json.encode()).verdict is Verdict.DAMAGED
    newer = made("json").replace(b"hubside-signed-record/1", b"hubside-signed-record/2")
    assert check(newer).verdict is Verdict.DAMAGED
    assert check(made("json")[:-200]).verdict is Verdict.DAMAGED


@pytest.mark.parametrize(
    "data", [b"", b"{}", b"\xff\xfe", b"<html></html>", b"%PDF-1.7\n%%EOF", b'{"format":"hubside-set/1"}']
)
def test_other_files_are_no_records(data: bytes) -> None:
    assert check(data) == Checked(Verdict.NO_RECORD, check(data).form)


def test_the_seal_names_form_language_and_renderer() -> None:
    line = made("pdf", "de").rsplit(b"\n%", 1)[1].decode().strip()
    seal = parse_seal(line)
    assert seal is not None
    assert (seal.form, seal.language, seal.renderer) == (Form.PDF, "de", files.renderer_id())
    assert made("pdf")[: -len(line) - 3].endswith(b"%%EOF"), "a comment behind the document"
