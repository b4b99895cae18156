"""Parameter sets out of recordings: what its SDO traffic showed of each device, whoever asked.

Of each object the last transfer counts that was acknowledged; a write that nobody saw end makes the object unknown.
Every value keeps its instant and its direction. What came before a boot-up or a gap is kept and marked: the device may
hold another value since, as after a boot-up without a save.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Any, Final

from app import __version__
from app.errors import RecordingError
from app.model.address import Address
from app.model.checks import RESTORE_DEFAULTS, STORE_PARAMETERS
from app.model.datatypes import Raw
from app.model.description import Bus, Description
from app.model.sets import Origin, ParameterSet, identity_of, iso_time
from app.recording.content import Event, EventKind, RecordingInfo
from app.recording.node_table import read_nodes, read_servers
from app.service.devices import decode
from app.service.library.series import Progress, Series
from app.wire.decoders import BusDecoder, decoder_of, decoder_of_frame
from app.wire.frame import Direction, Fdl, Frame
from app.wire.records import (
    BootUpSeen,
    Outcome,
    Protocol,
    Record,
    RestartSeen,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    SlaveSeen,
    SlaveState,
    Source,
    TransactionSeen,
    ValueSeen,
)
from app.wire.sdo import Abort

NOT_SEEN: Final = "not seen"
UNFINISHED: Final = "write not finished"
_COMMANDS: Final = (STORE_PARAMETERS, RESTORE_DEFAULTS)
"""What is written there is an order, and no value that stands anywhere."""
_GAPS: Final = frozenset({EventKind.FRAMES_LOST, EventKind.GAP, EventKind.BUS_LOST})


class Doubt(Enum):
    """What happened after a value was seen, so that the device may hold another one."""

    BOOT_UP = "boot-up"
    GAP = "gap"


@dataclass(frozen=True, slots=True)
class Seen:
    """How a value came to be known: when, read or written, by this tool or another master."""

    t_ns: int
    access: SdoAccess
    ours: bool
    doubt: Doubt | None = None

    def as_json(self) -> dict[str, Any]:
        """For the store."""
        doubt = None if self.doubt is None else self.doubt.value
        return {"t_ns": self.t_ns, "access": self.access.value, "ours": self.ours, "doubt": doubt}

    @classmethod
    def of_json(cls, kept: Mapping[str, Any]) -> Seen:
        """As ``as_json`` gave it."""
        doubt = None if kept["doubt"] is None else Doubt(kept["doubt"])
        return cls(kept["t_ns"], SdoAccess(kept["access"]), kept["ours"], doubt)


@dataclass(frozen=True, slots=True)
class RecoveredSet:
    """The set of one device, and how each of its values was seen."""

    bus: str
    parameters: ParameterSet
    seen: Mapping[Address, Seen]
    unknown: tuple[Address, ...] = ()
    """Objects that were seen and that the description does not have."""


@dataclass(frozen=True, slots=True)
class Recovered:
    """What a recording gave. ``nameless`` are nodes with SDO traffic of which it is not told what they are.

    ``name`` is that of its file, or says which files it were.
    """

    sets: tuple[RecoveredSet, ...]
    nameless: Mapping[tuple[str, int], int] = field(default_factory=dict)
    damages: int = 0
    name: str = ""


@dataclass(frozen=True, slots=True)
class Named:
    """Whose values the node's are."""

    slug: str
    description: Description


@dataclass(slots=True)
class _Node:
    values: dict[Address, bytes] = field(default_factory=dict)
    seen: dict[Address, Seen] = field(default_factory=dict)
    failed: dict[Address, str] = field(default_factory=dict)
    empty: set[Address] = field(default_factory=set)

    def take(self, record: SdoSeen) -> None:
        """One finished transfer."""
        address = record.address
        if record.access is SdoAccess.WRITE and address.major in _COMMANDS:
            return
        if record.outcome is Outcome.DONE and record.data is not None:
            self._forget(address)
            self.values[address] = record.data
            self.seen[address] = Seen(record.t_ns, record.access, record.client is Direction.TX)
        elif record.access is SdoAccess.WRITE and record.outcome is not Outcome.ABORTED:
            self._forget(address)
            self.failed[address] = UNFINISHED
        elif record.access is SdoAccess.READ and record.outcome is Outcome.ABORTED:
            if record.abort_code == Abort.NO_DATA:
                self._forget(address)
                self.empty.add(address)
            elif address not in self.values:
                self.failed[address] = _refusal(record)

    def told(self, record: ValueSeen, ours: bool) -> None:
        """One value out of a message that held many."""
        self._forget(record.address)
        self.values[record.address] = record.data
        self.seen[record.address] = Seen(record.t_ns, SdoAccess.READ, ours)

    def ordered(self, address: Address) -> None:
        """What was written there was an order to save."""
        self._forget(address)

    def doubt(self, why: Doubt) -> None:
        """Whatever is known now is in doubt from here on."""
        self.seen = {address: one if one.doubt else replace(one, doubt=why) for address, one in self.seen.items()}

    def _forget(self, address: Address) -> None:
        for known in (self.values, self.seen, self.failed):
            known.pop(address, None)
        self.empty.discard(address)


def _refusal(record: SdoSeen) -> str:
    code = record.abort_code or 0
    return f"PKW error {code}" if record.protocol is Protocol.PKW else f"abort {code:08X}h"


def recover_sets(
    path: Path | Sequence[Path],
    described: Mapping[str, Description],
    named: Mapping[int, Named] | None = None,
    on_progress: Progress | None = None,
) -> Recovered:
    """The sets of one recording file, or of several as one (``Series``). Takes a while for a long one.

    ``described`` are descriptions by id; ``named`` tells what nodes are, and goes before what the recording tells.
    Raises RecordingError.
    """
    paths = [path] if isinstance(path, Path) else path
    try:
        with Series(paths) as series:
            who = _nodes_of(series.infos, described, named or {})
            nodes = _follow(series, _describing(who, named or {}), on_progress)
            sets, nameless = [], {}
            for (bus, number), node in sorted(nodes.items()):
                name = who.get((bus, number)) or (named or {}).get(number)
                if name is not None and (node.values or node.failed):
                    sets.append(_set_of(series, bus, number, node, name))
                elif node.values:
                    nameless[bus, number] = len(node.values)
            whole = tuple(one for one in sets if one.parameters.values)
            return Recovered(whole, nameless, series.damages, series.name)
    except OSError as error:
        raise RecordingError(file=str(paths[0]), offset=0, reason=error.strerror or str(error)) from error


def _nodes_of(
    infos: Iterable[RecordingInfo], described: Mapping[str, Description], named: Mapping[int, Named]
) -> dict[tuple[str, int], Named]:
    """What the files say of their nodes (``can0/11`` = slug and description), where the description is known."""
    found = {}
    for (bus, node), name in (pair for info in infos for pair in read_nodes(info.nodes).items()):
        if name.description_id in described and node not in named:
            found[bus, node] = Named(name.slug, described[name.description_id])
    return found


_Describing = Callable[[str], Mapping[int, Description]]


def _describing(who: Mapping[tuple[str, int], Named], named: Mapping[int, Named]) -> _Describing:
    """What stands on a bus."""

    def on(bus: str) -> dict[int, Description]:
        told = {node: one.description for (name, node), one in who.items() if name == bus}
        return told | {node: one.description for node, one in named.items()}

    return on


def _decoder(frame: Frame, of_modbus: Mapping[str, Mapping[int, str]], described: _Describing) -> BusDecoder:
    """That of the frame's bus. On PROFIBUS only who knows the device can tell parameters from other data."""
    if isinstance(frame.payload, Fdl):
        return decoder_of(frame.bus, described(frame.bus), kind=Bus.PROFIBUS_DP)
    if frame.bus in of_modbus:
        return decoder_of(frame.bus, servers=of_modbus[frame.bus])
    return decoder_of_frame(frame)


def _follow(series: Series, described: _Describing, on_progress: Progress | None) -> dict[tuple[str, int], _Node]:
    servers = {key: at for info in series.infos for key, at in read_servers(info.servers).items()}
    of_modbus = {bus: {node: at for (on, node), at in servers.items() if on == bus} for bus, _ in servers}
    decoders: dict[str, BusDecoder] = {}
    nodes: dict[tuple[str, int], _Node] = {}
    gaps = deque(event for event in series.events() if event.kind in _GAPS)
    for frame in series.frames(on_progress):
        while gaps and gaps[0].t_ns <= frame.t_ns:
            _gap(decoders, nodes, gaps.popleft())
        decoder = decoders.get(frame.bus)
        if decoder is None:
            decoder = decoders[frame.bus] = _decoder(frame, of_modbus, described)
        records = decoder.feed(frame)
        for record in records:
            _take(nodes, record)
        _take_dictionary(nodes, records)
    for event in gaps:
        _gap(decoders, nodes, event)
    return nodes


def _gap(decoders: Mapping[str, BusDecoder], nodes: dict[tuple[str, int], _Node], event: Event) -> None:
    """Frames are missing: transfers that were open are lost, and every value is in doubt. "" is any bus."""
    for bus, decoder in decoders.items():
        if event.bus in ("", bus):
            for record in decoder.gap(event.t_ns, event.kind.value):
                _take(nodes, record)
            for (on_bus, _), node in nodes.items():
                if on_bus == bus:
                    node.doubt(Doubt.GAP)


def _take(nodes: dict[tuple[str, int], _Node], record: Record) -> None:
    if isinstance(record, SdoSeen):
        nodes.setdefault((record.bus, record.node), _Node()).take(record)
        return
    node = nodes.get((record.bus, record.node))
    if node is None:
        return
    if isinstance(record, SaveSeen):
        node.ordered(record.address)
    elif isinstance(record, BootUpSeen | RestartSeen) or _is_away(record):
        node.doubt(Doubt.BOOT_UP)


def _is_away(record: Record) -> bool:
    """A slave does not tell that it starts anew; one that was away may have done so."""
    return isinstance(record, SlaveSeen) and record.state is SlaveState.ABSENT


def _take_dictionary(nodes: dict[tuple[str, int], _Node], records: Sequence[Record]) -> None:
    """What one message told of many objects (Modbus FC 101 and 102): they are no transfers of their own."""
    if not records or not isinstance(records[0], TransactionSeen):
        return
    told = records[0]
    for record in records[1:]:
        if isinstance(record, ValueSeen) and record.source is Source.SDO_READ:
            nodes.setdefault((record.bus, record.node), _Node()).told(record, told.client is Direction.TX)


def _set_of(series: Series, bus: str, number: int, node: _Node, name: Named) -> RecoveredSet:
    entries = name.description.entries
    values: dict[Address, Raw] = {
        address: decode(entries[address], data) for address, data in sorted(node.values.items()) if address in entries
    }
    seen = {address: node.seen[address] for address in values}
    empty = tuple(sorted(address for address in node.empty if address in entries))
    readable = [entry.address for entry in name.description if entry.access.readable]
    missing = {address: node.failed.get(address, NOT_SEEN) for address in readable}
    unread = {address: why for address, why in missing.items() if address not in values and address not in empty}
    last_ns = max((one.t_ns for one in seen.values()), default=0)
    written = sum(one.access is SdoAccess.WRITE for one in seen.values())
    origin = Origin(
        turbine=name.slug.partition("/")[0],
        device=name.slug,
        node=number,
        time=iso_time(last_ns),
        person=series.infos[-1].who,
        reason=f"{series.name}: {len(seen) - written} read, {written} written",
        tool=f"hubside {__version__}",
    )
    parameters = ParameterSet(
        name.description.id, name.description.version, identity_of(values), origin, values, unread, empty
    )
    unknown = tuple(sorted(address for address in node.values if address not in entries))
    return RecoveredSet(bus, parameters, seen, unknown)
