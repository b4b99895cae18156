"""The linkage of the cylinders by numbers that were worked out by hand."""

from __future__ import annotations

from math import cos, dist, radians, sin

import pytest

from app.scene import linkage

# FOOT = 2, CRANK^2 = 3.75 / 7 = 0.535714, CRANK = 0.731925; sum of squares 4.535714, twice the product 2.927700.
# L0^2 = 4.535714 - 2.927700 cos 45 = 2.465518, L0 = 1.570197.
BY_HAND = [
    (0.0, 0.0),
    (0.25, 20.317),  # L = 1.820197: cos = (4.535714 - 3.313116) / 2.927700 = 0.417597, 65.317 less 45
    (0.5, 40.102),  # L = 2.070197: cos = 0.249999 / 2.927700 = 0.085391, 85.102 less 45
    (1.0, 90.0),
]


@pytest.mark.parametrize(("extension", "angle_deg"), BY_HAND)
def test_the_angle_follows_from_the_stroke_and_the_stroke_from_the_angle(extension: float, angle_deg: float) -> None:
    assert linkage.angle_deg(extension) == pytest.approx(angle_deg, abs=2e-3)
    assert linkage.extension_at(angle_deg) == pytest.approx(extension, abs=2e-5)


def test_the_shortest_is_longer_than_the_stroke_so_that_a_rod_fits_into_its_tube() -> None:
    assert pytest.approx(1.570197, abs=1e-6) == linkage.SHORTEST
    assert pytest.approx(0.731925, abs=1e-6) == linkage.CRANK


def test_the_first_cylinder_stands_below_and_the_second_is_the_first_turned_by_half_a_turn() -> None:
    """Rod in: foot (0, -2), pin at -45 degrees (0.517549, -0.517549): up 1.482451, across 0.517549."""
    first, second = (linkage.place_of(cylinder, 0.0) for cylinder in (1, 2))
    assert first.foot == pytest.approx((0.0, -2.0))
    assert first.points_deg == pytest.approx(70.755, abs=1e-3)  # atan(1.482451 / 0.517549)
    assert first.length == pytest.approx(1.570197, abs=1e-6)
    assert second.foot == pytest.approx((0.0, 2.0))
    assert second.points_deg == pytest.approx(70.755 - 180.0, abs=1e-3)


@pytest.mark.parametrize("extension", [0.0, 0.2, 0.5, 0.77, 1.0])
@pytest.mark.parametrize("cylinder", [1, 2])
def test_the_end_of_the_rod_is_on_the_pin_of_the_crank(cylinder: int, extension: float) -> None:
    place = linkage.place_of(cylinder, extension)
    assert place.length == pytest.approx(linkage.SHORTEST + extension)
    turn = radians(place.points_deg)
    end = (place.foot[0] + place.length * cos(turn), place.foot[1] + place.length * sin(turn))
    pin = radians(linkage.FOOT_AT_DEG[cylinder - 1] + linkage.FIRST_DEG + linkage.angle_deg(extension))
    assert dist(end, (linkage.CRANK * cos(pin), linkage.CRANK * sin(pin))) < 1e-9
