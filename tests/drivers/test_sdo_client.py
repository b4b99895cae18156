"""The strict SDO client against devices on a simulated line: late, lost, refused and interrupted answers."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.drivers.contract import Written
from app.drivers.sdo_client import DEFAULT_TIMEOUT_NS, Job
from app.drivers.sdo_jobs import read_steps, write_steps
from app.errors import BusLostError, HubsideError, NoAnswerError, OvertakenError, SdoAbortError, UnverifiedError
from app.model.address import Address
from app.model.description import Verify
from app.twins.line import Fault, delay, drop, duplicate
from app.twins.object_store import RefusedAccessError
from app.wire import sdo
from app.wire.frame import Can
from tests.drivers.rig import MS, NAME, POSITION, TIMEOUT_6066, WINDOW, Outcome, Rig, S, ServedNode, u16, u32

RESULTS = dict[Address, bytes | HubsideError]


def write(
    rig: Rig,
    address: Address,
    data: bytes,
    node: int = 11,
    verify: Verify = Verify.EQUAL,
    urgent: bool = False,
    timeout_ns: int = DEFAULT_TIMEOUT_NS,
) -> Outcome:
    outcome = Outcome()
    steps = write_steps(node, address, data, timeout_ns, DEFAULT_TIMEOUT_NS, verify, rig.client.counters)
    rig.client.submit(node, Job(steps, outcome, urgent=urgent))
    return outcome


def read(rig: Rig, *addresses: Address, node: int = 11) -> tuple[RESULTS, Outcome]:
    results: RESULTS = {}
    outcome = Outcome()
    timeouts = dict.fromkeys(addresses, DEFAULT_TIMEOUT_NS)
    rig.client.submit(node, Job(read_steps(node, timeouts, results, rig.client.counters), outcome))
    return results, outcome


def acknowledge_of(address: Address, node: int = 11) -> Callable[[Can], bool]:
    head = sdo.download_response(address)[:4]
    return lambda can: can.can_id == 0x580 + node and can.data[:4] == head


def abort_of(address: Address, node: int = 11) -> Callable[[Can], bool]:
    head = sdo.abort(address, 0)[:4]
    return lambda can: can.can_id == 0x580 + node and can.data[:4] == head


def value_of(address: Address, node: int = 11) -> Callable[[Can], bool]:
    mux = sdo.upload_request(address)[1:4]
    return lambda can: can.can_id == 0x580 + node and can.data[0] >> 5 == 2 and can.data[1:4] == mux


def request_to(address: Address, node: int = 11, command: int = 1) -> Callable[[Can], bool]:
    mux = sdo.upload_request(address)[1:4]
    return lambda can: can.can_id == 0x600 + node and can.data[0] >> 5 == command and can.data[1:4] == mux


def raw(device: ServedNode, address: Address) -> int:
    return device.store.at(address).number


def writes_sent(rig: Rig, address: Address) -> int:
    return sum(1 for can in rig.port.sent if request_to(address)(can))


def test_values_short_and_long_are_read() -> None:
    rig = Rig()
    device = rig.node()
    results, outcome = read(rig, WINDOW, NAME, TIMEOUT_6066)
    rig.run_until(lambda: outcome.done)
    assert outcome.error is None
    assert results == {address: device.store.read(address) for address in (WINDOW, NAME, TIMEOUT_6066)}
    assert len(device.store.read(NAME)) > 7


def test_a_refused_object_does_not_stop_the_list() -> None:
    rig = Rig()
    rig.node()
    unknown = Address(0x2FFF)
    results, outcome = read(rig, unknown, WINDOW)
    rig.run_until(lambda: outcome.done)
    error = results[unknown]
    assert isinstance(error, SdoAbortError)
    assert error.abort_code == sdo.Abort.NO_OBJECT
    assert isinstance(results[WINDOW], bytes)


def test_a_write_is_acknowledged() -> None:
    rig = Rig()
    device = rig.node()
    outcome = write(rig, WINDOW, u32(777))
    rig.run_until(lambda: outcome.done)
    assert (outcome.result, outcome.error) == (Written.ACKNOWLEDGED, None)
    assert raw(device, WINDOW) == 777


def test_a_refused_write_names_the_abort_code() -> None:
    rig = Rig()
    rig.node()
    outcome = write(rig, POSITION, u32(1))
    rig.run_until(lambda: outcome.done)
    assert isinstance(outcome.error, SdoAbortError)
    assert outcome.error.abort_code == sdo.Abort.READ_ONLY


@pytest.mark.parametrize("late_ms", [501, 503, 506, 520, 800])
def test_a_late_acknowledge_completes_nothing_else(late_ms: int) -> None:
    """A's acknowledge comes while A is read back, or while B is pending, or after all; B is refused by the device."""
    rig = Rig()
    slow_ms = 300
    delays = iter([MS, *[slow_ms * MS] * 50])
    device = rig.node(delays_ns=delays)
    rig.line.inject(Fault(acknowledge_of(WINDOW), delay(late_ms * MS)))
    a = write(rig, WINDOW, u32(4711))
    b = write(rig, POSITION, u32(1))
    rig.run_until(lambda: a.done and b.done)
    assert (a.result, a.error) == (Written.READ_BACK, None)
    assert isinstance(b.error, SdoAbortError)
    assert b.error.abort_code == sdo.Abort.READ_ONLY
    assert raw(device, WINDOW) == 4711
    assert writes_sent(rig, WINDOW) == 1
    rig.run(2 * S)
    assert rig.client.counters.late == 1
    assert (a.calls, b.calls) == (1, 1)


@pytest.mark.parametrize("late_ms", [505, 600, 801, 802, 1101, 1400])
def test_a_late_acknowledge_does_not_complete_a_later_write_to_the_same_object(late_ms: int) -> None:
    rig = Rig()
    delays = iter([MS, *[300 * MS] * 50])
    device = rig.node(delays_ns=delays)
    rig.line.inject(Fault(acknowledge_of(WINDOW), delay(late_ms * MS)))
    a = write(rig, WINDOW, u32(4711))
    rig.run_until(lambda: a.done)
    assert (a.result, a.error) == (Written.READ_BACK, None)
    refuse_writes(device, WINDOW)
    b = write(rig, WINDOW, u32(4712))
    rig.run_until(lambda: b.done)
    assert isinstance(b.error, SdoAbortError | UnverifiedError)
    assert raw(device, WINDOW) == 4711


def refuse_writes(device: ServedNode, address: Address) -> None:
    def guard(_raw: object) -> None:
        raise RefusedAccessError(sdo.Abort.DEVICE_STATE)

    device.store.at(address).guard = guard


def test_a_write_whose_request_is_lost_is_not_repeated() -> None:
    rig = Rig()
    device = rig.node()
    before = raw(device, WINDOW)
    rig.line.inject(Fault(request_to(WINDOW), drop))
    outcome = write(rig, WINDOW, u32(4711))
    rig.run_until(lambda: outcome.done)
    assert isinstance(outcome.error, UnverifiedError)
    assert outcome.error.details["found"] == u32(before).hex()
    assert raw(device, WINDOW) == before
    assert writes_sent(rig, WINDOW) == 1


def test_a_write_whose_acknowledge_is_lost_is_verified_by_reading() -> None:
    rig = Rig()
    device = rig.node()
    rig.line.inject(Fault(acknowledge_of(WINDOW), drop))
    outcome = write(rig, WINDOW, u32(4711))
    rig.run_until(lambda: outcome.done)
    assert (outcome.result, outcome.error) == (Written.READ_BACK, None)
    assert raw(device, WINDOW) == 4711
    assert Can(0x60B, sdo.abort(WINDOW, sdo.Abort.TIMED_OUT)) in rig.port.sent


def test_a_refusal_that_comes_late_is_still_a_refusal() -> None:
    rig = Rig()
    device = rig.node(delays_ns=iter([600 * MS, *[MS] * 50]))
    refuse_writes(device, WINDOW)
    outcome = write(rig, WINDOW, u32(4711))
    rig.run_until(lambda: outcome.done)
    assert isinstance(outcome.error, SdoAbortError)
    assert outcome.error.abort_code == sdo.Abort.DEVICE_STATE


def test_a_save_whose_acknowledge_is_lost_is_unverified() -> None:
    """What 1010h reads as says nothing about the save."""
    rig = Rig()
    rig.node()
    save = Address(0x1010, 3)
    rig.line.inject(Fault(acknowledge_of(save), drop))
    outcome = write(rig, save, b"save", verify=Verify.ACK)
    rig.run_until(lambda: outcome.done)
    assert isinstance(outcome.error, UnverifiedError)
    assert writes_sent(rig, save) == 1


def test_a_write_to_a_dead_node_says_so() -> None:
    rig = Rig()
    outcome = write(rig, WINDOW, u32(1))
    rig.run_until(lambda: outcome.done)
    assert isinstance(outcome.error, NoAnswerError)
    assert writes_sent(rig, WINDOW) == 1


def test_a_read_is_asked_once_more_behind_a_fence() -> None:
    rig = Rig()
    device = rig.node()
    rig.line.inject(Fault(value_of(WINDOW), drop))
    results, outcome = read(rig, WINDOW)
    rig.run_until(lambda: outcome.done)
    assert results == {WINDOW: device.store.read(WINDOW)}
    assert (rig.client.counters.read_retries, rig.client.counters.fences) == (1, 1)


def test_a_fence_is_as_patient_as_the_request_behind_it() -> None:
    rig = Rig()
    device = rig.node(delays_ns=iter([700 * MS] * 50))
    hasty, results = Outcome(), RESULTS()
    steps = read_steps(11, {WINDOW: 300 * MS}, results, rig.client.counters)
    rig.client.submit(11, Job(steps, hasty, fenced=False))
    rig.run_until(lambda: hasty.done)
    assert isinstance(results[WINDOW], NoAnswerError)
    patient, answers = Outcome(), RESULTS()
    rig.client.submit(11, Job(read_steps(11, {WINDOW: 2 * S}, answers, rig.client.counters), patient))
    rig.run_until(lambda: patient.done)
    assert answers == {WINDOW: device.store.read(WINDOW)}


def test_an_object_that_never_answers_does_not_end_the_list() -> None:
    rig = Rig()
    device = rig.node()
    rig.line.inject(Fault(value_of(WINDOW), drop, times=None))
    results, outcome = read(rig, WINDOW, TIMEOUT_6066)
    rig.run_until(lambda: outcome.done)
    assert isinstance(results[WINDOW], NoAnswerError)
    assert results[TIMEOUT_6066] == device.store.read(TIMEOUT_6066)


def test_a_dead_node_ends_a_long_list_soon() -> None:
    rig = Rig()
    addresses = [Address(0x2000 + i) for i in range(300)]
    results, outcome = read(rig, *addresses)
    rig.run_until(lambda: outcome.done, limit_ns=3 * S)
    assert set(results) == set(addresses)
    assert all(isinstance(result, NoAnswerError) for result in results.values())


def test_duplicated_answers_are_harmless() -> None:
    rig = Rig()
    device = rig.node()
    rig.line.inject(Fault(lambda can: can.can_id == 0x58B, duplicate(), times=None))
    addresses = (NAME, WINDOW, TIMEOUT_6066, NAME)
    results, outcome = read(rig, *addresses)
    written = write(rig, WINDOW, u32(5))
    rig.run_until(lambda: outcome.done and written.done)
    assert results == {address: device.store.read(address) for address in addresses} | {WINDOW: results[WINDOW]}
    assert written.result is Written.ACKNOWLEDGED


def test_nodes_work_in_parallel() -> None:
    rig = Rig()
    devices = [rig.node(node, iter([20 * MS] * 100)) for node in (1, 2, 3)]
    outcomes = [read(rig, WINDOW, TIMEOUT_6066, POSITION, node=device.node)[1] for device in devices]
    rig.run_until(lambda: all(outcome.done for outcome in outcomes), limit_ns=75 * MS)


def test_an_urgent_write_interrupts_a_list_which_then_goes_on() -> None:
    rig = Rig()
    device = rig.node(delays_ns=iter([2 * MS] * 1000))
    addresses = [entry.address for entry in device.store.description if entry.access.readable]
    results, outcome = read(rig, *addresses)
    rig.run(100 * MS)
    stop = write(rig, WINDOW, u32(99), urgent=True)
    rig.run_until(lambda: stop.done, limit_ns=8 * MS)
    assert stop.result is Written.ACKNOWLEDGED
    assert not outcome.done
    rig.run_until(lambda: outcome.done)
    assert results == {address: device.store.read(address) for address in addresses} | {WINDOW: results[WINDOW]}


def test_a_short_call_goes_between_two_objects_of_a_long_list() -> None:
    rig = Rig()
    device = rig.node(delays_ns=iter([2 * MS] * 1000))
    timeouts = {entry.address: DEFAULT_TIMEOUT_NS for entry in device.store.description if entry.access.readable}
    results: RESULTS = {}
    backup = Outcome()
    rig.client.submit(11, Job(read_steps(11, timeouts, results, rig.client.counters), backup, bulk=True))
    rig.run(100 * MS)
    for _ in range(3):
        short, outcome = read(rig, WINDOW, TIMEOUT_6066)
        written = write(rig, WINDOW, u32(99))
        rig.run_until(lambda done=outcome, also=written: done.done and also.done, limit_ns=13 * MS)  # type: ignore[misc]
        assert set(short) == {WINDOW, TIMEOUT_6066}
        rig.run(10 * MS)
    assert not backup.done
    rig.run_until(lambda: backup.done)
    assert list(results) == list(timeouts)
    assert all(isinstance(result, bytes) for result in results.values())
    assert rig.client.counters.interrupted == 0


def test_two_long_lists_of_a_node_are_both_read() -> None:
    rig = Rig()
    rig.node()
    outcomes = [Outcome(), Outcome()]
    for outcome in outcomes:
        timeouts = dict.fromkeys((WINDOW, TIMEOUT_6066, POSITION), DEFAULT_TIMEOUT_NS)
        rig.client.submit(11, Job(read_steps(11, timeouts, {}, rig.client.counters), outcome, bulk=True))
    rig.run_until(lambda: all(outcome.done for outcome in outcomes))


def test_a_write_interrupted_by_an_urgent_one_is_decided_by_reading() -> None:
    rig = Rig()
    device = rig.node()
    a = write(rig, WINDOW, u32(5))
    rig.run(MS // 2)
    stop = write(rig, TIMEOUT_6066, u16(9), urgent=True)
    rig.run_until(lambda: a.done and stop.done)
    assert stop.result is Written.ACKNOWLEDGED
    assert a.result is Written.READ_BACK
    assert (raw(device, WINDOW), raw(device, TIMEOUT_6066)) == (5, 9)


def test_an_urgent_write_waits_for_no_fence() -> None:
    rig = Rig()
    rig.node()
    rig.line.inject(Fault(acknowledge_of(WINDOW), drop, times=2))
    rig.line.inject(Fault(value_of(WINDOW), drop, times=None))
    a = write(rig, WINDOW, u32(5))
    rig.run_until(lambda: a.done)
    stop = write(rig, WINDOW, u32(6), urgent=True)
    sent = len(rig.port.sent)
    rig.run(1)
    assert rig.port.sent[-1].data == sdo.download_request(WINDOW, u32(6))
    assert len(rig.port.sent) == sent
    rig.run_until(lambda: stop.done)


def late_write(rig: Rig, data: bytes) -> Outcome:
    """A write of WINDOW that knows of no command yet."""
    outcome = Outcome()
    counters = rig.client.counters
    steps = write_steps(11, WINDOW, data, DEFAULT_TIMEOUT_NS, DEFAULT_TIMEOUT_NS, Verify.EQUAL, counters, known=0)
    rig.client.submit(11, Job(steps, outcome))
    return outcome


def test_what_waits_does_not_follow_an_urgent_command_to_the_same_object() -> None:
    rig = Rig()
    device = rig.node()
    device.watch_writes(WINDOW)
    read(rig, POSITION)
    waiting = late_write(rig, u32(5))
    after = write(rig, TIMEOUT_6066, u16(7))
    rig.client.commands.note(11, WINDOW)
    stop = write(rig, WINDOW, u32(6), urgent=True)
    rig.run_until(lambda: after.done)
    assert isinstance(waiting.error, OvertakenError)
    assert (stop.result, after.result) == (Written.ACKNOWLEDGED, Written.ACKNOWLEDGED), "the queue goes on"
    assert device.written == [(WINDOW, 6)]


def test_what_waits_for_a_fence_does_not_follow_it_either() -> None:
    rig = Rig()
    device = rig.node()
    rig.line.inject(Fault(lambda can: can.can_id == 0x60B, drop))
    write(rig, WINDOW, u32(5))
    rig.client.abort_current(11)
    device.watch_writes(WINDOW)
    waiting = late_write(rig, u32(7))
    rig.run(MS // 2)
    assert (rig.client.counters.fences, waiting.done) == (1, False)
    rig.client.commands.note(11, WINDOW)
    stop = write(rig, WINDOW, u32(6), urgent=True)
    rig.run_until(lambda: stop.done and waiting.done)
    assert isinstance(waiting.error, OvertakenError)
    assert device.written == [(WINDOW, 6)]


def test_an_earlier_command_gives_way_to_a_newer_one() -> None:
    """A STOP that waits for a slow node does not follow the FEATHER that went by PDO meanwhile."""
    rig = Rig()
    device = rig.node()
    device.watch_writes(WINDOW)
    rig.client.submit(11, Job(read_steps(11, {POSITION: DEFAULT_TIMEOUT_NS}, {}, rig.client.counters), Outcome(), True))
    outcome, known = Outcome(), rig.client.commands.note(11, WINDOW)
    counters = rig.client.counters
    steps = write_steps(11, WINDOW, u32(5), DEFAULT_TIMEOUT_NS, DEFAULT_TIMEOUT_NS, Verify.ACK, counters, known=known)
    rig.client.submit(11, Job(steps, outcome, urgent=True))
    rig.client.commands.note(11, WINDOW)
    rig.run_until(lambda: outcome.done)
    assert isinstance(outcome.error, OvertakenError)
    assert device.written == []


def test_a_write_that_nothing_has_overtaken_is_sent() -> None:
    rig = Rig()
    device = rig.node()
    rig.client.commands.note(11, TIMEOUT_6066)
    rig.client.commands.note(12, WINDOW)
    written = late_write(rig, u32(5))
    rig.run_until(lambda: written.done)
    assert (written.result, raw(device, WINDOW)) == (Written.ACKNOWLEDGED, 5)


def test_abort_current_ends_the_running_job_and_starts_the_next() -> None:
    rig = Rig()
    rig.node()
    a = write(rig, WINDOW, u32(5))
    b = write(rig, TIMEOUT_6066, u16(6))
    rig.client.abort_current(11)
    assert isinstance(a.error, NoAnswerError)
    rig.run_until(lambda: b.done)
    assert b.result is Written.ACKNOWLEDGED
    rig.client.abort_current(11)
    assert (a.calls, b.calls) == (1, 1)


def test_a_cancelled_job_is_aborted_and_forgotten() -> None:
    rig = Rig()
    rig.node()
    outcome, other = Outcome(), Outcome()
    results: RESULTS = {}
    timeouts = {Address(0x6000 + i): S for i in range(100)}
    job: Job[None] = Job(read_steps(11, timeouts, results, rig.client.counters), outcome)
    rig.client.submit(11, job)
    rig.run(10 * MS)
    rig.client.cancel(11, job)
    got = len(results)
    rig.client.submit(11, Job(read_steps(11, {WINDOW: S}, {}, rig.client.counters), other))
    rig.run_until(lambda: other.done)
    assert (len(results), outcome.calls) == (got, 0)
    assert 0 < got < 100


def test_a_lost_bus_ends_every_job() -> None:
    rig = Rig()
    rig.node()
    results, listed = read(rig, WINDOW, NAME)
    queued = write(rig, WINDOW, u32(1))
    writing = write(rig, WINDOW, u32(1), node=12)
    rig.client.lose(BusLostError(bus="can0", reason="pulled"))
    assert listed.done
    assert all(isinstance(result, BusLostError) for result in results.values())
    assert set(results) == {WINDOW, NAME}
    assert isinstance(queued.error, BusLostError)
    assert isinstance(writing.error, BusLostError)


def test_a_restart_of_the_node_ends_the_wait_at_once() -> None:
    rig = Rig()
    device = rig.node(delays_ns=iter([400 * MS, *[MS] * 100]))
    outcome = write(rig, WINDOW, u32(5))
    rig.run(10 * MS)
    device.boot()
    start_ns = rig.line.now_ns
    rig.run_until(lambda: outcome.done)
    assert rig.line.now_ns - start_ns < 450 * MS
    assert outcome.result is Written.READ_BACK


def test_a_receiver_that_raises_does_not_stop_the_next_job(caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig()
    rig.node()

    def raising(_result: object, _error: Exception | None) -> None:
        raise RuntimeError("receiver")

    rig.client.submit(11, Job(read_steps(11, {WINDOW: S}, {}, rig.client.counters), raising))
    outcome = write(rig, WINDOW, u32(1))
    rig.run_until(lambda: outcome.done)
    assert outcome.result is Written.ACKNOWLEDGED
    assert "receiver of an SDO result failed" in caplog.text
