"""``hubside incident``: incidents of the data folder, and files of them. Works while no server does."""

from __future__ import annotations

import argparse
import time
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from app.cli.connecting import run_command
from app.cli.output import Output
from app.cli.users import opened
from app.errors import UsageError
from app.model.incident import Incident, dump_draft
from app.service.incidents.annotations import Annotations
from app.service.incidents.desk import IncidentDesk
from app.service.incidents.form import SUFFIX
from app.service.incidents.incidents import Incidents, Wanted
from app.service.incidents.report.making import make_report
from app.service.incidents.report.view import time_text
from app.service.journal import Journal
from app.service.library.library import Library
from app.service.recording_list import Recordings, samples_folder
from app.service.replay.moments import Moments

Run = Callable[[argparse.Namespace, Output, IncidentDesk], Coroutine[Any, Any, int]]
KEY_HELP = "its code or id"


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = commands.add_parser("incident", help="incidents marked in recordings: list, export, open, report")
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")

    def action(name: str, run: Run, text: str) -> argparse.ArgumentParser:
        one = actions.add_parser(name, help=text)
        one.set_defaults(run=lambda arguments, output: run_command(_with_desk(arguments, output, run)))
        return one

    listing = action("list", _list, "all incidents, the latest first")
    listing.add_argument("--search", default="", metavar="WORDS", help="only those in which all words are found")
    listing.add_argument("--tag", help="only those with this tag")
    listing.add_argument("--hidden", action="store_true", help="those that were taken off the list too")
    for name, run, text in (
        ("show", _show, "one incident with its notes and annotations"),
        ("export", _export, "write the bundle of an incident: all of it in one file"),
        ("report", _report, "write the report of an incident: one HTML file"),
    ):
        one = action(name, run, text)
        one.add_argument("incident", help=KEY_HELP)
        if run is not _show:
            one.add_argument("--output", type=Path, help="the file to write; in this folder where not given")
    opening = action("open", _open, "open a bundle: recording and incident go into the data folder")
    opening.add_argument("file", type=Path)


async def _with_desk(arguments: argparse.Namespace, output: Output, run: Run) -> int:
    async with _desk(arguments) as desk:
        return await run(arguments, output, desk)


@asynccontextmanager
async def _desk(arguments: argparse.Namespace) -> AsyncIterator[IncidentDesk]:
    settings = arguments.settings
    async with opened(arguments) as (store, audit):
        journal = Journal(time.time_ns, settings.person)
        end = journal.listen(audit.take)
        files = Recordings(settings.recordings, samples_folder())
        annotations = Annotations(store, audit, time.time_ns)
        annotations.data = settings.data
        incidents = Incidents(store, audit, time.time_ns, journal)
        library = Library(store, audit, time.time_ns)
        moments = Moments(files, dict, settings.data / "indexes")
        try:
            yield IncidentDesk(incidents, annotations, library, files, moments, settings.recordings)
        finally:
            end()


async def _list(arguments: argparse.Namespace, output: Output, desk: IncidentDesk) -> int:
    found = await desk.incidents.all(Wanted(None, arguments.tag, arguments.search, arguments.hidden))
    if output.as_json:
        output.result([_as_dict(one) for one in found], "")
        return 0
    head = tuple(output.texts(f"incident.report.{name}") for name in ("code", "moment", "turbine", "text", "author"))
    rows = [(one.code, time_text(one.draft.at_ns), one.draft.turbine, one.draft.title, one.author) for one in found]
    output.table(head, rows)
    return 0


async def _show(arguments: argparse.Namespace, output: Output, desk: IncidentDesk) -> int:
    one = await desk.incidents.get(arguments.incident)
    standing = await desk.incidents.standing(desk.recordings, one)
    marks = (await desk.annotations.of(one.draft.recording, standing.path)).annotations
    mine = [mark for mark in marks if mark.incident == one.id]
    if output.as_json:
        told = [{"from_ns": mark.span.from_ns, "to_ns": mark.span.to_ns, "text": mark.text} for mark in mine]
        output.result({**_as_dict(one), "recording_state": standing.state.value, "annotations": told}, "")
        return 0
    draft, texts = one.draft, output.texts
    output.line(f"{one.code}  {draft.title}")
    for name, text in (
        ("turbine", draft.turbine),
        ("moment", time_text(draft.at_ns)),
        ("range", f"{time_text(draft.span.from_ns)} … {time_text(draft.span.to_ns)}"),
        ("recording", f"{draft.recording}. {texts(standing.state.text_key)}"),
        ("author", f"{one.author}, {time_text(one.created_ns)}"),
        ("tags", ", ".join(draft.tags) or "–"),
    ):
        output.line(f"{texts(f'incident.report.{name}')}: {text}")
    for line in draft.notes.splitlines():
        output.line(f"  {line}")
    for mark in mine:
        output.line(f"{time_text(mark.span.from_ns)}  {mark.text}")
    return 0


async def _export(arguments: argparse.Namespace, output: Output, desk: IncidentDesk) -> int:
    one = await desk.incidents.get(arguments.incident)
    target = _free(arguments.output or Path(f"{one.draft.turbine}-{one.code}{SUFFIX}"))
    exported = await desk.export(one.id, target, arguments.settings.person)
    for key in exported.manifest.lacking:
        output.say(key)
    details = {"file": str(target), "members": len(exported.manifest.members), "size": target.stat().st_size}
    output.result(details, output.texts("cli.incident_exported", **details))
    return 0


async def _report(arguments: argparse.Namespace, output: Output, desk: IncidentDesk) -> int:
    settings = arguments.settings
    cache = settings.data / "indexes"
    made = await make_report(desk, arguments.incident, settings.person, settings.language, {}, cache)
    target = _free(arguments.output or Path(made.name))
    try:
        target.write_text(made.html, encoding="utf-8")
    except OSError as error:
        raise UsageError(reason=f"{target}: {error.strerror or error}") from error
    details = {"file": str(target), "size": target.stat().st_size}
    output.result(details, output.texts("cli.incident_reported", **details))
    return 0


async def _open(arguments: argparse.Namespace, output: Output, desk: IncidentDesk) -> int:
    taken = await desk.take(arguments.file, arguments.settings.person)
    for flaw in taken.flaws:
        reason = output.texts(flaw.reason_key, detail=flaw.detail)
        output.say("cli.incident_flaw", member=flaw.member, reason=reason)
    for key in taken.lacking:
        output.say(key)
    one = taken.incident
    details = {
        "code": None if one is None else one.code,
        "title": "–" if one is None else one.draft.title,
        "recording": taken.recording or "–",
        "annotations": taken.annotations,
        "sets": taken.sets,
        "flaws": len(taken.flaws),
    }
    output.result(details, output.texts("cli.incident_opened", **{**details, "code": details["code"] or "–"}))
    return 1 if taken.flaws else 0


def _free(target: Path) -> Path:
    if target.exists():
        raise UsageError(reason=f"{target} exists already: name another file")
    return target


def _as_dict(one: Incident) -> dict[str, Any]:
    return {
        "id": one.id,
        "code": one.code,
        "version": one.version,
        "author": one.author,
        "created_ns": one.created_ns,
        "person": one.person,
        "t_ns": one.t_ns,
        "hidden": one.hidden,
        **dump_draft(one.draft),
    }
