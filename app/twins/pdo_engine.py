"""PDOs of a twin: sent and taken by their parameters in force (CiA 301, 7.2.2).

TPDOs: at every n-th SYNC (types 1..240), at a SYNC after a change (0), on a remote frame (252, 253, and all that allow
it), on a change and by the event timer, held back by the inhibit time (254, 255). RPDOs: at once, or at the next SYNC.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from app.model.datatypes import decode_raw
from app.twins.object_store import Cell, ObjectStore, RefusedAccessError
from app.twins.pdo_parameters import PdoObjects, guard_parameters, mapping_of, pdo_objects
from app.twins.ports import Alarm, Line
from app.wire import pdo
from app.wire.frame import Can

_MS: Final = 1_000_000
_INHIBIT_UNIT_NS: Final = 100_000
_MAX_SYNC_TYPE: Final = 240
_EVENT_TYPES: Final = (254, 255)
_NEVER_NS: Final = -(1 << 62)

Send = Callable[[Can], None]
OnRemote = Callable[[Can, int], None]


class _Tpdo:
    """One transmit PDO while the node is operational."""

    def __init__(self, store: ObjectStore, objects: PdoObjects, line: Line, send: Send) -> None:
        self._store = store
        self.objects = objects
        self._line = line
        self._send = send
        self._inhibited = Alarm(line)
        self._event = Alarm(line)
        self.parameters = objects.parameters
        self._cells: tuple[Cell, ...] = ()
        self._mapping = pdo.Mapping(())
        self._last: bytes | None = None
        self._last_ns = _NEVER_NS
        self._syncs = 0
        self._waits = False

    @property
    def on_event(self) -> bool:
        """Sent on a change."""
        return self.parameters.transmission_type in _EVENT_TYPES

    def start(self, t_ns: int) -> None:
        """Take the parameters in force; an event-driven PDO shows its values once."""
        self.stop()
        self.parameters = self.objects.parameters
        self._mapping = pdo.Mapping(mapping_of(self.objects))
        self._cells = tuple(self._store.at(address) for address, _bits in self._mapping.entries)
        self._last, self._last_ns, self._syncs = None, _NEVER_NS, 0
        if self.on_event:
            self.poll(t_ns)

    def stop(self) -> None:
        """No longer send."""
        self._inhibited.clear()
        self._event.clear()
        self._waits = False

    def poll(self, t_ns: int) -> None:
        """Send where a mapped value changed."""
        if not self._waits and self._cells and self._data() != self._last:
            self._trigger(t_ns)

    def synchronise(self) -> None:
        """A SYNC came."""
        kind = self.parameters.transmission_type
        if kind == 0:
            if self._data() != self._last:
                self.transmit()
        elif kind <= _MAX_SYNC_TYPE:
            self._syncs += 1
            if self._syncs >= kind:
                self._syncs = 0
                self.transmit()

    def transmit(self) -> None:
        """Send now."""
        if not self._cells:
            return
        now_ns = self._line.now_ns
        data = self._data()
        self._last, self._last_ns = data, now_ns
        self._send(Can(self.parameters.can_id, data))
        if self.on_event and self.parameters.event_ms:
            self._event.set(now_ns + self.parameters.event_ms * _MS, self._trigger)

    def _trigger(self, t_ns: int) -> None:
        ready_ns = self._last_ns + self.parameters.inhibit_100us * _INHIBIT_UNIT_NS
        if t_ns >= ready_ns:
            self.transmit()
        else:
            self._waits = True
            self._inhibited.set(ready_ns, self._released)

    def _released(self, _t_ns: int) -> None:
        self._waits = False
        self.transmit()

    def _data(self) -> bytes:
        if self._mapping.slots is not None:
            return b"".join([cell.to_bytes() for cell in self._cells])
        return pdo.pack(self._mapping, {cell.entry.address: cell.to_bytes() for cell in self._cells})


class _Rpdo:
    """One receive PDO while the node is operational."""

    def __init__(self, store: ObjectStore, objects: PdoObjects) -> None:
        self._store = store
        self.objects = objects
        self.parameters = objects.parameters
        self._mapping = pdo.Mapping(())
        self._latched: bytes | None = None

    def start(self) -> None:
        """Take the parameters in force."""
        self.parameters = self.objects.parameters
        self._mapping = pdo.Mapping(mapping_of(self.objects))
        self._latched = None

    def take(self, data: bytes) -> bool:
        """Data came; used at once (True) or kept for the next SYNC. A frame that is too short is not used (7.2.2.5.2).

        CiA 301 has emergency 8210h for that; neither unit's list of errors does (3.2.1.2, table 6), so none is sent.
        """
        if not self._mapping.entries or len(data) < self._mapping.size:
            return False
        if self.parameters.transmission_type <= _MAX_SYNC_TYPE:
            self._latched = data
            return False
        self._use(data)
        return True

    def synchronise(self) -> bool:
        """A SYNC came; True where something was kept for it."""
        data, self._latched = self._latched, None
        if data is not None:
            self._use(data)
        return data is not None

    def _use(self, data: bytes) -> None:
        for address, value in pdo.unpack(self._mapping, data):
            cell = self._store.at(address)
            try:
                self._store.assign(cell, decode_raw(cell.entry.type, value))
            except RefusedAccessError:
                continue  # a PDO has no answer: what the object refuses is left out, the rest is used


class PdoEngine:
    """All PDOs of one device. ``routes_changed`` runs when other identifiers are to be received."""

    def __init__(self, store: ObjectStore, line: Line, send: Send, routes_changed: Callable[[], None]) -> None:
        self._line = line
        self._routes_changed = routes_changed
        self._active = False
        self._tpdos: list[_Tpdo] = []
        self._rpdos: list[_Rpdo] = []
        self._running: tuple[_Tpdo, ...] = ()
        self._polled: tuple[_Tpdo, ...] = ()
        self._listening: tuple[_Rpdo, ...] = ()
        for objects in pdo_objects(store):
            guard_parameters(store, objects, self._reconfigured)
            if objects.transmit:
                self._tpdos.append(_Tpdo(store, objects, line, send))
            else:
                self._rpdos.append(_Rpdo(store, objects))

    def start(self) -> None:
        """The node became operational."""
        self._active = True
        self._reconfigured()

    def stop(self) -> None:
        """The node is operational no more."""
        self._active = False
        self._reconfigured()

    def poll(self, t_ns: int) -> None:
        """Look for changed values of event-driven TPDOs."""
        for tpdo in self._polled:
            tpdo.poll(t_ns)

    def synchronise(self, t_ns: int) -> None:
        """A SYNC came: what was received is used, then what is due is sent."""
        used = [rpdo.synchronise() for rpdo in self._listening]
        for tpdo in self._running:
            tpdo.synchronise()
        if any(used):
            self.poll(t_ns)

    def identifiers(self) -> dict[int, OnRemote]:
        """Identifiers to be received, with what takes them."""
        routes: dict[int, OnRemote] = {}
        for rpdo in self._listening:
            routes[rpdo.parameters.can_id] = self._received
        for tpdo in self._running:
            if tpdo.parameters.rtr_allowed:
                routes[tpdo.parameters.can_id] = self._asked
        return routes

    def _received(self, can: Can, t_ns: int) -> None:
        if can.remote:
            return
        used = [rpdo.take(can.data) for rpdo in self._listening if rpdo.parameters.can_id == can.can_id]
        if any(used):
            self.poll(t_ns)

    def _asked(self, can: Can, _t_ns: int) -> None:
        if can.remote:
            for tpdo in self._running:
                if tpdo.parameters.can_id == can.can_id and tpdo.parameters.rtr_allowed:
                    tpdo.transmit()

    def _reconfigured(self) -> None:
        for stopped in self._running:
            stopped.stop()
        self._running = tuple(t for t in self._tpdos if self._active and t.objects.parameters.valid)
        self._listening = tuple(r for r in self._rpdos if self._active and r.objects.parameters.valid)
        for tpdo in self._running:
            tpdo.start(self._line.now_ns)
        for rpdo in self._listening:
            rpdo.start()
        self._polled = tuple(t for t in self._running if t.on_event)
        self._routes_changed()
