"""What an open restore blocks: kept apart, for commands that only need to know this."""

from __future__ import annotations

import json

from app.service.gate import Block
from app.store.restore_rows import RestoreRow


def block_of(row: RestoreRow) -> Block:
    """What an open restore blocks."""
    devices = json.loads(row.details)["devices"]
    return Block(row.id, row.station, frozenset((one["adapter"], one["node"]) for one in devices))
