"""``hubside import``, ``cut``, ``merge`` and ``anonymise``: recordings made of other files."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app.cli.arguments import bitrate
from app.cli.index import made_index
from app.cli.moments import add_range, chosen_range, date_ns
from app.cli.output import Output
from app.cli.targets import site_turbine
from app.errors import UsageError
from app.model.address import is_decimal, parse_address
from app.model.description_file import BUILTIN
from app.recording.cdr import NS
from app.recording.exchange.anonymise import AnonymiseOrder, anonymise
from app.recording.exchange.cut import CutOrder, cut
from app.recording.exchange.formats import IMPORTED, Format
from app.recording.exchange.importing import Imported, ImportOrder, import_file
from app.recording.exchange.merge import MergeInput, merge
from app.recording.reader import open_recording
from app.service.exchange import remarks_of

MAX_NODE = 127


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    _add_import(commands)
    parser = commands.add_parser("cut", help="cut a time out of a recording")
    parser.add_argument("recording", type=Path)
    add_range(parser)
    parser.add_argument("--bus", action="append", help="only this bus; may be given several times")
    parser.add_argument("--output", type=Path, help="the file to write; beside the recording where not given")
    parser.set_defaults(run=_cut)
    parser = commands.add_parser("merge", help="merge recordings by time: parts of one, or several buses")
    parser.add_argument("recording", type=Path, nargs="+")
    parser.add_argument("--output", type=Path, required=True, help="the file to write")
    parser.add_argument(
        "--offset-s", action="append", default=[], metavar="N=SECONDS", help="add to the times of the Nth file"
    )
    parser.add_argument(
        "--rename", action="append", default=[], metavar="N:OLD=NEW", help="another name for a bus of the Nth file"
    )
    parser.set_defaults(run=_merge)
    parser = commands.add_parser("anonymise", help="a copy that does not tell whose recording it is")
    parser.add_argument("recording", type=Path)
    parser.add_argument("--output", type=Path, required=True, help="the file to write; its name is kept as it is")
    parser.add_argument("--hide-times", action="store_true", help="let it begin on 1 January 2000")
    parser.add_argument(
        "--object", action="append", default=[], metavar="ADDRESS", help="hide this object too, on every node"
    )
    parser.add_argument("--word", action="append", default=[], help="refuse the copy where this word is still in it")
    parser.set_defaults(run=_anonymise)


def _add_import(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    parser = commands.add_parser("import", help="make recordings of files of other tools")
    parser.add_argument("file", type=Path, nargs="+")
    parser.add_argument("--format", choices=[one.value for one in IMPORTED], help="where the file does not tell")
    parser.add_argument("--site", type=Path, help="site file that names the devices on the buses")
    parser.add_argument("--turbine", help="which turbine it is; the import's name where there is no site file")
    parser.add_argument(
        "--node", action="append", default=[], metavar="BUS/NODE=DESCRIPTION:SLUG",
        help="what a node is: can0/11=oat-pmc:wtg-07/blade-1/pmc",
    )  # fmt: skip
    parser.add_argument("--bitrate", action="append", default=[], metavar="BUS=RATE", help="bit/s of a bus")
    parser.add_argument("--rename", action="append", default=[], metavar="OLD=NEW", help="another name for a bus")
    parser.add_argument("--start", metavar="TIME", help="when the first frame came, where the file is wrong or silent")
    parser.add_argument("--lenient", action="store_true", help="leave bad lines out and count them")
    parser.add_argument("--output", type=Path, metavar="DIR", help="the folder; the data folder where not given")
    parser.set_defaults(run=_import)


def _import(arguments: argparse.Namespace, output: Output) -> int:
    order = _import_order(arguments)
    folder: Path = arguments.output or arguments.settings.recordings
    for path in arguments.file:
        found = import_file(path, folder, order, lambda count: output.progress("cli.importing", frames=count))
        _tell_import(output, path, found)
        for part in found.taped.parts:
            made_index(part, arguments.settings.data / "indexes", output).close()
    return 0


def _import_order(arguments: argparse.Namespace) -> ImportOrder:
    turbine = site_turbine(arguments)
    nodes, rates = {}, {}
    if turbine is not None:
        nodes = {f"{one.bus}/{one.node}": f"{one.slug} {one.description_id}" for one in turbine.devices}
        rates = {bus.name: bus.bitrate for bus in turbine.buses if bus.bitrate}
    nodes |= dict(_node(text) for text in arguments.node)
    rates |= {bus: bitrate(rate) for bus, rate in _pairs(arguments.bitrate, "--bitrate")}
    slug = turbine.slug if turbine is not None else arguments.turbine
    named = next((what.partition("/")[0] for what in nodes.values()), "import")
    return ImportOrder(
        turbine=slug or named,
        who=arguments.settings.person,
        bit_rates=rates,
        nodes=nodes,
        buses=dict(_pairs(arguments.rename, "--rename")),
        form=None if arguments.format is None else Format(arguments.format),
        start_ns=None if arguments.start is None else date_ns(arguments.start),
        lenient=arguments.lenient,
    )


def _node(text: str) -> tuple[str, str]:
    key, equals, what = text.partition("=")
    bus, slash, number = key.rpartition("/")
    description, colon, slug = what.partition(":")
    if not (equals and slash and colon and bus and slug) or not is_decimal(number) or not 1 <= int(number) <= MAX_NODE:
        raise UsageError(reason=f"--node {text}: write it as can0/11=oat-pmc:wtg-07/blade-1/pmc")
    if description not in BUILTIN:
        raise UsageError(reason=f"no description '{description}' (there are: {', '.join(BUILTIN)})")
    return f"{bus}/{int(number)}", f"{slug} {description}"


def _pairs(texts: Sequence[str], option: str) -> list[tuple[str, str]]:
    found = []
    for text in texts:
        left, equals, right = text.partition("=")
        if not (equals and left and right):
            raise UsageError(reason=f"{option} {text}: write it as LEFT=RIGHT")
        found.append((left, right))
    return found


def _tell_import(output: Output, path: Path, found: Imported) -> None:
    notes = found.notes
    for key, count in remarks_of(found).items():
        output.say(f"exchange.import.{key}", file=path.name, count=count)
    for skipped in notes.skipped:
        output.say("exchange.import.skipped_line", line=skipped.line, text=skipped.text)
    files = [str(part) for part in found.taped.parts]
    details: dict[str, Any] = {"file": path.name, "frames": found.taped.frames, "parts": files}
    details |= {"buses": dict(found.buses), "wall": found.wall.value, "remarks": remarks_of(found)}
    output.result(
        details, output.texts("cli.imported", file=path.name, frames=found.taped.frames, into=", ".join(files))
    )


def _cut(arguments: argparse.Namespace, output: Output) -> int:
    source: Path = arguments.recording
    with open_recording(source) as recording:
        start_ns, end_ns = chosen_range(arguments, recording)
    target: Path = arguments.output or source.with_name(f"{source.stem}.cut.mcap")
    order = CutOrder(start_ns, end_ns, arguments.bus)
    done = cut(source, target, order, lambda part: output.progress("cli.packing", percent=round(100 * part)))
    details = {"file": str(target), "frames": done.frames, "size": f"{done.size_bytes / 1e6:.2f} MB"}
    output.result(details | {"events": done.events}, output.texts("cli.exported", **details))
    return 0


def _merge(arguments: argparse.Namespace, output: Output) -> int:
    paths: list[Path] = arguments.recording
    offsets = [0] * len(paths)
    for number, seconds in _pairs(arguments.offset_s, "--offset-s"):
        try:
            offsets[_place(number, paths)] = round(float(seconds) * NS)
        except (ValueError, OverflowError):
            raise UsageError(reason=f"--offset-s {number}={seconds}: that is no number of seconds") from None
    renames: list[dict[str, str]] = [{} for _ in paths]
    for left, new in _pairs(arguments.rename, "--rename"):
        number, _, old = left.partition(":")
        renames[_place(number, paths)][old] = new
    inputs = [MergeInput(*one) for one in zip(paths, offsets, renames, strict=True)]
    done = merge(inputs, arguments.output, lambda count: output.progress("cli.importing", frames=count))
    details = {"file": str(arguments.output), "frames": done.taped.frames}
    details |= {"duplicates": done.duplicates, "moved": done.moved}
    output.result(details, output.texts("cli.merged", **details))
    return 0


def _place(number: str, paths: Sequence[Path]) -> int:
    if not is_decimal(number) or not 1 <= int(number) <= len(paths):
        raise UsageError(reason=f"'{number}' is the number of no file here (1 to {len(paths)})")
    return int(number) - 1


def _anonymise(arguments: argparse.Namespace, output: Output) -> int:
    order = AnonymiseOrder(arguments.hide_times, [parse_address(text) for text in arguments.object], arguments.word)
    done = anonymise(
        arguments.recording, arguments.output, order, lambda count: output.progress("cli.importing", frames=count)
    )
    details: dict[str, Any] = {"file": str(arguments.output), "frames": done.taped.frames, "serials": done.serials}
    details |= {"details": done.left_out_details, "attachments": done.left_out_attachments}
    details["telegrams"] = done.left_out_frames
    output.result(details, output.texts("cli.anonymised", **details))
    return 0
