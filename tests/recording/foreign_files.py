"""Writes MCAP files as other programs do: by the ``mcap`` library, with messages put together field by field."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from mcap.writer import CompressionType, Writer

from app.recording.schemas import CAN_FRAME
from app.wire.frame import Can, Frame

_IMU: Final = "geometry_msgs/msg/Vector3"


@dataclass(frozen=True)
class Form:
    """How a file is written. ``order``: byte order of CDR; ``frame_id`` None: as ours; ``topic`` with ``{bus}``."""

    order: str = "<"
    frame_id: str | None = "base_link"
    topic: str = "/{bus}"
    compression: CompressionType = CompressionType.ZSTD
    chunked: bool = True
    chunk_bytes: int = 20_000
    mixed: bool = False
    """Another topic's messages between the frames."""
    sequences: bool = False
    published_late_ns: int = 0
    stamp_early_ns: int = 0
    summary: bool = True
    crcs: bool = True
    garbage: bool = False
    """Bytes behind the data of a frame that are not zero."""


def payload(frame: Frame, form: Form) -> bytes:
    """A ``can_msgs/msg/Frame`` in CDR."""
    can, order = frame.payload, form.order
    assert isinstance(can, Can)
    text = (f"{frame.bus}/{frame.direction.value}" if form.frame_id is None else form.frame_id).encode() + b"\0"
    stamp_ns = frame.t_ns - form.stamp_early_ns
    head = struct.pack(f"{order}iII", stamp_ns // 10**9, stamp_ns % 10**9, len(text))
    data = can.data.ljust(8, b"\xa5" if form.garbage else b"\0")
    flags = (can.remote, can.extended, can.error)
    body = struct.pack(f"{order}I???B8s", can.can_id, *flags, can.length, data)
    encapsulation = b"\0\1\0\0" if order == "<" else b"\0\0\0\0"
    return encapsulation + head + text + bytes(-len(text) % 4) + body


def write(path: Path, frames: Sequence[Frame], form: Form, finish: bool = True) -> Path:
    """The file; not ``finish``: what is there when the program is killed, the last chunk not written."""
    with path.open("wb") as stream:
        writer = Writer(
            stream,
            chunk_size=form.chunk_bytes,
            compression=form.compression,
            use_chunking=form.chunked,
            use_summary_offsets=form.summary,
            use_statistics=form.summary,
            repeat_channels=form.summary,
            repeat_schemas=form.summary,
            enable_crcs=form.crcs,
        )
        writer.start("ros2", "another program")
        can_type = writer.register_schema(CAN_FRAME.name, "ros2msg", CAN_FRAME.text.encode())
        other_type = writer.register_schema(_IMU, "ros2msg", b"float64 x\nfloat64 y\nfloat64 z\n")
        other = writer.register_channel("/imu", "cdr", other_type)
        topics: dict[str, int] = {}
        for n, frame in enumerate(frames):
            topic = form.topic.format(bus=frame.bus, way=frame.direction.value)
            if topic not in topics:
                topics[topic] = writer.register_channel(topic, "cdr", can_type)
            sequence, publish_ns = n if form.sequences else 0, frame.t_ns + form.published_late_ns
            writer.add_message(topics[topic], frame.t_ns, payload(frame, form), publish_ns, sequence)
            if form.mixed and n % 3 == 0:
                writer.add_message(other, frame.t_ns, struct.pack("<4x3d", n, n, n), frame.t_ns)
        if finish:
            writer.finish()  # type: ignore[no-untyped-call]
    return path
