"""Scheduling of a benchmark, where the system lets us choose: a simulated bus has to keep its time."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

_PRIORITY = 10
_NICE = -15


@contextmanager
def real_time() -> Iterator[str]:
    """Ask for round-robin real-time scheduling, for processes started meanwhile too; gives what was granted."""
    if not hasattr(os, "sched_setscheduler"):
        yield "normal"
        return
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(_PRIORITY))
    except PermissionError:
        yield "normal"
        return
    try:
        yield f"real-time, round robin {_PRIORITY}"
    finally:
        os.sched_setscheduler(0, before, parameters)


@contextmanager
def preferred() -> Iterator[str]:
    """Ask for a low nice value, for processes started meanwhile too; gives what was granted.

    Keeps a busy machine's other work out of the figures without the 50 ms a second that real-time processes may be
    held back for.
    """
    if not hasattr(os, "setpriority"):
        yield "normal"
        return
    before = os.getpriority(os.PRIO_PROCESS, 0)
    try:
        os.setpriority(os.PRIO_PROCESS, 0, _NICE)
    except PermissionError:
        yield "normal"
        return
    try:
        yield f"nice {_NICE}"
    finally:
        os.setpriority(os.PRIO_PROCESS, 0, before)
