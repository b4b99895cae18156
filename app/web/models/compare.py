"""Comparisons as the page gets them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from app.model.diff.bits import BitRow
from app.model.diff.column import Cell
from app.model.diff.compare import Row, Summary
from app.service.compare.comparison import Compared
from app.service.compare.sources import Shown
from app.service.views import RawJson, raw_to_json
from app.web.models.writes import RawIn

MAX_COLUMNS = 12

ColumnKindName = Literal[
    "live",
    "stored",
    "editor",
    "default",
    "set",
    "file",
    "golden",
    "delivered",
    "found",
    "left",
    "year",
    "latest",
    "moment",
]
RowStateName = Literal["same", "different", "unit", "missing", "not-comparable"]
CellStateName = Literal["value", "not-in-set", "not-on-device", "unread", "empty"]
RestoreClassName = Literal["copy", "unit", "factory", "network", "never"]

Spec = Annotated[str, Field(max_length=300, examples=["live:wtg-07/blade-1/pmc"])]
Slug = Annotated[str, Field(max_length=200)]
AddressText = Annotated[str, Field(max_length=20)]


class CompareRequest(BaseModel):
    """``columns`` are specs such as ``live:wtg-07/blade-2/pmc``; ``pending`` are changes by device and address.

    ``all`` compares process values too, else parameters only.
    """

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "examples": [{"columns": ["live:wtg-07/blade-1/pmc", "default:wtg-07/blade-1/pmc"], "pending": {}}]
        },
    )

    columns: Annotated[list[Spec], Field(min_length=2, max_length=MAX_COLUMNS)]
    pending: Annotated[dict[Slug, Annotated[dict[AddressText, RawIn], Field(max_length=500)]], Field(max_length=12)] = (
        Field(default_factory=dict)
    )
    all: bool = False


class ColumnDoc(BaseModel):
    """What stands above a column. ``t_ns`` null: of no time, as defaults; ``twin`` null: nothing says what it is of.

    ``hash`` and ``record`` only where it is a kept set; ``complete``: nothing was left unread.
    """

    spec: str
    kind: ColumnKindName
    device: str
    description_id: str
    description_version: str
    t_ns: int | None
    person: str
    reason: str
    hash: str | None
    record: str | None
    complete: bool
    twin: bool | None

    @classmethod
    def of(cls, shown: Shown) -> ColumnDoc:
        """As the page gets it."""
        column = shown.column
        return cls(
            spec=str(shown.spec),
            kind=shown.spec.kind.value,
            device=column.slug,
            description_id=column.description.id,
            description_version=column.version,
            t_ns=shown.t_ns,
            person=shown.person,
            reason=shown.reason,
            hash=shown.hash,
            record=shown.record,
            complete=shown.complete,
            twin=shown.twin,
        )


class CellDoc(BaseModel):
    """One value: ``shown`` in ``unit``; ``text_key`` where an enumeration names it; ``reason`` why it is unread."""

    state: CellStateName
    raw: RawJson | None
    shown: str
    unit: str
    text_key: str | None
    reason: str

    @classmethod
    def of(cls, cell: Cell) -> CellDoc:
        """As the page gets it."""
        return cls(
            state=cell.state.value,
            raw=None if cell.raw is None else raw_to_json(cell.raw),
            shown=cell.shown,
            unit=cell.unit,
            text_key=cell.text_key,
            reason=cell.reason,
        )


class BitDoc(BaseModel):
    """One bit, or the field ``bit`` to ``last``, in every column; null where a column has no number there.

    ``text_key`` null: no table names it.
    """

    bit: int
    last: int
    text_key: str | None
    clamp: str
    differs: bool
    values: list[int | None]

    @classmethod
    def of(cls, row: BitRow) -> BitDoc:
        """As the page gets it."""
        return cls(
            bit=row.bit,
            last=row.last,
            text_key=row.text_key,
            clamp=row.clamp,
            differs=row.differs,
            values=list(row.values),
        )


class CompareRow(BaseModel):
    """One address, a cell for each column. ``group`` is a key below ``group.``; ``restore`` its class.

    ``rescaled``: equal raw values stand for other quantities, because what their unit rests on differs.
    ``findings``: ids of the rules that are broken here in any column, the gravest first; ``found_in``: the columns of
    each, counted from 0.
    """

    address: str
    group: str
    restore: RestoreClassName
    save_category: str | None
    name: str
    state: RowStateName
    rescaled: bool
    cells: list[CellDoc]
    bits: list[BitDoc]
    findings: list[str]
    found_in: dict[str, list[int]]

    @classmethod
    def of(cls, row: Row, findings: Mapping[str, Sequence[int]]) -> CompareRow:
        """As the page gets it."""
        return cls(
            address=row.address.short,
            group=row.entry.group,
            restore=row.entry.restore.value,
            save_category=row.entry.save_category,
            name=row.entry.title,
            state=row.state.value,
            rescaled=row.rescaled,
            cells=[CellDoc.of(cell) for cell in row.cells],
            bits=[BitDoc.of(bit) for bit in row.bits],
            findings=list(findings),
            found_in={rule: list(numbers) for rule, numbers in findings.items()},
        )


class SummaryDoc(BaseModel):
    """Rows by state: the first five add up to all. ``unread``: rows of any state in which a value was not read.

    ``undescribed``: objects in no row, because no description here knows them; so many as ``undescribed_different`` are
    not the same in every column.
    """

    model_config = ConfigDict(from_attributes=True)

    different: int
    same: int
    unit: int
    missing: int
    not_comparable: int
    unread: int
    undescribed: int
    undescribed_different: int

    @classmethod
    def of(cls, summary: Summary) -> SummaryDoc:
        """As the page gets it."""
        return cls.model_validate(summary)


class ComparisonDoc(BaseModel):
    """Columns side by side: all rows, group by group; the page hides those that are the same."""

    columns: list[ColumnDoc]
    rows: list[CompareRow]
    summary: SummaryDoc

    @classmethod
    def of(cls, compared: Compared) -> ComparisonDoc:
        """As the page gets it."""
        return cls(
            columns=[ColumnDoc.of(one) for one in compared.columns],
            rows=[CompareRow.of(row, compared.findings.get(row.address, {})) for row in compared.comparison.rows],
            summary=SummaryDoc.of(compared.comparison.summary),
        )
