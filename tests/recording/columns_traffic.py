"""Random CANopen traffic for tests that hold reading by columns to what the decoder sees, frame by frame."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Final

from app.model.address import Address
from app.wire import pdo, sdo
from app.wire.frame import Can, Direction, Frame
from tests.wire import traffic
from tests.wire.traffic import Line

BUSES: Final = ("can0", "bus-long-name", "c")
NODES: Final = (1, 2, 11)
STEPS_NS: Final = (0, 512, 512, 100_000, 100_000, 1_000_000, 70_000_000_000)
PLAIN: Final = (Address(0x6041), Address(0x6064), Address(0x3010, 1), Address(0x3062), Address(0x1008), Address(0x1001))
CONFIGURING: Final = (
    Address(0x1400, 1), Address(0x1600, 0), Address(0x1600, 1), Address(0x1800, 1), Address(0x1801, 1),
    Address(0x1A00, 0), Address(0x1A00, 1), Address(0x1A00, 2), Address(0x1A01, 0), Address(0x1A01, 1),
    Address(0x1200, 1), Address(0x1200, 2), Address(0x1014), Address(0x1010, 1), Address(0x1011, 1),
)  # fmt: skip
UNLISTED: Final = Address(0x1F50, 1)
_PDO_BASES: Final = (0x180, 0x200, 0x280, 0x300, 0x380)
_LONGEST_SLICE: Final = 6


def frames(seed: int, count: int, buses: Sequence[str]) -> list[Frame]:
    """About ``count`` frames, by time: transfers of all kinds in turns, whole and broken, and all that lies between."""
    chance = random.Random(seed)
    cans = {bus: _cans(chance, count // len(buses) + 1) for bus in buses}
    found, t_ns = [], 1_750_000_000_000_000_000
    while any(cans.values()):
        bus = chance.choice([bus for bus, left in cans.items() if left])
        for can in cans[bus][: chance.randrange(1, 4)]:
            t_ns += chance.choices(STEPS_NS, (1, 20, 20, 20, 20, 5, 1))[0]
            found.append(Frame(t_ns, bus, chance.choice(tuple(Direction)), can))
            cans[bus].pop(0)
    return found


def _cans(chance: random.Random, count: int) -> list[Can]:
    """Frames of several conversations that take turns; those of a node sometimes too."""
    found: list[Can] = []
    while len(found) < count:
        talks = [_talk(chance) for _ in range(chance.randrange(1, 4))]
        while any(talks):
            talk = chance.choice([talk for talk in talks if talk])
            for _ in range(chance.randrange(1, _LONGEST_SLICE)):
                if talk:
                    found.append(talk.pop(0))
    return found


def _talk(chance: random.Random) -> list[Can]:
    node = chance.choice(NODES)
    kinds = (_expedited, _expedited, _expedited, _configured, _long, _pdos, _pdos, _services, _noise)
    return chance.choice(kinds)(chance, node)


def _expedited(chance: random.Random, node: int) -> list[Can]:
    """Exchanges, most of them whole."""
    found: list[Can] = []
    for _ in range(chance.randrange(1, 12)):
        make = chance.choice((traffic.read, traffic.read, traffic.write))
        lines = make(chance.choice(PLAIN), chance.randbytes(chance.randrange(1, 5)))
        cans = _on(node, _worn(chance, lines, 0.1))
        if chance.random() < 0.05:
            cans.insert(chance.randrange(len(cans) + 1), Can(0x700 + node, b"\0"))
        found += cans
    return found


def _configured(chance: random.Random, node: int) -> list[Can]:
    """A PDO mapped anew or read, an identifier moved, a save: whole as a rule."""
    base, mapping = chance.choice(((0x1400, 0x1600), (0x1800, 0x1A00), (0x1801, 0x1A01)))
    identifier = chance.choice((chance.choice(_PDO_BASES) + node, chance.choice(_PDO_BASES) + chance.choice(NODES)))
    cob_id = identifier | chance.choice((0, 0, 0, pdo.COB_EXTENDED, pdo.COB_INVALID))
    entries = [(address, chance.choice((8, 16, 32, 4, 0))) for address in chance.sample(PLAIN, chance.randrange(1, 4))]
    server = chance.choice((0x600, 0x580)) + chance.choice((node, 100))
    writes = [
        (Address(base, 1), cob_id.to_bytes(4, "little")),
        (Address(mapping, 0), b"\0"),
        *(
            (Address(mapping, n), (address.major << 16 | address.minor << 8 | bits).to_bytes(4, "little"))
            for n, (address, bits) in enumerate(entries, 1)
        ),
        (Address(mapping, 0), bytes((len(entries),))),
    ]
    single = [
        (Address(0x1200, chance.choice((1, 2))), server.to_bytes(4, "little")),
        (Address(0x1014), (chance.choice((0x80, 0x180)) + node).to_bytes(4, "little")),
        (Address(0x1010, 1), b"save"),
        (Address(0x1011, 1), b"load"),
        (chance.choice(CONFIGURING), chance.randbytes(4)),
    ]
    chosen = writes if chance.random() < 0.6 else [chance.choice(single)]
    found: list[Can] = []
    for address, data in chosen:
        make = traffic.read if chance.random() < 0.2 else traffic.write
        found += _on(node, _worn(chance, make(address, data), 0.04))
    return found


def _long(chance: random.Random, node: int) -> list[Can]:
    """Segmented and block transfers, of objects that configure frames too."""
    address, data = chance.choice((*PLAIN, *CONFIGURING)), chance.randbytes(chance.choice((1, 5, 9, 20, 60)))
    if chance.random() < 0.2:
        return _on(node, _worn(chance, traffic.block_write(UNLISTED, _misleading(chance)), 0.1))
    kind = chance.randrange(4)
    if kind < 2:
        lines = (traffic.read, traffic.write)[kind](address, data + bytes(4))
    else:
        make = (traffic.block_read, traffic.block_write)[kind - 2]
        block, crc = chance.choice((3, 127)), chance.random() < 0.8
        lines = make(address, data, block, losses=[1] if chance.random() < 0.2 else [], crc=crc)
    return _on(node, _worn(chance, lines, 0.3))


def _misleading(chance: random.Random) -> bytes:
    """Data whose segments look like requests: numbers 32 and above are those of an initiate download."""
    segments = (
        address.major.to_bytes(2, "little") + bytes((address.minor,)) + chance.randbytes(4)
        for address in chance.choices((*PLAIN, *CONFIGURING), k=chance.randrange(30, 70))
    )
    return b"".join(segments)


def _pdos(chance: random.Random, node: int) -> list[Can]:
    return [
        Can(chance.choice(_PDO_BASES) + node, chance.randbytes(chance.choice((2, 4, 6, 8, 8))))
        for _ in range(chance.randrange(1, 8))
    ]


def _services(chance: random.Random, node: int) -> list[Can]:
    """NMT, heartbeats, boot-ups, emergencies; some of a wrong length."""
    state = chance.choice((0, 4, 5, 5, 127, 3))
    emergency = (0x1000).to_bytes(2, "little") + chance.randbytes(6)
    target = chance.choice((0, node, 200))
    choices = (
        Can(0, bytes((chance.choice((1, 1, 2, 128, 129, 7)), target))[: chance.choice((2, 2, 2, 1))]),
        Can(0x700 + chance.choice((*NODES, 50)), bytes((state,)) * chance.choice((1, 1, 1, 0, 2))),
        Can(0x80 + node, emergency[: chance.choice((8, 8, 7))]),
        Can(0x80, b""),
    )
    return [chance.choice(choices) for _ in range(chance.randrange(1, 4))]


def _noise(chance: random.Random, node: int) -> list[Can]:
    """Frames that mean nothing, or something else than they look like."""
    can_id = chance.choice((0x600, 0x580, 0x180, 0x80, 0x700, 0x200)) + node
    address = chance.choice((*PLAIN, *CONFIGURING))
    data = chance.choice(
        (
            bytes((chance.randrange(256),)) + address.major.to_bytes(2, "little") + chance.randbytes(5),
            sdo.abort(address, 0x06090011),
            sdo.upload_request(address),
            sdo.upload_response(address, chance.randbytes(2)),
            chance.randbytes(chance.randrange(8)),
        )
    )
    return [
        chance.choice(
            (
                Can(can_id, data),
                Can(can_id, data),
                Can(can_id, data, extended=True),
                Can(can_id | 1 << 20, data, extended=True),
                Can(can_id, data, error=True),
                Can(can_id, b"", remote=True, dlc=chance.randrange(16)),
                Can(can_id, data.ljust(8, b"\0"), dlc=chance.randrange(9, 16)),
            )
        )
    ]


def _worn(chance: random.Random, lines: list[Line], share: float) -> list[Line]:
    """The same conversation, or one that lost a frame, was aborted, doubled, given up or cut short."""
    if chance.random() >= share:
        return lines
    place = chance.randrange(len(lines))
    mux = lines[0].data[1:4]
    abort = Line(chance.random() < 0.5, b"\x80" + mux + chance.randbytes(4))
    return chance.choice(
        (
            lines[:place],
            lines[:place] + lines[place + 1 :],
            [*lines[:place], abort],
            [*lines[:place], abort, *lines[place:]],
            [*lines[:place], lines[place], *lines[place:]],
            [*lines[:place], Line(lines[place].client, lines[place].data[:5]), *lines[place:]],
        )
    )


def _on(node: int, lines: Sequence[Line]) -> list[Can]:
    return [Can((0x600 if line.client else 0x580) + node, line.data) for line in lines]
