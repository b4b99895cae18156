"""Puts other numbers and letters in place of what identifies a unit, in the frames that carry it.

SDO traffic of identity objects in all its forms (expedited, segmented, block; the CRC of a block is that of the new
bytes) and LSS, which addresses by serial number. Lengths and protocol steps stay: the traffic decodes as before.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Collection, Iterator, Mapping
from typing import Final

from app.errors import RecordingError
from app.model.address import Address
from app.model.description import Description
from app.wire import sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Can, Frame
from app.wire.records import Source, ValueSeen
from app.wire.trace.service import Service

STATIONS: Final = re.compile(r"blade-[1-9]|bench(-[0-9]+)?|pmc|pmm|hub|nodes|[0-9]{1,3}")
"""Parts of the names of devices that are the same on every turbine."""
SERIAL: Final = Address(0x1018, 4)
_LETTER: Final = 0x58
_LOOKED_FOR: Final = 5
"""Bytes of text from which on finding them again is no accident."""
_LSS_IDS: Final = (0x7E4, 0x7E5)
_LSS_SERIALS: Final = frozenset({0x43, 0x4A, 0x4B, 0x5D})  # selective switch, identify (low, high), inquire
_LSS_FASTSCAN: Final = 0x51
_FASTSCAN_SERIAL: Final = 3
_TIME_OF_DAY: Final = struct.Struct("<IH")  # CiA 301: 28 bits of ms since midnight, days since 1 January 1984
_MS_BITS: Final = 0x0FFF_FFFF
_MS_PER_DAY: Final = 86_400_000
_NS_PER_MS: Final = 1_000_000
_NAMES: Final = ("serial", "nameplate", "name plate", "order number", "customer")
_BLOCK_END: Final = 0xC1
_BLOCK_END_MASK: Final = 0xE3


def identity_objects(descriptions: Mapping[tuple[str, int], Description]) -> dict[tuple[str, int], frozenset[Address]]:
    """What identifies a unit, by its description; 1018h:04 is one always."""
    return {
        key: frozenset(entry.address for entry in description if any(word in entry.name.lower() for word in _NAMES))
        for key, description in descriptions.items()
    }


class Pseudonyms:
    """The same number for the same number, text for text: equal identities stay equal, and tell nothing."""

    def __init__(self) -> None:
        self._numbers: dict[bytes, bytes] = {}
        self.texts: set[bytes] = set()
        """What was hidden and is text, to be looked for afterwards."""

    def number(self, raw: bytes) -> bytes:
        """In place of up to four bytes; zero stays zero."""
        if not any(raw):
            return raw
        known = self._numbers.get(raw)
        if known is None:
            most = 256 ** len(raw) - 1
            known = self._numbers[raw] = (len(self._numbers) % most + 1).to_bytes(len(raw), "little")
        return known

    @property
    def numbers(self) -> Mapping[bytes, bytes]:
        """The raw numbers that were replaced, and by what."""
        return self._numbers


class Hider:
    """Goes with the frames of one recording, in their order."""

    def __init__(
        self,
        descriptions: Mapping[tuple[str, int], Description],
        names: Pseudonyms,
        more: Collection[Address] = (),
    ) -> None:
        self._objects = identity_objects(descriptions)
        self._everywhere = frozenset({SERIAL, *more})
        self._descriptions = descriptions
        self._names = names
        self._decoders: dict[str, CanOpenDecoder] = {}
        self._acknowledged: dict[tuple[str, int], int] = {}

    def is_identity(self, bus: str, node: int, address: Address | None) -> bool:
        """Whether an object tells which unit it is."""
        return address in self._everywhere or address in self._objects.get((bus, node), ())

    def __call__(self, frames: Iterator[Frame]) -> Iterator[Frame]:
        """The frames with other bytes where they identify. Raises RecordingError where a PDO does."""
        for frame in frames:
            can = frame.payload
            if isinstance(can, Can):
                yield self._hidden(frame, can)

    def decoder(self, bus: str) -> CanOpenDecoder:
        """Who follows the traffic of a bus, as it really was."""
        known = self._decoders.get(bus)
        if known is None:
            here = {node: one for (name, node), one in self._descriptions.items() if name == bus}
            known = self._decoders[bus] = CanOpenDecoder(bus, here)
        return known

    def _hidden(self, frame: Frame, can: Can) -> Frame:
        if can.can_id in _LSS_IDS and not can.extended:
            return frame._replace(payload=can._replace(data=self._lss(can.data)))
        decoder = self.decoder(frame.bus)
        speaker = decoder.speaker(can.can_id, can.extended)
        if speaker.service not in (Service.SDO_REQUEST, Service.SDO_RESPONSE):
            for record in decoder.feed(frame):
                if isinstance(record, ValueSeen) and record.source in (Source.PDO_TX, Source.PDO_RX):
                    self._check_pdo(record)
            return frame
        client = speaker.service is Service.SDO_REQUEST
        follower = decoder.sdo(speaker.node)
        before = follower.address
        in_block = len(can.data) == 8 and follower.is_block_segment(client, can.data)
        decoder.feed(frame)
        if len(can.data) != 8 or can.remote or can.error:
            return frame
        address = before or follower.address
        if not in_block and _carries_mux(can.data[0], client):
            address = _mux(can.data)
        orphan = address is None and can.data[0] >> 5 == 0  # of a transfer that began before the recording
        if not orphan and not self.is_identity(frame.bus, speaker.node, address):
            return frame
        data = self._in_block(can.data) if in_block else self._step((frame.bus, speaker.node), client, can.data)
        return frame._replace(payload=can._replace(data=data))

    def _check_pdo(self, seen: ValueSeen) -> None:
        if self.is_identity(seen.bus, seen.node, seen.address):
            raise RecordingError(
                file="", offset=0, reason=f"a PDO of node {seen.node} carries {seen.address}: it cannot be hidden"
            )

    def _step(self, key: tuple[str, int], client: bool, data: bytes) -> bytes:
        """A frame of a transfer that is no segment of a block."""
        command = data[0]
        specifier = command >> 5
        if specifier == 0:
            return self._segment(data, 7 - (command >> 1 & 0x07))
        if specifier == (1 if client else 2) and command & 0x02:
            size = 4 - (command >> 2 & 0x03) if command & 0x01 else 4
            return data[:4] + self._names.number(data[4 : 4 + size]) + data[4 + size :]
        if specifier == 5 and command & 0x03 == sdo.BlockStep.ACKNOWLEDGE:
            self._acknowledged[key] = self._acknowledged.get(key, 0) + data[1]
        elif command & _BLOCK_END_MASK == _BLOCK_END:
            size = self._acknowledged.pop(key, 0) * sdo.SEGMENT_SIZE - (command >> 2 & 0x07)
            check = sdo.crc(bytes([_LETTER]) * max(size, 0)) if any(data[1:3]) else 0
            return data[:1] + check.to_bytes(2, "little") + data[3:]
        elif specifier in (5, 6) and command & 0x01 == 0:
            self._acknowledged[key] = 0
        return data

    def _in_block(self, data: bytes) -> bytes:
        return self._segment(data, sdo.SEGMENT_SIZE)

    def _segment(self, data: bytes, size: int) -> bytes:
        """Letters in place of ``size`` bytes behind the first."""
        text = data[1 : 1 + size].rstrip(b"\0")
        if len(text) >= _LOOKED_FOR and text.isascii():
            self._names.texts.add(text)
        return data[:1] + bytes([_LETTER]) * size + data[1 + size :]

    def _lss(self, data: bytes) -> bytes:
        if len(data) < 5:
            return data
        fastscan = data[0] == _LSS_FASTSCAN and len(data) > 6 and data[6] == _FASTSCAN_SERIAL
        if data[0] in _LSS_SERIALS or fastscan:
            return data[:1] + self._names.number(data[1:5]) + data[5:]
        return data


def shifted_time(data: bytes, by_ns: int) -> bytes | None:
    """The data of a TIME object, told ``by_ns`` later, to the ms; None where it is none or cannot tell that."""
    if len(data) != _TIME_OF_DAY.size:
        return None
    low, days = _TIME_OF_DAY.unpack(data)
    ms = days * _MS_PER_DAY + (low & _MS_BITS) + by_ns // _NS_PER_MS
    days, of_day = divmod(ms, _MS_PER_DAY)
    if low & _MS_BITS >= _MS_PER_DAY or not 0 <= days <= 0xFFFF:
        return None
    return _TIME_OF_DAY.pack(low & ~_MS_BITS | of_day, days)


def _mux(data: bytes) -> Address | None:
    return Address(int.from_bytes(data[1:3], "little"), data[3]) if len(data) >= 4 else None


def _carries_mux(command: int, client: bool) -> bool:
    """Whether a frame names its object: where a transfer begins, or in an expedited answer."""
    return command >> 5 in ((1, 2) if client else (2, 3))
