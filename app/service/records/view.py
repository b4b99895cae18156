"""What a person sees of a record: titles, facts and tables in one language, the same for HTML and PDF. Pure."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from app.model.restore.plan import StepKind, Treatment
from app.model.rules.rule import Detail, Verdict
from app.model.texts import Texts
from app.service.records.restore_record import (
    CheckRecord,
    DeviceRecord,
    FindingRecord,
    Outcome,
    RestoreRecord,
    RowRecord,
    SetReference,
    Value,
)
from app.service.records.signing import PublicKey

DASH: Final = "–"
YES: Final = "✓"
SHORT_HASH: Final = 16
_UNSEEN: Final = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}
_IDENTITY: Final = (
    "device_name",
    "hardware",
    "software",
    "vendor_id",
    "product_code",
    "revision",
    "serial",
    "drive_serial",
)
_HEXADECIMAL: Final = {"vendor_id", "product_code", "revision"}


@dataclass(frozen=True, slots=True)
class Table:
    """A table. ``widths`` are relative; the first column heads its row where ``row_heads``."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    widths: tuple[int, ...]
    row_heads: bool = False


@dataclass(frozen=True, slots=True)
class View:
    """A whole record, ready to be set. ``badge`` is empty where the devices are real."""

    language: str
    title: str
    station: str
    badge: str
    outcome: Outcome
    verdict: str
    facts: tuple[tuple[str, str], ...]
    tables: tuple[Table, ...]
    foot: tuple[str, ...]


def view_of(record: RestoreRecord, texts: Texts, language: str, key: PublicKey) -> View:
    """The record as it is to be seen, sealed with ``key``."""
    written = [row for row in record.rows if row.treatment is Treatment.WRITE]
    tables = (
        _devices(record, texts),
        *(_written(texts, slug, rows) for slug, rows in _by_device(written)),
        _findings(record.findings, texts),
        _checks(record.checks, texts),
        _events(record, texts),
        _steps(record, texts),
        *(_skipped(texts, slug, rows) for slug, rows in _by_device(_treated(record, Treatment.SKIP))),
        *(_equal(texts, slug, rows) for slug, rows in _by_device(_treated(record, Treatment.EQUAL))),
    )
    return View(
        language=language,
        title=texts("record.title"),
        station=visible(record.station),
        badge=texts("record.twins") if record.simulated else "",
        outcome=record.outcome,
        verdict=texts(record.outcome.text_key),
        facts=tuple((texts(f"record.fact.{name}"), visible(text)) for name, text in _facts(record)),
        tables=tuple(table for table in tables if table.rows),
        foot=(
            texts("record.sealed", fingerprint=key.fingerprint),
            texts("record.how_to_verify"),
            key.text,
        ),
    )


def visible(text: str) -> str:
    """The text with what cannot be seen, or would reorder it, written as its code point. Line ends stay."""
    text = text.replace("\r\n", "\n")
    return "".join(
        f"‹U+{ord(char):04X}›" if unicodedata.category(char) in _UNSEEN and char != "\n" else char for char in text
    )


def _facts(record: RestoreRecord) -> Iterable[tuple[str, str]]:
    yield "person", record.person
    yield "reason", record.reason or DASH
    yield "work_order", record.work_order or DASH
    yield "started", _time(record.started)
    confirmed = DASH if record.confirmed is None else f"{_time(record.confirmed)}, {record.confirmed_by}"
    yield "confirmed", confirmed
    yield "ended", _time(record.ended)
    if record.note:
        yield "note", record.note
    yield "id", record.id
    yield "plan", record.plan_hash
    yield "tool", record.tool


def _devices(record: RestoreRecord, texts: Texts) -> Table:
    columns = [dict(_device(device, texts)) for device in record.devices]
    names = list(dict.fromkeys(name for column in columns for name in column))
    rows = tuple(
        (texts(f"record.device.{name}"), *(visible(column.get(name, DASH)) for column in columns)) for name in names
    )
    head = ("", *(visible(device.slug) for device in record.devices))
    return Table(texts("record.devices"), head, rows, (3, *(4 for _ in columns)), row_heads=True)


def _device(device: DeviceRecord, texts: Texts) -> Iterable[tuple[str, str]]:
    yield "description", f"{device.description_id} {device.description_version}"
    yield "node", str(device.node)
    for name in _IDENTITY:
        said = device.identity.get(name)
        if said is not None:
            yield name, f"{said:08X}h" if name in _HEXADECIMAL and isinstance(said, int) else str(said)
    yield "nameplate", device.nameplate or DASH
    unit = {True: "record.unit.same", False: "record.unit.other", None: "record.unit.unknown"}[device.same_unit]
    yield "unit", texts(unit)
    yield "before", _set(device.before)
    yield "restored", _set(device.restored)
    yield "origin", _origin(device.restored)
    yield "after", _set(device.after)
    yield "undo", _set(device.undo)
    if device.needs:
        yield "needs", ", ".join(texts(f"restore.need.{need.value}") for need in device.needs)
    yield "restarted", YES if device.restarted else DASH


def _set(reference: SetReference | None) -> str:
    return DASH if reference is None else f"sha256 {reference.hash[:SHORT_HASH]}…"


def _origin(reference: SetReference | None) -> str:
    if reference is None:
        return DASH
    parts = (reference.device, _time(reference.time), reference.person, reference.reason, reference.work_order)
    return ", ".join(part for part in parts if part) or DASH


def _treated(record: RestoreRecord, treatment: Treatment) -> list[RowRecord]:
    return [row for row in record.rows if row.treatment is treatment]


def _by_device(rows: Iterable[RowRecord]) -> Iterable[tuple[str, list[RowRecord]]]:
    grouped: dict[str, list[RowRecord]] = {}
    for row in rows:
        grouped.setdefault(row.device, []).append(row)
    return grouped.items()


def _written(texts: Texts, slug: str, rows: Sequence[RowRecord]) -> Table:
    names = ("address", "name", "was", "wanted", "now", "unit", "verified", "saved", "proven")
    lines = tuple(
        (
            *_named(row, texts),
            *(_shown(value) for value in (row.was, row.wanted, row.now)),
            visible(row.unit),
            *(YES if done else DASH for done in (row.verified, row.saved, row.proven)),
        )
        for row in rows
    )
    title = texts("record.written", device=visible(slug), count=len(rows))
    return Table(title, _head(names, texts), lines, (5, 11, 5, 5, 5, 4, 8, 7, 8))


def _skipped(texts: Texts, slug: str, rows: Sequence[RowRecord]) -> Table:
    lines = tuple(
        (
            *_named(row, texts),
            _shown(row.wanted),
            _shown(row.now or row.was),
            visible(row.unit),
            _words(texts, f"restore.why.{row.why.value}", row.details) if row.why else DASH,
        )
        for row in rows
    )
    title = texts("record.skipped", device=visible(slug), count=len(rows))
    return Table(title, _head(("address", "name", "wanted", "now", "unit", "why"), texts), lines, (4, 11, 5, 5, 4, 14))


def _equal(texts: Texts, slug: str, rows: Sequence[RowRecord]) -> Table:
    lines = tuple((*_named(row, texts), _shown(row.now or row.was), visible(row.unit)) for row in rows)
    title = texts("record.equal", device=visible(slug), count=len(rows))
    return Table(title, _head(("address", "name", "now", "unit"), texts), lines, (4, 20, 12, 4))


def _checks(checks: Iterable[CheckRecord], texts: Texts) -> Table:
    lines = tuple(
        (_words(texts, one.text_key, one.details), YES if one.passed else DASH, visible(one.confirmed_by) or DASH)
        for one in checks
    )
    return Table(texts("record.checks"), _head(("check", "passed", "confirmed_by"), texts), lines, (14, 3, 5))


def _findings(findings: Iterable[FindingRecord], texts: Texts) -> Table:
    lines = tuple(
        (
            texts(f"record.severity.{one.severity.value}"),
            visible(one.rule_id),
            _words(texts, _finding_key(one), one.details),
            visible("\n".join(f"{place.device} {place.address}" for place in one.places)) or DASH,
        )
        for one in findings
    )
    return Table(texts("record.findings"), _head(("severity", "rule", "text", "places"), texts), lines, (3, 5, 12, 7))


def _finding_key(finding: FindingRecord) -> str:
    return "rule.not_checked" if finding.verdict is Verdict.NOT_CHECKED else f"rule.{finding.rule_id}.broken"


def _events(record: RestoreRecord, texts: Texts) -> Table:
    lines = tuple(
        (_time(one.time), visible(one.person) or DASH, _words(texts, one.text_key, one.details))
        for one in record.events
    )
    return Table(texts("record.events"), _head(("time", "person", "text"), texts), lines, (6, 4, 14))


def _steps(record: RestoreRecord, texts: Texts) -> Table:
    lines = tuple(
        (
            str(number),
            _time(step.time),
            texts(f"record.step.{step.kind.value}"),
            visible(step.device),
            _object(step.kind, step.address, step.value),
            texts(step.outcome.text_key) + (f": {visible(step.note)}" if step.note else ""),
        )
        for number, step in enumerate(record.steps, 1)
    )
    head = _head(("number", "time", "step", "device", "value", "result"), texts)
    return Table(texts("record.steps"), head, lines, (2, 10, 6, 8, 7, 9))


def _object(kind: StepKind, address: str, value: Value | None) -> str:
    if kind not in (StepKind.WRITE, StepKind.AUXILIARY):
        return DASH
    return f"{visible(address)} := {_shown(value)}"


def _words(texts: Texts, key: str, details: Mapping[str, Detail]) -> str:
    """The text of a key that stands in the record; the key itself where the catalogue has no such text."""
    return visible(texts(key, **details) if key in texts.flat else key)


def _named(row: RowRecord, texts: Texts) -> tuple[str, str]:
    return visible(row.address), visible(texts.name(row.name))


def _shown(value: Value | None) -> str:
    return DASH if value is None else visible(value.shown)


def _head(names: Iterable[str], texts: Texts) -> tuple[str, ...]:
    return tuple(texts(f"record.column.{name}") for name in names)


def _time(text: str) -> str:
    """``2026-11-22T10:00:00.123Z`` as people read it; any other text as it is."""
    return visible(text.replace("T", " ", 1).removesuffix("Z").removesuffix("+00:00") + " UTC") if text else DASH
