"""Restores that were left: by a tool that ended, or given up by an expert."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from app.errors import UsageError
from app.service.connection import Connection
from app.service.devices import Target
from app.service.gate import BARE_TURBINE, Place, adapter_of, place_of
from app.service.journal import Kind
from app.service.restore.log import Kept, RestoreLog, event
from app.service.restore.order import Broken, Cause
from app.store import restore_rows as rows
from app.store.restore_rows import RestoreRow, RestoreState
from app.store.store import Store


async def give_up(store: Store, kept: Kept, stamp: Callable[[], int], person: str, reason: str) -> None:
    """Close it for good, with who answers for that. Raises UsageError without a reason, StoreError."""
    why = reason.strip()
    if not why:
        raise UsageError(reason="a restore is given up for a reason: say which")
    log = RestoreLog(store, kept, stamp)
    log.tell(f"journal.{Kind.RESTORE_GIVEN_UP.value}", person, station=kept.row.station, reason=why)
    try:
        await log.enter(RestoreState.GIVEN_UP, given_up_by=person, given_up_reason=why)
    except Broken as broken:
        raise broken.as_error(kept.row.station) from broken


def require_same_places(connection: Connection, kept: Kept, targets: Iterable[Target]) -> None:
    """On a bus without names a device is known by its place. Raises UsageError where this is another one."""
    if connection.turbine.slug != BARE_TURBINE:
        return
    buses = {bus.name: bus.connection for bus in connection.turbine.buses}
    places = {one["slug"]: Place(adapter_of(one["adapter"]), one["node"]) for one in kept.details["devices"]}
    for target in targets:
        then = places[target.slug]
        if then != place_of(target.device, buses[target.device.bus]):
            raise UsageError(reason=f"the restore is of node {then.node} at {then.adapter}: connect to that one")


def take_up(connection: Any, now_ns: int) -> list[RestoreRow]:
    """What an earlier run left open is incomplete from now on: its tool ended, and its deadline with it."""
    found = []
    for row in rows.open_restores(connection):
        if row.state is not RestoreState.INCOMPLETE:
            row = replace(row, state=RestoreState.INCOMPLETE, outcome=_ended_with_its_tool(row, now_ns))
            rows.put_state(connection, row.id, row.state, row.outcome)
        found.append(row)
    return found


def _ended_with_its_tool(row: RestoreRow, now_ns: int) -> str:
    outcome = json.loads(row.outcome)
    cause = Cause.TOOL_ENDED
    told = event(now_ns, f"journal.{Kind.RESTORE_INCOMPLETE.value}", station=row.station, cause_key=cause.text_key)
    outcome |= {"cause": cause.value, "in_state": row.state.value, "events": [*outcome.get("events", ()), told]}
    return json.dumps(outcome, ensure_ascii=False)
