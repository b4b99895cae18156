"""Hydraulic cylinders and the root of the blade that they turn, as meshes.

Drawn several times their size beside the blade; proportions are usual ones, no maker's, and the linkage is that of
``app.scene.linkage``. The pitch axis points along +x, towards who looks; positive is counter-clockwise for him. A
cylinder is made along +x from its foot, and turned to where it belongs.
"""

from __future__ import annotations

from typing import Final

from app.scene.blade import ROOT_M, blade_mesh, root_radius_m
from app.scene.linkage import CRANK, FOOT, SHORTEST
from app.scene.solids import Mesh, Vector, box, cylinder, merged, torus, tube

STROKE_M: Final = 0.8
"""Drawn length of one stroke."""
FOOT_M: Final = FOOT * STROKE_M
CRANK_M: Final = CRANK * STROKE_M
SHORTEST_M: Final = SHORTEST * STROKE_M
PLANE_M: Final = 0.46
"""Of the cylinders, before the blade's root."""
AXIS: Final[Vector] = (1.0, 0.0, 0.0)
_ALONG: Final[Vector] = (0.0, 1.0, 0.0)
"""Turning by 90 degrees about y brings z to x: bodies of revolution are made about z."""
_RADIUS: Final = root_radius_m()
_TUBE_M: Final = (0.10, 1.08)
_BORE_M: Final = 0.135
_ROD_M: Final = 0.062
_RAIL_M: Final = -0.27
"""Of the scale: beside the tube, on the side that looks away from the pitch axis."""
_BLADE_SPAN: Final = 0.22
"""Share of its drawn length at which the blade is drawn behind its root."""


def _lying(mesh: Mesh) -> Mesh:
    return mesh.turned(_ALONG, 90)


def barrel() -> Mesh:
    """The tube with its two heads: what is coloured by the state."""
    low, high = _TUBE_M
    heads = [cylinder(_BORE_M * 1.22, at, at + 0.09) for at in (low, high - 0.09)]
    return merged([_lying(one) for one in (cylinder(_BORE_M, low, high), *heads)])


def foot() -> Mesh:
    """The eye at the foot, and the pin that it turns about."""
    pin = [cylinder(0.11, -0.08, 0.08), cylinder(0.055, -0.20, 0.20)]
    return merged([*(one.turned(AXIS, 90) for one in pin), box((0.16, 0.12, 0.10), (0.07, 0.0, 0.0))])


def valve() -> Mesh:
    """The proportional valve on its block, with a magnet at either end, and the lines to both ports."""
    block = box((0.30, 0.15, 0.15), (0.58, 0.0, 0.20))
    body = box((0.34, 0.11, 0.11), (0.58, 0.0, 0.33))
    magnets = [_lying(cylinder(0.06, at, at + 0.16)).moved((0.0, 0.0, 0.33)) for at in (0.25, 0.75)]
    pipes = [_lying(cylinder(0.022, low, high)).moved((0.0, 0.0, 0.18)) for low, high in ((0.18, 0.45), (0.71, 1.0))]
    return merged([block, body, *magnets, *pipes])


def rod() -> Mesh:
    """The rod with the eye at its end; its origin is the middle of the eye."""
    eye = cylinder(0.115, -0.06, 0.06).turned(AXIS, 90)
    return merged([_lying(cylinder(_ROD_M, -1.0, -0.08)), eye, _lying(cylinder(0.08, -0.17, -0.06))])


def ghost() -> Mesh:
    """The rod as it would stand at the setpoint: a little thicker, so that it shows round the true one."""
    return merged([_lying(cylinder(_ROD_M * 1.35, -1.0, -0.08)), cylinder(0.14, -0.07, 0.07).turned(AXIS, 90)])


def pointer() -> Mesh:
    """From the eye of the rod to the scale."""
    return box((0.03, 0.03, 0.22), (0.0, 0.0, _RAIL_M + 0.07))


def rail() -> Mesh:
    """The scale that the pointer runs along, held by the tube: one stroke long."""
    bar = box((STROKE_M + 0.06, 0.03, 0.05), (SHORTEST_M + STROKE_M / 2, 0.05, _RAIL_M))
    arm = box((SHORTEST_M - 0.9, 0.03, 0.03), ((SHORTEST_M + 0.9) / 2, 0.05, _RAIL_M))
    post = box((0.05, 0.04, -_RAIL_M), (0.93, 0.05, _RAIL_M / 2))
    return merged([bar, arm, post])


def ticks() -> Mesh:
    """Marks of the scale at every tenth of the stroke, long ones at its ends and its middle."""
    return merged(
        box((0.014, 0.03, 0.12 if tenth % 5 == 0 else 0.07), (SHORTEST_M + STROKE_M * tenth / 10, 0.03, _RAIL_M))
        for tenth in range(11)
    )


def limit(upper: bool) -> Mesh:
    """The mark of a limit of travel: a stop across the scale, and a wedge that points to where the rod may be."""
    side = -1.0 if upper else 1.0
    stop = box((0.04, 0.12, 0.26), (-side * 0.02, 0.02, _RAIL_M - 0.05))
    steps = [
        box((0.03, 0.08, width), (side * at, 0.02, _RAIL_M - 0.11)) for width, at in ((0.12, 0.015), (0.06, 0.045))
    ]
    return merged([stop, *steps])


def halo() -> Mesh:
    """What shines around a cylinder with a fault."""
    return merged([_lying(torus(_BORE_M * 2.1, 0.05, at)) for at in (0.2, 0.95)])


def frame(feet: int) -> Mesh:
    """What stands still: the bearing's ring, and the brackets of so many feet, below and above."""
    ring = _lying(tube(_RADIUS * 1.03, _RADIUS * 1.20, -0.22, 0.06))
    parts = [ring]
    for side in (-1.0, 1.0)[:feet]:
        beam = box((0.16, 0.46, FOOT_M + 0.16 - _RADIUS), (-0.02, 0.0, side * (FOOT_M + 0.16 + _RADIUS) / 2))
        cheeks = [box((0.06, 0.26, 0.30), (PLANE_M + x, 0.0, side * FOOT_M)) for x in (-0.14, 0.14)]
        base = box((PLANE_M + 0.1, 0.26, 0.07), (PLANE_M / 2 + 0.1, 0.0, side * (FOOT_M + 0.16)))
        parts += [beam, *cheeks, base]
    return merged(parts)


def disc() -> Mesh:
    """The plate that closes the blade's root, with its bolts and the mark that is up at 0."""
    bolts = [
        cylinder(0.028, 0.06, 0.10, 8).moved((_RADIUS * 0.93, 0, 0)).turned((0, 0, 1), 15.0 * one) for one in range(24)
    ]
    return merged([_lying(one) for one in (cylinder(_RADIUS, -0.10, 0.06), cylinder(0.20, 0.06, 0.14), *bolts)])


def mark() -> Mesh:
    """The mark on the disc: a bar at its edge, up at 0."""
    return box((0.05, 0.07, 0.26), (0.085, 0.0, _RADIUS * 0.86))


def crank() -> Mesh:
    """One crank on the disc, and the pin that a rod takes hold of; to the right (+y)."""
    arm = box((0.12, CRANK_M + 0.10, 0.17), (0.14, CRANK_M / 2, 0.0))
    return merged([arm, _lying(cylinder(0.05, 0.06, PLANE_M + 0.10)).moved((0.0, CRANK_M, 0.0))])


def blade() -> Mesh:
    """The blade behind its root, shortened; its leading edge is up at 0."""
    mesh = blade_mesh()
    low = Mesh((mesh.vertices - (0.0, 0.0, ROOT_M)) * (1.0, 1.0, _BLADE_SPAN), mesh.faces)
    # From upwards to away from who looks, then round so that the leading edge, which is at -y, is up.
    return low.turned(_ALONG, -90).turned(AXIS, -90).moved((-0.10, 0.0, 0.0))
