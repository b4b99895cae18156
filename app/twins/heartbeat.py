"""Heartbeat producer and consumer of a twin (CiA 301, 7.2.8.2.2; objects 1017h and 1016h)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from app.model.datatypes import Raw
from app.twins.object_store import Cell, ObjectStore, RefusedAccessError
from app.twins.ports import Alarm, Line
from app.wire.sdo import Abort

_MS: Final = 1_000_000


class HeartbeatProducer:
    """Calls ``beat`` every 1017h milliseconds while running."""

    def __init__(self, store: ObjectStore, line: Line, beat: Callable[[], None]) -> None:
        self._cell = store.find(0x1017)
        self._line = line
        self._beat = beat
        self._alarm = Alarm(line)
        self._running = False
        if self._cell is not None:
            self._cell.effect = lambda _raw: self._again(self._line.now_ns)

    def start(self) -> None:
        """Begin after a boot-up message."""
        self._running = True
        self._again(self._line.now_ns)

    def stop(self) -> None:
        """End, for a restart."""
        self._running = False
        self._alarm.clear()

    def _again(self, from_ns: int) -> None:
        period_ms = 0 if self._cell is None else self._cell.number
        if self._running and period_ms:
            self._alarm.set(from_ns + period_ms * _MS, self._ring)
        else:
            self._alarm.clear()

    def _ring(self, t_ns: int) -> None:
        self._beat()
        self._again(t_ns)


class HeartbeatConsumer:
    """Watches the nodes of 1016h, each from its first heartbeat on. ``lost`` gets the node that fell silent."""

    def __init__(
        self, store: ObjectStore, line: Line, lost: Callable[[int], None], changed: Callable[[], None]
    ) -> None:
        self._line = line
        self._lost = lost
        self._changed = changed
        self._cells = [cell for cell in store if cell.entry.address.major == 0x1016 and cell.entry.address.minor > 0]
        self._alarms: dict[int, Alarm] = {}
        for cell in self._cells:
            cell.guard = self._guard(cell)
            cell.effect = lambda _raw: self._reconfigured()

    @property
    def nodes(self) -> dict[int, int]:
        """Watched nodes with their times in ms."""
        pairs = (_split(cell.number) for cell in self._cells)
        return {node: time_ms for node, time_ms in pairs if 1 <= node <= 127 and time_ms}

    def heard(self, node: int, t_ns: int) -> None:
        """A heartbeat of ``node`` came."""
        time_ms = self.nodes.get(node)
        if time_ms is not None:
            self._alarms.setdefault(node, Alarm(self._line)).set(t_ns + time_ms * _MS, lambda _t: self._lost(node))

    def reset(self) -> None:
        """Watch nobody until the next heartbeat."""
        for alarm in self._alarms.values():
            alarm.clear()
        self._alarms.clear()

    def _reconfigured(self) -> None:
        self.reset()
        self._changed()

    def _guard(self, cell: Cell) -> Callable[[Raw], None]:
        def check(raw: Raw) -> None:
            node, time_ms = _split(int(raw)) if isinstance(raw, int) else (0, 0)
            others = (_split(other.number)[0] for other in self._cells if other is not cell)
            if time_ms and node and node in others:
                raise RefusedAccessError(Abort.PARAMETER_INCOMPATIBLE)  # a node can be watched once (7.5.2.19)

        return check


def _split(raw: int) -> tuple[int, int]:
    """Node and time in ms of an entry of 1016h."""
    return raw >> 16 & 0xFF, raw & 0xFFFF
