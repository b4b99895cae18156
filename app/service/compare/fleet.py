"""One golden set against the latest set of every device of its kind: what differs where, and who stands out.

Vectors are compared as numbers (``model.set_vector``): thousands of sets in some hundredths of a second.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from app.model.address import Address
from app.model.description import Description, Entry, RestoreClass
from app.model.diff.compare import is_parameter
from app.model.set_vector import WIDTH, layout_of, pack, parse_layout
from app.service.compare.sources import Columns, Shown
from app.service.compare.spec import ColumnKind, ColumnSpec
from app.store.fleet_rows import layouts_of, scan_latest
from app.store.store import Connection, Store

Bools = npt.NDArray[np.bool_]
Counts = npt.NDArray[np.int64]
Indices = npt.NDArray[np.intp]

_WORD: Final = np.dtype(f"<u{WIDTH}")


class Mark(Enum):
    """One parameter of one device beside the golden set; ``UNIT``: it differs, and is bound to the single unit."""

    SAME = "same"
    DIFFERENT = "different"
    UNIT = "unit"
    MISSING = "missing"


@dataclass(frozen=True, slots=True)
class Member:
    """The latest set of one device. ``version`` is that of the description that it was read by."""

    record: str
    device: str
    t_ns: int
    version: str


@dataclass(frozen=True, slots=True)
class Fleet:
    """``members`` in the order of the rows of ``differs`` and ``lacks``, ``entries`` in that of their columns.

    ``entries`` are the parameters that the golden set has, group by group. ``foreign`` are devices whose sets were read
    by a description of another major version: they are not compared.
    """

    golden: Shown
    entries: tuple[Entry, ...]
    members: tuple[Member, ...]
    foreign: tuple[Member, ...]
    differs: Bools
    lacks: Bools

    @property
    def groups(self) -> tuple[str, ...]:
        """The groups of the entries, in their order."""
        return tuple(dict.fromkeys(entry.group for entry in self.entries))

    @property
    def bound(self) -> Bools:
        """Which entries may differ, because they are bound to the single unit."""
        return np.array([entry.restore is RestoreClass.UNIT for entry in self.entries], bool)

    def by_group(self) -> Counts:
        """Differences that must not be, a row for each member and a column for each group."""
        groups = self.groups
        starts = [next(n for n, entry in enumerate(self.entries) if entry.group == group) for group in groups]
        if not groups:
            return np.zeros((len(self.members), 0), np.int64)
        return np.add.reduceat(self.differs & ~self.bound, starts, axis=1, dtype=np.int64)

    def ranking(self) -> list[int]:
        """Rows of the members: most differences first, then what is missing, then by device."""
        different, missing = self.count(Mark.DIFFERENT), self.count(Mark.MISSING)
        return sorted(range(len(self.members)), key=lambda n: (-different[n], -missing[n], self.members[n].device))

    def count(self, mark: Mark) -> list[int]:
        """How often each member has it."""
        return [int(count) for count in np.count_nonzero(self._marked(mark), axis=1)]

    def per_entry(self, mark: Mark) -> list[int]:
        """How many members have it at each entry."""
        return [int(count) for count in np.count_nonzero(self._marked(mark), axis=0)]

    def marks(self, member: int) -> Iterator[Mark]:
        """One member's row."""
        for differs, lacks, bound in zip(self.differs[member], self.lacks[member], self.bound, strict=True):
            if lacks:
                yield Mark.MISSING
            elif differs:
                yield Mark.UNIT if bound else Mark.DIFFERENT
            else:
                yield Mark.SAME

    def _marked(self, mark: Mark) -> Bools:
        match mark:
            case Mark.MISSING:
                return self.lacks
            case Mark.DIFFERENT:
                return self.differs & ~self.bound
            case Mark.UNIT:
                return self.differs & self.bound
            case Mark.SAME:
                return ~(self.differs | self.lacks)


async def compare_fleet(columns: Columns, store: Store, golden: str) -> Fleet:
    """Compare the latest set of every device with ``golden``: a record, the beginning of a hash, or a description's id.

    Of a description its golden set is taken. Raises ColumnError, StoreError.
    """
    tagged = columns.ground.description(golden) is not None
    spec = ColumnSpec(ColumnKind.GOLDEN if tagged else ColumnKind.SET, golden)
    shown = await columns.resolve(str(spec))
    scan = _Scan(shown)
    await store.run(scan.read)
    return scan.fleet()


class _Scan:
    """Reads the sets, some at a time, and keeps what differs. For the store's thread."""

    def __init__(self, golden: Shown) -> None:
        self._golden = golden
        self._entries = _parameters(golden)
        self._major = _major(golden.column.version)
        self._plans: dict[int, _Plan] = {}
        self._foreign: dict[int, str] = {}
        self._members: list[Member] = []
        self._strangers: list[Member] = []
        self._differs: list[Bools] = []
        self._lacks: list[Bools] = []

    def read(self, connection: Connection) -> None:
        layouts = layouts_of(connection, self._golden.column.description.id)
        for number, (version, addresses) in layouts.items():
            if _major(version) == self._major:
                self._plans[number] = _Plan(self._golden, self._entries, version, addresses)
            else:
                self._foreign[number] = version
        scan_latest(connection, list(layouts), self._take)

    def _take(self, rows: Sequence[Any]) -> None:
        by_layout: dict[int, list[Any]] = {}
        for row in rows:
            by_layout.setdefault(row[3], []).append(row)
        for number, some in by_layout.items():
            plan = self._plans.get(number)
            if plan is None:
                version = self._foreign[number]
                self._strangers += [Member(record, device, t_ns, version) for record, device, t_ns, *_ in some]
            else:
                self._members += [Member(record, device, t_ns, plan.version) for record, device, t_ns, *_ in some]
                self._differs.append(plan.differs(b"".join([row[4] for row in some])))
                self._lacks.append(np.broadcast_to(plan.lacks, (len(some), len(plan.lacks))))

    def fleet(self) -> Fleet:
        none = np.zeros((0, len(self._entries)), bool)
        return Fleet(
            self._golden,
            self._entries,
            tuple(self._members),
            tuple(self._strangers),
            np.concatenate([none, *self._differs]),
            np.concatenate([none, *self._lacks]),
        )


class _Plan:
    """How sets of one layout are compared with the golden one: which words of theirs with which of its."""

    def __init__(self, golden: Shown, entries: Sequence[Entry], version: str, addresses: Sequence[str]) -> None:
        self.version = version
        theirs = _places(addresses)
        self._words = sum(count for _start, count in theirs.values())
        layout = layout_of(golden.column.values)
        values = np.frombuffer(pack(golden.column.values, layout), _WORD)
        ours = _places(layout)
        own: list[int] = []
        other: list[int] = []
        self._starts: list[int] = []
        self._there: list[int] = []
        alike = np.ones(len(entries), bool)
        self.lacks = np.zeros(len(entries), bool)
        for number, entry in enumerate(entries):
            start, count = ours[entry.address]
            if entry.address not in theirs:
                self.lacks[number] = True
            elif theirs[entry.address][1] != count:
                alike[number] = False  # one takes more room than the other: they cannot be equal
            else:
                self._starts.append(len(own))
                self._there.append(number)
                own += range(start, start + count)
                other += range(theirs[entry.address][0], theirs[entry.address][0] + count)
        self._alike = alike
        self._golden = values[own]
        self._other = np.array(other, np.intp)
        self._wide = len(own) > len(self._starts)

    def differs(self, vectors: bytes) -> Bools:
        """A row for each vector, a column for each entry."""
        words = np.frombuffer(vectors, _WORD).reshape(-1, self._words)
        unequal: Bools = words[:, self._other] != self._golden
        if self._wide:
            unequal = np.logical_or.reduceat(unequal, self._starts, axis=1)
        if len(self._there) == len(self._alike):
            return unequal
        found = np.broadcast_to(~self._alike, (len(words), len(self._alike))).copy()
        found[:, self._there] = unequal
        return found


def _places(layout: Sequence[str]) -> dict[Address, tuple[int, int]]:
    """Where the words of each address begin, and how many there are."""
    places, start = {}, 0
    for address, count in parse_layout(layout):
        places[address] = start, count
        start += count
    return places


def _parameters(golden: Shown) -> tuple[Entry, ...]:
    """The parameters that the golden set has, group by group."""
    description: Description = golden.column.description
    groups = {group: place for place, group in enumerate(description.groups)}
    found = [one for one in description if is_parameter(one) and one.address in golden.column.values]
    return tuple(sorted(found, key=lambda one: (groups.get(one.group, len(groups)), one.address[:2])))


def _major(version: str) -> str:
    return version.partition(".")[0]
