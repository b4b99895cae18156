"""A data folder with recordings, store and desk, as a server or a command has them."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.model.incident import Draft, Incident, SignalRef, Span
from app.service.incidents.desk import IncidentDesk
from app.service.incidents.identity import fingerprint
from app.service.journal import Journal
from app.service.office.office import Office
from app.service.recording_list import Recordings, samples_folder
from app.service.replay.moments import Moments
from app.store import audit_rows
from app.store.audit_rows import Filter
from app.store.store import Store

TRIP = "3-following-error.mcap"
MINE = "trip.mcap"
PMC_2 = "wtg-07/blade-2/pmc"
S = 1_000_000_000
T0 = 1_772_442_000 * S
NOW = 1_780_000_000 * S


@dataclass
class Place:
    """One computer's data folder."""

    folder: Path
    office: Office
    desk: IncidentDesk
    recordings: Recordings

    async def kinds(self) -> list[str]:
        """What was audited, oldest first."""
        await self.office.audit.flush()
        rows = await self.office.store.run(lambda kept: audit_rows.latest(kept, Filter(), None, 100))
        return [row.kind for row in reversed(rows)]

    async def mark(self, **changes: Any) -> Incident:
        """An incident on our own recording."""
        return await self.office.incidents.add(draft(self.folder / "recordings" / MINE, **changes), "Anna")


def draft(recording: Path, **changes: Any) -> Draft:
    """Of the trip of the sample: 8611h comes about 26 s after its beginning."""
    usual: dict[str, Any] = {
        "recording": recording.name,
        "fingerprint": fingerprint(recording),
        "turbine": "wtg-07",
        "span": Span(T0 + 22 * S, T0 + 30 * S),
        "at_ns": T0 + 27 * S,
        "title": "Blade 2 trips",
        "notes": "Grease on the gear.\n<script>alert(1)</script>",
        "tags": ("8611h",),
        "plots": ((SignalRef.parse(f"{PMC_2}/6064"), SignalRef.parse(f"{PMC_2}/60F4")),),
        "camera": "blade-2",
        "loop": Span(T0 + 24 * S, T0 + 29 * S),
    }
    return Draft(**{**usual, **changes})


@asynccontextmanager
async def place(folder: Path, recording: bool = True) -> AsyncIterator[Place]:
    """Open one; ``recording``: the sample of a trip lies in it as its own."""
    recordings = folder / "recordings"
    recordings.mkdir(parents=True, exist_ok=True)
    if recording and not (recordings / MINE).exists():
        shutil.copy(samples_folder() / TRIP, recordings / MINE)
    ticks = iter(range(NOW, NOW + 10**15, 1000))
    journal = Journal(lambda: next(ticks), "tester")
    office = Office(Store.open(folder), journal, lambda: next(ticks), "tester")
    office.annotations.data = folder
    files = Recordings(recordings)
    moments = Moments(files, dict, folder / "indexes")
    desk = IncidentDesk(office.incidents, office.annotations, office.library, files, moments, recordings)
    try:
        yield Place(folder, office, desk, files)
    finally:
        await office.close()
