"""The blade: as the published table says, closed, and pitched the right way round."""

from __future__ import annotations

import numpy as np
import pytest

from app.scene import aerofoil, blade, marks
from app.scene.solids import Floats, rotation
from tests.scene.meshes import open_edges, volume_m3

UPWIND = np.array([-1.0, 0.0, 0.0])
ROTOR_TURNS_TO = np.array([0.0, -1.0, 0.0])
"""The upper blade's way, clockwise seen from upwind."""
AEROFOILS = [station for station in blade.TABLE if station.thickness <= 0.405]


def chord_line(ring: Floats) -> Floats:
    """From the trailing edge's middle to the leading edge."""
    tail = (ring[0] + ring[-1]) / 2
    return np.asarray(ring[len(ring) // 2] - tail)


def ring_at(station: blade.Station) -> Floats:
    """The mesh's own vertices at this station."""
    vertices = blade.blade_mesh().vertices
    ring = vertices[np.isclose(vertices[:, 2], blade.drawn_z(station.radius_m))][: blade.AROUND]
    assert len(ring) == blade.AROUND
    return ring[::-1]


@pytest.mark.parametrize("station", AEROFOILS, ids=lambda station: f"{station.radius_m} m")
def test_chord_twist_and_thickness_are_those_of_the_table(station: blade.Station) -> None:
    ring = ring_at(station)
    chord = chord_line(ring)
    assert np.linalg.norm(chord) == pytest.approx(station.chord_m * blade.SCALE, rel=1e-3)
    twist_deg = np.degrees(np.arctan2(chord @ UPWIND, chord @ ROTOR_TURNS_TO))
    assert twist_deg == pytest.approx(station.twist_deg, abs=0.05)
    across = np.array([-chord[1], chord[0], 0.0]) / np.linalg.norm(chord)
    half = blade.AROUND // 2
    upper, lower = ring[: half + 1] @ across, ring[half:][::-1] @ across
    thickness = np.abs(upper - lower).max() / np.linalg.norm(chord)
    assert thickness == pytest.approx(station.thickness, rel=0.01)


def test_the_root_is_round_and_flat() -> None:
    vertices = blade.blade_mesh().vertices
    root = vertices[np.isclose(vertices[:, 2], blade.ROOT_M)]
    radii = np.hypot(*(root[:, :2]).T)
    assert radii[radii > 0.1] == pytest.approx(blade.root_radius_m(), rel=1e-6)
    assert vertices[:, 2].min() == pytest.approx(blade.ROOT_M)


def test_the_blade_is_closed_and_looks_outwards() -> None:
    mesh = blade.blade_mesh()
    assert open_edges(mesh) == 0
    assert volume_m3(mesh) > 0
    assert mesh.vertices[:, 2].max() == pytest.approx(blade.TIP_M)


def test_at_0_degrees_it_works_and_at_90_it_is_feathered() -> None:
    """At 0 the leading edge goes ahead in the rotor plane; at 90 it looks into the wind."""
    outer = chord_line(ring_at(blade.TABLE[-1]))
    outer /= np.linalg.norm(outer)
    assert outer @ ROTOR_TURNS_TO > 0.999
    feathered = rotation(blade.PITCH_AXIS, 90.0) @ outer
    assert feathered @ UPWIND > 0.999
    half_way = rotation(blade.PITCH_AXIS, 45.0) @ outer
    assert half_way @ UPWIND == pytest.approx(np.sqrt(0.5), abs=0.01)


def test_the_suction_side_looks_downwind_and_the_tip_is_bent_upwind() -> None:
    ring = ring_at(blade.TABLE[-2])
    chord = chord_line(ring)
    middle = ring.mean(axis=0)
    suction = ring[blade.AROUND // 4]  # half-way over the first side
    assert (suction - middle) @ UPWIND < 0
    assert middle @ UPWIND > 0.5 * blade.PREBEND_M
    assert abs(chord[2]) < 1e-9


def test_the_pointer_is_at_the_leading_edge() -> None:
    outer = chord_line(ring_at(blade.TABLE[-1]))
    for degrees in (0.0, 45.0, 90.0):
        turned = rotation(blade.PITCH_AXIS, degrees) @ outer / np.linalg.norm(outer)
        assert turned @ np.array(marks.direction(degrees)) > 0.999
    middle = marks.pointer().vertices.mean(axis=0)[:2]
    assert middle / np.linalg.norm(middle) == pytest.approx(marks.direction(0)[:2], abs=1e-6)


def test_the_thickness_form_is_that_of_the_report() -> None:
    """Report 492: full height at the place of maximum thickness, d0 at the trailing edge, nose radius 1.1019 t^2."""
    x = np.linspace(0.0, 1.0, 2001)
    half = aerofoil.half_thickness(x)
    assert half.max() == pytest.approx(0.10, abs=1e-6)
    assert x[half.argmax()] == pytest.approx(aerofoil.THICKEST_AT, abs=0.002)
    assert half[-1] == pytest.approx(0.01)
    assert half[0] == 0.0
    assert half[1] ** 2 / (2 * x[1]) == pytest.approx(1.1019 * 0.2**2, rel=0.05)
    assert np.abs(np.diff(half)).max() < 0.01


def test_the_mean_line_is_highest_at_half_chord() -> None:
    x = np.linspace(0.0, 1.0, 101)
    line = aerofoil.mean_line(x, 1.0)
    assert line[50] == line.max()
    assert line.max() == pytest.approx(np.log(2) / (4 * np.pi))
    assert line[0] == pytest.approx(0.0, abs=1e-6)


def test_between_stations_nothing_goes_beyond_them() -> None:
    x = np.array([0.0, 1.0, 2.0, 3.0])
    y = np.array([0.0, 1.0, 1.0, 0.5])
    at = np.linspace(0.0, 3.0, 301)
    smooth = blade.monotone(x, y, at)
    assert smooth[[0, 100, 200, 300]] == pytest.approx(y)
    assert smooth.max() <= 1.0 + 1e-12
    assert (np.diff(smooth[:100]) >= 0).all()
