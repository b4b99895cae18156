"""Which decoder a bus needs: by where its devices are, by a kept state, or by a frame of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Protocol

from app.model.description import Bus, Description
from app.wire.decoder import CanOpenDecoder
from app.wire.frame import Adu, Fdl, Frame
from app.wire.modbus.decoder import ModbusDecoder
from app.wire.pdo_follower import PdoRoute
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.pzd import Order
from app.wire.records import Record


class BusDecoder(Protocol):
    """What the decoders of all buses have: see ``CanOpenDecoder``."""

    bus: str

    def set_description(self, node: int, description: Description | None) -> None:
        """Tell what stands at ``node``."""

    def feed(self, frame: Frame) -> Sequence[Record]:
        """Decode one frame."""

    def feed_all(self, frames: Iterable[Frame]) -> list[Record]:
        """Decode many frames in their order."""

    def gap(self, t_ns: int, reason: str) -> Sequence[Record]:
        """Frames are missing before ``t_ns``; ``reason`` is a text key."""

    def pdos(self, node: int) -> tuple[PdoRoute, ...]:
        """The PDOs of ``node`` in force."""

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state for a keyframe."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError on another state."""


def decoder_of(
    bus: str,
    descriptions: Mapping[int, Description] | None = None,
    servers: Mapping[int, str] | None = None,
    kind: Bus | None = None,
    orders: Mapping[int, Order] | None = None,
) -> BusDecoder:
    """The decoder of ``bus``. ``servers`` are the ``host:port`` of its nodes where it is Modbus TCP, None elsewhere.

    ``kind`` is what is spoken on it, None: as what stands there does. ``orders`` are what a site says of the process
    data of its nodes on PROFIBUS.
    """
    speaks = {one.bus for one in (descriptions or {}).values()} if kind is None else {kind}
    if servers is not None or Bus.MODBUS_TCP in speaks:
        return ModbusDecoder(bus, {server: node for node, server in (servers or {}).items()})
    if Bus.PROFIBUS_DP in speaks:
        return ProfibusDecoder(bus, descriptions, orders)
    return CanOpenDecoder(bus, descriptions)


def decoder_of_state(bus: str, state: Mapping[str, Any]) -> BusDecoder:
    """One that can take the kept ``state``, without knowing a device."""
    kinds: Mapping[Any, type[ModbusDecoder] | type[ProfibusDecoder]]
    kinds = {kind.PROTOCOL: kind for kind in (ModbusDecoder, ProfibusDecoder)}
    return kinds.get(state.get("protocol"), CanOpenDecoder)(bus)


def decoder_of_frame(frame: Frame) -> BusDecoder:
    """One for the bus of ``frame``, of which nothing else is known."""
    if isinstance(frame.payload, Fdl):
        return ProfibusDecoder(frame.bus)
    return ModbusDecoder(frame.bus) if isinstance(frame.payload, Adu) else CanOpenDecoder(frame.bus)
