"""Parquet holds, value for value and time for time, what the streaming decoder sees."""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from app.errors import RecordingError, UsageError
from app.model.address import parse_address
from app.model.datatypes import decode_raw
from app.recording.columns import Signal
from app.recording.exchange.cut import CutOrder, cut
from app.recording.exchange.table import ABOUT, Shape, TableOrder, signals_named, write_table
from app.recording.node_table import described
from app.recording.reader import open_recording
from app.wire.decoder import CanOpenDecoder
from app.wire.records import ValueSeen
from tests.recording.rig import S

VISIT = Path(__file__).resolve().parents[2] / "recordings" / "scenarios" / "7-service-visit.mcap"


@pytest.fixture(scope="module")
def part(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """15 s of a visit: writes, reads, an abort, a save, PDOs of six devices."""
    path = tmp_path_factory.mktemp("part") / "part.mcap"
    with open_recording(VISIT) as recording:
        assert recording.span_ns is not None
        start_ns = recording.span_ns[0] + 38 * S
    cut(VISIT, path, CutOrder(start_ns, start_ns + 15 * S))
    return path


def seen_by_the_decoder(path: Path) -> dict[Signal, list[tuple[int, object, str]]]:
    with open_recording(path) as recording:
        descriptions = described(recording.info.nodes)
        decoder = CanOpenDecoder("can0", {node: one for (_, node), one in descriptions.items()})
        decoder.restore(next(recording.keyframes()).state["decoders"]["can0"])
        found: defaultdict[Signal, list[tuple[int, object, str]]] = defaultdict(list)
        for record in decoder.feed_all(recording.frames()):
            if isinstance(record, ValueSeen) and ("can0", record.node) in descriptions:
                entry = descriptions["can0", record.node].entries.get(record.address)
                if entry is not None:
                    raw = decode_raw(entry.type, record.data)
                    found[Signal("can0", record.node, record.address)].append((record.t_ns, raw, record.source.value))
    return dict(found)


def test_the_long_table_is_what_the_decoder_sees(part: Path, tmp_path: Path) -> None:
    target = tmp_path / "long.parquet"
    with open_recording(part) as recording:
        done = write_table(recording, target, TableOrder())
        nodes = recording.info.nodes
        descriptions = described(nodes)
    table = pq.read_table(target)
    columns = {name: table[name].to_pylist() for name in table.column_names if name != "t_ns"}
    times = table["t_ns"].cast("int64").to_pylist()
    found = defaultdict(list)
    for row, t_ns in enumerate(times):
        signal = Signal(columns["bus"][row], columns["node"][row], parse_address(columns["address"][row]))
        entry = descriptions[signal.bus, signal.node].entries[signal.address]
        raw = columns["raw"][row] if columns["text"][row] is None else columns["text"][row]
        found[signal].append((t_ns, raw, columns["source"][row]))
        assert columns["name"][row] == entry.name
        assert columns["device"][row] == nodes[f"can0/{signal.node}"].split()[0]
        if columns["scaled"][row] is not None and entry.quantity_rule is None:
            assert columns["scaled"][row] == float(columns["raw"][row] * entry.quantity.scale)
            assert columns["unit"][row] == entry.quantity.unit
    wanted = seen_by_the_decoder(part)
    assert dict(found) == wanted
    assert done.rows == len(times) == sum(map(len, wanted.values())) > 5000
    about = json.loads(table.schema.metadata[ABOUT])
    assert about["turbine"] == "wtg-07"
    assert about["nodes"] == dict(nodes)
    assert str(table.schema.field("t_ns").type) == "timestamp[ns, tz=UTC]"


def test_the_wide_table_joins_without_filling_in(part: Path, tmp_path: Path) -> None:
    target = tmp_path / "wide.parquet"
    with open_recording(part) as recording:
        names = ["wtg-07/blade-1/pmc:6064", "can0/12:6041", "can0/1:3063"]
        signals = signals_named(names, recording.info.nodes)
        write_table(recording, target, TableOrder(Shape.WIDE, signals))
        descriptions = described(recording.info.nodes)
    table = pq.read_table(target)
    assert table.column_names[1].startswith("wtg-07/blade-1/pmc 6064 ")
    times = table["t_ns"].cast("int64").to_pylist()
    assert times == sorted(set(times))
    wanted = seen_by_the_decoder(part)
    for number, signal in enumerate(signals, 1):
        scale = descriptions[signal.bus, signal.node].entries[signal.address].quantity.scale
        cells = table[table.column_names[number]].to_pylist()
        seen = {t_ns: cell for t_ns, cell in zip(times, cells, strict=True) if cell is not None}
        assert seen == {t_ns: float(raw * scale) for t_ns, raw, _ in wanted[signal] if isinstance(raw, int)}
        assert None in cells
    assert all(math.isfinite(cell) for cell in table[1].drop_null().to_pylist())


def test_a_time_range_holds_the_same_values(part: Path, tmp_path: Path) -> None:
    with open_recording(part) as recording:
        signals = signals_named(["can0/11:6064"], recording.info.nodes)
        assert recording.span_ns is not None
        start_ns, end_ns = recording.span_ns[0] + 4 * S, recording.span_ns[0] + 9 * S
        write_table(recording, tmp_path / "part.parquet", TableOrder(Shape.LONG, signals, start_ns, end_ns))
    times = pq.read_table(tmp_path / "part.parquet")["t_ns"].cast("int64").to_pylist()
    assert times == [t_ns for t_ns, *_ in seen_by_the_decoder(part)[signals[0]] if start_ns <= t_ns < end_ns]
    assert len(times) > 50


def test_what_cannot_be_written_is_said(part: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_recording(part) as recording:
        with pytest.raises(UsageError, match="no device 'can0/99'"):
            signals_named(["can0/99:6064"], recording.info.nodes)
        wrong = signals_named(["can0/11:5FFF"], recording.info.nodes)
        with pytest.raises(UsageError, match="not described"):
            write_table(recording, tmp_path / "a.parquet", TableOrder(Shape.LONG, wrong))
        with pytest.raises(UsageError, match="needs the signals"):
            write_table(recording, tmp_path / "a.parquet", TableOrder(Shape.WIDE))
        (tmp_path / "there.parquet").touch()
        with pytest.raises(RecordingError, match="exists already"):
            write_table(recording, tmp_path / "there.parquet", TableOrder())
        monkeypatch.setitem(sys.modules, "pyarrow", None)
        with pytest.raises(UsageError, match=r"pip install 'hubside\[parquet\]'"):
            write_table(recording, tmp_path / "a.parquet", TableOrder())
    assert {path.name for path in tmp_path.iterdir()} == {"there.parquet"}
