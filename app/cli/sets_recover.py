"""``hubside sets recover``: the sets that the SDO traffic of recordings showed, several files as one."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.cli.connecting import run_command
from app.cli.output import Output
from app.cli.sets_library import known, record_dict, tell_ahead, with_library
from app.errors import UsageError
from app.model.address import is_decimal
from app.service.library.folder import SetFolder
from app.service.library.library import Library
from app.service.library.recovered import Named, Recovered, recover_sets
from app.wire.records import SdoAccess


def add_actions(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the action."""
    recover = actions.add_parser(
        "recover",
        help="take the sets that the SDO traffic of recordings showed",
        description=(
            "Several files are read as one, by their time, whatever their order here: the parts of a recording, or "
            "recordings of one turbine. What was seen before a part that is missing, or before another recording "
            "begins, is marked as seen before a gap."
        ),
    )
    recover.add_argument("recording", type=Path, nargs="+")
    recover.add_argument(
        "--node",
        action="append",
        default=[],
        metavar="NODE=SLUG:DESCRIPTION",
        help="what a node is, where the recording does not tell; may be repeated",
    )
    recover.set_defaults(run=lambda arguments, output: run_command(with_library(arguments, output, _recover)))


async def _recover(arguments: argparse.Namespace, output: Output, library: Library, _folder: SetFolder) -> int:
    named = dict(_named(text) for text in arguments.node)
    found = recover_sets(
        arguments.recording,
        known(),
        named,
        lambda share: output.progress("cli.sets.recovering", percent=round(100 * share)),
    )
    records = await library.put_recovered(found, found.name, arguments.settings.person)
    for one, record in zip(found.sets, records, strict=True):
        written = sum(look.access is SdoAccess.WRITE for look in one.seen.values())
        doubtful = sum(look.doubt is not None for look in one.seen.values())
        counts = {"read": len(one.seen) - written, "written": written, "doubtful": doubtful}
        details = {"device": record.origin.device, "unread": record.unread, "id": record.id, **counts}
        seen = {address.short: look.as_json() for address, look in one.seen.items()}
        output.result(
            {**record_dict(record, []), **counts, "seen": seen}, output.texts("cli.sets.recovered", **details)
        )
        tell_ahead(output, library, record)
    _tell_rest(output, found)
    return 0


def _tell_rest(output: Output, found: Recovered) -> None:
    for (bus, node), count in found.nameless.items():
        output.say("cli.sets.nameless", bus=bus, node=node, values=count)
    if found.damages:
        output.say("cli.sets.damages", count=found.damages)
    if not found.sets:
        output.say("cli.sets.nothing_seen")


def _named(text: str) -> tuple[int, Named]:
    node, _, what = text.partition("=")
    slug, _, description = what.rpartition(":")
    descriptions = known()
    if not is_decimal(node) or slug.count("/") != 2 or description not in descriptions:
        raise UsageError(reason=f"'{text}' is not NODE=TURBINE/STATION/DEVICE:DESCRIPTION")
    return int(node), Named(slug, descriptions[description])
