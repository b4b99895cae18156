"""A child process of a benchmark that is told and tells, one line of JSON at a time."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from queue import Empty, Queue
from types import TracebackType
from typing import Any, Final, Self

START_TIMEOUT_S: Final = 20.0
STOP_TIMEOUT_S: Final = 15.0


class Child:
    """``python -m MODULE ARGUMENTS``. Its end: standard input is closed; what does not end by that is killed.

    ``quiet``: what it says on standard error is thrown away. ``environment`` stands in for ours where given.
    ``before``: a program, with its arguments, that runs this one.
    """

    def __init__(
        self,
        module: str,
        *arguments: str,
        quiet: bool = False,
        environment: Mapping[str, str] | None = None,
        before: Sequence[str] = (),
    ) -> None:
        self.module = module
        self._lines: Queue[str] = Queue()
        command: Sequence[str] = (*before, sys.executable, "-u", "-m", module, *arguments)
        stderr = subprocess.DEVNULL if quiet else None
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            env=dict(os.environ if environment is None else environment),
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def pid(self) -> int:
        """The process."""
        return self._process.pid

    def tell(self, **message: Any) -> None:
        """Send a line."""
        if self._process.stdin is None:
            raise RuntimeError("standard input is not piped")
        self._process.stdin.write(json.dumps(message) + "\n")
        self._process.stdin.flush()

    def hear(self, timeout_s: float = START_TIMEOUT_S) -> dict[str, Any]:
        """The next line that is JSON. Raises TimeoutError, and RuntimeError where the process ended instead."""
        while not (line := self._line(timeout_s)).startswith("{"):
            continue
        answer: dict[str, Any] = json.loads(line)
        return answer

    def wait_for(self, start: str, timeout_s: float = START_TIMEOUT_S) -> None:
        """Pass over lines until one begins with ``start``. Raises as ``hear`` does."""
        while not self._line(timeout_s).startswith(start):
            continue

    def close(self) -> None:
        """Close its standard input: it should end now."""
        if self._process.stdin is not None:
            self._process.stdin.close()

    def terminate(self) -> None:
        """Send it the signal to end."""
        self._process.terminate()

    def _line(self, timeout_s: float) -> str:
        try:
            line = self._lines.get(timeout=timeout_s)
        except Empty:
            raise TimeoutError(f"{self.module} said nothing for {timeout_s} s") from None
        if not line:
            raise RuntimeError(f"{self.module} ended with {self._process.wait(STOP_TIMEOUT_S)}")
        return line

    def _read(self) -> None:
        if self._process.stdout is not None:
            for line in self._process.stdout:
                self._lines.put(line)
        self._lines.put("")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
        try:
            self._process.wait(STOP_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(STOP_TIMEOUT_S)
        if self._process.stdout is not None:
            self._process.stdout.close()
