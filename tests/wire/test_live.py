"""The live state, fed through the decoder: RAM, stored place, nodes, events, versions, keyframes, threads."""

from __future__ import annotations

import json
import random
from collections.abc import Iterable
from threading import Thread

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.model.address import Address
from app.model.description import Description
from app.model.description_file import load_builtin
from app.wire import sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.events import EventKind, Severity
from app.wire.frame import Direction, Frame
from app.wire.live import LiveState, ValueView
from app.wire.live_node import NodeView
from app.wire.memory import Reading, Stored, StoredState
from app.wire.nmt import NmtCommand, NmtState
from app.wire.records import Fault, MalformedSeen, Source, StateSeen, ValueSeen
from app.wire.sdo import Abort
from tests.wire import traffic
from tests.wire.traffic import BUS, Line, frame, frames

A, B = Address(0x3110, 1), Address(0x3110, 2)
SAVE, LOAD = Address(0x1010, 1), Address(0x1011, 1)
COMM = Address(0x1017)
MS = 1_000_000


class Bench:
    """A decoder and its live state; every conversation goes on where the last one ended."""

    def __init__(self, node: int = 1, description: Description | None = None) -> None:
        self.number = node
        self.decoder = CanOpenDecoder(BUS, {} if description is None else {node: description})
        self.live = LiveState()
        self.live.set_description(BUS, node, description)
        self.t_ns = 0

    def feed(self, items: Iterable[Frame]) -> None:
        for item in items:
            self.t_ns += MS
            self.live.apply_all(self.decoder.feed(item._replace(t_ns=self.t_ns)))

    def talk(self, *conversations: list[Line]) -> None:
        for lines in conversations:
            self.feed(frames(self.number, lines))

    def boot(self) -> None:
        self.feed([frame(0, 0x700 + self.number, b"\0")])

    def nmt(self, command: NmtCommand, node: int = 0) -> None:
        self.feed([frame(0, 0, bytes((command, node)))])

    def heartbeat(self, state: NmtState) -> None:
        self.feed([frame(0, 0x700 + self.number, bytes((state,)))])

    def value(self, address: Address) -> ValueView:
        found = self.live.value(BUS, self.number, address)
        assert found is not None
        return found

    def ram(self, address: Address) -> bytes | None:
        reading = self.value(address).reading
        return None if reading is None else reading.data

    def stored(self, address: Address) -> tuple[bytes, StoredState] | None:
        stored = self.value(address).stored
        return None if stored is None else (stored.data, stored.state)

    @property
    def node(self) -> NodeView:
        found = self.live.node(BUS, self.number)
        assert found is not None
        return found

    @property
    def kinds(self) -> list[EventKind]:
        return [event.kind for event in self.live.events()]


# -- values in RAM ---------------------------------------------------------------


def test_latest_value_with_time_and_source() -> None:
    bench = Bench()
    assert bench.live.value(BUS, 1, A) is None
    bench.talk(traffic.read(A, b"\xf4\1"))
    assert bench.value(A).reading == Reading(b"\xf4\1", 2 * MS, Source.SDO_READ)
    bench.talk(traffic.write(A, b"\xf5\1"))
    assert bench.value(A).reading == Reading(b"\xf5\1", 4 * MS, Source.SDO_WRITE)
    reading = bench.value(A).reading
    assert reading is not None and reading.age_ns(10 * MS) == 6 * MS


def test_boot_up_makes_ram_unknown_until_read_again() -> None:
    bench = Bench()
    bench.talk(traffic.read(A, b"\1"))
    bench.boot()
    assert bench.ram(A) is None
    bench.talk(traffic.read(A, b"\2"))
    assert bench.ram(A) == b"\2"


def test_save_command_is_no_value() -> None:
    bench = Bench()
    bench.talk(traffic.read(SAVE, b"\1\0\0\0"), traffic.write(SAVE, b"save"))
    assert bench.ram(SAVE) == b"\1\0\0\0"


@pytest.mark.parametrize("end", [[], [Line(True, sdo.abort(A, Abort.TIMED_OUT))]])
def test_write_without_an_end_makes_ram_unknown(end: list[Line]) -> None:
    bench = Bench()
    bench.talk(traffic.read(A, b"\1"), [Line(True, sdo.download_request(A, b"\2")), *end], traffic.read(B, b"\1"))
    assert bench.ram(A) is None


def test_refused_write_leaves_ram_as_it_was() -> None:
    bench = Bench()
    refused = [Line(True, sdo.download_request(A, b"\2")), Line(False, sdo.abort(A, Abort.READ_ONLY))]
    bench.talk(traffic.read(A, b"\1"), refused)
    assert bench.ram(A) == b"\1"
    assert bench.live.events()[-1].details["reason_key"] == "abort.read_only"
    assert bench.live.events()[-1].severity is Severity.WARNING


def test_gap_makes_values_stale_until_seen_again() -> None:
    bench = Bench()
    bench.talk(traffic.read(A, b"\1"), traffic.read(B, b"\1"))
    bench.live.apply_all(bench.decoder.gap(99 * MS, "gap.adapter"))
    assert bench.value(A).stale and bench.ram(A) == b"\1"
    bench.talk(traffic.read(A, b"\1"))
    assert not bench.value(A).stale and bench.value(B).stale
    assert EventKind.GAP in bench.kinds


def test_written_mirror_is_stale() -> None:
    """5084h shows 6084h in 16 bits."""
    bench = Bench(11, load_builtin("oat-pmc"))
    wide, narrow = Address(0x6084), Address(0x5084)
    bench.boot()
    bench.talk(traffic.read(wide, b"\1\0\0\0"), traffic.write(narrow, b"\2\0"))
    assert bench.value(wide).stale
    bench.talk(traffic.read(wide, b"\2\0\0\0"))
    assert not bench.value(wide).stale
    assert bench.stored(wide) == (b"\1\0\0\0", StoredState.PROVEN)


# -- the stored place ------------------------------------------------------------


def test_nothing_is_stored_for_sure_before_a_boot_up_was_seen() -> None:
    bench = Bench()
    bench.talk(traffic.read(A, b"\1"))
    assert bench.stored(A) is None


def test_value_read_after_a_boot_up_is_stored_and_proven() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.read(A, b"\1"))
    assert bench.value(A).stored == Stored(b"\1", 3 * MS, StoredState.PROVEN)
    bench.talk(traffic.write(A, b"\2"), traffic.read(A, b"\2"))
    assert bench.stored(A) == (b"\1", StoredState.PROVEN)


def test_value_read_after_a_write_proves_nothing() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.write(A, b"\2"), traffic.read(A, b"\2"))
    assert bench.stored(A) is None


def test_possible_write_proves_nothing_either() -> None:
    bench = Bench()
    bench.boot()
    bench.talk([Line(True, sdo.download_request(A, b"\2"))], traffic.read(A, b"\2"))
    assert bench.stored(A) is None


def test_saved_then_proven_by_a_restart() -> None:
    bench = Bench()
    bench.talk(traffic.write(A, b"\2"), traffic.write(SAVE, b"save"))
    assert bench.stored(A) == (b"\2", StoredState.SAVED)
    bench.talk(traffic.write(A, b"\3"))
    assert bench.stored(A) == (b"\2", StoredState.SAVED)
    bench.boot()
    assert bench.stored(A) == (b"\2", StoredState.SAVED) and bench.ram(A) is None
    bench.talk(traffic.read(A, b"\2"))
    assert bench.stored(A) == (b"\2", StoredState.PROVEN)
    assert EventKind.STORED_DIFFERS not in bench.kinds


def test_save_that_did_not_last_is_told() -> None:
    bench = Bench()
    bench.talk(traffic.write(A, b"\2"), traffic.write(SAVE, b"save"))
    bench.boot()
    bench.talk(traffic.read(A, b"\1"))
    assert bench.stored(A) == (b"\1", StoredState.PROVEN)
    assert EventKind.STORED_DIFFERS in bench.kinds


def test_saved_without_knowing_ram_is_unknown_until_read() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.read(A, b"\1"), [Line(True, sdo.download_request(A, b"\2"))], traffic.write(SAVE, b"save"))
    assert bench.stored(A) is None
    bench.talk(traffic.read(A, b"\2"))
    assert bench.stored(A) == (b"\2", StoredState.SAVED)


def test_read_after_save_and_write_says_nothing_new() -> None:
    bench = Bench()
    bench.talk(traffic.write(SAVE, b"save"), traffic.write(A, b"\2"), traffic.read(A, b"\2"))
    assert bench.stored(A) is None


def test_proven_value_is_unknown_after_the_next_boot_up() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.read(A, b"\1"))
    bench.boot()
    assert bench.stored(A) is None


@pytest.mark.parametrize("code", [Abort.DEVICE_STATE, Abort.HARDWARE])
def test_refused_save_keeps_what_is_stored_unless_the_hardware_failed(code: Abort) -> None:
    bench = Bench()
    bench.boot()
    refused = [Line(True, sdo.download_request(SAVE, b"save")), Line(False, sdo.abort(SAVE, code))]
    bench.talk(traffic.read(A, b"\1"), refused)
    assert bench.stored(A) == (None if code is Abort.HARDWARE else (b"\1", StoredState.PROVEN))
    assert EventKind.SAVE_FAILED in bench.kinds


def test_save_without_an_end_makes_stored_unknown() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.read(A, b"\1"), [Line(True, sdo.download_request(SAVE, b"save"))], traffic.read(A, b"\1"))
    assert bench.stored(A) is None


def test_load_makes_stored_unknown_until_the_next_boot_up() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.read(A, b"\1"), traffic.write(LOAD, b"load"), traffic.read(B, b"\1"))
    assert bench.stored(A) is None and bench.stored(B) is None
    bench.boot()
    bench.talk(traffic.read(A, b"\0"))
    assert bench.stored(A) == (b"\0", StoredState.PROVEN)


def test_gap_takes_the_proof_away_from_later_reads() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.read(A, b"\1"))
    bench.live.apply_all(bench.decoder.gap(99 * MS, "gap.adapter"))
    bench.talk(traffic.read(B, b"\1"))
    assert bench.stored(A) == (b"\1", StoredState.PROVEN) and bench.stored(B) is None


def test_reset_communication_proves_communication_objects_only() -> None:
    bench = Bench()
    bench.boot()
    bench.talk(traffic.write(A, b"\2"), traffic.write(COMM, b"\2\0"))
    bench.nmt(NmtCommand.RESET_COMMUNICATION, 1)
    bench.boot()
    bench.talk(traffic.read(A, b"\2"), traffic.read(COMM, b"\1\0"))
    assert bench.stored(A) is None
    assert bench.stored(COMM) == (b"\1\0", StoredState.PROVEN)
    bench.nmt(NmtCommand.RESET_NODE, 1)
    bench.boot()
    bench.talk(traffic.read(A, b"\1"))
    assert bench.stored(A) == (b"\1", StoredState.PROVEN)


def test_restart_by_itself_after_a_reset_of_the_communication_proves_all() -> None:
    bench = Bench()
    bench.nmt(NmtCommand.RESET_COMMUNICATION, 1)
    bench.talk(traffic.read(A, b"\1"))
    bench.nmt(NmtCommand.RESET_COMMUNICATION, 1)
    bench.boot()
    bench.boot()
    bench.talk(traffic.read(A, b"\1"))
    assert bench.stored(A) == (b"\1", StoredState.PROVEN)


def test_save_covers_what_the_description_says() -> None:
    """The PMC saves by 1010h sub 3; 6065h is saved, the controlword is not."""
    bench = Bench(11, load_builtin("oat-pmc"))
    window, control = Address(0x6065), Address(0x6040)
    bench.boot()
    bench.talk(traffic.read(control, b"\0\0"), traffic.write(window, b"\1\0\0\0"))
    bench.talk(traffic.write(Address(0x1010, 3), b"save"))
    assert bench.stored(window) == (b"\1\0\0\0", StoredState.SAVED)
    assert bench.stored(control) is None


# -- nodes and events --------------------------------------------------------------


def test_node_table() -> None:
    bench = Bench(11)
    assert bench.live.nodes() == []
    bench.boot()
    assert (bench.node.state, bench.node.boots, bench.node.boot_ns) == (NmtState.PRE_OPERATIONAL, 1, MS)
    bench.nmt(NmtCommand.START)
    assert (bench.node.state, bench.node.commanded) == (NmtState.OPERATIONAL, True)
    bench.heartbeat(NmtState.OPERATIONAL)
    assert (bench.node.state, bench.node.commanded, bench.node.heartbeat_ns) == (NmtState.OPERATIONAL, False, 3 * MS)
    bench.talk(traffic.read(COMM, (500).to_bytes(2, "little")))
    assert bench.node.period_ns == 500 * MS
    assert bench.node.other_client_ns == 5 * MS
    assert bench.kinds == [EventKind.BOOT_UP, EventKind.NMT_COMMAND, EventKind.STATE_CHANGED]


def test_absent_nodes_of_a_scan_are_not_in_the_table() -> None:
    bench = Bench()
    for number in range(1, 128):
        bench.feed([frame(0, 0x600 + number, sdo.upload_request(Address(0x1000)))])
        bench.feed([frame(0, 0x600 + number, sdo.abort(Address(0x1000), Abort.TIMED_OUT))])
    assert bench.live.nodes() == [] and bench.live.events() == ()


def test_silent_node_is_found_and_comes_back() -> None:
    bench = Bench()
    bench.talk(traffic.read(COMM, (100).to_bytes(2, "little")))
    bench.heartbeat(NmtState.OPERATIONAL)
    silent = []
    for later_ms in (249, 251, 300):
        bench.live.tick(bench.t_ns + later_ms * MS)
        silent.append(bench.node.silent)
    bench.heartbeat(NmtState.OPERATIONAL)
    assert [*silent, bench.node.silent] == [False, True, True, False]
    assert [k for k in bench.kinds if k is not EventKind.STATE_CHANGED] == [
        EventKind.HEARTBEAT_LOST,
        EventKind.HEARTBEAT_BACK,
    ]


def test_period_is_measured_where_1017h_was_not_seen() -> None:
    """Two intervals at least; one heartbeat out of turn does not make a node look silent."""
    live = LiveState()
    for t_ms in (0, 2, 1002, 2002):
        live.apply(StateSeen(t_ms * MS, BUS, 1, NmtState.OPERATIONAL))
    view = live.node(BUS, 1)
    assert view is not None and view.period_ns == 1000 * MS
    silent = []
    for t_ms in (3500, 3700):
        live.tick(t_ms * MS)
        silent.append([node.silent for node in live.nodes()])
    assert silent == [[False], [True]]


def test_emcy_in_the_words_of_the_device() -> None:
    description = load_builtin("oat-pmc")
    bench = Bench(11, description)
    bench.feed([frame(0, 0x08B, bytes.fromhex("1186210000000000")), frame(0, 0x08B, bytes(8))])
    fault, reset = bench.live.events()
    assert (fault.kind, fault.severity) == (EventKind.EMCY, Severity.ERROR)
    assert fault.details["reason_key"] == description.errors[0x8611].text_key
    assert (reset.kind, reset.details["code"]) == (EventKind.EMCY_RESET, 0)
    assert bench.node.emcy_code == 0 and bench.ram(Address(0x1001)) == b"\0"


def test_noise_is_folded_and_events_are_bounded() -> None:
    live = LiveState(max_events=10)
    live.apply_all(MalformedSeen(i, BUS, 1, 0x701, Fault.STATE, b"\3") for i in range(1000))
    (event,) = live.events()
    assert event.repeats == 999
    for i in range(100):
        live.apply(StateSeen(i, BUS, 1, (NmtState.STOPPED, NmtState.OPERATIONAL)[i % 2]))
    assert len(live.events()) == 10


def test_late_acknowledge_is_told() -> None:
    bench = Bench()
    bench.boot()
    bench.talk([Line(False, sdo.download_response(A))])
    assert bench.live.events()[-1].kind is EventKind.ORPHAN
    assert bench.live.events()[-1].details["address"] == "3110:01"


# -- versions, keyframes, threads ----------------------------------------------------


def test_changes_since_a_version() -> None:
    bench = Bench()
    first = bench.live.changes_since(0)
    assert first.full and first.values == ()
    bench.talk(traffic.read(A, b"\1"), traffic.read(B, b"\1"))
    second = bench.live.changes_since(bench.live.changes_since(0).version)
    assert second.values == () and not second.full
    bench.talk(traffic.read(A, b"\2"), traffic.read(A, b"\3"))
    third = bench.live.changes_since(second.version)
    assert [(v.address, v.reading and v.reading.data) for v in third.values] == [(A, b"\3")]
    assert bench.live.changes_since(third.version + 5).full


def _random_talk(bench: Bench, rng: random.Random) -> None:
    address = Address(0x2000 + rng.randrange(4))
    data = bytes((rng.randrange(3),))
    choice = rng.randrange(9)
    if choice == 0:
        bench.boot()
    elif choice == 1:
        bench.talk(traffic.write(SAVE, b"save"))
    elif choice == 2:
        bench.talk([Line(True, sdo.download_request(address, data))])
    elif choice == 3:
        bench.live.apply_all(bench.decoder.gap(bench.t_ns, "gap.adapter"))
    elif choice in (4, 5):
        bench.talk(traffic.write(address, data))
    else:
        bench.talk(traffic.read(address, data))


@given(st.randoms(use_true_random=False))
@settings(max_examples=60, deadline=None)
def test_deltas_and_keyframes_show_the_same_as_the_state(rng: random.Random) -> None:
    """A reader that only ever takes deltas, and a state restored from JSON, end up like the one that saw it all."""
    bench, reader, version = Bench(), dict[Address, ValueView](), 0
    for step in range(60):
        _random_talk(bench, rng)
        if rng.random() < 0.3 or step == 59:
            changes = bench.live.changes_since(version)
            reader = {} if changes.full else reader
            reader |= {value.address: value for value in changes.values}
            version = changes.version
        if rng.random() < 0.05:
            bench.live.restore(json.loads(json.dumps(bench.live.snapshot())))
    changes = bench.live.changes_since(version)
    reader = {} if changes.full else reader
    reader |= {value.address: value for value in changes.values}
    assert reader == bench.live.values(BUS, 1)


@given(st.randoms(use_true_random=False))
@settings(max_examples=60, deadline=None)
def test_restored_state_goes_on_as_the_original(rng: random.Random) -> None:
    bench, other = Bench(), LiveState()
    for _ in range(20):
        _random_talk(bench, rng)
    other.restore(json.loads(json.dumps(bench.live.snapshot())))
    for live in (bench.live, other):
        live.apply(ValueSeen(10**9, BUS, 1, Address(0x2000), b"\7", Source.SDO_READ))
    plain = [{a: v._replace(version=0) for a, v in live.values(BUS, 1).items()} for live in (bench.live, other)]
    assert plain[0] == plain[1]
    assert [e.kind for e in bench.live.events()] == [e.kind for e in other.events()]


def test_restore_refuses_another_format_and_changes_nothing() -> None:
    bench = Bench()
    bench.talk(traffic.read(A, b"\1"))
    for bad in ({"snapshot": 99}, {**bench.live.snapshot(), "nodes": [{"bus": BUS}]}):
        with pytest.raises((ValueError, KeyError)):
            bench.live.restore(bad)
    assert bench.ram(A) == b"\1"


def test_restore_keeps_descriptions() -> None:
    bench = Bench(11, load_builtin("oat-pmc"))
    bench.live.restore(bench.live.snapshot())
    bench.boot()
    bench.talk(traffic.read(Address(0x6040), b"\0\0"))
    assert bench.stored(Address(0x6040)) is None


def test_own_transfers_are_not_those_of_another_client() -> None:
    bench = Bench()
    ask, answer = frames(1, traffic.read(A, b"\1"))
    bench.feed([ask._replace(direction=Direction.TX), answer])
    assert bench.node.other_client_ns is None


def test_readers_in_other_threads_never_see_half_a_change() -> None:
    """One thread writes the same byte into two objects under one lock; readers must never see them differ."""
    live, torn, done = LiveState(), list[object](), False

    def read() -> None:
        version = 0
        while not done:
            changes = live.changes_since(version)
            version = changes.version
            values = {v.address: v.reading.data for v in live.changes_since(0).values if v.reading}
            if len(values) == 2 and values[A] != values[B]:
                torn.append(values)

    readers = [Thread(target=read) for _ in range(2)]
    for thread in readers:
        thread.start()
    for i in range(3000):
        data = bytes((i & 0xFF,))
        live.apply_all(ValueSeen(i, BUS, 1, address, data, Source.PDO_TX) for address in (A, B))
    done = True
    for thread in readers:
        thread.join(10)
    assert not torn and not any(thread.is_alive() for thread in readers)
