"""The frames of a long recording in the formats of the peers: BLF by python-can, MDF 4.10 by asammdf; made once."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import can
import numpy as np

from app.recording.can_table import CanColumns
from bench._long import VERSION, cache, first_columns, frame_count

_S: Final = 1e9


def blf(path: Path, frames: int) -> Path:
    """The first ``frames`` frames as BLF, packed as python-can does by default."""
    target = cache() / f"peer-{VERSION}-{path.stem}-{frames}.blf"
    if not target.exists():
        columns, making = first_columns(path, frames), target.with_name("making.blf")
        with can.BLFWriter(making) as writer:
            for message in map(_message, map(columns.frame, range(columns.frames))):
                writer.on_message_received(message)
        making.rename(target)
    return target


def _message(frame: Any) -> can.Message:
    payload = frame.payload
    return can.Message(
        timestamp=frame.t_ns / _S,
        arbitration_id=payload.can_id,
        is_extended_id=payload.extended,
        data=payload.data,
        channel=1,
    )


def mdf(path: Path, deflated: bool) -> Path:
    """All frames as bus logging in MDF 4.10: one record a frame, as loggers write it."""
    from asammdf import MDF, Signal

    kind = "deflated" if deflated else "plain"
    target = cache() / f"peer-{VERSION}-{path.stem}-{kind}.mf4"
    if not target.exists():
        columns = first_columns(path, frame_count(path))
        making = target.with_name(f"making-{kind}.mf4")
        with MDF(version="4.10") as file:
            t_s = (columns.t_ns - columns.t_ns[0]).astype(np.float64) / _S
            file.append(Signal(samples=_records(columns), timestamps=t_s, name="CAN_DataFrame"))
            file.save(making, compression=2 if deflated else 0, overwrite=True)
        making.rename(target)
    return target


def _records(columns: CanColumns) -> np.typing.NDArray[np.void]:
    """The structure ``CAN_DataFrame`` of the standard's bus logging (ASAM MDF, "Bus logging")."""
    dtype = np.dtype(
        [
            ("CAN_DataFrame.BusChannel", "<u1"),
            ("CAN_DataFrame.ID", "<u4"),
            ("CAN_DataFrame.IDE", "<u1"),
            ("CAN_DataFrame.DLC", "<u1"),
            ("CAN_DataFrame.DataLength", "<u1"),
            ("CAN_DataFrame.DataBytes", "<u1", (8,)),
            ("CAN_DataFrame.Dir", "<u1"),
        ]
    )
    records = np.zeros(columns.frames, dtype=dtype)
    for name, column in (
        ("ID", columns.can_id),
        ("IDE", columns.extended),
        ("DLC", columns.dlc),
        ("DataLength", columns.lengths),
        ("DataBytes", columns.data),
        ("Dir", columns.tx),
    ):
        records[f"CAN_DataFrame.{name}"] = column
    return records
