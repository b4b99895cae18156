"""Generated bus traffic as six pitch drives make it: SDO polling, PDOs on SYNC, heartbeats; 500 kbit/s, full."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

from app.wire.can_bits import frame_bits
from app.wire.frame import Can, Direction, Frame, Stamper

NODES = (1, 2, 3, 11, 12, 13)
BIT_NS = 2000  # 500 kbit/s
SYNC_NS = 10_000_000
HEARTBEAT_NS = 1_000_000_000
OBJECTS = 500  # per node, polled in turn
CHANGING = 0.3  # share of the polled values that change between two polls
JITTER_NS = 5000.0  # standard deviation of the host's time stamp
START_NS = 1_750_000_000_123_456_789


def traffic(count: int, seed: int = 1, start_ns: int = START_NS) -> list[Frame]:
    """``count`` frames of a bus that is always busy, about 4,000 a second, strictly increasing in time."""
    chance = random.Random(seed)
    bus = _Bus(start_ns)
    jitter_ns = 0
    stamp = Stamper(start_ns, lambda: bus.t_ns + jitter_ns - start_ns)
    frames: list[Frame] = []
    for direction, can in islice(_sequence(chance, bus), count):
        bus.t_ns += frame_bits(can) * BIT_NS
        jitter_ns = int(abs(chance.gauss(0.0, JITTER_NS)))
        frames.append(Frame(stamp(), "can0", direction, can))
    return frames


@dataclass
class _Bus:
    """The time on the bus."""

    t_ns: int


def _sequence(chance: random.Random, bus: _Bus) -> Iterator[tuple[Direction, Can]]:
    objects = [
        (
            chance.choice((0x2000, 0x3000, 0x6000)) + chance.randrange(0x200),
            chance.randrange(8),
            chance.choice((1, 2, 4)),
        )
        for _ in range(OBJECTS)
    ]
    values = {(node, n): chance.getrandbits(8 * size) for node in NODES for n, (_, _, size) in enumerate(objects)}
    angles = dict.fromkeys(NODES, 0)
    sync_ns = heartbeat_ns = bus.t_ns
    while True:
        for n, (index, sub, size) in enumerate(objects):
            for node in NODES:
                if bus.t_ns >= sync_ns:
                    sync_ns += SYNC_NS
                    yield from _cycle(chance, angles)
                if bus.t_ns >= heartbeat_ns:
                    heartbeat_ns += HEARTBEAT_NS
                    for sender in NODES:
                        yield Direction.RX, Can(0x700 + sender, b"\x05")
                if chance.random() < CHANGING:
                    values[node, n] = (values[node, n] + chance.randrange(-20, 20)) % (1 << 8 * size)
                address = index.to_bytes(2, "little") + bytes([sub])
                yield Direction.TX, Can(0x600 + node, b"\x40" + address + bytes(4))
                command = bytes([0x43 | (4 - size) << 2])
                yield Direction.RX, Can(0x580 + node, command + address + values[node, n].to_bytes(4, "little"))


def _cycle(chance: random.Random, angles: dict[int, int]) -> Iterator[tuple[Direction, Can]]:
    yield Direction.TX, Can(0x080)
    for node in NODES:
        angles[node] += chance.randrange(-50, 200)
        speed = chance.randrange(200)
        status = b"\x37\x16" + angles[node].to_bytes(4, "little", signed=True) + speed.to_bytes(2, "little")
        yield Direction.RX, Can(0x180 + node, status)
        measured = (int(chance.gauss(300, 5)), int(chance.gauss(40, 2)), int(chance.gauss(560, 2)), 25)
        yield Direction.RX, Can(0x280 + node, b"".join(value.to_bytes(2, "little", signed=True) for value in measured))
