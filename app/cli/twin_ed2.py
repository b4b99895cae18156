"""``hubside twin ed2``: digital twins of Wandfluh ED2 controllers, served on PROFIBUS-DP, as a process of their own."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from app.cli.arguments import seed
from app.cli.output import Output
from app.cli.runtime import spare_collector, stop_event
from app.errors import BusOpenError, UsageError
from app.model.description_file import load_builtin
from app.model.slaves import ORDERS
from app.twins.ed2.delivered import ANALOG, INCREMENTAL, SSI_BINARY, SSI_GRAY
from app.twins.ed2.device import ADDRESS, OWN_BENCH, Ed2, Settings
from app.twins.ed2.faults import KINDS, FaultPlan, parse_order
from app.twins.ed2.scenario import load_scenario
from app.twins.ed2.segment import BAUD_RATES, Segment
from app.twins.paced_thread import PacedThread
from app.wire.profibus.fdl import MAX_ADDRESS
from app.wire.profibus.order_proof import read_order

if TYPE_CHECKING:
    from app.twins.ed2.pty_line import PtyLine

DESCRIPTION: Final = "wandfluh-ed2"
TRANSDUCERS: Final = {
    "incremental": INCREMENTAL,
    "ssi-binary": SSI_BINARY,
    "ssi-gray": SSI_GRAY,
    "analog": ANALOG,
}
BAUD: Final = 500_000
BENCHES: Final = {"free": OWN_BENCH, "linked": replace(OWN_BENCH, link_n_mm=500.0)}
"""What both cylinders move: each its own load, or one thing that gives way by a millimetre for 500 N."""


def add_parser(kinds: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = kinds.add_parser("ed2", help="controllers of hydraulic axes on PROFIBUS-DP, on a pseudo terminal")
    parser.add_argument("--baud", type=int, choices=BAUD_RATES, default=BAUD, help="bits a second of the line")
    parser.add_argument(
        "--address", type=int, action="append", metavar="N", help=f"address on the bus, may be repeated; {ADDRESS}"
    )
    parser.add_argument("--transducer", choices=sorted(TRANSDUCERS), default="ssi-gray", help="position sensors")
    parser.add_argument("--bench", choices=sorted(BENCHES), default="free", help="whether a link ties both cylinders")
    parser.add_argument(
        "--pzd-order", choices=sorted(ORDERS), default="high-high", help="which byte and which word come first"
    )
    parser.add_argument("--state", type=Path, metavar="DIR", help="where saved parameters are kept")
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="KIND@5s,axis=1,...",
        help=f"put a fault in, with axis=, slave=, value=, for_s= as it needs; may be repeated. {', '.join(KINDS)}",
    )
    parser.add_argument("--scenario", type=Path, metavar="FILE", help="faults and their times, from a file")
    parser.add_argument("--seed", type=seed, help="of faults that come by chance; default: the scenario's, or 0")
    parser.add_argument("--while-stdin", action="store_true", help="end when standard input ends, as the caller has")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Serve until interrupted. Raises UsageError, and BusOpenError where there is no pseudo terminal."""
    addresses = _addresses(arguments.address)
    scenario = None if arguments.scenario is None else load_scenario(arguments.scenario)
    orders = [*(() if scenario is None else scenario.orders), *map(parse_order, arguments.fault)]
    chance = arguments.seed if arguments.seed is not None else 0 if scenario is None else scenario.seed
    spare_collector()
    stop = stop_event(while_stdin=arguments.while_stdin)
    description = load_builtin(DESCRIPTION)
    devices = [Ed2(description, _settings(arguments, address)) for address in addresses]
    for device in devices:
        for problem in device.problems:
            output.say("cli.twin_problem", reason=problem)
    line = _line(Segment([device.slave for device in devices], arguments.baud), devices)
    plan = FaultPlan(devices, lambda fault: setattr(line, "fault", fault), chance)
    for order in orders:
        plan.add(order)
    line.add(plan)
    thread = PacedThread(line, name="ed2")
    line.serve(thread)
    with thread:
        _announce(line.path, addresses, arguments, output)
        stop.wait()
    line.close()
    return 0


def _line(segment: Segment, devices: list[Ed2]) -> PtyLine:
    try:
        # Not every system has pseudo terminals, and there the other commands must run.
        from app.twins.ed2.pty_line import PtyLine

        return PtyLine(segment, devices)
    except (ImportError, OSError) as error:
        raise BusOpenError(bus="pty", reason=str(error)) from error


def _addresses(given: list[int] | None) -> list[int]:
    addresses = given or [ADDRESS]
    for address in addresses:
        if not 0 <= address <= MAX_ADDRESS:
            raise UsageError(reason=f"{address}: addresses are 0 to {MAX_ADDRESS}")
    if len(set(addresses)) < len(addresses):
        raise UsageError(reason="an address is given twice")
    return addresses


def _settings(arguments: argparse.Namespace, address: int) -> Settings:
    return Settings(
        address=address,
        transducer=TRANSDUCERS[arguments.transducer],
        order=read_order(arguments.pzd_order),
        state=arguments.state,
        bench=BENCHES[arguments.bench],
    )


def _announce(path: str, addresses: list[int], arguments: argparse.Namespace, output: Output) -> None:
    if output.as_json:
        told = {"address": f"{path}@{arguments.baud}", "path": path, "baud": arguments.baud, "slaves": addresses}
        output.result(told, "")
    else:
        output.say("cli.twin_ed2.ready", path=path, baud=arguments.baud, slaves=", ".join(map(str, addresses)))
        output.say("cli.stop_hint")
