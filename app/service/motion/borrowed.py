"""Settings that one test signal borrows of a drive: PDOs that are switched on, times, a speed; put back at its end.

No mapping is changed: a PDO that carries what is needed is switched on, by bit 31 of its COB-ID. What is written is
noted in ``Left`` before, so that it can be put back after a server was killed; a restart of the drive ends it too.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from app.errors import HubsideError
from app.model.address import Address
from app.model.checks import Allow
from app.model.datatypes import encode_raw
from app.service.devices import decode
from app.service.journal import Journal
from app.service.motion.control import Control
from app.service.motion.left import Changed, Left
from app.service.write import write_raw
from app.wire import pdo

log = logging.getLogger(__name__)

TARGET: Final = Address(0x607A)
ACTUAL: Final = Address(0x6064)
BESIDE_TARGET: Final = frozenset(map(Address, (0x6081, 0x6083, 0x6084, 0x60B0, 0x60B1)))
"""What a PDO may carry beside the target: it is sent along as it stands. A controlword would be a command."""
_PDOS: Final = 4
_AT_ONCE: Final = 254
"""Transmission types from here on do not wait for a SYNC."""
_SAMPLE_MS: Final = 10


@dataclass(frozen=True, slots=True)
class PdoFound:
    """A PDO of the device as it is configured now. ``number`` from 1 on."""

    number: int
    parameters: pdo.PdoParameters
    mapping: pdo.Mapping

    @property
    def carried(self) -> frozenset[Address]:
        """Addresses that it carries."""
        return frozenset(address for address, _ in self.mapping.entries)

    @property
    def usable(self) -> bool:
        """Sent and taken at once, by whole octets."""
        return self.parameters.transmission_type >= _AT_ONCE and self.mapping.slots is not None


class Borrowed:
    """What was changed for one run. Needs an axis without power while it is set."""

    def __init__(self, control: Control, left: Left, journal: Journal) -> None:
        self._control = control
        self._left = left
        self._journal = journal
        self._mine: list[Address] = []

    async def number(self, address: Address, raw: int) -> None:
        """Write a number, unless it stands there. Raises what a write raises, StoreError."""
        await self.put(address, encode_raw(self._control.target.entry(address).type, raw))

    async def put(self, address: Address, data: bytes) -> None:
        """Write, noted before; nothing where it stands there. Raises what a write raises, StoreError."""
        was = await self._control.driver.read(self._control.target.node, address)
        if was == data:
            return
        self._control.require_own()
        await self._left.note(self._control.target.slug, address, Changed(was, data))
        self._mine.append(address)
        await self._write(address, data)

    async def put_back(self) -> bool:
        """What stood there before, newest first; whether all of it does. What failed stays noted in ``Left``.

        What no longer holds what was written is left as it is. None of it moves an axis or stops one.
        """
        slug, node = self._control.target.slug, self._control.target.node
        done = True
        for address in reversed(self._mine):
            changed = self._left.of(slug).get(address)
            if changed is None:
                continue
            try:
                if await self._control.driver.read(node, address) == changed.now:
                    await self._write(address, changed.was)
                await self._left.forget(slug, address)
            except HubsideError as error:
                log.warning("%s: %s is not put back: %s", slug, address.short, error.code)
                done = False
        self._mine.clear()
        return done

    async def _write(self, address: Address, data: bytes) -> None:
        control = self._control
        raw = decode(control.target.entry(address), data)
        await write_raw(control.driver, control.target, address, raw, self._journal, allow=Allow.COMMUNICATION)

    # -- PDOs ----------------------------------------------------------------------

    async def target_pdo(self) -> PdoFound | None:
        """The receive PDO that brings targets, switched on if need be. None: there is none that could."""
        found = [
            one
            for one in await self._found(pdo.RPDO_COMMUNICATION, pdo.RPDO_MAPPING)
            if one.usable and TARGET in one.carried and one.carried <= BESIDE_TARGET | {TARGET}
        ]
        return await self._on(pdo.RPDO_COMMUNICATION, found)

    async def sample_pdo(self) -> PdoFound | None:
        """A transmit PDO with the actual position, switched on at 100 a second. None: it must be read instead.

        One that is switched on already is somebody's, at a rate of theirs, and is left as it is.
        """
        found = await self._found(pdo.TPDO_COMMUNICATION, pdo.TPDO_MAPPING)
        off = [one for one in found if one.usable and not one.parameters.valid and ACTUAL in one.carried]
        # The one with the most to tell beside it, and no statusword, whose every change would be a frame.
        off.sort(key=lambda one: (Address(0x6041) in one.carried, -len(one.carried)))
        if not off:
            return None
        major = pdo.TPDO_COMMUNICATION + off[0].number - 1
        await self.number(Address(major, 3), 10 * _SAMPLE_MS)
        await self.number(Address(major, 5), _SAMPLE_MS)
        return await self._on(pdo.TPDO_COMMUNICATION, off[:1])

    async def _on(self, base: int, found: list[PdoFound]) -> PdoFound | None:
        on = next((one for one in found if one.parameters.valid), None)
        if on is not None or not found:
            return on
        chosen = found[0]
        await self.number(Address(base + chosen.number - 1, 1), chosen.parameters.cob_id & ~pdo.COB_INVALID)
        return chosen

    async def _found(self, base: int, mapping_base: int) -> list[PdoFound]:
        entries = self._control.target.description.entries
        majors = [(base + n, mapping_base + n) for n in range(_PDOS)]
        asked = [a for a in entries if any(a.major in pair for pair in majors)]
        answers = await self._control.driver.read_many(self._control.target.node, asked)
        known = {a: int.from_bytes(data, "little") for a, data in answers.items() if isinstance(data, bytes)}
        return list(_pdos(majors, known))


def _pdos(majors: list[tuple[int, int]], known: Mapping[Address, int]) -> Iterator[PdoFound]:
    for number, (communication, mapping) in enumerate(majors, 1):
        cob_id, kind = known.get(Address(communication, 1)), known.get(Address(communication, 2))
        count = known.get(Address(mapping, 0), 0)
        raws = [known.get(Address(mapping, sub)) for sub in range(1, count + 1)]
        if cob_id is None or kind is None or not raws or any(not raw for raw in raws):
            continue
        entries = tuple(pdo.parse_mapping_entry(raw) for raw in raws if raw)
        yield PdoFound(number, pdo.PdoParameters(cob_id, kind), pdo.Mapping(entries))
