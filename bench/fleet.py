"""The whole fleet against a golden set: 5,000 stored sets of 400 parameters, against a loop over 5,000 JSON files.

Ours reads a store file as a running server does, with no set in memory; the peer reads the set files of the same sets,
compares dictionaries, and counts by group. Both must find the same.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import random
import shutil
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from app.cli.runtime import spare_collector
from app.model.address import Address
from app.model.datatypes import DataType, Raw
from app.model.description import Access, Description, Entry, Kind, RestoreClass
from app.model.description_file import load_builtin
from app.model.set_record import Source
from app.model.sets import Identity, Origin, ParameterSet, dump_set, iso_time
from app.service.compare.fleet import Fleet, Mark, compare_fleet
from app.service.compare.ground import Ground
from app.service.compare.sources import Columns
from app.service.library.library import Library
from app.service.office.audit import AuditLog
from app.store.migrations import STEPS
from app.store.store import Store
from bench._priority import preferred
from bench._result import Result

SETS: Final = 5000
PARAMETERS: Final = 400
TARGET: Final = 20.0
LIMIT_S: Final = 0.5
GROUPS: Final = 16
UNIT_BOUND: Final = 3
START_NS: Final = 1_767_225_600_000_000_000
TYPES: Final = (DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32, DataType.INTEGER16, DataType.INTEGER32)
CACHE: Final = Path(__file__).resolve().parent.parent / ".cache" / "bench" / "fleet"
VERSION: Final = 1
"""Of the generated sets: raised with what is generated below."""


@dataclass(frozen=True)
class Line:
    """What both find of one device."""

    device: str
    different: int
    by_group: Mapping[str, int]


@dataclass(frozen=True)
class Run:
    """How long it took, and what was found."""

    elapsed_s: float
    lines: list[Line]


def run(full: bool) -> Result:
    """Compare; ``full`` takes more rounds."""
    return measure(SETS, PARAMETERS, rounds=15 if full else 5)


def measure(sets: int, parameters: int, rounds: int, cache: Path = CACHE) -> Result:
    """Both over the same sets, in turns: what else the machine does meets both alike. The median round counts."""
    description = describe(parameters)
    folder = prepare(cache, description, sets)
    spare_collector()  # as a server does
    with preferred() as scheduling:
        first, found = asyncio.run(_rounds(folder, description, rounds))
    peer_s, own_s = (sorted(one[place].elapsed_s for one in found)[rounds // 2] for place in (0, 1))
    ratio = sorted(peer.elapsed_s / own.elapsed_s for peer, own in found)[rounds // 2]
    alike = {tuple(sorted(map(str, one.lines))) for pair in found for one in pair}
    shortfalls = [] if own_s < LIMIT_S else [f"{own_s:.3f} s, wanted less than {LIMIT_S} s"]
    if len(alike) > 1:
        shortfalls.append("the two do not find the same")
    differing = sum(line.different for line in first.lines)
    return Result(
        ratio,
        TARGET,
        (
            f"{sets} sets of {parameters} parameters, {differing} differences; scheduling: {scheduling}; median round",
            f"json.load and compare, one file after another: {peer_s:.3f} s ({_times(one[0] for one in found)})",
            f"ours, out of the store file: {own_s * 1000:.1f} ms ({_times(one[1] for one in found)})",
            f"the first after it was opened: {first.elapsed_s * 1000:.1f} ms",
        ),
        tuple(shortfalls),
    )


def _times(runs: Iterable[Run]) -> str:
    return " ".join(f"{each.elapsed_s:.3f}" for each in runs)


async def _rounds(folder: Path, description: Description, rounds: int) -> tuple[Run, list[tuple[Run, Run]]]:
    """The first of ours after the store was opened, then the peer and the median of three of ours, in turns."""
    golden = golden_set(description)
    store = Store.open(folder / "store")
    try:
        audit = AuditLog(store)
        library = Library(store, audit, time.time_ns)
        columns = Columns(Ground(time.time_ns, library=library, known=(description,)))
        record = await library.record(golden.hash)
        first = await stored(columns, store, record.id)
        found = []
        for _ in range(rounds):
            peer = naive(folder / "sets", description, golden)
            ours = [await stored(columns, store, record.id) for _ in range(3)]
            found.append((peer, sorted(ours, key=lambda one: one.elapsed_s)[1]))
        await audit.close()
    finally:
        store.close()
    return first, found


# -- the two --------------------------------------------------------------------------


def naive(folder: Path, description: Description, golden: ParameterSet) -> Run:
    """The peer: each file read and compared by itself."""
    start = time.perf_counter()
    wanted = {str(address): raw for address, raw in golden.values.items()}
    groups = {str(entry.address): entry.group for entry in description}
    bound = {str(entry.address) for entry in description if entry.restore is RestoreClass.UNIT}
    lines = []
    for path in folder.iterdir():
        with path.open(encoding="utf-8") as file:
            content = json.load(file)
        values = content["values"]
        counts: dict[str, int] = {}
        for address, raw in wanted.items():
            if values.get(address) != raw and address not in bound:
                group = groups[address]
                counts[group] = counts.get(group, 0) + 1
        lines.append(Line(content["origin"]["device"], sum(counts.values()), counts))
    lines.sort(key=lambda line: -line.different)
    return Run(time.perf_counter() - start, lines)


async def stored(columns: Columns, store: Store, golden: str) -> Run:
    """Ours: the use case of the page; nothing is kept from one to the next."""
    start = time.perf_counter()
    fleet = await compare_fleet(columns, store, f"set:{golden}")
    ranking, counts, different = fleet.ranking(), fleet.by_group, fleet.count(Mark.DIFFERENT)
    elapsed_s = time.perf_counter() - start
    lines = [_line(fleet, member, counts[member].tolist(), different[member]) for member in ranking]
    return Run(elapsed_s, lines)


def _line(fleet: Fleet, member: int, counts: list[int], different: int) -> Line:
    by_group = {group: count for group, count in zip(fleet.groups, counts, strict=True) if count}  # in their order
    return Line(fleet.members[member].device, different, by_group)


# -- what is compared -----------------------------------------------------------------


def describe(parameters: int) -> Description:
    """A kind of device with so many parameters, of the types that drives have."""
    like = load_builtin("oat-pmc")
    groups = tuple(f"group-{number}" for number in range(GROUPS))
    entries = {}
    for number in range(parameters):
        address = Address(0x3000 + number // 8, number % 8 + 1)
        entries[address] = Entry(
            address=address,
            name=f"parameter {number}",
            object_name=f"object {number // 8}",
            kind=Kind.RECORD,
            type=TYPES[number % len(TYPES)],
            access=Access.RW,
            pdo=False,
            default=0,
            saved=True,
            group=groups[number * GROUPS // parameters],
            section="",
            restore=RestoreClass.UNIT if number < UNIT_BOUND else RestoreClass.COPY,
        )
    return replace(like, id="bench-drive", version="1.0.0", entries=entries, groups=groups)


def golden_set(description: Description) -> ParameterSet:
    """The set that all are held against."""
    some = random.Random(1)
    return _set(description, {entry.address: _value(entry, some) for entry in description}, "wtg-0000/blade-1/pmc", 0)


def fleet_sets(description: Description, sets: int) -> Iterator[ParameterSet]:
    """One set of each device: most hardly differ from the golden one, some do in many places."""
    some = random.Random(2)
    golden = golden_set(description).values
    entries = list(description)
    yield golden_set(description)
    for number in range(1, sets):
        values = dict(golden)
        many = some.choice((0, 0, 1, 2, 3, 5, 8)) if number % 100 else len(entries) // 3
        for entry in [*entries[:UNIT_BOUND], *some.sample(entries, many)]:
            values[entry.address] = _value(entry, some)
        yield _set(description, values, f"wtg-{number // 3:04}/blade-{number % 3 + 1}/pmc", number)


def _value(entry: Entry, some: random.Random) -> int:
    low, high = entry.type.range or (0, 0)
    return some.choice((some.randint(low, high), some.randint(max(low, -1000), min(high, 1000))))


def _set(description: Description, values: Mapping[Address, Raw], device: str, number: int) -> ParameterSet:
    taken = iso_time(START_NS + number * 60_000_000_000)
    return ParameterSet(
        description.id,
        description.version,
        Identity(device_type=0x20192, device_name="bench drive", hardware="1", software="2.4", serial=1000 + number),
        Origin(device.partition("/")[0], device, 11, taken, "Tester", "yearly service", "hubside"),
        values,
    )


def prepare(cache: Path, description: Description, sets: int) -> Path:
    """The folder with the store and the set files, made where it is not there yet."""
    schema = hashlib.sha256(repr(STEPS).encode()).hexdigest()[:8]
    folder = cache / f"{VERSION}-{schema}-{sets}-{len(description.entries)}"
    if folder.is_dir():
        return folder
    making = folder.with_name(f"{folder.name}.making")
    shutil.rmtree(making, ignore_errors=True)
    (making / "sets").mkdir(parents=True)
    whole = list(fleet_sets(description, sets))
    for number, one in enumerate(whole):
        (making / "sets" / f"{number}.json").write_text(dump_set(one), encoding="utf-8")
    asyncio.run(_fill(making / "store", whole))
    making.rename(folder)
    return folder


async def _fill(folder: Path, sets: list[ParameterSet]) -> None:
    store = Store.open(folder)
    try:
        audit = AuditLog(store)
        library = Library(store, audit, time.time_ns)
        for start in range(0, len(sets), 250):
            await library.put(sets[start : start + 250], Source.FILE)
        await audit.close()
    finally:
        store.close()
