"""What an index keeps as JSON: events, gaps, marks, signals."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from app.model.address import parse_address
from app.recording.content import Event as Noted
from app.recording.content import EventKind as NotedKind
from app.recording.index.content import Gap, GapKind, SignalInfo, SignalKey
from app.recording.index.course import Mark
from app.wire.events import Event, EventKind, Severity
from app.wire.signs import Sign, SignKind


def _text(content: Mapping[str, Any]) -> str:
    return json.dumps(content, separators=(",", ":"), ensure_ascii=False)


def dump_event(event: Event) -> str:
    """An event of the live state."""
    kinds = {"kind": event.kind.value, "severity": event.severity.value, "details": dict(event.details)}
    return _text({**event._asdict(), **kinds})


def load_event(text: str) -> Event:
    """What ``dump_event`` got."""
    body = json.loads(text)
    return Event(**{**body, "kind": EventKind(body["kind"]), "severity": Severity(body["severity"])})


def dump_noted(event: Noted) -> str:
    """An event that the recorder noted."""
    return _text({**event._asdict(), "kind": event.kind.value})


def load_noted(text: str) -> Noted:
    """What ``dump_noted`` got."""
    body = json.loads(text)
    return Noted(**{**body, "kind": NotedKind(body["kind"])})


def dump_gap(gap: Gap) -> str:
    """A gap."""
    return _text({**gap._asdict(), "kind": gap.kind.value})


def load_gap(text: str) -> Gap:
    """What ``dump_gap`` got."""
    body = json.loads(text)
    return Gap(**{**body, "kind": GapKind(body["kind"])})


def dump_mark(mark: Mark) -> str:
    """A mark."""
    return _text(mark._asdict())


def load_mark(text: str) -> Mark:
    """What ``dump_mark`` got."""
    return Mark(**json.loads(text))


def dump_sign(sign: Sign) -> str:
    """A sign."""
    return _text({**sign._asdict(), "kind": sign.kind.value, "severity": sign.severity.value})


def load_sign(text: str) -> Sign:
    """What ``dump_sign`` got."""
    body = json.loads(text)
    return Sign(**{**body, "kind": SignKind(body["kind"]), "severity": Severity(body["severity"])})


_MEASURED: Final = ("count", "first_ns", "last_ns", "low", "high", "changes")


class IndexedObject(NamedTuple):
    """One object of a node: row ``number``; ``info`` None: no value was seen, only told by a keyframe.

    ``dtype`` is that of its numbers, None where it is none; ``kept``: its whole history is in the index.
    """

    number: int
    key: SignalKey
    info: SignalInfo | None
    dtype: str | None
    kept: bool


def dump_object(one: IndexedObject) -> str:
    """An object, without its number."""
    bus, node, address = one.key
    more = {} if one.info is None else {name: getattr(one.info, name) for name in _MEASURED}
    return _text({"bus": bus, "node": node, "address": str(address), "dtype": one.dtype, "kept": one.kept, **more})


def load_object(number: int, text: str) -> IndexedObject:
    """What ``dump_object`` got."""
    body = json.loads(text)
    key = body["bus"], body["node"], parse_address(body["address"])
    info = None if "count" not in body else SignalInfo(*key, *(body[name] for name in _MEASURED))
    return IndexedObject(number, key, info, body["dtype"], body["kept"])
