"""Runs of test signals: each is kept with its settings, what was in force, its courses and what came of it.

A run is kept whatever ended it, from the first target that was sent on.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

from app.errors import SignalUnknownError
from app.model.address import Address
from app.model.checks import limits_of as entry_limits
from app.model.values import quantity_of, show
from app.service.devices import Target
from app.service.journal import Journal
from app.service.motion.cyclic import INTERPOLATION_MS, SEND_S, Played, play
from app.service.motion.desk import MotionDesk
from app.service.motion.evaluation import evaluate, results_document
from app.service.motion.proposal import MOST_GAIN, Proposal
from app.service.motion.signals import Signal
from app.store.signal_rows import SignalRow, get_run, put_run, runs_of
from app.store.store import Store
from app.store.uuid7 import Uuid7

LISTED: Final = 50
"""So many of a device are listed, the newest."""
GAIN: Final = Address(0x60FB, 1)


@dataclass(frozen=True, slots=True)
class SignalRun:
    """A run that is kept; ``content`` as ``_content`` makes it."""

    id: str
    device: str
    t_ns: int
    person: str
    shape: str
    why: str
    content: dict[str, Any]


class SignalRuns:
    """The runs of one store. ``stamp`` gives t_ns. Belongs to the event loop."""

    def __init__(self, store: Store, stamp: Callable[[], int]) -> None:
        self._store = store
        self._new_id = Uuid7(stamp)

    async def run(
        self, desk: MotionDesk, slug: str, fence: int, signal: Signal, person: str, journal: Journal
    ) -> SignalRun:
        """Run a signal while it is held, and keep it. Raises what ``play`` raises, StoreError."""
        played = await play(desk, slug, fence, signal, journal)
        target = desk.connection.target(slug)
        content = await asyncio.to_thread(_content, target, played)
        t_ns = desk.now_ns() if played.begun_ns is None else played.begun_ns
        run = SignalRun(self._new_id(), slug, t_ns, person, signal.shape.value, played.why.value, content)
        await self._store.run(lambda connection: put_run(connection, _row(run)))
        return run

    async def of(self, device: str) -> Sequence[SignalRun]:
        """The latest runs of a device, newest first. Raises StoreError."""
        rows = await self._store.run(lambda connection: runs_of(connection, device, LISTED))
        return [_run(row) for row in rows]

    async def get(self, run_id: str) -> SignalRun:
        """One run. Raises SignalUnknownError, StoreError."""
        row = await self._store.run(lambda connection: get_run(connection, run_id))
        if row is None:
            raise SignalUnknownError(run=run_id)
        return _run(row)


def _content(target: Target, played: Played) -> dict[str, Any]:
    evaluation = evaluate(played, gain_limits(target))
    return {
        "signal": {**asdict(played.signal), "shape": played.signal.shape.value},
        "transport": played.transport.value,
        "period_ms": round(1000 * SEND_S),
        "interpolation_ms": INTERPOLATION_MS,
        "sent": played.sent,
        "late": played.late,
        "error": played.error,
        "start_deg": round(played.start_deg, 3),
        "in_force": [_in_force(target, address, raw) for address, raw in played.raws.items()],
        "results": results_document(evaluation.results),
        "proposal": None if evaluation.proposal is None else _proposal(evaluation.proposal),
        "courses": evaluation.courses,
    }


def _in_force(target: Target, address: Address, raw: int) -> dict[str, Any]:
    entry = target.entry(address)
    return {
        "address": address.short,
        "name": entry.title,
        "raw": raw,
        "shown": show(entry, raw, target.lookup),
        "unit": quantity_of(entry, target.lookup).unit,
    }


def _proposal(proposal: Proposal) -> dict[str, Any]:
    return {
        "values": [asdict(value) for value in proposal.values],
        "reasons": [{"key": reason.key, "details": dict(reason.details)} for reason in proposal.reasons],
    }


def gain_limits(target: Target) -> tuple[int, int]:
    """Raw limits of 60FBh/1 by the description."""
    low, high = entry_limits(target.entry(GAIN), target.lookup)
    return int(low or 0), MOST_GAIN if high is None else int(high)


def _row(run: SignalRun) -> SignalRow:
    return SignalRow(
        run.id, run.device, run.t_ns, run.person, run.shape, run.why, json.dumps(run.content, ensure_ascii=False)
    )


def _run(row: SignalRow) -> SignalRun:
    return SignalRun(row.id, row.device, row.t_ns, row.person, row.shape, row.why, json.loads(row.content))
