"""Rows of restores: what was ordered, the values before and wanted, and every step as an intent with its outcome.

An intent is committed before its step is carried out, so that whoever reads these rows after a crash knows what may
have reached a device. Raw values, details and outcomes are JSON that the service writes and reads.
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any, Final

from sqlalchemy import Connection, insert, select, update

from app.errors import StoreError
from app.store.schema import restore_records, restore_steps, restore_values, restores


class RestoreState(Enum):
    """How a restore stands; the value is the end of its text key ``restore.state.…``.

    ``INCOMPLETE``: nobody works on it, and the station may hold old and new values: resume, or roll back.
    ``GIVEN_UP``: neither was possible, and an expert answers for what stands in the station.
    """

    WRITING = "writing"
    AWAITING_CONFIRMATION = "awaiting-confirmation"
    SAVING = "saving"
    RESTARTING = "restarting"
    PROVING = "proving"
    DONE = "done"
    ROLLING_BACK = "rolling-back"
    ROLLED_BACK = "rolled-back"
    INCOMPLETE = "incomplete"
    GIVEN_UP = "given-up"

    @property
    def ended(self) -> bool:
        """True where the station holds the new values or the old ones, or it was given up: nothing is blocked."""
        return self in (RestoreState.DONE, RestoreState.ROLLED_BACK, RestoreState.GIVEN_UP)

    @property
    def text_key(self) -> str:
        """Key of its word."""
        return f"restore.state.{self.value}"


class Direction(Enum):
    """What a step was done for: the new values, the new values after an interruption, or the old ones."""

    FORWARD = "forward"
    RESUME = "resume"
    BACK = "back"


class StepState(Enum):
    """``INTENDED``: it may have been carried out. ``UNKNOWN``: it was sent, and nobody knows what became of it."""

    INTENDED = "intended"
    DONE = "done"
    FAILED = "failed"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class RestoreRow:
    """One restore. ``details`` (what was ordered) and ``outcome`` (how it stands, and why) are JSON."""

    id: str
    turbine: str
    station: str
    state: RestoreState
    person: str
    reason: str
    work_order: str
    started_ns: int
    details: str
    ended_ns: int | None = None
    outcome: str = "{}"


@dataclass(frozen=True, slots=True)
class ValueRow:
    """One object that a restore answers for, in the order of its plan. ``before`` and ``wanted`` are JSON."""

    n: int
    device: str
    address: str
    before: str
    wanted: str


@dataclass(frozen=True, slots=True)
class StepRow:
    """One step in the order in which it was begun. ``raw`` is JSON, None where it is no write."""

    n: int
    direction: Direction
    kind: str
    device: str
    address: str | None
    raw: str | None
    begun_ns: int
    state: StepState = StepState.INTENDED
    ended_ns: int | None = None
    details: str = "{}"


def add_restore(connection: Connection, row: RestoreRow, values: Iterable[ValueRow]) -> None:
    """A new restore with all values, in one transaction: before anything is written."""
    connection.execute(insert(restores), _plain(row))
    rows = [{"restore_id": row.id, **_plain(value)} for value in values]
    if rows:
        connection.execute(insert(restore_values), rows)


def put_state(
    connection: Connection, restore_id: str, state: RestoreState, outcome: str, ended_ns: int | None = None
) -> None:
    """How a restore stands from now on."""
    values = {"state": state.value, "outcome": outcome, "ended_ns": ended_ns}
    connection.execute(update(restores).where(restores.c.id == restore_id).values(values))


def advance(connection: Connection, restore_id: str, ended: StepRow | None, begun: StepRow | None) -> None:
    """Keep the outcome of the last step and the intent of the next one, in one transaction."""
    if ended is not None:
        key = restore_steps.c.restore_id == restore_id, restore_steps.c.n == ended.n
        connection.execute(update(restore_steps).where(*key).values(_plain(ended)))
    if begun is not None:
        connection.execute(insert(restore_steps), {"restore_id": restore_id, **_plain(begun)})


def get_restore(connection: Connection, restore_id: str) -> RestoreRow | None:
    """One restore."""
    found = connection.execute(select(restores).where(restores.c.id == restore_id)).first()
    return None if found is None else _restore(found._mapping)


def list_restores(connection: Connection, turbine: str | None = None, limit: int = 100) -> list[RestoreRow]:
    """The latest restores, newest first; of one turbine where named."""
    query = select(restores).order_by(restores.c.started_ns.desc(), restores.c.id.desc()).limit(limit)
    if turbine is not None:
        query = query.where(restores.c.turbine == turbine)
    return [_restore(row._mapping) for row in connection.execute(query)]


def open_restores(connection: Connection) -> list[RestoreRow]:
    """Restores whose station holds neither the new values nor the old ones for sure, oldest first."""
    query = select(restores).where(restores.c.state.not_in(_ENDED)).order_by(restores.c.started_ns)
    return [_restore(row._mapping) for row in connection.execute(query)]


def values_of(connection: Connection, restore_id: str) -> list[ValueRow]:
    """The values of a restore, in the order of its plan."""
    table = restore_values
    query = select(table).where(table.c.restore_id == restore_id).order_by(table.c.n)
    return [ValueRow(row.n, row.device, row.address, row.before, row.wanted) for row in connection.execute(query)]


def steps_of(connection: Connection, restore_id: str) -> list[StepRow]:
    """The steps of a restore, in the order in which they were begun."""
    table = restore_steps
    query = select(table).where(table.c.restore_id == restore_id).order_by(table.c.n)
    return [_step(dict(row._mapping)) for row in connection.execute(query)]


def add_record(connection: Connection, restore_id: str, t_ns: int, text: str, seal: str) -> None:
    """The sealed record of a restore at its end."""
    connection.execute(insert(restore_records), {"restore_id": restore_id, "t_ns": t_ns, "text": text, "seal": seal})


def get_record(connection: Connection, restore_id: str) -> tuple[str, str] | None:
    """Text and seal of the latest record of a restore."""
    table = restore_records
    query = select(table).where(table.c.restore_id == restore_id).order_by(table.c.seq.desc()).limit(1)
    found = connection.execute(query).first()
    return None if found is None else (found.text, found.seal)


def peek_open(path: Path) -> list[RestoreRow]:
    """As ``open_restores``, of a store that another process has: it is read and nothing else.

    Raises StoreError. A store of an earlier version knows no restores.
    """
    if not path.is_file():
        return []
    columns = ", ".join(column.name for column in restores.columns)
    marks = ", ".join("?" * len(_ENDED))
    query = f"SELECT {columns} FROM restores WHERE state NOT IN ({marks}) ORDER BY started_ns"
    try:
        with contextlib.closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as file:
            file.row_factory = sqlite3.Row
            if not file.execute("SELECT 1 FROM sqlite_schema WHERE name = 'restores'").fetchone():
                return []
            return [_restore(dict(row)) for row in file.execute(query, _ENDED)]
    except sqlite3.Error as error:
        raise StoreError(file=str(path), reason=str(error)) from error


_ENDED: Final = tuple(state.value for state in RestoreState if state.ended)


def _plain(row: RestoreRow | ValueRow | StepRow) -> dict[str, Any]:
    found = {name: getattr(row, name) for name in row.__slots__}
    return {name: value.value if isinstance(value, Enum) else value for name, value in found.items()}


def _restore(row: Any) -> RestoreRow:
    values = dict(row)
    return RestoreRow(**{**values, "state": RestoreState(values["state"])})


def _step(row: dict[str, Any]) -> StepRow:
    del row["restore_id"]
    return StepRow(**{**row, "direction": Direction(row["direction"]), "state": StepState(row["state"])})


def ended_as(step: StepRow, state: StepState, ended_ns: int, details: str = "{}") -> StepRow:
    """The step with its outcome."""
    return replace(step, state=state, ended_ns=ended_ns, details=details)
