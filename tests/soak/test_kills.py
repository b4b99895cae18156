"""Two hundred kills while recording (``HUBSIDE_SOAK_KILLS`` for another number), none of which costs half a second."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from bench._process import Child
from tests.soak.killing import START_TIMEOUT_S, kill_once, plan, verdict

pytestmark = [pytest.mark.soak, pytest.mark.timeout(2 * 3600)]

KILLS = int(os.environ.get("HUBSIDE_SOAK_KILLS", "200"))


def test_two_hundred_kills(tmp_path: Path) -> None:
    seed = random.SystemRandom().randrange(1 << 32)
    chance = random.Random(seed)
    with Child("tests.soak.recorder_process") as zygote:
        zygote.hear(START_TIMEOUT_S)
        outcomes = [kill_once(zygote, tmp_path / str(n), plan(chance)) for n in range(KILLS)]
    told = verdict(outcomes)
    print(told.summary)
    assert not told.faults, f"seed {seed}: {told}"
    assert told.frames > 0
