"""What an open restore blocks: kept apart, for commands that only need to know this."""

from __future__ import annotations

import json

from app.model.sets import Identity
from app.service.gate import Block, Place, adapter_of
from app.store.restore_rows import RestoreRow


def block_of(row: RestoreRow) -> Block:
    """What an open restore blocks."""
    devices = json.loads(row.details)["devices"]
    found = ((Place(adapter_of(one["adapter"]), one["node"]), Identity(**one["identity"])) for one in devices)
    return Block(row.id, row.station, tuple(found))
