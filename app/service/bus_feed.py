"""What becomes of the frames of one bus, whether they come from a wire or from a recording: load, trace, live state."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from threading import Lock
from typing import Final

from app.model.description import Bus, Description
from app.recording.content import EventKind
from app.recording.index.course import GAP_REASONS
from app.service.trace.log import BusTrace
from app.wire.busload import EXTENDED_KEY, BusLoad, LoadSecond
from app.wire.can_bits import frame_bits
from app.wire.decoder import CanOpenDecoder
from app.wire.decoders import BusDecoder, decoder_of
from app.wire.frame import Adu, Can, Fdl, Frame
from app.wire.live import LiveState
from app.wire.modbus.adu import ETHERNET_BPS, wire_bits
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.pdo_follower import PdoRoute
from app.wire.profibus import fdl
from app.wire.profibus.owners import Owners
from app.wire.profibus.pzd import Order
from app.wire.records import Record

GAP_REASON: Final = GAP_REASONS[EventKind.BUS_LOST]


class BusFeed:
    """Frames of a bus go through the decoder into the live state and count as bus load.

    ``lock`` is shared by all buses of a stage, because the live state has one writer at a time. ``descriptions`` by
    node; ``bitrate`` in bit/s. ``servers``: ``host:port`` by node, where it is a Modbus TCP bus. ``kind`` is what is
    spoken on it, None: as what stands there does. ``orders``: what a site says of the process data of stations on
    PROFIBUS.
    """

    def __init__(
        self,
        name: str,
        bitrate: int,
        descriptions: Mapping[int, Description],
        live: LiveState,
        lock: Lock,
        servers: Mapping[int, str] | None = None,
        kind: Bus | None = None,
        orders: Mapping[int, Order] | None = None,
    ) -> None:
        self.name = name
        self.bitrate = bitrate
        self.decoder: BusDecoder = decoder_of(name, descriptions, servers, kind, orders)
        self._can = self.decoder if isinstance(self.decoder, CanOpenDecoder) else None
        self._modbus = self.decoder if isinstance(self.decoder, ModbusDecoder) else None
        self._owners = Owners()
        self.load = BusLoad(bitrate if self._modbus is None else ETHERNET_BPS)
        self.trace = BusTrace(name, self.decoder, lock, servers, orders)
        self.frames = 0
        self._live = live
        self._lock = lock

    def describe(self, node: int, description: Description) -> None:
        """Tell decoder and live state what stands at ``node``."""
        with self._lock:
            self.decoder.set_description(node, description)
            self.trace.describe(node, description)
            self._live.set_description(self.name, node, description)

    def take(self, frames: Sequence[Frame]) -> None:
        """Count and decode frames of this bus."""
        with self._lock:
            self.frames += len(frames)
            self._count(frames)
            self.trace.take(frames)
            records = self.decoder.feed_all(frames)
            if records:
                self.trace.heard(records)
                self._heard(records)
                self._live.apply_all(records)

    def _count(self, frames: Sequence[Frame]) -> None:
        count = self.load.feed
        for frame in frames:
            t_ns, _, _, payload, _ = frame
            if type(payload) is Can:
                count(t_ns, frame_bits(payload), payload.can_id, payload.extended)
            elif type(payload) is Fdl:
                count(t_ns, fdl.wire_bits(len(payload.data)), self._owners.of(payload.data))
            elif type(payload) is Adu and self._modbus is not None:
                count(t_ns, wire_bits(len(payload.data)), self._modbus.node_of(frame))

    def gap(self, t_ns: int, reason: str = GAP_REASON) -> None:
        """Frames are missing before ``t_ns``: what was read until then proves nothing any more."""
        with self._lock:
            self.trace.gap(t_ns, reason)
            records = self.decoder.gap(t_ns, reason)
            self.trace.heard(records)
            self._missed(records)
            self._live.apply_all(records)

    def _heard(self, records: Sequence[Record]) -> None:
        """What the frames told, before the live state takes it."""

    def _missed(self, records: Sequence[Record]) -> None:
        """What a gap told, before the live state takes it."""

    def bus_load(self, now_ns: int) -> float:
        """Load of the last second, 0..1."""
        with self._lock:
            return self.load.load(now_ns)

    def node_load(self, now_ns: int) -> dict[int, float]:
        """Load of the last second by node; 0 is what belongs to none."""
        with self._lock:
            return self.load.shares_by(self._node_of, now_ns)

    def identifier_load(self, now_ns: int) -> dict[int, float]:
        """Load of the last second by identifier; 29-bit identifiers have 2^29 added."""
        with self._lock:
            return self.load.shares(now_ns)

    def load_history(self, seconds: int) -> tuple[list[LoadSecond], list[tuple[int, dict[int, float]]]]:
        """The last full seconds, oldest first: the load, and the load by node."""
        with self._lock:
            return list(self.load.history)[-seconds:], self.load.history_by(self._node_of)[-seconds:]

    def _node_of(self, key: int) -> int:
        if self._can is None:
            return key
        return self._can.speaker(key & ~EXTENDED_KEY, bool(key & EXTENDED_KEY)).node

    def pdos(self, node: int) -> tuple[PdoRoute, ...]:
        """The PDOs of ``node`` by the mapping in force."""
        with self._lock:
            return self.decoder.pdos(node)
