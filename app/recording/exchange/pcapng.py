"""pcapng (draft-ietf-opsawg-pcapng), as Wireshark and tshark read it: ADUs in frames of Ethernet, PROFIBUS as it is.

A recording holds ADUs of Modbus TCP and no segments, so that everything around them is made up: addresses of Ethernet
out of those of IP, sequence numbers that go on without a gap, one segment for each ADU, no beginning and no end of a
connection. Ports and IPv4 addresses are those that were seen; an end with another name gets one of 192.0.2.0/24
(RFC 5737), and the comment of the file tells which.

Telegrams of PROFIBUS have a link type of their own, so that nothing is made up around them. Wireshark 4 has no words
for that type: it shows their times and bytes, and a dissector of others may take them.

Each bus is an interface. Times are whole ns; the direction stands in the flags of a packet.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterable, Mapping
from ipaddress import AddressValueError, IPv4Address
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from app.recording.exchange.formats import Head
from app.wire.frame import Adu, Direction, Fdl, Frame
from app.wire.modbus.transactions import ARROW

_ETHERNET: Final = 1
_PROFIBUS_DL: Final = 257
"""LINKTYPE_PROFIBUS_DL: telegrams from start to end delimiter (tcpdump.org/linktypes)."""
_IPV4: Final = 0x0800
_TCP: Final = 6
_PUSH_ACK: Final = 0x18
_WINDOW: Final = 0xFFFF
_HOPS: Final = 64
_IP_BYTES, _TCP_BYTES = 20, 20
_SECTION, _INTERFACE, _PACKET = 0x0A0D0D0A, 1, 6
_BYTE_ORDER: Final = 0x1A2B3C4D
_NANOSECONDS: Final = 9
_OWN_MAC: Final = b"\x02\x00"
"""Locally administered; the four bytes of the IPv4 address follow."""
_STAND_INS: Final = int(IPv4Address("192.0.2.0"))
_MOST_STAND_INS: Final = 254
_INBOUND, _OUTBOUND = 1, 2
_FIRST: Final = 1
"""The sequence number with which each end begins."""


class Endpoint(NamedTuple):
    """One end of a connection."""

    address: int
    port: int


class _Stream:
    """The two ends of a connection: how many bytes each has sent so far."""

    def __init__(self) -> None:
        self.next: dict[Endpoint, int] = {}

    def sent(self, sender: Endpoint, receiver: Endpoint, count: int) -> tuple[int, int]:
        """Sequence number and acknowledgement of the next segment."""
        sequence = self.next.get(sender, _FIRST)
        self.next[sender] = sequence + count & 0xFFFFFFFF
        return sequence, self.next.get(receiver, _FIRST)


class Framing:
    """Makes frames of Ethernet of ADUs. ``stand_ins``: addresses that were given to ends with other names."""

    def __init__(self) -> None:
        self.stand_ins: dict[str, str] = {}
        self._streams: dict[frozenset[Endpoint], _Stream] = {}
        self._count = 0

    def frame(self, adu: Adu, direction: Direction) -> bytes:
        """One ADU as one segment."""
        sender, receiver = self._ends(adu.link, direction)
        stream = self._streams.setdefault(frozenset((sender, receiver)), _Stream())
        sequence, acknowledged = stream.sent(sender, receiver, len(adu.data))
        segment = _segment(sender, receiver, sequence, acknowledged, adu.data)
        self._count += 1
        packet = _packet(sender.address, receiver.address, self._count & 0xFFFF, segment)
        return _mac(receiver.address) + _mac(sender.address) + struct.pack(">H", _IPV4) + packet

    def _ends(self, link: str, direction: Direction) -> tuple[Endpoint, Endpoint]:
        sender, arrow, receiver = link.partition(ARROW)
        if arrow:
            return self._end(sender), self._end(receiver)
        known, other = self._end(link), self._end("")  # an early recording: one end, and the direction
        return (other, known) if direction is Direction.TX else (known, other)

    def _end(self, name: str) -> Endpoint:
        host, _, port = name.rpartition(":")
        number = int(port) if port.isdecimal() and int(port) <= 0xFFFF else 0
        try:
            return Endpoint(int(IPv4Address(host)), number)
        except AddressValueError:
            return Endpoint(self._stand_in(host or name), number)

    def _stand_in(self, host: str) -> int:
        if host not in self.stand_ins:
            self.stand_ins[host] = str(IPv4Address(_STAND_INS + 1 + len(self.stand_ins) % _MOST_STAND_INS))
        return int(IPv4Address(self.stand_ins[host]))


def write_pcapng(path: Path, head: Head, frames: Iterable[Frame], lines: Collection[str] = ()) -> None:
    """Writes ``path``, which must not exist. The comment with the stand-ins comes at the end. Raises OSError.

    ``lines`` are those of the buses that are PROFIBUS.
    """
    framing = Framing()
    interfaces = {bus: number for number, bus in enumerate(head.buses)}
    with path.open("xb") as file:
        file.write(_section())
        for bus in head.buses:
            file.write(_interface(bus, _PROFIBUS_DL if bus in lines else _ETHERNET))
        last_ns = _write_packets(file, framing, interfaces, frames)
        if framing.stand_ins and head.buses:
            told = ", ".join(f"{address} stands for {host or '?'}" for host, address in framing.stand_ins.items())
            file.write(_packet_block(0, last_ns, b"", 0, told))


def _write_packets(file: BinaryIO, framing: Framing, interfaces: Mapping[str, int], frames: Iterable[Frame]) -> int:
    last_ns = 0
    for frame in frames:
        if isinstance(frame.payload, Adu):
            data = framing.frame(frame.payload, frame.direction)
        elif isinstance(frame.payload, Fdl):
            data = frame.payload.data
        else:
            continue
        flags = _OUTBOUND if frame.direction is Direction.TX else _INBOUND
        file.write(_packet_block(interfaces[frame.bus], frame.t_ns, data, flags))
        last_ns = frame.t_ns
    return last_ns


# -- TCP, IP -----------------------------------------------------------------------------


def _segment(sender: Endpoint, receiver: Endpoint, sequence: int, acknowledged: int, data: bytes) -> bytes:
    """RFC 9293, 3.1."""

    def header(checksum: int) -> bytes:
        offset = _TCP_BYTES // 4 << 4
        ports = sender.port, receiver.port
        return struct.pack(">HHIIBBHHH", *ports, sequence, acknowledged, offset, _PUSH_ACK, _WINDOW, checksum, 0)

    pseudo = struct.pack(">IIBBH", sender.address, receiver.address, 0, _TCP, _TCP_BYTES + len(data))
    return header(_checksum(pseudo + header(0) + data)) + data


def _packet(sender: int, receiver: int, identification: int, segment: bytes) -> bytes:
    """RFC 791, 3.1."""

    def header(checksum: int) -> bytes:
        length = _IP_BYTES + len(segment)
        first = 4 << 4 | _IP_BYTES // 4
        return struct.pack(
            ">BBHHHBBHII", first, 0, length, identification, 0, _HOPS, _TCP, checksum, sender, receiver
        )  # fmt: skip

    return header(_checksum(header(0))) + segment


def _checksum(data: bytes) -> int:
    """RFC 1071: the complement of the sum in ones' complement of words of 16 bits."""
    padded = data + bytes(len(data) % 2)
    total: int = sum(struct.unpack(f">{len(padded) // 2}H", padded))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


def _mac(address: int) -> bytes:
    return _OWN_MAC + address.to_bytes(4, "big")


# -- blocks ------------------------------------------------------------------------------


def _section() -> bytes:
    return _block(_SECTION, struct.pack("<IHHq", _BYTE_ORDER, 1, 0, -1) + _options([(4, b"Hubside")]))


def _interface(bus: str, link_type: int) -> bytes:
    options = [(2, bus.encode()), (9, bytes((_NANOSECONDS,)))]
    return _block(_INTERFACE, struct.pack("<HHI", link_type, 0, 0) + _options(options))


def _packet_block(interface: int, t_ns: int, data: bytes, flags: int, comment: str = "") -> bytes:
    head = struct.pack("<IIIII", interface, t_ns >> 32, t_ns & 0xFFFFFFFF, len(data), len(data))
    options = [(2, struct.pack("<I", flags))] + ([(1, comment.encode()[:0xFFF0])] if comment else [])
    return _block(_PACKET, head + _padded(data) + _options(options))


def _options(options: Iterable[tuple[int, bytes]]) -> bytes:
    return b"".join(_option(*one) for one in options) + bytes(4)


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + _padded(value)


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 4)


def _block(kind: int, body: bytes) -> bytes:
    length = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", kind) + length + body + length
