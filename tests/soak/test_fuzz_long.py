"""100,000 damaged files of each format (``HUBSIDE_SOAK_FILES`` for another number), by all processors.

Faults stay in the folder ``HUBSIDE_SOAK_FAULTS`` where that is given, for whoever mends them.
"""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from tests.fuzz.fleet import run, shares, workers
from tests.fuzz.targets import Name

pytestmark = [pytest.mark.soak, pytest.mark.timeout(6 * 3600)]

FILES = int(os.environ.get("HUBSIDE_SOAK_FILES", "100000"))
BUDGET_S = 3 * 3600.0


@pytest.mark.parametrize("name", Name, ids=lambda name: name.value)
def test_only_declared_errors(tmp_path: Path, name: Name) -> None:
    folder = Path(os.environ.get("HUBSIDE_SOAK_FAULTS", tmp_path))
    seed = str(random.SystemRandom().randrange(1 << 32))
    (found,) = run(shares(name, seed, FILES, workers()), folder, BUDGET_S)
    print(f"seed {seed}: {found.summary}")
    assert not found.faults, "\n".join(found.faults)
    assert found.done == FILES
