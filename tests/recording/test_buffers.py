"""Memory is used again only when nothing looks at it any more, whatever kind of view that is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from app.recording.columns.buffers import LEAST_BYTES, MOST_KEPT, Buffers

VIEWS: dict[str, Callable[[memoryview], Any]] = {
    "itself": lambda data: data,
    "a slice": lambda data: data[5:6],
    "an array": lambda data: np.frombuffer(data, dtype=np.uint8),
    "a field of records": lambda data: np.frombuffer(data, dtype=[("a", "u1"), ("b", "u1")])["b"][3:4],
    "an array that is contiguous by chance": lambda data: np.ascontiguousarray(np.frombuffer(data, np.uint8)[::9][:1]),
}


def place(data: memoryview) -> int:
    address: int = np.frombuffer(data, dtype=np.uint8).__array_interface__["data"][0]
    return address


@pytest.mark.parametrize("view", VIEWS.values(), ids=VIEWS)
def test_what_is_looked_at_is_not_given_again(view: Callable[[memoryview], Any]) -> None:
    buffers = Buffers()
    data = buffers.take(100)
    first, looking = place(data), view(data)
    del data
    assert place(buffers.take(100)) != first
    del looking
    assert first in {place(buffers.take(100)) for _ in range(2)}


def test_it_gives_what_is_asked_for_and_keeps_little() -> None:
    buffers = Buffers()
    held = [buffers.take(size) for size in (1, LEAST_BYTES + 1, 3 * LEAST_BYTES, *range(1, 20))]
    assert [len(each) for each in held[:3]] == [1, LEAST_BYTES + 1, 3 * LEAST_BYTES]
    assert len({place(each) for each in held}) == len(held)
    assert len(buffers._kept) == MOST_KEPT
