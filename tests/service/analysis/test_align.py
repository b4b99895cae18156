"""Laying recordings over each other: zeros, times, values scaled, and no extreme that is lost by reducing."""

from __future__ import annotations

import numpy as np
import pytest

from app.errors import UsageError
from app.model.address import parse_address
from app.service.analysis.align import Aligned, Floats, SignalAt, Track, Window, align, zero_of_trip
from tests.service.analysis.rig import BUS, MS, S, look, the_trip

POSITION, ERROR, MAINS = (parse_address(one) for one in ("6064", "60F4", "3062"))


def aligned(number: int, *signals: SignalAt, before_s: float = 5, after_s: float = 10, points: int = 500) -> Aligned:
    window = Window(round(before_s * S), round(after_s * S), points)
    return align(look(number), zero_of_trip(look(number), 0), signals, window)


def exact(number: int, node: int, text: str, from_ns: int, to_ns: int) -> tuple[Floats, Floats]:
    series = look(number).index.series((BUS, node, parse_address(text)), from_ns, to_ns, 1 << 30)
    return series.t_ns.astype(np.int64), series.low.astype(np.float64)


def test_each_recording_has_its_own_zero_and_the_same_blade_is_found_in_all() -> None:
    for number in (2, 3, 5, 8):
        one = aligned(number, SignalAt(POSITION, blade=2, device="pmc"))
        assert one.t0_ns == the_trip(number).t0_ns
        assert (one.from_ms, one.to_ms, one.turbine) == (-5000, 10_000, "wtg-07")
        (track,) = one.tracks
        assert (track.key, track.blade, track.device, track.unit) == ((BUS, 12), 2, "wtg-07/blade-2/pmc", "°")
        before, late = track.low[track.t_ms < 0], track.high[track.t_ms > 9000]
        assert before.max() < 30 < late.min(), "it feathers after its zero"


def test_all_blades_or_one_node() -> None:
    assert [one.key[1] for one in aligned(3, SignalAt(ERROR)).tracks] == [11, 12, 13]
    assert [one.key[1] for one in aligned(3, SignalAt(ERROR, node=(BUS, 13))).tracks] == [13]
    assert [one.key[1] for one in aligned(2, SignalAt(MAINS), SignalAt(ERROR, blade=1)).tracks] == [1, 2, 3, 11]
    assert aligned(3, SignalAt(parse_address("1234"))).tracks == ()
    assert aligned(3, SignalAt(ERROR, device="pmm")).tracks == ()


@pytest.mark.parametrize("points", [10, 60, 333, 1000])
def test_reduced_curves_lose_no_extreme_and_invent_none(points: int) -> None:
    (track,) = aligned(3, SignalAt(ERROR, blade=2), before_s=20, after_s=25, points=points).tracks
    t0_ns = the_trip(3).t0_ns
    t_ns, raw = exact(3, 12, "60F4", t0_ns - 20 * S, t0_ns + 25 * S)
    assert not track.exact
    assert len(track.t_ms) <= points
    assert (np.diff(track.t_ms) > 0).all()
    assert (track.low <= track.high).all()
    assert track.low.min() == pytest.approx(raw.min() / 100)
    assert track.high.max() == pytest.approx(raw.max() / 100)
    for t, value in zip(((t_ns - t0_ns) / MS).tolist(), (raw / 100).tolist(), strict=True):
        at = int(np.searchsorted(track.t_ms, t, "right")) - 1
        near = slice(max(0, at - 1), at + 2)
        assert track.low[near].min() - 1e-9 <= value <= track.high[near].max() + 1e-9


def test_few_values_stand_as_they_came() -> None:
    (track,) = aligned(2, SignalAt(MAINS, blade=1), before_s=4, after_s=2).tracks
    t0_ns = the_trip(2).t0_ns
    t_ns, raw = exact(2, 1, "3062", t0_ns - 4 * S, t0_ns + 2 * S)
    assert track.exact
    assert track.t_ms.tolist() == pytest.approx(((t_ns - t0_ns) / MS).tolist())
    assert track.low.tolist() == track.high.tolist() == raw.tolist()
    failed_ms = track.t_ms[track.low == 0][0]
    assert failed_ms == pytest.approx(-3003, abs=1)


def test_where_a_unit_restarted_no_line_may_cross() -> None:
    (track,) = aligned(7, SignalAt(POSITION, blade=2), before_s=2, after_s=3).tracks
    boot = next(one for one in the_trip(7).steps if one.step.kind.value == "boot_up").step.t_ns
    assert (boot - the_trip(7).t0_ns) / MS in track.breaks_ms.tolist()


def test_the_window_is_cut_where_the_recording_ends() -> None:
    one = aligned(4, SignalAt(POSITION), before_s=100, after_s=100)
    begin, end = look(4).span_ns
    assert (one.from_ms, one.to_ms) == ((begin - one.t0_ns) / MS, (end - one.t0_ns) / MS)
    assert all(isinstance(track, Track) and track.t_ms.min() >= one.from_ms - track.step_ms for track in one.tracks)


def test_a_zero_that_is_not_in_the_recording_is_refused() -> None:
    with pytest.raises(UsageError):
        align(look(3), look(4).span_ns[0], [SignalAt(POSITION)], Window(S, S, 100))
    for number in (-1, 1):
        with pytest.raises(UsageError):
            zero_of_trip(look(3), number)
    with pytest.raises(UsageError):
        zero_of_trip(look(1), 0)
