"""A report as it is read: words, tables and figures in one language. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

from app.model.diff.column import Cell
from app.model.diff.compare import Comparison, RowState
from app.model.incident import Annotation, Incident
from app.model.texts import Texts
from app.service.incidents.form import SetRole
from app.service.incidents.identity import RecordingState
from app.service.incidents.report.facts import Facts, PlotFacts, Story, ValueLine
from app.service.incidents.report.svg import Panel, Stretch, Track
from app.service.views import AxisLine

MAX_ROWS: Final = 300
"""Of differences to one set; how many more there were is told."""
_DASH: Final = "–"
_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Table:
    """``widths`` share the page between the columns. ``remark`` stands below."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    widths: tuple[int, ...]
    remark: str = ""


@dataclass(frozen=True, slots=True)
class Told:
    """A trip: its sentence, and its steps as rows of time and words."""

    headline: str
    already: str
    steps: tuple[tuple[str, str, str], ...]
    remark: str


@dataclass(frozen=True, slots=True)
class Difference:
    """A device at the moment against one of its sets."""

    device: str
    role: SetRole
    taken: str
    """When the set was taken."""
    comparison: Comparison


@dataclass(frozen=True, slots=True)
class View:
    """The report. ``scene`` is a page of its own, empty where there is none; ``remarks`` tell what is lacking."""

    language: str
    decimal: str
    title: str
    heading: str
    facts: tuple[tuple[str, str], ...]
    remarks: tuple[str, ...]
    stories: tuple[Told, ...]
    notes: str
    panels: tuple[Panel, ...]
    tables: tuple[Table, ...]
    scene: str
    words: Mapping[str, str]
    foot: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Matter:
    """What a report is made of. ``sha256`` empty: the hash of the recording is not known."""

    incident: Incident
    state: RecordingState
    sha256: str
    facts: Facts | None
    annotations: Sequence[Annotation]
    differences: Sequence[Difference]
    scene: str
    tool: str
    person: str
    made_ns: int
    lacking: Sequence[tuple[str, Mapping[str, str]]] = ()


def time_text(t_ns: int) -> str:
    """``2026-03-02 09:00:27.000 UTC``."""
    moment = datetime.fromtimestamp(t_ns // _NS, UTC)
    return f"{moment:%Y-%m-%d %H:%M:%S}.{t_ns % _NS // 1_000_000:03d} UTC"


def view_of(matter: Matter, texts: Texts, language: str) -> View:
    """The report in ``language``, whose texts are ``texts``."""
    return _Writer(matter, texts, language).view()


class _Writer:
    def __init__(self, matter: Matter, texts: Texts, language: str) -> None:
        self._matter, self._texts, self._language = matter, texts, language
        self._decimal = texts("analysis.decimal_point")
        self._draft = matter.incident.draft

    def _t(self, name: str, **details: object) -> str:
        return self._texts(f"incident.report.{name}", **details)

    def view(self) -> View:
        matter, facts = self._matter, self._matter.facts
        tables = [self._axes(facts.axes), self._values(facts.values)] if facts is not None else []
        tables += [self._marks(), *(self._difference(one) for one in matter.differences)]
        return View(
            language=self._language,
            decimal=self._decimal,
            title=self._t("title", title=self._draft.title),
            heading=self._draft.title,
            facts=tuple(self._head()),
            remarks=tuple(self._remarks()),
            stories=() if facts is None else tuple(self._story(one) for one in facts.stories),
            notes=self._draft.notes,
            panels=() if facts is None else tuple(self._panels(facts)),
            tables=tuple(table for table in tables if table.rows or table.remark),
            scene=matter.scene,
            words={name: self._t(name) for name in _WORDS},
            foot=(self._t("foot", tool=matter.tool, person=matter.person, time=time_text(matter.made_ns)),),
        )

    # -- the head --------------------------------------------------------------------

    def _head(self) -> Iterator[tuple[str, str]]:
        one, draft, matter = self._matter.incident, self._draft, self._matter
        yield self._t("turbine"), draft.turbine
        yield self._t("moment"), time_text(draft.at_ns)
        yield self._t("range"), f"{time_text(draft.span.from_ns)} … {time_text(draft.span.to_ns)}"
        yield self._t("recording"), f"{draft.recording}. {self._texts(matter.state.text_key)}"
        yield "SHA-256", matter.sha256 or self._t("no_hash")
        yield self._t("author"), f"{one.author}, {time_text(one.created_ns)}"
        if one.version > 1:
            edited = {"person": one.person, "time": time_text(one.t_ns), "version": one.version}
            yield self._t("changed"), self._t("changed_by", **edited)
        if draft.tags:
            yield self._t("tags"), ", ".join(draft.tags)
        yield self._t("code"), one.code
        if one.origin is not None:
            told = {"file": one.origin.file, "person": one.origin.person, "recording": one.origin.recording}
            yield self._t("origin"), self._t("origin_of", **told)

    def _remarks(self) -> Iterator[str]:
        matter, facts = self._matter, self._matter.facts
        if facts is None:
            yield self._t("no_recording")
        for key, details in (*matter.lacking, *(facts.lacking if facts is not None else ())):
            yield self._texts(key, **details)
        if facts is not None and not facts.stories and not any("story" in key for key, _ in facts.lacking):
            yield self._t("no_trip")

    def _story(self, story: Story) -> Told:
        steps = tuple(
            (f"{self._seconds((one.t_ns - story.t0_ns) / _NS)} s", one.told, one.because or "") for one in story.steps
        )
        remark = self._t("left_out", count=story.left_out) if story.left_out else ""
        return Told(story.headline, story.already or "", steps, remark)

    def _seconds(self, dt_s: float) -> str:
        text = f"{dt_s:+.3f}".replace(".", self._decimal).replace("-", "−")
        return text[1:] if not text.strip(f"+−0{self._decimal}") else text

    # -- figures ---------------------------------------------------------------------

    def _panels(self, facts: Facts) -> Iterator[Panel]:
        zero = facts.seconds_from_ns
        gaps = [
            Stretch((gap.from_ns - zero) / _NS, (gap.to_ns - zero) / _NS, self._texts(gap.text_key, **gap.details))
            for gap in facts.gaps
        ]
        begin, end = (facts.span.from_ns - zero) / _NS, (facts.span.to_ns - zero) / _NS
        cursor = (self._draft.at_ns - zero) / _NS
        for number, plot in enumerate(facts.plots, 1):
            for unit in dict.fromkeys(line.unit for line in plot.series):
                tracks = list(_tracks(plot, unit))
                title = self._t("plot", number=number, unit=unit or _DASH)
                yield Panel(unit, begin, end, cursor, tracks, gaps, title)

    # -- tables ----------------------------------------------------------------------

    def _axes(self, axes: Sequence[AxisLine]) -> Table:
        head = tuple(self._t(name) for name in ("blade", "position", "demand", "state", "fault", "dc_link", "battery"))
        rows = tuple(self._axis(line) for line in axes)
        return Table(self._t("axes"), head, rows, (2, 3, 3, 5, 6, 4, 3))

    def _axis(self, line: AxisLine) -> tuple[str, ...]:
        stale = f" ({self._t('stale')})" if line.stale and line.position_deg is not None else ""
        fault = _DASH if line.fault_code is None else self._t("no_fault")
        if line.fault_code:
            words = "" if line.fault_text_key is None else f" {self._texts(line.fault_text_key)}"
            fault = f"{line.fault_code:04X}h{words}"
        return (
            str(line.blade),
            self._number(line.position_deg, "°") + stale,
            self._number(line.demand_deg, "°"),
            _DASH if line.state is None else self._texts(line.state),
            fault,
            self._number(line.dc_link_v, " V"),
            self._number(line.battery_soc_pct, " %"),
        )

    def _number(self, number: float | None, unit: str) -> str:
        return _DASH if number is None else f"{number:.2f}{unit}".replace(".", self._decimal)

    def _values(self, values: Sequence[ValueLine]) -> Table:
        head = tuple(self._t(name) for name in ("signal", "value", "seen"))
        return Table(self._t("values"), head, tuple(self._value(one) for one in values), (10, 4, 4))

    def _value(self, one: ValueLine) -> tuple[str, ...]:
        if one.shown is None or one.age_ns is None:
            return one.name, self._t("unknown"), _DASH
        before = self._t("before", seconds=f"{one.age_ns / _NS:.3f}".replace(".", self._decimal))
        shown = one.shown.replace(".", self._decimal) if one.unit else one.shown
        return one.name, f"{shown} {one.unit}".strip(), before + (f" ({self._t('stale')})" if one.stale else "")

    def _marks(self) -> Table:
        head = tuple(self._t(name) for name in ("time", "lasts", "severity", "text", "by"))
        rows = tuple(
            (
                time_text(one.span.from_ns),
                f"{(one.span.to_ns - one.span.from_ns) / _NS:.3f} s".replace(".", self._decimal),
                self._t(f"note_{one.severity.value}"),
                one.text,
                one.person,
            )
            for one in self._matter.annotations
        )
        return Table(self._t("annotations"), head, rows, (7, 3, 3, 12, 4))

    def _difference(self, one: Difference) -> Table:
        told = {"device": one.device.partition("/")[2], "kind": self._t(f"set_{one.role.value}"), "time": one.taken}
        differ = [row for row in one.comparison.rows if row.state in (RowState.DIFFERENT, RowState.UNIT)]
        rows = tuple(
            (
                row.address.short,
                _entry_name(row.entry.object_name, row.entry.name, self._texts),
                self._cell(row.cells[0]),
                self._cell(row.cells[1]),
            )
            for row in differ[:MAX_ROWS]
        )
        summary = one.comparison.summary
        remark = self._t(
            "difference_sum", different=len(differ), same=summary.same, unseen=summary.missing + summary.unread
        )
        if len(differ) > MAX_ROWS:
            remark += " " + self._t("left_out", count=len(differ) - MAX_ROWS)
        head = tuple(self._t(name) for name in ("address", "object", "at_moment", "in_set"))
        return Table(self._t("difference", **told), head, rows, (3, 9, 5, 5), remark)

    def _cell(self, cell: Cell) -> str:
        if cell.raw is None:
            return _DASH
        if cell.text_key is not None:
            return self._texts(cell.text_key)
        return f"{cell.shown} {cell.unit}".strip().replace(".", self._decimal if cell.unit else ".")


_WORDS: Final = ("story", "notes_head", "plots", "scene", "scene_help", "remarks", "cursor", "gap", "step", "because")


def _tracks(plot: PlotFacts, unit: str) -> Iterator[Track]:
    for line, name in zip(plot.series, plot.names, strict=True):
        if line.unit == unit:
            yield Track(name, line.t_s, line.low, line.high, line.bucket_s)


def _entry_name(of: str, name: str, texts: Texts) -> str:
    return texts.name(name) if of == name or not of else f"{texts.name(of)}: {texts.name(name)}"
