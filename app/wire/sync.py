"""Byte codec of SYNC (CiA 301, 7.2.5): CAN id 80h, no data or a counter of 1..240. Pure."""

from __future__ import annotations

from typing import Final

SYNC_COB_ID: Final = 0x080
TIME_COB_ID: Final = 0x100
MAX_COUNTER: Final = 240


def sync(counter: int | None = None) -> bytes:
    """Data of a SYNC. Raises ValueError where the counter is outside 1..240."""
    if counter is None:
        return b""
    if not 1 <= counter <= MAX_COUNTER:
        raise ValueError(f"SYNC counter {counter} is outside 1..240")
    return bytes((counter,))


def parse_sync(data: bytes) -> int | None:
    """The counter of a SYNC, or None where it has none. Raises ValueError on a wrong length."""
    if len(data) > 1:
        raise ValueError(f"{data.hex()} is no SYNC")
    return data[0] if data else None
