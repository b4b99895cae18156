"""The file of annotations: read by the mcap library, valid by its own schema, and files of other programs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from app.errors import RecordingError
from app.model.incident import Annotation, Note, Span
from app.recording.annotations import (
    SCHEMA_NAME,
    file_hash,
    read_annotations,
    sidecar_of,
    write_annotations,
)

S = 1_000_000_000
FIRST = Annotation("a1", "trip.mcap", Span(1 * S, 2 * S + 5), "Überdrehzahl", Note.ERROR, "#ff0000", "Anna", 77, "i1")
POINT = Annotation("a2", "trip.mcap", Span(4 * S + 1, 4 * S + 1), "a\nb", Note.INFO, "", "Ben", 78)


def messages(path: Path) -> list[tuple[Any, Any, Any]]:
    with path.open("rb") as file:
        return list(make_reader(file).iter_messages())


def foreign(path: Path, *events: dict[str, Any], schema: str = SCHEMA_NAME) -> None:
    """As another program writes them."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        number = writer.register_schema(schema, "jsonschema", b"{}")
        channel = writer.register_channel("/events", "json", number)
        for event in events:
            writer.add_message(channel, 1, json.dumps(event).encode(), 1)
        writer.finish()  # type: ignore[no-untyped-call]


def event(start: int, end: int, **metadata: str) -> dict[str, Any]:
    times = {"start_time": {"sec": start, "nsec": 0}, "end_time": {"sec": end, "nsec": 500}}
    return {**times, "metadata": [{"key": key, "value": value} for key, value in metadata.items()]}


def test_annotations_come_back_and_lie_beside_their_recording(tmp_path: Path) -> None:
    path = sidecar_of(tmp_path / "trip.mcap")
    assert path.name == "trip.annotations.mcap"
    digest = write_annotations(path, [POINT, FIRST])
    assert read_annotations(path, "trip.mcap") == [FIRST, POINT]
    assert digest == file_hash(path)
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def test_every_message_is_a_valid_event_at_its_own_time(tmp_path: Path) -> None:
    path = tmp_path / "trip.annotations.mcap"
    write_annotations(path, [FIRST, POINT])
    found = messages(path)
    assert [message.log_time for _, _, message in found] == [1 * S, 4 * S + 1]
    for schema, channel, message in found:
        assert (schema.name, schema.encoding, channel.message_encoding) == ("foxglove.Event", "jsonschema", "json")
        validator = jsonschema_rs.Draft7Validator(json.loads(schema.data))
        validator.validate(json.loads(message.data))
        with pytest.raises(jsonschema_rs.ValidationError):
            validator.validate({"start_time": {"sec": 1, "nsec": -1}, "end_time": {"sec": 1, "nsec": 0}})
    told = json.loads(found[0][2].data)
    assert told["end_time"] == {"sec": 2, "nsec": 5}
    assert {"key": "text", "value": "Überdrehzahl"} in told["metadata"]


def test_events_of_others_are_read_with_all_that_they_say(tmp_path: Path) -> None:
    path = tmp_path / "trip.annotations.mcap"
    foreign(
        path,
        event(5, 6, title="Pitch stuck", level="warning", color="#00FF00", ticket="4711"),
        event(9, 8, weather="storm"),
    )
    first, second = read_annotations(path, "trip.mcap")
    assert (first.text, first.severity, first.colour, first.foreign) == ("Pitch stuck", Note.WARNING, "#00ff00", True)
    assert first.extra == {"title": "Pitch stuck", "level": "warning", "color": "#00FF00", "ticket": "4711"}
    assert (second.text, second.span) == ("weather: storm", Span(8 * S + 500, 9 * S))
    assert [one.id for one in read_annotations(path, "trip.mcap")] == [first.id, second.id]
    write_annotations(path, [first, replace(second, text="seen", t_ns=9)])
    again = read_annotations(path, "trip.mcap")
    assert [(one.id, one.text, one.foreign) for one in again] == [
        (first.id, "Pitch stuck", True),
        (second.id, "seen", True),
    ]
    assert again[0].extra["ticket"] == "4711"


def test_other_messages_are_passed_over_and_damage_is_an_error_with_its_file(tmp_path: Path) -> None:
    path = tmp_path / "trip.annotations.mcap"
    foreign(path, event(1, 2), schema="foxglove.Log")
    assert read_annotations(path, "trip.mcap") == []
    foreign(path, {"start_time": {"sec": 1, "nsec": 0}})
    with pytest.raises(RecordingError):
        read_annotations(path, "trip.mcap")
    write_annotations(path, [FIRST])
    whole = path.read_bytes()
    at = whole.index(b"zstd") + 40
    other_sum = whole[: at - 45] + bytes((whole[at - 45] ^ 0xFF,)) + whole[at - 44 :]
    flipped = whole[:at] + bytes((whole[at] ^ 0xFF,)) + whole[at + 1 :]
    for spoilt in (b"", whole[: len(whole) // 2], b"MCAP0" + whole[5:], flipped, other_sum):
        path.write_bytes(spoilt)
        with pytest.raises(RecordingError) as caught:
            read_annotations(path, "trip.mcap")
        assert caught.value.details["file"] == path.name
