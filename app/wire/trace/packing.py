"""What the ring asks of a way to keep frames as bytes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

from app.wire.frame import Frame


class Packing(Protocol):
    """Frames of one bus as bytes, and back."""

    def pack(self, frames: Sequence[Frame]) -> bytes:
        """Keep them. Raises TypeError where one is of another kind."""

    def unpack(self, data: bytes, bus: str) -> Iterator[Frame]:
        """What was packed."""
