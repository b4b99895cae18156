"""What the data folder keeps of restores, without a turbine: list them, or close one whose device is gone."""

from __future__ import annotations

import argparse
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any, Final

from app.cli.output import Output
from app.service.journal import Journal
from app.service.office.office import Office
from app.service.restore.desk import Desk
from app.settings import Settings
from app.store import restore_rows
from app.store.restore_rows import RestoreRow, RestoreState
from app.store.store import Store
from app.wire.frame import Stamper

MOST: Final = 100_000
"""Restores that are listed: all."""


@asynccontextmanager
async def desk_alone(settings: Settings) -> AsyncIterator[Desk]:
    """The desk of the data folder, with no bus. Raises StoreError, also where another process has the store."""
    stamp = Stamper(time.time_ns(), time.monotonic_ns)
    journal = Journal(stamp, settings.person)
    office = Office(Store.open(settings.data), journal, stamp, settings.person)
    desk = Desk(office, journal, stamp, data=settings.data)
    try:
        yield desk
    finally:
        await desk.close()
        await office.close()


async def list_restores(arguments: argparse.Namespace, output: Output) -> int:
    """All of them, newest first."""
    store = Store.open(arguments.settings.data)
    try:
        rows = await store.run(lambda kept: restore_rows.list_restores(kept, None, MOST))
    finally:
        store.close()
    if output.as_json:
        output.result([_row_dict(row) for row in rows], "")
        return 0
    head = ("ID", "STATION", "STATE", "PERSON", "WORK ORDER")
    output.table(
        head,
        [(row.id, row.station, output.texts(_shown_state(row)), row.person, row.work_order or "–") for row in rows],
    )
    return 0


async def give_up(arguments: argparse.Namespace, output: Output) -> int:
    """``--give-up ID``: its station takes writes again, as it is."""
    async with desk_alone(arguments.settings) as desk:
        await desk.give_up(arguments.give_up, arguments.settings.person, arguments.reason)
        row = (await desk.get(arguments.give_up)).row
    output.result(_row_dict(row), output.texts("cli.restore_given_up", station=row.station, restore=row.id))
    return 0


def _shown_state(row: RestoreRow) -> str:
    """Nobody works on any of them: the store is ours."""
    return (row.state if row.state.ended else RestoreState.INCOMPLETE).text_key


def _row_dict(row: RestoreRow) -> dict[str, Any]:
    state = row.state if row.state.ended else RestoreState.INCOMPLETE
    return {"id": row.id, "station": row.station, "state": state.value, "person": row.person, "reason": row.reason}
