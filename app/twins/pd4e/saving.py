"""Saving by categories: 1010h, 1011h (manual, 7.3.8 and 7.3.9).

A save is acknowledged at once and takes its time; meanwhile the entry reads as it was written, and 1 when it is done.
While the motor moves it is refused: the manual forbids it, for the control suffers, and a twin that let it pass would
teach the wrong thing. OPEN what a drive answers; here "not in this state of the device".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from app.model.datatypes import Raw
from app.model.description import LOAD_SIGNATURE, SAVE_SIGNATURE, Entry, SaveCommand
from app.twins.nonvolatile import NonVolatile
from app.twins.object_store import Cell, Guard, ObjectStore, RefusedAccessError
from app.wire.sdo import Abort

READY: Final = 1
VERIFY_CONFIGURATION: Final = 0x1020


class _Pending(NamedTuple):
    due_ns: int
    cell: Cell
    finish: Callable[[], None]


class Saving:
    """The commands of one device. ``moving`` says whether the motor turns, ``now_ns`` is the device's time."""

    def __init__(
        self,
        store: ObjectStore,
        memory: NonVolatile,
        *,
        duration_ns: int,
        moving: Callable[[], bool],
        now_ns: Callable[[], int],
    ) -> None:
        self._memory = memory
        self._duration_ns = duration_ns
        self._moving = moving
        self._now_ns = now_ns
        self._pending: _Pending | None = None
        for command in store.description.save:
            self._install(store, command, SAVE_SIGNATURE, memory.save)
        for command in store.description.load:
            self._install(store, command, LOAD_SIGNATURE, memory.discard)
        known = {command.address for command in (*store.description.save, *store.description.load)}
        for cell in store:
            if cell.entry.address.major in (0x1010, 0x1011) and cell.entry.address not in known:
                cell.guard = _refuse

    @property
    def busy(self) -> bool:
        """A save or its contrary runs."""
        return self._pending is not None

    def restart(self) -> None:
        """Power was gone: what had not ended has not happened."""
        self._pending = None

    def step(self) -> None:
        """End what is due. A memory that takes nothing is reported by the device; the entry is free again."""
        pending = self._pending
        if pending is None or self._now_ns() < pending.due_ns:
            return
        self._pending = None
        pending.cell.raw = READY
        try:
            pending.finish()
        except RefusedAccessError:
            return  # the memory has told the device; the command was acknowledged long ago

    def _install(
        self,
        store: ObjectStore,
        command: SaveCommand,
        signature: int,
        act: Callable[[Callable[[Entry], bool]], None],
    ) -> None:
        cell = store.find(command.address.major, command.address.minor)
        if cell is None:
            return
        cell.guard = self._guard(cell, signature)
        covered = _covered(command.category)

        def start(_raw: Raw) -> None:
            due_ns = self._now_ns() + (self._memory.slow_ns or self._duration_ns)
            self._pending = _Pending(due_ns, cell, lambda: act(covered))

        cell.effect = start

    def _guard(self, cell: Cell, signature: int) -> Guard:
        def check(raw: Raw) -> None:
            if raw != signature or cell.raw != READY:
                raise RefusedAccessError(Abort.DEVICE_STATE if self.busy else Abort.NOT_STORED)
            if self.busy or self._moving():
                raise RefusedAccessError(Abort.DEVICE_STATE)

        return check


def _refuse(_raw: Raw) -> None:
    """An entry without a category that is known: it saves nothing."""
    raise RefusedAccessError(Abort.NOT_STORED)


def _covered(category: str | None) -> Callable[[Entry], bool]:
    """Entries of a category; date and time of the configuration (1020h) go with every save (manual, 1020h)."""

    def covers(entry: Entry) -> bool:
        return category is None or entry.save_category == category or entry.address.major == VERIFY_CONFIGURATION

    return covers
