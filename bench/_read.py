"""One reader of ``reader`` as a process of its own: ``python -m bench._read READER FILE``.

Reads the position of one axis (6064h of node 11 in its TPDO 2) out of the whole file as often as told, one line on
standard input each, and says how long it took, what it found, and the most memory that the process has had.
"""

from __future__ import annotations

import json
import struct
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

CAN_ID: Final = 0x28B
NODE: Final = 11
INDEX: Final = 0x6064


class Found(NamedTuple):
    """Number of frames read, number of values found, and their sum."""

    frames: int
    values: int
    total: int


def ours(path: Path) -> Found:
    """By columns."""
    from app.model.address import Address
    from app.recording.columns import Signal, samples
    from app.recording.reader import open_recording
    from bench._long import BUS

    signal = Signal(BUS, NODE, Address(INDEX))
    with open_recording(path) as recording:
        found = samples(recording, [signal], _described())[signal]
        return Found(recording.frame_count, found.values, int(found.raw.sum()))


def _described() -> Any:
    from app.model.description_file import load_builtin
    from bench._long import BUS

    if not _DESCRIPTIONS:
        _DESCRIPTIONS.update({(BUS, NODE): load_builtin("oat-pmc")})
    return _DESCRIPTIONS


_DESCRIPTIONS: dict[Any, Any] = {}


def by_mcap(path: Path) -> Found:
    """A loop over the messages that the mcap library gives, the fields taken out by ``struct``."""
    from mcap.reader import make_reader

    at = 4 + 8 + 4 + 8  # encapsulation, stamp, length of the frame_id and its 8 bytes
    can_id, position = struct.Struct("<I"), struct.Struct("<i")
    frames, values = 0, []
    with path.open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(topics=["/can0"]):
            frames += 1
            if can_id.unpack_from(message.data, at)[0] == CAN_ID:
                values.append((message.log_time, position.unpack_from(message.data, at + 8)[0]))
    return Found(frames, len(values), sum(value for _, value in values))


def by_blf(path: Path) -> Found:
    """python-can's reader of BLF."""
    import can

    position = struct.Struct("<i")
    frames, values = 0, []
    with can.BLFReader(path) as reader:
        for message in reader:
            frames += 1
            if message.arbitration_id == CAN_ID:
                values.append((message.timestamp, position.unpack_from(message.data)[0]))
    return Found(frames, len(values), sum(value for _, value in values))


def by_asammdf(path: Path) -> Found:
    """asammdf, column by column: times, identifiers, data."""
    from asammdf import MDF

    with MDF(path) as mdf:
        t_s = mdf.get_master(0)
        can_id, _ = mdf.get("CAN_DataFrame.ID", group=0, samples_only=True, raw=True)
        rows = np.flatnonzero(can_id == CAN_ID)
        data, _ = mdf.get("CAN_DataFrame.DataBytes", group=0, samples_only=True, raw=True)
        raw = np.ascontiguousarray(data[rows, :4]).view("<i4").reshape(-1)
        return Found(len(t_s), len(t_s[rows]), int(raw.sum()))


READERS: Final[dict[str, Callable[[Path], Found]]] = {
    "ours": ours,
    "mcap": by_mcap,
    "blf": by_blf,
    "asammdf": by_asammdf,
}


def main() -> None:
    name, path = sys.argv[1], Path(sys.argv[2])
    if name == "ours":
        _described()
    for _ in sys.stdin:
        begin = time.perf_counter()
        found = READERS[name](path)
        took_s = time.perf_counter() - begin
        print(json.dumps({"took_s": took_s, "peak_bytes": _peak_bytes(), **found._asdict()}), flush=True)


def _peak_bytes() -> int:
    """The most memory since the program was started, file mappings included.

    The figure of getrusage(2) is no use: a process begins with that of the one that started it.
    """
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM:"))


if __name__ == "__main__":
    main()
