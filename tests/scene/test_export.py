"""A stretch of time as a page: geometry and every pose are in it, at their times."""

from __future__ import annotations

import base64
import re
from typing import Any

import msgspec
import pytest
import zstandard

from app.scene.blade import PITCH_AXIS
from app.scene.export import Still, scene_page
from app.scene.hub import BladePose, BladeState, RotorPose, blade_node
from app.scene.solids import quaternion

ANGLES = (5.0, 30.0, 88.0)


def recorded(page: str) -> dict[str, Any]:
    """What the page plays: zstd behind its size, then the length of the messages, then these."""
    (data,) = re.findall(r'__VISER_EMBED_DATA__="([^"]*)"', page)
    plain = zstandard.ZstdDecompressor().decompressobj().decompress(base64.b64decode(data)[8:])
    found: dict[str, Any] = msgspec.msgpack.decode(plain[8 : 8 + int.from_bytes(plain[:8], "little")])
    return found


def test_the_page_holds_geometry_and_poses_at_their_times() -> None:
    stills = [
        Still({2: BladePose(angle, BladeState.FAULT if angle > 80 else BladeState.ENABLED)}, RotorPose(), 0.5)
        for angle in ANGLES
    ]
    page = scene_page(stills)
    tape = recorded(page)
    assert tape["durationSeconds"] == pytest.approx(1.5)
    meshes = [one["name"] for _, one in tape["messages"] if "Mesh" in one["type"]]
    assert f"{blade_node(2)}/pitch/blade" in meshes
    turned = [
        (at, one["wxyz"])
        for at, one in tape["messages"]
        if one["type"] == "SetOrientationMessage" and one["name"] == f"{blade_node(2)}/pitch"
    ]
    last = turned[-3:]
    assert [at for at, _ in last] == pytest.approx([0.0, 0.5, 1.0])
    for (_, wxyz), angle in zip(last, ANGLES, strict=True):
        assert wxyz == pytest.approx(list(quaternion(PITCH_AXIS, angle)))
    assert not re.search(r'(src|href)="https?:', page)
