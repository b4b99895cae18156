"""CAN frames in message records of any form that others write: any frame_id, either byte order, topics mixed.

Messages of the same topic and the same length are read together as one matrix of bytes; what differs from one such
group to the next is found out once for each. The bus is the topic's name, its direction the frame_id's or the topic's:

- a frame_id as ours, ``can0/tx``, tells both;
- ``/can0/from_can_bus`` and ``/can0/to_can_bus`` (also ``received_messages`` and ``sent_messages``, ``rx`` and ``tx``)
  are the two ways of ``can0``;
- else the frames of ``/can0`` were received on ``can0``; without any name the frame_id is the bus, or ``can``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from operator import itemgetter
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from mcap.records import Channel, Schema

from app.recording.can_table import CanColumns, Ids, Rows, Times, concatenated
from app.recording.cdr import (
    MAX_DATA,
    MAX_DLC,
    MAX_ID,
    MESSAGE_FIXED,
    OP_MESSAGE,
    RECORD_PREFIX,
    Representation,
    decode_telegram,
)
from app.recording.chunks import Body, join_bodies
from app.recording.schemas import CAN_FRAME, MESSAGE_ENCODING, TELEGRAM
from app.wire.frame import Direction, Frame

PAYLOAD_AT: Final = RECORD_PREFIX.size + MESSAGE_FIXED
_CHANNEL_AT: Final = 9
_TIME_AT: Final = 15
_TEXT_AT: Final = 16  # in a payload: behind encapsulation, stamp and length of the frame_id
_BEHIND_TEXT: Final = 16  # id, flags, dlc, data
_UNNAMED: Final = "can"
_WAYS: Final = {
    "from_can_bus": Direction.RX,
    "received_messages": Direction.RX,
    "received": Direction.RX,
    "rx": Direction.RX,
    "to_can_bus": Direction.TX,
    "sent_messages": Direction.TX,
    "sent": Direction.TX,
    "tx": Direction.TX,
}
_Matrix = npt.NDArray[np.uint8]


class Messages(NamedTuple):
    """The message records in a stretch of records: where each begins, its length with its head, topic and log time.

    ``others``: where records of other kinds begin.
    """

    data: bytes
    others: list[int]
    offsets: Rows
    sizes: Rows
    channels: npt.NDArray[np.uint16]
    t_ns: Times


def messages_in(data: bytes) -> Messages:
    """Finds them; records of other kinds are passed over. Raises ``ValueError`` where the records are not whole."""
    offsets, sizes, others, at = [], [], [], 0
    while at < len(data):
        if at + RECORD_PREFIX.size > len(data):
            raise ValueError("ends inside a record")
        opcode, length = RECORD_PREFIX.unpack_from(data, at)
        size = RECORD_PREFIX.size + length
        if not opcode or at + size > len(data) or (opcode == OP_MESSAGE and length < MESSAGE_FIXED):
            raise ValueError("holds something that is no record")
        if opcode == OP_MESSAGE:
            offsets.append(at)
            sizes.append(size)
        else:
            others.append(at)
        at += size
    starts = np.array(offsets, dtype=np.intp)
    raw = np.frombuffer(data, dtype=np.uint8)
    channels = _matrix(raw, starts, _CHANNEL_AT, 2).view("<u2").reshape(-1)
    t_ns = _matrix(raw, starts, _TIME_AT, 8).view("<u8").reshape(-1)
    return Messages(data, others, starts, np.array(sizes, dtype=np.intp), channels, t_ns)


def _matrix(raw: _Matrix, offsets: Rows, at: int, size: int) -> _Matrix:
    """``size`` bytes behind each offset plus ``at``, one row each."""
    matrix: _Matrix = raw[(offsets + at)[:, None] + np.arange(size)]
    return matrix


class Loose(NamedTuple):
    """CAN frames of a chunk by bus, and what was left out: how many messages, by reason.

    ``places``: which message of the chunk each frame is.
    """

    buses: dict[str, CanColumns]
    places: dict[str, Rows]
    left_out: Counter[str]


class LooseFrames(NamedTuple):
    """Frames of a chunk by time, and what was left out: how many messages, by reason."""

    frames: list[Frame]
    left_out: Counter[str]


def can_frames(data: bytes, channels: Mapping[int, Channel], schemas: Mapping[int, Schema]) -> Loose:
    """The CAN frames among uncompressed records, those of each bus by time. Raises ``ValueError``."""
    messages = messages_in(data)
    pieces: dict[str, list[tuple[Rows, CanColumns]]] = {}
    left_out: Counter[str] = Counter()
    for channel_id in np.unique(messages.channels).tolist():
        channel = channels.get(channel_id)
        if channel is None or _type_name(channel, schemas) != CAN_FRAME.name:
            continue
        of_channel = np.flatnonzero(messages.channels == channel_id)
        for size in np.unique(messages.sizes[of_channel]).tolist():
            rows = of_channel[messages.sizes[of_channel] == size]
            matrix = _matrix(np.frombuffer(data, np.uint8), messages.offsets[rows], PAYLOAD_AT, size - PAYLOAD_AT)
            for bus, which, columns in _read(matrix, channel.topic, messages.t_ns[rows], left_out):
                pieces.setdefault(bus, []).append((rows[which], columns))
    ordered = {bus: _in_order(found) for bus, found in pieces.items()}
    buses = {bus: columns for bus, (columns, _) in ordered.items()}
    return Loose(buses, {bus: rows for bus, (_, rows) in ordered.items()}, left_out)


def frames_in(data: bytes, channels: Mapping[int, Channel], schemas: Mapping[int, Schema]) -> LooseFrames:
    """All frames among uncompressed records by time, CAN and others. Raises ``ValueError`` as ``messages_in``."""
    loose = can_frames(data, channels, schemas)
    found = [
        (frame.t_ns, place, frame)
        for bus, columns in loose.buses.items()
        for place, frame in zip(loose.places[bus].tolist(), map(columns.frame, range(columns.frames)), strict=True)
    ]
    for t_ns, payload in payloads_in(data, channels, schemas, TELEGRAM.name):
        try:
            found.append((t_ns, -1, decode_telegram(payload)._replace(t_ns=t_ns)))
        except ValueError as error:
            loose.left_out[str(error)] += 1
    found.sort(key=itemgetter(0, 1))
    return LooseFrames([frame for _, _, frame in found], loose.left_out)


def payloads_in(
    data: bytes, channels: Mapping[int, Channel], schemas: Mapping[int, Schema], type_name: str
) -> list[tuple[int, bytes]]:
    """Log times and payloads of the messages of one type, by time. Raises ``ValueError`` as ``messages_in``."""
    messages = messages_in(data)
    wanted = [number for number, channel in channels.items() if _type_name(channel, schemas) == type_name]
    rows = np.flatnonzero(np.isin(messages.channels, wanted))
    rows = rows[np.argsort(messages.t_ns[rows], kind="stable")]
    columns = (messages.t_ns[rows], messages.offsets[rows], messages.sizes[rows])
    spans = zip(*(column.tolist() for column in columns), strict=True)
    return [(t_ns, data[at + PAYLOAD_AT : at + size]) for t_ns, at, size in spans]


def bodies_in(data: bytes) -> Iterator[Body]:
    """The messages of each topic as a body of its own. Raises ``ValueError`` as ``messages_in``."""
    messages = messages_in(data)
    for channel_id in np.unique(messages.channels).tolist():
        rows = np.flatnonzero(messages.channels == channel_id)
        spans = zip(messages.offsets[rows].tolist(), messages.sizes[rows].tolist(), strict=True)
        pieces = [data[at : at + size] for at, size in spans]
        sizes = messages.sizes[rows].astype(np.uint64)
        yield join_bodies([Body(channel_id, b"".join(pieces), messages.t_ns[rows], np.cumsum(sizes) - sizes)])


def _type_name(channel: Channel, schemas: Mapping[int, Schema]) -> str:
    schema = schemas.get(channel.schema_id)
    return "" if schema is None or channel.message_encoding != MESSAGE_ENCODING else schema.name


def _in_order(pieces: list[tuple[Rows, CanColumns]]) -> tuple[CanColumns, Rows]:
    """By time; where that is equal as they stand in the file."""
    rows = np.concatenate([rows for rows, _ in pieces])
    whole = concatenated([columns for _, columns in pieces])
    order = np.lexsort((rows, whole.t_ns))
    return whole.gather(order), rows[order]


def _read(matrix: _Matrix, topic: str, t_ns: Times, left_out: Counter[str]) -> Iterator[tuple[str, Rows, CanColumns]]:
    """The frames in payloads of one length, by bus, with their places; what cannot be read is counted."""
    if matrix.shape[1] < _TEXT_AT + _BEHIND_TEXT:
        left_out["message too short"] += len(matrix)
        return
    heads = matrix[:, :2].copy().view(">u2").reshape(-1)
    for head in np.unique(heads).tolist():
        alike = np.flatnonzero(heads == head)
        try:
            order = Representation(head).order
        except ValueError:
            left_out[f"CDR representation {head:04x}h is not known"] += len(alike)
            continue
        lengths = matrix[alike, 12:16].copy().view(f"{order}u4").reshape(-1)
        for length in np.unique(lengths).tolist():
            which = alike[lengths == length]
            if matrix.shape[1] < _TEXT_AT + -(-length // 4) * 4 + _BEHIND_TEXT:
                left_out["message ends too soon"] += len(which)
                continue
            yield from _named(matrix[which], topic, t_ns[which], which, (order, length), left_out)


def _named(
    matrix: _Matrix, topic: str, t_ns: Times, which: Rows, form: tuple[str, int], left_out: Counter[str]
) -> Iterator[tuple[str, Rows, CanColumns]]:
    """Frames whose frame_ids have one length, by bus. ``form``: byte order and that length."""
    order, length = form
    texts = np.ascontiguousarray(matrix[:, _TEXT_AT : _TEXT_AT + length])
    names, place = _distinct(texts)
    dtype = np.dtype([("id", f"{order}u4"), ("marks", "u1", 4), ("data", "u1", 8)])
    at = _TEXT_AT + -(-length // 4) * 4
    fields = np.ascontiguousarray(matrix[:, at : at + _BEHIND_TEXT]).view(dtype).reshape(-1)
    sound = (fields["id"] <= MAX_ID) & (fields["marks"][:, 3] <= MAX_DLC)
    if not sound.all():
        left_out["identifier or length that no classic CAN frame has"] += int(np.count_nonzero(~sound))
    told = [bus_of(topic, name.decode("utf-8", "replace").rstrip("\0")) for name in names]
    for bus in dict.fromkeys(bus for bus, _ in told):
        mine = np.array([name for name, _ in told]) == bus
        rows = np.flatnonzero(sound & mine[place])
        if len(rows):
            sent = np.array([direction is Direction.TX for _, direction in told])[place[rows]]
            yield bus, which[rows], _columns(bus, t_ns[rows], sent, fields[rows])


def _distinct(texts: _Matrix) -> tuple[list[bytes], Rows]:
    """The different rows of a matrix, and which of them each row is."""
    if not texts.shape[1] or bool((texts == texts[0]).all()):
        return [texts[0].tobytes()], np.zeros(len(texts), dtype=np.intp)
    rows = texts.view(f"V{texts.shape[1]}").reshape(-1).tolist()
    names = list(dict.fromkeys(rows))
    numbers = {name: n for n, name in enumerate(names)}
    return names, np.array([numbers[row] for row in rows], dtype=np.intp)


def _columns(bus: str, t_ns: Times, sent: Any, fields: npt.NDArray[np.void]) -> CanColumns:
    marks = fields["marks"]
    flags = marks[:, :3] != 0
    ids: Ids = fields["id"].astype(np.uint32)
    dlc = np.ascontiguousarray(marks[:, 3])
    columns = CanColumns(bus, t_ns, ids, sent, flags[:, 1], flags[:, 0], flags[:, 2], dlc, fields["data"].copy())
    columns.data[np.arange(MAX_DATA) >= columns.lengths[:, None]] = 0  # whatever the writer left there
    return columns


def bus_of(topic: str, frame_id: str) -> tuple[str, Direction]:
    """Bus and direction of frames by their topic and frame_id."""
    bus, _, word = frame_id.rpartition("/")
    if bus and word in (Direction.RX.value, Direction.TX.value):
        return bus, Direction(word)
    path, _, last = topic.strip("/").rpartition("/")
    way = _WAYS.get(last)
    if way is not None:
        return path or frame_id or _UNNAMED, way
    return topic.strip("/") or frame_id or _UNNAMED, Direction.RX
