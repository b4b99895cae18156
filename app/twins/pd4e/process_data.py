"""Process data: registers of the mapped objects (manual, 8.5; 3502h, 3602h).

Master to drive from register 6000 on, drive to master from 5000 on. A mapping is changed while its sub-index 0 is 0,
and in force again as soon as that counts its entries.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from app.model.address import Address
from app.model.datatypes import Raw
from app.twins.object_store import Cell, ObjectStore, RefusedAccessError
from app.wire.modbus.functions import ModbusException
from app.wire.modbus.image import (
    MAX_ENTRIES,
    RX_MAPPING,
    RX_REGISTER,
    TX_MAPPING,
    TX_REGISTER,
    ProcessImage,
    WordOrder,
    process_image,
)
from app.wire.sdo import Abort

_ORDER: Final = WordOrder.HIGH_FIRST
"""OPEN which register of a 32-bit value comes first; as within a register, and as Modbus has it, the high one."""
_DUMMIES: Final = {0x0002: 8, 0x0003: 16, 0x0004: 32, 0x0005: 8, 0x0006: 16, 0x0007: 32}
"""Objects that fill a gap, always 0 (manual, 8.5), and their width in bits."""


class RefusedRequestError(Exception):
    """A register request that the device answers with an exception code."""

    def __init__(self, exception: ModbusException) -> None:
        super().__init__(exception.name)
        self.exception = exception


class ProcessData:
    """Both images of one device."""

    def __init__(self, store: ObjectStore) -> None:
        self._store = store
        self._rx = process_image(RX_REGISTER, [], _ORDER)
        self._tx = process_image(TX_REGISTER, [], _ORDER)
        for index in (RX_MAPPING, TX_MAPPING):
            for cell in store:
                if cell.entry.address.major == index:
                    self._guard(cell, receives=index == RX_MAPPING)
        self.reload()

    def reload(self) -> None:
        """Take the mapping as it stands: after power-on, and after a change."""
        self._rx = process_image(RX_REGISTER, self._entries(RX_MAPPING), _ORDER)
        self._tx = process_image(TX_REGISTER, self._entries(TX_MAPPING), _ORDER)

    def _entries(self, index: int) -> list[int]:
        """The mapped entries. A saved mapping that cannot be is none at all."""
        count = self._store.number(index)
        entries = [self._store.number(index, sub) for sub in range(1, min(count, MAX_ENTRIES) + 1)]
        try:
            for entry in entries:
                self._check(entry, receives=index == RX_MAPPING)
            process_image(0, entries)
        except (RefusedAccessError, ValueError):
            return []
        return entries

    # -- changing the mapping --------------------------------------------------------------

    def _guard(self, cell: Cell, *, receives: bool) -> None:
        index, sub = cell.entry.address.major, cell.entry.address.minor

        def count(raw: Raw) -> None:
            if not isinstance(raw, int) or raw > MAX_ENTRIES:
                raise RefusedAccessError(Abort.VALUE_TOO_HIGH)
            entries = [self._store.number(index, place) for place in range(1, raw + 1)]
            for entry in entries:
                self._check(entry, receives=receives)
            try:
                process_image(0, entries)
            except ValueError as error:
                raise RefusedAccessError(Abort.PDO_LENGTH) from error

        def entry(raw: Raw) -> None:
            if self._store.number(index):
                raise RefusedAccessError(Abort.UNSUPPORTED_ACCESS)
            if isinstance(raw, int) and raw:
                self._check(raw, receives=receives)

        def changed(_raw: Raw) -> None:
            self.reload()

        cell.guard = entry if sub else count
        cell.effect = None if sub else changed

    def _check(self, entry: int, *, receives: bool) -> None:
        """Raises RefusedAccessError where an entry maps nothing, or something that cannot be mapped there."""
        index, sub, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
        if index in _DUMMIES:
            if sub or bits != _DUMMIES[index]:
                raise RefusedAccessError(Abort.NOT_MAPPABLE)
            return
        cell = self._store.at(Address(index, sub))
        access = cell.entry.access
        allowed = access.writable if receives else access.readable
        if not cell.entry.pdo or not allowed or cell.entry.type.bits != bits:
            raise RefusedAccessError(Abort.NOT_MAPPABLE)

    # -- registers ---------------------------------------------------------------------------

    def read(self, start: int, quantity: int) -> tuple[int, ...]:
        """Registers of one image. Raises RefusedRequestError: ILLEGAL_ADDRESS."""
        image = self._image(start, quantity)
        registers = self._registers(image)
        first = start - image.start
        return registers[first : first + quantity]

    def write(self, start: int, registers: Sequence[int]) -> None:
        """Write registers of the receive image, objects in the order of the mapping.

        Of a 32-bit object a single register may be written; the other half keeps its value. Raises RefusedRequestError:
        ILLEGAL_ADDRESS, ILLEGAL_VALUE where an object refuses the value, DEVICE_FAILURE where it refuses the write.
        """
        image = self._image(start, len(registers))
        if image is not self._rx:
            raise RefusedRequestError(ModbusException.ILLEGAL_ADDRESS)
        merged = list(self._registers(image))
        first = start - image.start
        merged[first : first + len(registers)] = registers
        touched = range(2 * first, 2 * (first + len(registers)))
        values = dict(image.values(image.start, merged))
        for address, begin, end in image.slots:
            if begin < touched.stop and touched.start < end:
                self._put(address, values[address])

    def _put(self, address: Address, data: bytes) -> None:
        try:
            self._store.write(address, data)
        except RefusedAccessError as error:
            by_value = error.code in (Abort.VALUE_RANGE, Abort.VALUE_TOO_HIGH, Abort.VALUE_TOO_LOW)
            exception = ModbusException.ILLEGAL_VALUE if by_value else ModbusException.DEVICE_FAILURE
            raise RefusedRequestError(exception) from error

    def _registers(self, image: ProcessImage) -> tuple[int, ...]:
        return image.registers({slot.address: self._store.at(slot.address).to_bytes() for slot in image.slots})

    def _image(self, start: int, quantity: int) -> ProcessImage:
        for image in (self._rx, self._tx):
            if image.start <= start and start + quantity <= image.start + image.span.quantity:
                return image
        raise RefusedRequestError(ModbusException.ILLEGAL_ADDRESS)
