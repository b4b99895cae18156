"""Comparisons: states of rows and cells, masks, scales, foreign versions; and what holds for any columns."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.model.address import Address
from app.model.datatypes import DataType, Raw
from app.model.description import Description, Quantity, RestoreClass
from app.model.diff.column import CellState, Column
from app.model.diff.compare import Comparison, Row, RowState, compare
from app.model.set_head import NOT_IN_FILE
from tests.model.diff.devices import (
    ACCELERATION,
    ACTUAL,
    FEED,
    KIND,
    LIMIT,
    MASK,
    MIRROR,
    NAME,
    OFFSET,
    PARAMETERS,
    POSITION,
    TOY,
    VALUES,
    column,
    describe,
    entry,
)


def row_of(found: Comparison, address: Address) -> Row:
    return next(row for row in found.rows if row.address == address)


def state(address: Address, *columns: Column) -> RowState:
    return row_of(compare(columns), address).state


def test_equal_columns_match_in_every_parameter_and_in_nothing_else() -> None:
    found = compare([column(), column()])
    assert {row.address for row in found.rows} == set(PARAMETERS), "no process value, no mirror"
    assert found.summary.same == found.summary.rows == len(PARAMETERS)
    assert {row.address for row in compare([column(), column()], everything=True).rows} == set(VALUES)


def test_rows_stand_group_by_group_as_the_description_has_them() -> None:
    assert [row.address for row in compare([column(), column()]).rows][:2] == [MASK, LIMIT]


def test_a_value_is_shown_in_its_unit_and_by_its_name() -> None:
    cells = row_of(compare([column(), column({LIMIT: 495})]), LIMIT).cells
    assert [(cell.raw, cell.shown, cell.unit) for cell in cells] == [(500, "50.0", "°C"), (495, "49.5", "°C")]
    named = row_of(compare([column(), column({KIND: 2})]), KIND).cells
    assert [cell.text_key for cell in named] == ["enum.one", None]


@pytest.mark.parametrize(
    ("address", "raw", "wanted"),
    [
        (LIMIT, 501, RowState.DIFFERENT),
        (OFFSET, -18, RowState.UNIT),
        (NAME, "drivf", RowState.DIFFERENT),
        (LIMIT, None, RowState.MISSING),
        (OFFSET, None, RowState.MISSING),
    ],
)
def test_what_one_of_three_has_otherwise(address: Address, raw: Raw | None, wanted: RowState) -> None:
    assert state(address, column(), column({address: raw}), column()) is wanted


def test_a_difference_counts_more_than_a_gap() -> None:
    assert state(LIMIT, column(), column({LIMIT: None}), column({LIMIT: 1})) is RowState.DIFFERENT


def test_why_there_is_no_value_is_told_apart() -> None:
    without = describe("1.2.0")
    without = replace(without, entries={key: one for key, one in without.entries.items() if key != LIMIT})
    gone: dict[Address, Raw | None] = {LIMIT: None}
    others = [
        column(gone),
        column(gone, without),
        column(gone, unread={LIMIT: "no_answer"}),
        column(gone, unread={LIMIT: "abort 06020000h"}),
        column(gone, unread={LIMIT: NOT_IN_FILE}),
        column(gone, empty=frozenset({LIMIT})),
    ]
    found = compare([column(), *others])
    row = row_of(found, LIMIT)
    assert [cell.state for cell in row.cells] == [
        CellState.VALUE,
        CellState.NOT_IN_SET,
        CellState.NOT_ON_DEVICE,
        CellState.UNREAD,
        CellState.NOT_ON_DEVICE,
        CellState.NOT_IN_SET,
        CellState.EMPTY,
    ]
    assert row.cells[3].reason == "no_answer"
    assert (row.state, found.summary.missing, found.summary.unread) == (RowState.MISSING, 1, 1)


def test_a_value_that_its_own_description_lacks_is_bound_to_no_unit() -> None:
    """Two columns of one kind have a value at an address that only the third, of another kind, knows."""
    known = {key: one for key, one in TOY.entries.items() if key != OFFSET}
    lacking, other = replace(TOY, entries=known), replace(TOY, id="other")
    columns = [column({}, lacking), column({OFFSET: 5}, lacking), column({OFFSET: None}, other)]
    assert state(OFFSET, *columns) is RowState.DIFFERENT


def test_values_that_no_description_knows_are_counted() -> None:
    new: dict[Address, Raw | None] = {Address(0x2FF0): 1, Address(0x2FF1): 2, Address(0x2FF2): 3}
    found = compare([column(new), column({**new, Address(0x2FF1): 9, Address(0x2FF2): None})])
    assert (found.summary.undescribed, found.summary.undescribed_different) == (3, 2)
    assert (found.summary.rows, found.summary.different) == (len(PARAMETERS), 0), "they are no rows"
    equal = compare([column(new), column(new)]).summary
    assert (equal.undescribed, equal.undescribed_different) == (3, 0)
    assert compare([column(), column()]).summary.undescribed == 0


def test_what_another_description_knows_is_a_row_and_not_counted_again() -> None:
    lacking = replace(TOY, entries={key: one for key, one in TOY.entries.items() if key != LIMIT})
    found = compare([column(), column({}, lacking)])
    assert LIMIT in {row.address for row in found.rows}
    assert found.summary.undescribed == 0


def test_what_no_column_has_is_no_row_and_what_is_empty_everywhere_matches() -> None:
    gone: dict[Address, Raw | None] = {LIMIT: None}
    assert LIMIT not in {row.address for row in compare([column(gone), column(gone)]).rows}
    empty = column(gone, empty=frozenset({LIMIT}))
    assert state(LIMIT, empty, empty) is RowState.SAME
    unread = column(gone, unread={LIMIT: "no_answer"})
    assert state(LIMIT, unread, unread) is RowState.MISSING, "two unknown values are not known to be equal"


# -- masks ----------------------------------------------------------------------------


def test_masks_are_compared_bit_by_bit_with_names_and_clamps() -> None:
    row = row_of(compare([column({MASK: 0x21}), column({MASK: 0x30}), column({MASK: None})]), MASK)
    fan, mode = row.bits
    assert (fan.text_key, fan.clamp, fan.values, fan.differs) == ("bit.fan", "X1.1", (1, 0, None), True)
    assert (mode.bit, mode.last, mode.values, mode.differs) == (4, 5, (2, 3, None), True)


def test_a_bit_without_a_name_is_told_where_it_is_set() -> None:
    row = row_of(compare([column({MASK: 0x8001}), column({MASK: 0x0001})]), MASK)
    assert [(bit.bit, bit.text_key, bit.values) for bit in row.bits if bit.differs] == [(15, None, (1, 0))]


# -- meaning --------------------------------------------------------------------------


def test_the_same_number_on_another_scale_is_no_match() -> None:
    """A position counts in units of the feed: with another feed the same raw value is another angle."""
    row = row_of(compare([column(), column({FEED: 7200})]), POSITION)
    assert (row.state, row.rescaled) == (RowState.DIFFERENT, True)
    assert [cell.shown for cell in row.cells] == ["100.0", "50.00"]


def test_an_unknown_scale_is_no_difference() -> None:
    row = row_of(compare([column(), column({FEED: None}, unread={FEED: "no_answer"})]), POSITION)
    assert (row.state, row.rescaled) == (RowState.SAME, False)


def test_a_mirror_of_16_bits_hides_what_its_object_shows() -> None:
    """70,000 and 4,464 look alike in the lower half: the parameter itself differs, and it is what counts."""
    other = column({ACCELERATION: 70_000 - 65_536})
    found = compare([column(), other], everything=True)
    assert row_of(found, MIRROR).state is RowState.SAME
    assert row_of(found, ACCELERATION).state is RowState.DIFFERENT
    assert state(ACCELERATION, column(), other) is RowState.DIFFERENT


# -- foreign versions -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("description", "version"),
    [
        (replace(TOY, id="another"), "1.2.0"),
        (TOY, "2.0.0"),
        (describe("1.3.0", entry(LIMIT, DataType.INTEGER32, quantity=Quantity("°C", Decimal("0.1")))), "1.3.0"),
        (describe("1.3.0", entry(LIMIT, DataType.INTEGER16, quantity=Quantity("°C", Decimal(1)))), "1.3.0"),
        (describe("1.3.0", entry(LIMIT, DataType.INTEGER16, quantity=Quantity("K", Decimal("0.1")))), "1.3.0"),
    ],
    ids=("kind", "major version", "type", "scale", "unit"),
)
def test_what_is_meant_otherwise_is_not_compared(description: Description, version: str) -> None:
    foreign = replace(column(), description=description, version=version)
    found = compare([column(), foreign, column()])
    assert row_of(found, LIMIT).state is RowState.NOT_COMPARABLE
    assert all(cell.shown for cell in row_of(found, LIMIT).cells), "it is shown all the same"


def test_a_compatible_version_is_compared_where_it_means_the_same() -> None:
    newer = column(description=describe("1.9.0", entry(LIMIT, DataType.INTEGER32), entry(Address(0x2100))))
    found = compare([column(), newer])
    assert found.summary.not_comparable == 1
    assert found.summary.same == len(PARAMETERS) - 1


def test_a_class_that_only_one_version_has_does_not_allow_a_difference() -> None:
    newer = describe("1.3.0", entry(OFFSET, DataType.INTEGER32, restore=RestoreClass.COPY))
    assert state(OFFSET, column(), column({OFFSET: 5}, newer)) is RowState.DIFFERENT


# -- any columns ----------------------------------------------------------------------

RAWS: dict[Address, st.SearchStrategy[Raw]] = {
    LIMIT: st.integers(498, 502),
    MASK: st.integers(0, 3),
    OFFSET: st.integers(-2, 2),
    FEED: st.sampled_from((0, 3600, 7200)),
    POSITION: st.integers(0, 1),
    NAME: st.sampled_from(("a", "b")),
    ACTUAL: st.integers(0, 1),
}
VERSIONS = [TOY, describe("1.3.0", entry(LIMIT, DataType.INTEGER32)), replace(TOY, id="another"), describe("2.0.0")]


@st.composite
def columns(draw: st.DrawFn) -> Column:
    changes: dict[Address, Raw | None] = {address: draw(raws | st.none()) for address, raws in RAWS.items()}
    gone = [address for address, raw in changes.items() if raw is None]
    unread = {
        address: draw(st.sampled_from(("no_answer", "abort 06020000h"))) for address in gone if draw(st.booleans())
    }
    empty = frozenset(address for address in gone if address not in unread and draw(st.booleans()))
    return column(changes, draw(st.sampled_from(VERSIONS)), unread=unread, empty=empty)


@settings(max_examples=60)
@given(st.lists(columns(), min_size=2, max_size=4), st.randoms(use_true_random=False), st.booleans())
def test_the_order_of_the_columns_changes_no_row(given_columns: list[Column], chance: object, everything: bool) -> None:
    turned = list(given_columns)
    chance.shuffle(turned)  # type: ignore[attr-defined]
    one, other = compare(given_columns, everything), compare(turned, everything)
    assert {row.address: (row.state, row.rescaled) for row in one.rows} == {
        row.address: (row.state, row.rescaled) for row in other.rows
    }
    assert one.summary == other.summary


@settings(max_examples=60)
@given(st.lists(columns(), min_size=2, max_size=4), st.booleans())
def test_the_summary_adds_up_and_every_state_is_what_the_cells_say(
    given_columns: list[Column], everything: bool
) -> None:
    found = compare(given_columns, everything)
    assert found.summary.rows == len(found.rows)
    assert len({row.address for row in found.rows}) == len(found.rows)
    for row in found.rows:
        raws = [cell.raw for cell in row.cells if cell.state is CellState.VALUE]
        kinds = {one.description.id for one, cell in zip(given_columns, row.cells, strict=True) if cell.raw is not None}
        assert all((cell.raw is None) == (cell.state is not CellState.VALUE) for cell in row.cells)
        match row.state:
            case RowState.SAME:
                assert len(set(raws)) <= 1 and (len(raws) == len(row.cells) or not raws)
            case RowState.MISSING:
                assert len(set(raws)) <= 1 and len(raws) < len(row.cells)
            case RowState.DIFFERENT | RowState.UNIT:
                assert len(set(raws)) > 1 or row.rescaled
            case RowState.NOT_COMPARABLE:
                assert len(raws) > 1
        assert row.state is RowState.NOT_COMPARABLE or len(kinds) <= 1


@settings(max_examples=60)
@given(columns(), st.integers(2, 12))
def test_a_column_beside_itself_differs_nowhere(one: Column, times: int) -> None:
    summary = compare([one] * times, everything=True).summary
    assert (summary.different, summary.unit, summary.not_comparable) == (0, 0, 0)
