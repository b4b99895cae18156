"""A process that records until it is killed, or for a number of batches: ``DIRECTORY PROGRESS [BATCHES]``.

After each batch it has handed over, the time stamp of the last frame stands in the file PROGRESS.
"""

from __future__ import annotations

import mmap
import sys
import time
from itertools import count
from pathlib import Path

from app.recording.content import RecorderClock
from app.recording.writer import Recorder, RecorderSettings
from app.wire.frame import Can, Direction, Frame, Stamper
from tests.recording.rig import INFO

BATCH = 10
PERIOD_S = 0.005


def main() -> None:
    directory, progress = Path(sys.argv[1]), Path(sys.argv[2])
    batches = range(int(sys.argv[3])) if len(sys.argv) > 3 else count()
    stamp = Stamper(time.time_ns(), time.monotonic_ns)
    clock = RecorderClock(time.monotonic_ns, time.time_ns, stamp)
    recorder = Recorder(directory, INFO, clock, settings=RecorderSettings(min_free_bytes=0))
    with progress.open("r+b") as file, mmap.mmap(file.fileno(), 8) as shared:
        for n in batches:
            data = (n * BATCH).to_bytes(8, "little")
            frames = [Frame(stamp(), "can0", Direction.RX, Can(0x181 + k, data)) for k in range(BATCH)]
            recorder.write(frames)
            shared[:8] = frames[-1].t_ns.to_bytes(8, "little")
            time.sleep(PERIOD_S)
    recorder.close()


if __name__ == "__main__":
    main()
