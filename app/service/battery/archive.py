"""What is kept of batteries in the store: tests, changes, and the old battery that was noted before a change."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Final

from app.service.battery.records import ChangeRecord, Noted, TestRecord, dump, load_change, load_noted, load_test
from app.store import battery_rows
from app.store.battery_rows import BatteryRow, RowKind
from app.store.small_rows import get_setting, put_setting
from app.store.store import Store
from app.store.uuid7 import Uuid7

MOST: Final = 20
"""So many tests and changes of a device are shown, the newest."""
_NOTED: Final = "battery.noted"


class Archive:
    """Tests and changes of one store. Raises StoreError. ``stamp`` gives t_ns."""

    def __init__(self, store: Store, stamp: Callable[[], int]) -> None:
        self._store = store
        self.new_id = Uuid7(stamp)

    async def keep(self, record: TestRecord | ChangeRecord) -> None:
        """Keep a record; it never changes again."""
        kind = RowKind.TEST if isinstance(record, TestRecord) else RowKind.CHANGE
        row = BatteryRow(record.id, record.device, kind, record.t_ns, record.person, dump(record))
        await self._store.run(lambda kept: battery_rows.add(kept, row))

    async def tests(self, device: str) -> list[TestRecord]:
        """The latest tests of a device, newest first."""
        found = await self._store.run(lambda kept: battery_rows.latest(kept, device, RowKind.TEST, MOST))
        return [load_test(one) for one in found]

    async def changes(self, device: str) -> list[ChangeRecord]:
        """The latest changes of its battery, newest first."""
        found = await self._store.run(lambda kept: battery_rows.latest(kept, device, RowKind.CHANGE, MOST))
        return [load_change(one) for one in found]

    async def noted(self, device: str) -> Noted | None:
        """The old battery, where its change has begun."""
        found = await self._store.run(lambda kept: get_setting(kept, f"{_NOTED}.{device}"))
        return None if found is None else load_noted(found)

    async def note(self, noted: Noted) -> None:
        """Keep what the old battery was."""
        document = json.loads(dump(noted))
        await self._store.run(lambda kept: put_setting(kept, f"{_NOTED}.{noted.device}", document))

    async def forget(self, device: str) -> None:
        """The change is done, or given up."""
        await self._store.run(lambda kept: put_setting(kept, f"{_NOTED}.{device}", None))
