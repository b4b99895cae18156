"""Buses at a rate, recorded through the whole service: what was sent, what is in the files, what is counted as lost."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from app.recording.content import EventKind
from app.recording.reader import open_recording
from bench._process import Child
from tests.recording.rig import files
from tests.soak.killing import LATE_NS, START_TIMEOUT_S, read_ticks, recorded
from tests.soak.numbered import wrong

NS: Final = 1_000_000_000
MORE_S: Final = 120.0
"""So much longer than the feed itself it may take until everything is recorded."""


class Rates(NamedTuple):
    """By bus what was ``sent`` and what became of it; ``faults`` is empty where the sum is exact and the order right.

    ``rate_hz`` was really sent a second, all buses together; the machine let the feeder wait ``stalled_s`` in all.
    """

    sent: tuple[int, ...]
    recorded: tuple[int, ...]
    lost: tuple[int, ...]
    faults: tuple[str, ...]
    rate_hz: float
    stalled_s: float
    cpu_share: float

    @property
    def share_lost(self) -> float:
        """0 to 1."""
        return 1 - sum(self.recorded) / sum(self.sent)

    @property
    def summary(self) -> str:
        """For people."""
        return (
            f"{len(self.sent)} buses, {sum(self.sent)} frames sent at {self.rate_hz:.0f} frames/s, "
            f"{sum(self.recorded)} recorded, {sum(self.lost)} counted as lost ({self.share_lost:.4%} missing); "
            f"{self.cpu_share:.0%} of a core; the machine stood still for {self.stalled_s:.2f} s in all"
        )


def run(folder: Path, buses: int, rate_hz: int, seconds: float) -> Rates:
    """Each of ``buses`` at ``rate_hz``."""
    ticks, into = folder / "ticks", folder / "rec"
    with Child("tests.soak.feeder", str(ticks), str(rate_hz), str(seconds), str(buses)) as feeder:
        ports = [str(port) for port in feeder.hear(START_TIMEOUT_S)["ports"]]
        with Child("tests.soak.recorder_process", str(into), *ports) as recorder:
            counted = recorder.hear(seconds + MORE_S)
        feeder.tell(stop=False)
        report = feeder.hear(START_TIMEOUT_S)
    sent, names = report["sent"], [f"can{n}" for n in range(buses)]
    columns = [recorded(into, name) for name in names]
    lost = _lost(into)
    faults = [
        f"{name}: frames are not what was sent, or in another order"
        for name, each in zip(names, columns, strict=True)
        if wrong(each) or np.any(np.diff(each.numbers.astype(np.int64)) <= 0)
    ]
    kept = [len(each.numbers) for each in columns]
    faults += [
        f"{name}: {sent[n]} sent, {kept[n]} recorded, {lost[name]} counted as lost"
        for n, name in enumerate(names)
        if kept[n] + lost[name] != sent[n]
    ]
    if (counted["frames"], counted["lost"]) != (sum(kept), sum(sent) - sum(kept)):
        faults.append(f"the recorder counted {counted}")
    late_ns = read_ticks(ticks)["late_ns"]
    elapsed_s = max(report["elapsed_s"])
    return Rates(
        tuple(sent), tuple(kept), tuple(lost[name] for name in names), tuple(faults), sum(sent) / elapsed_s,
        int(late_ns[late_ns > LATE_NS].sum()) / NS / buses, counted["cpu_ms"] / 1000 / elapsed_s,
    )  # fmt: skip


def _lost(folder: Path) -> Counter[str]:
    """Frames lost by bus, as the events in the files say."""
    lost = Counter[str]()
    for path in files(folder):
        with open_recording(path, strict=True) as recording:
            for event in recording.events():
                if event.kind is EventKind.FRAMES_LOST:
                    lost[event.bus] += event.details["count"]
    return lost
