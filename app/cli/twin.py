"""``hubside twin``: digital twins of drives that answer on a simulated bus, as a process of their own."""

from __future__ import annotations

import argparse
import signal
import sys
import threading
from pathlib import Path

from app.cli.arguments import bitrate, milliseconds
from app.cli.output import Output
from app.cli.runtime import spare_collector
from app.errors import BusOpenError, UsageError
from app.model.address import is_decimal
from app.model.description_file import load_builtin
from app.twins.line import CanLine
from app.twins.line_thread import LineThread
from app.twins.rotor import Rotor
from app.twins.socketcand_server import SocketcandServer
from app.twins.surroundings import Surroundings
from app.twins.turbine import build_turbine

SWITCH_INTERVAL_S = 0.0005
"""Threads of this process hand over faster than Python's 5 ms, else the bus would be late by as much."""
ROTOR_SEED = 7
"""Of the wind: every run has the same."""


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("twin", help="digital twins that answer on a simulated bus")
    kinds = parser.add_subparsers(dest="kind", required=True)
    oat = kinds.add_parser("oat", help="three blades, a PMM and a PMC each, on one CAN bus")
    oat.add_argument("--can", default="socketcand:127.0.0.1:29536", metavar="socketcand:HOST:PORT")
    oat.add_argument("--state", type=Path, metavar="DIR", help="where saved parameters are kept")
    oat.add_argument("--bitrate", type=bitrate, default=500_000)
    oat.add_argument("--turnaround-ms", type=milliseconds, default=1.0, help="time a drive takes to answer")
    oat.add_argument("--while-stdin", action="store_true", help="end when standard input ends, as the caller has")
    oat.add_argument("--factory", action="store_true", help="allow writing of r(w) objects")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Serve until interrupted."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    spare_collector()
    host, port = _address(arguments.can)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    if arguments.while_stdin:
        threading.Thread(target=_end_with_stdin, args=(stop,), daemon=True).start()
    line = CanLine(arguments.bitrate)
    turbine = build_turbine(
        line,
        load_builtin("oat-pmm"),
        load_builtin("oat-pmc"),
        state_dir=arguments.state,
        turnaround_ns=round(arguments.turnaround_ms * 1e6),
        factory=arguments.factory,
    )
    for problem in turbine.problems:
        output.say("cli.twin_problem", reason=problem)
    turbine.power_on(line.now_ns)
    surroundings = Surroundings(line, Rotor(seed=ROTOR_SEED), [blade.axis for blade in turbine.blades])
    surroundings.start(line.now_ns)
    thread = LineThread(line)
    try:
        server = SocketcandServer(thread, host, port)
    except OSError as error:
        raise BusOpenError(bus=arguments.can, reason=error.strerror or str(error)) from error
    with thread, server:
        _announce(f"socketcand:{host}:{server.port}", len(turbine.devices), arguments.bitrate, output)
        stop.wait()
    surroundings.stop()
    turbine.power_off()
    return 0


def _end_with_stdin(stop: threading.Event) -> None:
    """A caller that was killed closes our input; twins without a caller would keep its port for ever."""
    sys.stdin.read()
    stop.set()


def _announce(address: str, devices: int, bitrate: int, output: Output) -> None:
    if output.as_json:
        output.result({"address": address, "devices": devices, "bitrate": bitrate}, "")
    else:
        output.say("cli.twin_ready", count=devices, address=address, bitrate=bitrate)
        output.say("cli.stop_hint")


def _address(text: str) -> tuple[str, int]:
    interface, _, place = text.partition(":")
    host, _, port = place.rpartition(":")
    if interface != "socketcand" or not host or not is_decimal(port) or int(port) > 65535:
        raise UsageError(reason=f"'{text}': twins are served as socketcand:HOST:PORT")
    return host, int(port)
