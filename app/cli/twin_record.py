"""``hubside twin record``: plays scenarios in bulk and records them, faster than real time."""

from __future__ import annotations

import argparse
from pathlib import Path

from app.cli.output import Output
from app.errors import UsageError


def add_parser(kinds: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = kinds.add_parser("record", help="play scenarios in bulk and record them")
    parser.add_argument("scenarios", type=Path, nargs="+", metavar="SCENARIO.toml")
    parser.add_argument(
        "--out", type=Path, metavar="FILE_OR_DIR", help="where to; beside the scenario where not given, as .mcap"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Record one after the other. Raises UsageError and RecordingError."""
    from app.cli.record_scenario import record_scenario

    out: Path | None = arguments.out
    if out is not None and len(arguments.scenarios) > 1 and not out.is_dir():
        raise UsageError(reason=f"{out} is no folder, and there are several scenarios")
    for path in arguments.scenarios:
        made = record_scenario(path, _target(path, out))
        size = f"{made.size_bytes / 1e6:.2f} MB"
        details = {"file": str(made.file), "frames": made.frames, "seconds": made.seconds, "size": size}
        output.result(details, output.texts("cli.scenario_recorded", **details))
    return 0


def _target(scenario: Path, out: Path | None) -> Path:
    name = f"{scenario.stem}.mcap"
    if out is None:
        return scenario.with_name(name)
    return out / name if out.is_dir() else out
