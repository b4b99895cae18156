"""What is made of a capture: series, XY, spectra and files. Against what the rules say, and against known sines."""

from __future__ import annotations

import csv
import io
import json
import math
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.errors import ScopeSpectrumError
from app.model.texts import load_texts
from app.service.scope import export
from app.service.scope.capture import (
    Capture,
    Head,
    InForce,
    KeptMark,
    KeptSignal,
    Values,
    dump_head,
    dump_marks,
    line_of,
    load_head,
    load_line,
    pack_values,
    unpack_values,
)
from app.service.scope.export import INSTANTS, NUMBERS, csv_pieces, json_pieces, scaled_numbers, scaled_text
from app.service.scope.series import capture_series, xy_points
from app.service.scope.spectrum import spectrum_of
from tests.service.scope.rig import AXIS, POSITION, order

ZERO_NS = 1_750_000_000_000_000_000
S = 1_000_000_000

Fed = list[tuple[float, int]]
Step = tuple[int, int]


def fed(steps: list[Step]) -> Fed:
    """Values with their distances in ms."""
    times = np.cumsum([dt_ms for dt_ms, _ in steps], dtype=int).tolist()
    return [(t_ms / 1000, raw) for t_ms, (_, raw) in zip(times, steps, strict=True)]


def capture(*signals: Fed, scale: str = "0.01", marks: tuple[KeptMark, ...] = ()) -> Capture:
    """A capture of signals given as (s since the trigger, raw)."""
    names = [POSITION, f"{AXIS}/60F4", f"{AXIS}/6078"][: len(signals)]
    head = Head(
        id="0197a000-0000-7000-8000-000000000001",
        name="a test",
        note="",
        person="tester",
        turbine="wtg-07",
        turbine_name="WTG-07",
        cause="manual",
        ended="complete",
        trigger_ns=ZERO_NS,
        start_ns=ZERO_NS - S,
        end_ns=ZERO_NS + 10 * S,
        known_ns=ZERO_NS - S,
        made_ns=ZERO_NS + 10 * S,
        order=order(*names),
        signals=tuple(
            KeptSignal(name, AXIS, "can0", "position actual value", None, None, "°", scale, len(fed), 0)
            for name, fed in zip(names, signals, strict=True)
        ),
        marks=marks,
        devices=(),
        recording="wtg-07-001.mcap",
        twin=True,
        size_bytes=0,
    )
    values = tuple(
        Values(
            np.array([ZERO_NS + round(t * S) for t, _ in fed], np.int64), np.array([raw for _, raw in fed], np.int64)
        )
        for fed in signals
    )
    return Capture(head, values)


def sine(frequency_hz: float, rate_hz: float, amplitude: int, length_s: float = 4.0, mean: int = 0) -> Fed:
    count = int(length_s * rate_hz)
    return [
        (n / rate_hz, round(mean + amplitude * math.sin(2 * math.pi * frequency_hz * n / rate_hz)))
        for n in range(count)
    ]


def gap(at_s: float) -> KeptMark:
    return KeptMark(ZERO_NS + round(at_s * S), "gap", "can0", None, "event.gap")


# -- spectra -------------------------------------------------------------------------


@pytest.mark.parametrize("frequency_hz", [5.0, 7.3, 23.1, 61.0])
def test_a_sine_is_found_with_its_frequency_and_amplitude(frequency_hz: float) -> None:
    found = spectrum_of(capture(sine(frequency_hz, 200.0, 10_000, mean=4500)), 0, -1, 10)
    assert found.peaks[0].frequency_hz == pytest.approx(frequency_hz, abs=0.05)
    assert found.peaks[0].amplitude == pytest.approx(100.0, rel=0.02), "in degrees"
    assert found.mean == pytest.approx(45.0, abs=2.0)
    assert found.rate_hz == pytest.approx(200.0)
    assert found.unevenness < 1e-3
    assert found.resolution_hz == pytest.approx(0.25)


def test_two_sines_are_two_peaks_the_stronger_first() -> None:
    both = [(t, a + b) for (t, a), (_, b) in zip(sine(10, 200, 2000), sine(40, 200, 6000), strict=True)]
    found = spectrum_of(capture(both), 0, -1, 10)
    assert [round(peak.frequency_hz) for peak in found.peaks[:2]] == [40, 10]
    assert [peak.amplitude for peak in found.peaks[:2]] == pytest.approx([60, 20], rel=0.03)


def test_values_that_come_unevenly_keep_their_main_frequency_and_say_so() -> None:
    rng = np.random.default_rng(7)
    times = np.sort(rng.uniform(0, 4, 800))
    fed = [(float(t), round(10_000 * math.sin(2 * math.pi * 6 * t))) for t in times]
    found = spectrum_of(capture(fed), 0, -1, 10)
    assert found.peaks[0].frequency_hz == pytest.approx(6, abs=0.1)
    assert found.peaks[0].amplitude == pytest.approx(100, rel=0.1)
    assert found.unevenness > 0.5


def test_too_few_values_and_gaps_make_no_spectrum() -> None:
    with pytest.raises(ScopeSpectrumError) as few:
        spectrum_of(capture(sine(5, 10, 100, 2.0)), 0, -1, 10)
    assert few.value.details["count"] == 20
    broken = capture(sine(5, 200, 100), marks=(gap(2.0),))
    with pytest.raises(ScopeSpectrumError) as holed:
        spectrum_of(broken, 0, -1, 10)
    assert holed.value.details["reason_key"] == "scope.spectrum.gap"
    assert spectrum_of(broken, 0, 2.001, 10).values > 300, "behind the gap there is one"


# -- series --------------------------------------------------------------------------


def test_few_values_are_told_as_they_are_and_a_gap_breaks_them() -> None:
    (line,) = capture_series(capture([(0.0, 100), (1.0, 200), (2.0, 300)], marks=(gap(1.5),)), -1, 10, 100)
    assert (line.exact, line.t_s) == (True, [0.0, 1.0, 1.5, 2.0])
    assert line.low == [1.0, 2.0, None, 3.0]


@given(st.lists(st.tuples(st.integers(1, 40), st.integers(-9, 9)), min_size=60, max_size=300), st.integers(10, 40))
def test_buckets_hold_every_value_between_their_limits(steps: list[tuple[int, int]], points: int) -> None:
    t_ms, fed = 0, []
    for dt_ms, raw in steps:
        t_ms += dt_ms
        fed.append((t_ms / 1000, raw))
    (line,) = capture_series(capture(fed, scale="1"), 0.0, t_ms / 1000 + 0.001, points)
    assert not line.exact
    assert len(line.t_s) <= points + 2
    for t_s, raw in fed:
        at = [n for n, start_s in enumerate(line.t_s) if start_s - 1e-9 <= t_s < start_s + line.bucket_s + 1e-9]
        assert any((line.low[n] or 0) <= raw <= (line.high[n] or 0) for n in at), t_s
    assert min(one for one in line.low if one is not None) == min(raw for _, raw in fed)


def test_xy_takes_of_both_what_was_seen_last() -> None:
    points = xy_points(capture([(0.0, 100), (2.0, 300)], [(1.0, 7), (3.0, 9)]), 0, 1, -1, 10, 100)
    assert points.t_s == [0.0, 1.0, 2.0, 3.0]
    assert points.x == [1.0, 1.0, 3.0, 3.0]
    assert points.y == [None, 0.07, 0.07, 0.09]
    holed = xy_points(capture([(0.0, 100), (2.0, 300)], [(1.0, 7), (3.0, 9)], marks=(gap(1.5),)), 0, 1, -1, 10, 100)
    assert holed.y == [None, 0.07, None, 0.09], "nothing is carried over a gap"
    few = xy_points(capture([(n / 100, n) for n in range(100)], [(0.0, 1)]), 0, 1, -1, 10, 10)
    assert (few.instants, few.every, len(few.x)) == (100, 10, 10)


# -- files ---------------------------------------------------------------------------


def test_csv_has_a_row_an_instant_and_nothing_is_carried_on() -> None:
    one = capture([(-0.5, -7), (0.0, 8000), (0.0, 8001)], [(0.0, 5), (0.25, 6)])
    english = b"".join(csv_pieces(one, load_texts("en"))).decode()
    rows = list(csv.reader(io.StringIO(english.removeprefix("\ufeff"))))
    assert rows[0][:2] == ["time since trigger [s]", "t_ns"]
    assert rows[0][2] == "blade-1/pmc position actual value [°]"
    assert [row[0] for row in rows[1:]] == ["-0.500000000", "0.000000000", "0.000000000", "0.250000000"]
    assert [row[2:] for row in rows[1:]] == [["-0.07", ""], ["80.00", "0.05"], ["80.01", ""], ["", "0.06"]]
    assert rows[2][1] == str(ZERO_NS)
    german = b"".join(csv_pieces(one, load_texts("de"))).decode().removeprefix("\ufeff").splitlines()
    assert german[1] == f"-0,500000000;{ZERO_NS - S // 2};-0,07;"


def test_json_holds_all_of_it() -> None:
    one = capture([(0.0, 8000), (0.5, 8001)])
    rows = [InForce(AXIS, "6065", "following error window", "500", "5.00", "°", None, False, "proven", True)]
    plain = json.loads(b"".join(json_pieces(one, rows)))
    assert plain["signals"][0]["raw"] == [8000, 8001]
    assert plain["signals"][0]["scaled"] == [80.0, 80.01]
    assert plain["order"]["trigger"]["kind"] == "manual"
    assert plain["in_force"][0]["stored"] == "proven"
    assert plain["recording"] == "wtg-07-001.mcap"


@given(
    st.lists(st.tuples(st.integers(0, 3), st.integers(-9, 9)), max_size=40),
    st.lists(st.tuples(st.integers(0, 3), st.integers(-9, 9)), max_size=40),
    st.integers(1, 5),
)
def test_files_in_pieces_hold_every_value_once(first: list[Step], second: list[Step], size: int) -> None:
    """Whatever falls on one instant, and wherever a piece ends."""
    one = capture(fed(first), fed(second), scale="0.1", marks=tuple(gap(n / 10) for n in range(7)))
    with pytest.MonkeyPatch.context() as patch:
        for name in ("INSTANTS", "NUMBERS", "ROWS"):
            patch.setattr(export, name, size)
        text = b"".join(csv_pieces(one, load_texts("en"))).decode().removeprefix("\ufeff")
        plain = json.loads(b"".join(json_pieces(one, [])))
    rows = list(csv.reader(io.StringIO(text)))[1:]
    for column, values in enumerate(one.values):
        told = [(int(row[1]), row[2 + column]) for row in rows if row[2 + column] != ""]
        assert [t_ns for t_ns, _ in told] == values.t_ns.tolist()
        assert [float(cell) for _, cell in told] == [raw / 10 for raw in values.raw.tolist()]
        kept = plain["signals"][column]
        assert (kept["t_ns"], kept["raw"]) == (values.t_ns.tolist(), values.raw.tolist())
        assert kept["scaled"] == [raw / 10 for raw in values.raw.tolist()]
    assert all(any(row[2:]) for row in rows)
    assert [int(row[1]) for row in rows] == sorted(int(row[1]) for row in rows)
    assert len(plain["marks"]) == 7


def test_no_piece_of_a_large_file_is_large() -> None:
    """Each piece is made in one go, and nothing else of the program runs for the time that a call for it takes."""
    count = 40_000
    one = capture([(n / 1000, n) for n in range(count)], [(n / 1000 + 0.0005, n) for n in range(count)])
    row = InForce(AXIS, "6065", "following error window", "500", "5.00", "°", None, False, "proven", True)
    for pieces, least in (
        (list(csv_pieces(one, load_texts("en"))), 2 * count // INSTANTS),
        (list(json_pieces(one, [row] * 2000)), 6 * count // NUMBERS),
    ):
        assert len(pieces) >= least
        assert max(map(len, pieces)) < 100_000


@given(st.lists(st.integers(-(2**63), 2**63 - 1), max_size=20), st.sampled_from(["1", "0.01", "0.1", "0.3", "10"]))
def test_scaled_numbers_are_the_nearest_floats(raws: list[int], scale: str) -> None:
    step = Decimal(scale)
    assert scaled_numbers(np.array(raws, np.int64), step) == [float(raw * step) for raw in raws]


@given(st.integers(-(2**63), 2**63 - 1), st.sampled_from(["1", "0.01", "0.1", "0.001", "10"]))
def test_scaled_values_have_all_their_digits(raw: int, scale: str) -> None:
    assert Decimal(scaled_text(raw, Decimal(scale))) / Decimal(scale) == pytest.approx(raw, rel=1e-25)


@given(st.lists(st.integers(-(2**31), 2**31 - 1), max_size=50))
def test_what_is_kept_comes_back(raws: list[int]) -> None:
    one = capture([(n / 1000, raw) for n, raw in enumerate(raws)], [], marks=(gap(0.1),))
    text = dump_head(one.head)
    assert "marks" not in text, "a list of captures reads no marks"
    assert load_head(text, dump_marks(one.head)) == one.head
    assert load_line(text) == line_of(one.head, True)
    for before, after in zip(one.values, unpack_values(pack_values(one.values)), strict=True):
        assert before.t_ns.tolist() == after.t_ns.tolist()
        assert before.raw.tolist() == after.raw.tolist()
