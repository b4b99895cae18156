"""Real processes for the end-to-end tests: started, waited for by what they print, ended by their own id."""

from __future__ import annotations

import atexit
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HUBSIDE = (sys.executable, "-m", "app.cli")
ROOT = Path(__file__).resolve().parents[2]
START_S = 30.0
SCRATCH = tempfile.mkdtemp(prefix="hubside-tests-")
"""The data folder of commands that name none: never that of the person who runs the tests."""
USUAL = {"HUBSIDE_LANGUAGE": "en", "HUBSIDE_DATA": SCRATCH}
atexit.register(shutil.rmtree, SCRATCH, ignore_errors=True)


@dataclass
class Process:
    """A running process; its lines are kept as they come."""

    popen: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)
    _arrived: threading.Condition = field(default_factory=threading.Condition)

    def follow(self) -> None:
        """Keep what it prints until it ends."""
        stream = self.popen.stdout
        if stream is None:
            raise RuntimeError("no pipe")
        for line in stream:
            with self._arrived:
                self.lines.append(line.rstrip("\n"))
                self._arrived.notify_all()
        with self._arrived:
            self._arrived.notify_all()

    def wait_for(self, text: str, timeout_s: float = START_S) -> str:
        """The first line that holds ``text``."""

        def found() -> str | None:
            return next((line for line in self.lines if text in line), None)

        with self._arrived:
            self._arrived.wait_for(lambda: found() is not None or self.popen.poll() is not None, timeout_s)
            line = found()
        if line is None:
            raise AssertionError(f"no line with {text!r} in:\n" + "\n".join(self.lines))
        return line


@contextmanager
def running(*arguments: str, **environment: str) -> Iterator[Process]:
    """Run ``hubside`` with these arguments until the block ends."""
    popen = subprocess.Popen(
        [*HUBSIDE, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT,
        env={**os.environ, **USUAL, **environment},
    )
    process = Process(popen)
    reader = threading.Thread(target=process.follow, daemon=True)
    reader.start()
    try:
        yield process
    finally:
        if popen.poll() is None:
            popen.send_signal(signal.SIGTERM)
        try:
            popen.wait(15)
        except subprocess.TimeoutExpired:
            popen.kill()
            popen.wait(5)
        reader.join(5)
        if popen.stdout is not None:
            popen.stdout.close()


@dataclass(frozen=True)
class Done:
    """A finished command."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The last line of standard output as JSON."""
        return json.loads(self.out.strip().splitlines()[-1])

    @property
    def error(self) -> Any:
        """The last line of standard error as JSON."""
        return json.loads(self.err.strip().splitlines()[-1])


def hubside(*arguments: str, data: Path | None = None, timeout_s: float = 60.0) -> Done:
    """Run ``hubside`` to its end."""
    head = ("--data", str(data)) if data is not None else ()
    done = subprocess.run(
        [*HUBSIDE, *head, *arguments],
        check=False,
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=timeout_s,
        env={**os.environ, **USUAL},
    )
    return Done(done.returncode, done.stdout, done.stderr)
