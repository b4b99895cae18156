"""Values of one object as columns: gathered piece by piece, put in order, and turned into numbers of its data type."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from app.model.datatypes import DataType
from app.recording.can_table import Bytes, Rows, Times, Words
from app.wire.records import Source

SOURCES: Final = tuple(Source)
"""What the numbers in ``Samples.source`` mean."""
LONG: Final = 255
"""Stands in ``Samples.size`` for more than 8 bytes."""
_WORD: Final = 8
_FLOATS: Final = {DataType.REAL32: (4, "<u4", "<f4"), DataType.REAL64: (8, "<u8", "<f8")}
_TEXTS: Final = frozenset(
    {
        DataType.VISIBLE_STRING,
        DataType.OCTET_STRING,
        DataType.UNICODE_STRING,
        DataType.DOMAIN,
        DataType.TIME_OF_DAY,
        DataType.TIME_DIFFERENCE,
    }
)


class Samples(NamedTuple):
    """All values of one object in the order seen: one array a field, all of the same length n.

    ``raw``: int64 for INTEGER types, uint64 for UNSIGNED, BOOLEAN and undescribed ones, float64 for REAL, else bytes
    as Python objects. ``source``: place in ``Source``. ``size``: bytes as they came, 255 for more than 8; a size that
    is not the type's makes a number read by its own width. ``others``: the bytes, by position, of values that ``raw``
    cannot hold, where it is 0 or NaN.
    """

    t_ns: Times
    raw: npt.NDArray[Any]
    source: Bytes
    size: Bytes
    others: Mapping[int, bytes]

    @property
    def values(self) -> int:
        """How many values these are."""
        return len(self.t_ns)

    def data(self, position: int) -> bytes:
        """The bytes of the value at ``position`` as they came."""
        if position in self.others:
            return self.others[position]
        raw, size = self.raw[position], int(self.size[position])
        if isinstance(raw, bytes):
            return raw
        if self.raw.dtype.kind == "f":
            return np.asarray(raw, dtype=f"<f{size}").tobytes()
        return int(raw).to_bytes(size, "little", signed=self.raw.dtype.kind == "i")


class Piece(NamedTuple):
    """Values out of one block: the rows of their frames, and ``words`` of ``size`` bytes, first byte lowest."""

    rows: Rows
    t_ns: Times
    words: Words
    size: Bytes
    source: Bytes

    def at(self, places: Rows | slice) -> Piece:
        """The values at some places."""
        rows, t_ns, words, size, source = self
        return Piece(rows[places], t_ns[places], words[places], size[places], source[places])


_BYTES: Final = np.empty(0, dtype=np.uint8)
_WORDS: Final = np.empty(0, dtype=np.uint64)
_EMPTY: Final = Piece(np.empty(0, dtype=np.intp), _WORDS, _WORDS, _BYTES, _BYTES)


def _joined(pieces: Sequence[Piece]) -> Piece:
    rows, t_ns, words, size, source = zip(*pieces, strict=True)
    join = np.concatenate
    return Piece(join(rows), join(t_ns), join(words), join(size), join(source))


class Gathered:
    """The values of one object as they come."""

    def __init__(self) -> None:
        self._pieces: list[Piece] = []
        self._long: dict[int, bytes] = {}
        self._count = 0
        self._new: list[Piece] = []
        self._new_long: list[tuple[int, bytes]] = []

    def add(self, rows: Rows, t_ns: Times, words: Words, size: Bytes | int, source: Source) -> None:
        """Values of the block at work, sorted by row."""
        if not len(rows):
            return
        sizes = np.full(len(rows), size, dtype=np.uint8) if isinstance(size, int) else size
        sources = np.full(len(rows), SOURCES.index(source), dtype=np.uint8)
        self._new.append(Piece(rows, t_ns, words, sizes, sources))

    def add_one(self, row: int, t_ns: int, data: bytes, source: Source) -> None:
        """One value of the block at work."""
        if len(data) > _WORD:
            self._new_long.append((sum(len(piece.rows) for piece in self._new), data))
        word = int.from_bytes(data, "little") if len(data) <= _WORD else 0
        size = len(data) if len(data) <= _WORD else LONG
        one = np.array([row], dtype=np.intp), np.array([t_ns], dtype=np.uint64), np.array([word], dtype=np.uint64)
        self.add(*one, size, source)

    def next_block(self) -> None:
        """The block at work is done: put its values in the order of their rows."""
        if not self._new:
            return
        piece = self._new[0]
        places: Rows | None = None
        if len(self._new) > 1:
            piece = _joined(self._new)
            order = np.argsort(piece.rows, kind="stable")
            piece = piece.at(order)
            places = np.argsort(order, kind="stable")
        for place, data in self._new_long:
            self._long[self._count + int(place if places is None else places[place])] = data
        self._pieces.append(piece)
        self._count += len(piece.rows)
        self._new.clear()
        self._new_long.clear()

    def samples(self, data_type: DataType | None, start_ns: int | None = None) -> Samples:
        """Those from ``start_ns`` on, as numbers of the type; None: not described."""
        whole = _joined(self._pieces) if self._pieces else _EMPTY
        first = 0 if start_ns is None else int(np.searchsorted(whole.t_ns, np.uint64(max(start_ns, 0)), "left"))
        whole = whole.at(slice(first, None))
        others = {place - first: data for place, data in self._long.items() if place >= first}
        if data_type in _TEXTS:
            raw = _as_bytes(whole, others)
            others = {}
        elif data_type in _FLOATS:
            raw = _as_floats(whole, data_type, others)
        else:
            raw = _signed(whole) if data_type is not None and data_type.is_signed else whole.words
        return Samples(whole.t_ns, raw, whole.source, whole.size, others)


def _as_bytes(piece: Piece, long: Mapping[int, bytes]) -> npt.NDArray[Any]:
    raw = np.empty(len(piece.rows), dtype=object)
    for n, (word, size) in enumerate(zip(piece.words.tolist(), piece.size.tolist(), strict=True)):
        raw[n] = long[n] if size == LONG else word.to_bytes(size, "little")
    return raw


def _as_floats(piece: Piece, data_type: DataType, others: dict[int, bytes]) -> npt.NDArray[Any]:
    """Numbers of a REAL type; the bytes of what is none, or of another size, go to ``others``."""
    size, word, number = _FLOATS[data_type]
    raw = piece.words.astype(word).view(number).astype(np.float64)
    odd = np.flatnonzero((piece.size != size) | np.isnan(raw))
    raw[odd] = np.nan
    for n in odd.tolist():
        if piece.size[n] != LONG:
            others[n] = int(piece.words[n]).to_bytes(int(piece.size[n]), "little")
    return raw


def _signed(piece: Piece) -> npt.NDArray[Any]:
    """Numbers in two's complement of their own width."""
    size = np.where(piece.size > _WORD, 0, piece.size).astype(np.int64)
    shift = np.where(size == 0, 0, 8 * (_WORD - size)).astype(np.uint64)
    raw: npt.NDArray[Any] = (piece.words << shift).view(np.int64) >> shift.view(np.int64)
    return raw
