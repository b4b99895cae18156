"""Processor time of a process and all that it started, as Linux tells it under ``/proc``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

_PROC: Final = Path("/proc")
_USER: Final = 11
"""Position of the user time in ``/proc/PID/stat``, behind the name; the system time follows (proc(5))."""


def tree_cpu_s(pid: int) -> dict[int, float]:
    """User and system time in s of ``pid`` and of its descendants, by process. Raises OSError where it has ended."""
    found = {pid: _cpu_s(pid)}
    for child in _children(pid):
        found |= tree_cpu_s(child)
    return found


def _cpu_s(pid: int) -> float:
    fields = (_PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()
    return (int(fields[_USER]) + int(fields[_USER + 1])) / os.sysconf("SC_CLK_TCK")


def _children(pid: int) -> list[int]:
    """A process started by any thread of ``pid``."""
    texts = [(task / "children").read_text() for task in (_PROC / str(pid) / "task").iterdir()]
    return [int(each) for text in texts for each in text.split()]
