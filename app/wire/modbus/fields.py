"""Reads the fields of a Modbus message and says what is wrong with it, and at which byte."""

from __future__ import annotations

from collections.abc import Sequence

from app.wire.records import Fault

MAX_WORD = 0xFFFF


class FormatError(ValueError):
    """Bytes that are no Modbus: ``fault`` at byte ``offset`` of the message, or of the stream for a splitter."""

    def __init__(self, fault: Fault, offset: int, reason: str) -> None:
        super().__init__(f"byte {offset}: {reason}")
        self.fault = fault
        self.offset = offset
        self.reason = reason


class Fields:
    """Takes fields from the front of ``data``; offsets of errors begin at ``base``. All methods raise FormatError."""

    def __init__(self, data: bytes, base: int = 0) -> None:
        self._data = data
        self._base = base
        self._at = 0

    @property
    def offset(self) -> int:
        """Where the next field lies."""
        return self._base + self._at

    @property
    def left(self) -> int:
        """Bytes not taken yet."""
        return len(self._data) - self._at

    def take(self, size: int) -> bytes:
        """The next ``size`` bytes."""
        if size > self.left:
            end = self._base + len(self._data)
            raise FormatError(Fault.LENGTH, end, f"ends, {size - self.left} bytes are missing")
        self._at += size
        return self._data[self._at - size : self._at]

    def byte(self) -> int:
        """One byte."""
        return self.take(1)[0]

    def word(self) -> int:
        """Two bytes, high byte first."""
        return int.from_bytes(self.take(2), "big")

    def word_low_first(self) -> int:
        """Two bytes, low byte first."""
        return int.from_bytes(self.take(2), "little")

    def expect(self, wanted: int, name: str, fault: Fault = Fault.FIELD) -> None:
        """One byte that can only be ``wanted``."""
        at, found = self.offset, self.byte()
        if found != wanted:
            raise FormatError(fault, at, f"{name} is {found:02X}h, not {wanted:02X}h")

    def count(self, least: int, most: int, name: str) -> int:
        """A word within limits."""
        at, found = self.offset, self.word()
        if not least <= found <= most:
            raise FormatError(Fault.COUNT, at, f"{name} is {found}, not {least} to {most}")
        return found

    def registers(self, count: int) -> tuple[int, ...]:
        """A byte count that must be that of ``count`` registers, and the registers."""
        self.expect(2 * count, "the number of bytes", Fault.COUNT)
        return words_of(self.take(2 * count))

    def end(self) -> None:
        """Nothing may be left."""
        if self.left:
            raise FormatError(Fault.LENGTH, self.offset, f"{self.left} bytes too many")


def words_of(data: bytes) -> tuple[int, ...]:
    """Registers of an even number of bytes, each high byte first."""
    return tuple(int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2))


def bytes_of(registers: Sequence[int]) -> bytes:
    """Bytes of registers, each high byte first. Raises ValueError where one is no UNSIGNED16."""
    return b"".join(checked(register, 0, MAX_WORD, "register").to_bytes(2, "big") for register in registers)


def checked(value: int, least: int, most: int, name: str) -> int:
    """``value``, or ValueError where it is outside its limits: nothing is sent that no peer could read."""
    if not least <= value <= most:
        raise ValueError(f"{name} {value} is outside {least} to {most}")
    return value
