"""Makes SDO conversations and frames byte by byte, for tests of those who follow them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from app.model.address import Address
from app.wire import sdo
from app.wire.frame import Can, Direction, Frame

BUS = "can0"


class Line(NamedTuple):
    """One frame of a conversation: from the client or from the server."""

    client: bool
    data: bytes


def read(address: Address, data: bytes) -> list[Line]:
    """A read: expedited up to 4 bytes, else segmented."""
    lines = [Line(True, sdo.upload_request(address)), Line(False, sdo.upload_response(address, data))]
    if 0 < len(data) <= 4:
        return lines
    for toggle, part, last in _segments(data):
        lines.append(Line(True, sdo.upload_segment_request(toggle)))
        lines.append(Line(False, sdo.upload_segment_response(part, toggle, last)))
    return lines


def write(address: Address, data: bytes) -> list[Line]:
    """A write: expedited up to 4 bytes, else segmented."""
    lines = [Line(True, sdo.download_request(address, data)), Line(False, sdo.download_response(address))]
    if 0 < len(data) <= 4:
        return lines
    for toggle, part, last in _segments(data):
        lines.append(Line(True, sdo.download_segment_request(part, toggle, last)))
        lines.append(Line(False, sdo.download_segment_response(toggle)))
    return lines


def _segments(data: bytes) -> list[tuple[bool, bytes, bool]]:
    parts = [data[i : i + 7] for i in range(0, len(data), 7)] or [b""]
    return [(bool(i % 2), part, i == len(parts) - 1) for i, part in enumerate(parts)]


def block_read(
    address: Address, data: bytes, block: int = 127, losses: Iterable[int] = (), crc: bool = True
) -> list[Line]:
    """A block read. ``losses`` numbers the segments, in the order sent, that the client does not get."""
    lines = [
        Line(True, sdo.block_upload_request(address, block, crc=crc)),
        Line(False, sdo.block_upload_response(address, len(data), crc=crc)),
        Line(True, sdo.block_upload_start()),
    ]
    lines += _sub_blocks(data, block, set(losses), sender_is_client=False)
    lines.append(Line(False, sdo.block_end(-len(data) % 7, sdo.crc(data) if crc else 0)))
    lines.append(Line(True, sdo.block_end_response()))
    return lines


def block_write(
    address: Address, data: bytes, block: int = 127, losses: Iterable[int] = (), crc: bool = True
) -> list[Line]:
    """A block write. ``losses`` numbers the segments, in the order sent, that the server does not get."""
    lines = [
        Line(True, sdo.block_download_request(address, len(data), crc=crc)),
        Line(False, sdo.block_download_response(address, block, crc=crc)),
    ]
    lines += _sub_blocks(data, block, set(losses), sender_is_client=True)
    lines.append(Line(True, sdo.block_end(-len(data) % 7, sdo.crc(data) if crc else 0)))
    lines.append(Line(False, sdo.block_end_response()))
    return lines


def _sub_blocks(data: bytes, block: int, losses: set[int], sender_is_client: bool) -> list[Line]:
    parts = [data[i : i + 7] for i in range(0, len(data), 7)]
    lines, position, sent = [], 0, 0
    while position < len(parts):
        received, in_order = 0, True
        for sequence, part in enumerate(parts[position : position + block], 1):
            last = position + sequence == len(parts)
            lines.append(Line(sender_is_client, sdo.block_segment(sequence, part, last)))
            in_order = in_order and sent not in losses
            received += in_order
            sent += 1
        lines.append(Line(not sender_is_client, sdo.block_acknowledge(received, block)))
        position += received
    return lines


def frame(t_ns: int, can_id: int, data: bytes, direction: Direction = Direction.RX) -> Frame:
    return Frame(t_ns, BUS, direction, Can(can_id, data))


def frames(node: int, lines: Iterable[Line], t_ns: int = 0) -> list[Frame]:
    """The conversation with ``node`` in frames, 1 ms apart."""
    return [
        frame(t_ns + i * 1_000_000, (0x600 if line.client else 0x580) + node, line.data) for i, line in enumerate(lines)
    ]
