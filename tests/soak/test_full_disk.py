"""The disk of a served turbine is full at twenty random points (``HUBSIDE_SOAK_FULL`` for another number)."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from tests.e2e.conftest import Twins, twins
from tests.soak.filling import MOST_LEFT_BYTES, SPACE_LOW_BYTES, fill_often

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

__all__ = ["twins"]
TIMES = int(os.environ.get("HUBSIDE_SOAK_FULL", "20"))


async def test_full_at_random_points(twins: Twins, tmp_path: Path) -> None:
    seed = random.SystemRandom().randrange(1 << 32)
    chance = random.Random(seed)
    left = [SPACE_LOW_BYTES if chance.random() < 0.2 else chance.randrange(MOST_LEFT_BYTES) for _ in range(TIMES)]
    print(f"seed {seed}:", await fill_often(twins, tmp_path, left))
