"""What a command does on a bus goes to the audit log of the data folder too."""

from __future__ import annotations

import argparse
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

from app.cli.output import Output
from app.errors import StoreInUseError
from app.service.connection import Connection

if TYPE_CHECKING:
    from app.store.store import Store


@asynccontextmanager
async def audited(arguments: argparse.Namespace, output: Output, connection: Connection) -> AsyncIterator[None]:
    """Have what the connection's journal is told audited, and its gate shut by restores that are not finished.

    While a server has the store it is only looked into, and this is said: the server sees writes on the bus, and audits
    them as those of another master. Raises StoreError, before anything is done.
    """
    # Late: most commands on a bus change nothing, and need not wait for the store's libraries.
    from app.service.restore.blocking import block_of
    from app.store.database import FILE
    from app.store.restore_rows import peek_open
    from app.store.store import Store

    try:
        store = Store.open(arguments.settings.data)
    except StoreInUseError:
        connection.gate.blocks.put(block_of(row) for row in peek_open(arguments.settings.data / FILE))
        output.say("cli.no_audit")
        yield
        return
    try:
        async with audited_in(store, connection):
            yield
    finally:
        store.close()


@asynccontextmanager
async def audited_in(store: Store, connection: Connection) -> AsyncIterator[None]:
    """As ``audited``, for a command that has the store already."""
    from app.service.office.audit import AuditLog
    from app.service.restore.blocking import block_of
    from app.store.restore_rows import open_restores

    journal = connection.journal
    connection.gate.blocks.put(block_of(row) for row in store.call(open_restores))
    audit = AuditLog(store)
    for entry in journal.latest():
        audit.take(entry)
    end = journal.listen(audit.take)
    try:
        yield
    finally:
        end()
        await audit.close()
