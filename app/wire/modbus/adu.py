"""The MBAP header, and what cuts a byte stream into messages (PD4-E manual, 8.2, page 94).

Transaction 2, protocol 2 (always 0), length 2 (unit and all after it), unit 1; all high byte first.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Final, NamedTuple

from app.wire.modbus.fields import MAX_WORD, FormatError, checked
from app.wire.modbus.functions import MAX_FRAME_BYTES
from app.wire.records import Fault

HEADER_SIZE: Final = 7
"""The unit included."""
MIN_LENGTH: Final = 2
"""Unit and function code."""
MAX_LENGTH: Final = 1 + 3 + MAX_FRAME_BYTES
"""Unit, head and frames of FC 101; standard Modbus ends at 254."""
MAX_ADU: Final = HEADER_SIZE - 1 + MAX_LENGTH
ETHERNET_BPS: Final = 100_000_000
"""What the load of a Modbus TCP bus is a share of: the port of the drives (fast Ethernet)."""
_TCP_OCTETS: Final = 14 + 20 + 20 + 24
"""What carries an ADU: Ethernet, IP and TCP headers, check, preamble and gap."""
_HEADER: Final = struct.Struct(">HHHB")
_LENGTH_AT: Final = 4


class Message(NamedTuple):
    """A whole ADU: the transaction that the server echoes, the unit, and the PDU with its function code."""

    transaction: int
    unit: int
    pdu: bytes

    @property
    def function(self) -> int:
        """The function code, with 80h where the request was refused."""
        return self.pdu[0]

    def encode(self) -> bytes:
        """Bytes on the wire. Raises ValueError where a field is out of range."""
        length = checked(1 + len(self.pdu), MIN_LENGTH, MAX_LENGTH, "length")
        transaction = checked(self.transaction, 0, MAX_WORD, "transaction")
        return _HEADER.pack(transaction, 0, length, checked(self.unit, 0, 0xFF, "unit")) + self.pdu


def wire_bits(size: int) -> int:
    """Bits that an ADU of ``size`` bytes takes on the Ethernet, in a packet of its own."""
    return 8 * (size + _TCP_OCTETS)


def decode_adu(data: bytes) -> Message:
    """Read one whole ADU. Raises FormatError, also where bytes are missing or left over."""
    if len(data) < HEADER_SIZE:
        raise FormatError(Fault.LENGTH, len(data), "ends within the MBAP header")
    transaction, _, length, unit = _HEADER.unpack_from(data)
    _check_header(data, 0)
    missing = HEADER_SIZE - 1 + length - len(data)
    if missing:
        raise FormatError(
            Fault.LENGTH, _LENGTH_AT, f"the length is {length}, {len(data) - HEADER_SIZE + 1} bytes follow"
        )
    return Message(transaction, unit, data[HEADER_SIZE:])


def _check_header(data: bytes | bytearray, base: int) -> None:
    """Look at as much of the header as is there: what is wrong is told at the first byte that shows it."""
    for at in range(2, min(len(data), _LENGTH_AT)):
        if data[at]:
            raise FormatError(Fault.PROTOCOL, base + at, "the protocol identifier is not 0")
    if len(data) >= _LENGTH_AT + 2:
        length = int.from_bytes(data[_LENGTH_AT : _LENGTH_AT + 2], "big")
        if not MIN_LENGTH <= length <= MAX_LENGTH:
            reason = f"the length is {length}, not {MIN_LENGTH} to {MAX_LENGTH}"
            raise FormatError(Fault.LENGTH, base + _LENGTH_AT, reason)


class AduSplitter:
    """Cuts one direction of a connection into ADUs, however its bytes are split or joined.

    After a violation the borders are lost for good: every further ``feed`` raises the same error.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._base = 0
        self._error: FormatError | None = None

    @property
    def pending(self) -> int:
        """Bytes of an ADU that is not whole yet."""
        return len(self._buffer)

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Take bytes and give the ADUs that are whole now.

        The iterator gives all that came before a violation, then raises FormatError with the offset in the stream.
        """
        self._buffer += data
        return self._cut()

    def end(self) -> None:
        """The stream has ended. Raises FormatError where it ended within an ADU."""
        if self._error is None and self._buffer:
            raise FormatError(Fault.LENGTH, self._base + len(self._buffer), "the stream ends within a message")

    def _cut(self) -> Iterator[bytes]:
        while True:
            if self._error is not None:
                raise self._error
            try:
                _check_header(self._buffer, self._base)
            except FormatError as error:
                self._error = error
                self._buffer.clear()
                continue
            if len(self._buffer) < HEADER_SIZE:
                return
            size = HEADER_SIZE - 1 + int.from_bytes(self._buffer[_LENGTH_AT : _LENGTH_AT + 2], "big")
            if len(self._buffer) < size:
                return
            adu = bytes(self._buffer[:size])
            del self._buffer[:size]
            self._base += size
            yield adu
