"""``hubside export``: a recording in another form; ``hubside recover``: close what a crash left open."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from app.cli.moments import add_range, chosen_range
from app.cli.output import Output
from app.errors import UsageError
from app.recording.exchange.cut import CutOrder, cut
from app.recording.exchange.exporting import Choice, export, losses
from app.recording.exchange.formats import SUFFIXES, Format, Style
from app.recording.exchange.table import Shape, TableOrder, arrow, signals_named, write_table
from app.recording.pack import pack
from app.recording.reader import open_recording
from app.recording.recover import recover_all


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    parser = commands.add_parser("export", help="write a recording in another form")
    parser.add_argument("recording", type=Path)
    form = parser.add_mutually_exclusive_group(required=True)
    form.add_argument("--pack", action="store_true", help="the archive form: small, no message indexes")
    form.add_argument("--format", choices=[one.value for one in Format], help="a format that other tools read")
    form.add_argument("--parquet", action="store_true", help="decoded signals for notebooks and data tools")
    parser.add_argument("--output", type=Path, help="the file to write; beside the recording where not given")
    parser.add_argument(
        "--exact", action="store_true", help="nine decimals, directions, raw DLC: nothing lost, but fewer tools read it"
    )
    parser.add_argument("--losses", action="store_true", help="only tell what the format cannot hold, write nothing")
    parser.add_argument("--bus", action="append", help="only this bus; may be given several times")
    parser.add_argument("--wide", action="store_true", help="Parquet: a column for each --signal")
    parser.add_argument(
        "--signal", action="append", metavar="DEVICE:ADDRESS", help="Parquet: only this object, wtg-07/blade-1/pmc:6064"
    )
    add_range(parser)
    parser.set_defaults(run=_export)
    recover = commands.add_parser("recover", help="close recordings that a crash or a power cut left open")
    recover.add_argument("folder", nargs="?", type=Path, help="where to look; the data folder where not given")
    recover.set_defaults(run=_recover)


def _export(arguments: argparse.Namespace, output: Output) -> int:
    if arguments.pack:
        return _pack(arguments, output)
    if arguments.parquet:
        return _parquet(arguments, output)
    form = Format(arguments.format)
    if form is Format.MCAP:
        return _plain(arguments, output)
    return _foreign(arguments, output, form)


def _target(arguments: argparse.Namespace, suffix: str) -> Path:
    source: Path = arguments.recording
    target: Path = arguments.output or source.with_name(f"{source.stem}{suffix}")
    if target.resolve() == source.resolve():
        raise UsageError(reason="a recording is never replaced: name another file")
    return target


def _pack(arguments: argparse.Namespace, output: Output) -> int:
    source, target = arguments.recording, _target(arguments, ".packed.mcap")
    result = pack(source, target, lambda part: output.progress("cli.packing", percent=round(100 * part)))
    per_frame = f"{result.packed_bytes / result.messages:.1f}" if result.messages else "–"
    details = {"file": str(target), "frames": result.messages, "per_frame": per_frame, "damages": result.damages}
    sizes = {"before": f"{result.source_bytes / 1e6:.2f} MB", "after": f"{result.packed_bytes / 1e6:.2f} MB"}
    output.result(details | sizes, output.texts("cli.packed", **details, **sizes))
    return 0


def _foreign(arguments: argparse.Namespace, output: Output, form: Format) -> int:
    with open_recording(arguments.recording) as recording:
        start_ns, end_ns = chosen_range(arguments, recording)
        style = Style.EXACT if arguments.exact else Style.COMMON
        choice = Choice(form, style, arguments.bus, start_ns, end_ns)
        told = losses(recording, choice)
        for loss in told:
            output.say(f"exchange.loss.{loss.what.value}", things=loss.things, format=form.value)
        lost = {loss.what.value: loss.things for loss in told}
        if arguments.losses:
            output.result({"losses": lost}, output.texts("cli.losses_told", count=len(told)))
            return 0
        target = _target(arguments, SUFFIXES[form])
        done = export(recording, target, choice, lambda count: output.progress("cli.exporting", frames=count))
    size = f"{done.size_bytes / 1e6:.2f} MB"
    details = {"file": str(target), "frames": done.frames, "size": size, "losses": lost}
    output.result(details | {"channels": list(done.channels)}, output.texts("cli.exported", **details))
    return 0


def _plain(arguments: argparse.Namespace, output: Output) -> int:
    with open_recording(arguments.recording) as recording:
        start_ns, end_ns = chosen_range(arguments, recording)
    target = _target(arguments, ".plain.mcap")
    order = CutOrder(start_ns, end_ns, arguments.bus)
    done = cut(
        arguments.recording, target, order, lambda part: output.progress("cli.packing", percent=round(100 * part))
    )
    details = {"file": str(target), "frames": done.frames, "size": f"{done.size_bytes / 1e6:.2f} MB"}
    output.result(details, output.texts("cli.exported", **details))
    return 0


def _parquet(arguments: argparse.Namespace, output: Output) -> int:
    arrow()
    with open_recording(arguments.recording) as recording:
        start_ns, end_ns = chosen_range(arguments, recording)
        nodes = recording.metadata.get("nodes", {})
        signals = None if arguments.signal is None else signals_named(arguments.signal, nodes)
        order = TableOrder(Shape.WIDE if arguments.wide else Shape.LONG, signals, start_ns, end_ns)
        target = _target(arguments, ".parquet")
        done = write_table(
            recording, target, order, lambda part: output.progress("cli.packing", percent=round(100 * part))
        )
    size = f"{done.size_bytes / 1e6:.2f} MB"
    details = {"file": str(target), "rows": done.rows, "signals": done.signals, "size": size}
    output.result(details, output.texts("cli.tabled", **details))
    return 0


def _recover(arguments: argparse.Namespace, output: Output) -> int:
    folder: Path = arguments.folder or arguments.settings.recordings
    if not folder.is_dir():
        raise UsageError(reason=f"{folder} is no folder")
    recoveries = recover_all(folder, time.time_ns())
    if not recoveries:
        output.say("cli.nothing_to_recover", folder=folder)
    for recovery in recoveries:
        details = {"file": str(recovery.file), "frames": recovery.frames, "dropped": recovery.lost_bytes}
        output.result(details, output.texts("cli.recovered", **details))
    return 0
