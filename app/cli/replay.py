"""``hubside replay``: the page on recordings, wherever they lie. Nothing is connected; a turbine may be chosen there.

Exit codes: 0 where it was served, 2 where a file cannot be replayed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from app.cli.arguments import add_port
from app.cli.output import Output
from app.errors import RecordingError, UsageError


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("replay", help="serve the page on recordings: time line, plots, 3D, what came first")
    parser.add_argument("recording", nargs="+", type=Path, help="MCAP files; the first one is opened")
    add_port(parser)
    parser.set_defaults(
        run=_replay, site=None, can=None, modbus=None, profibus=None, turbine=None, eds=[], consent=False, listen_s=0.5
    )
    parser.set_defaults(no_record=True, listen=None, tls_cert=None, tls_key=None, host=[], instructor=None)


def _replay(arguments: argparse.Namespace, output: Output) -> int:
    """Serve until interrupted. Raises RecordingError, UsageError where a file cannot be replayed."""
    from app.cli.serve import serve_turbine

    for path in arguments.recording:
        _check(path)
    arguments.recordings = tuple(path.resolve() for path in arguments.recording)
    if len({path.name for path in arguments.recordings}) < len(arguments.recordings):
        raise UsageError(reason="two of the files have the same name: rename one")
    return serve_turbine(arguments, output)


def _check(path: Path) -> None:
    from app.recording.reader import open_recording

    if path.suffix != ".mcap":
        raise UsageError(reason=f"{path} is no MCAP file: turn it into one with 'hubside import'")
    with open_recording(path) as recording:
        if recording.span_ns is None:
            raise RecordingError(file=path.name, offset=0, reason="no frames in it")
