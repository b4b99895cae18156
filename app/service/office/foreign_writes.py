"""Writes of other masters, seen on the wire: acknowledged SDO downloads that were not ours (CiA 301, 7.2.4).

The first write of an object is told at once. While it goes on being written, the later ones are folded into one event
a window, and the window doubles each time: a controller that writes cyclically fills no log.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Final

from app.model.address import Address
from app.model.values import show
from app.service.devices import Target, decode
from app.service.journal import Journal, Kind
from app.wire.frame import Direction
from app.wire.records import Outcome, Record, SdoAccess, SdoSeen

FIRST_WINDOW_NS: Final = 10_000_000_000
LONGEST_WINDOW_NS: Final = 600_000_000_000
NOBODY: Final = ""
"""The person of another master: nobody whom we know."""


@dataclass(frozen=True, slots=True)
class _Write:
    bus: str
    node: int
    address: Address
    was: str
    now: str
    data: bytes
    count: int


@dataclass(slots=True)
class _Fold:
    until_ns: int
    window_ns: int
    told: str
    last: _Write | None = None


class ForeignWrites:
    """``heard`` takes records on the receive thread, before the live state has them; ``tick`` tells the journal."""

    def __init__(self, targets: Iterable[Target], journal: Journal) -> None:
        self._targets: Mapping[tuple[str, int], Target] = {(one.device.bus, one.node): one for one in targets}
        self._journal = journal.by(NOBODY)
        self._folds: dict[tuple[str, int, Address], _Fold] = {}
        self._waiting: list[_Write] = []
        self._lock = Lock()

    def heard(self, records: Sequence[Record]) -> None:
        """Take the records of a batch of frames. Called for all traffic, so the usual case is left at once."""
        for record in records:
            if type(record) is SdoSeen and record.client is Direction.RX and record.access is SdoAccess.WRITE:
                self._take(record)

    def _take(self, seen: SdoSeen) -> None:
        if seen.outcome is not Outcome.DONE or seen.data is None:
            return
        key = seen.bus, seen.node, seen.address
        with self._lock:
            fold = self._folds.get(key)
            if fold is None:
                was, now = self._shown(seen, None), self._shown(seen, seen.data)
                self._folds[key] = _Fold(seen.t_ns + FIRST_WINDOW_NS, FIRST_WINDOW_NS, now)
                self._waiting.append(_Write(*key, was, now, seen.data, 1))
            else:
                count = 1 if fold.last is None else fold.last.count + 1
                fold.last = _Write(*key, fold.told, self._shown(seen, seen.data), seen.data, count)

    def _shown(self, seen: SdoSeen, data: bytes | None) -> str:
        """``data``, or where None what the live state knew before, as people read it."""
        target = self._targets.get((seen.bus, seen.node))
        entry = None if target is None else target.description.entries.get(seen.address)
        if target is None or entry is None:
            return "–" if data is None else data.hex(" ")
        raw = target.lookup(seen.address) if data is None else decode(entry, data)
        return "–" if raw is None else show(entry, raw, target.lookup)

    def tick(self, now_ns: int) -> None:
        """Tell what waits, and what was folded in windows that are over. Call it a few times a second."""
        self._tell(self._due(lambda fold: fold.until_ns <= now_ns, now_ns))

    def flush(self) -> None:
        """Tell everything: the connection ends."""
        self._tell(self._due(lambda _fold: True, 0))

    def _due(self, is_over: Callable[[_Fold], bool], now_ns: int) -> list[_Write]:
        with self._lock:
            due, self._waiting = self._waiting, []
            for key, fold in list(self._folds.items()):
                if not is_over(fold):
                    continue
                if fold.last is None:
                    del self._folds[key]  # it is written no more: the next write is news
                    continue
                due.append(fold.last)
                fold.told, fold.last = fold.last.now, None
                fold.window_ns = min(2 * fold.window_ns, LONGEST_WINDOW_NS)
                fold.until_ns = now_ns + fold.window_ns
        return due

    def _tell(self, writes: list[_Write]) -> None:
        for write in writes:
            target = self._targets.get((write.bus, write.node))
            entry = None if target is None else target.description.entries.get(write.address)
            self._journal.note(
                Kind.FOREIGN_WRITTEN,
                None if target is None else target.slug,
                bus=write.bus,
                node=write.node,
                address=write.address.short,
                name="" if entry is None else entry.title,
                was=write.was,
                now=write.now,
                data=write.data.hex(),
                count=write.count,
                times=f" (×{write.count})" if write.count > 1 else "",
            )
