"""One signal out of a long recording, read by columns, against a loop over the mcap library's reader.

The position of one axis is read out of a recording of a full bus of 1 Mbit/s: three million frames, or an hour in the
long form. Beside it stand python-can's reader of BLF and asammdf on MDF 4.10, plain and deflated, with the same frames.
Each reads in a process of its own, in turns; the median rounds count. Readers that go message by message read a
beginning of the file: each message costs them the same. All must find the same values where they read the same frames.
"""

from __future__ import annotations

import statistics
from pathlib import Path
from typing import Any, Final, NamedTuple

from bench import _read_files
from bench._long import first_columns, frame_count, long_recording
from bench._priority import preferred
from bench._process import Child
from bench._read import CAN_ID
from bench._result import Result

TARGET: Final = 60.0
PEAK_LIMIT_BYTES: Final = 400_000_000
SHORT_FRAMES: Final = 3_000_000
LOOP_FRAMES: Final = 600_000
FULL_LOOP_FRAMES: Final = 3_000_000
TIMEOUT_S: Final = 900.0


class Rate(NamedTuple):
    """A reader's median: million frames a second as the clock goes, values found, its process' most memory."""

    name: str
    million_per_s: float
    frames: int
    values: int
    total: int
    peak_bytes: int


def run(full: bool) -> Result:
    """Three million frames, or an hour."""
    path = long_recording(None if full else SHORT_FRAMES)
    beginning = long_recording(FULL_LOOP_FRAMES if full else LOOP_FRAMES)
    return measure(path, beginning, rounds=3 if full else 9)


def measure(path: Path, beginning: Path, rounds: int) -> Result:
    """``beginning``: the same frames, but fewer, for readers that go message by message."""
    blf = _read_files.blf(beginning, frame_count(beginning))
    plain, deflated = (_read_files.mdf(path, packed) for packed in (False, True))
    with preferred() as scheduling:
        fast, slow = (
            _in_turns([("ours", "ours", path), ("asammdf", "plain", plain), ("asammdf", "deflated", deflated)], rounds),
            _in_turns([("mcap", "mcap", beginning), ("blf", "blf", blf)], 1),
        )
    ours, mdf, packed_mdf = fast
    mcap, python_can = slow
    return Result(
        ours.million_per_s / mcap.million_per_s,
        TARGET,
        (
            f"{ours.frames} frames of a full bus of 1 Mbit/s, {path.stat().st_size / 1e6:.0f} MB; {rounds} rounds, "
            f"medians; scheduling: {scheduling}",
            _line("ours, by columns", ours),
            _line("mcap's reader in a loop", mcap),
            _line("python-can's BLF reader in a loop", python_can),
            _line("asammdf, MDF 4.10 plain", mdf),
            _line("asammdf, MDF 4.10 deflated", packed_mdf),
        ),
        tuple(_shortfalls(ours, (mcap, python_can), (mdf, packed_mdf), beginning)),
    )


def _line(text: str, rate: Rate) -> str:
    return (
        f"{text}: {rate.million_per_s:.2f} million frames/s, {rate.values} values in {rate.frames} frames, "
        f"peak memory {rate.peak_bytes / 1e6:.0f} MB"
    )


def _shortfalls(ours: Rate, loops: tuple[Rate, ...], columns: tuple[Rate, ...], beginning: Path) -> list[str]:
    found = [f"{peer.name} is ahead of us" for peer in (*loops, *columns) if peer.million_per_s >= ours.million_per_s]
    if ours.peak_bytes > PEAK_LIMIT_BYTES:
        found.append(f"peak memory {ours.peak_bytes / 1e6:.0f} MB, limit {PEAK_LIMIT_BYTES / 1e6:.0f} MB")
    found += [f"{peer.name} found other values" for peer in columns if peer[2:5] != ours[2:5]]
    frames = first_columns(beginning, frame_count(beginning))
    chosen = (frames.can_id == CAN_ID).nonzero()[0]
    total = int(frames.gather(chosen).data[:, :4].copy().view("<i4").sum())
    expected = (frames.frames, len(chosen), total)
    found += [f"{peer.name} found other values" for peer in loops if peer[2:5] != expected]
    return found


def _in_turns(readers: list[tuple[str, str, Path]], rounds: int) -> list[Rate]:
    """Each reader reads once a round; nobody else reads meanwhile."""
    children = [Child("bench._read", reader, str(path)) for reader, _, path in readers]
    answers: list[list[dict[str, Any]]] = [[] for _ in readers]
    try:
        for _ in range(rounds):
            for child, heard in zip(children, answers, strict=True):
                child.tell()
                heard.append(child.hear(TIMEOUT_S))
    finally:
        for child in children:
            child.close()
            child.__exit__(None, None, None)
    return [_rate(name, heard) for (_, name, _), heard in zip(readers, answers, strict=True)]


def _rate(name: str, answers: list[dict[str, Any]]) -> Rate:
    last = answers[-1]
    took_s = statistics.median(answer["took_s"] for answer in answers)
    return Rate(name, last["frames"] / took_s / 1e6, last["frames"], last["values"], last["total"], last["peak_bytes"])
