"""A fleet beside its golden set: it finds what comparing set by set finds; latest sets only; foreign versions."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.errors import ColumnError
from app.model.address import Address
from app.model.datatypes import Raw
from app.model.diff.compare import RowState, compare
from app.model.set_record import Source, Tag
from app.model.sets import Identity, Origin, ParameterSet, iso_time
from app.service.compare.fleet import Fleet, Mark, compare_fleet
from app.service.compare.ground import Ground
from app.service.compare.sources import Columns
from app.service.library.library import Library
from app.service.office.audit import AuditLog
from app.store.store import Store
from app.web.models.fleet import FleetDoc
from tests.model.diff.devices import LIMIT, MASK, NAME, OFFSET, PARAMETERS, TOY, VALUES

MARKS = {
    RowState.SAME: Mark.SAME,
    RowState.DIFFERENT: Mark.DIFFERENT,
    RowState.UNIT: Mark.UNIT,
    RowState.MISSING: Mark.MISSING,
}


class Kept:
    """A store with its library, for one fleet after another."""

    def __init__(self) -> None:
        self.store = Store.in_memory()
        self.audit = AuditLog(self.store)
        self.library = Library(self.store, self.audit, lambda: 1)
        self.columns = Columns(Ground(lambda: 1, library=self.library, known=(TOY,)))

    async def close(self) -> None:
        """Forget all."""
        await self.audit.close()
        self.store.close()

    async def fleet(self, golden: ParameterSet, *others: ParameterSet) -> Fleet:
        """Keep them all, and compare with the first."""
        first, *_rest = await self.library.put([golden, *others], Source.FILE)
        return await compare_fleet(self.columns, self.store, f"set:{first.id}")


@pytest.fixture
async def kept() -> AsyncIterator[Kept]:
    made = Kept()
    yield made
    await made.close()


def taken(device: int, changes: dict[Address, Raw | None] | None = None, minute: int = 0) -> ParameterSet:
    values = {address: raw for address, raw in {**VALUES, **(changes or {})}.items() if raw is not None}
    time = iso_time(1_700_000_000_000_000_000 + minute * 60_000_000_000)
    slug = f"wtg-{device:02}/blade-1/toy"
    return ParameterSet(
        "toy", "1.2.0", Identity(serial=device), Origin(f"wtg-{device:02}", slug, 1, time, "", "", ""), values
    )


def found(fleet: Fleet, device: int) -> dict[Address, Mark]:
    row = [member.device for member in fleet.members].index(f"wtg-{device:02}/blade-1/toy")
    return dict(zip((entry.address for entry in fleet.entries), fleet.marks(row), strict=True))


async def test_outliers_are_ranked_and_counted_by_group(kept: Kept) -> None:
    fleet = await kept.fleet(
        taken(0),
        taken(1, {LIMIT: 501, MASK: 3, OFFSET: 5}),
        taken(2, {OFFSET: 6}),
        taken(3, {NAME: "other", LIMIT: None}),
        taken(4),
    )
    assert [fleet.members[row].device[:6] for row in fleet.ranking()] == [
        "wtg-01",
        "wtg-03",
        "wtg-00",
        "wtg-02",
        "wtg-04",
    ]
    assert fleet.groups == ("io", "all")
    by_device = {
        member.device[:6]: counts.tolist() for member, counts in zip(fleet.members, fleet.by_group, strict=True)
    }
    assert by_device == {"wtg-00": [0, 0], "wtg-01": [1, 1], "wtg-02": [0, 0], "wtg-03": [0, 1], "wtg-04": [0, 0]}
    assert (fleet.count(Mark.UNIT), fleet.count(Mark.MISSING)) == ([0, 1, 1, 0, 0], [0, 0, 0, 1, 0])
    place = [entry.address for entry in fleet.entries].index(LIMIT)
    assert (fleet.per_entry(Mark.DIFFERENT)[place], fleet.per_entry(Mark.MISSING)[place]) == (1, 1)


async def test_only_the_latest_set_of_a_device_counts_whenever_it_came(kept: Kept) -> None:
    later, earlier = taken(1, {LIMIT: 1}, minute=9), taken(1, {LIMIT: 2}, minute=3)
    fleet = await kept.fleet(taken(0), later, earlier)
    assert len(fleet.members) == 2
    assert found(fleet, 1)[LIMIT] is Mark.DIFFERENT
    back = await kept.fleet(taken(0), taken(1, minute=20))
    assert found(back, 1)[LIMIT] is Mark.SAME


def fragment(device: int, changes: dict[Address, Raw | None], minute: int) -> ParameterSet:
    """Nobody read LIMIT."""
    return replace(taken(device, {**changes, LIMIT: None}, minute), unread={LIMIT: "no_answer"})


async def test_a_fragment_takes_the_place_of_no_complete_set_in_whatever_order_they_come(kept: Kept) -> None:
    fleet = await kept.fleet(
        taken(0),
        *(taken(1, {MASK: 2}, minute=1), fragment(1, {}, minute=9)),
        *(fragment(2, {}, minute=9), taken(2, {MASK: 2}, minute=1)),
        *(fragment(3, {}, minute=1), fragment(3, {MASK: 3}, minute=2), fragment(3, {}, minute=0)),
    )
    assert found(fleet, 1)[LIMIT] is found(fleet, 2)[LIMIT] is Mark.SAME
    assert found(fleet, 1)[MASK] is found(fleet, 2)[MASK] is Mark.DIFFERENT
    assert (found(fleet, 3)[LIMIT], found(fleet, 3)[MASK]) == (Mark.MISSING, Mark.DIFFERENT)


async def test_a_device_whose_set_is_a_fragment_is_incomplete_and_not_equal(kept: Kept) -> None:
    fleet = await kept.fleet(taken(0), fragment(1, {}, 0), fragment(2, {MASK: 3}, 0), taken(3, {MASK: 3}))
    doc = FleetDoc.of(fleet, None, 10)
    assert (doc.total, doc.equal, doc.different, doc.incomplete) == (4, 1, 2, 2)
    missing = {one.device[:6]: dict(zip(doc.groups, one.missing_by_group, strict=True)) for one in doc.devices}
    whole, lacking = {"io": 0, "all": 0}, {"io": 0, "all": 1}
    assert missing == {"wtg-00": whole, "wtg-01": lacking, "wtg-02": lacking, "wtg-03": whole}


async def test_another_major_version_or_kind_is_not_compared(kept: Kept) -> None:
    foreign = replace(taken(1, {LIMIT: 1}), description_version="2.0.0")
    other = replace(taken(2, {LIMIT: 1}), description_id="other")
    minor = replace(taken(3, {LIMIT: 1}), description_version="1.9.0")
    fleet = await kept.fleet(taken(0), foreign, other, minor)
    assert [member.device[:6] for member in fleet.members] == ["wtg-00", "wtg-03"]
    assert [(member.device[:6], member.version) for member in fleet.foreign] == [("wtg-01", "2.0.0")]


async def test_the_golden_set_is_that_of_the_kind_and_named_where_there_is_none(kept: Kept) -> None:
    with pytest.raises(ColumnError) as caught:
        await compare_fleet(kept.columns, kept.store, "golden:toy")
    assert caught.value.details["reason_key"] == "compare.unresolved.no-golden"
    (record,) = await kept.library.put([taken(7, {LIMIT: 3})], Source.FILE)
    await kept.library.tag(record.id, Tag.GOLDEN, "Eva")
    fleet = await compare_fleet(kept.columns, kept.store, "golden:toy")
    assert fleet.golden.record == record.id
    assert fleet.count(Mark.DIFFERENT) == [0]


RAWS: dict[Address, st.SearchStrategy[Raw | None]] = {
    LIMIT: st.sampled_from((None, -1, 500, 32767)),
    OFFSET: st.sampled_from((None, -17, 2**31 - 1, -(2**31))),
    MASK: st.sampled_from((None, 0, 1, 65535)),
    NAME: st.sampled_from((None, "", "drive", "a longer name than eight bytes", b"\x01\x02", 5, 2**40, 1.5)),
}


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.fixed_dictionaries(RAWS), min_size=2, max_size=6))
async def test_a_fleet_finds_what_comparing_set_by_set_finds(changes: list[dict[Address, Raw | None]]) -> None:
    sets = [taken(number, change) for number, change in enumerate(changes)]
    made = Kept()
    try:
        fleet = await made.fleet(*sets)
        golden = fleet.golden.column
        for number, one in enumerate(sets):
            pair = compare([golden, made.columns.of_set(fleet.golden.spec, one).column])
            states = {row.address: MARKS[row.state] for row in pair.rows}
            assert found(fleet, number) == {key: states[key] for key in PARAMETERS if key in golden.values}
    finally:
        await made.close()
