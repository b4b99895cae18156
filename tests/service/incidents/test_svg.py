"""Plots: what is drawn is what was seen; nothing crosses a gap; axes are round numbers."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from app.service.incidents.report.svg import Panel, Stretch, Track, number_text, panel_svg, ticks

STEPS = Track("<b>", (0.0, 1.0, 2.0, 3.0, 4.0), (0.0, 10.0, None, 5.0, 0.0), (0.0, 10.0, None, 5.0, 0.0), 0.0)
PANEL = Panel("°", 0.0, 4.0, 2.0, (STEPS,), (), "plot")
X0, PER_S = 66.0, 170.0


def path(svg: str, kind: str) -> str:
    return str(re.findall(rf'class="{kind}" style="[^"]*" d="([^"]*)"', svg)[0])


def numbers(svg: str) -> list[tuple[str, float]]:
    return [(one, float(number)) for one, number in re.findall(r"([MHV])(-?[\d.]+)", path(svg, "line"))]


def test_a_value_is_held_until_the_next_and_a_break_is_a_break() -> None:
    moves = numbers(panel_svg(PANEL, "."))
    assert [one for one, _ in moves] == ["M", "H", "V", "H", "M", "H", "V"]
    assert [x for one, x in moves if one in "MH"] == [X0, X0 + PER_S, X0 + 2 * PER_S, X0 + 3 * PER_S, X0 + 4 * PER_S]


def test_a_line_ends_where_a_gap_begins() -> None:
    gap = Stretch(0.25, 0.75, "silence")
    svg = panel_svg(replace(PANEL, gaps=(gap,)), ".")
    moves = numbers(svg)
    assert moves[:3] == [("M", X0), ("H", X0 + 0.2 * PER_S + 8.5), ("M", X0 + PER_S)]
    assert "<title>silence</title>" in svg
    assert f'x="{X0 + 0.25 * PER_S:.1f}"' in svg and f'width="{0.5 * PER_S:.1f}"' in svg


def test_what_is_sent_many_times_a_second_is_not_held_through_silence() -> None:
    times = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 3.0)
    cyclic = Track("a", times, (1.0,) * 7, (1.0,) * 7, 0.0)
    moves = numbers(panel_svg(replace(PANEL, tracks=(cyclic,)), "."))
    assert [x for one, x in moves if one != "V"][-2:] == [X0 + 1.5 * PER_S, X0 + 3 * PER_S]
    assert moves[-1][0] == "M"
    read = Track("a", times[4:], (1.0,) * 3, (1.0,) * 3, 0.0)
    assert [one for one, _ in numbers(panel_svg(replace(PANEL, tracks=(read,)), "."))].count("M") == 1


def test_buckets_show_least_and_greatest_and_no_band_crosses_a_gap() -> None:
    track = Track("a", (0.0, 1.0, 3.0), (0.0, 2.0, 1.0), (9.0, 10.0, 1.0), 1.0)
    band = path(panel_svg(replace(PANEL, tracks=(track,)), "."), "band")
    assert band.count("M") == 2 and band.count("Z") == 2
    heights = {float(y) for y in re.findall(r"[ML][\d.]+ ([\d.]+)", band)}
    span = (200 - 10 - 26) / (10 * 1.12)
    for value in (0.0, 2.0, 9.0, 10.0, 1.0):
        assert any(abs(200 - 26 - (value + 0.6) * span - y) < 0.1 for y in heights), value


def test_a_signal_that_never_changed_or_was_never_seen_is_drawn_too() -> None:
    flat = Track("a", (0.0, 4.0), (3.0, 3.0), (3.0, 3.0), 0.0)
    for track in (flat, Track("a", (), (), (), 0.0), Track("a", (1.0,), (None,), (None,), 0.0)):
        svg = panel_svg(replace(PANEL, tracks=(track,)), ".")
        assert "nan" not in svg.lower() and "inf" not in svg.lower()


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [(0.0, 10.0, [0.0, 2.5, 5.0, 7.5, 10.0]), (-1.0, 1.0, [-1.0, -0.5, 0.0, 0.5, 1.0]), (98.0, 98.4, [98.0, 98.1])],
)
def test_ticks_are_round(low: float, high: float, expected: list[float]) -> None:
    assert ticks(low, high, 4)[: len(expected)] == pytest.approx(expected)


def test_numbers_are_short_and_in_their_language() -> None:
    assert [number_text(one, ",") for one in (0.30000000000000004, -2.5, -0.0, 1e9)] == ["0,3", "−2,5", "0", "1e+09"]
