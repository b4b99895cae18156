"""Faults that can be put into a twin: the catalogue, what is ordered, and what is active. Pure data.

Two levels: on the device (what breaks in the drive or around it) and on the wire (what happens to frames). Texts are
``fault.<id>.name`` and ``fault.<id>.hint`` of the catalogue of texts, names of parameters ``fault_parameter.<name>``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final, NoReturn

from app.errors import UsageError

BLADES: Final = (1, 2, 3)
MAX_NODE: Final = 127
MAX_SECONDS: Final = 86_400.0
"""Longest time for which a fault can be ordered: a day."""
_FIELDS: Final = ("blade", "node", "for_s")


class FaultLevel(Enum):
    """Where a fault acts."""

    DEVICE = "device"
    WIRE = "wire"


class FaultTarget(Enum):
    """What a fault is put into.

    ``TURBINE``: all blades, or the ``blade`` that the order names (a momentary one has all). ``BLADE``: the order must
    name it. ``NODE``: the order must name the node. ``BUS``: all frames, or those that the ``node`` of the order sends.
    """

    TURBINE = "turbine"
    BLADE = "blade"
    NODE = "node"
    BUS = "bus"


@dataclass(frozen=True, slots=True)
class FaultParameter:
    """A number that an order may give: from ``low`` to ``high`` in ``unit``, else ``default``."""

    name: str
    unit: str
    low: float
    high: float
    default: float
    integer: bool = False


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind of fault. ``momentary``: it ends of itself by its own parameters, so ``seconds`` cannot be given."""

    id: str
    level: FaultLevel
    target: FaultTarget
    parameters: tuple[FaultParameter, ...] = ()
    momentary: bool = False


@dataclass(frozen=True, slots=True)
class FaultOrder:
    """What is wanted: a kind by its id, where, with which values, and for how long (None: until cleared)."""

    kind: str
    blade: int | None = None
    node: int | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class ActiveFault:
    """A fault that acts now, since ``since_ns`` (line time). ``id`` is its own as long as the twins run."""

    id: int
    order: FaultOrder
    since_ns: int


def _whole(name: str, low: int, high: int, default: int) -> FaultParameter:
    return FaultParameter(name, "", low, high, default, integer=True)


_PERCENT: Final = FaultParameter("percent", "%", 0.1, 100.0, 20.0)
_COUNT: Final = _whole("count", 0, 1_000_000, 0)
"""How many frames in all; 0: no end."""
_FIRST_ID: Final = _whole("first_id", 0, 0x7FF, 0)
_LAST_ID: Final = _whole("last_id", 0, 0x7FF, 0x7FF)
_FRAMES: Final = (_PERCENT, _COUNT, _FIRST_ID, _LAST_ID)
_REMAINING: Final = FaultParameter("remaining_percent", "%", 0.0, 130.0, 0.0)


def _device(id_: str, target: FaultTarget, *parameters: FaultParameter, momentary: bool = False) -> FaultKind:
    return FaultKind(id_, FaultLevel.DEVICE, target, parameters, momentary)


def _wire(id_: str, target: FaultTarget, *parameters: FaultParameter) -> FaultKind:
    return FaultKind(id_, FaultLevel.WIRE, target, parameters)


_KINDS: Final = (
    _device("mains_failure", FaultTarget.TURBINE, _REMAINING),
    _device("phase_loss", FaultTarget.TURBINE, _whole("phase", 1, 3, 1)),
    _device(
        "bloc_weak",
        FaultTarget.BLADE,
        _whole("bloc", 0, 6, 0),
        FaultParameter("capacity_percent", "%", 1.0, 100.0, 40.0),
        FaultParameter("ohm_factor", "", 1.0, 100.0, 5.0),
    ),
    _device("sensor_short", FaultTarget.BLADE, _whole("sensor", 1, 2, 1)),
    _device("sensor_open", FaultTarget.BLADE, _whole("sensor", 1, 2, 1)),
    _device("encoder_sine_cosine", FaultTarget.BLADE),
    _device("encoder_data", FaultTarget.BLADE),
    _device("blade_encoder_slip", FaultTarget.BLADE, FaultParameter("slip_deg", "deg", -45.0, 45.0, 5.0)),
    _device("blade_encoder_failed", FaultTarget.BLADE),
    _device("brake_stuck", FaultTarget.BLADE, _whole("lifted", 0, 1, 0)),
    _device("touch_probe", FaultTarget.BLADE),
    _device("overload", FaultTarget.BLADE, FaultParameter("moment_nm", "Nm", -200_000.0, 200_000.0, 30_000.0)),
    _device(
        "over_temperature",
        FaultTarget.BLADE,
        FaultParameter("heat_sink_w", "W", 0.0, 20_000.0, 1_500.0),
        FaultParameter("motor_w", "W", 0.0, 20_000.0, 0.0),
        FaultParameter("battery_w", "W", 0.0, 20_000.0, 0.0),
    ),
    _device("eeprom_slow", FaultTarget.NODE, FaultParameter("save_ms", "ms", 1.0, 60_000.0, 5_000.0)),
    _device("eeprom_failing", FaultTarget.NODE),
    _device("power_cut", FaultTarget.NODE, FaultParameter("off_s", "s", 0.001, 3_600.0, 2.0), momentary=True),
    _device(
        "gust",
        FaultTarget.TURBINE,
        FaultParameter("rise_mps", "m/s", -30.0, 50.0, 12.0),
        FaultParameter("duration_s", "s", 0.5, 600.0, 10.0),
        momentary=True,
    ),
    _wire("frames_lost", FaultTarget.BUS, *_FRAMES),
    _wire(
        "frames_delayed",
        FaultTarget.BUS,
        *_FRAMES,
        FaultParameter("delay_ms", "ms", 0.1, 10_000.0, 20.0),
        FaultParameter("spread_ms", "ms", 0.0, 10_000.0, 0.0),
    ),
    _wire("frames_doubled", FaultTarget.BUS, *_FRAMES),
    _wire("frames_reordered", FaultTarget.BUS, *_FRAMES, FaultParameter("hold_ms", "ms", 1.0, 10_000.0, 100.0)),
    _wire("bus_off", FaultTarget.NODE),
    _wire("node_gone", FaultTarget.NODE),
    _wire("late_sdo_ack", FaultTarget.NODE, FaultParameter("delay_ms", "ms", 1.0, 60_000.0, 2_000.0)),
    _wire(
        "babbling_node",
        FaultTarget.BUS,
        _whole("can_id", 0, 0x7FF, 0x010),
        FaultParameter("load_percent", "%", 1.0, 100.0, 80.0),
    ),
    _wire(
        "second_master",
        FaultTarget.NODE,
        _whole("index", 0x1000, 0xFFFF, 0x6081),
        _whole("sub", 0, 0xFF, 0),
        _whole("raw", -(1 << 31), (1 << 32) - 1, 400),
        _whole("nmt", 0, 0xFF, 0),
        FaultParameter("interval_ms", "ms", 10.0, 60_000.0, 1_000.0),
    ),
)
CATALOGUE: Final[Mapping[str, FaultKind]] = {kind.id: kind for kind in _KINDS}
"""All kinds by id, in the order in which they are shown."""


def kind_of(order: FaultOrder) -> FaultKind:
    """The kind that an order names. Raises UsageError (field ``kind``)."""
    kind = CATALOGUE.get(order.kind)
    return kind if kind is not None else _wrong("kind", f"'{order.kind}' is no fault")


def check_order(order: FaultOrder) -> FaultOrder:
    """The order with all its values, defaults filled in. Raises UsageError that names the field."""
    kind = kind_of(order)
    _check_place(kind, order)
    if order.seconds is not None:
        if kind.momentary:
            _wrong("for_s", f"{kind.id} ends of itself")
        _between("for_s", order.seconds, 0.0, MAX_SECONDS)
    known = {parameter.name: parameter for parameter in kind.parameters}
    for name in order.values:
        if name not in known:
            _wrong(name, f"{kind.id} has no such value")
    values = {name: _value(one, order.values.get(name, one.default)) for name, one in known.items()}
    if "first_id" in values and values["first_id"] > values["last_id"]:
        _wrong("first_id", "is above last_id")
    return FaultOrder(kind.id, order.blade, order.node, values, order.seconds)


def _check_place(kind: FaultKind, order: FaultOrder) -> None:
    of_blade = kind.target in (FaultTarget.TURBINE, FaultTarget.BLADE)
    if order.blade is None and kind.target is FaultTarget.BLADE:
        _wrong("blade", f"is missing: {kind.id} needs one")
    if order.node is None and kind.target is FaultTarget.NODE:
        _wrong("node", f"is missing: {kind.id} needs one")
    if order.blade is not None:
        if not of_blade or (kind.target is FaultTarget.TURBINE and kind.momentary):
            _wrong("blade", f"{kind.id} is not of a blade")
        if order.blade not in BLADES:
            _wrong("blade", f"is {order.blade!r}, not 1, 2 or 3")
    if order.node is not None:
        if of_blade:
            _wrong("node", f"{kind.id} is not of a node")
        if not _is_whole(order.node) or not 1 <= order.node <= MAX_NODE:
            _wrong("node", f"is {order.node!r}, not 1 to {MAX_NODE}")


def _value(parameter: FaultParameter, given: float) -> float:
    value = _between(parameter.name, given, parameter.low, parameter.high)
    if parameter.integer and value != int(value):
        _wrong(parameter.name, f"is {given!r}, no whole number")
    return int(value) if parameter.integer else float(value)


def _between(name: str, value: float, low: float, high: float) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not number or not low <= value <= high:
        _wrong(name, f"is {value!r}, not {low:g} to {high:g}")
    return value


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _wrong(name: str, reason: str) -> NoReturn:
    raise UsageError(reason=f"fault: field '{name}': {reason}", field=name)


# -- as tables (JSON, TOML) and as text ------------------------------------------------


def order_from_table(table: Mapping[str, Any]) -> FaultOrder:
    """The order that a flat table tells: ``fault``, ``blade``, ``node``, ``for_s``, and values by name. It is checked.

    Raises UsageError that names the field.
    """
    kind = table.get("fault")
    if not isinstance(kind, str):
        _wrong("fault", "is missing or no text")
    values = {name: value for name, value in table.items() if name not in ("fault", *_FIELDS)}
    return check_order(FaultOrder(kind, table.get("blade"), table.get("node"), values, table.get("for_s")))


def order_table(order: FaultOrder) -> dict[str, Any]:
    """The flat table of an order; what is not given is left out."""
    places = {"blade": order.blade, "node": order.node, "for_s": order.seconds}
    given = {name: value for name, value in places.items() if value is not None}
    return {"fault": order.kind, **given, **order.values}


def active_table(active: ActiveFault) -> dict[str, Any]:
    """The table of a fault that acts: ``id``, ``since_ns``, ``order``."""
    return {"id": active.id, "since_ns": active.since_ns, "order": order_table(active.order)}


def active_from_table(table: Mapping[str, Any]) -> ActiveFault:
    """What ``active_table`` made. Raises UsageError (order), KeyError, TypeError, ValueError (the rest)."""
    return ActiveFault(int(table["id"]), order_from_table(table["order"]), int(table["since_ns"]))


def kind_table(kind: FaultKind) -> dict[str, Any]:
    """The table of a kind."""
    return {
        "id": kind.id,
        "level": kind.level.value,
        "target": kind.target.value,
        "momentary": kind.momentary,
        "parameters": [
            {
                "name": parameter.name,
                "unit": parameter.unit,
                "low": parameter.low,
                "high": parameter.high,
                "default": parameter.default,
                "integer": parameter.integer,
            }
            for parameter in kind.parameters
        ],
    }


def kind_from_table(table: Mapping[str, Any]) -> FaultKind:
    """What ``kind_table`` made. Raises KeyError, TypeError, ValueError."""
    parameters = tuple(FaultParameter(**parameter) for parameter in table["parameters"])
    level, target = FaultLevel(table["level"]), FaultTarget(table["target"])
    return FaultKind(str(table["id"]), level, target, parameters, bool(table["momentary"]))


def order_from_words(kind: str, words: Iterable[str]) -> FaultOrder:
    """The order of a command line: a kind, and ``name=value`` words. Numbers may be hexadecimal (``0x6081``).

    Raises UsageError that names the field.
    """
    table: dict[str, Any] = {"fault": kind}
    for word in words:
        name, equals, text = word.partition("=")
        name = name.strip()
        if not equals or not name or name == "fault":
            _wrong(word, "is not NAME=VALUE")
        table[name] = _number(name, text.strip())
    return order_from_table(table)


def timed_order(text: str) -> tuple[float, FaultOrder]:
    """``KIND@5s,blade=2,...``: when in s from the start (0 where it is not said), and what.

    Raises UsageError that names the field.
    """
    head, *words = text.split(",")
    kind, at, when = head.partition("@")
    number = when.removesuffix("s")
    at_s = _between("at_s", _number("at_s", number), 0.0, MAX_SECONDS) if at else 0.0
    return at_s, order_from_words(kind.strip(), words)


def _number(name: str, text: str) -> float:
    try:
        return int(text, 0)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        _wrong(name, f"'{text}' is no number")
