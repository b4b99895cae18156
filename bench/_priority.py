"""Real-time scheduling for a benchmark, where the system lets us: a simulated bus has to keep its time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

_PRIORITY = 10


@contextmanager
def real_time() -> Iterator[str]:
    """Ask for round-robin real-time scheduling, for processes started meanwhile too; gives what was granted."""
    if not hasattr(os, "sched_setscheduler"):
        yield "normal"
        return
    before = os.sched_getscheduler(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    except PermissionError:
        yield "normal"
        return
    try:
        yield f"real-time, round robin {_PRIORITY}"
    finally:
        os.sched_setscheduler(0, before, os.sched_param(0))
