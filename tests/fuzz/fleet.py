"""Fuzzing in bulk: workers in processes of their own, and what they found."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from tests.fuzz.targets import Name

ROOT: Final = Path(__file__).resolve().parents[2]
GRACE_S: Final = 300.0


class Share(NamedTuple):
    """The part of one worker: ``files`` files from number ``first`` on, made from the ``seeds`` in turn."""

    name: Name
    seeds: str
    first: int
    files: int


class Found(NamedTuple):
    """What all workers of a format did. ``faults`` tell the file that is kept and what came out of the reader."""

    name: Name
    done: int
    seconds: float
    cpu_s: float
    slowest_s: float
    peak_mib: int
    faults: tuple[str, ...]

    @property
    def summary(self) -> str:
        """For people."""
        rate = self.done / self.cpu_s if self.cpu_s else 0.0
        return (
            f"{self.name.value}: {self.done} files, {rate:.0f} in a second of processor time ({self.seconds:.0f} s of "
            f"all workers), the slowest {self.slowest_s:.2f} s; {self.peak_mib} MiB at most; {len(self.faults)} faults"
        )


def shares(name: Name, seeds: str, files: int, workers: int) -> list[Share]:
    """The work, cut into parts."""
    each = -(-files // workers)
    return [Share(name, seeds, first, min(each, files - first)) for first in range(0, files, each)]


def run(work: Sequence[Share], folder: Path, budget_s: float) -> list[Found]:
    """All shares at once, each for at most ``budget_s``; what was found by format."""
    begun = []
    for n, (name, seeds, first, files) in enumerate(work):
        own = folder / f"{name.value}-{n}"
        arguments = (name.value, seeds, str(first), str(files), str(budget_s), str(own))
        command = (sys.executable, "-m", "tests.fuzz.worker", *arguments)
        begun.append((name, own, subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)))
    reports: dict[Name, list[dict[str, Any]]] = {}
    for name, own, process in begun:
        reports.setdefault(name, []).append(_report(own, process, budget_s + GRACE_S))
    return [_together(name, each) for name, each in reports.items()]


def _report(folder: Path, process: subprocess.Popen[bytes], timeout_s: float) -> dict[str, Any]:
    """What a worker printed last; a worker that died has met a fault with the file that it had in hand."""
    with process:
        try:
            text = process.communicate(timeout=timeout_s)[0].decode("utf-8", "replace")
        except subprocess.TimeoutExpired:
            process.kill()
            text = process.communicate()[0].decode("utf-8", "replace") + "\nended: no answer"
    last = text.strip().splitlines()[-1:] or [""]
    if process.returncode == 0 and last[0].startswith("{"):
        report: dict[str, Any] = json.loads(last[0])
        return report
    fault = {"file": str(folder / "current"), "fault": f"the worker ended with {process.returncode}\n{text[-3000:]}"}
    return {"done": 0, "seconds": 0.0, "cpu_s": 0.0, "slowest_s": 0.0, "peak_mib": 0, "faults": [fault]}


def _together(name: Name, reports: Sequence[dict[str, Any]]) -> Found:
    return Found(
        name,
        done=sum(report["done"] for report in reports),
        seconds=sum(report["seconds"] for report in reports),
        cpu_s=sum(report["cpu_s"] for report in reports),
        slowest_s=max(report["slowest_s"] for report in reports),
        peak_mib=max(report["peak_mib"] for report in reports),
        faults=tuple(f"{fault['file']}\n{fault['fault']}" for report in reports for fault in report["faults"]),
    )


def workers() -> int:
    """As many as there are processors."""
    return os.cpu_count() or 1
