"""How the PDOs of a node are set up as far as the wire has told, who else uses which identifier, and what it costs.

Sends nothing, and serves a recording as it serves the bench.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from app.model.address import Address
from app.model.datatypes import DataType
from app.model.description import Description
from app.model.pdo.findings import CONTROLWORD
from app.model.pdo.identifiers import EMCY, SYNC, Taken, Use, bus_wide, is_restricted
from app.model.pdo.load import Basis, PdoLoad, estimate, total
from app.model.pdo.objects import COB_INVALID
from app.model.pdo.setup import PdoId, PdoSetup, PdoSetups, parse_setup, places_of
from app.service.devices import Target
from app.service.stage import Stage
from app.wire.frame import Can
from app.wire.nmt import NmtState
from app.wire.pdo_follower import EMCY_COB_ID
from app.wire.records import Source

SYNC_COB_ID: Final = Address(0x1005)
_EMCY_COB_ID: Final = Address(EMCY_COB_ID)
_DUMMIES: Final = (DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32)
_Key = tuple[int, bool]


@dataclass(frozen=True, slots=True)
class Mappable:
    """An object that may be mapped, and into which PDOs. Up to 001Fh it only fills bits."""

    address: Address
    bits: int
    receive: bool
    transmit: bool


@dataclass(frozen=True, slots=True)
class Cost:
    """What the PDOs of a bus cost: of every PDO now and with the change, and of the bus as a whole (0..1)."""

    now: Mapping[tuple[str, PdoId], PdoLoad]
    after: Mapping[tuple[str, PdoId], PdoLoad]
    bus_now: float
    bus_after: float
    pdos_now: float
    pdos_after: float


@dataclass(frozen=True, slots=True)
class Seen:
    """Frames of identifiers: how many in the last full second, and when the latest came. SYNC messages a second."""

    per_second: Mapping[_Key, int]
    latest_ns: Mapping[_Key, int]
    sync_hz: float | None


def setups_of(target: Target) -> dict[PdoId, PdoSetup]:
    """The PDOs of a device by what was seen on the wire since it started; those not known are left out."""
    found = (parse_setup(place, target.lookup) for place in places_of(target.description))
    return {setup.id: setup for setup in found if setup is not None}


def mappable(description: Description) -> list[Mappable]:
    """What may be mapped, by address."""
    dummies = [Mappable(Address(kind.value), kind.bits or 0, True, False) for kind in _DUMMIES]
    objects = [
        Mappable(entry.address, entry.type.bits, entry.receivable, entry.sendable)
        for entry in description
        if entry.pdo and entry.type.bits and (entry.receivable or entry.sendable)
    ]
    return [*objects, *dummies]


def is_operational(target: Target) -> bool | None:
    """Whether PDOs of the node are sent and taken; None where its state is not known."""
    view = target.live.node(target.device.bus, target.node)
    return None if view is None or view.state is None else view.state is NmtState.OPERATIONAL and not view.silent


def seen_on(stage: Stage, bus: str) -> Seen:
    """What came on the bus."""
    feed, now_ns = stage.buses[bus], stage.stamper()
    rates: dict[_Key, int] = {}
    latest: dict[_Key, int] = {}
    for view in feed.trace.identifiers(now_ns):
        can = view.frame.payload
        if isinstance(can, Can) and not can.remote:
            rates[can.can_id, can.extended] = view.per_second
            latest[can.can_id, can.extended] = view.frame.t_ns
    sync = [rates[one, False] for one in _sync_ids(stage, bus) if (one, False) in rates]
    return Seen(rates, latest, float(max(sync)) if sync else None)


def taken_by_others(stage: Stage, target: Target) -> list[Taken]:
    """Identifiers that this bus uses beside the PDOs of ``target``: services, PDOs of other nodes, unknown frames."""
    bus = target.device.bus
    found = bus_wide(_sync_ids(stage, bus))
    for other in _on_bus(stage, bus):
        found += _services(other)
        if other.slug == target.slug:
            continue
        for route in stage.buses[bus].pdos(other.node):
            receives = route.source is not Source.PDO_TX
            use = Use.RPDO if receives else Use.TPDO
            found.append(Taken(route.can_id, route.extended, use, other.slug, route.number))
            if receives and any(address == CONTROLWORD for address, _bits in route.mapping.entries):
                found.append(Taken(route.can_id, route.extended, Use.COMMANDS, other.slug, route.number))
    return [*found, *_unknown_frames(stage, target, found)]


def _services(target: Target) -> Iterator[Taken]:
    """Emergencies, and SDO servers (CiA 301, 7.5.2.30) at other identifiers than those that no PDO may have anyway."""
    emcy = target.lookup(_EMCY_COB_ID)
    if not isinstance(emcy, int):
        yield Taken(EMCY + target.node, False, Use.EMCY, target.slug)
    elif not emcy & COB_INVALID:
        yield Taken(emcy & 0x7FF, False, Use.EMCY, target.slug)
    for entry in target.description:
        if not 0x1200 <= entry.address.major < 0x1280 or entry.address.minor not in (1, 2):
            continue
        raw = target.lookup(entry.address)
        if raw is None and isinstance(entry.default, int):
            raw = entry.default + (target.node if entry.node_id else 0)
        if isinstance(raw, int) and not raw & COB_INVALID and not is_restricted(raw & 0x7FF):
            yield Taken(raw & 0x7FF, False, Use.SDO, target.slug)


def _unknown_frames(stage: Stage, target: Target, known: Iterable[Taken]) -> Iterator[Taken]:
    """What came in the last second and belongs to nobody that is known: a device beside those of the site, perhaps."""
    bus = target.device.bus
    own = {(route.can_id, route.extended) for route in stage.buses[bus].pdos(target.node)}
    explained = own | {(one.can_id, one.extended) for one in known}
    for (can_id, extended), per_second in seen_on(stage, bus).per_second.items():
        if per_second and (can_id, extended) not in explained and (extended or not is_restricted(can_id)):
            yield Taken(can_id, extended, Use.SEEN, None)


def cost(stage: Stage, target: Target, before: PdoSetups, after: PdoSetups) -> Cost:
    """What the PDOs of all nodes of the target's bus cost now, and would with ``after`` in the target.

    A PDO that stays as it is counts as it was measured, where its node is operational. Of those that change, only what
    was measured is in the load of the bus now, and no more than that leaves it.
    """
    bus = target.device.bus
    seen, bitrate = seen_on(stage, bus), stage.buses[bus].bitrate
    now: dict[tuple[str, PdoId], PdoLoad] = {}
    then: dict[tuple[str, PdoId], PdoLoad] = {}
    for other in _on_bus(stage, bus):
        is_own = other.slug == target.slug
        runs = is_operational(other) is True
        for pdo, setup in (before if is_own else setups_of(other)).items():
            measured = measured_hz(setup, seen) if runs else None
            now[other.slug, pdo] = estimate(setup, bitrate, seen.sync_hz, measured)
            new = after.get(pdo, setup) if is_own else setup
            if new == setup:
                then[other.slug, pdo] = now[other.slug, pdo]
            else:
                then[other.slug, pdo] = estimate(new, bitrate, seen.sync_hz, None)
    pdos_now, pdos_after = total(now.values()), total(then.values())
    changed = [key for key in now if then[key] is not now[key]]
    leaves = total(now[key] for key in changed if now[key].basis is Basis.MEASURED)
    bus_now = stage.buses[bus].bus_load(stage.stamper())
    bus_after = max(0.0, bus_now - leaves) + total(then[key] for key in changed)
    return Cost(now, then, bus_now, bus_after, pdos_now, pdos_after)


def measured_hz(setup: PdoSetup, seen: Seen) -> float:
    """How often its frame came in the last full second."""
    return float(seen.per_second.get((setup.parameters.can_id, setup.parameters.extended), 0))


def with_changes(before: PdoSetups, changes: Iterable[PdoSetup]) -> dict[PdoId, PdoSetup]:
    """``before`` with some PDOs set up otherwise."""
    return {**before, **{setup.id: setup for setup in changes}}


def _on_bus(stage: Stage, bus: str) -> list[Target]:
    return [target for target in stage.targets if target.device.bus == bus]


def _sync_ids(stage: Stage, bus: str) -> list[int]:
    """As the nodes have them set; what nobody has read is what CiA 301 predefines."""
    found = {SYNC}
    for target in _on_bus(stage, bus):
        raw = target.lookup(SYNC_COB_ID)
        if isinstance(raw, int):
            found.add(raw & 0x7FF)
    return sorted(found)
