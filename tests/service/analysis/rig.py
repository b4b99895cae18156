"""What the tests of analysis share: the scenarios, indexed once, and what their scripts say was done when and where."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from app.model.address import parse_address
from app.model.description_file import load_builtin
from app.service.analysis.look import Look
from app.service.analysis.places import Place
from app.service.analysis.trips import Trip
from app.wire.events import Severity
from app.wire.signs import Sign, SignKind
from tests.recording.index_rig import FOLDER, indexed

BUS = "can0"
MS, S = 1_000_000, 1_000_000_000
PLACES = {
    (BUS, node): Place(f"wtg-07/blade-{node % 10}/{device}", f"oat-{device}")
    for device, first in (("pmm", 1), ("pmc", 11))
    for node in range(first, first + 3)
}


def scenario(number: int) -> Path:
    """A scenario of the repository."""
    return next(FOLDER.glob(f"{number}-*.mcap"))


@cache
def look(number: int) -> Look:
    """A scenario with its index."""
    return Look(indexed(scenario(number)).recording)


def script(number: int, **wanted: Any) -> dict[str, Any]:
    """The last event of the scenario's script that has these fields, those of the master's order among them."""
    told = tomllib.loads(scenario(number).with_suffix(".toml").read_text(encoding="utf-8"))
    flat = ({**one, **one.get("master", {}), **one.get("controller", {})} for one in told["event"])
    found: dict[str, Any] = [one for one in flat if wanted.items() <= one.items()][-1]
    return found


def at_s(number: int, t_ns: int) -> float:
    """Seconds from the beginning of the scenario, as its script counts."""
    return (t_ns - look(number).span_ns[0]) / S


def the_trip(number: int) -> Trip:
    """The one trip of a scenario."""
    (trip,) = look(number).trips
    return trip


def sign(t_ms: float, node: int, kind: SignKind, **details: Any) -> Sign:
    """A sign as the finder would tell it."""
    severity = details.pop("severity", Severity.ERROR)
    text_key = kind.ended_key if details.get("ends") else kind.text_key
    return Sign(round(t_ms * MS), BUS, node, kind, text_key, details, severity)


def emcy(t_ms: float, node: int, code: int) -> Sign:
    """An emergency message."""
    kind = load_builtin(PLACES[BUS, node].description_id)
    known = kind.errors[code]
    details = {"code": code, "code_hex": f"{code:04X}h", "reason_key": known.text_key, "subject": f"{code:04X}"}
    return sign(t_ms, node, SignKind.EMCY, **details)


ADDRESS = parse_address
