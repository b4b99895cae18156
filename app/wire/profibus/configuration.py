"""Identifiers of Chk_Cfg and Get_Cfg: which modules a slave has, and how many bytes each exchanges.

The simple form is one byte; the special form names lengths of outputs and inputs apart, and carries bytes of the maker.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final, NamedTuple

from app.wire.profibus.fields import FormatError, checked
from app.wire.records import Fault

MAX_SIMPLE: Final = 16
MAX_SPECIAL: Final = 64
MAX_MAKER_BYTES: Final = 14
MAX_CONFIGURATION: Final = 244
_CONSISTENT: Final = 0x80
_WORDS: Final = 0x40
_OUT: Final = 0x20
_IN: Final = 0x10


class Length(NamedTuple):
    """``units`` bytes or words; ``consistent`` over the whole of them, or over each."""

    units: int
    words: bool = False
    consistent: bool = False

    @property
    def size(self) -> int:
        """Bytes."""
        return self.units * (2 if self.words else 1)

    def _encode(self, most: int) -> int:
        count = checked(self.units, 1, most, "length of a module")
        return _CONSISTENT * self.consistent | _WORDS * self.words | count - 1


class Module(NamedTuple):
    """One module, as a master sees it. ``special`` is the form; ``maker`` are its bytes of the maker.

    The simple form has one length for both sides, and cannot be empty.
    """

    outputs: Length | None
    inputs: Length | None
    special: bool = False
    maker: bytes = b""

    @property
    def output_size(self) -> int:
        """Bytes from master to slave."""
        return 0 if self.outputs is None else self.outputs.size

    @property
    def input_size(self) -> int:
        """Bytes from slave to master."""
        return 0 if self.inputs is None else self.inputs.size

    def encode(self) -> bytes:
        """The identifier. Raises ValueError where the form cannot hold it."""
        if self.special:
            return self._special()
        length = self.outputs or self.inputs
        if length is None or self.maker or (self.outputs and self.inputs and self.outputs != self.inputs):
            raise ValueError("the simple form has one length, and no bytes of the maker")
        side = _OUT * (self.outputs is not None) | _IN * (self.inputs is not None)
        return bytes((length._encode(MAX_SIMPLE) | side,))

    def _special(self) -> bytes:
        size = checked(len(self.maker), 0, MAX_MAKER_BYTES, "number of bytes of the maker")
        head = 0x80 * (self.outputs is not None) | 0x40 * (self.inputs is not None) | size
        lengths = bytes(one._encode(MAX_SPECIAL) for one in (self.outputs, self.inputs) if one is not None)
        return bytes((head,)) + lengths + self.maker


def encode_configuration(modules: Iterable[Module]) -> bytes:
    """The data of Chk_Cfg. Raises ValueError where they are empty or do not fit."""
    data = b"".join(module.encode() for module in modules)
    checked(len(data), 1, MAX_CONFIGURATION, "length of the configuration")
    return data


def decode_configuration(data: bytes, base: int = 0) -> tuple[Module, ...]:
    """Read identifiers; offsets of errors begin at ``base``. Raises FormatError."""
    if not 1 <= len(data) <= MAX_CONFIGURATION:
        raise FormatError(Fault.LENGTH, base, f"{len(data)} bytes of configuration, not 1 to {MAX_CONFIGURATION}")
    modules, at = [], 0
    while at < len(data):
        size, module = _module(data, at, base)
        modules.append(module)
        at += size
    return tuple(modules)


def _module(data: bytes, at: int, base: int) -> tuple[int, Module]:
    head = data[at]
    if head & (_IN | _OUT):
        length = Length((head & 0x0F) + 1, bool(head & _WORDS), bool(head & _CONSISTENT))
        return 1, Module(length if head & _OUT else None, length if head & _IN else None)
    count = head & 0x0F
    if count > MAX_MAKER_BYTES:
        raise FormatError(Fault.FIELD, base + at, f"identifier {head:02X}h has no known length")
    has = (bool(head & 0x80), bool(head & 0x40))
    size = 1 + sum(has) + count
    if at + size > len(data):
        raise FormatError(Fault.LENGTH, base + len(data), f"an identifier of {size} bytes ends too early")
    lengths = iter(data[at + 1 : at + 1 + sum(has)])
    sides = [_length(next(lengths)) if there else None for there in has]
    return size, Module(sides[0], sides[1], True, data[at + size - count : at + size])


def _length(byte: int) -> Length:
    return Length((byte & 0x3F) + 1, bool(byte & _WORDS), bool(byte & _CONSISTENT))
