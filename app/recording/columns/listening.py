"""What to look for among the frames of a bus, as long as its identifiers keep their meaning."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from enum import IntEnum
from functools import cache
from typing import Final, NamedTuple

import numpy as np

from app.model.address import Address, Addressing
from app.recording.can_table import Block, Bytes, CanColumns, Flags, Rows, Words
from app.wire import pdo, sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.nmt import MAX_NODE
from app.wire.pdo_follower import PdoRoute, configures
from app.wire.records import Source
from app.wire.sdo_follower import LOAD_INDEX, SAVE_INDEX
from app.wire.trace.service import Service

_STANDARD: Final = 1 << 11
EXTENDED: Final = 1 << 29
"""Added to an identifier of 29 bits."""
_INDICES: Final = 1 << 16


class Kind(IntEnum):
    """What a frame is to who looks for values; bits, so that several are found in one go."""

    NOTHING = 0
    PDO = 1
    EMCY = 2
    NMT = 4
    HEARTBEAT = 8
    REQUEST = 16
    RESPONSE = 32


_TAKEN: Final = Kind.PDO | Kind.EMCY | Kind.NMT | Kind.HEARTBEAT


class Field(NamedTuple):
    """Where a wanted object lies in a PDO of ``pdo_size`` bytes: ``bits`` from bit ``position`` on."""

    node: int
    address: Address
    position: int
    bits: int
    pdo_size: int
    source: Source


class Wanted:
    """The objects looked for on a bus, by node."""

    def __init__(self, objects: Collection[tuple[int, Address]]) -> None:
        self.objects = frozenset(objects)
        self.nodes = frozenset(node for node, _ in objects)
        self.by_key = {key(node, mux(address)): (node, address) for node, address in objects if _in_od(address)}
        self.indices = np.zeros(_INDICES, dtype=np.bool_)
        """Indices that a request must name to be of interest: those looked for, and those that configure frames."""
        for address in (address for _, address in objects if _in_od(address)):
            self.indices[address.major] = True
        self.configuring = _configuring()
        self.indices |= self.configuring


@cache
def _configuring() -> Flags:
    """Of every index, whether a transfer may change how frames are read."""
    own = (SAVE_INDEX, LOAD_INDEX)
    return np.array([index in own or configures(Address(index)) for index in range(_INDICES)])


def _in_od(address: Address) -> bool:
    return address.addressing is Addressing.OD and 0 <= address.major < _INDICES and 0 <= address.minor < 256


def mux(address: Address) -> int:
    """Index and sub-index as an SDO frame carries them, first byte lowest."""
    return address.major | address.minor << 16


def key(node: int, multiplexer: int) -> int:
    """An object of a node as one number."""
    return node << 24 | multiplexer


class Digest(NamedTuple):
    """The frames of a block that matter: their rows in the block, their kinds, their columns.

    Of SDO only the requests are in it that open a transfer of interest. ``listening`` tells what was looked for.
    """

    listening: Listening
    rows: Rows
    kinds: Bytes
    columns: CanColumns


class Listening:
    """The meaning of identifiers by what ``decoder`` knows now."""

    def __init__(self, decoder: CanOpenDecoder, wanted: Wanted) -> None:
        self._layouts = decoder.layouts
        self._service_ids = decoder.service_ids()
        self.wanted = wanted
        self.nodes = np.zeros(_STANDARD + 1, dtype=np.uint8)
        self.fields = _fields(decoder, wanted)
        self.requests: dict[int, int] = {}
        self.responses: dict[int, int] = {}
        self._kinds = np.zeros(_STANDARD + 1, dtype=np.uint8)
        for can_id, speaker in decoder.speakers().items():
            if can_id < _STANDARD:
                self._hear(can_id, speaker.service, speaker.node)
        self._extended = np.array([k & ~EXTENDED for k in self.fields if k & EXTENDED], dtype=np.uint32)

    def _hear(self, can_id: int, service: Service, node: int) -> None:
        kind = Kind.NOTHING
        if service in (Service.TPDO, Service.RPDO):
            kind = Kind.PDO if can_id in self.fields else kind
        elif service is Service.EMCY:
            kind = Kind.EMCY if node in self.wanted.nodes else kind
        elif service is Service.NMT:
            kind = Kind.NMT
        elif service is Service.HEARTBEAT:
            kind = Kind.HEARTBEAT
        elif service is Service.SDO_REQUEST:
            kind = Kind.REQUEST
            self.requests[node] = can_id
        elif service is Service.SDO_RESPONSE:
            kind = Kind.RESPONSE
            self.responses[node] = can_id
        self._kinds[can_id] = kind
        self.nodes[can_id] = node

    def holds(self, decoder: CanOpenDecoder) -> bool:
        """Whether the meaning is still what ``decoder`` knows: PDOs of other objects may change as they like."""
        if decoder.layouts == self._layouts:
            return True
        fields = _fields(decoder, self.wanted)
        if decoder.service_ids() != self._service_ids or [*fields.items()] != [*self.fields.items()]:
            return False
        self._layouts = decoder.layouts
        return True

    def digest(self, block: Block) -> Digest:
        """What matters of ``block``."""
        ids = block.ids
        kinds = self._kinds.take(ids, mode="clip")
        if len(self._extended):
            sent = np.flatnonzero(np.isin(ids, self._extended))
            kinds[sent[block.gather(sent).extended]] = Kind.PDO  # whatever the same number means with 11 bits
        rows = np.flatnonzero((kinds & _TAKEN) != 0)
        requests = np.flatnonzero(kinds == Kind.REQUEST)
        openers = requests[self._opens(block.words(requests))]
        if len(openers):
            rows = np.sort(np.concatenate((rows, openers)))
        return Digest(self, rows, kinds[rows], block.gather(rows))

    def _opens(self, words: Words) -> Flags:
        """Which requests may open a transfer of interest. A block download of any object is one (see ``follow``)."""
        named: Flags = self.wanted.indices[words >> np.uint64(8) & np.uint64(0xFFFF)]
        named |= words >> np.uint64(5) & np.uint64(7) == sdo.Command.CCS_BLOCK_DOWNLOAD
        return named


def _fields(decoder: CanOpenDecoder, wanted: Wanted) -> Mapping[int, list[Field]]:
    """Where PDOs carry what is wanted, by identifier (extended: plus 2^29), in the order in which they are read."""
    found: dict[int, list[Field]] = {}
    for node in sorted(wanted.nodes):
        if not 1 <= node <= MAX_NODE:
            continue
        for route in decoder.pdos(node):
            fields = [field for field in _mapped(node, route) if (node, field.address) in wanted.objects]
            can_id = route.can_id | EXTENDED if route.extended else route.can_id
            if fields and _is_pdo(decoder, can_id):
                found.setdefault(can_id, []).extend(fields)
    return found


def _is_pdo(decoder: CanOpenDecoder, can_id: int) -> bool:
    """Whether PDOs are heard there: fixed services win over them."""
    speaker = decoder.speaker(can_id & ~EXTENDED, bool(can_id & EXTENDED))
    return speaker.service in (Service.TPDO, Service.RPDO)


def _mapped(node: int, route: PdoRoute) -> Iterator[Field]:
    position = 0
    for address, bits in route.mapping.entries:
        if address.major > pdo.MAX_DUMMY_INDEX:
            yield Field(node, address, position, bits, route.mapping.size, route.source)
        position += bits
