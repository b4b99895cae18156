"""How many bytes a frame takes: in a recording as it is written, with message indexes, and in its archive form.

The recording is the real one: chunks as the recorder's time limits close them, clock readings, a state keyframe of
six nodes every five seconds, metadata and an attachment. No peer writes these; ratio = limit / ours, the worse one.
"""

from __future__ import annotations

import random
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from app.recording.content import AttachedFile, RecorderClock, RecordingInfo
from app.recording.pack import pack
from app.recording.writer import RecorderCore, RecorderSettings
from app.wire.frame import Frame
from bench._result import Result
from bench._traffic import NODES, OBJECTS, START_NS, traffic

LIMIT_LIVE = 30.0
LIMIT_PACKED = 14.0
CYCLE_NS = 100_000_000
DESCRIPTION_BYTES = 40_000  # about the size of a device description


class Sizes(NamedTuple):
    """Bytes a frame of the live and the packed file, and frames a second of the traffic."""

    live: float
    packed: float
    frames_per_s: float


def record(directory: Path, frames: Sequence[Frame]) -> Path:
    """Records frames as they would have come, on a clock that follows their times."""
    now_ns = START_NS
    clock = RecorderClock(lambda: now_ns - START_NS, lambda: now_ns, lambda: now_ns)
    info = RecordingInfo("wtg-07", "bench", {"can0": 500_000}, {f"can0/{node}": f"node-{node}" for node in NODES})
    chance = random.Random(2)
    description = bytes(chance.choices(b"abcdefgh =.\n", k=DESCRIPTION_BYTES))
    settings = RecorderSettings(min_free_bytes=0, max_file_bytes=1 << 40)
    attachments = [AttachedFile("oat-pmc.toml", "application/toml", description)]
    recorder = RecorderCore(directory, info, clock, attachments, settings)
    values = {f"{n:04X}:00": f"{chance.getrandbits(32):08x}" for n in range(OBJECTS)}
    state = {f"can0/{node}": values for node in NODES}
    due_ns = START_NS
    for frame in frames:
        now_ns = frame.t_ns
        recorder.write((frame,))
        if now_ns >= due_ns:
            due_ns += CYCLE_NS
            if recorder.keyframe_due():
                recorder.keyframe(state)
            recorder.cycle()
    recorder.shut()
    file = recorder.status().file
    if file is None:
        raise RuntimeError("nothing was recorded")
    return file


def measure(count: int) -> Sizes:
    """Records and packs ``count`` frames."""
    frames = traffic(count)
    with tempfile.TemporaryDirectory() as name:
        live = record(Path(name), frames)
        packed = Path(name) / "packed.mcap"
        pack(live, packed)
        seconds = (frames[-1].t_ns - frames[0].t_ns) / 1e9
        return Sizes(live.stat().st_size / count, packed.stat().st_size / count, count / seconds)


def run(full: bool) -> Result:
    """30 s of traffic, or ten minutes in the long form."""
    sizes = measure(2_400_000 if full else 120_000)
    return Result(
        ratio=min(LIMIT_LIVE / sizes.live, LIMIT_PACKED / sizes.packed),
        target=1.0,
        lines=(
            f"traffic {sizes.frames_per_s:.0f} frames/s",
            f"recording {sizes.live:.2f} bytes a frame, limit {LIMIT_LIVE:g}",
            f"packed {sizes.packed:.2f} bytes a frame, limit {LIMIT_PACKED:g}",
        ),
    )
