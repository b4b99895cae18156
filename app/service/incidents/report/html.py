"""A report as one HTML file: it opens from a disk, loads nothing, and prints. Pure.

Only the 3D scene runs anything, in a frame that can reach neither the page around it nor any network.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Final

from app.service.incidents.report.svg import COLOURS, DASHES, Panel, panel_svg
from app.service.incidents.report.view import Table, Told, View

PLAIN: Final = "default-src 'none'; style-src 'unsafe-inline'"
WITH_SCENE: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; "
    "worker-src blob:; connect-src data: blob:; img-src data: blob:; font-src data:"
)
"""The client of the scene is inline code with a decoder and a worker of its own; nothing of it comes from a network."""
_STYLE: Final = """
@page { size: A4; margin: 14mm 12mm; }
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 8mm; max-width: 230mm; background: #fff; color: #16202b;
  font: 10pt/1.4 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
h1 { font-size: 17pt; margin: 0 0 3mm; overflow-wrap: anywhere; }
h2 { font-size: 12pt; margin: 7mm 0 2mm; break-after: avoid; }
h3 { font-size: 10pt; margin: 3mm 0 1mm; break-after: avoid; }
table { width: 100%; border-collapse: collapse; table-layout: fixed; }
th, td { text-align: left; vertical-align: top; padding: .7mm 1.2mm; border-bottom: .2mm solid #c9d1d8;
  overflow-wrap: anywhere; font-variant-numeric: tabular-nums; }
thead th { border-bottom: .4mm solid #16202b; font-size: 8.5pt; }
tbody th { font-weight: 600; } thead { display: table-header-group; } tr, figure { break-inside: avoid; }
.remarks { border-left: 2mm solid #8a5a00; background: #fdf6e9; padding: 2mm 4mm; margin: 4mm 0; }
.remarks p, p.remark { margin: .6mm 0; }
.headline { font-size: 12.5pt; font-weight: 700; margin: 1mm 0 2mm; }
.notes { white-space: pre-wrap; overflow-wrap: anywhere; margin: 0; }
figure { margin: 2mm 0 5mm; } figcaption { font-size: 9pt; }
figcaption span { display: inline-flex; align-items: center; gap: 1.5mm; margin-right: 5mm; }
figcaption svg { width: 9mm; height: 3mm; }
svg { width: 100%; height: auto; display: block; }
svg text { font: 11px system-ui, "DejaVu Sans", sans-serif; fill: #33414e; }
svg .unit { font-weight: 700; } svg .grid { stroke: #e3e8ec; fill: none; } svg .frame { stroke: #16202b; fill: none; }
svg .line { fill: none; stroke-width: 1.6; } svg .band { fill-opacity: .45; stroke-width: .8; }
svg .gap { fill: #b3261e; fill-opacity: .16; }
svg .cursor { stroke: #16202b; stroke-width: 1.2; stroke-dasharray: 5 3; }
iframe { width: 100%; height: 118mm; border: .3mm solid #c9d1d8; background: #eef1f4; }
footer { margin-top: 8mm; padding-top: 2mm; border-top: .4mm solid #16202b; font-size: 8.5pt; }
@media print { body { padding: 0; max-width: none; } .scene { display: none; } }
""".strip()


def render_html(view: View) -> str:
    """The whole document."""
    policy = WITH_SCENE if view.scene else PLAIN
    body = "\n".join(_body(view))
    return f"""<!doctype html>
<html lang="{escape(view.language)}">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width">
<meta name="referrer" content="no-referrer">
<title>{escape(view.title)}</title>
<style>
{_STYLE}
</style>
</head>
<body>
{body}
</body>
</html>
"""


def _body(view: View) -> Iterator[str]:
    words = view.words
    yield f"<header><h1>{escape(view.heading)}</h1></header>\n<main>"
    facts = "\n".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(text)}</td></tr>' for name, text in view.facts
    )
    yield f"<table>{_widths((3, 13))}<tbody>\n{facts}\n</tbody></table>"
    if view.remarks:
        lines = "".join(f"<p>{escape(line)}</p>" for line in view.remarks)
        yield f'<section class="remarks" aria-label="{escape(words["remarks"])}">{lines}</section>'
    if view.stories:
        yield f"<h2>{escape(words['story'])}</h2>"
        yield from (_story(one, view) for one in view.stories)
    if view.notes:
        yield f'<h2>{escape(words["notes_head"])}</h2>\n<p class="notes">{escape(view.notes)}</p>'
    if view.panels:
        yield f"<h2>{escape(words['plots'])}</h2>"
        yield from (_figure(panel, view) for panel in view.panels)
    if view.scene:
        yield _scene(view)
    yield from (_table(table) for table in view.tables)
    foot = "".join(f"<p>{escape(line)}</p>" for line in view.foot)
    yield f"</main>\n<footer>{foot}</footer>"


def _story(story: Told, view: View) -> str:
    rows = tuple(story.steps)
    head = ("T", view.words["step"], view.words["because"])
    table = _rows(Table("", head, rows, (3, 12, 11)))
    remark = f'<p class="remark">{escape(story.remark)}</p>' if story.remark else ""
    already = f"<p>{escape(story.already)}</p>\n" if story.already else ""
    return f'<p class="headline">{escape(story.headline)}</p>\n{already}{table}{remark}'


def _figure(panel: Panel, view: View) -> str:
    legend = "".join(_key(number, track.label) for number, track in enumerate(panel.tracks))
    cursor = (
        f'<span><svg viewBox="0 0 36 12"><path class="cursor" d="M18 0V12"/></svg>{escape(view.words["cursor"])}</span>'
    )
    gap = ""
    if panel.gaps:
        box = '<svg viewBox="0 0 36 12"><rect class="gap" width="36" height="12"/></svg>'
        gap = f"<span>{box}{escape(view.words['gap'])}</span>"
    return f"<figure>\n{panel_svg(panel, view.decimal)}\n<figcaption>{legend}{cursor}{gap}</figcaption>\n</figure>"


def _key(number: int, label: str) -> str:
    colour, dash = COLOURS[number % len(COLOURS)], DASHES[number // 2 % len(DASHES)] or "none"
    style = f"stroke:{colour};stroke-dasharray:{dash};stroke-width:3"
    line = f'<svg viewBox="0 0 36 12"><path d="M0 6H36" style="{style}"/></svg>'
    return f"<span>{line}{escape(label)}</span>"


def _scene(view: View) -> str:
    """The frame has an origin of its own and may run scripts, nothing else."""
    title = escape(view.words["scene"])
    frame = f'<iframe title="{title}" sandbox="allow-scripts" srcdoc="{escape(view.scene)}"></iframe>'
    return f'<section class="scene"><h2>{title}</h2>\n<p>{escape(view.words["scene_help"])}</p>\n{frame}</section>'


def _table(table: Table) -> str:
    remark = f'<p class="remark">{escape(table.remark)}</p>' if table.remark else ""
    return f"<section><h2>{escape(table.title)}</h2>\n{_rows(table) if table.rows else ''}{remark}</section>"


def _rows(table: Table) -> str:
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in table.head)
    rows = "\n".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    return f"<table>{_widths(table.widths)}<thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table>\n"


def _widths(widths: tuple[int, ...]) -> str:
    columns = "".join(f'<col style="width:{100 * width / sum(widths):.2f}%">' for width in widths)
    return f"<colgroup>{columns}</colgroup>"
