"""Hydraulic cylinders as the page and the 3D view show them: by the objects that a description names for it.

Only what was seen on the wire is in it. Of a cylinder whose place no telegram carries nothing is known but its errors.
The cylinders of one station drive one blade. Pure: live state in, small views out.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import cycle
from typing import Final, Literal

from app.model.address import Address
from app.model.cylinders import MOST, Cylinders
from app.model.site import Turbine
from app.model.values import to_scaled
from app.scene import linkage
from app.service.devices import Target, decode
from app.service.views import STALE_NS, LookName

DEGREE: Final = "°"
_STROKE: Final[Mapping[str, float]] = {"mm": 500.0, "in": 20.0}
"""Of a cylinder as it is drawn where nothing asks for a longer one; no object tells the true one."""
_OVER: Final = 0.02
"""By such a share of the stroke a rod may be beyond its end before a longer one is drawn."""
_SEVERITY: Final[Mapping[str, int]] = {"idle": 0, "enabled": 1, "warning": 2, "fault": 3}
UnitName = Literal["mm", "in", "°", ""]
_UNITS: Final[Mapping[str, UnitName]] = {"mm": "mm", "in": "in", DEGREE: "°"}


@dataclass(frozen=True, slots=True)
class CylinderLine:
    """One cylinder, ``number`` 1 or 2, of a station. Lengths are in ``unit``, which is empty where it is not known.

    ``position`` None: no telegram carries it, or none was seen. ``setpoint`` is None while the rod follows none, and
    ``limits`` where they do not count. ``extension``, ``setpoint_at`` and ``limits_at`` are the same as shares of the
    stroke as drawn. ``state`` and ``fault_text_key`` are text keys; ``fault_code`` is 0 where this cylinder has no
    fault, None where that is not known.
    """

    number: int
    device: str
    unit: UnitName
    position: float | None
    position_t_ns: int | None
    setpoint: float | None
    limits: tuple[float, float] | None
    extension: float | None
    setpoint_at: float | None
    limits_at: tuple[float, float] | None
    state: str | None
    fault_code: int | None
    fault_text_key: str | None
    look: LookName


@dataclass(frozen=True, slots=True)
class CylindersLine:
    """What turns one blade. ``synchronous``: they move as one; None where nobody has told yet.

    ``deviation`` is the first cylinder's position less the second's, None where not both are known and fresh.
    ``angle_deg`` is how far the blade as drawn is turned by them (``app.scene.linkage``): no angle of a machine.
    """

    station: str
    blade: int | None
    synchronous: bool | None
    cylinders: tuple[CylinderLine, ...]
    unit: UnitName
    deviation: float | None
    angle_deg: float | None
    look: LookName


def cylinder_lines(turbine: Turbine, targets: Mapping[str, Target], now_ns: int) -> tuple[CylindersLine, ...]:
    """Every station that has cylinders, in the order of the site file. ``targets`` by slug."""
    found = []
    for station in turbine.stations:
        devices = [targets[device.slug] for device in station.devices if device.slug in targets]
        having = [(device, roles) for device in devices if (roles := device.description.cylinders) is not None]
        if having:
            found.append(_station_line(station.slug, station.blade, having, now_ns))
    return tuple(found)


def _station_line(
    station: str, blade: int | None, devices: list[tuple[Target, Cylinders]], now_ns: int
) -> CylindersLine:
    # Where there are several devices, each tells of the cylinder whose telegram it exchanges.
    if len(devices) > 1:
        synchronous: bool | None = True
        lines = [_Seen(*device, now_ns).line(at) for at, device in enumerate(devices[:MOST], 1)]
    else:
        seen = _Seen(*devices[0], now_ns)
        synchronous = seen.roles.synchronous.of(seen.target.lookup) if seen.roles.count > 1 else False
        lines = [seen.line(1), *(seen.other(at) for at in range(2, seen.roles.count + 1))]
    known = [line for line in lines if line.extension is not None]
    driving = known if synchronous else known[:1]
    angles = [linkage.angle_deg(line.extension) for line in driving if line.extension is not None]
    return CylindersLine(
        station=station,
        blade=blade,
        synchronous=synchronous,
        cylinders=tuple(lines),
        unit=lines[0].unit,
        deviation=_deviation(lines),
        angle_deg=round(sum(angles) / len(angles), 2) if angles else None,
        look=_worst(driving or lines[:1]),
    )


def _deviation(lines: list[CylinderLine]) -> float | None:
    fresh = [line.position for line in lines if line.position is not None and line.look != "stale"]
    if len(fresh) < MOST or lines[0].unit != lines[1].unit:
        return None
    return round(fresh[0] - fresh[1], 4)


def _worst(lines: Iterable[CylinderLine]) -> LookName:
    looks = [line.look for line in lines]
    for one in ("unknown", "stale"):
        if one in looks:
            return one
    return max(looks, key=lambda look: _SEVERITY[look])


class _Seen:
    """What the wire has shown of one device."""

    def __init__(self, target: Target, roles: Cylinders, now_ns: int) -> None:
        self.target = target
        self.roles = roles
        self._now_ns = now_ns
        machine = target.description.machine
        status = None if machine is None else target.lookup(machine.statusword)
        self._status = status if isinstance(status, int) else None
        self._state = None if machine is None or self._status is None else machine.state_of(self._status)
        code = target.lookup(roles.error)
        self._code = code if isinstance(code, int) else None
        node = target.live.node(target.device.bus, target.node)
        self._silent = node is not None and node.silent

    def line(self, number: int) -> CylinderLine:
        """The cylinder whose objects these are."""
        roles = self.roles
        position, unit, t_ns, stale = self._position()
        limits = self._limits()
        setpoint = self._setpoint() if position is not None and not stale else None
        stroke = _Stroke(unit, [number for number in (position, *(limits or ())) if number is not None])
        code, text_key = self._fault(1 if roles.count > 1 else None)
        return CylinderLine(
            number=number,
            device=self.target.slug,
            unit=unit,
            position=position,
            position_t_ns=t_ns,
            setpoint=setpoint,
            limits=limits,
            extension=None if position is None else stroke.share(position),
            setpoint_at=None if setpoint is None else stroke.share(setpoint),
            limits_at=None if limits is None else (stroke.share(limits[0]), stroke.share(limits[1])),
            state=None if self._state is None else self._state.text_key,
            fault_code=code,
            fault_text_key=text_key,
            look=self._look(position, stale, code),
        )

    def other(self, number: int) -> CylinderLine:
        """A cylinder of the same device that no telegram tells of."""
        code, text_key = self._fault(number)
        return CylinderLine(
            number=number,
            device=self.target.slug,
            unit="",
            position=None,
            position_t_ns=None,
            setpoint=None,
            limits=None,
            extension=None,
            setpoint_at=None,
            limits_at=None,
            state=None,
            fault_code=code,
            fault_text_key=text_key,
            look="fault" if code and not self._silent else "unknown",
        )

    def _position(self) -> tuple[float | None, UnitName, int | None, bool]:
        view = self.target.live.value(self.target.device.bus, self.target.node, self.roles.position)
        if view is None or view.reading is None:
            return None, "", None, False
        number, unit = self._number(self.roles.position)
        t_ns = view.reading.t_ns
        return number, unit, t_ns, view.stale or self._silent or self._now_ns - t_ns > STALE_NS

    def _number(self, address: Address) -> tuple[float | None, UnitName]:
        """In the unit that the device has chosen; an empty one where nobody has told it yet, with the same number."""
        target = self.target
        view = target.live.value(target.device.bus, target.node, address)
        entry = target.entry(address)
        if view is None or view.reading is None:
            return None, ""
        scaled = to_scaled(entry, decode(entry, view.reading.data), target.lookup)
        if scaled is None:
            return None, ""
        unit = _UNITS.get(scaled.unit, "")
        return round(float(scaled.number), 4), unit

    def _limits(self) -> tuple[float, float] | None:
        if not self.roles.limited.of(self.target.lookup):
            return None
        (low, _), (high, _) = (self._number(address) for address in self.roles.limits)
        return None if low is None or high is None else (low, high)

    def _setpoint(self) -> float | None:
        """What is not known does not keep it from being shown: what is known to be otherwise does."""
        if self._state is None or not self._state.runs:
            return None
        if any(condition.of(self.target.lookup) is False for condition in self.roles.follows):
            return None
        return self._number(self.roles.setpoint)[0]

    def _fault(self, cylinder: int | None) -> tuple[int | None, str | None]:
        """The code that concerns this cylinder, and its text; one that names no cylinder concerns all."""
        if not self._code:
            return self._code, None
        error = self.target.description.errors.get(self._code)
        if error is not None and cylinder is not None and error.number not in (None, cylinder):
            return 0, None
        return self._code, None if error is None else error.text_key

    def _look(self, position: float | None, stale: bool, code: int | None) -> LookName:
        if position is None:
            return "unknown"
        if stale:
            return "stale"
        if code:
            return "fault"
        if self._code:
            return "warning"  # it stands for the sake of the other one
        if self._state is not None and self._state.fault:
            return "fault"
        if self._status is not None and self._status & self.roles.warning:
            return "warning"
        return "enabled" if self._state is not None and self._state.powered else "idle"


class _Stroke:
    """From where to where a rod is drawn: the usual stroke, or as many times of it as what is known needs."""

    def __init__(self, unit: UnitName, numbers: list[float]) -> None:
        self._unit = unit
        usual = _STROKE.get(unit, _STROKE["mm"])
        steps: Iterator[int] = cycle((2, 5, 10))
        reach, factor, decade = max(map(abs, numbers), default=0.0), 1, 1
        for step in steps:
            if usual * factor * (1.0 + _OVER) >= reach:
                break
            factor = decade * step
            decade *= 10 if step == 10 else 1
        self._high = usual * factor
        self._low = -self._high if min(numbers, default=0.0) < -_OVER * self._high else 0.0

    def share(self, number: float) -> float:
        """Of the stroke, 0 to 1; an angle is where a rod must stand for it."""
        if self._unit == DEGREE:
            return round(linkage.extension_at(min(max(number, 0.0), linkage.RANGE_DEG)), 5)
        return round(min(max((number - self._low) / (self._high - self._low), 0.0), 1.0), 5)
