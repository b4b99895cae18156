"""A turbine's bus at work, frame by frame: its controller cycles PDOs of six drives on SYNC and reads them by SDO.

The controller enables TPDO 2 and 3 first, as a real one does, so that every PDO's mapping can be followed. The position
of each axis counts up by one a cycle: no two frames of an axis carry the same.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from typing import Final

from app.wire.frame import Can

PMM_NODES: Final = (1, 2, 3)
PMC_NODES: Final = (11, 12, 13)
NODES: Final = (*PMM_NODES, *PMC_NODES)
POSITION_TPDO: Final = 0x280
"""TPDO 2 of an axis: statusword, position actual value (6064h)."""
EXCHANGES_A_CYCLE: Final = 9
CYCLES_A_HEARTBEAT: Final = 20
_READ: Final = (0x3010, 0x3011, 0x3062, 0x3070, 0x6061, 0x6078, 0x6079, 0x607A)
_EXPEDITED: Final = {1: 0x4F, 2: 0x4B, 4: 0x43}


def frames(count: int, first_cycle: int = 1) -> list[Can]:
    """``count`` frames, always the same ones; ``first_cycle`` is the first position of each axis."""
    return list(itertools.islice(_sequence(random.Random(1), first_cycle), count))


def endless() -> Iterator[Can]:
    """The same frames without an end."""
    return _sequence(random.Random(1), 1)


def position_of(can: Can) -> tuple[int, int] | None:
    """Node and position (6064h) where the frame carries one."""
    node = can.can_id - POSITION_TPDO
    return (node, int.from_bytes(can.data[2:6], "little")) if node in PMC_NODES else None


def _sequence(chance: random.Random, first_cycle: int) -> Iterator[Can]:
    yield from _set_up()
    for cycle in itertools.count(first_cycle):
        if cycle % CYCLES_A_HEARTBEAT == 1:
            yield from (Can(0x700 + node, b"\x05") for node in NODES)
        yield Can(0x080)
        yield from _pdos(chance, cycle)
        for n in range(EXCHANGES_A_CYCLE):
            turn = cycle * EXCHANGES_A_CYCLE + n
            index = _READ[turn // len(NODES) % len(_READ)]
            yield from _exchange(chance, NODES[turn % len(NODES)], index)


def _set_up() -> Iterator[Can]:
    """Enable TPDO 2 and 3 of all nodes (1801h:01, 1802h:01), then start them."""
    for node in NODES:
        for index, base in ((0x1801, POSITION_TPDO), (0x1802, 0x380)):
            address = index.to_bytes(2, "little") + b"\x01"
            yield Can(0x600 + node, b"\x23" + address + (0x40000000 | base + node).to_bytes(4, "little"))
            yield Can(0x580 + node, b"\x60" + address + bytes(4))
    yield Can(0x000, b"\x01\x00")


def _pdos(chance: random.Random, cycle: int) -> Iterator[Can]:
    for node in PMC_NODES:
        yield Can(0x200 + node, b"\x0f\x00")
    for node in PMC_NODES:
        speed = chance.randrange(-800, 800).to_bytes(4, "little", signed=True)
        yield Can(0x180 + node, b"\x37\x16")
        yield Can(POSITION_TPDO + node, b"\x37\x16" + cycle.to_bytes(4, "little"))
        yield Can(0x380 + node, b"\x37\x16" + speed)
    for node in PMM_NODES:
        battery, dc_link = chance.randrange(2900, 3000), chance.randrange(5500, 5700)
        yield Can(0x180 + node, b"\x04\x00\x00")
        yield Can(POSITION_TPDO + node, battery.to_bytes(2, "little") + chance.randbytes(4) + b"\x5f")
        yield Can(0x380 + node, battery.to_bytes(2, "little") + dc_link.to_bytes(2, "little") + chance.randbytes(4))


def _exchange(chance: random.Random, node: int, index: int) -> Iterator[Can]:
    size = chance.choice((1, 2, 2, 4))
    address = index.to_bytes(2, "little") + b"\x00"
    answer = bytes((_EXPEDITED[size],)) + address + chance.randbytes(size) + bytes(4 - size)
    yield Can(0x600 + node, b"\x40" + address + bytes(4))
    yield Can(0x580 + node, answer)
