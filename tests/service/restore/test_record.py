"""The record of a restore: made of what was kept, sealed, and the same years later."""

from __future__ import annotations

from app.model.restore.plan import Treatment
from app.service.records.check import Verdict, check_file
from app.service.records.files import html_file
from app.service.records.restore_record import Outcome, StepOutcome
from app.service.restore.transaction import End
from tests.service.restore.conftest import PMC, PMM, Bench
from tests.service.restore.test_restore import new_values, ram


async def test_the_record_says_what_happened_and_is_sealed(bench: Bench) -> None:
    restore_id, _ = await bench.run(restart=True, reason="motor exchanged", work_order="WO-7")
    sealed = await bench.desk.record(restore_id)
    key = bench.desk.key()
    assert sealed is not None and key is not None
    record = sealed.record
    assert (record.outcome, record.reason, record.work_order) == (Outcome.NEW, "motor exchanged", "WO-7")
    assert record.simulated and record.confirmed is not None and record.confirmed_by == "Anna"
    rows = {(row.device, row.address): row for row in record.rows if row.treatment is Treatment.WRITE}
    assert set(rows) == set(new_values())
    limit = rows[PMM, "3110:01"]
    assert limit.was and limit.wanted and limit.now
    assert (limit.was.shown, limit.wanted.shown, limit.now.shown, limit.unit) == ("50.0", "49.0", "49.0", "°C")
    assert limit.verified and limit.saved and limit.proven
    for one in record.devices:
        assert one.after is not None and one.restored is not None and one.restarted
        assert (await bench.office.library.get(one.after.record)).hash == one.after.hash != one.before.hash
    assert [event.text_key for event in record.events] == [
        "journal.restore_begun",
        "journal.restore_confirmed",
        "journal.restore_done",
    ]
    checked = check_file(html_file(sealed, "en", key), {key.public: "ours"})
    assert checked.verdict is Verdict.GOOD


async def test_the_record_of_what_was_rolled_back_says_why(bench: Bench) -> None:
    before = await ram(bench)
    restore_id = await bench.begin(confirm_s=0.2)
    assert await bench.desk.wait(restore_id) is End.OLD
    sealed = await bench.desk.record(restore_id)
    assert sealed is not None
    record = sealed.record
    assert (record.outcome, record.confirmed) == (Outcome.OLD, None)
    assert record.note == "nobody confirmed in time"
    assert {
        (row.device, row.address): row.now and row.now.raw for row in record.rows if row.treatment is Treatment.WRITE
    } == before
    assert not any(row.saved for row in record.rows)
    assert {step.outcome for step in record.steps} == {StepOutcome.DONE}
    assert {one.slug for one in record.devices} == {PMM, PMC}
