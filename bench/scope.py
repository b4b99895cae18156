"""The scope at a full bus of 1 Mbit/s of PDOs with 16 signals, against a program that does the same with ``canopen``.

Both get the same frames in the same portions, stamped as on the bus, in one process and in turns, and both have to:
decode the PDOs by their mapping, keep every value of 16 signals, wait for an edge, take out the capture around it, and
four times a second make of the last ten seconds what a page draws: least and greatest of each of some hundred points.
The peer is what one writes first: a callback of ``canopen`` for each PDO that appends to lists, and loops over values.
Both must have caught the same values to the bit, and none may be missing. Processor time counts.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, Final, NamedTuple

import canopen

from app.cli.runtime import spare_collector
from app.model.description_file import load_builtin
from app.model.site import load_site
from app.service.connection import Connection
from app.service.options import Options
from app.service.scope.engine import SETTLE_NS, Caught, Engine
from app.service.scope.line import Latest, scope_view
from app.service.scope.order import Plan, ScopeOrder, TriggerOrder, plan
from app.service.scope.signals import number_of
from app.wire.can_bits import frame_bits
from app.wire.frame import STAMP_STEP_NS, Can, Direction, Frame
from app.wire.records import Source, ValueSeen
from bench._priority import preferred
from bench._result import Result

BUS: Final = "can0"
BIT_NS: Final = 1000  # 1 Mbit/s
START_NS: Final = 1_750_000_000_000_000_000
TARGET: Final = 3.0
PORTION: Final = 16
"""Frames that the driver hands over at a time, as they gather in 2 ms."""
LOOK_NS: Final = 250_000_000
SHOWN_NS: Final = 10_000_000_000
POINTS: Final = 600
AXES: Final = {11: "wtg-07/blade-1/pmc", 12: "wtg-07/blade-2/pmc", 13: "wtg-07/blade-3/pmc"}
_POSITION, _VELOCITY, _STATUSWORD = "6064", "606C", "6041"
_NS: Final = 1e9
LEVEL_DEG: Final = 50.0


class Outcome(NamedTuple):
    """Processor time in s, and the capture: of each signal its times and raw values. ``drawn``: points made."""

    cpu_s: float
    caught: list[list[tuple[int, int]]]
    drawn: int


def run(full: bool) -> Result:
    """Three rounds of 20 s of the bus; of a minute in the long form."""
    return measure(rounds=3, seconds=60.0 if full else 20.0)


def measure(rounds: int, seconds: float) -> Result:
    """Run both in turns and compare."""
    sent = frames(seconds)
    spare_collector()  # as the server does, for both
    total_s = seconds / 2
    with preferred() as scheduling:
        pairs = [(ours(sent, total_s), peer(sent, total_s)) for _ in range(rounds)]
    ratios = [their.cpu_s / our.cpu_s for our, their in pairs]
    share, theirs = (statistics.median(pair[n].cpu_s for pair in pairs) / seconds for n in (0, 1))
    first, last = pairs[-1]
    values = sum(map(len, first.caught))
    return Result(
        statistics.median(ratios),
        TARGET,
        (
            f"{len(sent)} PDOs in {seconds:g} s ({len(sent) / seconds:.0f} a second), 16 signals, "
            f"{rounds} rounds; medians; scheduling: {scheduling}",
            f"ours: {share:.1%} of a core; a capture of {values} values, {first.drawn} points drawn",
            f"canopen and lists: {theirs:.1%} of a core; a capture of {sum(map(len, last.caught))} values",
            f"ratios {' '.join(f'{ratio:.2f}' for ratio in ratios)}",
        ),
        tuple(_shortfalls(sent, pairs)),
    )


def _shortfalls(sent: list[Frame], pairs: list[tuple[Outcome, Outcome]]) -> Iterator[str]:
    for our, their in pairs:
        if our.caught != their.caught:
            yield "the captures of the two differ"
        times = [t_ns for t_ns, _ in our.caught[0]]
        told = [one.t_ns for one in sent if _is_position(one, 11)]
        inside = [t_ns for t_ns in told if times[0] <= t_ns <= times[-1]]
        if times != inside:
            yield f"{len(inside) - len(times)} values of a signal are missing"


# -- the bus -----------------------------------------------------------------------


def names() -> list[str]:
    """16 signals: of each axis the position, the speed, the statusword and two of its bits, and one more bit."""
    of_axis = [_POSITION, _VELOCITY, _STATUSWORD, f"{_STATUSWORD}.2", f"{_STATUSWORD}.3"]
    return [f"{slug}/{one}" for slug in AXES.values() for one in of_axis] + [f"{AXES[11]}/{_STATUSWORD}.10"]


def frames(seconds: float) -> list[Frame]:
    """A bus that is never idle, of nothing but transmit PDOs of three axes, after the reading of their mapping."""
    made: list[Frame] = []
    t_ns, end_ns = START_NS, START_NS + round(seconds * _NS)
    for can in _sequence():
        t_ns += frame_bits(can) * BIT_NS
        if t_ns >= end_ns:
            break
        made.append(Frame(t_ns - t_ns % STAMP_STEP_NS, BUS, Direction.RX, can))
    return made


def _sequence() -> Iterator[Can]:
    """TPDO 2 has statusword and position, TPDO 3 statusword and speed; an axis swings between 0 and 100 degrees."""
    cycle = 0
    while True:
        cycle += 1
        for node in AXES:
            swing = (cycle * 20 + 1000 * node) % 20_000
            angle = swing if swing < 10_000 else 20_000 - swing
            status = (0x0027 | (cycle // 50 % 2) << 10).to_bytes(2, "little")
            yield Can(0x280 + node, status + angle.to_bytes(4, "little"))
            speed = 300 if swing < 10_000 else -300
            yield Can(0x380 + node, status + speed.to_bytes(4, "little", signed=True))


def _is_position(frame: Frame, node: int) -> bool:
    return isinstance(frame.payload, Can) and frame.payload.can_id == 0x280 + node


def _portions(sent: list[Frame]) -> Iterator[list[Frame]]:
    source = iter(sent)
    while portion := list(islice(source, PORTION)):
        yield portion


# -- ours ---------------------------------------------------------------------------


def ours(sent: list[Frame], total_s: float) -> Outcome:
    """The bus of a connection as the server makes it, with the scope listening; all in this thread."""
    connection = _connection()
    link = connection.buses[BUS]
    for node in AXES:  # what the mapping is, as the reading of it tells: enabled, and what each PDO carries
        link.on_frames(_enabled(node))
    edge = TriggerOrder("edge", names()[0], LEVEL_DEG, "rising", None, None, None, None)
    order = ScopeOrder(tuple(names()), edge, total_s, total_s / 2, "single", 0.0, 1.0)
    planned = plan(order, connection.target, connection.targets)
    scope = _Scope(planned, sent[0].t_ns - 1)
    link.listen(scope.hear)
    begin_s = time.process_time()
    for portion in _portions(sent):
        link.on_frames(portion)
        scope.tick(portion[-1].t_ns)
    scope.tick(sent[-1].t_ns + SETTLE_NS + 1)
    cpu_s = time.process_time() - begin_s
    (caught,) = scope.caught
    pairs = [list(zip(one.t_ns.tolist(), one.raw.tolist(), strict=True)) for one in caught.stretches]
    return Outcome(cpu_s, pairs, scope.drawn)


class _Scope:
    """Engine and live view, fed as the desk feeds them."""

    def __init__(self, planned: Plan, armed_ns: int) -> None:
        buses = [place.bus for place in planned.sources]
        self.caught: list[Caught] = []
        self.drawn = 0
        self._plan = planned
        self._sources = {tuple(place): number for place, number in planned.sources.items()}
        self._engine = Engine(
            planned.channels, planned.trigger, planned.timing, armed_ns, buses, SHOWN_NS, max_samples=10_000_000
        )
        self._due_ns = armed_ns + LOOK_NS

    def hear(self, records: Any) -> None:
        """Take the values of what the bus told."""
        sources, types, engine = self._sources, self._plan.types, self._engine
        for one in records:
            if type(one) is ValueSeen and (source := sources.get((one.bus, one.node, one.address))) is not None:
                raw = number_of(types[source], one.data)
                if raw is not None:
                    engine.value(source, one.t_ns, raw, one.source is Source.PDO_TX)

    def tick(self, now_ns: int) -> None:
        """Time goes on: what is complete is taken out, and now and then a page looks."""
        self.caught += self._engine.advance(now_ns)
        if now_ns < self._due_ns:
            return
        self._due_ns += LOOK_NS
        engine, since_ns = self._engine, now_ns - SHOWN_NS
        latest = Latest(now_ns, self._plan.signals, engine.latest(since_ns, now_ns), engine.marks(since_ns, now_ns))
        self.drawn += sum(len(one.t_s) for one in scope_view(latest, POINTS).series)


def _connection() -> Connection:
    example = Path(__file__).parents[1] / "docs" / "sites" / "example.toml"
    (turbine,) = load_site(example)
    descriptions = {name: load_builtin(name) for name in ("oat-pmm", "oat-pmc")}
    return Connection(turbine, descriptions, Options("bench", None))


def _enabled(node: int) -> list[Frame]:
    """Somebody enables TPDO 2 and 3, and the axis acknowledges."""
    sent = []
    for index, base in ((0x1801, 0x280), (0x1802, 0x380)):
        address = index.to_bytes(2, "little") + b"\x01"
        sent.append(Can(0x600 + node, b"\x23" + address + (0x40000000 | base + node).to_bytes(4, "little")))
        sent.append(Can(0x580 + node, b"\x60" + address + bytes(4)))
    return [
        Frame(START_NS - 10_000_000 + n * STAMP_STEP_NS, BUS, Direction.RX, one)
        for n, one in enumerate([*sent, Can(0x700 + node, b"\x05")])
    ]


# -- the peer -------------------------------------------------------------------------


def peer(sent: list[Frame], total_s: float) -> Outcome:
    """``canopen`` decodes; callbacks append to lists, and loops look through them."""
    scope = _Lists(total_s, sent[0].t_ns - 1)
    network = canopen.Network()
    for node in AXES:
        _listen(network, node, scope)
    stamps = [(one.t_ns, one.payload.can_id, bytearray(one.payload.data)) for one in sent if type(one.payload) is Can]
    begin_s = time.process_time()
    source = iter(stamps)
    while portion := list(islice(source, PORTION)):
        for t_ns, can_id, data in portion:
            scope.t_ns = t_ns
            network.notify(can_id, data, t_ns)
        scope.tick(portion[-1][0])
    scope.tick(sent[-1].t_ns + SETTLE_NS + 1)
    cpu_s = time.process_time() - begin_s
    if scope.capture is None:
        raise RuntimeError("the peer's trigger never came")
    return Outcome(cpu_s, scope.capture, scope.drawn)


def _listen(network: canopen.Network, node: int, scope: _Lists) -> None:
    """The mapping as the axis has it; ``canopen`` subscribes to it when it is enabled."""
    dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
    kinds = {0x6041: canopen.objectdictionary.UNSIGNED16, 0x6064: canopen.objectdictionary.INTEGER32}
    for index, kind in {**kinds, 0x606C: canopen.objectdictionary.INTEGER32}.items():
        variable = canopen.objectdictionary.ODVariable(f"{index:04X}", index)
        variable.data_type = kind
        dictionary.add_object(variable)
    for number in (2, 3):
        _add_pdo(dictionary, number)
    remote = canopen.RemoteNode(node, dictionary)
    network.add_node(remote)
    for number, base, second in ((2, 0x280, 0x6064), (3, 0x380, 0x606C)):
        pdo = remote.tpdo[number]
        pdo.clear()
        pdo.add_variable(0x6041)
        pdo.add_variable(second)
        pdo.cob_id, pdo.enabled = base + node, True
        pdo.add_callback(scope.callback(node))
        network.subscribe(pdo.cob_id, pdo.on_message)


def _add_pdo(dictionary: canopen.ObjectDictionary, number: int) -> None:
    for index, name in ((0x1800 + number - 1, "communication"), (0x1A00 + number - 1, "mapping")):
        record = canopen.objectdictionary.ODRecord(f"TPDO {number} {name}", index)
        dictionary.add_object(record)


class _Lists:
    """Every value in a list of its signal, the trigger and the picture by loops over values."""

    def __init__(self, total_s: float, armed_ns: int) -> None:
        self.t_ns = 0
        self.drawn = 0
        self.capture: list[list[tuple[int, int]]] | None = None
        self._signals: dict[str, list[tuple[int, int]]] = {name: [] for name in names()}
        self._total_ns = round(total_s * _NS)
        self._pre_ns = round(total_s / 2 * _NS)
        self._trigger_ns: int | None = None
        self._before: int | None = None
        self._due_ns = armed_ns + LOOK_NS

    def callback(self, node: int) -> Callable[[Any], None]:
        """Keeps what a PDO of ``node`` carries, and its bits."""
        slug, own = AXES[node], self._signals
        bits = [(name, int(name.rpartition(".")[2])) for name in own if name.startswith(f"{slug}/{_STATUSWORD}.")]

        def take(pdo: Any) -> None:
            t_ns = self.t_ns
            for variable in pdo.map:
                raw = variable.raw
                name = f"{slug}/{variable.index:04X}"
                own[name].append((t_ns, raw))
                if variable.index == 0x6041:
                    for full, bit in bits:
                        own[full].append((t_ns, raw >> bit & 1))
                elif node == 11 and variable.index == 0x6064:
                    self._look(t_ns, raw)

        return take

    def _look(self, t_ns: int, raw: int) -> None:
        level = LEVEL_DEG * 100
        if self._trigger_ns is None and self._before is not None and self._before < level <= raw:
            self._trigger_ns = t_ns
        self._before = raw

    def tick(self, now_ns: int) -> None:
        """As ours."""
        if self._trigger_ns is not None and self.capture is None:
            start_ns = self._trigger_ns - self._pre_ns
            end_ns = start_ns + self._total_ns
            if end_ns + SETTLE_NS <= now_ns:
                self.capture = [[one for one in own if start_ns <= one[0] <= end_ns] for own in self._signals.values()]
        if now_ns >= self._due_ns:
            self._due_ns += LOOK_NS
            for own in self._signals.values():
                self.drawn += len(_drawn(own, now_ns))


def _drawn(own: list[tuple[int, int]], now_ns: int) -> dict[int, tuple[int, int]]:
    """Least and greatest of each point of the last seconds, newest first until they are over."""
    points: dict[int, tuple[int, int]] = {}
    since_ns, wide_ns = now_ns - SHOWN_NS, SHOWN_NS // POINTS
    for t_ns, raw in reversed(own):
        if t_ns < since_ns:
            break
        at = (t_ns - since_ns) // wide_ns
        low, high = points.get(at, (raw, raw))
        points[at] = (raw if raw < low else low, raw if raw > high else high)
    return points
