"""Looks in an anonymised copy for what was to be taken away: in what it tells, not in the words of the format itself.

Keys of JSON, names of tables and fixed topics, text keys and kinds of events are ours: nobody is known by them.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final, NamedTuple

from app.model.description_file import BUILTIN
from app.recording.content import METADATA_BIT_RATES, METADATA_NODES
from app.recording.exchange.hiding import STATIONS
from app.recording.reader import Recording
from app.recording.schemas import CAN_FRAME, FIXED_TOPICS, TELEGRAM

LEAST_TEXT: Final = 4
"""Shorter words are found everywhere by accident."""
_OURS: Final = re.compile(
    rf"({STATIONS.pattern})|turbine|person|anonymised|place-[0-9]+|v?s?can[0-9]+|descriptions|"
    + "|".join(map(re.escape, BUILTIN))
)
_NAMED_KEYS: Final = frozenset({METADATA_BIT_RATES, METADATA_NODES})
_OUR_VALUES: Final = frozenset({"kind", "severity", "client", "reason", "text_key", "person"})
_HEX: Final = re.compile(r"([0-9A-Fa-f]{2})+")


class Where(Enum):
    """Where something was found: the value names it to a person, and says what to do."""

    BUS = "the name of a bus: rename the bus in a merge of the recording"
    TABLE = "a table of the file: give the recording or its nodes another name"
    ATTACHMENT = "the name of an attachment: leave the attachment out"
    EVENT = "an event: leave the event out by a cut"
    STATE = "the state of a node: name the object that tells it as one to hide"
    FRAME = "a frame: name the object that it carries as one to hide"


class Found(NamedTuple):
    """A word that is still there."""

    text: str
    where: Where


@dataclass(frozen=True)
class Wanted:
    """What must not be left.

    ``names`` are those of the recording, ``words`` those that a person gave: both are looked for as whole words, but
    names only where they are no words of ours. ``texts`` were hidden in frames, and may stand in frames and states.
    """

    names: Collection[str]
    words: Collection[str] = ()
    texts: Collection[bytes] = ()

    def pattern(self, where: Where) -> re.Pattern[bytes] | None:
        """What to look for there; None: nothing."""
        words = {name for name in self.names if not _OURS.fullmatch(name)} | set(self.words)
        wanted = [_whole_word(word) for word in words if len(word) >= LEAST_TEXT]
        if where in (Where.FRAME, Where.STATE):
            wanted += [re.escape(text) for text in self.texts]
        return re.compile(b"|".join(wanted)) if wanted else None


def find_left(copy: Recording, wanted: Wanted, on_piece: Callable[[], None]) -> Found | None:
    """The first that is found; ``on_piece`` is called again and again, and may raise."""
    patterns = {where: wanted.pattern(where) for where in Where}
    for where, piece in told(copy):
        on_piece()
        pattern = patterns[where]
        match = None if pattern is None else pattern.search(piece)
        if match is not None:
            return Found(match[0].decode(errors="replace"), where)
    return None


def told(copy: Recording) -> Iterator[tuple[Where, bytes]]:
    """What a file tells beyond the words of its format."""
    for channel in copy.channels.values():
        if channel.topic not in FIXED_TOPICS:
            yield Where.BUS, repr((channel.topic, list(channel.metadata.values()))).encode()
    for record in copy.metadata_records:
        keys = list(record.metadata) if record.name in _NAMED_KEYS else []
        for text in (*keys, *record.metadata.values()):
            if not text.isdecimal():
                yield Where.TABLE, text.encode()
    for attached in copy.attachments():
        yield Where.ATTACHMENT, attached.name.encode()
    for reading in copy.clocks():
        yield Where.BUS, reading.bus.encode()
    for event in copy.events():
        yield Where.BUS, event.bus.encode()
        yield from ((Where.EVENT, piece) for piece in _texts(event.details))
    for keyframe in copy.keyframes():
        yield from ((Where.STATE, piece) for piece in _texts(keyframe.state))
    for body, _ in copy.bodies():
        if copy.schemas[copy.channels[body.channel_id].schema_id].name in (CAN_FRAME.name, TELEGRAM.name):
            yield Where.FRAME, body.data


def _texts(value: Any, key: str = "") -> Iterator[bytes]:
    """The texts of plain JSON, and the bytes that stand in it as hexadecimal digits."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _texts(inner, name)
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner, key)
    elif isinstance(value, str) and key not in _OUR_VALUES and not key.endswith("_key"):
        yield value.encode()
        if _HEX.fullmatch(value):
            yield bytes.fromhex(value)


def _whole_word(word: str) -> bytes:
    """Not as a part of a longer word."""
    return rb"(?<![0-9A-Za-z_-])" + re.escape(word.encode()) + rb"(?![0-9A-Za-z_-])"
