"""``hubside demo``: twins of three blades, a servo drive and two cylinders, and the page on them.

The twins are processes of their own. Those of the cylinders are there where the extra ``profibus`` is.

Imports little: the libraries of the page are loaded while the twins start.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from app.cli.arguments import add_port, milliseconds
from app.cli.output import Output
from app.errors import BusOpenError
from app.settings import TWIN_PORT

END_S: Final = 20.0
EXTRA_PACKAGE: Final = "pyprofibus"
"""What the extra brings."""
SERVO_PORT: Final = 1502
"""Usual of the twin of the servo drive."""


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("demo", help="twins of three blades, a servo drive and two cylinders, and the page")
    parser.add_argument("--turnaround-ms", type=milliseconds, default=1.0, help="time a twin takes to answer")
    add_port(parser)
    parser.set_defaults(
        run=run,
        consent=False,
        listen_s=0.5,
        eds=[],
        turbine=None,
        can=None,
        modbus=None,
        profibus=None,
        no_record=False,
    )
    parser.set_defaults(listen=None, tls_cert=None, tls_key=None, host=[])


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Start the twins, then serve their page until interrupted. Raises BusOpenError where they do not start."""
    data = arguments.settings.data
    with contextlib.ExitStack() as running:
        blades = _Twins(running, "socketcand:127.0.0.1:{port}", TWIN_PORT, _blades(arguments, data / "twins"))
        servo = _Twins(running, "127.0.0.1:{port}", SERVO_PORT, _servo(data / "twins" / "pd4e"))
        line = _Twins(running, "", 0, _cylinders(data / "twins" / "ed2")) if _speaks_profibus() else None
        from app.cli.control_client import ControlClient
        from app.cli.demo_site import FIRST, demo_site
        from app.cli.serve import serve_turbine

        started, at = blades.started(), str(servo.started()["address"])
        address, control = str(started["address"]), started["control"]
        path = None if line is None else str(line.started()["path"])
        arguments.site, arguments.turbine = demo_site(data, address, at, path), FIRST
        arguments.instructor = ControlClient(control["address"], control["token"], address)
        return serve_turbine(arguments, output)


def _blades(arguments: argparse.Namespace, state: Path) -> list[str]:
    state.mkdir(parents=True, exist_ok=True)
    return ["oat", "--state", str(state), "--turnaround-ms", str(arguments.turnaround_ms), "--can"]


def _servo(state: Path) -> list[str]:
    state.mkdir(parents=True, exist_ok=True)
    return ["pd4e", "--state", str(state), "--modbus"]


def _cylinders(state: Path) -> list[str]:
    state.mkdir(parents=True, exist_ok=True)
    return ["ed2", "--state", str(state)]


def _speaks_profibus() -> bool:
    """Whether there is somebody to speak with the cylinders, and a pseudo terminal where they could answer."""
    return find_spec(EXTRA_PACKAGE) is not None and find_spec("termios") is not None


class _Twins:
    """One process of twins, from now until ``running`` ends; on any port where the usual one is taken.

    ``place`` is empty where they find one by themselves.
    """

    def __init__(self, running: contextlib.ExitStack, place: str, port: int, what: list[str]) -> None:
        self._running = running
        self._place = place
        self._what = what
        self._process = self._start(port)

    def started(self) -> dict[str, Any]:
        """What they say as soon as they answer: where, and how they are told. Raises BusOpenError."""
        said = _first_line(self._process)
        if said is None:  # the usual port is taken
            self._process = self._start(0)
            said = _first_line(self._process)
        if said is None:
            raise BusOpenError(bus="twins", reason=_reason(self._process))
        return said

    def _start(self, port: int) -> subprocess.Popen[str]:
        place = [self._place.format(port=port)] if self._place else []
        return self._running.enter_context(_twins([*self._what, *place]))


@contextlib.contextmanager
def _twins(what: list[str]) -> Iterator[subprocess.Popen[str]]:
    """Twins as ``what`` names them, while the block runs."""
    command = [sys.executable, "-m", "app.cli", "twin", *what, "--json", "--while-stdin"]
    pipe = subprocess.PIPE
    # A group of its own: Ctrl-C is for us, and the twins stay until the recording is closed.
    alone: dict[str, Any] = {"start_new_session": True} if sys.platform != "win32" else {"creationflags": 0x200}
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, **alone) as process:
        try:
            yield process
        finally:
            process.terminate()
            process.wait(END_S)


def _first_line(twins: subprocess.Popen[str]) -> dict[str, Any] | None:
    """What the twins say at first; None where they ended instead."""
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
