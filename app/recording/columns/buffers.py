"""Memory to unpack into, used again as soon as nobody looks at it: fresh pages cost a tenth of the reading."""

from __future__ import annotations

import sys
from threading import Lock
from typing import Any, Final

import numpy as np

LEAST_BYTES: Final = 1 << 23
MOST_KEPT: Final = 8
_UNUSED: Final = 3
"""References to an array that only ``Buffers`` knows, as ``take`` counts them: its list, the loop, the count itself."""


class Buffers:
    """Gives memory to threads. A piece is free again when no array and no view of it is left."""

    def __init__(self) -> None:
        self._kept: list[np.ndarray[Any, np.dtype[np.uint8]]] = []
        self._lock = Lock()

    def take(self, size: int) -> memoryview:
        """``size`` bytes of whatever content."""
        with self._lock:
            for kept in self._kept:
                if len(kept) >= size and sys.getrefcount(kept) <= _UNUSED:
                    return kept[:size].data
            fresh = np.empty(max(size, LEAST_BYTES), dtype=np.uint8)
            if len(self._kept) < MOST_KEPT:
                self._kept.append(fresh)
            return fresh[:size].data
