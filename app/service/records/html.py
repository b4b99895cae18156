"""A record as one HTML file: nothing is loaded, nothing is run, and it prints on A4. Pure."""

from __future__ import annotations

from html import escape
from typing import Final

from app.service.records.view import Table, View

POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'"
_STYLE: Final = """
@page { size: A4; margin: 14mm 12mm; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 8mm; max-width: 210mm; background: #fff; color: #16202b;
  font: 9pt/1.35 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
h1 { font-size: 16pt; margin: 0; } h2 { font-size: 11pt; margin: 5mm 0 1.5mm; break-after: avoid; }
p.station { font-size: 12pt; margin: 1mm 0 3mm; }
p.badge { border: 2px solid #8a5a00; color: #6b4600; font-weight: 700; padding: 1.5mm 3mm; }
p.outcome { border-left: 2mm solid; padding: 2mm 3mm; font-size: 11pt; font-weight: 700; background: #f3f5f7; }
p.new { border-color: #17703a; } p.old { border-color: #2a5d9c; } p.incomplete { border-color: #b3261e; }
table { width: 100%; border-collapse: collapse; table-layout: fixed; }
th, td { text-align: left; vertical-align: top; padding: .7mm 1.2mm; border-bottom: .2mm solid #c9d1d8;
  overflow-wrap: anywhere; white-space: pre-wrap; font-variant-numeric: tabular-nums; }
thead th { border-bottom: .4mm solid #16202b; font-size: 7.5pt; }
tbody th { font-weight: 600; } thead { display: table-header-group; } tr { break-inside: avoid; }
footer { margin-top: 6mm; padding-top: 2mm; border-top: .4mm solid #16202b; font-size: 8pt; overflow-wrap: anywhere; }
footer p { margin: .8mm 0; }
@media print { body { padding: 0; max-width: none; } }
""".strip()


def render_html(view: View) -> str:
    """The whole document but for what a machine reads of it."""
    facts = "\n".join(
        f'<tr><th scope="row">{escape(label)}</th><td>{escape(text)}</td></tr>' for label, text in view.facts
    )
    badge = f'<p class="badge">{escape(view.badge)}</p>\n' if view.badge else ""
    foot = "\n".join(f"<p>{escape(line)}</p>" for line in view.foot)
    return f"""<!doctype html>
<html lang="{escape(view.language)}">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<title>{escape(view.title)} – {escape(view.station)}</title>
<style>
{_STYLE}
</style>
</head>
<body>
<header>
<h1>{escape(view.title)}</h1>
<p class="station">{escape(view.station)}</p>
{badge}<p class="outcome {view.outcome.value}">{escape(view.verdict)}</p>
</header>
<main>
<table>
{_widths((3, 10))}
<tbody>
{facts}
</tbody>
</table>
{"".join(_table(table) for table in view.tables)}</main>
<footer>
{foot}
</footer>
</body>
</html>
"""


def _table(table: Table) -> str:
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in table.head)
    rows = "\n".join(_row(row, table.row_heads) for row in table.rows)
    return f"""<section>
<h2>{escape(table.title)}</h2>
<table>
{_widths(table.widths)}
<thead><tr>{head}</tr></thead>
<tbody>
{rows}
</tbody>
</table>
</section>
"""


def _row(cells: tuple[str, ...], headed: bool) -> str:
    first, *others = cells
    begin = f'<th scope="row">{escape(first)}</th>' if headed else f"<td>{escape(first)}</td>"
    return f"<tr>{begin}{''.join(f'<td>{escape(cell)}</td>' for cell in others)}</tr>"


def _widths(widths: tuple[int, ...]) -> str:
    columns = "".join(f'<col style="width:{100 * width / sum(widths):.2f}%">' for width in widths)
    return f"<colgroup>{columns}</colgroup>"
