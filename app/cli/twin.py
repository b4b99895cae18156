"""``hubside twin``: digital twins of drives that answer on a simulated bus, as a process of their own."""

from __future__ import annotations

import argparse
import secrets
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from app.cli import twin_ed2, twin_fault, twin_pd4e, twin_record
from app.cli.arguments import bitrate, milliseconds, seed, wind
from app.cli.output import Output
from app.cli.runtime import spare_collector, stop_event
from app.errors import BusOpenError, UsageError
from app.model.address import is_decimal
from app.model.bundled import bundled_folder
from app.model.description_file import load_builtin
from app.model.fault import FaultOrder, timed_order
from app.twins.control_server import ControlServer
from app.twins.faults import Instructor
from app.twins.line import CanLine
from app.twins.line_thread import LineThread
from app.twins.rotor import Rotor
from app.twins.scenario import Scenario, load_scenario
from app.twins.socketcand_server import SocketcandServer
from app.twins.surroundings import Surroundings
from app.twins.turbine import START_ANGLE_DEG, Settings, Turbine

SWITCH_INTERVAL_S = 0.0005
"""Threads of this process hand over faster than Python's 5 ms, else the bus would be late by as much."""
DEFAULT_SEED = 7
"""Of the wind and of faults: every run has the same."""
TOKEN_BYTES = 16


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
    oat.add_argument("--seed", type=seed, help=f"of wind and faults; default: the scenario's, or {DEFAULT_SEED}")
    oat.add_argument("--wind", type=wind, metavar="M/S", help="mean wind speed")
    oat.add_argument("--scenario", type=Path, metavar="FILE", help="play a scenario from the start")
    oat.add_argument("--end", action="store_true", help="end with the scenario; else the twins stay")
    oat.add_argument("--scenarios", type=Path, metavar="DIR", help="scenarios that can be played by name")
    oat.add_argument(
        "--fault", action="append", default=[], metavar="KIND@5s,blade=2,...", help="put a fault in; may be repeated"
    )
    oat.set_defaults(run=run)
    twin_pd4e.add_parser(kinds)
    twin_ed2.add_parser(kinds)
    twin_fault.add_parser(kinds)
    twin_record.add_parser(kinds)


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Serve until interrupted."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    spare_collector()
    host, port = _address(arguments.can)
    stop = stop_event(while_stdin=arguments.while_stdin)
    twins = _build(arguments)
    for problem in twins.turbine.problems:
        output.say("cli.twin_problem", reason=problem)
    line, turbine = twins.line, twins.turbine
    turbine.power_on(line.now_ns)
    twins.surroundings.start(line.now_ns)
    _begin(twins, arguments, stop.set)
    thread = LineThread(line)
    token = secrets.token_hex(TOKEN_BYTES)  # no leading dash
    folder = arguments.scenarios or bundled_folder("recordings/scenarios", "recordings/scenarios")
    control = ControlServer(thread, twins.instructor, token, folder)
    for problem in control.problems:
        output.say("cli.scenario_problem", reason=problem)
    try:
        server = SocketcandServer(thread, host, port)
    except OSError as error:
        raise BusOpenError(bus=arguments.can, reason=error.strerror or str(error)) from error
    with thread, server, control:
        told = _Told(f"socketcand:{host}:{server.port}", len(turbine.devices), arguments.bitrate)
        _announce(told, control.address, token, output)
        stop.wait()
    twins.instructor.stop()
    twins.surroundings.stop()
    turbine.power_off()
    return 0


@dataclass(frozen=True, slots=True)
class _Twins:
    """A turbine that is built, and what is to happen to it."""

    line: CanLine
    turbine: Turbine
    surroundings: Surroundings
    instructor: Instructor
    scenario: Scenario | None


@dataclass(frozen=True, slots=True)
class _Told:
    """What is told at the start."""

    address: str
    devices: int
    bitrate: int


def _build(arguments: argparse.Namespace) -> _Twins:
    """A turbine as the arguments, and before them the scenario, want it. Raises UsageError."""
    scenario = None if arguments.scenario is None else load_scenario(arguments.scenario)
    if arguments.end and scenario is None:
        raise UsageError(reason="--end needs a --scenario to end with")
    chosen = scenario.seed if scenario is not None and arguments.seed is None else arguments.seed
    number = DEFAULT_SEED if chosen is None else chosen
    angle_deg = None if scenario is None else scenario.start.angle_deg
    line = CanLine(arguments.bitrate)
    settings = Settings(
        state_dir=arguments.state,
        turnaround_ns=round(arguments.turnaround_ms * 1e6),
        factory=arguments.factory,
        angle_deg=START_ANGLE_DEG if angle_deg is None else angle_deg,
    )
    turbine = Turbine(line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), settings)
    surroundings = Surroundings(line, Rotor(seed=number), [blade.axis for blade in turbine.blades])
    if arguments.wind is not None:
        surroundings.set_wind(arguments.wind)
    return _Twins(line, turbine, surroundings, Instructor(turbine, line, surroundings, number), scenario)


def _begin(twins: _Twins, arguments: argparse.Namespace, stop: Callable[[], None]) -> None:
    """Play the scenario, and have the faults of the command line happen at their times. Raises UsageError."""
    line, instructor = twins.line, twins.instructor
    if twins.scenario is not None:
        instructor.play(twins.scenario)
        if arguments.end:
            line.call_at(line.now_ns + twins.scenario.duration_ns, lambda _t_ns: stop())
    for text in arguments.fault:
        at_s, order = timed_order(text)
        line.call_at(line.now_ns + round(at_s * 1e9), _injection(instructor, instructor.check(order)))


def _injection(instructor: Instructor, order: FaultOrder) -> Callable[[int], None]:
    def inject(_t_ns: int) -> None:
        instructor.inject(order)

    return inject


def _announce(told: _Told, control: str, token: str, output: Output) -> None:
    if output.as_json:
        access = {"address": control, "token": token}
        line = {"address": told.address, "devices": told.devices, "bitrate": told.bitrate, "control": access}
        output.result(line, "")
    else:
        output.say("cli.twin_ready", count=told.devices, address=told.address, bitrate=told.bitrate)
        output.say("cli.twin_control", address=control, token=token)
        output.say("cli.stop_hint")


def _address(text: str) -> tuple[str, int]:
    interface, _, place = text.partition(":")
    host, _, port = place.rpartition(":")
    if interface != "socketcand" or not host or not is_decimal(port) or int(port) > 65535:
        raise UsageError(reason=f"'{text}': twins are served as socketcand:HOST:PORT")
    return host, int(port)
