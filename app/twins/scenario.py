"""Scenarios: what happens to twins and when, from a TOML file. The same file makes the same frames, byte for byte.

::

    title = "Mains failure"        # wanted
    note = "What to see."          # may be missing
    seed = 7                       # of all that is random in it; default 0
    duration_s = 60.0              # wanted; at its end all faults are cleared

    [start]
    angle_deg = 0.0                # of the blades of a turbine that is built for this scenario
    wind_mps = 11.0                # mean wind; the turbine's own where it is missing
    operational = true             # NMT start to all nodes as soon as they have booted
    controller = true              # a turbine controller drives the axes

    [[parameters]]                 # what somebody has changed before
    blade = 2                      # all blades where it is missing
    device = "pmc"                 # or "pmm"
    address = "60FB:01"
    raw = 2
    save = true                    # also in the memory of the device; default false

    [[event]]
    at_s = 5.0
    fault = "mains_failure"        # a kind of the catalogue, with blade or node, for_s, and its values
    for_s = 10.0

    [[event]]
    at_s = 20.0
    clear = true                   # all faults, or clear = "node_gone", with blade or node

    [[event]]
    at_s = 25.0
    controller = { angle_deg = 45.0 }

    [[event]]
    at_s = 30.0
    master = { do = "write", node = 12, address = "60FB:01", raw = 17 }

A service master can ``read`` and ``write`` (node, address, raw), ``save`` (node), ``restart`` (node) and send ``nmt``
(node, 0 for all; command ``start``, ``stop``, ``pre_operational``, ``reset_node``, ``reset_communication``).
Times count from the beginning of the scenario. A key that is not known is an error.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any, Final, NoReturn, TypeVar

from app.errors import UsageError
from app.model.address import Address, Addressing, parse_address
from app.model.fault import BLADES, CATALOGUE, MAX_NODE, FaultOrder, order_from_table
from app.model.toml_lines import TomlLines
from app.wire.nmt import NmtCommand

MAX_DURATION_S: Final = 7 * 24 * 3600.0
MAX_SEED: Final = (1 << 63) - 1
MAX_BYTES: Final = 1 << 18
"""Longest text of a scenario."""
_NS: Final = 1_000_000_000
_ANGLES: Final = (-5.0, 100.0)
"""Between the end stops of the blade."""
_STRONGEST_MPS: Final = 60.0
_Choice = TypeVar("_Choice", bound=Enum)


class Unit(Enum):
    """Which device of a blade."""

    PMM = "pmm"
    PMC = "pmc"


class MasterDo(Enum):
    """What a service master can do."""

    READ = "read"
    WRITE = "write"
    SAVE = "save"
    RESTART = "restart"
    NMT = "nmt"


@dataclass(frozen=True, slots=True)
class Start:
    """How things are at the beginning; see the module."""

    angle_deg: float | None = None
    wind_mps: float | None = None
    operational: bool = False
    controller: bool = False


@dataclass(frozen=True, slots=True)
class Preset:
    """A parameter that was changed before the scenario begins. ``blade`` None: of all blades."""

    unit: Unit
    address: Address
    raw: int
    blade: int | None = None
    save: bool = False


@dataclass(frozen=True, slots=True)
class Clear:
    """Faults end: of this kind, blade and node, where they are named, else all."""

    kind: str | None = None
    blade: int | None = None
    node: int | None = None

    def covers(self, order: FaultOrder) -> bool:
        """Whether a fault that was ordered so ends."""
        wanted = ((self.kind, order.kind), (self.blade, order.blade), (self.node, order.node))
        return all(mine is None or mine == given for mine, given in wanted)


@dataclass(frozen=True, slots=True)
class Control:
    """A command to the turbine controller, as its own table."""

    table: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class MasterOrder:
    """An action of a service master."""

    do: MasterDo
    node: int
    address: Address | None = None
    raw: int = 0
    command: NmtCommand | None = None


Action = FaultOrder | Clear | Control | MasterOrder


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happens ``at_ns`` after the beginning."""

    at_ns: int
    action: Action


@dataclass(frozen=True, slots=True)
class Scenario:
    """A whole scenario; ``events`` in the order of time, those of one instant in the order of the file."""

    title: str
    duration_s: float
    seed: int = 0
    note: str = ""
    start: Start = field(default_factory=Start)
    presets: tuple[Preset, ...] = ()
    events: tuple[Event, ...] = ()

    @property
    def duration_ns(self) -> int:
        """How long it takes."""
        return round(self.duration_s * _NS)


def load_scenario(path: Path) -> Scenario:
    """Read a scenario file. Raises UsageError with file, line or event, field and reason."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        raise UsageError(reason=f"{path}: cannot be read: {reason or error}", file=str(path)) from error
    return read_scenario(text, str(path))


def read_scenario(text: str, file: str) -> Scenario:
    """Read the text of a scenario; ``file`` names it in errors. Raises UsageError as ``load_scenario``."""
    if len(text) > MAX_BYTES:
        raise UsageError(reason=f"{file}: is longer than {MAX_BYTES} characters", file=file)
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line = TomlLines.line_of_error(str(error))
        raise UsageError(reason=f"{file}: line {line}: no valid TOML: {error}", file=file, line=line) from error
    return _scenario(_Table(file, "", table))


class _Table:
    """A table of the file that is read key by key; every complaint names file, place and field."""

    def __init__(self, file: str, where: str, table: Mapping[str, Any]) -> None:
        self._file = file
        self._where = where
        self.raw = table

    def wrong(self, key: str, reason: str) -> NoReturn:
        """Complain about ``key``."""
        where = f"{self._where}: " if self._where else ""
        raise UsageError(reason=f"{self._file}: {where}field '{key}' {reason}", file=self._file, field=key)

    def only(self, *known: str) -> None:
        """Nothing but these keys."""
        for key in self.raw:
            if key not in known:
                self.wrong(key, f"is not known here (known: {', '.join(known)})")

    def number(self, key: str, low: float, high: float, default: float | None = None) -> float:
        """A finite number; wanted where there is no default."""
        value = self.raw.get(key, default)
        if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
            self.wrong(key, "is missing" if key not in self.raw else f"is {value!r}, no number")
        if not low <= value <= high:
            self.wrong(key, f"is {value!r}, not {low:g} to {high:g}")
        return float(value)

    def maybe_number(self, key: str, low: float, high: float) -> float | None:
        """A number that may be missing."""
        return self.number(key, low, high) if key in self.raw else None

    def whole(self, key: str, low: int, high: int, default: int | None = None) -> int:
        """A whole number; wanted where there is no default."""
        value = self.raw.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool):
            self.wrong(key, "is missing" if key not in self.raw else f"is {value!r}, no whole number")
        if not low <= value <= high:
            self.wrong(key, f"is {value!r}, not {low} to {high}")
        return value

    def flag(self, key: str) -> bool:
        """True or false; false where it is missing."""
        value = self.raw.get(key, False)
        if not isinstance(value, bool):
            self.wrong(key, f"is {value!r}, not true or false")
        return value

    def text(self, key: str) -> str:
        """A text that is not empty."""
        value = self.raw.get(key)
        if not isinstance(value, str) or not value.strip():
            self.wrong(key, "is missing" if key not in self.raw else f"is {value!r}, no text")
        return value

    def choice(self, key: str, kind: type[_Choice]) -> _Choice:
        """One of the values of an enum."""
        text = self.text(key)
        for one in kind:
            if one.value == text:
                return one
        self.wrong(key, f"is '{text}', not one of {', '.join(str(one.value) for one in kind)}")

    def blade(self) -> int | None:
        """The blade, where one is named."""
        return self.whole("blade", BLADES[0], BLADES[-1]) if "blade" in self.raw else None

    def address(self) -> Address:
        """The address of an object."""
        try:
            address = parse_address(self.text("address"))
        except UsageError as error:
            self.wrong("address", str(error.details["reason"]))
        if address.addressing is not Addressing.OD:
            self.wrong("address", "is no index and sub-index")
        return address

    def raw_value(self) -> int:
        """A raw value of up to 32 bits."""
        return self.whole("raw", -(1 << 31), (1 << 32) - 1)

    def tables(self, key: str, singular: str) -> Sequence[_Table]:
        """The tables ``[[key]]``, counted from 1 in complaints."""
        found = self.raw.get(key, [])
        if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
            self.wrong(key, f"is not written as [[{key}]]")
        return [_Table(self._file, f"{singular} {number}", one) for number, one in enumerate(found, 1)]

    def table(self, key: str, where: str) -> _Table:
        """The table of ``key``, empty where it is missing."""
        found = self.raw.get(key, {})
        if not isinstance(found, dict):
            self.wrong(key, "is no table")
        return _Table(self._file, where, found)

    def inner(self, key: str) -> _Table:
        """The inline table of ``key``; complaints name ``key`` too."""
        return self.table(key, f"{self._where}: {key}")


def _scenario(table: _Table) -> Scenario:
    table.only("title", "note", "seed", "duration_s", "start", "parameters", "event")
    duration_s = table.number("duration_s", 0.1, MAX_DURATION_S)
    start = _start(table.table("start", "start"))
    events = [_event(one, duration_s, start) for one in table.tables("event", "event")]
    return Scenario(
        title=table.text("title"),
        duration_s=duration_s,
        seed=table.whole("seed", 0, MAX_SEED, 0),
        note=table.text("note") if "note" in table.raw else "",
        start=start,
        presets=tuple(_preset(one) for one in table.tables("parameters", "parameters")),
        events=tuple(sorted(events, key=lambda event: event.at_ns)),
    )


def _start(table: _Table) -> Start:
    table.only("angle_deg", "wind_mps", "operational", "controller")
    return Start(
        angle_deg=table.maybe_number("angle_deg", *_ANGLES),
        wind_mps=table.maybe_number("wind_mps", 0.0, _STRONGEST_MPS),
        operational=table.flag("operational"),
        controller=table.flag("controller"),
    )


def _preset(table: _Table) -> Preset:
    table.only("blade", "device", "address", "raw", "save")
    return Preset(table.choice("device", Unit), table.address(), table.raw_value(), table.blade(), table.flag("save"))


def _event(table: _Table, duration_s: float, start: Start) -> Event:
    at_s = table.number("at_s", 0.0, duration_s)
    kinds = [key for key in ("fault", "clear", "controller", "master") if key in table.raw]
    if len(kinds) != 1:
        table.wrong("fault", "is missing, and so are clear, controller, master" if not kinds else f"and {kinds[1]}")
    if kinds[0] == "controller" and not start.controller:
        table.wrong("controller", "is there, but [start] has no controller = true")
    return Event(round(at_s * _NS), _ACTIONS[kinds[0]](table))


def _fault(table: _Table) -> FaultOrder:
    try:
        return order_from_table({key: value for key, value in table.raw.items() if key != "at_s"})
    except UsageError as error:
        table.wrong(str(error.details["field"]), str(error.details["reason"]).rpartition("': ")[2])


def _clear(table: _Table) -> Clear:
    table.only("at_s", "clear", "blade", "node")
    what = table.raw["clear"]
    if what is not True and what not in CATALOGUE:
        table.wrong("clear", f"is {what!r}, neither true nor a fault")
    node = table.whole("node", 1, MAX_NODE) if "node" in table.raw else None
    return Clear(None if what is True else what, table.blade(), node)


def _control(table: _Table) -> Control:
    table.only("at_s", "controller")
    return Control(table.inner("controller").raw)


def _master(table: _Table) -> MasterOrder:
    table.only("at_s", "master")
    inner = table.inner("master")
    do = inner.choice("do", MasterDo)
    inner.only("do", "node", *_MASTER_KEYS[do])
    node = inner.whole("node", 0 if do is MasterDo.NMT else 1, MAX_NODE)
    if do is MasterDo.NMT:
        name = inner.text("command")
        if name.upper() not in NmtCommand.__members__:
            inner.wrong("command", f"is '{name}', not one of {', '.join(one.name.lower() for one in NmtCommand)}")
        return MasterOrder(do, node, command=NmtCommand[name.upper()])
    address = inner.address() if do in (MasterDo.READ, MasterDo.WRITE) else None
    return MasterOrder(do, node, address, inner.raw_value() if do is MasterDo.WRITE else 0)


_MASTER_KEYS: Final = {
    MasterDo.READ: ("address",),
    MasterDo.WRITE: ("address", "raw"),
    MasterDo.SAVE: (),
    MasterDo.RESTART: (),
    MasterDo.NMT: ("command",),
}
_ACTIONS: Final[Mapping[str, Callable[[_Table], Action]]] = {
    "fault": _fault,
    "clear": _clear,
    "controller": _control,
    "master": _master,
}
