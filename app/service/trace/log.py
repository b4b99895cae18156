"""What is kept of a bus for the trace: its last frames, its identifiers, the SDO transfers and the emergencies seen.

The receive thread writes with the connection's lock held; any other thread reads through the same lock.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from threading import Lock
from typing import Final

from app.model.description import Description
from app.wire.decoder import CanOpenDecoder
from app.wire.decoders import BusDecoder
from app.wire.frame import Frame
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.pzd import Order
from app.wire.records import EmcySeen, Outcome, Record, SdoAccess, SdoSeen
from app.wire.trace.ids import Identifiers, IdentifierView
from app.wire.trace.modbus_tracer import ModbusTracer
from app.wire.trace.profibus_tracer import ProfibusTracer
from app.wire.trace.ring import Chunk, FrameRing
from app.wire.trace.service import UNKNOWN, Speaker
from app.wire.trace.tracer import Gap, Item, Tracer, Tracing

MAX_TRANSFERS: Final = 5000
MAX_EMERGENCIES: Final = 2000


class BusTrace:
    """The trace of the bus ``bus``, which ``decoder`` follows; ``lock`` is held by the receive thread.

    ``servers``: ``host:port`` by node, where it is a Modbus TCP bus; ``orders`` of process data by node, where it is
    PROFIBUS. ``epoch`` is raised when a node turns out to be another device: then tracers must be made anew.
    """

    def __init__(
        self,
        bus: str,
        decoder: BusDecoder,
        lock: Lock,
        servers: Mapping[int, str] | None = None,
        orders: Mapping[int, Order] | None = None,
    ) -> None:
        self.bus = bus
        self.epoch = 0
        self.sdo_count: dict[int, int] = {}
        """Transfers by node since the connection was opened."""
        self._decoder = decoder
        self._servers = servers
        self._orders = orders
        self._lock = lock
        self._descriptions: dict[int, Description] = {}
        self._identifiers = Identifiers()
        self._ring = FrameRing(bus, decoder.snapshot, packed=self._identifiers.take)
        self._polls: deque[SdoSeen] = deque(maxlen=MAX_TRANSFERS)
        self._telling: deque[SdoSeen] = deque(maxlen=MAX_TRANSFERS)
        self._emergencies: deque[EmcySeen] = deque(maxlen=MAX_EMERGENCIES)

    # -- the receive thread, lock held ----------------------------------------------

    def take(self, frames: Sequence[Frame]) -> None:
        """Keep frames, before the decoder takes them."""
        self._ring.extend(frames)

    def gap(self, t_ns: int, reason: str) -> None:
        """Frames are missing before ``t_ns``; before the decoder is told."""
        self._ring.extend((Gap(t_ns, self.bus, reason),))

    def heard(self, records: Iterable[Record]) -> None:
        """Keep what the decoder made of the frames."""
        for record in records:
            if type(record) is SdoSeen:
                quiet = record.access is SdoAccess.READ and record.outcome is Outcome.DONE
                (self._polls if quiet else self._telling).append(record)
                self.sdo_count[record.node] = self.sdo_count.get(record.node, 0) + 1
            elif type(record) is EmcySeen:
                self._emergencies.append(record)

    def describe(self, node: int, description: Description) -> None:
        """What stands at ``node`` is known now; after the decoder was told."""
        self._descriptions[node] = description
        self._identifiers.take(self._ring.open_items())
        self._ring.renew()
        self.epoch += 1

    # -- readers, any thread ----------------------------------------------------------

    def chunks(self) -> list[Chunk]:
        """All that is kept of the frames, oldest first."""
        with self._lock:
            return self._ring.chunks()

    def since(self, number: int) -> tuple[int, list[Item]]:
        """Items from ``number`` on, and the number of the first of them: a later one where that is gone."""
        with self._lock:
            return self._ring.since(number)

    def tracer(self) -> Tracing:
        """One that begins anywhere: give it the snapshot of a chunk by ``restart``."""
        if self._servers is not None:
            return ModbusTracer(self.bus, self._servers)
        if isinstance(self._decoder, ProfibusDecoder):
            return ProfibusTracer(self.bus, self.descriptions(), self._orders)
        return Tracer(self.bus, self.descriptions())

    def tracer_now(self) -> tuple[Tracing, int]:
        """One that goes on from now, and the number of the first item that it has to take."""
        with self._lock:
            snapshot, number = self._decoder.snapshot(), self._ring.total
        tracer = self.tracer()
        tracer.restart(snapshot)
        return tracer, number

    def descriptions(self) -> Mapping[int, Description]:
        """What stands at which node."""
        with self._lock:
            return dict(self._descriptions)

    def speaker(self, can_id: int, extended: bool) -> Speaker:
        """Whose CAN identifier this is now."""
        if not isinstance(self._decoder, CanOpenDecoder):
            return UNKNOWN
        with self._lock:
            return self._decoder.speaker(can_id, extended)

    def identifiers(self, now_ns: int) -> list[IdentifierView]:
        """All identifiers since the connection was opened."""
        with self._lock:
            table, rest = self._identifiers.copy(), self._ring.open_items()
        table.take(rest)
        return table.views(now_ns)

    def transfers(self, polls: bool) -> list[SdoSeen]:
        """Transfers by time, oldest first: writes and what did not succeed, and with ``polls`` every read."""
        with self._lock:
            found = [*self._telling, *(self._polls if polls else ())]
        return sorted(found, key=lambda seen: seen.t_ns)

    def emergencies(self) -> list[EmcySeen]:
        """Emergency messages, oldest first."""
        with self._lock:
            return list(self._emergencies)

    def last_transfers(self) -> dict[int, SdoSeen]:
        """The latest transfer of each node."""
        return {seen.node: seen for seen in self.transfers(polls=True)}
