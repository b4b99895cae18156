"""Processor time of a process, told on demand: a line on standard input is answered with ``{"cpu_s": ...}``."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable


def start_meter(on_end: Callable[[], object], **first: object) -> None:
    """Say ``first``, then answer every line; ``on_end`` is called, on the meter's thread, when the input ends."""

    def answer() -> None:
        for _ in sys.stdin:
            print(json.dumps({"cpu_s": time.process_time()}), flush=True)
        on_end()

    print(json.dumps(first), flush=True)
    threading.Thread(target=answer, name="meter", daemon=True).start()
