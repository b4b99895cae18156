"""A long recording of a full bus of 1 Mbit/s: what a turbine's twins sent at work, again and again; made once and kept.

The frames are those of ``recordings/scenarios/1-normal-operation.mcap``, which the twins made: three axes in the wind,
their controller's SYNC and set-points, PDOs, SDO polling and heartbeats. It begins as recorded, boot-ups and all; what
follows the first seconds is repeated. Each frame follows the one before as soon as the bus is free, so that the bus is
always full: about 9,000 frames/s. Chunks are as the recorder closes them on such a bus, every 0.4 s.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from app.recording.can_table import CanColumns, concatenated
from app.recording.cdr import NS, CanArray, encode_can
from app.recording.chunks import Level, can_body, compressor, encode_chunk
from app.recording.columns import can_columns
from app.recording.content import METADATA_BIT_RATES, METADATA_RECORDING, METADATA_TOTALS
from app.recording.mcap_file import McapFile
from app.recording.reader import open_recording
from app.recording.schemas import ALL_TYPES, CAN_FRAME, bus_topic
from app.wire.can_bits import frame_bits
from app.wire.frame import STAMP_STEP_NS, Can

BUS: Final = "can0"
BIT_NS: Final = 1000
START_NS: Final = 1_772_431_200_000_000_000
HOUR_NS: Final = 3600 * NS
CHUNK_NS: Final = 400_000_000
SET_UP_FRAMES: Final = 2000
"""Frames at the beginning that are not repeated: boot-ups, and the controller setting up its devices."""
SOURCE: Final = Path(__file__).resolve().parent.parent / "recordings" / "scenarios" / "1-normal-operation.mcap"
VERSION: Final = 1
"""Of what is made here; raised with it."""


def cache() -> Path:
    """The folder of generated inputs, outside the working copy."""
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "hubside-bench"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def long_recording(frames: int | None) -> Path:
    """The recording of so many frames, or of an hour."""
    path = cache() / f"long-{VERSION}-{frames or 'hour'}.mcap"
    if not path.exists():
        making = path.with_suffix(".making")
        making.unlink(missing_ok=True)
        _write(making, frames)
        making.rename(path)
    return path


def first_columns(path: Path, frames: int) -> CanColumns:
    """The first ``frames`` frames of a long recording, or all where it is shorter."""
    pieces, count = [], 0
    for columns in can_columns(path):
        pieces.append(columns)
        count += columns.frames
        if count >= frames:
            break
    return concatenated(pieces).gather(slice(0, frames))


def frame_count(path: Path) -> int:
    """How many frames a recording has."""
    with open_recording(path) as recording:
        return recording.frame_count


def _write(path: Path, count: int | None) -> None:
    file = McapFile(path)
    file.add_metadata(METADATA_RECORDING, {"schema": "1", "id": "long", "part": "1", "started_ns": str(START_NS)})
    file.add_metadata(METADATA_BIT_RATES, {BUS: str(NS // BIT_NS)})
    schemas = {kind: file.add_schema(kind) for kind in ALL_TYPES}
    channel = file.add_channel(bus_topic(BUS), schemas[CAN_FRAME], {"bus": BUS})
    packer, written = compressor(Level.BUSY), 0
    for records in _chunks(channel):
        if count is not None:
            records = records[: count - written]
        elif int(records["log_time"][0]) - START_NS >= HOUR_NS:
            break
        if not len(records):
            break
        file.add_chunk(encode_chunk(can_body(channel, records), packer, with_index=True))
        written += len(records)
    file.add_metadata(METADATA_TOTALS, {"frames": str(written), "lost": "0", "closed_ns": "0"})
    file.finish()


def _chunks(channel: int) -> Iterator[CanArray]:
    """Message records of endless traffic, in chunks of 0.4 s."""
    with open_recording(SOURCE) as recording:
        frames = [frame for frame in recording.frames() if frame.bus == BUS]
    bits = [frame_bits(frame.payload) for frame in frames if isinstance(frame.payload, Can)]
    records = encode_can(channel, BUS, frames)
    lengths_ns = np.array(bits, dtype=np.uint64) * np.uint64(BIT_NS)
    t_ns, tile, tile_ns = START_NS, records, lengths_ns
    while True:
        ends = np.uint64(t_ns) + np.cumsum(tile_ns)
        yield from _cut(_stamped(tile, ends - ends % np.uint64(STAMP_STEP_NS)))
        t_ns = int(ends[-1])
        tile, tile_ns = records[SET_UP_FRAMES:], lengths_ns[SET_UP_FRAMES:]


def _stamped(records: CanArray, t_ns: np.typing.NDArray[np.uint64]) -> CanArray:
    stamped = records.copy()
    stamped["log_time"] = stamped["publish_time"] = t_ns
    stamped["sec"], stamped["nanosec"] = t_ns // np.uint64(NS), t_ns % np.uint64(NS)
    return stamped


def _cut(records: CanArray) -> Iterator[CanArray]:
    numbers = (records["log_time"] - np.uint64(START_NS)) // np.uint64(CHUNK_NS)
    borders = np.flatnonzero(np.diff(numbers)) + 1
    yield from np.split(records, borders)
