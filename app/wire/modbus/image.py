"""Process data as registers: what lies where, from the mapping objects of the device (PD4-E manual, 8.5).

3502h maps what a master sends, in registers from 6000 on; 3602h what the drive sends, from 5000 on (6000 stands in an
example of the manual; 5000 is that of public users and sibling manuals). Entries follow each other without gaps, each
most significant byte first: of a dummy and a mode of 8 bits each, the dummy is the register's high byte. Which register
of a 32-bit value comes first is printed nowhere: the device has to show it (``shown_order``), and until it has, values
on which the order has an influence are not given.
"""

from __future__ import annotations

from collections.abc import Mapping as MappingOf
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Final, NamedTuple

from app.model.address import Address
from app.wire.modbus.fields import bytes_of, words_of
from app.wire.pdo import Mapping, Slot, parse_mapping_entry

RX_MAPPING: Final = 0x3502
TX_MAPPING: Final = 0x3602
RX_REGISTER: Final = 6000
TX_REGISTER: Final = 5000
MAX_ENTRIES: Final = 16


class WordOrder(Enum):
    """Which register of a value of 32 bits and more comes first."""

    HIGH_FIRST = "high_first"
    LOW_FIRST = "low_first"


class Span(NamedTuple):
    """Registers ``start`` to ``start + quantity - 1``."""

    start: int
    quantity: int


@dataclass(frozen=True)
class ProcessImage:
    """Where the entries of ``mapping`` lie in registers from ``start`` on; ``order`` is None until it is known.

    Use ``process_image``: it refuses what has no place on byte borders.
    """

    start: int
    mapping: Mapping
    order: WordOrder | None = None

    @cached_property
    def slots(self) -> tuple[Slot, ...]:
        """Byte positions within the image, without dummies."""
        return self.mapping.slots or ()

    @property
    def span(self) -> Span:
        """All its registers; a last odd byte fills one."""
        return Span(self.start, (self.mapping.size + 1) // 2)

    @cached_property
    def places(self) -> MappingOf[Address, Span]:
        """The registers that hold each object, in part or whole."""
        return {
            address: Span(self.start + start // 2, (stop + 1) // 2 - start // 2) for address, start, stop in self.slots
        }

    def values(self, start: int, registers: Sequence[int]) -> list[tuple[Address, bytes]]:
        """Objects that lie wholly within ``registers`` from register ``start`` on: bytes least significant first."""
        data, shift = bytes_of(registers), 2 * (self.start - start)
        found = []
        for address, first, stop in self.slots:
            if shift + first >= 0 and shift + stop <= len(data):
                turned = self._turned(data[shift + first : shift + stop], first)
                if turned is not None:
                    found.append((address, turned[::-1]))
        return found

    def touched(self, start: int, quantity: int) -> list[Address]:
        """Objects of which registers ``start`` and following hold any part."""
        first, last = 2 * (start - self.start), 2 * (start + quantity - self.start)
        return [slot.address for slot in self.slots if slot.start < last and first < slot.stop]

    def registers(self, values: MappingOf[Address, bytes]) -> tuple[int, ...]:
        """All registers, from ``values`` least significant byte first; dummies are 0.

        Raises KeyError where a mapped object has no value, ValueError where one has another width, or where the order
        of its registers is not known.
        """
        data = bytearray(2 * self.span.quantity)
        for address, start, stop in self.slots:
            raw = values[address]
            if len(raw) != stop - start:
                raise ValueError(f"{address.short} has {len(raw)} bytes where {stop - start} are mapped")
            turned = self._turned(raw[::-1], start) if any(raw) else raw  # 0 is the same in any order
            if turned is None:
                raise ValueError(f"which register of {address.short} comes first is not known")
            data[start:stop] = turned
        return words_of(bytes(data))

    def _turned(self, data: bytes, start: int) -> bytes | None:
        """Most significant byte first to the order of registers, and back. None where that order is not known."""
        if self.order is None and len(data) > 2 and (len(data) % 2 or start % 2):
            return None  # it shares registers with its neighbours
        if self.order is WordOrder.HIGH_FIRST or len(data) % 2 or start % 2:
            return data
        turned = bytes_of(words_of(data)[::-1])
        return None if self.order is None and turned != data else turned


def process_image(start: int, entries: Sequence[int], order: WordOrder | None = None) -> ProcessImage:
    """The image of mapping entries (UNSIGNED32 each: index, sub-index, width in bits); entries of 0 are none.

    Raises ValueError where there are more than 16, or where one does not begin and end on a byte border.
    """
    if len(entries) > MAX_ENTRIES:
        raise ValueError(f"{len(entries)} entries where {MAX_ENTRIES} can be mapped")
    mapping = Mapping(tuple(parse_mapping_entry(raw) for raw in entries if raw))
    if mapping.slots is None:
        raise ValueError("an entry does not begin and end on a byte border")
    return ProcessImage(start, mapping, order)


def shown_order(plain: bytes, registers: Sequence[int]) -> WordOrder | None:
    """Which order a device shows by one object, read as ``plain`` bytes (least significant first) and as registers.

    None where this value does not tell, or where it has changed in between.
    """
    if len(plain) % 2 or len(plain) < 4:
        return None
    high_first, found = words_of(plain[::-1]), tuple(registers)
    if high_first == high_first[::-1]:
        return None
    return {high_first: WordOrder.HIGH_FIRST, high_first[::-1]: WordOrder.LOW_FIRST}.get(found)


class MappingObjects:
    """Learns one mapping object from its values, as they are read or written, in any order.

    Nothing is assumed: without its number of entries, and each of them, there is no image.
    """

    def __init__(self, index: int, start: int) -> None:
        self.index = index
        self.start = start
        self._order: WordOrder | None = None
        self._known: dict[int, int] = {}
        self._image: ProcessImage | None = None

    @property
    def image(self) -> ProcessImage | None:
        """The image in force, None where it is not known or makes no sense."""
        return self._image

    @property
    def order(self) -> WordOrder | None:
        """The order of words, where the device has shown it."""
        return self._order

    @order.setter
    def order(self, order: WordOrder | None) -> None:
        self._order = order
        self._image = self._built()

    def _built(self) -> ProcessImage | None:
        count = self._known.get(0)
        if not count or count > MAX_ENTRIES:
            return None
        entries = [self._known[sub] for sub in range(1, count + 1) if sub in self._known]
        if len(entries) < count:
            return None
        try:
            return process_image(self.start, entries, self._order)
        except ValueError:
            return None

    def learn(self, address: Address, data: bytes) -> bool:
        """Take a value of any object. True where it was one of this."""
        if address.major != self.index:
            return False
        self._known[address.minor] = int.from_bytes(data, "little")
        self._image = self._built()
        return True

    def forget(self, address: Address | None = None) -> bool:
        """The value at ``address`` is not known any more, or none is. True where it was one of this."""
        if address is not None and address.major != self.index:
            return False
        if address is None:
            self._known.clear()
        else:
            self._known.pop(address.minor, None)
        self._image = self._built()
        return True

    def snapshot(self) -> dict[str, int]:
        """JSON-able: raw values by sub-index. The order is not in it."""
        return {str(sub): raw for sub, raw in self._known.items()}

    def restore(self, state: MappingOf[str, int]) -> None:
        """Go on from ``snapshot()``. Raises ValueError on another state."""
        self._known = {int(sub): int(raw) for sub, raw in state.items()}
        self._image = self._built()
