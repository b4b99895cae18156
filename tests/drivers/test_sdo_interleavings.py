"""Whatever is late or lost, in whatever order: what the client says of a write is what happened to it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, repeat

from hypothesis import example, given, settings
from hypothesis import strategies as st

from app.drivers.contract import Written
from app.drivers.sdo_client import DEFAULT_TIMEOUT_NS, Job
from app.drivers.sdo_jobs import read_steps, write_steps
from app.errors import HubsideError, NoAnswerError, SdoAbortError, UnverifiedError
from app.model.address import Address
from app.model.description import Verify
from app.twins.line import Fault, drop
from app.twins.object_store import RefusedAccessError
from app.wire import sdo
from app.wire.frame import Can
from tests.drivers.rig import MS, NAME, Outcome, Rig, S, u32

OBJECTS = tuple(Address(0x1016, sub) for sub in (1, 2, 3))


@dataclass(frozen=True)
class Op:
    """A request of the client, ``gap_ms`` after the one before."""

    object: int
    writes: bool
    refused: bool
    urgent: bool
    gap_ms: int


ops = st.builds(
    Op,
    object=st.integers(0, 2),
    writes=st.booleans(),
    refused=st.booleans(),
    urgent=st.sampled_from([False, False, False, True]),
    gap_ms=st.sampled_from([0, 1, 250, 600, 2000]),
)
delays_ms = st.lists(st.sampled_from([1, 1, 1, 30, 300, 498, 499, 500, 501, 620, 1300, 2600]), max_size=40)


class Story:
    """Runs the operations, and remembers what the device did."""

    def __init__(self, delays: list[int], lost: set[int]) -> None:
        self.rig = Rig()
        late: Iterator[int] = chain((ms * MS for ms in delays), repeat(MS))
        self.device = self.rig.node(11, late)
        self.executed: list[int] = []
        self.refused: list[int] = []
        self.outcomes: list[tuple[Op, int, Outcome, dict[Address, bytes | HubsideError]]] = []
        for address in OBJECTS:
            cell = self.device.store.at(address)
            cell.guard, cell.effect = self._guard, self._effect
        self._frames = 0
        self._lost = lost
        self.rig.line.inject(Fault(self._is_lost, drop, times=None))

    def _guard(self, raw: object) -> None:
        assert isinstance(raw, int)
        if raw & 1:
            self.refused.append(raw)
            raise RefusedAccessError(sdo.Abort.DEVICE_STATE)

    def _effect(self, raw: object) -> None:
        assert isinstance(raw, int)
        self.executed.append(raw)

    def _is_lost(self, _can: Can) -> bool:
        self._frames += 1
        return self._frames in self._lost

    def submit(self, number: int, op: Op) -> None:
        """Every write has a value of its own; the device refuses odd ones."""
        self.rig.run(op.gap_ms * MS)
        address, outcome = OBJECTS[op.object], Outcome()
        value = 2 * (number + 1) + op.refused
        results: dict[Address, bytes | HubsideError] = {}
        counters = self.rig.client.counters
        if op.writes:
            writing = write_steps(
                11, address, u32(value), DEFAULT_TIMEOUT_NS, DEFAULT_TIMEOUT_NS, Verify.EQUAL, counters
            )
            self.rig.client.submit(11, Job(writing, outcome, urgent=op.urgent))
        else:
            reading = read_steps(11, {address: DEFAULT_TIMEOUT_NS}, results, counters)
            self.rig.client.submit(11, Job(reading, outcome))
        self.outcomes.append((op, value, outcome, results))

    def finish(self) -> None:
        self.rig.run_until(lambda: all(outcome.done for _, _, outcome, _ in self.outcomes), limit_ns=300 * S)
        self.rig.run(30 * S)


def tell(delays: list[int], lost: set[int], operations: list[Op]) -> Story:
    story = Story(delays, lost)
    for number, op in enumerate(operations):
        story.submit(number, op)
    story.finish()
    return story


def plain(object_number: int, writes: bool = False) -> Op:
    return Op(object_number, writes, refused=False, urgent=False, gap_ms=0)


@example(
    delays=[1, 1300, 2600, 1, 1, 1, 499, 2600],
    lost=set(),
    operations=[plain(0), plain(0), plain(1), plain(0), plain(2), plain(0, writes=True)],
)
@settings(max_examples=150, deadline=None)
@given(delays_ms, st.sets(st.integers(1, 40), max_size=5), st.lists(ops, min_size=1, max_size=8))
def test_what_is_said_of_a_write_is_what_happened(delays: list[int], lost: set[int], operations: list[Op]) -> None:
    story = tell(delays, lost, operations)
    urgent_used = any(op.urgent and op.writes for op in operations)
    for op, value, outcome, results in story.outcomes:
        assert outcome.calls == 1
        if op.writes:
            check_write(story, value, outcome, sure=not urgent_used)
        else:
            check_read(results[OBJECTS[op.object]])
    assert len(set(story.executed)) == len(story.executed), "no write is repeated"


def check_write(story: Story, value: int, outcome: Outcome, sure: bool) -> None:
    if outcome.result is not None:
        assert outcome.result in (Written.ACKNOWLEDGED, Written.READ_BACK)
        assert value in story.executed
    elif isinstance(outcome.error, SdoAbortError):
        assert value in story.refused
    else:
        assert isinstance(outcome.error, NoAnswerError | UnverifiedError)
        differs = "unverified.other_value"
        if isinstance(outcome.error, UnverifiedError) and outcome.error.details["reason_key"] == differs and sure:
            assert value not in story.executed


def check_read(result: bytes | HubsideError) -> None:
    if isinstance(result, bytes):
        assert len(result) == 4
    else:
        assert isinstance(result, NoAnswerError)


likely_answers = st.builds(
    lambda head, address, rest: bytes([head]) + sdo.upload_request(address)[1:4] + rest,
    st.integers(0, 255),
    st.sampled_from([*OBJECTS, NAME, Address(0x1000)]),
    st.binary(min_size=4, max_size=4),
)
strays_of_a_node = st.lists(st.tuples(likely_answers | st.binary(max_size=8), st.integers(0, 1900)), max_size=30)


@settings(max_examples=60, deadline=None)
@given(strays_of_a_node)
def test_stray_frames_bring_no_job_down(strays: list[tuple[bytes, int]]) -> None:
    """Whatever else is sent with the node's answer identifier, every job ends, once."""
    rig = Rig()
    rig.node(delays_ns=chain([600 * MS, 2 * MS, 600 * MS], repeat(MS)))
    other = rig.line.attach(lambda _can, _t_ns: None, ())
    for data, at_ms in strays:
        other.send(Can(0x58B, data), at_ms * MS)
    outcomes = [Outcome() for _ in range(4)]
    counters = rig.client.counters
    for number, outcome in enumerate(outcomes[:2]):
        steps = write_steps(11, OBJECTS[0], u32(number), DEFAULT_TIMEOUT_NS, DEFAULT_TIMEOUT_NS, Verify.EQUAL, counters)
        rig.client.submit(11, Job(steps, outcome))
    for outcome in outcomes[2:]:
        timeouts = dict.fromkeys((*OBJECTS, NAME), DEFAULT_TIMEOUT_NS)
        rig.client.submit(11, Job(read_steps(11, timeouts, {}, counters), outcome, bulk=True))
    rig.run_until(lambda: all(outcome.done for outcome in outcomes))
    rig.run(S)
    assert [outcome.calls for outcome in outcomes] == [1, 1, 1, 1]
    assert not any(isinstance(outcome.error, ValueError | KeyError | AttributeError) for outcome in outcomes)
