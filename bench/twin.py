"""How much faster than real time the twins run: three axes, each with PMM and PMC, with everything on, on one core.

The turbine works in a gusty wind: its controller pitches the blades by cyclic set-points at every SYNC, reads supply
and
batteries by SDO, and all six units send their PDOs, heartbeats and the link between PMM and PMC. Half-way the mains of
a blade fails, so that booster and battery work too. The peer is the clock: ratio = simulated seconds a second of CPU.
"""

from __future__ import annotations

import cProfile
import pstats
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from app.model.description_file import load_builtin
from app.model.fault import FaultOrder
from app.twins.controller import TurbineController
from app.twins.faults import Instructor
from app.twins.line import CanLine
from app.twins.plant_kernel import Run, run_compiled, run_plain
from app.twins.rotor import Rotor
from app.twins.surroundings import Surroundings
from app.twins.turbine import build_turbine
from bench._result import Result

TARGET = 20.0
SECOND = 1_000_000_000
WARM_UP_S = 20
"""The controller has set its devices and the rotor turns by then."""
WIND_MPS = 14.0
ROUNDS = 3
_ROOT = Path(__file__).resolve().parent.parent


class Course(NamedTuple):
    """One run: simulated seconds a second of CPU, frames on the line, degrees that the blades moved in all."""

    rate: float
    frames: int
    moved_deg: float


class Work:
    """A turbine at work on a line."""

    def __init__(self, run: Run) -> None:
        self.line = CanLine(500_000)
        self.turbine = build_turbine(self.line, load_builtin("oat-pmm"), load_builtin("oat-pmc"), run=run)
        self.axes = [blade.axis for blade in self.turbine.blades]
        rotor = Rotor(seed=11)
        surroundings = Surroundings(self.line, rotor, self.axes)
        surroundings.set_wind(WIND_MPS)
        self.instructor = Instructor(self.turbine, self.line, surroundings, seed=1)
        self.turbine.power_on(0)
        surroundings.start(0)
        TurbineController(self.line, rotor).start(0)
        self.line.run_until(WARM_UP_S * SECOND)

    def course(self, seconds: int) -> Course:
        """Let time pass; the mains of blade 3 fails half-way for two seconds, which the hold-up time covers."""
        frames, moved = self.line.frames, 0.0
        begin_ns = self.line.now_ns
        started = time.process_time()
        for step in range(seconds * 10):
            if step == seconds * 5:
                self.instructor.inject(FaultOrder("mains_failure", blade=3, seconds=2.0))
            before = [axis.angle_deg for axis in self.axes]
            self.line.run_until(begin_ns + (step + 1) * SECOND // 10)
            moved += sum(abs(axis.angle_deg - was) for axis, was in zip(self.axes, before, strict=True))
        took = time.process_time() - started
        return Course(seconds / took, self.line.frames - frames, moved)


def profile(run: Run, seconds: int) -> list[str]:
    """The functions that take most, of one run, as shares of all."""
    work = Work(run)
    profiler = cProfile.Profile()
    profiler.enable()
    work.course(seconds)
    profiler.disable()
    stats = pstats.Stats(profiler)
    rows = sorted(stats.stats.items(), key=lambda row: -row[1][2])  # type: ignore[attr-defined]
    whole = stats.total_tt  # type: ignore[attr-defined]
    return [f"  {row[1][2] / whole:5.1%}  {_place(row[0])}" for row in rows[:12]]


def _place(function: tuple[str, int, str]) -> str:
    file, line, name = function
    path = Path(file)
    return f"{path.relative_to(_ROOT)}:{line} {name}" if path.is_relative_to(_ROOT) else name


def measure(name: str, run: Run, seconds: int) -> tuple[float, list[str]]:
    """The median rate of some rounds, and what to say of them."""
    rounds = [Work(run).course(seconds) for _ in range(ROUNDS)]
    rate = statistics.median(one.rate for one in rounds)
    one = rounds[0]
    said = f"{name}: {rate:.1f} s a second of CPU (rounds {', '.join(f'{each.rate:.1f}' for each in rounds)})"
    return rate, [
        said,
        f"  {one.frames / seconds:.0f} frames/s, blades moved {one.moved_deg:.0f} degrees in {seconds} s",
    ]


def run(full: bool) -> Result:
    """20 s of work, five minutes in the long form, compiled and plain."""
    seconds = 300 if full else 20
    lines: list[str] = []
    compiled, said = measure("compiled", _compiled(lines), seconds)
    lines += said
    lines += measure("plain Python", run_plain, seconds)[1]
    lines += ["where the time goes, compiled:", *profile(run_compiled(), seconds)]
    return Result(ratio=compiled, target=TARGET, lines=tuple(lines))


def _compiled(lines: list[str]) -> Callable[[list[float], list[float], int], int]:
    started = time.process_time()
    kernel = run_compiled()
    Work(kernel).course(1)
    lines.append(f"compiling took {time.process_time() - started:.1f} s, once for a process; it is not counted")
    return kernel
