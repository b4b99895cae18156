"""PDOs of the axis unit as it is delivered, and ways to change them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from app.model.address import Address, parse_address
from app.model.datatypes import Raw
from app.model.description import Description
from app.model.description_file import load_builtin
from app.model.pdo.objects import mapping_entry
from app.model.pdo.setup import Direction, Mapped, PdoId, PdoPlace, PdoSetup, objects_of, parse_setup, places_of

NODE = 0x11
RPDO1, RPDO2 = (PdoId(Direction.RECEIVE, number) for number in (1, 2))
TPDO1, TPDO2, TPDO3 = (PdoId(Direction.TRANSMIT, number) for number in (1, 2, 3))


@cache
def pmc() -> Description:
    return load_builtin("oat-pmc")


@cache
def places() -> tuple[PdoPlace, ...]:
    return places_of(pmc())


def place(pdo: PdoId) -> PdoPlace:
    return next(one for one in places() if one.id == pdo)


def delivered_values() -> dict[Address, Raw]:
    """Every object that sets up a PDO, with its default."""
    found: dict[Address, Raw] = {}
    for one in places():
        for address in objects_of(one):
            entry = pmc().entry(address)
            assert isinstance(entry.default, int)
            found[address] = entry.default + (NODE if entry.node_id else 0)
    return found


def delivered() -> dict[PdoId, PdoSetup]:
    values = delivered_values()
    found = {one.id: parse_setup(one, values.get) for one in places()}
    return {pdo: setup for pdo, setup in found.items() if setup is not None}


def mapped(*objects: str) -> tuple[Mapped, ...]:
    """``"6041/16"``: index, width."""
    parts = (one.split("/") for one in objects)
    return tuple(Mapped(mapping_entry(parse_address(address), int(bits))) for address, bits in parts)


def changed(setup: PdoSetup, *objects: str, **parameters: int) -> PdoSetup:
    """Other objects where some are named, other parameters where some are."""
    entries = mapped(*objects) if objects else setup.mapped
    return replace(setup, mapped=entries, parameters=setup.parameters._replace(**parameters))


def enabled(setup: PdoSetup, *objects: str, **parameters: int) -> PdoSetup:
    return changed(setup, *objects, **{"cob_id": setup.parameters.cob_id & 0x7FFFFFFF, **parameters})


def disabled(setup: PdoSetup) -> PdoSetup:
    return changed(setup, cob_id=setup.parameters.cob_id | 0x80000000)
