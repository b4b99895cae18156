"""One golden set against the latest set of every device of its kind: what differs where, and who stands out.

Vectors are compared as numbers (``model.set_vector``): thousands of sets in some hundredths of a second. They are raw
values: where the scale of a position differs, it is the scale itself that is counted, not each position.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Any, Final, NamedTuple, overload

import numpy as np
import numpy.typing as npt

from app.model.description import Description, Entry, RestoreClass
from app.model.set_vector import WIDTH, layout_of, pack, places
from app.service.compare.sources import Columns, Shown
from app.store.fleet_rows import layouts_of, scan_latest
from app.store.store import Connection, Store

Bools = npt.NDArray[np.bool_]
Counts = npt.NDArray[np.uint16]
Indices = npt.NDArray[np.intp]

_WORD: Final = np.dtype(f"<u{WIDTH}")


class Mark(Enum):
    """One parameter of one device beside the golden set; ``UNIT``: it differs, and is bound to the single unit."""

    SAME = "same"
    DIFFERENT = "different"
    UNIT = "unit"
    MISSING = "missing"


class Member(NamedTuple):
    """The latest set of one device. ``version`` is that of the description that it was read by."""

    device: str
    record: str
    t_ns: int
    version: str


class Members(Sequence[Member]):
    """Many of them, kept as columns: thousands are found before a few are shown."""

    def __init__(self) -> None:
        self._columns: tuple[list[Any], ...] = ([], [], [], [])

    def add(self, devices: Sequence[str], records: Sequence[str], times: Sequence[int], version: str) -> None:
        """Add some that have the version in common."""
        versions = [version] * len(devices)
        for column, more in zip(self._columns, (devices, records, times, versions), strict=True):
            column += more

    def __len__(self) -> int:
        return len(self._columns[0])

    @overload
    def __getitem__(self, place: int) -> Member: ...

    @overload
    def __getitem__(self, place: slice) -> list[Member]: ...

    def __getitem__(self, place: int | slice) -> Member | list[Member]:
        if isinstance(place, slice):
            return [self[one] for one in range(*place.indices(len(self)))]
        return Member(*(column[place] for column in self._columns))


@dataclass(frozen=True)
class Fleet:
    """``members`` in the order of the rows of ``differs``, ``entries`` in that of its columns.

    ``entries`` are the parameters that the golden set has, group by group; ``bound`` tells which of them may differ,
    because they are bound to the single unit. Sets that were read alike lack the same: ``lacks`` has a row for each
    ``layout`` that a member may have. ``foreign`` are devices whose sets were read by a description of another major
    version: they are not compared.
    """

    golden: Shown
    entries: tuple[Entry, ...]
    bound: Bools
    members: Sequence[Member]
    foreign: Sequence[Member]
    differs: Bools
    layout: Indices
    lacks: Bools

    @property
    def groups(self) -> tuple[str, ...]:
        """The groups of the entries, in their order."""
        return tuple(dict.fromkeys(entry.group for entry in self.entries))

    @cached_property
    def by_group(self) -> Counts:
        """Differences that must not be, a row for each member and a column for each group."""
        return self._grouped(self.differs & ~self.bound)

    @cached_property
    def missing_by_group(self) -> Counts:
        """What is missing, a row for each member and a column for each group."""
        found: Counts = self._grouped(self.lacks)[self.layout]
        return found

    def _grouped(self, marked: Bools) -> Counts:
        names = [entry.group for entry in self.entries]
        starts = [names.index(group) for group in self.groups]  # the entries of a group stand together
        if not starts:
            return np.zeros((len(marked), 0), np.uint16)
        found: Counts = np.add.reduceat(marked, starts, axis=1, dtype=np.uint16)
        return found

    def ranking(self) -> list[int]:
        """Rows of the members: most differences first, then what is missing, then as they come."""
        rows: list[int] = np.lexsort((-self._count(Mark.MISSING), -self._count(Mark.DIFFERENT))).tolist()
        return rows

    def count(self, mark: Mark) -> list[int]:
        """How often each member has it."""
        counts: list[int] = self._count(mark).tolist()
        return counts

    def _count(self, mark: Mark) -> npt.NDArray[np.intp]:
        counts: npt.NDArray[np.intp]
        if mark is Mark.DIFFERENT:
            counts = self.by_group.sum(axis=1, dtype=np.intp)
        elif mark is Mark.MISSING:
            counts = np.count_nonzero(self.lacks, axis=1)[self.layout]
        else:
            counts = np.count_nonzero(self._marked(mark), axis=1)
        return counts

    def per_entry(self, mark: Mark) -> list[int]:
        """How many members have it at each entry."""
        counts: list[int] = np.count_nonzero(self._marked(mark), axis=0).tolist()
        return counts

    def marks(self, member: int) -> Iterator[Mark]:
        """One member's row."""
        lacking = self.lacks[self.layout[member]]
        for differs, lacks, bound in zip(self.differs[member], lacking, self.bound, strict=True):
            if lacks:
                yield Mark.MISSING
            elif differs:
                yield Mark.UNIT if bound else Mark.DIFFERENT
            else:
                yield Mark.SAME

    def _marked(self, mark: Mark) -> Bools:
        match mark:
            case Mark.MISSING:
                return self.lacks[self.layout]
            case Mark.DIFFERENT:
                return self.differs & ~self.bound
            case Mark.UNIT:
                return self.differs & self.bound
            case Mark.SAME:
                return ~(self.differs | self.lacks[self.layout])


async def compare_fleet(columns: Columns, store: Store, golden: str) -> Fleet:
    """Compare the latest set of every device with a column, such as ``golden:oat-pmc`` or ``set:0195f3a2``.

    Raises ColumnError, StoreError.
    """
    scan = _Scan(await columns.resolve(golden))
    await store.run(scan.read)
    return scan.fleet()


class _Scan:
    """Reads the sets, some at a time, and keeps what differs. For the store's thread."""

    def __init__(self, golden: Shown) -> None:
        self._golden = golden
        self._entries = _parameters(golden)
        self._plans: dict[int, _Plan] = {}
        self._members = Members()
        self._strangers = Members()
        self._differs: list[Bools] = []
        self._layouts: list[int] = []

    def read(self, connection: Connection) -> None:
        """Scan the store."""
        column = self._golden.column
        layouts = layouts_of(connection, column.description.id)
        layout = layout_of(column.values)
        words = _Words(places(layout), np.frombuffer(pack(column.values, layout), _WORD))
        for number, (version, addresses) in layouts.items():
            foreign = _major(version) != _major(column.version)
            self._plans[number] = _Plan(words, self._entries, version, addresses, len(self._plans), foreign)
        scan_latest(connection, list(layouts), self._take)

    def _take(self, rows: Sequence[Any]) -> None:
        for number, some in groupby(rows, key=itemgetter(3)):
            plan = self._plans[number]
            devices, records, times, _layouts, vectors = zip(*some, strict=True)
            if plan.foreign:
                self._strangers.add(devices, records, times, plan.version)
                continue
            self._members.add(devices, records, times, plan.version)
            self._differs.append(plan.differs(b"".join(vectors)))
            self._layouts += [plan.number] * len(devices)

    def fleet(self) -> Fleet:
        """What was found."""
        none = np.zeros((0, len(self._entries)), bool)
        return Fleet(
            golden=self._golden,
            entries=self._entries,
            bound=np.array([entry.restore is RestoreClass.UNIT for entry in self._entries], bool),
            members=self._members,
            foreign=self._strangers,
            differs=np.concatenate([none, *self._differs]),
            layout=np.array(self._layouts, np.intp),
            lacks=np.array([plan.lacks for plan in self._plans.values()], bool).reshape(-1, len(self._entries)),
        )


@dataclass(frozen=True, slots=True)
class _Words:
    """The golden set: where the words of each address begin, how many there are, and all words."""

    places: Mapping[str, tuple[int, int]]
    words: npt.NDArray[np.uint32]


class _Plan:
    """How sets of one layout are compared with the golden one: which words of theirs with which of its."""

    def __init__(
        self,
        golden: _Words,
        entries: Sequence[Entry],
        version: str,
        addresses: Sequence[str],
        number: int,
        foreign: bool,
    ) -> None:
        self.version, self.number, self.foreign = version, number, foreign
        theirs = places(addresses)
        self._words = sum(count for _start, count in theirs.values())
        own: list[int] = []
        other: list[int] = []
        self._starts: list[int] = []
        self._there: list[int] = []
        self._unlike = np.zeros(len(entries), bool)
        self.lacks = np.zeros(len(entries), bool)
        for number, entry in enumerate(entries):
            text = str(entry.address)
            start, count = golden.places[text]
            place = theirs.get(text)
            if place is None:
                self.lacks[number] = True
            elif place[1] != count:
                self._unlike[number] = True  # one takes more room than the other: they cannot be equal
            else:
                self._starts.append(len(own))
                self._there.append(number)
                own += range(start, start + count)
                other += range(place[0], place[0] + count)
        self._golden = golden.words[own]
        self._other = _slice_of(other)

    def differs(self, vectors: bytes) -> Bools:
        """A row for each vector, a column for each entry."""
        words = np.frombuffer(vectors, _WORD).reshape(-1, self._words)
        unequal: Bools = words[:, self._other] != self._golden
        if len(self._starts) < len(self._golden):
            unequal = np.logical_or.reduceat(unequal, self._starts, axis=1)
        if len(self._there) == len(self._unlike):
            return unequal
        found = np.broadcast_to(self._unlike, (len(words), len(self._unlike))).copy()
        found[:, self._there] = unequal
        return found


def _slice_of(numbers: list[int]) -> slice | Indices:
    """The numbers as a slice where they follow one another, which spares a copy."""
    if numbers and numbers == list(range(numbers[0], numbers[0] + len(numbers))):
        return slice(numbers[0], numbers[0] + len(numbers))
    return np.array(numbers, np.intp)


def _parameters(golden: Shown) -> tuple[Entry, ...]:
    """The parameters that the golden set has, group by group."""
    description: Description = golden.column.description
    groups = {group: place for place, group in enumerate(description.groups)}
    found = [one for one in description if one.is_parameter and one.address in golden.column.values]
    return tuple(sorted(found, key=lambda one: (groups.get(one.group, len(groups)), one.address[:2])))


def _major(version: str) -> str:
    return version.partition(".")[0]
