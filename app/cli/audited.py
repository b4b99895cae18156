"""What a command does on a bus goes to the audit log of the data folder too."""

from __future__ import annotations

import argparse
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from app.cli.output import Output
from app.errors import StoreInUseError
from app.service.journal import Journal


@asynccontextmanager
async def audited(arguments: argparse.Namespace, output: Output, journal: Journal) -> AsyncIterator[None]:
    """Have what ``journal`` is told audited. Raises StoreError, before anything is done.

    While a server has the store this is said instead: the server sees writes on the bus, and audits them as those of
    another master.
    """
    # Late: most commands on a bus change nothing, and need not wait for the store's libraries.
    from app.service.office.audit import AuditLog
    from app.store.store import Store

    try:
        store = Store.open(arguments.settings.data)
    except StoreInUseError:
        output.say("cli.no_audit")
        yield
        return
    try:
        audit = AuditLog(store)
        for entry in journal.latest():
            audit.take(entry)
        end = journal.listen(audit.take)
        try:
            yield
        finally:
            end()
            await audit.close()
    finally:
        store.close()
