"""8,000 frames/s of one bus, recorded and decoded, against python-can's Logger writing BLF from the same bus.

A simulated bus of 1 Mbit/s in a process of its own sends every frame singly. Both consumers are connected to it at the
same time, each in a process of its own; what counts is the processor time of all their threads over the same seconds.
Every frame must be in the recording, in its order. The peer records only; ours also follows PDOs and SDO transfers,
keeps the live state and syncs the file to the disk twice a second or so.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import can

from app.recording.reader import open_recording
from app.wire.frame import Frame
from bench._load import frames
from bench._priority import preferred
from bench._process import Child
from bench._result import Result
from bench._site import write_site

BITRATE: Final = 1_000_000
RATE_HZ: Final = 8_000
TARGET: Final = 0.67
WARM_UP_S: Final = 1.0
TAIL_S: Final = 0.5
SETTLE_S: Final = 30.0
PEER_READY: Final = "Can Logger"
IDLE_LOOK_S: Final = 0.3
IDLE_SHARE: Final = 0.1
_NS: Final = 1_000_000_000


class Outcome(NamedTuple):
    """What became of one load. ``ours_s`` and ``peer_s``: processor time in each window."""

    ours_s: list[float]
    peer_s: list[float]
    sent: int
    skipped_s: float
    ours: int
    peer: int
    in_order: bool
    values: int
    lost: int


def run(full: bool) -> Result:
    """Three windows of 10 s; thirty in the long form. The median ratio counts."""
    return measure(windows=30 if full else 3, seconds=10.0)


def measure(windows: int, seconds: float, rate_hz: int = RATE_HZ) -> Result:
    """Run and compare."""
    with preferred() as scheduling, tempfile.TemporaryDirectory() as name:
        done = record_both(Path(name), windows, seconds, rate_hz)
    ratios = [peer_s / ours_s for ours_s, peer_s in zip(done.ours_s, done.peer_s, strict=True)]
    ours, peer = (statistics.median(times) / seconds for times in (done.ours_s, done.peer_s))
    return Result(
        statistics.median(ratios),
        TARGET,
        (
            f"{rate_hz} frames/s on {BITRATE} bit/s, {windows} windows of {seconds:g} s, both at the same time; "
            f"medians; scheduling: {scheduling}",
            f"sent {done.sent} frames, in our file {done.ours}, in the peer's {done.peer}",
            f"ours, recorded and decoded ({done.values} objects): {ours:.1%} of a core",
            f"python-can Logger to BLF, recorded: {peer:.1%} of a core",
            f"ratios {' '.join(f'{ratio:.2f}' for ratio in ratios)}",
        ),
        tuple(_shortfalls(done)),
    )


def _shortfalls(done: Outcome) -> Iterator[str]:
    if done.ours != done.sent or done.lost:
        yield f"{done.sent - done.ours} frames lost, {done.lost} of them counted by the recorder"
    elif not done.in_order:
        yield "frames recorded in another order, or with other bytes"
    if done.skipped_s:
        yield f"the bus stood still for {done.skipped_s:.2f} s: a busy machine"


def record_both(folder: Path, windows: int, seconds: float, rate_hz: int) -> Outcome:
    """One load, both consumers, with their files in ``folder``."""
    blf, recordings = folder / "peer.blf", folder / "ours"
    count = int((WARM_UP_S + windows * seconds + TAIL_S) * rate_hz)
    with Child("bench._source", "--bitrate", str(BITRATE)) as source:
        address = source.hear()["address"]
        host, port = address.split(":")
        site = write_site(folder, address, BITRATE)
        with (
            Child("bench._record_peer", host, port, str(blf), quiet=True) as peer,
            Child("bench._record_ours", str(site), str(recordings)) as ours,
        ):
            peer.wait_for(PEER_READY)
            ours.hear()
            source.tell(count=count, period_ns=_NS // rate_hz)
            source.hear()
            ours_s, peer_s = _windows(ours, peer, windows, seconds)
            report = source.hear(seconds + SETTLE_S)
            for consumer in (ours, peer):
                _settle(consumer)
            ours.close()
            kept = ours.hear()
    if report["dropped_clients"]:
        raise RuntimeError("a consumer did not read, and the bus dropped it")
    recorded = [each.payload for each in _frames(recordings)]
    return Outcome(
        ours_s, peer_s, report["sent"], report["skipped_s"], len(recorded), _count_blf(blf),
        recorded == frames(count), kept["values"], kept["lost"],
    )  # fmt: skip


def _windows(ours: Child, peer: Child, windows: int, seconds: float) -> tuple[list[float], list[float]]:
    """Processor time of both in each window, the warm-up left out."""
    time.sleep(WARM_UP_S)
    ours_s, peer_s = [_cpu_s(ours)], [_cpu_s(peer)]
    for _ in range(windows):
        time.sleep(seconds)
        ours_s.append(_cpu_s(ours))
        peer_s.append(_cpu_s(peer))
    return [after - before for before, after in pairwise(ours_s)], [b - a for a, b in pairwise(peer_s)]


def _cpu_s(consumer: Child) -> float:
    consumer.tell()
    seconds: float = consumer.hear()["cpu_s"]
    return seconds


def _settle(consumer: Child) -> None:
    """Wait until the consumer has nothing left to do. Raises TimeoutError."""
    deadline = time.monotonic() + SETTLE_S
    before_s = _cpu_s(consumer)
    while time.monotonic() < deadline:
        time.sleep(IDLE_LOOK_S)
        now_s = _cpu_s(consumer)
        if now_s - before_s < IDLE_LOOK_S * IDLE_SHARE:
            return
        before_s = now_s
    raise TimeoutError(f"{consumer.module} does not come to rest")


def _frames(folder: Path) -> Iterator[Frame]:
    for path in sorted(folder.glob("*.mcap")):
        with open_recording(path, strict=True) as recording:
            yield from recording.frames()


def _count_blf(path: Path) -> int:
    with can.BLFReader(path) as reader:
        return sum(1 for _ in reader)
