"""A comparison as a file: HTML that is read and printed without anything else, or CSV for a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from html import escape
from itertools import groupby
from typing import Final

from app import __version__
from app.model.datatypes import Raw
from app.model.diff.compare import Row
from app.model.texts import Texts
from app.service.compare.comparison import Compared
from app.service.compare.wording import Words, rows_of

POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'"
_STYLE: Final = """
@page { size: A4 landscape; margin: 12mm; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 8mm; background: #fff; color: #16202b;
  font: 9pt/1.35 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
h1 { font-size: 16pt; margin: 0; } h2 { font-size: 11pt; margin: 5mm 0 1.5mm; break-after: avoid; }
p.sum { border-left: 2mm solid #2a5d9c; padding: 2mm 3mm; font-size: 11pt; font-weight: 700; background: #f3f5f7; }
table { width: 100%; border-collapse: collapse; table-layout: fixed; }
col.name { width: 26%; } col.state { width: 11%; }
th, td { text-align: left; vertical-align: top; padding: .7mm 1.2mm; border-bottom: .2mm solid #c9d1d8;
  overflow-wrap: anywhere; font-variant-numeric: tabular-nums; }
thead th { border-bottom: .4mm solid #16202b; } thead small { display: block; font-weight: 400; }
thead { display: table-header-group; } tr { break-inside: avoid; }
tr.different td.state { color: #b3261e; font-weight: 700; } tr.unit td.state { color: #2a5d9c; }
tr.missing td.state, tr.not-comparable td.state { color: #8a5a00; }
small.seen { display: block; color: #55606b; }
td.absent { color: #55606b; font-style: italic; } tr.bit th { font-weight: 400; padding-left: 6mm; }
p.finding { color: #8a5a00; margin: .5mm 0 0; font-weight: 400; }
footer { margin-top: 6mm; font-size: 8pt; color: #55606b; }
@media print { body { padding: 0; } }
""".strip()


def to_html(compared: Compared, texts: Texts, same: bool = False) -> str:
    """The comparison as one document: nothing is loaded, nothing is run. ``same``: with the rows that match."""
    words = Words(texts)
    rows = rows_of(compared.comparison.rows, same)
    groups = "".join(_group(title, list(some), compared, words) for title, some in groupby(rows, key=words.group))
    nothing = (
        ""
        if rows or compared.comparison.summary.undescribed_different
        else f"<p>{escape(texts('compare.nothing'))}</p>"
    )
    title = texts("compare.title")
    return f"""<!doctype html>
<html lang="{escape(texts("compare.language"))}">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<title>{escape(title)}: {escape(" / ".join(words.title(one) for one in compared.columns))}</title>
<style>
{_STYLE}
</style>
</head>
<body>
<h1>{escape(title)}</h1>
<p class="sum">{escape(words.sentence(compared.comparison.summary))}</p>
{_notes(compared, words)}{nothing}{groups}<footer>Hubside {escape(__version__)}</footer>
</body>
</html>
"""


def _notes(compared: Compared, words: Words) -> str:
    """What must be known of a column to read it."""
    told = [(words.title(one), words.note(one)) for one in compared.columns]
    return "".join(f"<p>{escape(title)}: {escape(note)}</p>\n" for title, note in told if note)


def _group(title: str, rows: list[Row], compared: Compared, words: Words) -> str:
    head = "".join(
        f'<th scope="col">{escape(words.title(one))}<small>{escape(", ".join(words.circumstances(one)))}</small></th>'
        for one in compared.columns
    )
    body = "\n".join(_row(row, compared, words) for row in rows)
    parameter, state = words.texts("page.compare.head.parameter"), words.texts("page.compare.head.state")
    return f"""<section>
<h2>{escape(title)}</h2>
<table>
<colgroup><col class="name"><col class="state"></colgroup>
<thead><tr><th scope="col">{escape(parameter)}</th><th scope="col">{escape(state)}</th>{head}</tr></thead>
<tbody>
{body}
</tbody>
</table>
</section>
"""


def _row(row: Row, compared: Compared, words: Words) -> str:
    cells = "".join(_cell(row, number, compared, words) for number in range(len(row.cells)))
    findings = "".join(
        f'<p class="finding">⚠ {escape(words.texts(f"rule.{rule}.title"))}</p>'
        for rule in compared.findings.get(row.address, {})
    )
    name = f"{escape(row.address.short)} {escape(words.name(row))}{findings}"
    state = ", ".join(word for word in (words.state(row), words.restore(row)) if word)
    lines = [
        f'<tr class="{row.state.value}"><th scope="row">{name}</th><td class="state">{escape(state)}</td>{cells}</tr>'
    ]
    for bit in row.bits:
        if bit.differs:
            values = "".join(f"<td>{escape(words.bit_value(bit, number))}</td>" for number in bit.values)
            lines.append(f'<tr class="bit"><th scope="row">{escape(words.bit(bit))}</th><td></td>{values}</tr>')
    return "\n".join(lines)


def _cell(row: Row, number: int, compared: Compared, words: Words) -> str:
    """A value, and how it was seen where it comes out of a recording."""
    cell, look = row.cells[number], compared.columns[number].seen.get(row.address)
    if cell.raw is None:
        return f'<td class="absent">{escape(words.value(cell))}</td>'
    seen = "" if look is None else f'<small class="seen">{escape(words.seen(look))}</small>'
    return f"<td>{escape(words.value(cell))}{seen}</td>"


def to_csv(compared: Compared, texts: Texts, same: bool = False) -> str:
    """The comparison as CSV: a row a parameter, below it one for each bit that differs; shown values with raw ones."""
    words = Words(texts)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\r\n")
    head = ["address", "bit", "name", "group", "class", "state", "findings"]
    for one in compared.columns:
        head += [words.title(one), f"{words.title(one)}: raw"]
        head += [f"{words.title(one)}: {words.texts('compare.seen')}"] if one.seen else []
    writer.writerow(map(harmless, head))
    for row in rows_of(compared.comparison.rows, same):
        rules = " ".join(compared.findings.get(row.address, {}))
        group, restore = words.group(row), row.entry.restore.value
        cells = list(_csv_cells(row, compared, words))
        fixed = [row.address.short, "", words.name(row), group, restore, row.state.value, rules]
        writer.writerow(map(harmless, [*fixed, *cells]))
        for bit in row.bits:
            if bit.differs:
                cells = []
                for number, one in zip(bit.values, compared.columns, strict=True):
                    cells += [words.bit_value(bit, number), _raw(number), *([""] if one.seen else [])]
                fixed = [row.address.short, str(bit.bit), words.bit(bit), group, restore, "different", ""]
                writer.writerow(map(harmless, [*fixed, *cells]))
    return out.getvalue()


def _csv_cells(row: Row, compared: Compared, words: Words) -> Iterator[str]:
    """Shown and raw value of every column; of one out of a recording also how the value was seen."""
    for cell, one in zip(row.cells, compared.columns, strict=True):
        yield words.value(cell)
        yield _raw(cell.raw)
        if one.seen:
            look = one.seen.get(row.address)
            yield "" if look is None else words.seen(look)


def _raw(raw: Raw | None) -> str:
    if raw is None:
        return ""
    return raw.hex() if isinstance(raw, bytes) else str(raw)


def harmless(text: str) -> str:
    """A text of elsewhere that a spreadsheet would take for a formula, as plain text; numbers stay numbers."""
    number = text.replace(".", "", 1).removeprefix("-").isdecimal()
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t") and not number else text
