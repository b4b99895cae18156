"""What a kill costs: never more than half a second before it, however slow the disk and whatever is being done."""

from __future__ import annotations

import os
import random
from pathlib import Path

import pytest

from app.recording.writer import RecorderSettings
from bench._process import Child
from tests.recording.rig import MS, Bench, S
from tests.soak.killing import START_TIMEOUT_S, Outcome, kill_once, plan, verdict

KILLS = 20
SEED = 61


@pytest.mark.timeout(600)
def test_kills_at_random_moments(tmp_path: Path) -> None:
    chances = random.Random(SEED), random.Random(fresh := random.SystemRandom().randrange(1 << 32))
    outcomes: list[Outcome] = []
    with Child("tests.soak.recorder_process") as zygote:
        zygote.hear(START_TIMEOUT_S)
        for n in range(KILLS):
            outcomes.append(kill_once(zygote, tmp_path / str(n), plan(chances[n % 2])))
    told = verdict(outcomes)
    print(told.summary)
    assert not told.faults, f"fresh seed {fresh}: {told}"
    assert told.frames > 0


@pytest.mark.parametrize("sync_ms", [0, 40, 75, 110])
def test_a_slow_disk_has_chunks_closed_more_often(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sync_ms: int
) -> None:
    """A frame that came just after the chunks were closed is in the file half a second later, at any time."""
    bench = Bench(tmp_path, RecorderSettings(min_free_bytes=0, clock_s=0.15))
    really, unsafe_ns = os.fsync, [0]

    def slow(descriptor: int) -> None:
        bench.clock.advance(sync_ms * MS)
        really(descriptor)

    monkeypatch.setattr(os, "fsync", slow)
    taken_ns = bench.clock.monotonic
    for _ in range(20):
        bench.write(10)
        frames_before = bench.core.status().frames
        started_ns = bench.clock.monotonic
        bench.core.cycle()
        if bench.core.status().frames > frames_before:
            # The chunk of the bus is the first of two; its sync is over sync_ms after the call.
            unsafe_ns.append(started_ns + sync_ms * MS - taken_ns)
            taken_ns = started_ns
        bench.clock.advance(max(1, round(bench.core.wait_s() * S)))
    bench.core.shut()
    assert len(unsafe_ns) > 3
    assert max(unsafe_ns) <= S // 2
    assert sync_ms or max(unsafe_ns) == 400 * MS, "a quick disk is not asked for more"
