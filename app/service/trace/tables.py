"""The tables of the bus room: nodes, identifiers, SDO transfers, emergencies, load. Small views of what was seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from app.model.address import Address
from app.service.bus_feed import BusFeed
from app.service.stage import Stage
from app.service.trace.text import Namer, TraceItem, abort_details, emcy_details
from app.service.views import is_managed
from app.wire.busload import EXTENDED_KEY
from app.wire.emcy import NO_ERROR
from app.wire.frame import Can, Direction
from app.wire.live import NodeView
from app.wire.nmt import MAX_NODE
from app.wire.records import EmcySeen, Outcome, SdoSeen

DEVICE_NAME: Final = Address(0x1008)
HISTORY_S: Final = 300
Transfers = Literal["all", "writes", "failed"]


@dataclass(frozen=True, slots=True)
class BusNode:
    """One node that was seen, or that the site names. ``nmt`` is the text key of its state.

    ``device_name`` is what it said of itself (1008h). Not ``managed``: its bus has neither states nor heartbeats; then
    ``answered_t_ns``, its latest answer to anybody, tells that it is there. ``sdo_count`` counts transfers;
    ``other_client_t_ns`` is the latest one that was not ours.
    """

    bus: str
    node: int
    device: str | None
    description: str | None
    device_name: str | None
    seen: bool
    nmt: str | None
    commanded: bool
    silent: bool
    heartbeat_t_ns: int | None
    period_ms: float | None
    boots: int
    load: float
    emcy_t_ns: int | None
    emcy: Mapping[str, Any] | None
    sdo_count: int
    sdo_t_ns: int | None
    other_client_t_ns: int | None
    managed: bool
    answered_t_ns: int | None


@dataclass(frozen=True, slots=True)
class BusIdentifier:
    """One identifier: what it carried last, how often it comes, and its share of the bus (0..1 of the bit rate)."""

    bus: str
    can_id: int
    extended: bool
    service: str
    number: int
    node: int
    device: str | None
    direction: Literal["rx", "tx"]
    data: str
    dlc: int
    remote: bool
    t_ns: int
    frames: int
    per_second: int
    period_ms: float | None
    shortest_ms: float | None
    longest_ms: float | None
    load: float


@dataclass(frozen=True, slots=True)
class SdoLine:
    """One SDO transfer. ``ours``: the bench was its client. ``abort`` fills a text, as in the trace."""

    t_ns: int
    start_t_ns: int
    bus: str
    node: int
    device: str | None
    ours: bool
    access: Literal["read", "write"]
    protocol: str
    outcome: str
    item: TraceItem
    abort: Mapping[str, Any] | None
    aborted_by: str | None
    took_ms: float


@dataclass(frozen=True, slots=True)
class EmcyLine:
    """One emergency message; ``reset``: it tells that an error is gone."""

    t_ns: int
    bus: str
    node: int
    device: str | None
    reset: bool
    details: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class LoadSecondLine:
    """One full second: load 0..1, frames, and the load by node (0: of no node)."""

    second: int
    load: float
    frames: int
    nodes: Mapping[int, float]


@dataclass(frozen=True, slots=True)
class BusLoadLine:
    """The load of one bus: now, by node now, and second by second, oldest first."""

    bus: str
    bitrate: int
    load: float
    nodes: Mapping[int, float]
    seconds: tuple[LoadSecondLine, ...]


def nodes(stage: Stage) -> list[BusNode]:
    """All nodes of all buses, by number."""
    now_ns = stage.stamper()
    namer = Namer(stage.targets)
    views = {(view.bus, view.node): view for view in stage.live.nodes()}
    places = {(target.device.bus, target.node) for target in stage.targets} | set(views)
    found = []
    for bus, link in stage.buses.items():
        loads, last = link.node_load(now_ns), link.trace.last_transfers()
        of_bus = {node for each, node in places if each == bus}
        of_bus |= {node for node in loads if 0 < node <= MAX_NODE}
        for node in sorted(of_bus):
            view = views.get((bus, node))
            found.append(_node(stage, link, namer, node, view, loads.get(node, 0.0), last.get(node)))
    return found


def _node(
    stage: Stage,
    link: BusFeed,
    namer: Namer,
    node: int,
    view: NodeView | None,
    load: float,
    last: SdoSeen | None,
) -> BusNode:
    target, bus = namer.target(link.name, node), link.name
    known = view or NodeView(bus, node)
    emcy = None
    if known.emcy_code is not None and known.emcy_ns is not None:
        heard = EmcySeen(known.emcy_ns, bus, node, known.emcy_code, 0, b"")
        emcy = {**emcy_details(heard, namer.description(bus, node)), "reset": known.emcy_code == NO_ERROR}
    return BusNode(
        bus=bus,
        node=node,
        device=namer.slug(bus, node),
        description=None if target is None else target.description.id,
        device_name=_device_name(stage, bus, node),
        seen=view is not None,
        nmt=None if known.state is None or known.silent else known.state.text_key,
        commanded=known.commanded,
        silent=known.silent,
        heartbeat_t_ns=known.heartbeat_ns,
        period_ms=_ms(known.period_ns),
        boots=known.boots,
        load=round(load, 5),
        emcy_t_ns=known.emcy_ns,
        emcy=emcy,
        sdo_count=link.trace.sdo_count.get(node, 0),
        sdo_t_ns=None if last is None else last.t_ns,
        other_client_t_ns=known.other_client_ns,
        managed=target is None or is_managed(target),
        answered_t_ns=known.answered_ns,
    )


def _device_name(stage: Stage, bus: str, node: int) -> str | None:
    view = stage.live.value(bus, node, DEVICE_NAME)
    return None if view is None or view.reading is None else view.reading.data.rstrip(b"\0").decode("ascii", "replace")


def identifiers(stage: Stage) -> list[BusIdentifier]:
    """All identifiers of all buses since the connection was opened."""
    now_ns = stage.stamper()
    namer = Namer(stage.targets)
    found = []
    for bus, link in stage.buses.items():
        shares = link.identifier_load(now_ns)
        for view in link.trace.identifiers(now_ns):
            can = view.frame.payload
            if not isinstance(can, Can):
                continue
            speaker = link.trace.speaker(can.can_id, can.extended)
            found.append(
                BusIdentifier(
                    bus=bus,
                    can_id=can.can_id,
                    extended=can.extended,
                    service=speaker.service.value,
                    number=speaker.number,
                    node=speaker.node,
                    device=namer.slug(bus, speaker.node),
                    direction=view.frame.direction.value,
                    data=can.data.hex(),
                    dlc=can.length,
                    remote=can.remote,
                    t_ns=view.frame.t_ns,
                    frames=view.frames,
                    per_second=view.per_second,
                    period_ms=_ms(view.period_ns),
                    shortest_ms=_ms(view.shortest_ns),
                    longest_ms=_ms(view.longest_ns),
                    load=round(shares.get(can.can_id | EXTENDED_KEY if can.extended else can.can_id, 0.0), 5),
                )
            )
    return found


def _ms(ns: int | None) -> float | None:
    return None if ns is None else round(ns / 1e6, 3)


def transfers(stage: Stage, which: Transfers, node: int | None, limit: int) -> list[SdoLine]:
    """The latest ``limit`` transfers, newest first."""
    namer = Namer(stage.targets)
    seen = [one for link in stage.buses.values() for one in link.trace.transfers(polls=which == "all")]
    wanted = [
        one
        for one in seen
        if (node is None or one.node == node) and (which != "failed" or one.outcome is not Outcome.DONE)
    ]
    wanted.sort(key=lambda one: -one.t_ns)
    return [_transfer(one, namer) for one in wanted[:limit]]


def _transfer(seen: SdoSeen, namer: Namer) -> SdoLine:
    return SdoLine(
        t_ns=seen.t_ns,
        start_t_ns=seen.t_ns - seen.dt_ns,
        bus=seen.bus,
        node=seen.node,
        device=namer.slug(seen.bus, seen.node),
        ours=seen.client is Direction.TX,
        access=seen.access.value,
        protocol=seen.protocol.value,
        outcome=seen.outcome.value,
        item=namer.item(seen.bus, seen.node, seen.address, seen.data),
        abort=None if seen.abort_code is None else abort_details(seen.abort_code, seen.protocol),
        aborted_by=None if seen.aborted_by is None else seen.aborted_by.value,
        took_ms=round(seen.dt_ns / 1e6, 2),
    )


def emergencies(stage: Stage, limit: int) -> list[EmcyLine]:
    """The latest ``limit`` emergency messages, newest first."""
    namer = Namer(stage.targets)
    seen = [one for link in stage.buses.values() for one in link.trace.emergencies()]
    seen.sort(key=lambda one: -one.t_ns)
    return [
        EmcyLine(
            t_ns=one.t_ns,
            bus=one.bus,
            node=one.node,
            device=namer.slug(one.bus, one.node),
            reset=one.code == NO_ERROR,
            details=emcy_details(one, namer.description(one.bus, one.node)),
        )
        for one in seen[:limit]
    ]


def load(stage: Stage) -> list[BusLoadLine]:
    """The load of every bus, with the last minutes."""
    now_ns = stage.stamper()
    found = []
    for bus, link in stage.buses.items():
        seconds, by_node = link.load_history(HISTORY_S)
        shares = dict(by_node)
        lines = tuple(
            LoadSecondLine(one.second, round(one.load, 4), one.frames, _rounded(shares.get(one.second, {})))
            for one in seconds
        )
        now = link.node_load(now_ns)
        found.append(BusLoadLine(bus, link.bitrate, round(sum(now.values()), 4), _rounded(now), lines))
    return found


def _rounded(shares: Mapping[int, float]) -> dict[int, float]:
    return {node: round(share, 5) for node, share in shares.items()}
