"""Settings of the Python runtime for commands that start soon and serve a bus: its garbage collector, its end."""

from __future__ import annotations

import gc
import signal
import sys
import threading
from typing import Final

GC_THRESHOLD: Final = 50_000
"""Objects that may be made, less those that were freed, before garbage is looked for: more than the frames that wait
for the recorder at full load, so that traffic alone never makes the collector walk them."""


def calm_collector() -> None:
    """Let the collector walk seldom. With Python's usual threshold of 700 loading libraries takes nearly twice as long.

    Frames are freed by reference counts: the collector would walk thousands of waiting ones to find nothing.
    """
    gc.set_threshold(GC_THRESHOLD, 10, 10)


def spare_collector() -> None:
    """Take what was loaded so far (descriptions, modules) out of the collector's walks, and let it walk seldom."""
    calm_collector()
    gc.freeze()


def stop_event(*, while_stdin: bool) -> threading.Event:
    """Set by an interrupt or a termination, and with ``while_stdin`` as soon as standard input ends.

    A caller that was killed closes our input; a server without a caller would keep its port for ever.
    """
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    if while_stdin:
        threading.Thread(target=_end_with_stdin, args=(stop,), daemon=True).start()
    return stop


def _end_with_stdin(stop: threading.Event) -> None:
    sys.stdin.read()
    stop.set()
