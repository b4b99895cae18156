"""Runs a simulated CAN line in real time, with the sockets that feed it, in one thread."""

from __future__ import annotations

import time
from collections.abc import Callable

from app.twins.line import CanLine
from app.twins.paced_thread import PacedThread


class LineThread(PacedThread):
    """The thread of one line."""

    def __init__(self, line: CanLine, monotonic_ns: Callable[[], int] = time.monotonic_ns) -> None:
        super().__init__(line, monotonic_ns, name="can-line")
        self.line = line
