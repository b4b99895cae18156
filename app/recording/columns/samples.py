"""The values of chosen objects out of a recording, by columns."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from app.model.address import Address
from app.model.datatypes import DataType
from app.model.description import Bus, Description
from app.recording.can_table import Block
from app.recording.columns.blocks import Span, can_blocks
from app.recording.columns.follow import BusFollower
from app.recording.columns.frames import opened
from app.recording.columns.listening import Wanted
from app.recording.columns.telegrams import telegram_values
from app.recording.columns.values import Samples
from app.recording.content import Keyframe
from app.recording.reader import Recording
from app.wire.decoder import CanOpenDecoder
from app.wire.decoders import BusDecoder, decoder_of, decoder_of_state

_LOOK_BACK_NS: Final = (10_000_000_000, 120_000_000_000)
"""Where the last keyframe before a time is looked for first; they come every few seconds."""


class Signal(NamedTuple):
    """An object of a node on a bus."""

    bus: str
    node: int
    address: Address


def samples(
    recording: Path | Recording,
    signals: Collection[Signal],
    descriptions: Mapping[tuple[str, int], Description],
    start_ns: int | None = None,
    end_ns: int | None = None,
    workers: int | None = None,
) -> dict[Signal, Samples]:
    """All values of ``signals`` seen from ``start_ns`` on and before ``end_ns``; ``descriptions`` by bus and node.

    The same values at the same times as the decoder of the bus sees them by process data, parameter traffic and
    emergency message, fed with the frames since the last keyframe at or before the start; without one, with all frames
    from the beginning of the file. CAN is read by columns; of other buses every telegram is decoded.
    Where the file cannot be read the recording's ``damages`` tell. Raises ``RecordingError`` as ``open_recording``
    does.
    """
    by_bus: defaultdict[str, list[Signal]] = defaultdict(list)
    for signal in signals:
        by_bus[signal.bus].append(signal)
    with opened(recording) as source:
        keyframe = _keyframe(source, start_ns)
        of_telegrams = {bus for bus, kind in source.kinds.items() if kind is not Bus.CANOPEN}
        followers = {
            bus: _follower(bus, found, descriptions, keyframe)
            for bus, found in by_bus.items()
            if bus not in of_telegrams
        }
        span = Span(None if keyframe is None else keyframe.t_ns + 1, end_ns)

        def prepare(block: Block) -> Block:
            return followers[block.bus].prepare(block)

        for block in can_blocks(source, followers.keys(), span, workers, prepare) if followers else ():
            followers[block.bus].take(block)
        found = {bus: follower.found for bus, follower in followers.items()}
        for bus in by_bus.keys() & of_telegrams:
            decoder = _telegram_decoder(source, bus, descriptions)
            _go_on(decoder, keyframe)
            found[bus] = telegram_values(source, decoder, _places(by_bus[bus]), span)
    return {
        signal: found[signal.bus][signal.node, signal.address].samples(
            _data_type(descriptions.get(signal[:2]), signal.address), start_ns
        )
        for signal in signals
    }


def _telegram_decoder(source: Recording, bus: str, descriptions: Mapping[tuple[str, int], Description]) -> BusDecoder:
    kind = source.kinds[bus]
    servers = {node: at for (name, node), at in source.servers.items() if name == bus}
    if kind is Bus.MODBUS_TCP:
        return decoder_of(bus, servers=servers)
    described = {node: one for (name, node), one in descriptions.items() if name == bus}
    orders = {node: order for (name, node), order in source.orders.items() if name == bus}
    return decoder_of(bus, described, None, kind, orders)


def _data_type(description: Description | None, address: Address) -> DataType | None:
    entry = None if description is None else description.entries.get(address)
    return None if entry is None else entry.type


def _follower(
    bus: str,
    signals: list[Signal],
    descriptions: Mapping[tuple[str, int], Description],
    keyframe: Keyframe | None,
) -> BusFollower:
    described = {node: description for (name, node), description in descriptions.items() if name == bus}
    decoder = CanOpenDecoder(bus, described)
    _go_on(decoder, keyframe)
    return BusFollower(decoder, Wanted(_places(signals)))


def _go_on(decoder: BusDecoder, keyframe: Keyframe | None) -> None:
    state = {} if keyframe is None else keyframe.state.get("decoders", {})
    if decoder.bus in state:
        decoder.restore(state[decoder.bus])


def _places(signals: list[Signal]) -> list[tuple[int, Address]]:
    return [(signal.node, signal.address) for signal in signals]


def _keyframe(recording: Recording, start_ns: int | None) -> Keyframe | None:
    """The last keyframe at or before the start that a decoder can go on from."""
    if start_ns is None:
        span = recording.span_ns
        if span is None:
            return None
        start_ns = span[0]
    for back_ns in (*_LOOK_BACK_NS, start_ns):
        found = list(recording.keyframes(max(0, start_ns - back_ns), start_ns + 1))
        usable: Keyframe | None = next(filter(_usable, reversed(found)), None)
        if usable is not None:
            return usable
    return None


def _usable(keyframe: Keyframe) -> bool:
    """Whether all decoders take their state; that of another program may be of another kind."""
    decoders = keyframe.state.get("decoders")
    if not isinstance(decoders, Mapping):
        return False
    try:
        for bus, state in decoders.items():
            decoder_of_state(bus, state).restore(state)
    except (KeyError, ValueError, TypeError, AttributeError):
        return False
    return True
