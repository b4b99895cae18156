"""``hubside demo``: twins of three blades in a process of their own, and the page on them.

Imports little: the libraries of the page are loaded while the twins start.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from app.cli.arguments import add_port, milliseconds
from app.cli.output import Output
from app.errors import BusOpenError
from app.model.bundled import bundled_folder
from app.settings import TWIN_PORT

END_S: Final = 20.0
_TWINS_AT: Final = re.compile(r'(\[turbine\.wtg-07\.bus\.can0\][^\[]*?connection\s*=\s*)"[^"]*"')
"""Where the bus of the example turbine is connected to."""


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("demo", help="twins of three blades, and the page on them")
    parser.add_argument("--turnaround-ms", type=milliseconds, default=1.0, help="time a twin takes to answer")
    add_port(parser)
    parser.set_defaults(run=run, consent=False, listen_s=0.5, eds=[], turbine=None, can=None, no_record=False)
    parser.set_defaults(listen=None, tls_cert=None, tls_key=None, host=[])


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Start the twins, then serve their page until interrupted. Raises BusOpenError where they do not start."""
    data = arguments.settings.data
    with contextlib.ExitStack() as running:
        twins = running.enter_context(_twins(arguments, data / "twins", TWIN_PORT))
        from app.cli.control_client import ControlClient
        from app.cli.serve import serve_turbine

        started = _started(twins)
        if started is None:  # the usual port is taken
            running.close()
            twins = running.enter_context(_twins(arguments, data / "twins", 0))
            started = _started(twins)
            if started is None:
                raise BusOpenError(bus="twins", reason=_reason(twins))
        address, control = str(started["address"]), started["control"]
        arguments.site = _site(data, address)
        arguments.instructor = ControlClient(control["address"], control["token"], address)
        return serve_turbine(arguments, output)


@contextlib.contextmanager
def _twins(arguments: argparse.Namespace, state: Path, port: int) -> Iterator[subprocess.Popen[str]]:
    """Twins on ``port`` (0: any) while the block runs."""
    state.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "app.cli", "twin", "oat", "--json", "--while-stdin", "--state", str(state)]
    command += ["--can", f"socketcand:127.0.0.1:{port}", "--turnaround-ms", str(arguments.turnaround_ms)]
    pipe = subprocess.PIPE
    # A group of its own: Ctrl-C is for us, and the twins stay until the recording is closed.
    alone: dict[str, Any] = {"start_new_session": True} if sys.platform != "win32" else {"creationflags": 0x200}
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, **alone) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.wait(END_S)


def _started(twins: subprocess.Popen[str]) -> dict[str, Any] | None:
    """What the twins say as soon as they answer: where, and how they are told; None where they ended instead."""
    line = twins.stdout.readline() if twins.stdout is not None else ""
    started: dict[str, Any] | None = json.loads(line) if line else None
    return started


def _reason(twins: subprocess.Popen[str]) -> str:
    """Why the twins ended: the text of the error that they told as JSON, or the last line that they said."""
    said = twins.stderr.read() if twins.stderr is not None else ""
    last = said.strip().splitlines()[-1:] or ["the twins did not start"]
    try:
        return str(json.loads(last[0])["text"])
    except (ValueError, KeyError, TypeError):
        return last[0]


def _site(folder: Path, address: str) -> Path:
    """The demo's site file in ``folder``: its twins at ``address``, and whatever was added to it in the page."""
    path = folder / "demo-site.toml"
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    if not _TWINS_AT.search(text):
        text = (bundled_folder("docs/sites", "sites") / "example.toml").read_text(encoding="utf-8")
    path.write_text(_TWINS_AT.sub(rf'\1"{address}"', text), encoding="utf-8")
    return path
