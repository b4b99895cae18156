"""``hubside twin pd4e``: the digital twin of a Nanotec PD4-E, served over Modbus TCP, as a process of its own."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from app.cli.output import Output
from app.cli.runtime import spare_collector, stop_event
from app.errors import BusOpenError, UsageError
from app.model.address import is_decimal
from app.model.description_file import load_builtin
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import BOOT_NS, FREE_SHAFT, MOTORS, Pd4e, Settings
from app.twins.pd4e.server import PORT, Pd4eServer
from app.twins.pd4e.servo import Bench

DESCRIPTION: Final = "nanotec-pd4e"
SLIDE: Final = Bench(
    low_stop=-10.5, high_stop=10.5, negative_switch=-10.0, positive_switch=10.0, home_switch=(-2.0, -1.0), index=0.25
)
BENCHES: Final = {"free": FREE_SHAFT, "slide": SLIDE}
"""What the motor is coupled to: nothing, or a slide of 21 revolutions with stops, limit and reference switches."""


def add_parser(kinds: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = kinds.add_parser("pd4e", help="one servo drive on Modbus TCP")
    parser.add_argument("--modbus", default=f"127.0.0.1:{PORT}", metavar="HOST:PORT")
    parser.add_argument("--variant", choices=sorted(MOTORS), default="pd4-e591")
    parser.add_argument("--bench", choices=sorted(BENCHES), default="free", help="what the motor turns")
    parser.add_argument("--serial", default="TWIN-0001", help="serial number of the drive (4040h)")
    parser.add_argument("--state", type=Path, metavar="DIR", help="where saved parameters are kept")
    parser.add_argument("--while-stdin", action="store_true", help="end when standard input ends, as the caller has")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, output: Output) -> int:
    """Serve until interrupted. Raises UsageError, and BusOpenError where the port cannot be had."""
    host, port = _address(arguments.modbus)
    if not arguments.serial.isascii():
        raise UsageError(reason=f"'{arguments.serial}': a serial number has ASCII letters and digits only")
    spare_collector()
    stop = stop_event(while_stdin=arguments.while_stdin)
    device = Pd4e(load_builtin(DESCRIPTION), _settings(arguments))
    if device.memory.problem is not None:
        output.say("cli.twin_problem", reason=device.memory.problem)
    device.run_until(BOOT_NS)
    thread = PacedThread(device, name="pd4e")
    try:
        server = Pd4eServer(thread, device, host, port)
    except OSError as error:
        thread.stop()
        raise BusOpenError(bus=arguments.modbus, reason=error.strerror or str(error)) from error
    with thread, server:
        _announce(f"{host}:{server.port}", arguments, output)
        stop.wait()
    return 0


def _settings(arguments: argparse.Namespace) -> Settings:
    state: Path | None = arguments.state
    return Settings(
        variant=arguments.variant,
        serial=arguments.serial,
        state=None if state is None else state / f"{arguments.variant}.json",
        bench=BENCHES[arguments.bench],
    )


def _announce(address: str, arguments: argparse.Namespace, output: Output) -> None:
    if output.as_json:
        output.result({"address": address, "variant": arguments.variant, "serial": arguments.serial}, "")
    else:
        output.say("cli.twin_pd4e.ready", variant=arguments.variant.upper(), address=address)
        output.say("cli.stop_hint")


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not is_decimal(port) or int(port) > 65535:
        raise UsageError(reason=f"'{text}': the twin is served as HOST:PORT")
    return host, int(port)
