"""The scope itself, by properties: what is caught is exactly what was fed, around exactly the value that fired."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from app.service.scope.engine import SETTLE_NS, Caught, Cause, Channel, Ended, Engine, Mode, Phase, Timing
from app.service.scope.trigger import (
    Change,
    Edge,
    Event,
    Fault,
    Happened,
    Level,
    Manual,
    Side,
    Slope,
    StateChange,
    Trigger,
    What,
)
from app.wire.nmt import NmtState

MS = 1_000_000
S = 1_000_000_000
SINGLE = Timing(total_ns=100 * MS, pre_ns=40 * MS, mode=Mode.SINGLE, hold_off_ns=0, auto_ns=S)
NORMAL = replace(SINGLE, mode=Mode.NORMAL)
WHOLE = (Channel(0, None, "q"),)
BUSES = ("can0", "can0")

Fed = list[tuple[int, int]]


@st.composite
def courses(draw: st.DrawFn) -> Fed:
    """Times that rise, and small numbers."""
    steps = draw(st.lists(st.tuples(st.integers(1, 30 * MS), st.integers(-5, 5)), min_size=1, max_size=120))
    t_ns, fed = 0, []
    for dt_ns, number in steps:
        t_ns += dt_ns
        fed.append((t_ns, number))
    return fed


def run(
    fed: Fed, trigger: Trigger, timing: Timing, max_samples: int = 1_000_000, ticks: bool = True
) -> tuple[Engine, list[Caught]]:
    """Feed all, the clock going with it, and let the clock go on until nothing is under way."""
    engine, caught = Engine(WHOLE, trigger, timing, 0, BUSES, max_samples=max_samples), []
    for t_ns, number in fed:
        engine.value(0, t_ns, number, True)
        if ticks:
            caught += engine.advance(t_ns)
    end_ns = fed[-1][0] + timing.total_ns + SETTLE_NS
    return engine, caught + engine.advance(end_ns)


def within(fed: Fed, one: Caught) -> Fed:
    return [(t, n) for t, n in fed if one.window.start_ns <= t <= one.window.end_ns]


def seen(one: Caught, channel: int = 0) -> Fed:
    stretch = one.stretches[channel]
    return list(zip(stretch.t_ns.tolist(), stretch.raw.tolist(), strict=True))


def phase_of(engine: Engine) -> Phase:
    return engine.phase


def edges(fed: Fed, level: float, slope: Slope) -> list[int]:
    found = []
    for (_, before), (t_ns, now) in pairwise(fed):
        rose, fell = before < level <= now, before > level >= now
        if (rose and slope is not Slope.FALLING) or (fell and slope is not Slope.RISING):
            found.append(t_ns)
    return found


def expected(fires: list[int], timing: Timing) -> list[int]:
    """When captures begin, by the words of the rules: after each its end and the hold-off must have passed."""
    begun: list[int] = []
    ready = 0
    for t_ns in fires:
        if t_ns >= ready and (timing.mode is not Mode.SINGLE or not begun):
            begun.append(t_ns)
            ready = t_ns - timing.pre_ns + timing.total_ns + timing.hold_off_ns + 1
    return begun


@given(courses(), st.sampled_from([-2, 0, 0.5, 3]), st.sampled_from(Slope), st.integers(0, 100), st.booleans())
@settings(max_examples=300)
def test_an_edge_fires_at_its_value_and_nothing_is_lost_or_doubled(
    fed: Fed, level: float, slope: Slope, pre_ms: int, ticks: bool
) -> None:
    timing = replace(SINGLE, pre_ns=pre_ms * MS)
    _, caught = run(fed, Edge(0, None, level, slope), timing, ticks=ticks)
    assert [one.window.trigger_ns for one in caught] == expected(edges(fed, level, slope), timing)
    for one in caught:
        assert seen(one) == within(fed, one)
        assert one.window.start_ns == one.window.trigger_ns - timing.pre_ns
        assert one.window.end_ns - one.window.start_ns == timing.total_ns
        assert (one.window.ended, one.window.cause) == (Ended.COMPLETE, Cause.TRIGGER)


@given(courses(), st.sampled_from([-2, 0, 3]), st.integers(0, 80), st.booleans())
@settings(max_examples=300)
def test_it_re_arms_after_each_end_and_its_hold_off(fed: Fed, level: float, hold_off_ms: int, ticks: bool) -> None:
    timing = replace(NORMAL, hold_off_ns=hold_off_ms * MS)
    _, caught = run(fed, Edge(0, None, level, Slope.EITHER), timing, ticks=ticks)
    assert [one.window.trigger_ns for one in caught] == expected(edges(fed, level, Slope.EITHER), timing)
    for one in caught:
        assert seen(one) == within(fed, one)


@given(courses(), st.sampled_from(Side), st.integers(-5, 5))
def test_a_level_fires_at_the_first_value_on_its_side(fed: Fed, side: Side, level: int) -> None:
    fires = [t for t, n in fed if (n > level if side is Side.ABOVE else n < level)]
    for timing in (SINGLE, NORMAL):
        _, caught = run(fed, Level(0, None, level, side), timing)
        assert [one.window.trigger_ns for one in caught] == expected(fires, timing)


def test_an_edge_needs_a_value_before_it_and_a_level_does_not() -> None:
    fed = [(MS, 5), (2 * MS, 5)]
    assert run(fed, Edge(0, None, 3, Slope.RISING), SINGLE)[1] == []
    assert [one.window.trigger_ns for one in run(fed, Level(0, None, 3, Side.ABOVE), SINGLE)[1]] == [MS]


def test_a_gap_takes_what_was_before_an_edge_and_marks_the_capture() -> None:
    engine = Engine(WHOLE, Edge(0, None, 3, Slope.RISING), SINGLE, 0, BUSES)
    engine.value(0, MS, 0, True)
    engine.gap(2 * MS, "can0", "gap.reason")
    engine.value(0, 3 * MS, 5, True)
    assert engine.window is None
    engine.value(0, 4 * MS, 0, True)
    engine.value(0, 5 * MS, 5, True)
    (one,) = engine.advance(S)
    assert one.window.trigger_ns == 5 * MS
    assert [(mark.what, mark.t_ns, mark.bus) for mark in one.marks] == [("gap", 2 * MS, "can0")]


def test_a_gap_of_another_bus_takes_nothing() -> None:
    """What was seen on this bus still tells an edge, a state and a fault: the loss is not its own."""
    for lost, fired in (("can1", 4 * MS), ("can0", None)):
        engine = Engine(WHOLE, Edge(0, None, 3, Slope.RISING), SINGLE, 0, ("can0", "can1"))
        engine.value(0, MS, 0, True)
        engine.gap(2 * MS, lost, "gap.reason")
        engine.value(0, 4 * MS, 5, True)
        assert (engine.window and engine.window.trigger_ns) == fired
    words = (0x0027, 0x0008)
    for trigger in (Fault(frozenset({0, 1}), None, None), StateChange(frozenset({0, 1}))):
        trigger.value(0, words[0])
        trigger.value(1, words[0])
        trigger.forget("can1", (1,))
        assert [trigger.value(0, words[1]), trigger.value(1, words[1])] == [True, False]
    event = Event(What.NMT, None)
    event.happened(nmt(1, NmtState.OPERATIONAL))
    event.forget("can1", ())
    assert event.happened(nmt(2, NmtState.STOPPED))


def test_what_comes_after_its_capture_was_taken_out_is_counted() -> None:
    engine = Engine(WHOLE, Level(0, None, 3, Side.ABOVE), SINGLE, 0, BUSES)
    engine.value(0, 50 * MS, 5, True)
    (one,) = engine.advance(S)
    engine.value(0, one.window.end_ns, 5, True)
    engine.value(0, one.window.end_ns + 1, 5, True)
    assert engine.late == 1


def test_a_pre_trigger_shorter_than_wanted_says_so() -> None:
    engine = Engine(WHOLE, Level(0, None, 3, Side.ABOVE), SINGLE, 10 * MS, BUSES)
    engine.value(0, 15 * MS, 5, True)
    (one,) = engine.advance(S)
    assert (one.window.start_ns, one.window.known_ns) == (-25 * MS, 10 * MS)


@given(courses(), st.integers(4, 40))
def test_memory_is_bounded_and_a_capture_that_ran_out_says_so(fed: Fed, most: int) -> None:
    timing = Timing(total_ns=10 * S, pre_ns=S, mode=Mode.SINGLE, hold_off_ns=0, auto_ns=S)
    engine, caught = run(fed, Level(0, None, 2, Side.ABOVE), timing, max_samples=most)
    for one in caught:
        told = [pair for pair in within(fed, one) if pair[0] >= one.window.known_ns]
        assert seen(one)[-len(told) :] == told
        if one.window.ended is Ended.COMPLETE:
            assert len(seen(one)) <= most + 1
        else:
            assert one.window.ended is Ended.MEMORY
            assert one.window.end_ns < one.window.start_ns + timing.total_ns
    assert engine._held <= 2 * most + 2


def test_by_hand_and_stopping_early() -> None:
    engine = Engine(WHOLE, Manual(), NORMAL, 0, BUSES)
    for at in range(1, 30):
        engine.value(0, at * MS, at, True)
    assert engine.advance(29 * MS) == []
    assert engine.trigger_now(29 * MS)
    assert not engine.trigger_now(30 * MS), "one is under way"
    engine.value(0, 40 * MS, 40, True)
    assert phase_of(engine) is Phase.CAPTURING
    (one,) = engine.stop(45 * MS)
    assert (one.window.ended, one.window.cause, one.window.end_ns) == (Ended.STOPPED, Cause.MANUAL, 45 * MS)
    assert [n for _, n in seen(one)] == [*range(1, 30), 40]
    assert phase_of(engine) is Phase.DONE
    assert not engine.trigger_now(50 * MS)


def test_auto_begins_by_itself_where_no_trigger_comes() -> None:
    engine = Engine(WHOLE, Edge(0, None, 3, Slope.RISING), replace(SINGLE, mode=Mode.AUTO, auto_ns=S), 0, BUSES)
    caught = []
    for at in range(0, 4000, 10):
        engine.value(0, at * MS, 5 if at >= 2000 else 0, True)
        caught += engine.advance(at * MS)
    causes = [(one.window.cause, one.window.trigger_ns) for one in caught]
    assert causes[0] == (Cause.AUTO, S)
    assert (Cause.TRIGGER, 2 * S) in causes
    assert causes[2] == (Cause.AUTO, 2 * S - SINGLE.pre_ns + SINGLE.total_ns + 1 + S)


def test_a_late_value_of_another_bus_is_in_the_capture() -> None:
    engine = Engine((Channel(0, None, "q"), Channel(1, None, "q")), Level(0, None, 3, Side.ABOVE), SINGLE, 0, BUSES)
    engine.value(0, 50 * MS, 5, True)
    engine.value(1, 45 * MS, 7, False)  # handed over after the trigger, seen before it
    (one,) = engine.advance(S)
    assert seen(one, 1) == [(45 * MS, 7)]
    assert [stretch.by_pdo for stretch in one.stretches] == [1, 0]


def test_a_bit_of_a_word_is_a_signal_of_its_own() -> None:
    channels = (Channel(0, None, "q"), Channel(0, 3, "B"))
    engine = Engine(channels, Change(0, 3), SINGLE, 0, BUSES)
    for at, word in enumerate((0x21, 0x08, 0x0F, 0x21), 1):
        engine.value(0, at * MS, word, True)
    (one,) = engine.advance(S)
    assert one.window.trigger_ns == 2 * MS
    assert [n for _, n in seen(one, 1)] == [0, 1, 1, 0]


def test_an_unsigned_number_of_64_bits_is_kept_exactly() -> None:
    engine = Engine((Channel(0, None, "Q"),), Manual(), SINGLE, 0, BUSES)
    engine.value(0, MS, 2**64 - 1, True)
    engine.trigger_now(2 * MS)
    (one,) = engine.advance(S)
    assert seen(one) == [(MS, 2**64 - 1)]


# -- events --------------------------------------------------------------------------


def fires(trigger: Trigger, *events: Happened) -> list[int]:
    return [one.t_ns for one in events if trigger.happened(one)]


def emcy(t_ns: int, code: int, node: int = 11) -> Happened:
    return Happened(t_ns, What.EMCY, "can0", node, code=code)


def nmt(t_ns: int, state: NmtState, node: int = 11) -> Happened:
    return Happened(t_ns, What.NMT, "can0", node, state=state)


def boot(t_ns: int, node: int = 11) -> Happened:
    return Happened(t_ns, What.BOOT_UP, "can0", node)


def test_a_fault_fires_on_a_code_and_on_the_state() -> None:
    own = frozenset({("can0", 11)})
    assert fires(Fault(frozenset(), own, None), emcy(1, 0), emcy(2, 0x8611, 12), emcy(3, 0x8611)) == [3]
    assert fires(Fault(frozenset(), None, 0x8611), emcy(1, 0x3120), emcy(2, 0x8611)) == [2]
    trigger = Fault(frozenset({0}), own, None)
    words = [0x0008, 0x0021, 0x0027, 0x000F, 0x0008, 0x0027]
    assert [trigger.value(0, word) for word in words] == [False, False, False, True, False, False]
    with_code = Fault(frozenset({0}), own, 0x8611)
    assert not any(with_code.value(0, word) for word in words), "only the message brings the code"


def test_events_fire_on_what_is_waited_for_alone() -> None:
    pre, operational = NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL
    course = (nmt(1, pre), emcy(2, 0x3120), nmt(3, pre), nmt(4, operational), boot(5), nmt(6, pre), nmt(7, pre, 12))
    assert fires(Event(What.NMT, None), *course) == [4, 5]
    assert fires(Event(What.BOOT_UP, None), *course) == [5]
    assert fires(Event(What.EMCY, None), *course) == [2]
    assert fires(Event(What.EMCY, frozenset({("can0", 12)})), *course) == []


def test_the_state_of_an_axis_changes_by_state_and_not_by_word() -> None:
    trigger = StateChange(frozenset({0}))
    assert [trigger.value(0, word) for word in (0x0027, 0x0427, 0x0023, 0x0023)] == [False, False, True, False]


def test_only_changes_of_the_nmt_state_are_marked() -> None:
    engine = Engine(WHOLE, Event(What.NMT, None), SINGLE, 0, BUSES)
    for at in range(1, 20):
        engine.happened(nmt(at * MS, NmtState.OPERATIONAL))
    assert engine.window is None
    engine.happened(nmt(20 * MS, NmtState.STOPPED))
    (one,) = engine.advance(S)
    assert [(mark.t_ns, mark.detail) for mark in one.marks] == [(20 * MS, NmtState.STOPPED.text_key)]
