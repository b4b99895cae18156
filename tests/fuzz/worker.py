"""Reads damaged files, one after another: ``python -m tests.fuzz.worker FORMAT SEEDS FIRST FILES BUDGET_S FOLDER``.

File ``n`` is made from ``n`` and one of the SEEDS, which are named with commas between and take turns. Whatever comes
out of a reader but an error of ``app.errors`` is a fault, and so are more than 512 MiB held by the process, everything
counted, and 10 s of processor time for one file. Faults are kept in FOLDER; the last line printed is the
report. The time of BUDGET_S ends the work early.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import json
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

from tests.fuzz.targets import Name, Target, clear, target

LIMIT_MIB = 512
HANG_S = 10.0
DEAD_S = 120.0
"""Wall time after which even a hang that no signal ends is one."""
MOST_FAULTS = 5
IN_MEMORY = Path("/dev/shm")
"""Where files are read from, where there is such a place: a disk would take longer than the reader."""


class HangError(BaseException):
    """A file took too long; nothing may catch it."""


def _hang(*_: object) -> NoReturn:
    raise HangError


def address_space() -> int:
    """Bytes of this process."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * resource.getpagesize()


def peak_mib() -> int:
    """The most that this process ever held; ``getrusage`` would count what its parent held when it was forked."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) // 1024 for line in lines if line.startswith("VmHWM"))


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Processor time, so that a busy machine is no hang; wall time for what waits."""
    signal.setitimer(signal.ITIMER_PROF, HANG_S)
    faulthandler.dump_traceback_later(DEAD_S, exit=True)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        faulthandler.cancel_dump_traceback_later()


def fault_of(read: Target, data: bytes, folder: Path) -> str | None:
    """What is wrong with how ``data`` is read; None where nothing is."""
    try:
        with watched():
            read.read(data, folder)
    except HangError:
        return f"hang\n{traceback.format_exc()}"
    except Exception:  # noqa: BLE001 - whatever comes out of a reader is what is looked for
        return traceback.format_exc()
    return None


def forget_peak() -> None:
    """``peak_mib`` begins anew."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def warm_up(chosen: Target, folder: Path) -> None:
    """Everything is loaded and every seed is read before the memory is limited."""
    for data in (*chosen.seeds, *chosen.large):
        fault = fault_of(chosen, data, folder)
        if fault is not None:
            raise RuntimeError(f"a seed: {fault}")
    gc.collect()


def main() -> None:
    name, seeds = Name(sys.argv[1]), sys.argv[2].split(",")
    first, count, budget_s, folder = int(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5]), Path(sys.argv[6])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=IN_MEMORY if IN_MEMORY.is_dir() else folder) as work:
        print(json.dumps(run(name, seeds, range(first, first + count), budget_s, folder, Path(work))), flush=True)


def run(name: Name, seeds: list[str], numbers: range, budget_s: float, folder: Path, work: Path) -> dict[str, object]:
    """Make and read the files; the report."""
    current = folder / "current"
    chosen = target(name)
    signal.signal(signal.SIGPROF, _hang)
    warm_up(chosen, work)
    limit = address_space() + (LIMIT_MIB << 20)  # a fence: it ends what would fill the machine
    forget_peak()
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    faults: list[dict[str, str]] = []
    slowest_s, highest_mib, done, started_s, used_s = 0.0, 0, 0, time.monotonic(), time.process_time()
    for n in numbers:
        seed = seeds[n % len(seeds)]
        data = chosen.file(random.Random(f"{seed}/{n}"))
        current.write_bytes(data)
        before_s = time.process_time()
        fault = fault_of(chosen, data, work)
        slowest_s = max(slowest_s, time.process_time() - before_s)
        done += 1
        held_mib = peak_mib()
        highest_mib = max(highest_mib, held_mib)
        if held_mib > LIMIT_MIB:
            fault = fault or f"{held_mib} MiB of memory"
            forget_peak()
        if fault is not None:
            clear(work)
            kept = folder / f"{name.value}-{seed}-{n}"
            kept.write_bytes(data)
            faults.append({"file": str(kept), "fault": fault})
        if len(faults) >= MOST_FAULTS or time.monotonic() - started_s > budget_s:
            break
    used_s = time.process_time() - used_s
    report = {
        "done": done,
        "seconds": time.monotonic() - started_s,
        "cpu_s": used_s,
        "slowest_s": slowest_s,
        "peak_mib": highest_mib,
    }
    return {**report, "faults": faults}


if __name__ == "__main__":
    main()
