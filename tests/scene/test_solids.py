"""Primitive bodies: closed, looking outwards, of the volume that geometry says."""

from __future__ import annotations

import numpy as np
import pytest

from app.scene import machinery, marks, solids
from app.scene.solids import Mesh
from tests.scene.meshes import open_edges, volume_m3

BODIES = {
    "box": (solids.box((1.0, 2.0, 3.0), (5.0, 0.0, 0.0)), 6.0),
    "cylinder": (solids.cylinder(1.0, 0.0, 2.0, 400), 2 * np.pi),
    "tube": (solids.tube(1.0, 2.0, 0.0, 1.0, 400), 3 * np.pi),
    "torus": (solids.torus(3.0, 1.0, 7.0, 400), 2 * np.pi**2 * 3.0 * 0.25),
}


@pytest.mark.parametrize("name", BODIES)
def test_a_body_is_closed_and_has_its_volume(name: str) -> None:
    mesh, volume = BODIES[name]
    assert open_edges(mesh) == 0
    assert volume_m3(mesh) == pytest.approx(volume, rel=0.06)


PARTS = {
    function.__name__: function()
    for function in (
        machinery.nose, machinery.casting, machinery.bearing, machinery.bolts, machinery.drive, machinery.motor,
        machinery.battery, machinery.cabinet, machinery.halo, machinery.nacelle, machinery.arrow,
        marks.collar, marks.ticks, marks.named_ticks, marks.feather_tick, marks.pointer,
    )
}  # fmt: skip


@pytest.mark.parametrize("name", PARTS)
def test_every_part_is_closed_and_looks_outwards(name: str) -> None:
    assert open_edges(PARTS[name]) == 0
    assert volume_m3(PARTS[name]) > 0


def test_a_hole_and_an_inverted_body_are_found() -> None:
    body = solids.box((1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    assert open_edges(Mesh(body.vertices, body.faces[:-1])) > 0
    assert volume_m3(Mesh(body.vertices, body.faces[:, ::-1])) < 0


def test_matrix_and_quaternion_turn_alike() -> None:
    w, x, y, z = solids.quaternion((0.0, 0.0, 1.0), 90.0)
    assert (x, y) == (0.0, 0.0)
    assert np.degrees(2 * np.arctan2(z, w)) == pytest.approx(90.0)
    turned = solids.rotation((0.0, 0.0, 1.0), 90.0) @ np.array([1.0, 0.0, 0.0])
    assert turned == pytest.approx([0.0, 1.0, 0.0])
