"""``hubside export``: a recording in its archive form; ``hubside recover``: close what a crash left open."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from app.cli.output import Output
from app.errors import UsageError
from app.recording.pack import pack
from app.recording.recover import recover_all


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the commands."""
    export = commands.add_parser("export", help="write a recording in another form")
    export.add_argument("recording", type=Path)
    export.add_argument(
        "--pack", action="store_true", required=True, help="the archive form: small, no message indexes"
    )
    export.add_argument("--output", type=Path, help="the file to write; beside the recording where not given")
    export.set_defaults(run=_export)
    recover = commands.add_parser("recover", help="close recordings that a crash or a power cut left open")
    recover.add_argument("folder", nargs="?", type=Path, help="where to look; the data folder where not given")
    recover.set_defaults(run=_recover)


def _export(arguments: argparse.Namespace, output: Output) -> int:
    source: Path = arguments.recording
    target = arguments.output or source.with_name(f"{source.stem}.packed.mcap")
    if target.resolve() == source.resolve():
        raise UsageError(reason="a recording is never replaced: name another file")
    result = pack(source, target, lambda part: output.progress("cli.packing", percent=round(100 * part)))
    per_frame = f"{result.packed_bytes / result.messages:.1f}" if result.messages else "–"
    details = {"file": str(target), "frames": result.messages, "per_frame": per_frame, "damages": result.damages}
    sizes = {"before": f"{result.source_bytes / 1e6:.2f} MB", "after": f"{result.packed_bytes / 1e6:.2f} MB"}
    output.result(details | sizes, output.texts("cli.packed", **details, **sizes))
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
