"""The object dictionary of a twin at run time: one cell for each entry of its description.

A cell holds a raw value, or takes it from a live source each time it is read. Access, length, preconditions and limits
are enforced here with the abort codes of CiA 301 (table 22), whoever writes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final, NamedTuple

from app.model.address import Address
from app.model.checks import limits_of
from app.model.datatypes import DataType, Raw, decode_raw, encode_raw
from app.model.description import Access, Description, Entry
from app.wire.sdo import Abort

_FIRST_OF_MAKER: Final = 0x2000
"""Below it sub-index 0 may tell how many of the elements are in use (CiA 301)."""


class RefusedAccessError(Exception):
    """An access that the device refuses; ``code`` is the abort code its answer carries."""

    def __init__(self, code: Abort) -> None:
        super().__init__(f"{code:08X}h {code.name}")
        self.code = code


class Deferred(NamedTuple):
    """A write that takes time: ``finish`` runs ``duration_ns`` later, and only then the write is acknowledged."""

    duration_ns: int
    finish: Callable[[int], None]


Guard = Callable[[Raw], None]
"""Looks at a value before it is written; raises RefusedAccessError."""
Effect = Callable[[Raw], Deferred | None]
"""Runs after a value was written."""


class Cell:
    """One entry at run time.

    ``source`` gives a live value; ``raw`` is used where there is none. ``guard`` may refuse a write, ``effect``
    follows it.
    """

    __slots__ = ("effect", "entry", "guard", "raw", "size", "source")

    def __init__(self, entry: Entry, raw: Raw) -> None:
        self.entry = entry
        self.raw = raw
        self.size = entry.type.size
        self.source: Callable[[], Raw] | None = None
        self.guard: Guard | None = None
        self.effect: Effect | None = None

    @property
    def now(self) -> Raw:
        """The raw value at this moment."""
        return self.raw if self.source is None else self.source()

    @property
    def number(self) -> int:
        """The raw value of an integer object."""
        value = self.raw if self.source is None else self.source()
        if not isinstance(value, int):
            raise TypeError(f"{self.entry.address} holds {value!r}, no integer")
        return value

    def to_bytes(self) -> bytes:
        """The value as it goes over the wire. A live number beyond the type's range is held at its limit."""
        value = self.raw if self.source is None else self.source()
        kind = self.entry.type
        span = kind.range
        if span is None or self.size is None or not isinstance(value, int):
            return encode_raw(kind, value)
        low, high = span
        if value < low or value > high:
            value = low if value < low else high
        return value.to_bytes(self.size, "little", signed=kind.is_signed)


def initial(entry: Entry, node_id: int) -> Raw:
    """The entry's default; a COB-ID that rests on the node id (CiA 301, 7.3.5) gets it added."""
    if entry.default is not None:
        raw = entry.default
        return raw + node_id if entry.node_id and isinstance(raw, int) else raw
    if entry.type.is_integer:
        return 0
    if entry.type in (DataType.REAL32, DataType.REAL64):
        return 0.0
    if entry.type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return ""
    return bytes(entry.type.size or 0)


class ObjectStore:
    """All cells of one device. ``factory`` opens the objects that only the maker may write (r(w))."""

    def __init__(self, description: Description, node_id: int, *, factory: bool = False) -> None:
        self.description = description
        self.node_id = node_id
        self._factory = factory
        self._cells = {address: Cell(entry, initial(entry, node_id)) for address, entry in description.entries.items()}
        # Controllers look objects up some ten thousand times a second; an int is hashed faster than an address.
        self._by_number = {address.major << 8 | address.minor: cell for address, cell in self._cells.items()}
        self._link_mirrors()
        self._count_elements()

    def __iter__(self) -> Iterator[Cell]:
        return iter(self._cells.values())

    def cell(self, index: int, sub: int = 0) -> Cell:
        """The cell of an object that the device must have. Raises KeyError."""
        return self._by_number[index << 8 | sub]

    def find(self, index: int, sub: int = 0) -> Cell | None:
        """The cell of an object that the device may have."""
        return self._by_number.get(index << 8 | sub)

    def number(self, index: int, sub: int = 0) -> int:
        """The raw value of an integer object that the device must have."""
        cell = self._by_number[index << 8 | sub]
        value = cell.raw if cell.source is None else cell.source()
        return value if isinstance(value, int) else cell.number

    def at(self, address: Address) -> Cell:
        """The cell that a client asks for.

        Raises RefusedAccessError: NO_OBJECT or NO_SUB_INDEX.
        """
        found = self._cells.get(address)
        if found is None:
            known = self.description.has_index(address.major)
            raise RefusedAccessError(Abort.NO_SUB_INDEX if known else Abort.NO_OBJECT)
        return found

    def read(self, address: Address) -> bytes:
        """Bytes of an object for a client. Raises RefusedAccessError."""
        cell = self.at(address)
        if not cell.entry.access.readable:
            raise RefusedAccessError(Abort.WRITE_ONLY)
        return cell.to_bytes()

    def check_writable(self, address: Address, size: int | None) -> Cell:
        """Check what is known before the data is there; ``size`` is None where it was not announced.

        Raises RefusedAccessError.
        """
        cell = self.at(address)
        access = cell.entry.access
        # r(w) outside the factory is refused as read-only: the manual says no more than "not allowed".
        if not (access.writable or (access is Access.FACTORY and self._factory)):
            raise RefusedAccessError(Abort.READ_ONLY)
        if size is not None and cell.size is not None and size != cell.size:
            raise RefusedAccessError(Abort.LENGTH_TOO_HIGH if size > cell.size else Abort.LENGTH_TOO_LOW)
        return cell

    def write(self, address: Address, data: bytes) -> Deferred | None:
        """Write an object for a client. Raises RefusedAccessError; nothing was changed then."""
        cell = self.check_writable(address, len(data))
        raw = decode_raw(cell.entry.type, data)
        if isinstance(raw, str) and not raw.isascii():
            raise RefusedAccessError(Abort.VALUE_RANGE)
        return self.assign(cell, raw)

    def assign(self, cell: Cell, raw: Raw) -> Deferred | None:
        """Write a value with all checks but those of access (a PDO is checked when it is mapped)."""
        for condition in cell.entry.requires:
            if condition.concerns(raw) and self.at(condition.address).now not in condition.values:
                raise RefusedAccessError(Abort.DEVICE_STATE)
        self._check_range(cell.entry, raw)
        if cell.guard is not None:
            cell.guard(raw)
        cell.raw = raw
        return None if cell.effect is None else cell.effect(raw)

    def restore(self, wanted: Callable[[Entry], bool], stored: dict[Address, bytes]) -> None:
        """Give every wanted object its stored value, or else its default, without guards and effects."""
        for address, cell in self._cells.items():
            if wanted(cell.entry):
                data = stored.get(address)
                entry = cell.entry
                cell.raw = initial(entry, self.node_id) if data is None else decode_raw(entry.type, data)

    def _lookup(self, address: Address) -> Raw | None:
        cell = self._cells.get(address)
        return None if cell is None else cell.now

    def _check_range(self, entry: Entry, raw: Raw) -> None:
        if not isinstance(raw, int | float):
            return
        if (entry.only and raw not in entry.only) or (entry.step > 1 and raw % entry.step):
            raise RefusedAccessError(Abort.VALUE_RANGE)
        if raw not in entry.also and (entry.minimum is not None or entry.maximum is not None):
            low, high = limits_of(entry, self._lookup)
            if high is not None and raw > high:
                raise RefusedAccessError(Abort.VALUE_TOO_HIGH)
            if low is not None and raw < low:
                raise RefusedAccessError(Abort.VALUE_TOO_LOW)
        enumeration = self.description.enumeration_of(entry, self._lookup)
        if (
            enumeration is not None
            and enumeration.exclusive
            and all(value.value != raw for value in enumeration.values)
        ):
            raise RefusedAccessError(Abort.VALUE_RANGE)

    def _link_mirrors(self) -> None:
        """Let 16-bit mirrors show, and write, the object they mirror.

        OPEN what a mirror shows where its object needs more bits. It is held at the limit of its type: a cut-off
        number would pass as a true position.
        """
        for cell in self._cells.values():
            mirror = cell.entry.mirror
            if mirror is None or mirror.of not in self._cells:
                continue
            target = self._cells[mirror.of]
            cell.source = _mirror_source(target, mirror.divisor)
            if cell.entry.access.writable:
                cell.effect = _mirror_effect(self, target, mirror.divisor)

    def _count_elements(self) -> None:
        """Sub-index 0 counts the elements, also where fewer are printed than described (6410h: 12 and 15)."""
        last: dict[int, int] = {}
        for address in self._cells:
            last[address.major] = max(last.get(address.major, 0), address.minor)
        for index, count in last.items():
            cell = self.find(index)
            if cell is None or cell.entry.access.writable:
                continue  # a mapping's own count is a value
            if index >= _FIRST_OF_MAKER and count and cell.raw != count:
                cell.source = _constant(count)


def _constant(number: int) -> Callable[[], Raw]:
    return lambda: number


def _mirror_source(target: Cell, divisor: int) -> Callable[[], Raw]:
    return lambda: target.number // divisor


def _mirror_effect(store: ObjectStore, target: Cell, divisor: int) -> Effect:
    def write_through(raw: Raw) -> Deferred | None:
        return store.assign(target, raw * divisor) if isinstance(raw, int) else None

    return write_through
