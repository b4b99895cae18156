"""``hubside trips``: what came first at the trips of a recording; ``hubside search``: find a signature in many.

Exit codes of ``search``: 0 where all was looked into, 2 where the signature or a recording cannot be understood.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from app.cli.output import Output
from app.errors import UsageError
from app.model.description import Bus
from app.model.description_file import BUILTIN, load_builtin
from app.recording.node_table import NodeKey
from app.service.analysis.look import Look, look_at, make_index
from app.service.analysis.search.match import check
from app.service.analysis.search.parser import EXAMPLES, parse_query
from app.service.analysis.search.query import Query
from app.service.analysis.search.search import Hit, Skipped, Unsearched, search_one
from app.service.analysis.trips import Trip
from app.service.analysis.words import Teller

NS: Final = 1_000_000_000


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    trips = commands.add_parser("trips", help="tell the trips of a recording, and what came first of each")
    trips.add_argument("recording", nargs="+", type=Path)
    trips.add_argument("--steps", action="store_true", help="with every step, its time and why it came")
    trips.set_defaults(run=_trips)
    search = commands.add_parser(
        "search", help="search recordings for a signature", epilog="examples: " + "; ".join(f"'{e}'" for e in EXAMPLES)
    )
    search.add_argument("signature", help="events in their order and conditions of signals, see the examples")
    search.add_argument(
        "where", nargs="*", type=Path, help="recordings or folders of them; the data folder where not given"
    )
    search.add_argument("--index", action="store_true", help="make the indexes that are missing first")
    search.set_defaults(run=_search)


# -- trips ------------------------------------------------------------------------


def _trips(arguments: argparse.Namespace, output: Output) -> int:
    for path in arguments.recording:

        def shown(share: float, name: str = path.name) -> None:
            output.progress("cli.indexing", file=name, percent=round(100 * share))

        with look_at(path, _cache(arguments), shown) as look:
            _tell(look, arguments, output)
    return 0


def _tell(look: Look, arguments: argparse.Namespace, output: Output) -> None:
    teller = Teller(arguments.settings.language, look.places)
    if not look.trips:
        lines = [output.texts("cli.no_trips", file=look.name)]
        if (before := teller.already(look.tripped_before)) is not None:
            lines.append(f"  {before}")
        data = {"file": look.name, "trips": 0, "already": _keys(look.tripped_before)}
        output.result(data, "\n".join(lines))
    for trip in look.trips:
        lines = [output.texts("cli.trip", file=look.name, time=_time(trip.t0_ns), headline=teller.headline(trip))]
        if (already := teller.already(trip.already)) is not None:
            lines.append(f"  {already}")
        if arguments.steps:
            lines += _lines(trip, teller)
        output.result(_data(look, trip, teller, arguments.steps), "\n".join(lines))


def _keys(nodes: Sequence[NodeKey]) -> list[str]:
    return [f"{bus}/{node}" for bus, node in nodes]


def _lines(trip: Trip, teller: Teller) -> list[str]:
    first_ns = trip.steps[trip.first].step.t_ns
    lines = []
    for place, one in enumerate(trip.steps):
        mark = {trip.first: "1", trip.at: "T0"}.get(place, "")
        because = teller.because_of(trip, place)
        lines.append(f"  {mark:2} {teller.lasting(one.step.t_ns - first_ns):>9}  {teller.sentence(one.step)}")
        if because is not None:
            lines.append(f"  {'':2} {'':9}    {because}")
    return lines


def _data(look: Look, trip: Trip, teller: Teller, with_steps: bool) -> dict[str, Any]:
    first = trip.steps[trip.first].step
    data: dict[str, Any] = {
        "file": look.name,
        "t0_ns": trip.t0_ns,
        "ended_ns": trip.ended_ns,
        "known": trip.known,
        "first_ns": first.t_ns,
        "first": first.kind.value,
        "nodes": _keys(first.nodes),
        "headline": teller.headline(trip),
        "already": _keys(trip.already),
    }
    if with_steps:
        data["steps"] = [
            {
                "t_ns": one.step.t_ns,
                "role": one.role.value,
                "kind": one.step.kind.value,
                "nodes": [f"{bus}/{node}" for bus, node in one.step.nodes],
                "says": teller.sentence(one.step),
                "because": None if one.because is None else one.because.cause,
                "reason": None if one.because is None else one.because.reason.value,
            }
            for one in trip.steps
        ]
    return data


# -- search -----------------------------------------------------------------------


def _search(arguments: argparse.Namespace, output: Output) -> int:
    query = parse_query(arguments.signature)
    check(query, [one for one in map(load_builtin, BUILTIN) if one.bus is Bus.CANOPEN])
    paths = _paths(arguments)
    code = found = 0
    for number, path in enumerate(paths):
        output.progress("cli.searching", done=number, total=len(paths), file=path.name)
        told = _searched(path, query, arguments, output)
        if isinstance(told, Skipped):
            output.say("cli.not_searched", file=path.name, reason_key=told.reason.text_key)
            code = 2
            continue
        found += len(told)
        for hit in told:
            _tell_hit(hit, arguments, output)
    output.say("cli.searched", recordings=len(paths), found=found)
    return code


def _searched(path: Path, query: Query, arguments: argparse.Namespace, output: Output) -> list[Hit] | Skipped:
    told = search_one(path, query, _cache(arguments))
    missing = isinstance(told, Skipped) and told.reason is Unsearched.NO_INDEX
    if not missing or not arguments.index:
        return told

    def shown(share: float) -> None:
        output.progress("cli.indexing", file=path.name, percent=round(100 * share))

    make_index(path, _cache(arguments), shown)
    return search_one(path, query, _cache(arguments))


def _tell_hit(hit: Hit, arguments: argparse.Namespace, output: Output) -> None:
    words = hit.words.de if arguments.settings.language == "de" else hit.words.en
    data = {
        "file": hit.file,
        "turbine": hit.turbine,
        "t_ns": hit.found.t_ns,
        "from_ns": hit.found.from_ns,
        "to_ns": hit.found.to_ns,
        "node": None if hit.found.key is None else f"{hit.found.key[0]}/{hit.found.key[1]}",
        "says": words,
    }
    output.result(data, f"{hit.file}  {_time(hit.found.t_ns)}  {words}")


def _paths(arguments: argparse.Namespace) -> list[Path]:
    found: list[Path] = []
    for place in arguments.where or [arguments.settings.recordings]:
        if not place.exists():
            raise UsageError(reason=f"{place}: no such file or folder")
        found += sorted(place.glob("*.mcap")) if place.is_dir() else [place]
    return found


def _cache(arguments: argparse.Namespace) -> Path:
    cache: Path = arguments.settings.data / "indexes"
    return cache


def _time(t_ns: int) -> str:
    text = datetime.fromtimestamp(t_ns / NS, UTC).isoformat(timespec="milliseconds")
    return text.replace("+00:00", "Z")
