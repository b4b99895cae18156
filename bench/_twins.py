"""The twins of a turbine as a process of their own."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from queue import Empty, Queue

READY_TIMEOUT_S = 20.0
STOP_TIMEOUT_S = 5.0


@contextmanager
def twins(bitrate: int = 500_000, turnaround_ms: float = 2.0) -> Iterator[str]:
    """Serve six twins (PMM 1..3, PMC 11..13) on a free port; gives ``HOST:PORT``. Raises TimeoutError."""
    command = [sys.executable, "-m", "app.cli", "--json", "twin", "oat", "--can", "socketcand:127.0.0.1:0"]
    command += ["--bitrate", str(bitrate), "--turnaround-ms", str(turnaround_ms)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        yield _address(process)
    finally:
        process.terminate()
        try:
            process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _address(process: subprocess.Popen[str]) -> str:
    lines: Queue[str] = Queue()
    stdout = process.stdout
    if stdout is None:
        raise RuntimeError("the twins' output is not piped")
    threading.Thread(target=lambda: lines.put(stdout.readline()), daemon=True).start()
    try:
        answer = json.loads(lines.get(timeout=READY_TIMEOUT_S))
    except Empty:
        raise TimeoutError("the twins did not start") from None
    address: str = answer["address"]
    return address.removeprefix("socketcand:")
