"""What the browser gets of the 3D client: its own page, shown bare, with the script that ties it to our page."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, Final

from app.scene import actuator
from app.scene.blade import ROOT_M, TIP_M
from app.scene.cameras import CAMERAS, Camera
from app.scene.hub import BLADES, NOSE, ROTOR, demand_node, selected_node
from app.scene.marks import NAMED_DEG, direction, label_place
from app.scene.shaft import LABEL_M, MOST, place_of
from app.scene.solids import Vector, rotation

_HERE: Final = Path(__file__).parent
_SHAFT: Final[Vector] = (1.0, 0.0, 0.0)
_LABEL_M: Final = ROOT_M + (TIP_M - ROOT_M) * 0.97
"""Where along a blade its label belongs: at the tip, where it hides least."""


_ACTUATORS: Final = range(1, actuator.MOST + 1)


def bare_page(page: bytes) -> bytes:
    """The client's page with our style and script at the start of its head, before anything of its own runs."""
    head, mark, rest = page.partition(b"<head>")
    return head + mark + _ours() + rest


@cache
def _ours() -> bytes:
    style = (_HERE / "bridge.css").read_text(encoding="utf-8")
    script = (_HERE / "bridge.js").read_text(encoding="utf-8")
    script = script.replace("/*SCENE*/ null", json.dumps(scene_facts()))
    return f"<style>{style}</style><script>{script}</script>".encode()


def scene_facts() -> dict[str, Any]:
    """What the script must know of the scene: cameras, nodes that a view sets itself, places of labels."""
    blades = [{"blade": blade, "selected": selected_node(blade), "demand": demand_node(blade)} for blade in BLADES]
    return {
        "rotor": ROTOR,
        "nose": NOSE,
        "cameras": [_camera(camera) for camera in CAMERAS],
        "blades": blades,
        "ghosts": [actuator.setpoint_node(number, one) for number in _ACTUATORS for one in (1, 2)],
        "places": [
            *(place for blade in BLADES for place in _places(blade)),
            *map(_shaft_place, range(1, MOST + 1)),
            *(place for number in _ACTUATORS for place in _actuator_places(number)),
        ],
    }


def _camera(camera: Camera) -> dict[str, Any]:
    return {
        "name": camera.name,
        "position": camera.position_m,
        "look_at": camera.look_at_m,
        "half": camera.half_m,
        "nose_off": camera.nose_off,
        "blade": camera.blade,
    }


def _shaft_place(number: int) -> dict[str, Any]:
    """Where the label of an axis on the bench belongs: it does not turn with the rotor."""
    position = [round(one + more, 4) for one, more in zip(place_of(number), LABEL_M, strict=True)]
    return {"id": f"shaft-{number}", "position": position, "normal": None, "fixed": True}


def _actuator_places(number: int) -> list[dict[str, Any]]:
    """Where the labels of two cylinders and of what they turn belong."""
    names = (*(f"cylinder-{number}-{one}" for one in (1, 2)), f"turned-{number}")
    found = []
    for name, more in zip(names, (*actuator.LABELS_M, actuator.BLADE_LABEL_M), strict=True):
        position = [round(one + by, 4) for one, by in zip(actuator.place_of(number), more, strict=True)]
        found.append({"id": name, "position": position, "normal": None, "fixed": True})
    return found


def _places(blade: int) -> list[dict[str, Any]]:
    """Places of labels in rotor axes: the blade's, its root's, and those of the named marks, seen from outside only."""
    turn = rotation(_SHAFT, 120.0 * (blade - 1))

    def turned(point: Vector) -> list[float]:
        return [round(float(one), 4) for one in turn @ point]

    places = [
        {"id": f"blade-{blade}", "position": turned((0.0, 0.0, _LABEL_M)), "normal": None},
        {"id": f"root-{blade}", "position": turned((0.0, 0.0, ROOT_M + 1.9)), "normal": None},
    ]
    for degrees in NAMED_DEG:
        position, normal = turned(label_place(degrees)), turned(direction(degrees))
        places.append({"id": f"mark-{blade}-{degrees}", "position": position, "normal": normal})
    return places
