"""What goes into a recording beside frames: who recorded what, attachments, events and state keyframes."""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Final, NamedTuple

SCHEMA_NUMBER: Final = 1

METADATA_RECORDING: Final = "recording"
METADATA_BIT_RATES: Final = "bit_rates"
METADATA_NODES: Final = "nodes"
METADATA_SERVERS: Final = "servers"
METADATA_PROTOCOLS: Final = "protocols"
METADATA_ORDERS: Final = "orders"
METADATA_VERSIONS: Final = "versions"
METADATA_TOTALS: Final = "totals"
METADATA_RECOVERY: Final = "recovery"
METADATA_ORIGIN: Final = "origin"
METADATA_CHUNK_CHANNELS: Final = "chunk_channels"


class EventKind(Enum):
    """What happened beside the frames. The details of each are listed in ``docs/recording-format.md``."""

    FRAMES_LOST = "frames_lost"
    GAP = "gap"
    BUS_LOST = "bus_lost"
    BUS_BACK = "bus_back"
    WALL_CLOCK_STEP = "wall_clock_step"
    WRITE = "write"
    SPACE_LOW = "space_low"
    DISK_ERROR = "disk_error"
    RESUMED = "resumed"
    NOTE = "note"


class Event(NamedTuple):
    """An event at ``t_ns``; ``bus`` is empty where it concerns none. ``details`` is plain JSON."""

    t_ns: int
    kind: EventKind
    bus: str
    details: Mapping[str, Any]


class Keyframe(NamedTuple):
    """The whole state at ``t_ns``, as plain JSON: it holds what all frames up to then have told."""

    t_ns: int
    state: Mapping[str, Any]


class AttachedFile(NamedTuple):
    """A file inside the recording: a description, a parameter set."""

    name: str
    media_type: str
    data: bytes


GZIP_FROM: Final = 1024  # bytes; below, packing gains nothing
MAX_ATTACHMENT_BYTES: Final = 64 << 20  # an attachment that unpacks to more is taken as damaged
_GZIP_WINDOW: Final = 31  # zlib's number for a gzip frame
_GZIP_TYPE: Final = "application/gzip; content="
_GZIP_SUFFIX: Final = ".gz"


def to_stored(attached: AttachedFile) -> AttachedFile:
    """The form in the file: gzip where it is not tiny, for every part bears all attachments."""
    name, media_type, data = attached
    if len(data) < GZIP_FROM:
        return attached
    return AttachedFile(name + _GZIP_SUFFIX, _GZIP_TYPE + media_type, gzip.compress(data, mtime=0))


def from_stored(stored: AttachedFile) -> AttachedFile:
    """What ``to_stored`` got. Raises ``ValueError`` where the packed bytes make no sense."""
    name, media_type, data = stored
    if not media_type.startswith(_GZIP_TYPE):
        return stored
    unpacker = zlib.decompressobj(_GZIP_WINDOW)
    try:
        plain = unpacker.decompress(data, MAX_ATTACHMENT_BYTES)
    except zlib.error as error:
        raise ValueError(f"attachment {name}: {error}") from error
    if not unpacker.eof:
        reason = "larger than any of ours" if len(plain) == MAX_ATTACHMENT_BYTES else "its end is missing"
        raise ValueError(f"attachment {name}: {reason}")
    return AttachedFile(name.removesuffix(_GZIP_SUFFIX), media_type.removeprefix(_GZIP_TYPE), plain)


@dataclass(frozen=True)
class RecordingInfo:
    """What a recording is of. ``bit_rates`` in bit/s by bus; ``nodes`` maps ``can0/11`` to slug and description.

    ``servers`` maps a node of a Modbus TCP bus to its ``host:port``. ``protocols`` names what is spoken on buses where
    neither their messages nor ``servers`` tell it (``profibus-dp``); ``orders`` maps a node on PROFIBUS to the order of
    its process data as the site says it (``low-high``).
    """

    turbine: str
    who: str
    bit_rates: Mapping[str, int] = field(default_factory=dict)
    nodes: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    servers: Mapping[str, str] = field(default_factory=dict)
    protocols: Mapping[str, str] = field(default_factory=dict)
    orders: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class RecorderClock:
    """The clocks of a recorder, all in ns. ``stamp`` is the Stamper that also stamps the frames."""

    monotonic_ns: Callable[[], int]
    wall_ns: Callable[[], int]
    stamp: Callable[[], int]


def to_json(content: Mapping[str, Any]) -> str:
    """Canonical JSON. Raises ``TypeError`` or ``ValueError`` where the content is not plain JSON."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
