"""What a request does to the device: the objects that it names, and the registers that it writes."""

from __future__ import annotations

from app.model.address import Address
from app.wire.modbus.requests import (
    ReadObject,
    ReadWriteRegisters,
    Request,
    WriteArray,
    WriteObject,
    WriteRegister,
    WriteRegisters,
)


def objects_of(request: Request) -> list[tuple[Address, bytes]]:
    """The objects that a request names one by one, with what it writes to them."""
    match request:
        case ReadObject():
            return [(request.address, b"")]
        case WriteObject():
            return [(request.address, request.data)]
        case WriteArray():
            return [(frame.address, frame.data) for frame in request.frames]
    return []


def registers_written(request: Request) -> list[tuple[int, tuple[int, ...]]]:
    """Register and new values from there on, of a request that writes registers."""
    match request:
        case WriteRegister():
            return [(request.start, (request.value,))]
        case WriteRegisters():
            return [(request.start, request.registers)]
        case ReadWriteRegisters():
            return [(request.write_start, request.registers)]
    return []
