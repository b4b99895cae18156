"""Makes ``recordings/golden.mcap``: ``python -m tests.recording.make_golden``.

The file holds every kind of content at fixed times. It is the proof of ``docs/recording-format.md``: whoever changes
the format changes this file, in the same commit.
"""

from __future__ import annotations

import sys
from pathlib import Path

from app.recording.cdr import ClockReading
from app.recording.content import AttachedFile, Event, EventKind, RecordingInfo, to_json
from app.recording.part import Batch, Identity, Part, event_entry
from app.wire.frame import Adu, Can, Direction, Fdl, Frame

GOLDEN = Path(__file__).resolve().parents[2] / "recordings" / "golden.mcap"
T_NS = 1_750_000_000_000_000_000
LIBRARY = "hubside golden"
INFO = RecordingInfo(
    turbine="wtg-07",
    who="ada",
    bit_rates={"can0": 500_000},
    nodes={"can0/1": "wtg-07/blade-1/pmm oat-pmm", "can0/11": "wtg-07/blade-1/pmc oat-pmc"},
    versions={"hubside": "0.1.0", "oat-pmc": "1.0.0"},
)
ATTACHMENTS = (AttachedFile("note.txt", "text/plain", "Rotorblatt 1, Prüfstand\n".encode()),)
PAYLOADS: tuple[tuple[str, Direction, Can | Adu | Fdl], ...] = (
    ("can0", Direction.TX, Can(0x000, b"\x01\x0b")),
    ("can0", Direction.RX, Can(0x70B, b"\x05")),
    ("can0", Direction.TX, Can(0x60B, b"\x40\x41\x60\x00\x00\x00\x00\x00")),
    ("can0", Direction.RX, Can(0x58B, b"\x4b\x41\x60\x00\x37\x16\x00\x00")),
    ("can0", Direction.TX, Can(0x080)),
    ("can0", Direction.RX, Can(0x18B, b"\x37\x16\x40\x1f\x00\x00\x00\x00")),
    ("can0", Direction.RX, Can(0x1FFFFFFF, b"\xff", extended=True)),
    ("can0", Direction.RX, Can(0x123, remote=True, dlc=4)),
    ("can0", Direction.RX, Can(0x00000004, bytes(8), extended=True, error=True)),
    ("modbus0", Direction.TX, Adu(b"\x00\x01\x00\x00\x00\x06\x05\x2b\x0d\x00\x00\x00", "127.0.0.1:1502")),
    ("dp0", Direction.RX, Fdl(b"\x10\x05\x02\x49\x50\x16")),
)


def frames() -> list[Frame]:
    """One frame each 51.2 us."""
    return [Frame(T_NS + n * 51_200, bus, direction, payload) for n, (bus, direction, payload) in enumerate(PAYLOADS)]


def clocks() -> list[ClockReading]:
    """One without and one with an adapter's time."""
    return [
        ClockReading(T_NS, 5_000_000_000, T_NS),
        ClockReading(T_NS + 100_000_000, 5_100_000_000, T_NS + 100_000_000, "can0", 7_000, T_NS + 51_200),
    ]


def events() -> list[Event]:
    """A loss and a step of the wall clock."""
    loss = {"count": 3, "from_ns": T_NS, "to_ns": T_NS + 1000, "reason": "adapter"}
    return [
        Event(T_NS + 1000, EventKind.FRAMES_LOST, "can0", loss),
        Event(T_NS + 2000, EventKind.WALL_CLOCK_STEP, "", {"step_ns": -3_000_000_000, "wall_ns": T_NS - 3_000_000_000}),
    ]


STATE = {"values": {"can0/11/6041:00": "3716"}, "mappings": {}, "transfers": []}


def make(path: Path) -> None:
    """Writes the golden content to ``path``, in two batches."""
    part = Part(path, Identity("golden", 1, T_NS, T_NS), INFO, ATTACHMENTS, LIBRARY)
    part.append(Batch(frames()[:6], clocks()[:1], [event_entry(event) for event in events()], [(T_NS, to_json(STATE))]))
    part.append(Batch(frames()[6:], clocks()[1:]))
    part.finish(T_NS + 200_000_000, lost=3)


if __name__ == "__main__":
    GOLDEN.parent.mkdir(exist_ok=True)
    GOLDEN.unlink(missing_ok=True)
    make(GOLDEN)
    sys.stdout.write(f"{GOLDEN}: {GOLDEN.stat().st_size} bytes\n")
