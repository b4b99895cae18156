"""A stretch of time as a page of its own: the 3D view with what its blades did, played by the page itself."""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from app.scene.hub import BladePose, HubScene, RotorPose


class Still(NamedTuple):
    """Blades and rotor, and how long they are shown, in s."""

    blades: Mapping[int, BladePose]
    rotor: RotorPose
    lasts_s: float


def scene_page(stills: Sequence[Still]) -> str:
    """One HTML document that needs no server. Takes a second; a 3D server of its own runs meanwhile."""
    scene = HubScene(secrets.token_hex(32))
    try:
        return scene.played((one.blades, one.rotor, one.lasts_s) for one in stills)
    finally:
        scene.close()
