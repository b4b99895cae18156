"""Scenarios for ED2 twins: faults and when they come, from a TOML file.

::

    title = "A sensor's wire breaks"
    seed = 3                    # of what comes by chance; default 0
    duration_s = 60.0           # its end: nothing is said of later

    [[event]]
    at_s = 10.0
    fault = "sensor_wire"       # a kind of faults.KINDS, with axis, slave, value and for_s as it needs
    axis = 1
    for_s = 5.0

Times count from the start of the twins. A key that is not known is an error.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NoReturn

from app.errors import UsageError
from app.twins.ed2.faults import MAX_SECONDS, Order, check_order

_KEYS: Final = ("title", "seed", "duration_s", "event")
_PLACES: Final = ("at_s", "axis", "slave", "value", "for_s")


@dataclass(frozen=True, slots=True)
class Scenario:
    """What happens."""

    title: str
    seed: int
    duration_s: float
    orders: tuple[Order, ...]


def load_scenario(path: Path) -> Scenario:
    """Read a file. Raises UsageError that names the file and what is wrong in it."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(reason=f"{path}: {error}") from error
    return read_scenario(text, str(path))


def read_scenario(text: str, file: str) -> Scenario:
    """Read a text; ``file`` names it. Raises UsageError."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UsageError(reason=f"{file}: {error}") from error
    _known(table, _KEYS, file)
    title, seed = table.get("title"), table.get("seed", 0)
    if not isinstance(title, str) or not title:
        _wrong(file, "title", "is missing")
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        _wrong(file, "seed", "is no whole number")
    duration_s = _number(table.get("duration_s"), file, "duration_s")
    if not 0.0 < duration_s <= MAX_SECONDS:
        _wrong(file, "duration_s", f"is not between 0 and {MAX_SECONDS:g}")
    events = table.get("event", [])
    if not isinstance(events, list):
        _wrong(file, "event", "is no list of tables")
    orders = tuple(_order(event, f"{file}: event {number}", duration_s) for number, event in enumerate(events, 1))
    return Scenario(title, seed, duration_s, orders)


def _order(event: Any, where: str, duration_s: float) -> Order:
    if not isinstance(event, dict):
        _wrong(where, "event", "is no table")
    _known(event, ("fault", *_PLACES), where)
    kind = event.get("fault")
    if not isinstance(kind, str):
        _wrong(where, "fault", "is missing")
    given = {name: _number(event[name], where, name) for name in _PLACES if name in event}
    try:
        order = check_order(kind, given)
    except UsageError as error:
        raise UsageError(reason=f"{where}: {error.details['reason']}", field=str(error.details["field"])) from error
    if order.at_s > duration_s:
        _wrong(where, "at_s", "is later than the end")
    return order


def _known(table: Mapping[str, Any], keys: tuple[str, ...], where: str) -> None:
    for key in table:
        if key not in keys:
            _wrong(where, key, "is not known here")


def _number(value: Any, where: str, name: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        _wrong(where, name, "is missing or no number")
    return float(value)


def _wrong(where: str, name: str, reason: str) -> NoReturn:
    raise UsageError(reason=f"{where}: '{name}' {reason}", field=name)
