"""What is polled: the usual list, what may be changed, what it takes of a bus, and that a change counts at once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.errors import AccessError, LimitError, UnknownObjectError, UsageError
from app.model.address import Address
from app.model.description import Access
from app.model.description_file import load_builtin
from app.service.connection import Connection
from app.service.journal import Entry, Journal, Kind
from app.service.poll import Poller
from app.service.polling import (
    EXCHANGE_BITS,
    KEY,
    USUAL,
    Polling,
    PollPlan,
    Rate,
    plan_document,
    plan_from,
    read_bits,
    usual_list,
)
from app.store.small_rows import put_setting
from app.store.store import Store
from tests.e2e.test_interoperation import until
from tests.service.test_poll import PMM, Asked

PMM_DESCRIPTION, PMC_DESCRIPTION = load_builtin("oat-pmm"), load_builtin("oat-pmc")
KNOWN = {one.id: one for one in (PMM_DESCRIPTION, PMC_DESCRIPTION)}
LIMIT = Address(0x3110, 1)


@pytest.fixture
def journal() -> Journal:
    return Journal(lambda: 1, "tester")


def test_the_usual_list_holds_only_what_the_device_has_and_can_be_read() -> None:
    for description in KNOWN.values():
        items = usual_list(description)
        assert items and all(description.entry(address).access.readable for address in items)


async def test_a_change_is_kept_and_noted_with_old_and_new(journal: Journal) -> None:
    noted: list[Entry] = []
    journal.listen(noted.append)
    store = Store.in_memory()
    polling = Polling(store)
    plan = replace(USUAL, period_s=0.2, lists={"oat-pmm": {LIMIT: Rate.SLOW}})
    await polling.change(plan, KNOWN, journal)
    assert polling.plan == plan == Polling(store).plan
    (entry,) = noted
    assert entry.kind is Kind.SETTINGS_CHANGED
    assert entry.details["changes"] == "period_s 0.1 → 0.2; lists.oat-pmm.3110:01 – → slow"
    await polling.change(plan, KNOWN, journal)
    assert len(noted) == 1, "what changes nothing is no change"
    store.close()


async def test_the_usual_list_is_not_kept_as_a_list_of_its_own(journal: Journal) -> None:
    polling = Polling()
    await polling.change(replace(USUAL, lists={"oat-pmm": usual_list(PMM_DESCRIPTION)}), KNOWN, journal)
    assert polling.plan.lists == {}


@pytest.mark.parametrize(
    ("plan", "error"),
    [
        (replace(USUAL, period_s=0.01), LimitError),
        (replace(USUAL, load_cap=1.0), LimitError),
        (replace(USUAL, slow_every=1), LimitError),
        (replace(USUAL, lists={"oat-pmm": {Address(0x2FFF): Rate.FAST}}), UnknownObjectError),
        (replace(USUAL, lists={"nobody": {LIMIT: Rate.FAST}}), UsageError),
        (replace(USUAL, lists={"oat-pmm": {}}), LimitError),
    ],
)
async def test_what_makes_no_sense_changes_nothing(plan: PollPlan, error: type[Exception], journal: Journal) -> None:
    polling = Polling()
    with pytest.raises(error):
        await polling.change(plan, KNOWN, journal)
    assert polling.plan is USUAL


async def test_what_cannot_be_read_cannot_be_polled(journal: Journal) -> None:
    entry = replace(PMM_DESCRIPTION.entry(LIMIT), access=Access.WO)
    write_only = replace(PMM_DESCRIPTION, entries={**PMM_DESCRIPTION.entries, LIMIT: entry})
    with pytest.raises(AccessError):
        await Polling().change(replace(USUAL, lists={"oat-pmm": {LIMIT: Rate.RARE}}), {"oat-pmm": write_only}, journal)


def test_damaged_settings_are_named() -> None:
    store = Store.in_memory()
    store.call(lambda connection: put_setting(connection, KEY, {"period_s": "x"}))
    with pytest.raises(UsageError):
        Polling(store)
    store.close()
    assert plan_from(plan_document(USUAL)) == USUAL


def test_the_load_follows_rates_devices_and_bit_rate() -> None:
    plan = PollPlan(0.1, 10, 100, 0.6, {"oat-pmm": {LIMIT: Rate.FAST, Address(0x3000): Rate.RARE}})
    expected = 3 * EXCHANGE_BITS * (10 + 0.1) / 500_000
    assert plan.load([PMM_DESCRIPTION] * 3, 500_000) == pytest.approx(expected)
    assert read_bits(PMM_DESCRIPTION.entry(Address(0x1008))) > EXCHANGE_BITS


async def test_a_change_counts_in_the_connection_that_is_open(connection: Connection) -> None:
    asked = Asked(connection)
    plan = USUAL
    poller = Poller(connection, lambda: plan)
    try:
        await until(lambda: len(asked.times(PMM, Address(0x3000))) >= 2)
        assert asked.times(PMM, LIMIT) == []
        plan = replace(USUAL, lists={"oat-pmm": {LIMIT: Rate.FAST}})
        await until(lambda: len(asked.times(PMM, LIMIT)) >= 3)
        since_s = asked.times(PMM, LIMIT)[0]
        await until(lambda: len(asked.times(PMM, LIMIT)) >= 6)
        assert asked.times(PMM, Address(0x3000), since_s) == []
    finally:
        await poller.close()
