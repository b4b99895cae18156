"""Damaged files of every format: nothing but declared errors, no hang, no more memory than is allowed.

Half of the files are the same at each run, half are new ones; their seed is in what is told of a fault.
"""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.fuzz.fleet import Share, run
from tests.fuzz.targets import Name

FIXED = "hubside"
FILES = {Name.MCAP: 500, Name.CANDUMP: 800, Name.ASC: 600, Name.EDS: 1200, Name.DCF: 500, Name.SET: 4000}
BUDGET_S = 120.0
"""A machine so busy that this is not enough reads fewer files."""
AT_ONCE = ((Name.MCAP, Name.SET, Name.EDS), (Name.CANDUMP, Name.ASC, Name.DCF))


@pytest.mark.timeout(900)
@pytest.mark.parametrize("names", AT_ONCE, ids=lambda names: "-".join(name.value for name in names))
def test_only_declared_errors(tmp_path: Path, names: tuple[Name, ...]) -> None:
    seeds = f"{FIXED},{random.SystemRandom().randrange(1 << 32)}"
    work = [Share(name, seeds, 0, FILES[name]) for name in names]
    for found in run(work, tmp_path, BUDGET_S):
        print(found.summary)
        assert not found.faults, "\n".join(found.faults)
        assert found.done > 0
