"""Expedited SDO transfers by columns: a request and, as the next frame of its server, the answer that ends it."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from app.recording.can_table import Block, Bytes, CanColumns, Flags, Rows, Words
from app.recording.columns.listening import Listening, Wanted
from app.wire import sdo
from app.wire.sdo_follower import LATE_NS

_FULL: Final = 8
_EXPEDITED: Final = 2
_SIZED: Final = 1


class Stream(NamedTuple):
    """The SDO frames of one server in a block, by their rows in it."""

    node: int
    rows: Rows
    columns: CanColumns
    asks: Flags
    """True for those of a client."""

    @classmethod
    def of(cls, block: Block, listening: Listening, node: int) -> Stream:
        """The stream of ``node`` by the identifiers in force."""
        request, response = listening.requests.get(node, -1), listening.responses.get(node, -1)
        rows = np.flatnonzero((block.ids == request) | (block.ids == response))
        columns = block.gather(rows)
        plain = np.flatnonzero(columns.plain)
        if len(plain) < len(rows):
            rows, columns = rows[plain], columns.gather(plain)
        return cls(node, rows, columns, columns.can_id == request)


class Exchanges(NamedTuple):
    """Whole transfers of one server: place of each request in the stream, object, bytes as a number, their count."""

    positions: Rows
    muxes: Words
    words: Words
    size: Bytes
    writes: Flags


def clean_exchanges(stream: Stream, openers: Rows, boots: Rows, wanted: Wanted) -> Exchanges:
    """Those of the requests at positions ``openers`` that are answered at once, and configure no frames.

    ``boots``: rows of the block at which the node started anew, which ends any transfer.
    """
    openers = openers[openers + 1 < len(stream.rows)]
    columns, answers = stream.columns, openers + 1
    words, full = columns.words, columns.lengths == _FULL
    ask, answer = words[openers], words[answers]
    muxes = _mux(ask)
    whole = (
        stream.asks[openers]
        & ~stream.asks[answers]
        & full[openers]
        & full[answers]
        & (muxes == _mux(answer))
        & (columns.t_ns[answers] - columns.t_ns[openers] <= LATE_NS)
        & ~wanted.configuring[muxes & np.uint64(0xFFFF)]
        & (np.searchsorted(boots, stream.rows[openers]) == np.searchsorted(boots, stream.rows[answers]))
    )
    reads = _is(ask, sdo.Command.CCS_UPLOAD) & _is(answer, sdo.Command.SCS_UPLOAD) & _expedited(answer)
    writes = _is(ask, sdo.Command.CCS_DOWNLOAD) & _is(answer, sdo.Command.SCS_DOWNLOAD) & _expedited(ask)
    clean = np.flatnonzero(whole & (reads | writes))
    told = np.where(writes, ask, answer)[clean]
    size = _size(told)
    mask = (np.uint64(1) << size * np.uint64(8)) - np.uint64(1)
    return Exchanges(openers[clean], muxes[clean], told >> np.uint64(32) & mask, size.astype(np.uint8), writes[clean])


def _mux(words: Words) -> Words:
    return words >> np.uint64(8) & np.uint64(0xFFFFFF)


def _is(words: Words, command: sdo.Command) -> Flags:
    flags: Flags = words >> np.uint64(5) & np.uint64(7) == int(command)
    return flags


def _expedited(words: Words) -> Flags:
    flags: Flags = words & np.uint64(_EXPEDITED) != 0
    return flags


def _size(words: Words) -> Words:
    """Bytes of an expedited transfer: 4 where the frame does not tell."""
    unused = words >> np.uint64(2) & np.uint64(3)
    return np.where(words & np.uint64(_SIZED) != 0, np.uint64(4) - unused, np.uint64(4))
