"""``hubside serve``: the page, and the connection to a turbine."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import importlib
import signal
import sys
import time
from pathlib import Path
from typing import Any

from app.cli.arguments import add_port
from app.cli.connecting import SWITCH_INTERVAL_S, make_bench
from app.cli.output import Output
from app.cli.runtime import spare_collector
from app.cli.targets import add_connection
from app.errors import NoAnswerError
from app.recording.recover import RecoveryKind, recover_all
from app.service.bench import Bench


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register the command."""
    parser = commands.add_parser("serve", help="serve the page; the turbine may be chosen there")
    add_connection(parser, required=False)
    parser.add_argument("--no-record", action="store_true", help="do not record")
    add_port(parser)
    parser.add_argument("--listen", metavar="ADDRESS[:PORT]", help="serve on another address: by TLS, and with users")
    parser.add_argument("--tls-cert", type=Path, metavar="FILE", help="certificate with its chain (PEM)")
    parser.add_argument("--tls-key", type=Path, metavar="FILE", help="its private key (PEM)")
    parser.add_argument(
        "--host", action="append", default=[], metavar="NAME", help="a name under which browsers reach the page"
    )
    parser.set_defaults(run=serve_turbine, instructor=None)


def serve_turbine(arguments: argparse.Namespace, output: Output) -> int:
    """Serve the page and connect to the turbine that the arguments name, until interrupted; gives the exit code."""
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    return asyncio.run(_serve(arguments, output))


async def _serve(arguments: argparse.Namespace, output: Output) -> int:
    settings = arguments.settings
    recoveries = recover_all(settings.recordings, time.time_ns())
    for recovery in recoveries:
        output.say("cli.recovered", file=recovery.file, frames=recovery.frames, dropped=recovery.lost_bytes)
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C comes as KeyboardInterrupt
            loop.add_signal_handler(number, stop.set)
    turbine, bench = await make_bench(arguments, output, not arguments.no_record)
    for recovery in recoveries:
        if recovery.kind is not RecoveryKind.SET_ASIDE:
            bench.indexing.later(settings.recordings / recovery.file)
    connecting = asyncio.create_task(_connect(bench, turbine, settings.person, output))
    try:
        # In a thread, and while the bus is opened and listened to: that takes about as long as loading the libraries.
        page: Any = await asyncio.to_thread(importlib.import_module, "app.cli.page")
        async with page.serve_page(arguments, bench) as url:
            await connecting
            spare_collector()
            output.result({"url": url}, output.texts("cli.page", url=url))
            output.say("cli.demo_data", folder=settings.data)
            output.say("cli.stop_hint")
            await stop.wait()
    finally:
        connecting.cancel()
        await asyncio.gather(connecting, return_exceptions=True)
        await bench.close()
    return 0


async def _connect(bench: Bench, turbine: str | None, person: str, output: Output) -> None:
    """Connect at the start. Where the adapter is not there yet, the page is served all the same and can try again."""
    if turbine is None:
        return
    try:
        await bench.connect(turbine, person)
    except NoAnswerError as error:
        output.error(error)
