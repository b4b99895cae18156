"""Runs the cycles of a blade's plant, axis and supply, in steps of 1 ms: as plain Python, or compiled for bulk work.

Both are the same source, and give the same numbers to the last bit: compiled code keeps the order of operations, fuses
none of them, and uses the same square root. Compiling takes some seconds, once for a process, which pays for a
simulation in bulk and for nothing that runs in real time.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any, Final

from app.errors import UsageError
from app.twins import axis_kernel, supply_kernel
from app.twins.axis_kernel import AWAKE, EVENT, axis_cycle
from app.twins.supply_kernel import supply_cycle

SIZE: Final = 160
"""Length of state and parameters: 80 for the axis, 80 for the supply."""
Run = Callable[[list[float], list[float], int], int]
"""Runs up to so many cycles on state and parameters; gives how many it ran: it stops after one with an event."""


def run_plain(s: list[float], p: list[float], cycles: int) -> int:
    """Run cycles as Python."""
    for cycle in range(cycles):
        if p[AWAKE]:
            axis_cycle(s, p)
        supply_cycle(s, p)
        if s[EVENT]:
            return cycle + 1
    return cycles


@cache
def run_compiled() -> Run:
    """The same, compiled. Raises UsageError where the compiler (numba) is not installed."""
    try:
        import numba
        import numpy as np
    except ImportError as error:
        raise UsageError(reason="bulk simulation needs numba: pip install 'hubside[bulk]'") from error
    compiled = _compile(numba.njit)
    state, parameters = np.zeros(SIZE), np.zeros(SIZE)

    def run(s: list[float], p: list[float], cycles: int) -> int:
        state[:] = s
        parameters[:] = p
        done = int(compiled(state, parameters, cycles))
        s[:] = state.tolist()
        return done

    return run


def _compile(njit: Callable[..., Any]) -> Callable[..., int]:
    """Copies of the kernel's functions that call one another compiled."""
    ours = dict(globals())
    for module in (axis_kernel, supply_kernel):
        names = dict(vars(module))
        for name, value in vars(module).items():
            if isinstance(value, FunctionType):
                names[name] = njit(FunctionType(value.__code__, names, name))
        ours.update({name: names[name] for name in ("axis_cycle", "supply_cycle") if name in names})
    return njit(FunctionType(run_plain.__code__, ours, run_plain.__name__))  # type: ignore[no-any-return]
