"""The decoder keeps up with a full bus many times over, so that a slow laptop does with one."""

from __future__ import annotations

import time

from app.model.address import Address
from app.model.description_file import load_builtin
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Direction
from app.wire.live import LiveState
from tests.wire import traffic
from tests.wire.traffic import BUS, frame, frames

LEAST_FRAMES_PER_S = 60_000
"""A bus of 500 kbit/s carries at most about 9,000 frames a second."""


def test_decoder_follows_60000_frames_a_second() -> None:
    """Reads of two objects a node and one PDO of each; best of several rounds, for the machine may be busy."""
    decoder = CanOpenDecoder(BUS, {node: load_builtin("oat-pmc") for node in (11, 12, 13)})
    capture = []
    for i in range(2000):
        node = 11 + i % 3
        reading = frames(node, traffic.read(Address(0x3000 + i % 200, i % 4), b"\1\2"), 3 * i)
        capture += [reading[0]._replace(direction=Direction.TX), reading[1]]
        capture.append(frame(3 * i + 2, 0x180 + node, b"\x37\x02"))
    best, live = 0.0, LiveState()
    for _ in range(5):
        start = time.perf_counter()
        for item in capture:
            live.apply_all(decoder.feed(item))
        best = max(best, len(capture) / (time.perf_counter() - start))
    assert best >= LEAST_FRAMES_PER_S
