"""``hubside serve`` and ``hubside demo``: the page of a connected turbine."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import secrets
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Coroutine, Iterator
from pathlib import Path
from typing import Any

from app.cli.arguments import milliseconds, port
from app.cli.connecting import SWITCH_INTERVAL_S, make_bench
from app.cli.output import Output
from app.cli.targets import add_connection
from app.errors import BusOpenError, NoAnswerError
from app.model.description_file import bundled_folder
from app.recording.recover import recover_all
from app.service.bench import Bench
from app.settings import DEFAULT_PORT, TWIN_PORT

START_S = 20.0


def add_parser(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Register both commands."""
    serve = commands.add_parser("serve", help="serve the page; the turbine may be chosen there")
    add_connection(serve, required=False)
    serve.add_argument("--no-record", action="store_true", help="do not record")
    serve.set_defaults(run=lambda arguments, output: _start(_serve(arguments, output)))
    demo = commands.add_parser("demo", help="twins of three blades, and the page on them")
    demo.add_argument("--turnaround-ms", type=milliseconds, default=1.0, help="time a twin takes to answer")
    demo.set_defaults(run=_demo, consent=False, listen_s=0.5, eds=[], turbine=None, can=None, no_record=False)
    for parser in (serve, demo):
        parser.add_argument(
            "--port", type=port, default=DEFAULT_PORT, help="loopback port of the page; 0: any free one"
        )


def _start(command: Coroutine[Any, Any, int]) -> int:
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    return asyncio.run(command)


def _demo(arguments: argparse.Namespace, output: Output) -> int:
    """Start the twins as a process of their own, then serve their page."""
    state = arguments.settings.data / "twins"
    state.mkdir(parents=True, exist_ok=True)
    with _twins(arguments, state) as address:
        arguments.site = _demo_site(arguments.settings.data, address)
        return _start(_serve(arguments, output))


@contextlib.contextmanager
def _twins(arguments: argparse.Namespace, state: Path) -> Iterator[str]:
    """Twins in a process of their own, on the usual port or, where that is taken, on a free one."""
    error = ""
    for tried in (TWIN_PORT, 0):
        command = [sys.executable, "-m", "app.cli", "twin", "oat", "--json", "--while-stdin", "--state", str(state)]
        command += ["--can", f"socketcand:127.0.0.1:{tried}", "--turnaround-ms", str(arguments.turnaround_ms)]
        pipe = subprocess.PIPE
        # A group of its own: Ctrl-C is for us, and the twins stay until the recording is closed.
        alone: dict[str, Any] = {"start_new_session": True} if sys.platform != "win32" else {"creationflags": 0x200}
        with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, **alone) as process:
            try:
                line = process.stdout.readline() if process.stdout is not None else ""
                if line:
                    yield json.loads(line)["address"]
                    return
                error = process.stderr.read() if process.stderr is not None else ""
            finally:
                process.terminate()
                process.wait(START_S)
    raise BusOpenError(bus="twins", reason=_reason(error) or "the twins did not start")


def _reason(error: str) -> str:
    """The text of an error that another of our processes told as JSON."""
    last = error.strip().splitlines()[-1:] or [""]
    try:
        return str(json.loads(last[0])["text"])
    except (ValueError, KeyError, TypeError):
        return last[0]


def _demo_site(folder: Path, address: str) -> Path:
    text = (bundled_folder("docs/sites", "sites") / "example.toml").read_text(encoding="utf-8")
    path = folder / "demo-site.toml"
    folder.mkdir(parents=True, exist_ok=True)
    path.write_text(text.replace(f"socketcand:127.0.0.1:{TWIN_PORT}", address), encoding="utf-8")
    return path


async def _serve(arguments: argparse.Namespace, output: Output) -> int:
    settings = arguments.settings
    for recovery in recover_all(settings.recordings, time.time_ns()):
        output.say("cli.recovered", file=recovery.file, frames=recovery.frames, dropped=recovery.lost_bytes)
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        with contextlib.suppress(NotImplementedError):  # Windows: Ctrl-C comes as KeyboardInterrupt
            loop.add_signal_handler(number, stop.set)
    turbine, bench = await make_bench(arguments, output, not arguments.no_record)
    try:
        if turbine is not None:
            await _connect(bench, turbine, settings.person, output)
        async with _page(arguments, output, bench):
            output.say("cli.demo_data", folder=settings.data)
            output.say("cli.stop_hint")
            await stop.wait()
    finally:
        await bench.close()
    return 0


async def _connect(bench: Bench, turbine: str, person: str, output: Output) -> None:
    """Connect at the start. Where the adapter is not there yet, the page is served all the same and can try again."""
    try:
        await bench.connect(turbine, person)
    except NoAnswerError as error:
        output.error(error)


@contextlib.asynccontextmanager
async def _page(arguments: argparse.Namespace, output: Output, bench: Bench) -> AsyncIterator[None]:
    from app.scene.hub import HubScene
    from app.web.access import Access
    from app.web.app import create_app
    from app.web.serve import launch_url, open_port, port_of, serve

    listener = open_port(arguments.port)
    at = port_of(listener)
    access = Access(bench.office.sessions, at)
    scene = await asyncio.to_thread(HubScene, secrets.token_urlsafe(32))
    try:
        application = create_app(bench, access, at, scene, arguments.settings.language)
        async with serve(application, listener):
            url = launch_url(at, access.issue_token())
            output.result({"url": url}, output.texts("cli.page", url=url))
            yield
    finally:
        await asyncio.to_thread(scene.close)
