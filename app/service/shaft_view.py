"""Axes without a blade, as the 3D view shows them: the angles of shaft and motor by the units that the device has.

Only what was seen on the wire is in it. An angle that the units do not give is not guessed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from app.model.address import Address
from app.model.site import Turbine
from app.model.values import Scaled, to_scaled
from app.service.devices import Target, decode
from app.service.views import STALE_NS, STATUSWORD, LookName, axis_state, fault_lines, look_of

POSITION: Final = Address(0x6064)
VELOCITY: Final = Address(0x606C)
GEAR: Final = (Address(0x6091, 1), Address(0x6091, 2))
"""Revolutions of the motor, and those of the shaft in the same time (CiA 402, gear ratio)."""
FEED: Final = (Address(0x6092, 1), Address(0x6092, 2))
"""Feed in user units, and the revolutions of the shaft that make it (CiA 402, feed constant)."""
ENCODER: Final = (Address(0x608F, 1), Address(0x608F, 2))
"""Increments, and the revolutions of the motor that make them (CiA 402, position encoder resolution)."""
SUBMODE: Final = Address(0x3202)
CLOSED_LOOP: Final = 1
"""Bit of 3202h: commutation is in closed loop."""
OPEN_LOOP_INCREMENTS: Final = 320_000
"""Of a motor revolution in open loop, where nothing is measured (PD4-E manual, 5.3.1)."""
_TURN_DEG: Final = 360.0


@dataclass(frozen=True, slots=True)
class ShaftLine:
    """One axis. ``turns``: the sign of its velocity, 0 where it stands or where that is not known or old."""

    station: str
    device: str
    shaft_deg: float | None
    motor_deg: float | None
    turns: int
    look: LookName


def shaft_lines(turbine: Turbine, targets: Mapping[str, Target], now_ns: int) -> tuple[ShaftLine, ...]:
    """Every axis of a station without a blade, in the order of the site file. ``targets`` by slug."""
    return tuple(
        _line(station.slug, targets[device.slug], now_ns)
        for station in turbine.stations
        if station.blade is None
        for device in station.devices
        if device.slug in targets and _is_axis(targets[device.slug])
    )


def _is_axis(target: Target) -> bool:
    return STATUSWORD in target.description.entries and POSITION in target.description.entries


def _line(station: str, target: Target, now_ns: int) -> ShaftLine:
    view = target.live.value(target.device.bus, target.node, POSITION)
    reading = None if view is None else view.reading
    node = target.live.node(target.device.bus, target.node)
    silent = node is not None and node.silent
    stale = reading is None or view is None or view.stale or silent or now_ns - reading.t_ns > STALE_NS
    motor_deg, shaft_deg = _angles(target)
    velocity = target.lookup(VELOCITY)
    turns = 0 if stale or not isinstance(velocity, int) else (velocity > 0) - (velocity < 0)
    return ShaftLine(station, target.slug, shaft_deg, motor_deg, turns, _look(target, shaft_deg, stale))


def _look(target: Target, shaft_deg: float | None, stale: bool) -> LookName:
    if shaft_deg is None:
        return "unknown"
    if stale:
        return "stale"
    status = target.lookup(STATUSWORD)
    state = axis_state(status) if isinstance(status, int) else None
    faults, _ = fault_lines([target])
    return look_of(state, faults)


def _angles(target: Target) -> tuple[float | None, float | None]:
    """Motor and shaft, in degrees since the zero position."""
    gear = _ratio(target, GEAR)
    scaled = _position(target)
    if scaled is None:
        return None, None
    number = float(scaled.number)
    if scaled.unit == "inc":
        increments = _increments(target)
        motor = None if increments is None else number / increments * _TURN_DEG
        return motor, None if motor is None or not gear else motor / gear
    shaft = _shaft_deg(target, scaled.unit, number)
    return None if shaft is None or gear is None else shaft * gear, shaft


def _shaft_deg(target: Target, unit: str, number: float) -> float | None:
    if unit == "°":
        return number
    if unit == "rev":
        return number * _TURN_DEG
    if unit == "step":
        return None
    # Lengths and plain numbers: the feed says them in the very units in which the position counts.
    feed, raw = _ratio(target, FEED), target.lookup(POSITION)
    return raw / feed * _TURN_DEG if feed and isinstance(raw, int) else None


def _position(target: Target) -> Scaled | None:
    view = target.live.value(target.device.bus, target.node, POSITION)
    if view is None or view.reading is None:
        return None
    entry = target.entry(POSITION)
    if entry.quantity_rule is not None and target.lookup(entry.quantity_rule.address) is None:
        return None  # in which unit it counts is not known yet
    return to_scaled(entry, decode(entry, view.reading.data), target.lookup)


def _increments(target: Target) -> float | None:
    submode = target.lookup(SUBMODE)
    if SUBMODE in target.description.entries:
        if not isinstance(submode, int):
            return None
        if not submode & CLOSED_LOOP:
            return float(OPEN_LOOP_INCREMENTS)
    return _ratio(target, ENCODER)


def _ratio(target: Target, objects: tuple[Address, Address]) -> float | None:
    above, below = (target.lookup(address) for address in objects)
    return above / below if isinstance(above, int) and isinstance(below, int) and below else None
