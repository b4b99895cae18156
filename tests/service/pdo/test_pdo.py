"""PDOs are changed as a whole or not at all, in a twin over a wire; what they carry is decoded from then on."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import canopen
import pytest

from app.errors import (
    InterlockError,
    LeaseHeldError,
    PdoBrokenError,
    PdoBusyError,
    PdoChangedError,
    PdoNoUndoError,
    PdoRefusedError,
    PdoRolledBackError,
    RestoreOpenError,
    SdoAbortError,
    UsageError,
)
from app.model.address import Address
from app.model.checks import Allow
from app.model.pdo.findings import Code, Severity
from app.model.pdo.identifiers import Taken, Use
from app.model.pdo.load import Basis
from app.service.connection import Connection
from app.service.gate import Block
from app.service.jobs import JobState, RowState
from app.service.journal import Entry, Kind
from app.service.motion.desk import MotionDesk
from app.service.pdo.desk import Edit, PdoDesk, UndoStand, preview
from app.service.pdo.look import is_operational, seen_on, setups_of, taken_by_others
from app.service.save import restart
from app.service.stop import Command, command_all
from app.service.stop import Path as Way
from app.service.write import write_raw
from app.store.store import Store
from app.twins.line import Fault, drop
from app.wire.records import Source
from tests.model.pdo.rig import RPDO1, RPDO2, TPDO1, TPDO2, TPDO3, changed, disabled, enabled
from tests.service.conftest import Served
from tests.service.pdo.rig import AXIS, DEADLINE_S, PAGE, Person, ended, with_cob_id
from tests.service.restore.conftest import holding

POSITION = Address(0x6064)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = Store.open(tmp_path / "data")
    yield opened
    opened.close()


@pytest.fixture
def person(connection: Connection, store: Store) -> Person:
    return Person(connection, store)


@contextmanager
def witness(served: Served, node: int) -> Iterator[canopen.RemoteNode]:
    """The device as another CANopen library reads it."""
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=served.server.port, channel="can0")
    remote = canopen.RemoteNode(node, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
    remote.sdo.RESPONSE_TIMEOUT = 5.0
    network.add_node(remote)
    try:
        yield remote
    finally:
        network.disconnect()


def number(remote: canopen.RemoteNode, index: int, sub: int) -> int:
    return int.from_bytes(remote.sdo.upload(index, sub), "little")


async def carried_by_pdo(person: Person, address: Address) -> None:
    """Wait until the live value came by a PDO."""
    bus, node = person.target.device.bus, person.target.node
    async with asyncio.timeout(DEADLINE_S):
        while True:
            view = person.connection.live.value(bus, node, address)
            if view is not None and view.reading is not None and view.reading.source is Source.PDO_TX:
                return
            await asyncio.sleep(0.01)


async def test_a_new_mapping_stands_in_the_device_and_live_values_come_by_it(served: Served, person: Person) -> None:
    wanted = await person.sending()
    job = await person.apply(wanted)
    assert (job.state, job.error, job.done) == (JobState.DONE, None, len(job.rows))
    assert {row.state for row in job.rows} == {RowState.VERIFIED}
    assert (await person.setups())[TPDO2] == wanted
    await carried_by_pdo(person, POSITION)

    def look() -> list[int]:
        with witness(served, person.target.node) as remote:
            return [
                number(remote, 0x1801, 1),
                number(remote, 0x1801, 5),
                *(number(remote, 0x1A01, sub) for sub in range(3)),
            ]

    cob_id = 0x40000280 + person.target.node
    assert await asyncio.to_thread(look) == [cob_id, 50, 2, 0x60640020, 0x60410010]
    noted = [(entry.kind, entry.person, entry.details.get("pdos")) for entry in person.connection.journal.latest()]
    assert (Kind.PDO_CHANGED, "A. Technician", "TPDO2") in noted
    written = [entry for entry in person.connection.journal.latest() if entry.kind is Kind.WRITTEN]
    assert [entry.details["address"] for entry in written] == [row.address for row in job.rows]

    undone = await person.undo()
    assert (undone.state, undone.error) == (JobState.DONE, None)
    assert not (await person.setups())[TPDO2].enabled
    assert person.desk.kept.of(AXIS) is None
    with pytest.raises(PdoNoUndoError):
        await person.undo()


async def test_what_the_device_refuses_midway_is_rolled_back_and_read_back(person: Person) -> None:
    before = await person.setups()
    first = await person.apply(enabled(before[TPDO3], event_ms=100))
    assert first.state is JobState.DONE
    kept = person.desk.kept.of(AXIS)
    before = await person.setups()
    # The unit has no 29-bit identifiers, which nothing but its answer tells: mapping and timers are written by then.
    wanted = with_cob_id(changed(before[TPDO2], "6064/32", event_ms=20), 0x60012345)
    job = await person.apply(changed(before[TPDO3], event_ms=200), wanted)
    assert job.state is JobState.FAILED and isinstance(job.error, PdoRolledBackError)
    refused = [row for row in job.rows if row.state is RowState.REFUSED]
    assert [row.address for row in refused] == ["1801:01"]
    assert isinstance(refused[0].error, SdoAbortError)
    assert await person.setups() == before
    assert person.desk.kept.of(AXIS) == kept  # the change before it can still be put back
    kinds = [entry.kind for entry in person.connection.journal.latest()]
    assert Kind.PDO_ROLLED_BACK in kinds and kinds.count(Kind.PDO_CHANGED) == 1


async def test_a_lost_answer_is_no_failure(served: Served, person: Person) -> None:
    before = await person.setups()
    answer = 0x580 + person.target.node
    served.spoil(Fault(lambda can: can.can_id == answer and can.data[:4] == bytes([0x60, 0x00, 0x1A, 0]), drop))
    served.spoil(Fault(lambda can: can.can_id == answer and can.data[:3] == bytes([0x60, 0x01, 0x1A]), drop))
    wanted = enabled(before[TPDO2], "6064/32")
    job = await person.apply(wanted)
    assert job.state is JobState.DONE and (await person.setups())[TPDO2] == wanted


async def test_a_change_that_is_cancelled_is_put_back_whole(person: Person) -> None:
    before = await person.setups()
    job = await person.begin(enabled(before[TPDO2], "6064/32", event_ms=50), enabled(before[TPDO3], event_ms=20))
    async with asyncio.timeout(DEADLINE_S):
        while job.done < 3:  # noqa: ASYNC110  a job has no event
            await asyncio.sleep(0)
    with pytest.raises(PdoBusyError):
        person.motion.require_left()  # the connection must not end in the middle of it
    for _ in range(3):
        person.jobs.cancel(job.id)
        await asyncio.sleep(0)
    assert (await ended(job)).state is JobState.CANCELLED
    person.motion.require_left()
    assert await person.setups() == before
    assert person.desk.kept.of(AXIS) is None


async def test_what_failed_is_put_back_whatever_the_gate_says_meanwhile(person: Person) -> None:
    before = await person.setups()
    blocks, journal = person.connection.gate.blocks, person.connection.journal

    def shut(entry: Entry) -> None:
        """From the failed write on nobody else may write any more."""
        if entry.kind is Kind.WRITE_FAILED:
            blocks.put([Block("r1", "wtg-07/blade-1", ())])

    end = journal.listen(shut)
    job = await person.apply(with_cob_id(changed(before[TPDO2], "6064/32", event_ms=20), 0x60012345))
    end()
    assert job.state is JobState.FAILED and isinstance(job.error, PdoRolledBackError)
    assert blocks.now, "the gate was shut before anything was put back"
    assert await person.setups() == before
    assert person.desk.kept.of(AXIS) is None


async def test_what_could_not_be_put_back_stays_open_and_is_put_back_later(served: Served, person: Person) -> None:
    before = await person.setups()
    blocks, journal = person.connection.gate.blocks, person.connection.journal
    deaf = Fault(lambda can: can.can_id == 0x600 + person.target.node, drop, times=None)

    def cut_off(entry: Entry) -> None:
        """From the failed write on the device hears nothing any more."""
        if entry.kind is Kind.WRITE_FAILED:
            served.spoil(deaf)

    end = journal.listen(cut_off)
    job = await person.apply(with_cob_id(changed(before[TPDO2], "6064/32", event_ms=20), 0x60012345))
    end()
    assert job.state is JobState.FAILED and isinstance(job.error, PdoBrokenError)
    assert job.error.details["again_key"] == "page.pdo.why.no_answer"
    assert Kind.PDO_BROKEN in [entry.kind for entry in journal.latest()]
    assert person.desk.undo_stand(person.target) is UndoStand.OPEN
    served.thread.call_soon(lambda: served.line.withdraw(deaf))
    assert (await person.setups())[TPDO2].parameters.event_ms == 20
    with pytest.raises(PdoBusyError):
        await person.begin(changed(before[TPDO2], "6064/32", event_ms=30))
    blocks.put([Block("r1", "wtg-07/blade-1", ())])  # a restore of the station that is not finished is no obstacle
    undone = await person.undo()
    assert (undone.state, undone.error) == (JobState.DONE, None)
    assert await person.setups() == before
    assert person.desk.undo_stand(person.target) is None


async def test_a_change_can_be_put_back_after_the_server_was_started_anew(
    connection: Connection, person: Person, tmp_path: Path, store: Store
) -> None:
    before = await person.setups()
    await person.apply(enabled(before[TPDO2], event_ms=50))
    store.close()
    again = Store.open(tmp_path / "data")
    try:
        later = Person(connection, again)
        assert later.desk.undo_stand(later.target) is UndoStand.READY
        kept = later.desk.kept.of(AXIS)
        assert kept is not None and (kept.person, list(kept.after)) == ("A. Technician", [TPDO2])
        assert (await later.undo()).state is JobState.DONE
        assert await later.setups() == before
        assert PdoDesk(again, connection.stamper).kept.of(AXIS) is None
    finally:
        again.close()


async def test_what_somebody_else_has_changed_since_is_not_overwritten(person: Person) -> None:
    before = await person.setups()
    edits = await person.edits(enabled(before[TPDO2]))
    driver, target = person.connection.driver(person.target), person.target
    await write_raw(driver, target, Address(0x1801, 5), 30, person.connection.journal, allow=Allow.COMMUNICATION)
    with pytest.raises(PdoChangedError, match="TPDO2"):
        await person.desk.apply(person.worker, target, edits)
    await person.apply(enabled((await person.setups())[TPDO2]))
    await write_raw(driver, target, Address(0x1801, 5), 40, person.connection.journal, allow=Allow.COMMUNICATION)
    assert person.desk.undo_stand(target) is UndoStand.GONE
    with pytest.raises(PdoChangedError, match="TPDO2"):
        await person.undo()
    assert (await person.setups())[TPDO2].parameters.event_ms == 40


async def test_after_a_restart_the_unit_has_its_defaults_and_there_is_nothing_to_put_back(person: Person) -> None:
    before = await person.setups()
    await person.apply(enabled(before[TPDO2]))
    target, journal = person.target, person.connection.journal
    await restart(person.connection.driver(target), target, journal, person.connection.stamper)
    assert person.desk.undo_stand(target) is UndoStand.UNKNOWN
    assert await person.setups() == before
    assert person.desk.undo_stand(target) is UndoStand.GONE


async def test_an_error_of_the_rules_is_refused_with_nothing_written(person: Person) -> None:
    before = await person.setups()
    for wanted, key in (
        (disabled(before[RPDO1]), Code.STOP_PATH),
        (disabled(before[TPDO1]), Code.STATUS_PATH),
        (enabled(before[TPDO2], cob_id=0x40000580 + 5), Code.RESTRICTED),
        (enabled(before[TPDO2], "6065/32"), Code.NOT_MAPPABLE),
    ):
        with pytest.raises(PdoRefusedError) as refused:
            await person.begin(wanted)
        assert refused.value.details["reason_key"] == f"page.pdo.finding.{key.value}"
    with pytest.raises(UsageError):
        await person.begin()
    assert await person.setups() == before
    assert not [entry for entry in person.connection.journal.latest() if entry.kind is Kind.WRITTEN]
    assert person.desk.kept.of(AXIS) is None


async def test_stop_goes_by_another_pdo_once_that_carries_the_controlword_alone(person: Person) -> None:
    before = await person.setups()
    await person.start_node()
    job = await person.apply(disabled(before[RPDO1]), enabled(before[RPDO2], "6040/16"))
    assert job.state is JobState.DONE
    axis = next(one for one in person.connection.axes() if one.target.slug == AXIS)
    connection = person.connection
    (outcome,) = await command_all([axis], Command.STOP, connection.journal, connection.stamper)
    assert outcome.how is Way.RPDO
    sent = seen_on(connection, "can0").latest_ns
    assert (0x300 + person.target.node, False) in sent and (0x200 + person.target.node, False) not in sent


async def test_while_a_restore_is_open_nothing_is_changed(person: Person) -> None:
    before = await person.setups()
    blocks = person.connection.gate.blocks
    blocks.put([Block("r1", "wtg-07/blade-1", ())])
    with pytest.raises(RestoreOpenError):
        await person.begin(enabled(before[TPDO2]))
    blocks.put([])
    assert (await person.apply(enabled(before[TPDO2]))).state is JobState.DONE


async def test_another_page_with_the_lease_and_a_change_under_way_hold_it_back(person: Person) -> None:
    before = await person.setups()
    motion: MotionDesk = person.motion
    other = motion.take_lease("B. Colleague", "another page")
    with pytest.raises(LeaseHeldError):
        await person.begin(enabled(before[TPDO2]))
    motion.give_back_lease(other.fence)
    own = motion.take_lease("A. Technician", PAGE)
    job = await person.begin(enabled(before[TPDO2]))
    with pytest.raises(PdoBusyError):
        await person.begin(enabled(before[TPDO3]))
    with pytest.raises(InterlockError):
        await motion.prepare(AXIS, own.fence)
    assert (await ended(job)).state is JobState.DONE
    motion.give_back_lease(own.fence)
    assert (await person.apply(enabled(before[TPDO3]))).state is JobState.DONE
    await motion.close()


async def test_a_preview_tells_the_writes_the_findings_and_the_load_and_sends_nothing(person: Person) -> None:
    await person.setups()
    await person.start_node()
    now, target, connection = setups_of(person.target), person.target, person.connection
    requests = (0x600 + target.node, False)
    sent = seen_on(connection, "can0").latest_ns[requests]
    wanted = enabled(now[TPDO2], "6064/32", "6041/16", "6061/8", inhibit_100us=100)
    found = preview(connection, target, [Edit(now[TPDO2], wanted)])
    assert [finding.code for finding in found.findings if finding.severity is Severity.ERROR] == []
    assert found.writes[-1].raw == 0x40000280 + target.node
    load = found.cost.after[AXIS, TPDO2]
    assert (load.per_second, load.basis, load.bits) == (100.0, Basis.INHIBIT, 47 + 56 + (34 + 56 - 1) // 4)
    assert found.cost.pdos_after - found.cost.pdos_now == pytest.approx(100 * load.bits / 500_000)
    assert found.cost.now[AXIS, TPDO1].basis is Basis.MEASURED
    assert seen_on(connection, "can0").latest_ns[requests] == sent
    assert is_operational(target) is True


async def test_identifiers_of_the_whole_turbine_are_known(person: Person) -> None:
    taken = taken_by_others(person.connection, person.target)
    for target in person.connection.targets:
        assert Taken(0x80 + target.node, False, Use.EMCY, target.slug) in taken
        if target.slug != AXIS:
            assert Taken(0x180 + target.node, False, Use.TPDO, target.slug, 1) in taken
            assert Taken(0x200 + target.node, False, Use.RPDO, target.slug, 1) in taken
            commands = Taken(0x200 + target.node, False, Use.COMMANDS, target.slug, 1)
            assert (commands in taken) is target.slug.endswith("/pmc")
    before = await person.setups()
    other = person.connection.target("wtg-07/blade-2/pmc").node
    with pytest.raises(PdoRefusedError) as refused:
        await person.begin(enabled(before[TPDO2], cob_id=0x40000180 + other))
    assert refused.value.details["by"] == "wtg-07/blade-2/pmc"
    with pytest.raises(PdoRefusedError) as refused:
        await person.begin(enabled(before[RPDO2], cob_id=0x200 + other))
    assert refused.value.details["reason_key"] == "page.pdo.finding.commands_other"


async def test_an_emergency_object_that_is_off_takes_no_identifier(served: Served, person: Person) -> None:
    target, driver = person.target, person.connection.driver(person.target)
    own, cell = Taken(0x80 + target.node, False, Use.EMCY, AXIS), served.turbine.devices[target.node].store.find(0x1014)
    assert cell is not None and own in taken_by_others(person.connection, target)
    end = holding(cell, 0x80000000 + own.can_id)  # the unit lets nobody write it
    await driver.read(target.node, Address(0x1014))
    async with asyncio.timeout(DEADLINE_S):
        while own in taken_by_others(person.connection, target):  # noqa: ASYNC110  the live state has no event for it
            await asyncio.sleep(0.01)
    end()


async def test_what_an_unknown_device_sends_is_seen_and_told(served: Served, person: Person) -> None:
    stranger = 0x2F0
    before = await person.setups()
    network = canopen.Network()
    network.connect(interface="socketcand", host="127.0.0.1", port=served.server.port, channel="can0")
    sending = network.send_periodic(stranger, b"\x01\x02", 0.02)
    try:
        async with asyncio.timeout(DEADLINE_S):
            unknown = Taken(stranger, False, Use.SEEN, None)
            while unknown not in taken_by_others(person.connection, person.target):  # noqa: ASYNC110  no event for it
                await asyncio.sleep(0.02)
    finally:
        sending.stop()  # type: ignore[no-untyped-call]
        network.disconnect()
    wanted = enabled(before[TPDO2], cob_id=0x40000000 + stranger)
    found = preview(person.connection, person.target, [Edit(before[TPDO2], wanted)], before).findings
    assert Code.COB_ID_SEEN in {one.code for one in found if one.pdo == TPDO2}


async def test_what_is_sent_by_nobody_yet_leaves_no_load_when_it_ends(person: Person) -> None:
    """The node is not operational: its PDOs cost nothing now, and nothing less once one of them is off."""
    before = await person.setups()
    await person.apply(enabled(before[TPDO2], event_ms=10))
    now = await person.setups()
    found = preview(person.connection, person.target, [Edit(now[TPDO2], disabled(now[TPDO2]))], now).cost
    assert found.pdos_after < found.pdos_now
    assert found.bus_after == found.bus_now
