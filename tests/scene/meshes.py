"""What can be asked of a mesh."""

from __future__ import annotations

from collections import Counter

import numpy as np

from app.scene.solids import Mesh


def open_edges(mesh: Mesh) -> int:
    """Edges whose two sides do not match, with vertices at one place taken as one: 0 for a closed, oriented surface."""
    places, place_of = np.unique(np.round(mesh.vertices, 6), axis=0, return_inverse=True)
    faces = place_of.ravel()[mesh.faces]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[whole]
    edges = Counter(
        (int(a), int(b))
        for pair in ((0, 1), (1, 2), (2, 0))
        for a, b in faces[:, pair]  # directed
    )
    assert len(places) > 3
    return sum(edges[b, a] != times for (a, b), times in edges.items())


def volume_m3(mesh: Mesh) -> float:
    """Positive where the faces look outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    return float((np.cross(a, b) * c).sum() / 6)
