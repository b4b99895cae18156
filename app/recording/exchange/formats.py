"""The formats that others read and write, and what each can hold of a frame.

``held`` is the one place that knows what a format keeps: the report of losses compares with it before anything is
written, and the round-trip tests compare with it afterwards.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Final, NamedTuple

from app.errors import UsageError
from app.recording.cdr import MAX_DATA, MAX_T_NS, make_can
from app.recording.summary import MAGIC
from app.wire.frame import Adu, Can, Direction, Fdl, Frame

US: Final = 1_000
MAX_STANDARD_ID: Final = 0x7FF
MAX_BIT_RATE: Final = 1_000_000
_PCAPNG_MAGIC: Final = b"\x0a\x0d\x0d\x0a"
ONE_BUS: Final = "can0"
"""What a bus is called where the file does not say."""


class Format(Enum):
    """A file format."""

    CANDUMP = "candump"
    ASC = "asc"
    BLF = "blf"
    TRC = "trc"
    CSV = "csv"
    PCAPNG = "pcapng"
    MCAP = "mcap"


class Style(Enum):
    """How the frames are written where a format leaves a choice.

    ``COMMON``: as the usual tools read it. ``EXACT``: with what they would trip over, so that nothing of a frame is
    lost: nine decimals, directions, raw DLC.
    """

    COMMON = "common"
    EXACT = "exact"


SUFFIXES: Final = {
    Format.CANDUMP: ".log",
    Format.ASC: ".asc",
    Format.BLF: ".blf",
    Format.TRC: ".trc",
    Format.CSV: ".csv",
    Format.PCAPNG: ".pcapng",
    Format.MCAP: ".mcap",
}


IMPORTED: Final = tuple(one for one in Format if one is not Format.PCAPNG)
"""What is read, too. ADUs would have to be put together of segments on a network first: pcapng is written only."""


class Lost(Enum):
    """What a format may fail to keep. The value ends the text key ``exchange.loss.<value>``."""

    FRAME = "frame"
    TIME = "time"
    BUS = "bus"
    DIRECTION = "direction"
    LENGTH = "length"
    ERROR_DETAILS = "error_details"
    KIND = "kind"
    EVENTS = "events"
    CLOCKS = "clocks"
    STATES = "states"
    ATTACHMENTS = "attachments"
    NODES = "nodes"


@dataclass(frozen=True)
class Head:
    """What goes before the frames. ``started_ns``: time of the first frame; ``buses`` in the order of channels."""

    started_ns: int
    buses: tuple[str, ...]
    bit_rates: Mapping[str, int] = field(default_factory=dict)

    def to_json(self) -> str:
        """One line, for a comment of a file."""
        content = {"started_ns": self.started_ns, "buses": list(self.buses), "bit_rates": dict(self.bit_rates)}
        return json.dumps(content, sort_keys=True)

    @classmethod
    def from_json(cls, text: str) -> Head | None:
        """What ``to_json`` wrote, or None where it is something else."""
        try:
            content = json.loads(text)
            started_ns, buses, rates = content["started_ns"], content["buses"], content["bit_rates"]
        except (ValueError, KeyError, TypeError, RecursionError):
            return None
        sound = (
            type(started_ns) is int
            and 0 <= started_ns < MAX_T_NS
            and isinstance(buses, list)
            and all(isinstance(bus, str) and bus for bus in buses)
            and isinstance(rates, dict)
            and all(type(rate) is int and 0 < rate <= MAX_BIT_RATE for rate in rates.values())
        )
        return cls(started_ns, tuple(buses), rates) if sound else None


HEAD_MARK: Final = "hubside "
"""Begins the comment that holds a head."""


class Loss(NamedTuple):
    """``things`` frames (or events, attachments) of which a format cannot hold ``what``."""

    what: Lost
    things: int


def detect(path: Path, name: str | None = None) -> Format:
    """The format of a file, by its first bytes, then by its (former) name. Raises UsageError where neither tells."""
    name = path.name if name is None else name
    try:
        with path.open("rb") as file:
            begin = file.read(4096)
    except OSError as error:
        raise UsageError(reason=f"{path}: {error.strerror or error}") from error
    if begin.startswith(MAGIC):
        return Format.MCAP
    if begin.startswith(_PCAPNG_MAGIC):
        return Format.PCAPNG
    if begin.startswith(b"LOGG"):
        return Format.BLF
    found = _by_text(begin.decode("utf-8", "replace"))
    if found is not None:
        return found
    for known, suffix in SUFFIXES.items():
        if name.lower().endswith(suffix):
            return known
    raise UsageError(reason=f"{name}: no format that is known; name it with --format")


def _by_text(text: str) -> Format | None:
    first = next((line.strip() for line in text.lstrip("\ufeff").splitlines() if line.strip()), "")
    lower = first.lower()
    if first.startswith("("):
        return Format.CANDUMP
    if lower.startswith(("date ", "base hex", "base dec", "// version")):
        return Format.ASC
    if lower.startswith((";$fileversion", ";##", ";---")):
        return Format.TRC
    if lower.startswith(("timestamp,arbitration_id", "t_ns,bus,")):
        return Format.CSV
    return None


def held(frame: Frame, into: Format, style: Style = Style.COMMON) -> Frame | None:
    """What is left of a frame after a way through a file; None where the file cannot hold it at all."""
    can = frame.payload
    if into is Format.MCAP:
        return frame._replace(t_adapter_ns=None)
    if into is Format.PCAPNG:
        return frame._replace(t_adapter_ns=None) if isinstance(can, Adu | Fdl) else None
    if not isinstance(can, Can):
        return None
    exact = style is Style.EXACT
    t_ns = frame.t_ns if exact or into in (Format.BLF, Format.CSV) else frame.t_ns // US * US
    bus, direction = frame.bus, frame.direction
    if into is Format.CANDUMP:
        bus = "_".join(bus.split()) or ONE_BUS
        direction = direction if exact else Direction.RX
    elif into is Format.CSV:
        bus, direction = (" ".join(bus.split()) or ONE_BUS, direction) if exact else (ONE_BUS, Direction.RX)
    elif can.error and into in (Format.ASC, Format.BLF):
        direction = Direction.RX
    return Frame(t_ns, bus, direction, _can_held(can, into, exact))


def _can_held(can: Can, into: Format, exact: bool) -> Can:
    can_id, data, extended, remote, error, _ = can
    dlc = can.length
    if into is Format.CSV:
        return make_can(can_id, data, extended, remote, error, dlc)
    if error:
        return _error_held(can, into)
    if can_id > MAX_STANDARD_ID:
        extended = True
    if into is Format.CANDUMP and not exact:
        dlc = min(dlc, MAX_DATA)
    return make_can(can_id, data.ljust(min(dlc, MAX_DATA), b"\0"), extended, remote, False, dlc)


def _error_held(can: Can, into: Format) -> Can:
    """An error frame: SocketCAN gives it an identifier (what went wrong) and data, other worlds little or nothing."""
    data = can.data.ljust(0 if can.remote else min(can.length, MAX_DATA), b"\0")
    if into is Format.ASC:
        return Can(0, b"", error=True)
    if into is Format.TRC:
        return make_can(0, data, False, False, True, len(data))
    if into is Format.CANDUMP:
        return make_can(can.can_id, data, False, False, True, len(data))
    return make_can(can.can_id, can.data.ljust(MAX_DATA, b"\0"), can.extended, False, True, can.length)


def lost_parts(frame: Frame, left: Frame | None) -> tuple[Lost, ...]:
    """In what ``left`` differs from the frame."""
    if left is None:
        return (Lost.FRAME,)
    lost = []
    if frame.t_ns != left.t_ns:
        lost.append(Lost.TIME)
    if frame.bus != left.bus:
        lost.append(Lost.BUS)
    if frame.direction is not left.direction:
        lost.append(Lost.DIRECTION)
    was, now = frame.payload, left.payload
    if isinstance(was, Can) and isinstance(now, Can):
        lost += _lost_of_can(was, now)
    return tuple(lost)


def _lost_of_can(was: Can, now: Can) -> list[Lost]:
    if was.error and was != now:
        return [Lost.ERROR_DETAILS]
    lost = []
    if was.length != now.length or was.data != now.data:
        lost.append(Lost.LENGTH)
    if (was.extended, was.remote, was.can_id) != (now.extended, now.remote, now.can_id):
        lost.append(Lost.KIND)
    return lost
