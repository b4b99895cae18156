"""Annotations beside a recording: an MCAP file of ``foxglove.Event`` messages, as JSON.

Written whole and put in place at once. What another program has written there is read too: its texts are kept as they
are, and what they say is taken where the keys are usual ones.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from mcap.reader import make_reader
from mcap.writer import Writer

from app.errors import RecordingError
from app.model.incident import MAX_TEXT, Annotation, Note, Span
from app.recording.mcap_file import LIBRARY, sync_directory

SUFFIX: Final = ".annotations.mcap"
TOPIC: Final = "/annotations"
SCHEMA_NAME: Final = "foxglove.Event"
SCHEMA_ENCODING: Final = "jsonschema"
MESSAGE_ENCODING: Final = "json"
MAX_FILE_BYTES: Final = 64 << 20
MAX_EVENTS: Final = 100_000
_NS: Final = 1_000_000_000
_ID: Final = "hubside.id"
_CHANGED: Final = "hubside.changed_ns"
_INCIDENT: Final = "hubside.incident"
_FOREIGN: Final = "hubside.foreign"
_TEXT: Final = "text"
_SEVERITY: Final = "severity"
_COLOUR: Final = "color"
_AUTHOR: Final = "author"
_OURS: Final = (_ID, _CHANGED, _INCIDENT, _FOREIGN, _TEXT, _SEVERITY, _COLOUR, _AUTHOR)
_TEXT_KEYS: Final = (_TEXT, "title", "label", "name", "description", "event", "message")
_SEVERITY_KEYS: Final = (_SEVERITY, "level")
_COLOUR_KEYS: Final = (_COLOUR, "colour")
_AUTHOR_KEYS: Final = (_AUTHOR, "user", "created_by")
_TIME: Final = {
    "type": "object",
    "title": "time",
    "properties": {
        "sec": {"type": "integer", "minimum": 0},
        "nsec": {"type": "integer", "minimum": 0, "maximum": _NS - 1},
    },
}
SCHEMA: Final[Mapping[str, Any]] = {
    "title": SCHEMA_NAME,
    "type": "object",
    "properties": {
        "start_time": _TIME,
        "end_time": _TIME,
        "metadata": {
            "type": "array",
            "items": {
                "title": "foxglove.KeyValuePair",
                "type": "object",
                "properties": {"key": {"type": "string"}, "value": {"type": "string"}},
                "required": ["key", "value"],
            },
        },
    },
    "required": ["start_time", "end_time"],
}
"""Fields of the message, as the well-known schema of that name has them; both ends of the time belong to it."""


def sidecar_of(recording: Path) -> Path:
    """Where the annotations of a recording lie: ``trip.annotations.mcap`` beside ``trip.mcap``."""
    return recording.with_name(recording.name.removesuffix(".mcap") + SUFFIX)


def write_annotations(path: Path, annotations: Iterable[Annotation]) -> str:
    """Write the file anew, by time; SHA-256 of what was written. Raises RecordingError."""
    ordered = sorted(annotations, key=lambda one: (one.span.from_ns, one.id))
    unfinished = path.with_name(path.name + ".part")
    try:
        with unfinished.open("wb") as file:
            writer = Writer(file)
            writer.start(profile="", library=LIBRARY)
            schema = writer.register_schema(SCHEMA_NAME, SCHEMA_ENCODING, json.dumps(SCHEMA).encode())
            channel = writer.register_channel(TOPIC, MESSAGE_ENCODING, schema)
            for number, one in enumerate(ordered):
                at_ns = one.span.from_ns
                writer.add_message(
                    channel, at_ns, json.dumps(_message(one), ensure_ascii=False).encode(), at_ns, number
                )
            writer.finish()  # type: ignore[no-untyped-call]
            file.flush()
            os.fsync(file.fileno())
        digest = hashlib.sha256(unfinished.read_bytes()).hexdigest()
        unfinished.replace(path)
        sync_directory(path.parent)
        return digest
    except OSError as error:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error


def read_annotations(path: Path, recording: str) -> list[Annotation]:
    """The annotations of a file, whoever wrote it. Raises RecordingError where it cannot be read."""
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise RecordingError(file=path.name, offset=0, reason=f"larger than {MAX_FILE_BYTES} bytes")
        with path.open("rb") as file:
            return [_annotation(message, recording) for message in _messages(file, path.name)]
    except (ValueError, TypeError, KeyError) as error:
        raise RecordingError(file=path.name, offset=0, reason=f"no annotation: {error!r}") from error
    except OSError as error:
        raise RecordingError(file=path.name, offset=0, reason=error.strerror or str(error)) from error


def file_hash(path: Path) -> str | None:
    """SHA-256 of a file; None where there is none, or it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None


def _messages(file: Any, name: str) -> Iterator[Mapping[str, Any]]:
    count = 0
    try:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            if schema is None or schema.name != SCHEMA_NAME or channel.message_encoding != MESSAGE_ENCODING:
                continue
            count += 1
            if count > MAX_EVENTS:
                raise RecordingError(file=name, offset=0, reason=f"more than {MAX_EVENTS} events")
            content = json.loads(message.data)
            if not isinstance(content, dict):
                raise ValueError("no object")
            yield content
    except RecordingError:
        raise
    except Exception as error:  # the library raises what its parser happens to meet
        reason = f"{type(error).__name__}: {error}"
        raise RecordingError(file=name, offset=0, reason=reason) from error


# -- one annotation ------------------------------------------------------------------


def _message(one: Annotation) -> dict[str, Any]:
    own = {
        _TEXT: one.text,
        _SEVERITY: one.severity.value,
        _COLOUR: one.colour,
        _AUTHOR: one.person,
        _ID: one.id,
        _CHANGED: str(one.t_ns),
        _INCIDENT: one.incident or "",
        _FOREIGN: "yes" if one.foreign else "",
    }
    pairs = {**one.extra, **{key: text for key, text in own.items() if text}}
    return {
        "start_time": _time(one.span.from_ns),
        "end_time": _time(one.span.to_ns),
        "metadata": [{"key": key, "value": text} for key, text in sorted(pairs.items())],
    }


def _annotation(content: Mapping[str, Any], recording: str) -> Annotation:
    """Raises ValueError, TypeError, KeyError where it is no such message."""
    start_ns, end_ns = _ns(content["start_time"]), _ns(content["end_time"])
    pairs = {str(pair["key"]): str(pair["value"]) for pair in content.get("metadata", [])}
    span = Span(min(start_ns, end_ns), max(start_ns, end_ns))
    changed = pairs.get(_CHANGED, "")
    known = _ID in pairs
    text = next((pairs[key] for key in _TEXT_KEYS if pairs.get(key, "").strip()), "")
    severity = next((pairs[key] for key in _SEVERITY_KEYS if key in pairs), "").casefold()
    colour = next((pairs[key] for key in _COLOUR_KEYS if key in pairs), "").casefold()
    told = ", ".join(f"{key}: {value}" for key, value in pairs.items() if key not in _OURS)
    return Annotation(
        id=pairs[_ID] if known else _foreign_id(recording, span, pairs),
        recording=recording,
        span=span,
        text=_cleaned(text or told)[:MAX_TEXT] or "–",
        severity=Note(severity) if severity in {one.value for one in Note} else Note.INFO,
        colour=colour if _is_colour(colour) else "",
        person=_cleaned(next((pairs[key] for key in _AUTHOR_KEYS if key in pairs), "")),
        t_ns=int(changed) if changed.isascii() and changed.isdecimal() and len(changed) < 20 else 0,
        incident=pairs.get(_INCIDENT),
        foreign=not known or _FOREIGN in pairs,
        extra={key: value for key, value in pairs.items() if not known or key not in _OURS},
    )


def _cleaned(text: str) -> str:
    return "".join(one if one.isprintable() or one in "\n\t" else " " for one in text)


def _is_colour(text: str) -> bool:
    return len(text) == 7 and text[0] == "#" and all(one in "0123456789abcdef" for one in text[1:])


def _foreign_id(recording: str, span: Span, pairs: Mapping[str, str]) -> str:
    """The same each time the same event is read."""
    told = json.dumps([recording, span.from_ns, span.to_ns, sorted(pairs.items())])
    return f"event-{hashlib.sha256(told.encode()).hexdigest()[:32]}"


def _time(t_ns: int) -> dict[str, int]:
    return {"sec": t_ns // _NS, "nsec": t_ns % _NS}


def _ns(found: Mapping[str, Any]) -> int:
    sec, nsec = found["sec"], found["nsec"]
    if not all(isinstance(one, int) for one in (sec, nsec)) or not 0 <= sec < 1 << 33 or not 0 <= nsec < _NS:
        raise ValueError("time out of range")
    return int(sec) * _NS + int(nsec)
