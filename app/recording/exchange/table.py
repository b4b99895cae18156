"""Decoded signals as an Apache Parquet file, for notebooks and data tools.

*Long*: a row for every value that was seen. *Wide*: a column for each chosen signal and a row for every instant at
which one of them was seen; what was not seen then is null, nothing is resampled or carried on. Both are written in
stretches of five minutes, so that memory does not grow with the recording.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from app import __version__
from app.errors import RecordingError, UsageError
from app.model.address import Address, parse_address
from app.model.datatypes import DataType, Raw, decode_raw
from app.model.description import Entry, Quantity
from app.model.values import quantity_of
from app.recording.cdr import NS
from app.recording.columns import Samples, Signal, samples
from app.recording.content import METADATA_NODES, METADATA_RECORDING
from app.recording.exchange.draft import drafted
from app.recording.node_table import read_nodes
from app.recording.reader import Recording
from app.wire.records import Source

if TYPE_CHECKING:
    import pyarrow as pa

STRETCH_NS: Final = 300 * NS
ABOUT: Final = b"hubside"
"""The key of the file's metadata: JSON with turbine, recording, versions and the form of the table."""
FORMAT: Final = 1
INSTALL: Final = "pip install 'hubside[parquet]'"
_INT64: Final = np.iinfo(np.int64)
_REALS: Final = (DataType.REAL32, DataType.REAL64)
_SOURCES: Final = [source.value for source in Source]


class Shape(Enum):
    """How the table is laid out."""

    LONG = "long"
    WIDE = "wide"


@dataclass(frozen=True, slots=True)
class TableOrder:
    """What is written. ``signals`` None: all objects of all devices that are described; a wide table needs some."""

    shape: Shape = Shape.LONG
    signals: Sequence[Signal] | None = None
    start_ns: int | None = None
    end_ns: int | None = None


class Tabled(NamedTuple):
    """What was written."""

    rows: int
    signals: int
    size_bytes: int


class _Column(NamedTuple):
    """One signal in a stretch: times, raw integers, scaled numbers, texts (each null where it has none)."""

    t_ns: npt.NDArray[np.uint64]
    raw: list[int | None]
    scaled: list[float | None]
    text: list[str | None]
    unit: list[str]
    source: npt.NDArray[np.uint8]


def arrow() -> Any:
    """The library, which only this needs. Raises UsageError with the command that installs it."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise UsageError(reason=f"Parquet needs pyarrow, which is not installed: {INSTALL}") from error
    return pyarrow


def write_table(
    recording: Recording, path: Path, order: TableOrder, on_progress: Callable[[float], None] | None = None
) -> Tabled:
    """Writes ``path``, which must not exist; it appears only when it is complete. ``on_progress``: share done, 0 to 1.

    Raises UsageError where pyarrow is missing or no such signal is described, RecordingError where a file cannot be
    read or written.
    """
    pyarrow = arrow()
    try:
        with drafted(path) as draft:
            table = _Table(pyarrow, recording, order)
            with pyarrow.parquet.ParquetWriter(draft, table.schema, compression="zstd") as writer:
                rows = table.write(writer, on_progress)
        return Tabled(rows, len(table.signals), path.stat().st_size)
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error


class _Table:
    def __init__(self, pyarrow: Any, recording: Recording, order: TableOrder) -> None:
        self._pa, self._recording, self._order = pyarrow, recording, order
        self._descriptions = recording.descriptions
        named = read_nodes(recording.metadata.get(METADATA_NODES, {}))
        self._devices = {key: named[key].slug for key in self._descriptions}
        self.signals = self._chosen(order.signals)
        self._last: dict[Signal, Raw | None] = {}
        """What was seen last of the objects that tell the unit of others."""
        self._units = {other for one in self.signals for other in self._rests_on(one)}
        self.schema = self._schema()

    def _chosen(self, signals: Sequence[Signal] | None) -> list[Signal]:
        if signals is None:
            if self._order.shape is Shape.WIDE:
                raise UsageError(reason="a wide table needs the signals that are its columns")
            return [
                Signal(bus, node, entry.address)
                for (bus, node), description in sorted(self._descriptions.items(), key=lambda item: item[0])
                for entry in description
            ]
        for signal in signals:
            if self._entry(signal) is None:
                raise UsageError(
                    reason=f"{signal.bus}/{signal.node} {signal.address} is not described in the recording"
                )
        return list(dict.fromkeys(signals))

    def _entry(self, signal: Signal) -> Entry | None:
        description = self._descriptions.get((signal.bus, signal.node))
        return None if description is None else description.entries.get(signal.address)

    def _rests_on(self, signal: Signal) -> Iterator[Signal]:
        """The objects that tell the unit of another one."""
        entry = self._entry(signal)
        rule = None if entry is None else entry.quantity_rule
        if rule is not None:
            yield signal._replace(address=rule.address)
            if rule.shaft is not None:
                yield signal._replace(address=rule.shaft)

    def _schema(self) -> pa.Schema:
        pa = self._pa
        word, when = pa.dictionary(pa.int32(), pa.string()), pa.timestamp("ns", tz="UTC")
        if self._order.shape is Shape.LONG:
            fields = [("t_ns", when), ("device", word), ("bus", word), ("node", pa.uint8()), ("address", word)]
            fields += [("name", word), ("unit", word), ("raw", pa.int64()), ("scaled", pa.float64())]
            fields += [("text", pa.string()), ("source", word)]
        else:
            fields = [("t_ns", when)]
            fields += [(self._title(one), pa.string() if self._is_text(one) else pa.float64()) for one in self.signals]
        return pa.schema(fields, metadata={ABOUT: json.dumps(self._about(), sort_keys=True).encode()})

    def _is_text(self, signal: Signal) -> bool:
        entry = self._entry(signal)
        return entry is None or not (entry.type.is_integer or entry.type in _REALS)

    def _title(self, signal: Signal) -> str:
        entry = self._entry(signal)
        name, unit = ("", "") if entry is None else (entry.name, entry.quantity.unit)
        device = self._devices[signal.bus, signal.node]
        return f"{device} {signal.address.short} {name}" + (f" [{unit}]" if unit else "")

    def _about(self) -> dict[str, Any]:
        identity = self._recording.metadata.get(METADATA_RECORDING, {})
        return {
            "format": FORMAT,
            "shape": self._order.shape.value,
            "made_by": f"hubside {__version__}",
            "recording": identity.get("id", ""),
            "turbine": identity.get("turbine", ""),
            "file": self._recording.path.name,
            "nodes": dict(self._recording.metadata.get("nodes", {})),
            "descriptions": {one.id: one.version for one in self._descriptions.values()},
        }

    def write(self, writer: Any, on_progress: Callable[[float], None] | None) -> int:
        span = self._recording.span_ns
        if span is None:
            return 0
        start_ns = span[0] if self._order.start_ns is None else max(self._order.start_ns, span[0])
        end_ns = span[1] + 1 if self._order.end_ns is None else min(self._order.end_ns, span[1] + 1)
        rows = 0
        for from_ns in range(start_ns, end_ns, STRETCH_NS):
            to_ns = min(from_ns + STRETCH_NS, end_ns)
            # Of the first stretch too the beginning is named: a state before it may tell the mapping.
            found = samples(self._recording, {*self.signals, *self._units}, self._descriptions, from_ns, to_ns)
            batch = self._long(found) if self._order.shape is Shape.LONG else self._wide(found)
            if batch.num_rows:
                writer.write_table(batch)
                rows += batch.num_rows
            self._remember(found)
            if on_progress is not None:
                on_progress((to_ns - start_ns) / (end_ns - start_ns))
        return rows

    def _remember(self, found: Mapping[Signal, Samples]) -> None:
        for signal in self._units:
            if found[signal].values:
                self._last[signal] = self._values(signal, found[signal])[-1]

    def _values(self, signal: Signal, seen: Samples) -> list[Raw | None]:
        entry = self._entry(signal)
        if entry is None:
            return [None] * seen.values
        return [_decoded(entry.type, seen.data(place)) for place in range(seen.values)]

    def _long(self, found: Mapping[Signal, Samples]) -> pa.Table:
        pa = self._pa
        pieces = []
        for signal in self.signals:
            column = self._column(signal, found)
            if column is not None:
                pieces.append(self._long_piece(signal, column))
        if not pieces:
            return self.schema.empty_table()
        return pa.concat_tables(pieces).unify_dictionaries().combine_chunks()

    def _long_piece(self, signal: Signal, column: _Column) -> pa.Table:
        pa, size, entry = self._pa, len(column.t_ns), self._entry(signal)

        def same(word: str) -> Any:
            return pa.DictionaryArray.from_arrays(pa.array(np.zeros(size, np.int32)), pa.array([word], pa.string()))

        arrays = [
            _times(pa, column.t_ns),
            same(self._devices[signal.bus, signal.node]),
            same(signal.bus),
            pa.array(np.full(size, signal.node, np.uint8)),
            same(signal.address.short),
            same("" if entry is None else entry.name),
            pa.array(column.unit, pa.string()).dictionary_encode(),
            pa.array(column.raw, pa.int64()),
            pa.array(column.scaled, pa.float64()),
            pa.array(column.text, pa.string()),
            pa.DictionaryArray.from_arrays(pa.array(column.source.astype(np.int32)), pa.array(_SOURCES)),
        ]
        return pa.Table.from_arrays(arrays, schema=self.schema)

    def _wide(self, found: Mapping[Signal, Samples]) -> pa.Table:
        pa = self._pa
        columns = [self._column(signal, found) for signal in self.signals]
        seen = [column.t_ns for column in columns if column is not None]
        if not seen:
            return self.schema.empty_table()
        times = np.unique(np.concatenate(seen))
        arrays = [_times(pa, times)]
        for signal, column in zip(self.signals, columns, strict=True):
            is_text = self._is_text(signal)
            cells: list[Any] = [None] * len(times)
            if column is not None:
                values: Sequence[Any] = column.text if is_text else column.scaled
                for place, value in zip(np.searchsorted(times, column.t_ns).tolist(), values, strict=True):
                    cells[place] = value
            arrays.append(pa.array(cells, pa.string() if is_text else pa.float64()))
        return pa.Table.from_arrays(arrays, schema=self.schema)

    def _column(self, signal: Signal, found: Mapping[Signal, Samples]) -> _Column | None:
        seen, entry = found[signal], self._entry(signal)
        if not len(seen.t_ns) or entry is None:
            return None
        quantities = self._quantities(signal, entry, seen.t_ns, found)
        units = [quantity.unit for quantity in quantities]
        if entry.type.is_integer and not seen.others and bool(np.all(seen.size == entry.type.size)):
            raws: list[Raw | None] = seen.raw.tolist()
        else:
            raws = [_decoded(entry.type, seen.data(place)) for place in range(seen.values)]
        numbers = [None if isinstance(raw, str | bytes) else raw for raw in raws]
        scaled = [
            None if number is None else _scaled(number, quantity.scale)
            for number, quantity in zip(numbers, quantities, strict=True)
        ]
        whole = [raw if isinstance(raw, int) and _INT64.min <= raw <= _INT64.max else None for raw in raws]
        texts = [
            None if kept is not None or isinstance(raw, float) else _text(raw, seen.data(place))
            for place, (raw, kept) in enumerate(zip(raws, whole, strict=True))
        ]
        return _Column(seen.t_ns, whole, scaled, texts, units, seen.source)

    def _quantities(
        self, signal: Signal, entry: Entry, t_ns: npt.NDArray[np.uint64], found: Mapping[Signal, Samples]
    ) -> list[Quantity]:
        """Unit and factor at each time, where they depend on other objects by what those were then."""
        rests_on = list(self._rests_on(signal))
        if not rests_on:
            return [entry.quantity] * len(t_ns)
        known: dict[Address, list[Raw | None]] = {}
        for other in rests_on:
            seen = found[other]
            places = np.searchsorted(seen.t_ns, t_ns, "right") - 1
            values, before = self._values(other, seen), self._last.get(other)
            known[other.address] = [values[place] if place >= 0 else before for place in places.tolist()]

        def at(row: int) -> Quantity:
            return quantity_of(entry, lambda address: known[address][row] if address in known else None)

        return [at(row) for row in range(len(t_ns))]


def _decoded(data_type: DataType, data: bytes) -> Raw | None:
    """None where the bytes are not of the type."""
    try:
        return decode_raw(data_type, data)
    except ValueError:
        return None


def _scaled(number: int | float, scale: Decimal) -> float:
    """Rounded once: 1637 tenths are 163.7."""
    over, under = scale.as_integer_ratio()
    return number * over / under


def _text(raw: Raw | None, data: bytes) -> str:
    return data.hex() if raw is None or isinstance(raw, bytes) else str(raw)


def _times(pa: Any, t_ns: npt.NDArray[np.uint64]) -> Any:
    return pa.array(t_ns.astype(np.int64), pa.timestamp("ns", tz="UTC"))


def signals_named(texts: Collection[str], nodes: Mapping[str, str]) -> list[Signal]:
    """Signals from ``can0/11:6064`` or ``wtg-07/blade-1/pmc:6064``. Raises UsageError."""
    named = read_nodes(nodes)
    by_name = {name.slug: key for key, name in named.items()} | {f"{bus}/{node}": (bus, node) for bus, node in named}
    found = []
    for text in texts:
        device, _, address = text.partition(":")
        if device not in by_name:
            slugs = ", ".join(name.slug for name in named.values())
            raise UsageError(reason=f"no device '{device}' in it (there are: {slugs})")
        found.append(Signal(*by_name[device], parse_address(address)))
    return found
