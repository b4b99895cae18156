"""Makes the report of an incident out of its recording, the library and the store."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.errors import HubsideError
from app.model.diff.column import Column
from app.model.diff.compare import compare
from app.model.incident import Incident
from app.model.sets import ParameterSet
from app.model.site import Turbine
from app.model.texts import Texts, load_texts
from app.scene.export import Still, scene_page
from app.service.devices import Target
from app.service.incidents.bundle import TOOL
from app.service.incidents.desk import IncidentDesk
from app.service.incidents.form import plain_name
from app.service.incidents.identity import Standing
from app.service.incidents.report.facts import STEP_NS, Facts, ScenePose, gather
from app.service.incidents.report.html import render_html
from app.service.incidents.report.view import Difference, Matter, view_of
from app.service.office.audit import Action
from app.service.replay.moments import Moment

MAX_SCENE_BYTES: Final = 12 << 20
SCENE_TIMEOUT_S: Final = 60.0
_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Report:
    """A report; ``name`` is that of its file."""

    name: str
    html: str


async def make_report(
    desk: IncidentDesk, key: str, person: str, language: str, known: Mapping[str, Turbine], cache: Path | None
) -> Report:
    """The report in ``language``. What could not be had is named in it. Raises IncidentUnknownError, StoreError."""
    incident = await desk.incidents.get(key)
    standing = await desk.incidents.standing(desk.recordings, incident)
    texts = load_texts(language)
    lacking: list[tuple[str, Mapping[str, str]]] = []
    facts, differences, scene, sha256 = None, [], "", await desk.incidents.known_hash(incident) or ""
    if standing.path is not None:
        try:
            facts = await asyncio.to_thread(gather, standing.path, incident, known, cache, texts, language)
            differences = await _differences(desk, incident, standing, lacking)
            scene = await _scene(facts.poses, lacking, texts)
            sha256 = await desk.incidents.hash_of(standing.path)
        except HubsideError as error:
            lacking.append(("incident.report.unreadable", {"reason": texts(error.text_key, **error.details)}))
    matter = await _matter(desk, incident, standing, facts, differences, scene, sha256, person, lacking)
    html = await asyncio.to_thread(lambda: render_html(view_of(matter, texts, language)))
    desk.incidents.note(Action.INCIDENT_REPORTED, incident, person)
    return Report(f"{plain_name(incident.draft.turbine)}-{incident.code}.html", html)


async def _matter(
    desk: IncidentDesk,
    incident: Incident,
    standing: Standing,
    facts: Facts | None,
    differences: list[Difference],
    scene: str,
    sha256: str,
    person: str,
    lacking: list[tuple[str, Mapping[str, str]]],
) -> Matter:
    draft = incident.draft
    listed = await desk.annotations.of(draft.recording, standing.path)
    span = draft.span
    near = [one for one in listed.annotations if one.span.to_ns >= span.from_ns and one.span.from_ns <= span.to_ns]
    return Matter(
        incident, standing.state, sha256, facts, near, differences, scene, TOOL, person,
        desk.incidents.stamp(), tuple(lacking),
    )  # fmt: skip


async def _differences(
    desk: IncidentDesk, incident: Incident, standing: Standing, lacking: list[tuple[str, Mapping[str, str]]]
) -> list[Difference]:
    """Each device at the moment against its golden set, else its latest one."""
    moment = await desk.moment(incident, standing)
    found, without = [], []
    for target in () if moment is None else moment.targets:
        reference = await desk.reference(target.slug, target.description.id)
        if moment is None or not reference:
            without.append(target.slug.partition("/")[2])
            continue
        role, parameters = reference[0]
        columns = [_column(target, _of_moment(moment, target)), _column(target, parameters)]
        found.append(Difference(target.slug, role, parameters.origin.time, compare(columns)))
    if without:
        lacking.append(("incident.report.no_set", {"devices": ", ".join(without)}))
    return found


def _of_moment(moment: Moment, target: Target) -> ParameterSet:
    return moment.parameters(target.slug, "", "")


def _column(target: Target, one: ParameterSet) -> Column:
    return Column(
        target.slug, target.description, one.description_version, one.values, one.unread, frozenset(one.empty)
    )


async def _scene(poses: tuple[ScenePose, ...], lacking: list[tuple[str, Mapping[str, str]]], texts: Texts) -> str:
    if not poses:
        return ""
    stills = [Still(one.blades, one.rotor, STEP_NS / _NS) for one in poses]
    try:
        async with asyncio.timeout(SCENE_TIMEOUT_S):
            page = await asyncio.to_thread(scene_page, stills)
    except (TimeoutError, OSError, RuntimeError) as error:
        lacking.append(("incident.report.no_scene", {"reason": str(error) or texts("incident.report.too_slow")}))
        return ""
    if len(page) > MAX_SCENE_BYTES:
        lacking.append(("incident.report.no_scene", {"reason": f"{len(page) >> 20} MB"}))
        return ""
    return page
