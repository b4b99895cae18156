"""What a report tells, taken from the recording: series, gaps, values at the moment, trips in words, poses.

Nothing is left out without a word: what could not be had is named in ``lacking``.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from app.errors import HubsideError
from app.model.description import Entry, Kind
from app.model.incident import Incident, SignalRef, Span
from app.model.site import Turbine
from app.model.texts import Texts
from app.model.values import show, to_scaled
from app.scene.hub import BladePose, RotorPose
from app.service.analysis.look import Look, look_at
from app.service.analysis.trips import Trip
from app.service.analysis.words import Teller
from app.service.devices import Target, decode
from app.service.replay.source import Source
from app.service.replay.stage import ReplayStage
from app.service.replay.views import GapLine, SeriesLine, Views
from app.service.rotor_view import rotor_line
from app.service.scene_feed import pose, rotor_pose
from app.service.views import AxisLine, axis_lines

log = logging.getLogger(__name__)

POINTS: Final = 1200
"""Of a series in a plot: more than it has pixels."""
SCENE_NS: Final = 20_000_000_000
"""The 3D scene plays so much at most, around the moment."""
STEP_NS: Final = 100_000_000
"""From pose to pose."""
MAX_STEPS: Final = 40
"""Steps of a trip that are told; how many more there were is told too."""


@dataclass(frozen=True, slots=True)
class ValueLine:
    """A signal at the moment; ``shown`` None: nothing was known of it then. ``age_ns``: how long before it was seen."""

    signal: SignalRef
    name: str
    shown: str | None
    unit: str
    age_ns: int | None
    stale: bool


@dataclass(frozen=True, slots=True)
class PlotFacts:
    """One plot: a title for each of its series."""

    series: tuple[SeriesLine, ...]
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class StoryStep:
    """One step of a trip in words; ``t_ns`` is its time."""

    t_ns: int
    told: str
    because: str | None


@dataclass(frozen=True, slots=True)
class Story:
    """A trip in words; ``already`` names units that were tripped before, ``left_out`` steps were too many."""

    t0_ns: int
    headline: str
    already: str | None
    steps: tuple[StoryStep, ...]
    left_out: int


@dataclass(frozen=True, slots=True)
class ScenePose:
    """Blades and rotor at a time."""

    t_ns: int
    blades: Mapping[int, BladePose]
    rotor: RotorPose


@dataclass(frozen=True, slots=True)
class Facts:
    """All of it. ``lacking``: text key and details of what could not be had. ``begin_ns``: where plots begin."""

    span: Span
    plots: tuple[PlotFacts, ...] = ()
    gaps: tuple[GapLine, ...] = ()
    values: tuple[ValueLine, ...] = ()
    axes: tuple[AxisLine, ...] = ()
    stories: tuple[Story, ...] = ()
    poses: tuple[ScenePose, ...] = ()
    begin_ns: int = 0
    lacking: tuple[tuple[str, Mapping[str, str]], ...] = ()
    seconds_from_ns: int = 0
    """What the seconds of series count from."""
    names: Mapping[str, str] = field(default_factory=dict)


def gather(
    path: Path, incident: Incident, known: Mapping[str, Turbine], cache: Path | None, texts: Texts, language: str
) -> Facts:
    """Everything of a recording; it is indexed first where it is not. Raises RecordingError."""
    lacking: list[tuple[str, Mapping[str, str]]] = []
    stories: tuple[Story, ...] = ()
    try:
        with look_at(path, cache) as look:
            stories = tuple(_stories(look, incident.draft.span, language))
    except HubsideError as error:
        lacking.append(("incident.report.no_story", {"reason": texts(error.text_key, **error.details)}))
    except Exception as error:  # a defect of ours costs the words, not the report
        log.exception("the trips of %s could not be told", path.name)
        lacking.append(("incident.report.no_story", {"reason": repr(error)}))
    source = Source(path, known, cache)
    try:
        source.look_for_index()
        return _facts(source, incident, texts, stories, lacking)
    finally:
        source.close()


def _facts(
    source: Source,
    incident: Incident,
    texts: Texts,
    stories: tuple[Story, ...],
    lacking: list[tuple[str, Mapping[str, str]]],
) -> Facts:
    draft = incident.draft
    span = Span(max(draft.span.from_ns, source.from_ns), min(draft.span.to_ns, source.to_ns))
    at_ns = min(max(draft.at_ns, source.from_ns), source.to_ns)
    stage = ReplayStage(source, source.keyframe(at_ns), lambda: at_ns)
    stage.advance(at_ns, lambda: False)
    targets = {target.slug: target for target in stage.targets}
    signals = list(dict.fromkeys(signal for plot in draft.plots for signal in plot))
    plots: tuple[PlotFacts, ...] = ()
    gaps: tuple[GapLine, ...] = ()
    try:
        views = Views(source, stage.targets)
        plots = tuple(_plot(views, plot, span, targets, texts) for plot in draft.plots)
        gaps = views.timeline(span.from_ns, span.to_ns + 1, 10).gaps
    except HubsideError as error:
        lacking.append(("incident.report.no_plots", {"reason": texts(error.text_key, **error.details)}))
    values = tuple(_value(signal, targets.get(signal.device), at_ns, texts) for signal in signals)
    axes = axis_lines(stage.turbine, targets, at_ns)
    return Facts(
        span=span,
        plots=plots,
        gaps=gaps,
        values=values,
        axes=axes,
        stories=stories,
        poses=tuple(_poses(source, span, at_ns)),
        begin_ns=span.from_ns,
        lacking=tuple(lacking),
        seconds_from_ns=source.from_ns,
        names={target.slug: target.slug.partition("/")[2] for target in stage.targets},
    )


def _plot(
    views: Views, plot: Sequence[SignalRef], span: Span, targets: Mapping[str, Target], texts: Texts
) -> PlotFacts:
    there = [one for one in plot if one.device in targets]
    lines = views.series([one.text for one in there], span.from_ns, span.to_ns + 1, POINTS)
    return PlotFacts(tuple(lines), tuple(_title(one, targets[one.device], texts) for one in there))


def _title(signal: SignalRef, target: Target, texts: Texts) -> str:
    entry = target.description.entries.get(signal.address)
    place = signal.device.partition("/")[2]
    return f"{place} {signal.address.short}" + ("" if entry is None else f" {_name(entry, texts)}")


def _name(entry: Entry, texts: Texts) -> str:
    if entry.kind is Kind.VAR:
        return texts.name(entry.name)
    return f"{texts.name(entry.object_name)}: {texts.name(entry.name)}"


def _value(signal: SignalRef, target: Target | None, at_ns: int, texts: Texts) -> ValueLine:
    entry = None if target is None else target.description.entries.get(signal.address)
    if target is None or entry is None:
        return ValueLine(signal, signal.text, None, "", None, False)
    name = _title(signal, target, texts)
    view = target.live.value(target.device.bus, target.node, signal.address)
    if view is None or view.reading is None:
        return ValueLine(signal, name, None, "", None, False)
    raw = decode(entry, view.reading.data)
    scaled = to_scaled(entry, raw, target.lookup)
    key = target.description.name_key(entry, raw)
    shown = texts(key) if key is not None else show(entry, raw, target.lookup)
    unit = "" if scaled is None or key is not None else scaled.unit
    return ValueLine(signal, name, shown, unit, at_ns - view.reading.t_ns, view.stale)


# -- the trip ------------------------------------------------------------------------


def _stories(look: Look, span: Span, language: str) -> Iterator[Story]:
    teller = Teller(language, look.places)
    for trip in look.trips:
        if span.from_ns <= trip.t0_ns <= span.to_ns:
            yield _story(trip, teller)


def _story(trip: Trip, teller: Teller) -> Story:
    steps = tuple(
        StoryStep(one.step.t_ns, teller.step_of(trip, number), teller.because_of(trip, number))
        for number, one in enumerate(trip.steps[:MAX_STEPS])
    )
    return Story(
        trip.t0_ns, teller.headline(trip), teller.already(trip.already), steps, max(0, len(trip.steps) - MAX_STEPS)
    )


# -- the 3D scene --------------------------------------------------------------------


def _poses(source: Source, span: Span, at_ns: int) -> Iterator[ScenePose]:
    """The blades every tenth of a second, as they were decoded; what was not known then is not shown as known."""
    begin = max(span.from_ns, at_ns - SCENE_NS // 2)
    end = min(span.to_ns, begin + SCENE_NS)
    now = begin
    stage = ReplayStage(source, source.keyframe(begin), lambda: now)
    targets = {target.slug: target for target in stage.targets}
    while now <= end:
        stage.advance(now, lambda: False)
        lines = axis_lines(stage.turbine, targets, now)
        blades = {line.blade: pose(line) for line in lines}
        yield ScenePose(now, blades, rotor_pose(rotor_line(stage.live, now)))
        now += STEP_NS
