"""``hubside sets list|show|import|export|tag|nameplate``: the library, while no server has the data folder."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from typing import Any, Final

from app import __version__
from app.cli.connecting import run_command
from app.cli.output import Output
from app.cli.sets_seen import mark, tell_legend
from app.cli.users import opened
from app.errors import SetFileError, UsageError
from app.model.address import Address
from app.model.description import Description
from app.model.description_file import BUILTIN, load_builtin
from app.model.set_csv import dump_csv
from app.model.set_dcf import dump_dcf
from app.model.set_head import Taking
from app.model.set_import import read_set_file
from app.model.set_record import SetRecord, Tag
from app.model.sets import Origin, ParameterSet, dump_set, iso_time
from app.model.values import quantity_of, show
from app.service.library.folder import SetFolder
from app.service.library.library import Library
from app.service.library.recovered import Seen
from app.store.set_rows import Filter

Run = Callable[[argparse.Namespace, Output, Library, SetFolder], Coroutine[Any, Any, int]]
FORMATS: Final = ("json", "dcf", "csv")
SECOND_NS: Final = 1_000_000_000
_HEAD: Final = ("ADDRESS", "NAME", "VALUE", "UNIT")
_SET_HELP: Final = "its id, or 8 or more digits of its hash"


def add_actions(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the actions."""

    def action(name: str, run: Run, text: str) -> argparse.ArgumentParser:
        one = actions.add_parser(name, help=text)
        one.set_defaults(run=lambda arguments, output: run_command(with_library(arguments, output, run)))
        return one

    listing = action("list", _list, "all sets of the library, the newest first")
    listing.add_argument("--turbine", help="of this turbine only")
    listing.add_argument("--device", metavar="SLUG", help="of this device only")
    listing.add_argument("--tag", choices=[tag.value for tag in Tag], help="with this tag only")
    shown = action("show", _show, "one set with its values")
    shown.add_argument("set", help=_SET_HELP)
    taking = action("import", _import, "take files into the library: JSON, DCF or CSV")
    taking.add_argument("file", type=Path, nargs="+")
    taking.add_argument("--device", metavar="SLUG", help="whose values they are, where the file does not tell")
    taking.add_argument("--description", metavar="ID", help="what the device is, where its objects do not tell")
    taking.add_argument("--node", type=int, default=0, help="its node number, where the file does not tell")
    taking.add_argument("--as-values", action="store_true", help="take changed values; the origin is that of --device")
    taking.add_argument("--reason", default="", help="kept in the set")
    export = action("export", _export, "write a set as a file")
    export.add_argument("set", help=_SET_HELP)
    export.add_argument("--format", choices=FORMATS, default="json")
    export.add_argument("--output", type=Path, metavar="FILE", help="a file that does not exist; else on stdout")
    tag = action("tag", _tag, "give a set a tag, or take it off")
    tag.add_argument("set", help=_SET_HELP)
    tag.add_argument("tag", choices=[one.value for one in Tag if one.by_hand])
    tag.add_argument("--off", action="store_true", help="take it off")
    plate = action("nameplate", _nameplate, "the serial number on a device's plate; typed twice to keep it")
    plate.add_argument("device", metavar="SLUG")
    plate.add_argument("serial", nargs="*", help="the serial number, and once more")


async def with_library(arguments: argparse.Namespace, output: Output, run: Run) -> int:
    """Run one action on the library of the data folder. Raises StoreInUseError while a server has it, StoreError."""
    async with opened(arguments) as (store, audit):
        library = Library(store, audit, time.time_ns)
        folder = SetFolder(arguments.settings.sets, store, library)
        return await run(arguments, output, library, folder)


async def _list(arguments: argparse.Namespace, output: Output, library: Library, folder: SetFolder) -> int:
    looked = await folder.look(budget_s=60.0)
    for bad in looked.bad:
        output.error(SetFileError(file=bad.name, line=bad.line, reason=bad.reason))
    tag = None if arguments.tag is None else Tag(arguments.tag)
    tags = await library.tags()
    rows = [
        (one, [entry.tag for entry in tags.get(one.id, [])])
        for one in await library.records(Filter(arguments.turbine, arguments.device, None, tag))
    ]
    if output.as_json:
        output.result([record_dict(one, given) for one, given in rows], "")
        return 0
    head = ("ID", "HASH", "TIME", "DEVICE", "UNREAD", "TAGS", "REASON")
    output.table(
        head,
        [
            (
                one.id,
                one.hash[:12],
                one.origin.time,
                one.origin.device,
                str(one.unread or "–"),
                ", ".join(output.texts(tag.text_key) for tag in given) or "–",
                one.origin.reason or "–",
            )
            for one, given in rows
        ],
    )
    return 0


async def _show(arguments: argparse.Namespace, output: Output, library: Library, _folder: SetFolder) -> int:
    record = await library.record(arguments.set)
    found = await library.set_of(record)
    recording, seen = await library.seen(record)
    if output.as_json:
        output.raw(dump_set(found) if not seen else _with_seen(found, recording, seen))
        return 0
    tags = (await library.tags()).get(record.id, [])
    details = {"device": found.origin.device, "time": found.origin.time, "person": found.origin.person or "–"}
    output.line(output.texts("cli.sets.head", **details, hash=record.hash, reason=found.origin.reason or "–"))
    for entry in tags:
        output.line(output.texts("cli.sets.tagged", tag=output.texts(entry.tag.text_key), person=entry.person))
    description = known().get(found.description_id)
    rows = [(key, _line(found, key, description)) for key in sorted(found.values)]
    if seen:
        marked = [(*row, mark(seen[key]) if key in seen else "") for key, row in rows]
        output.table((*_HEAD, "SEEN"), marked)
        tell_legend(output, recording)
    else:
        output.table(_HEAD, [row for _key, row in rows])
    for address, why in found.unread.items():
        output.say("cli.sets.unread", address=address.short, why=why)
    return 0


def _with_seen(found: ParameterSet, recording: str, seen: Mapping[Address, Seen]) -> str:
    """The set and how its values were seen: for reading, no set file; ``export`` writes that."""
    looks = {str(address): look.as_json() for address, look in seen.items()}
    content = json.loads(dump_set(found)) | {"recording": recording, "seen": looks}
    return json.dumps(content, sort_keys=True, indent=1, ensure_ascii=False) + "\n"


async def _import(arguments: argparse.Namespace, output: Output, library: Library, _folder: SetFolder) -> int:
    """All of the files, or none."""
    taking = Taking(known(), _origin(arguments), arguments.description, arguments.as_values)
    read = [(path, read_set_file(_bytes(path), path.name, taking)) for path in arguments.file]
    for path, imported in read:
        record = await library.take(imported, path.name, arguments.settings.person)
        for unknown in imported.unknown:
            details = {"address": unknown.address.short, "name": unknown.name, "line": unknown.line}
            output.say("cli.sets.unknown", **details, reason_key=unknown.text_key)
        text = output.texts("cli.sets.taken", device=record.origin.device, values=record.values, id=record.id)
        output.result(record_dict(record, []), text)
        tell_ahead(output, library, record)
    return 0


async def _export(arguments: argparse.Namespace, output: Output, library: Library, _folder: SetFolder) -> int:
    text = _file(await library.get(arguments.set), arguments.format)
    if arguments.output is None:
        output.raw(text)
        return 0
    try:
        with arguments.output.open("x", encoding="utf-8", newline="") as file:
            file.write(text)
    except OSError as error:
        raise UsageError(reason=f"{arguments.output}: {error.strerror}") from error
    output.result({"file": str(arguments.output)}, output.texts("cli.sets.exported", file=arguments.output))
    return 0


async def _tag(arguments: argparse.Namespace, output: Output, library: Library, _folder: SetFolder) -> int:
    tag = Tag(arguments.tag)
    record = await library.tag(arguments.set, tag, arguments.settings.person, not arguments.off)
    given = [entry.tag for entry in (await library.tags()).get(record.id, [])]
    key = "cli.sets.tag_off" if arguments.off else "cli.sets.tag_on"
    output.result(
        record_dict(record, given), output.texts(key, device=record.origin.device, tag=output.texts(tag.text_key))
    )
    return 0


async def _nameplate(arguments: argparse.Namespace, output: Output, library: Library, _folder: SetFolder) -> int:
    typed = arguments.serial
    if len(typed) not in (0, 2):
        raise UsageError(reason="type the serial number twice")
    if typed:
        await library.set_nameplate(arguments.device, typed[0], typed[1], arguments.settings.person)
    plate = library.nameplate(arguments.device)
    serial = None if plate is None else plate.serial
    output.result(
        {"device": arguments.device, "serial": serial},
        output.texts("cli.sets.nameplate", device=arguments.device, serial=serial or "–"),
    )
    return 0


def tell_ahead(output: Output, library: Library, record: SetRecord) -> None:
    """A set whose time cannot be is kept, and this is said."""
    if library.is_ahead(record):
        output.say("cli.sets.ahead", device=record.origin.device, time=record.origin.time)


def known() -> dict[str, Description]:
    """The descriptions that come along, by id."""
    return {name: load_builtin(name) for name in BUILTIN}


def _origin(arguments: argparse.Namespace) -> Origin | None:
    slug: str | None = arguments.device
    if slug is None:
        return None
    if slug.count("/") != 2:
        raise UsageError(reason=f"'{slug}' is no device: turbine/station/device")
    time_text = iso_time(time.time_ns() // SECOND_NS * SECOND_NS)
    person, tool = arguments.settings.person, f"hubside {__version__}"
    return Origin(slug.partition("/")[0], slug, arguments.node, time_text, person, arguments.reason, tool)


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise SetFileError(file=str(path), line=1, reason=error.strerror or str(error)) from error


def _file(found: ParameterSet, kind: str) -> str:
    description = known().get(found.description_id)
    if kind == "json":
        return dump_set(found)
    if kind == "csv":
        return dump_csv(found, description)
    if description is None:
        raise UsageError(reason=f"nothing describes {found.description_id}, so there is no DCF of it")
    return dump_dcf(found, description)


def _line(found: ParameterSet, address: Any, description: Description | None) -> tuple[str, str, str, str]:
    raw = found.values[address]
    entry = None if description is None else description.entries.get(address)
    if entry is None:
        return address.short, "–", str(raw), ""
    lookup = found.values.get
    return address.short, entry.title, show(entry, raw, lookup), quantity_of(entry, lookup).unit


def record_dict(record: SetRecord, tags: list[Tag]) -> dict[str, Any]:
    """A record for machines."""
    origin = record.origin
    return {
        "id": record.id,
        "hash": record.hash,
        "device": origin.device,
        "time": origin.time,
        "person": origin.person,
        "reason": origin.reason,
        "work_order": origin.work_order,
        "description": f"{record.description_id} {record.description_version}",
        "source": record.source.value,
        "values": record.values,
        "unread": record.unread,
        "tags": [tag.value for tag in tags],
    }
