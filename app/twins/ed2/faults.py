"""Faults that can be put into ED2 twins: kinds, orders as text, and a plan that has them happen at their times."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count
from math import isfinite
from typing import Final, NamedTuple, NoReturn

from app.errors import UsageError
from app.twins.ed2.axis import Axis
from app.twins.ed2.device import Ed2
from app.twins.ed2.digital import Input, level_of
from app.twins.ed2.dp_line import Fault, LineNoise

_SECOND: Final = 1_000_000_000
_FOREVER_NS: Final = 1 << 62
MAX_SECONDS: Final = 86_400.0


class Value(NamedTuple):
    """The number that a kind takes: from ``low`` to ``high``, else ``default``."""

    low: float
    high: float
    default: float


@dataclass(frozen=True, slots=True)
class Order:
    """A fault: on one axis (None: of the device, or of the line), from ``at_s`` on for ``for_s`` (None: for good)."""

    kind: str
    slave: int | None = None
    axis: int | None = None
    value: float = 0.0
    at_s: float = 0.0
    for_s: float | None = None


Undo = Callable[[], None]
OnDevice = Callable[[Ed2, float], Undo]
OnAxis = Callable[[Axis, float], Undo]


def _set(thing: object, name: str, value: object) -> Undo:
    """Change something, and give the way back."""
    before = getattr(thing, name)
    setattr(thing, name, value)
    return lambda: setattr(thing, name, before)


def _all(undo: Iterable[Undo]) -> Undo:
    """The way back from several."""
    ways = tuple(undo)

    def back() -> None:
        for way in ways:
            way()

    return back


def _switch_wire(axis: Axis, positive: bool) -> Undo:
    negative_too, positive_too = axis.surroundings.switch_broken
    broken = (negative_too, True) if positive else (True, positive_too)
    return _set(axis.surroundings, "switch_broken", broken)


def _joystick(axis: Axis, device: Ed2) -> Undo:
    analog, place = device.kernel.conditions.analog, 3 + axis.number
    before, analog[place] = analog[place], 0.0
    return lambda: analog.__setitem__(place, before)


def _release(device: Ed2) -> Undo:
    conditions = device.kernel.conditions
    return _set(conditions, "levels", conditions.levels & ~level_of(Input.RELEASE))


def _power(device: Ed2) -> Undo:
    device.power_off()
    return device.power_on


def _memory(device: Ed2) -> Undo:
    return _all(_set(channel.memory, "failing", True) for channel in device.channels)


def _slow_memory(device: Ed2, seconds: float) -> Undo:
    return _all(_set(channel.memory, "slow_ns", round(seconds * _SECOND)) for channel in device.channels)


ON_AXIS: Final[Mapping[str, tuple[Value | None, OnAxis]]] = {
    "sensor_wire": (None, lambda axis, _: _set(axis.transducer.wire, "broken", True)),
    "sensor_values": (None, lambda axis, _: _set(axis.transducer.wire, "disturbed", True)),
    "sensor_slip": (Value(-500.0, 500.0, 5.0), lambda axis, mm: _set(axis.transducer.wire, "slip_mm", mm)),
    "magnet_a_wire": (None, lambda axis, _: _set(axis.surroundings, "magnet_a_broken", True)),
    "magnet_b_wire": (None, lambda axis, _: _set(axis.surroundings, "magnet_b_broken", True)),
    "limit_negative_wire": (None, lambda axis, _: _switch_wire(axis, False)),
    "limit_positive_wire": (None, lambda axis, _: _switch_wire(axis, True)),
    "load": (Value(-100_000.0, 100_000.0, 20_000.0), lambda axis, n: _set(axis.surroundings, "load_n", n)),
}
"""On one axis; ``value`` is in mm or N."""
ON_DEVICE: Final[Mapping[str, tuple[Value | None, OnDevice]]] = {
    "joystick_1_wire": (None, lambda device, _: _joystick(device.axes[0], device)),
    "joystick_2_wire": (None, lambda device, _: _joystick(device.axes[1], device)),
    "supply": (Value(0.0, 60.0, 15.0), lambda device, volt: _set(device.kernel.conditions, "supply_v", volt)),
    "pressure": (Value(0.0, 300.0, 0.0), lambda device, bar: _set(device.kernel.conditions, "supply_bar", bar)),
    "release": (None, lambda device, _: _release(device)),
    "power": (None, lambda device, _: _power(device)),
    "eeprom_failing": (None, lambda device, _: _memory(device)),
    "eeprom_slow": (Value(0.001, 60.0, 5.0), _slow_memory),
}
"""On a device; ``value`` is in V, bar or s."""
ON_LINE: Final[Mapping[str, str]] = {
    "answers_lost": "lost",
    "answers_doubled": "doubled",
    "answers_cut": "truncated",
    "bit_errors": "bit_errors",
}
"""On what slaves send, ``value`` in per cent of the answers, or of the bits."""
_SHARE: Final = Value(0.0, 100.0, 5.0)
KINDS: Final = (*ON_AXIS, *ON_DEVICE, *ON_LINE)


def parse_order(text: str) -> Order:
    """``KIND@5s,axis=1,slave=6,value=15,for_s=10``: what, when in s from the start, where, how much and how long.

    Raises UsageError that names the field.
    """
    head, *words = text.split(",")
    kind, _, when = head.partition("@")
    given: dict[str, float] = {"at_s": _number("at_s", when.removesuffix("s"))} if when else {}
    for word in words:
        name, _, number = word.partition("=")
        if name not in ("axis", "slave", "value", "for_s"):
            _wrong(name, "is not known here")
        given[name] = _number(name, number)
    return check_order(kind.strip(), given)


def check_order(kind: str, given: Mapping[str, float]) -> Order:
    """An order that makes sense. Raises UsageError that names the field."""
    if kind not in KINDS:
        _wrong("fault", f"'{kind}' is none of: {', '.join(KINDS)}")
    axis, slave = given.get("axis"), given.get("slave")
    if (axis is not None) != (kind in ON_AXIS) or axis not in (None, 1, 2):
        _wrong("axis", f"is 1 or 2 with {', '.join(ON_AXIS)}, and not there with others")
    if slave is not None and kind in ON_LINE:
        _wrong("slave", f"{kind} is of the line")
    limits = _limits(kind)
    if limits is None and "value" in given:
        _wrong("value", f"{kind} takes none")
    value = 0.0 if limits is None else given.get("value", limits.default)
    if limits is not None:
        _between("value", value, limits.low, limits.high)
    for name in ("at_s", "for_s"):
        _between(name, given.get(name, 0.0), 0.0, MAX_SECONDS)
    return Order(
        kind,
        None if slave is None else int(slave),
        None if axis is None else int(axis),
        value,
        given.get("at_s", 0.0),
        given.get("for_s"),
    )


class FaultPlan:
    """Has faults happen and end, on the time of the line. It is run like a device.

    ``make_noise`` is told what happens to the answers of slaves.
    """

    def __init__(self, devices: Sequence[Ed2], make_noise: Callable[[Fault | None], None], seed: int = 0) -> None:
        self._devices = devices
        self._make_noise = make_noise
        self._seed = seed
        self._now_ns = 0
        self._numbers = count()
        self._due: list[tuple[int, int, Callable[[], None]]] = []
        self._shares: dict[str, float] = {}

    def add(self, order: Order) -> None:
        """Have a fault happen. Raises UsageError where no such device is there."""
        devices = [device for device in self._devices if order.slave in (None, device.settings.address)]
        if not devices:
            _wrong("slave", f"nobody has address {order.slave}")
        self._at(self._now_ns + round(order.at_s * _SECOND), lambda: self._begin(order, devices))

    def next_due_ns(self) -> int:
        """When the next one begins or ends."""
        return self._due[0][0] if self._due else _FOREVER_NS

    def run_until(self, t_ns: int) -> None:
        """Let what is due happen."""
        while self._due and self._due[0][0] <= t_ns:
            due_ns, _, act = heappop(self._due)
            self._now_ns = max(due_ns, self._now_ns)
            act()
        self._now_ns = max(t_ns, self._now_ns)

    def _at(self, t_ns: int, act: Callable[[], None]) -> None:
        heappush(self._due, (t_ns, next(self._numbers), act))

    def _begin(self, order: Order, devices: Sequence[Ed2]) -> None:
        on_line = order.kind in ON_LINE
        end = self._noise(order) if on_line else _all([_put_in(order, device) for device in devices])
        if order.for_s is not None:
            self._at(self._now_ns + round(order.for_s * _SECOND), end)

    def _noise(self, order: Order) -> Undo:
        name = ON_LINE[order.kind]

        def become(share: float) -> None:
            self._shares[name] = share
            noisy = any(self._shares.values())
            self._make_noise(LineNoise(self._seed, **self._shares) if noisy else None)

        become(order.value / 100.0)
        return lambda: become(0.0)


def _put_in(order: Order, device: Ed2) -> Undo:
    if order.axis is None:
        return ON_DEVICE[order.kind][1](device, order.value)
    return ON_AXIS[order.kind][1](device.axes[order.axis - 1], order.value)


def _limits(kind: str) -> Value | None:
    if kind in ON_LINE:
        return _SHARE
    return ON_AXIS[kind][0] if kind in ON_AXIS else ON_DEVICE[kind][0]


def _number(name: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        _wrong(name, f"'{text}' is no number")
    if not isfinite(number):
        _wrong(name, f"'{text}' is no number")
    return number


def _between(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:
        _wrong(name, f"is {value:g}, not {low:g} to {high:g}")


def _wrong(name: str, reason: str) -> NoReturn:
    raise UsageError(reason=f"fault: field '{name}': {reason}", field=name)
