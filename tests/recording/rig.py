"""What the tests of recordings share: a clock that is driven by hand, and recorders on it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from mcap.reader import NonSeekingReader, make_reader
from mcap_ros2.decoder import DecoderFactory

from app.recording.content import AttachedFile, RecorderClock, RecordingInfo
from app.recording.reader import open_recording
from app.recording.writer import RecorderCore, RecorderSettings
from app.wire.frame import Can, Direction, Frame, Stamper

START_NS = 1_750_000_000_000_000_000
MS = 1_000_000
S = 1_000_000_000
INFO = RecordingInfo(
    "wtg-07", "ada", {"can0": 500_000}, {"can0/11": "wtg-07/blade-1/pmc oat-pmc"}, {"hubside": "0.1.0"}
)


class HandClock:
    """Monotonic and wall time that move only when told."""

    def __init__(self) -> None:
        self.monotonic = 5 * S
        self.wall = START_NS
        self.recorder = RecorderClock(
            lambda: self.monotonic, lambda: self.wall, Stamper(START_NS, lambda: self.monotonic)
        )

    def advance(self, ns: int) -> None:
        self.monotonic += ns
        self.wall += ns


class Bench:
    """A recorder without a thread, in steps of 100 ms, with room on the disk as the test says."""

    def __init__(self, directory: Path, settings: RecorderSettings | None = None) -> None:
        self.directory = directory
        self.clock = HandClock()
        self.free = 1 << 40
        settings = settings or RecorderSettings()
        self.core = RecorderCore(directory, INFO, self.clock.recorder, (), settings, lambda _: self.free)
        self.written: list[Frame] = []

    def frames(self, count: int, bus: str = "can0") -> list[Frame]:
        """New frames, stamped now; not yet written."""
        stamp = self.clock.recorder.stamp
        return [Frame(stamp(), bus, Direction.RX, Can(0x181, n.to_bytes(8, "little"))) for n in range(count)]

    def write(self, count: int, bus: str = "can0") -> None:
        frames = self.frames(count, bus)
        self.core.write(frames)
        self.written += frames

    def run(self, seconds: float, per_step: int = 0) -> None:
        """Time goes on, with ``per_step`` frames every 100 ms."""
        for _ in range(round(seconds * 10)):
            self.clock.advance(100 * MS)
            if per_step:
                self.write(per_step)
            self.core.cycle()

    def recorded(self) -> list[Frame]:
        """All frames of all files."""
        return [frame for path in files(self.directory) for frame in frames_of(path)]


def files(directory: Path) -> list[Path]:
    return sorted(directory.glob("*.mcap"))


def frames_of(path: Path, strict: bool = True) -> list[Frame]:
    with open_recording(path, strict) as recording:
        return list(recording.frames())


def record(
    directory: Path,
    frames: Iterable[Frame],
    attachments: Iterable[AttachedFile] = (),
    settings: RecorderSettings | None = None,
) -> Path:
    """Records frames at the times that they bear, a keyframe where one is due; the file."""
    now_ns = START_NS
    clock = RecorderClock(lambda: now_ns - START_NS, lambda: now_ns, lambda: now_ns)
    core = RecorderCore(directory, INFO, clock, attachments, settings or RecorderSettings(min_free_bytes=0))
    due_ns = 0
    for frame in frames:
        now_ns = max(now_ns, frame.t_ns)
        core.write([frame])
        if now_ns >= due_ns:
            due_ns = now_ns + 100 * MS
            if core.keyframe_due():
                core.keyframe({"can0/11": {"6041:00": "1637"}})
            core.cycle()
    core.shut()
    file = core.status().file
    if file is None:
        raise RuntimeError("nothing was recorded")
    return file


def by_mcap(path: Path, streaming: bool = False) -> Iterator[tuple[str, int, object]]:
    """Topic, log time and decoded message, as the mcap library with its ROS 2 support reads them."""
    with path.open("rb") as stream:
        factories = [DecoderFactory()]
        reader = (
            NonSeekingReader(stream, validate_crcs=True, decoder_factories=factories)
            if streaming
            else make_reader(stream, validate_crcs=True, decoder_factories=factories)
        )
        for _, channel, message, decoded in reader.iter_decoded_messages():
            yield channel.topic, message.log_time, decoded
