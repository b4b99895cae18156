"""A process that appends to the audit log as fast as it can, and prints what is on the disk, until it is killed."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from app.service.office.audit import Action, AuditLog
from app.store.store import Store


async def main(folder: Path) -> None:
    audit = AuditLog(Store.open(folder))
    number = 0
    while True:
        for _ in range(20):
            number += 1
            audit.note(Action.LOGIN, "anna", None, number=number)
        await audit.flush()
        print(number, flush=True)


if __name__ == "__main__":
    asyncio.run(main(Path(sys.argv[1])))
