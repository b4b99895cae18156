"""The PDO mapping of one node as far as it is known: its description's defaults, then what SDO traffic showed.

After a boot-up the mapping is what was stored: the description's default, overlaid with what stood there at an
acknowledged save, or was read before anybody wrote it. Where a node keeps more than that, the next read tells.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

from app.model.address import Address, parse_address
from app.model.description import Description
from app.model.pdo.setup import EVENT_TYPES, SUB_COB_ID, SUB_INHIBIT, SUB_TYPE
from app.wire import pdo
from app.wire.records import Source
from app.wire.stored import covers

_BASES: Final = {  # communication, mapping, source, COB-ID of PDO 1 in the predefined connection set
    pdo.TPDO_COMMUNICATION: (pdo.TPDO_MAPPING, Source.PDO_TX, 0x180),
    pdo.RPDO_COMMUNICATION: (pdo.RPDO_MAPPING, Source.PDO_RX, 0x200),
}
_PREDEFINED: Final = 4
"""PDOs of the predefined connection set."""
_MAX_ENTRIES: Final = 64
"""More in sub-index 0 means a multiplex PDO (FEh, FFh), whose data name their own address."""
SDO_SERVER: Final = 0x1200
EMCY_COB_ID: Final = 0x1014


class PdoRoute(NamedTuple):
    """A PDO that exists: its identifier, what it carries, which way, and its number from 1 on.

    ``at_once``: it is event-driven (type 254 or 255, CiA 301, 7.5.2.35) and no inhibit time holds it back, as far as is
    known for sure. Data of another RPDO take effect at the next SYNC, if there is one; this one's when they come.
    """

    can_id: int
    extended: bool
    mapping: pdo.Mapping
    source: Source
    number: int
    at_once: bool


class Layout(NamedTuple):
    """CAN identifiers of a node's default SDO server (1200h) and emergency messages (1014h), and its PDOs."""

    sdo_request: int
    sdo_response: int
    emcy: int
    predefined: bool
    """The three identifiers are those of the predefined connection set."""
    pdos: tuple[PdoRoute, ...]


def configures(address: Address) -> bool:
    """True where the object decides how frames are to be read."""
    index = address.major
    return 0x1400 <= index < 0x1C00 or index in (SDO_SERVER, EMCY_COB_ID)


class NodeConfiguration:
    """COB-IDs and mappings of ``node``. Values are raw integers."""

    def __init__(self, node: int, description: Description | None) -> None:
        self._node = node
        self._description = description
        self._known: dict[Address, int] = {}
        self._stored: dict[Address, int] = {}
        self._written: set[Address] = set()
        self._defaults = {} if description is None else _defaults(description, node)

    def learn(self, address: Address, data: bytes, written: bool) -> bool:
        """Take a value that a device gave or acknowledged. True where routes may have changed."""
        raw = int.from_bytes(data, "little")
        before = self._in_force(address)
        if written:
            self._written.add(address)
        elif address not in self._written:
            self._stored[address] = raw
        self._known[address] = raw
        return self._in_force(address) != before

    def forget(self, address: Address) -> bool:
        """A write had no end that was seen: back to what is stored. True where routes may have changed."""
        before = self._in_force(address)
        self._written.add(address)
        self._known.pop(address, None)
        return self._in_force(address) != before

    def save(self, command: Address) -> None:
        """'save' was acknowledged on ``command``."""
        for address, raw in self._known.items():
            if covers(self._description, command, address):
                self._stored[address] = raw

    def load(self, command: Address) -> None:
        """'load' was acknowledged on ``command``: defaults are in force from the next boot-up on."""
        for address in [a for a in self._stored if covers(self._description, command, a)]:
            del self._stored[address]

    def boot_up(self) -> bool:
        """The node has started anew. True where routes may have changed."""
        changed = self._known != self._stored or any(map(self._is_unsure, self._written))
        self._known = dict(self._stored)
        self._written.clear()
        return changed

    def get(self, address: Address) -> int | None:
        """The raw value in force, else None."""
        known = self._known.get(address)
        return self._defaults.get(address) if known is None else known

    def _in_force(self, address: Address) -> tuple[int | None, bool]:
        return self.get(address), self._is_unsure(address)

    def _is_unsure(self, address: Address) -> bool:
        """A write to it had no end that was seen, and nobody has read it since."""
        return address in self._written and address not in self._known

    def layout(self) -> Layout:
        """All identifiers and PDOs in force."""
        request, response = (self.get(Address(SDO_SERVER, sub)) for sub in (1, 2))
        predefined = (0x600 + self._node, 0x580 + self._node, 0x80 + self._node)
        known = (request, response, self.get(Address(EMCY_COB_ID)))
        ids = tuple((raw or usual) & 0x7FF for raw, usual in zip(known, predefined, strict=True))
        return Layout(ids[0], ids[1], ids[2], ids == predefined, tuple(self.routes()))

    def routes(self) -> Iterator[PdoRoute]:
        """Every PDO that is valid and whose mapping is known."""
        for base, (mapping_base, source, predefined) in _BASES.items():
            for number in self._numbers(mapping_base):
                cob_id = self.get(Address(base + number, SUB_COB_ID))
                if cob_id is None and number < _PREDEFINED:
                    cob_id = predefined + 0x100 * number + self._node
                mapping = self._mapping(mapping_base + number)
                if cob_id is None or mapping is None:
                    continue
                parameters = pdo.PdoParameters(cob_id)
                if parameters.valid:
                    at_once = self._is_at_once(base + number, mapping_base + number)
                    yield PdoRoute(parameters.can_id, parameters.extended, mapping, source, number + 1, at_once)

    def _is_at_once(self, communication: int, mapping: int) -> bool:
        if any(one.major in (communication, mapping) and self._is_unsure(one) for one in self._written):
            return False
        kind, inhibit = (self.get(Address(communication, sub)) for sub in (SUB_TYPE, SUB_INHIBIT))
        return kind in EVENT_TYPES and not inhibit

    def _numbers(self, base: int) -> list[int]:
        known = {a.major - base for known in (self._defaults, self._known) for a in known}
        return sorted(n for n in known if 0 <= n < pdo.PDO_COUNT)

    def _mapping(self, index: int) -> pdo.Mapping | None:
        count = self.get(Address(index, 0))
        if not count or count > _MAX_ENTRIES:
            return None
        entries = []
        for sub in range(1, count + 1):
            raw = self.get(Address(index, sub))
            if raw is None:
                return None
            if raw:
                entries.append(pdo.parse_mapping_entry(raw))
        mapping = pdo.Mapping(tuple(entries))
        return mapping if 0 < mapping.bits <= 64 else None

    # -- keyframes -------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state, without the description's defaults."""
        return {
            "known": {str(a): raw for a, raw in self._known.items()},
            "stored": {str(a): raw for a, raw in self._stored.items()},
            "written": sorted(map(str, self._written)),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from ``snapshot()``."""
        self._known = {parse_address(a): raw for a, raw in state["known"].items()}
        self._stored = {parse_address(a): raw for a, raw in state["stored"].items()}
        self._written = {parse_address(a) for a in state["written"]}


def _defaults(description: Description, node: int) -> dict[Address, int]:
    """Defaults of the objects that configure frames, the node's number added where the description says so."""
    return {
        entry.address: entry.default + (node if entry.node_id else 0)
        for entry in description
        if configures(entry.address) and isinstance(entry.default, int)
    }
