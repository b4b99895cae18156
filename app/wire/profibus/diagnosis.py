"""The answer to Slave_Diag: six bytes of status, master and ident number, and blocks of extended diagnosis."""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntFlag
from typing import Final, NamedTuple

from app.wire.profibus.fields import FormatError, checked
from app.wire.records import Fault

SIZE: Final = 6
NO_MASTER: Final = 255
_MAX_EXTENDED: Final = 238


class Status(IntFlag):
    """The three bytes of station status, the first one lowest. A slave leaves those of the master 0."""

    NON_EXISTENT = 1 << 0
    """Told by a master."""
    NOT_READY = 1 << 1
    CONFIGURATION_FAULT = 1 << 2
    EXTENDED = 1 << 3
    NOT_SUPPORTED = 1 << 4
    INVALID_ANSWER = 1 << 5
    """Told by a master."""
    PARAMETER_FAULT = 1 << 6
    LOCKED_BY_OTHER = 1 << 7
    """Told by a master."""
    PARAMETERS_REQUIRED = 1 << 8
    STATIC = 1 << 9
    """The slave has no valid data: it wants to be asked for its diagnosis until this ends."""
    ALWAYS = 1 << 10
    WATCHDOG = 1 << 11
    FREEZE = 1 << 12
    SYNC = 1 << 13
    DEACTIVATED = 1 << 15
    """Told by a master."""
    OVERFLOW = 1 << 23

    @property
    def text_keys(self) -> list[str]:
        """Text keys of what it tells; a bit that every slave sets tells nothing."""
        return [f"profibus.status.{str(bit.name).lower()}" for bit in Status if self & bit and bit is not Status.ALWAYS]

    @property
    def faults(self) -> Status:
        """What of it keeps the slave from exchanging data, or is not as it should be."""
        return self & ~(Status.ALWAYS | Status.WATCHDOG | Status.FREEZE | Status.SYNC)


class DeviceBlock(NamedTuple):
    """Diagnosis of the maker's own making."""

    data: bytes


class ModuleBlock(NamedTuple):
    """Modules (numbers from 0) that have something to tell."""

    modules: tuple[int, ...]


class ChannelBlock(NamedTuple):
    """One channel of one module: its side (1 input, 2 output, 3 both), width and error, as they are coded."""

    module: int
    channel: int
    side: int
    width: int
    error: int


class RevisionBlock(NamedTuple):
    """The revision number of the device."""

    revision: int


Block = DeviceBlock | ModuleBlock | ChannelBlock | RevisionBlock


class Diagnosis(NamedTuple):
    """What a slave tells of itself. ``master`` is the one that parametrised it, ``NO_MASTER`` where none did."""

    status: Status
    master: int
    ident: int
    extended: bytes = b""

    @property
    def ready(self) -> bool:
        """True where a master may go on to Data_Exchange."""
        wrong = (
            Status.NOT_READY
            | Status.CONFIGURATION_FAULT
            | Status.PARAMETER_FAULT
            | Status.PARAMETERS_REQUIRED
            | Status.NOT_SUPPORTED
            | Status.STATIC
        )
        return not self.status & wrong

    def encode(self) -> bytes:
        """The data of the answer. Raises ValueError where a field is out of range."""
        checked(len(self.extended), 0, _MAX_EXTENDED, "length of the extended diagnosis")
        master = checked(self.master, 0, 255, "master")
        ident = checked(self.ident, 0, 0xFFFF, "ident number")
        status = checked(int(self.status), 0, 0xFFFFFF, "status").to_bytes(3, "little")
        return status + bytes((master,)) + ident.to_bytes(2, "big") + self.extended

    def blocks(self) -> Iterator[Block]:
        """The extended diagnosis. Raises FormatError, with an offset in it, where a block is cut off or unknown."""
        at, data = 0, self.extended
        while at < len(data):
            size, block = _block(data, at)
            yield block
            at += size


def decode_diagnosis(data: bytes, base: int = 0) -> Diagnosis:
    """Read the data of an answer; offsets of errors begin at ``base``. Raises FormatError."""
    if len(data) < SIZE:
        raise FormatError(Fault.LENGTH, base + len(data), f"a diagnosis has {SIZE} bytes at least")
    status = Status(int.from_bytes(data[:3], "little"))
    return Diagnosis(status, data[3], int.from_bytes(data[4:6], "big"), data[SIZE:])


def _block(data: bytes, at: int) -> tuple[int, Block]:
    head, kind = data[at], data[at] >> 6
    if kind == 3:
        return 1, RevisionBlock(head & 0x3F)
    size = 3 if kind == 2 else head & 0x3F
    if size < 1 or at + size > len(data):
        raise FormatError(Fault.LENGTH, at, f"a block of {size} bytes, {len(data) - at} are left")
    body = data[at + 1 : at + size]
    if kind == 0:
        return size, DeviceBlock(body)
    if kind == 1:
        numbers = (8 * byte + bit for byte in range(len(body)) for bit in range(8) if body[byte] >> bit & 1)
        return size, ModuleBlock(tuple(numbers))
    return size, ChannelBlock(head & 0x3F, body[0] & 0x3F, body[0] >> 6, body[1] >> 5, body[1] & 0x1F)
