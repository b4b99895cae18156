"""Vector's ASC: ``   1.234567 1  181             Rx   d 8 01 02 03 04 05 06 07 08`` below a head with a date.

Times count from the start of the measurement; the date has milliseconds and is local time, without a zone. A comment
in the head of our files keeps the exact start and the names of the buses, of which the lines have only channel numbers.

What python-can's reader and writer do otherwise: the writer gives milliseconds without leading zeros (``.5`` for
5 ms, which its reader takes as 500), the reader turns a DLC of 9 and more into a length of CAN FD, takes every later
trigger block as a new start and passes over what it does not know without a word.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from datetime import datetime
from typing import Final

from app.recording.cdr import MAX_DATA, MAX_DLC, MAX_ID, NS, make_can
from app.recording.exchange.formats import HEAD_MARK, Head, Style
from app.recording.exchange.lines import BadLineError, Notes, Other, checked_id, decimal_ns, hex_bytes, number_of
from app.wire.frame import Can, Direction, Frame

MS: Final = 1_000_000
_MONTHS: Final = "Jan Feb Mar Apr May Jun Jul Aug Sep Oct Nov Dec".split()
_DAYS: Final = "Mon Tue Wed Thu Fri Sat Sun".split()
_GERMAN: Final = {"Mär": "Mar", "Mai": "May", "Okt": "Oct", "Dez": "Dec"}
_DATE: Final = re.compile(
    r"(?:\w+\s+)?(\w+)\s+(\d{1,2})\s+(\d{1,2}):(\d{2}):(\d{2})(?:\.(\d{1,6}))?\s*([ap]m)?\s+(\d{4})$", re.IGNORECASE
)
_TIMED: Final = re.compile(r"(\d+\.\d+)\s+(.*)$", re.ASCII)
_PASSED_OVER: Final = re.compile(
    r"//|;|(?:no\s+)?internal\s+events|end\s+trigger|begin\s+trigger|date\s|base\s", re.IGNORECASE
)
_BEGUN: Final = "start of measurement"
_DIRECTIONS: Final = {"rx": Direction.RX, "tx": Direction.TX}


class AscParser:
    """Reads the lines of an ASC file, its head included."""

    expects = "exchange.expects.asc"

    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        notes.wall_known = False
        self._base = 16
        self._relative = False
        self._date_ns: int | None = None
        self._trigger_ns: int | None = None
        self._start_ns: int | None = None
        self._last_ns = 0

    def parse(self, line: str) -> Frame | None:
        """The frame of a line, if it is one. Raises BadLineError."""
        match = _TIMED.match(line)
        if match is None:
            self._head_line(line)
            return None
        at_ns = decimal_ns(match[1])
        if self._relative:
            at_ns += self._last_ns
        self._last_ns = at_ns
        rest = match[2]
        if self._start_ns is None:
            self._begin(rest)
        if rest.lower().startswith(_BEGUN):
            return None
        return self._event(at_ns + (self._start_ns or 0), rest.split())

    def _begin(self, first_event: str) -> None:
        """The head is over. Only a block at the start of the measurement tells when that was."""
        at_start = first_event.lower().startswith(_BEGUN) or self._date_ns is None
        start_ns = self._trigger_ns if at_start and self._trigger_ns is not None else self._date_ns
        if self._notes.head is not None:
            start_ns = self._notes.head.started_ns
        self._notes.wall_known = start_ns is not None
        self._start_ns = start_ns or 0

    def _head_line(self, line: str) -> None:
        words = line.split()
        lower = [word.lower() for word in words]
        if line.startswith(f"// {HEAD_MARK}"):
            self._notes.head = Head.from_json(line[len(HEAD_MARK) + 3 :])
        elif not words:  # blank, be it with blanks that only Unicode knows
            return
        elif lower[0] == "date":
            self._date_ns = _date_ns(" ".join(words[1:]))
        elif lower[0] == "base":
            if lower[1:2] not in (["hex"], ["dec"]):
                raise BadLineError("the base is neither hex nor dec")
            self._base = 16 if lower[1] == "hex" else 10
            self._relative = "relative" in lower
        elif lower[:2] == ["begin", "triggerblock"]:
            if self._trigger_ns is None and len(words) > 2:
                self._trigger_ns = _date_ns(" ".join(words[2:]))
        elif not _PASSED_OVER.match(line):
            raise BadLineError("no line of an ASC file")

    def _event(self, t_ns: int, words: list[str]) -> Frame | None:
        if words and words[0].upper() == "CANFD":
            self._notes.other[Other.CAN_FD] += 1
            return None
        if len(words) < 2 or not words[0].isdecimal():
            self._notes.other[Other.STATUS] += 1
            return None
        bus = self._bus(number_of(words[0], 10, 255, "channel"))
        if words[1].lower() == "errorframe":
            return Frame(t_ns, bus, Direction.RX, Can(0, b"", error=True))
        if len(words) > 2 and words[2].lower() == "txrq":
            self._notes.other[Other.REQUEST] += 1
            return None
        if len(words) < 4 or words[2].lower() not in _DIRECTIONS:
            self._notes.other[Other.STATUS] += 1
            return None
        return Frame(t_ns, bus, _DIRECTIONS[words[2].lower()], self._can(words[1], words[3:]))

    def _bus(self, channel: int) -> str:
        head = self._notes.head
        if head is not None and 1 <= channel <= len(head.buses):
            return head.buses[channel - 1]
        return f"can{channel - 1 if channel else 0}"

    def _can(self, identifier: str, words: list[str]) -> Can:
        extended = identifier[-1] in "xX"
        can_id = number_of(identifier.rstrip("xX"), self._base, MAX_ID, "identifier")
        checked_id(can_id, extended)
        kind = words[0].lower()
        if kind == "r":
            known = len(words) > 1 and len(words[1]) == 1
            dlc = number_of(words[1], 16, MAX_DLC, "length") if known else 0
            return make_can(can_id, b"", extended, True, False, dlc)
        if kind != "d" or len(words) < 2:
            raise BadLineError("neither a data nor a remote frame")
        dlc = number_of(words[1], 16, MAX_DLC, "length")
        octets = words[2 : 2 + min(dlc, MAX_DATA)]
        if len(octets) < min(dlc, MAX_DATA):
            raise BadLineError("fewer bytes of data than the length says")
        if self._base == 10:
            data = bytes(number_of(word, 10, 255, "byte") for word in octets)
        else:
            data = hex_bytes("".join(word.rjust(2, "0") for word in octets))
        return make_can(can_id, data, extended, False, False, dlc)


def _date_ns(text: str) -> int:
    """A date of an ASC file (local time) in ns since 1970."""
    match = _DATE.match(text)
    if match is None:
        raise BadLineError("the date is none")
    name, day, hour, minute, second, fraction, half, year = match.groups()
    month = _GERMAN.get(name.capitalize(), name.capitalize()[:3])
    hours = int(hour) % 12 + 12 * (half.lower() == "pm") if half else int(hour)
    try:
        whole = datetime(int(year), _MONTHS.index(month) + 1, int(day), hours, int(minute), int(second))
        seconds = int(whole.astimezone().timestamp())
    except (ValueError, OverflowError, OSError):
        raise BadLineError("the date is none") from None
    # python-can writes milliseconds without leading zeros; whoever writes three digits or more means decimals
    rest_ns = 0 if not fraction else int(fraction) * MS if len(fraction) < 3 else int(fraction.ljust(9, "0"))
    return seconds * NS + rest_ns


def asc_lines(head: Head, frames: Iterable[Frame], style: Style) -> Iterator[str]:
    """The lines of frames that are ``held``, each with its end, with head and foot."""
    decimals = 9 if style is Style.EXACT else 6
    date = _date_text(head.started_ns)
    yield f"date {date}\n"
    yield "base hex  timestamps absolute\n"
    yield "no internal events logged\n"
    yield f"// {HEAD_MARK}{_started_at_step(head, decimals).to_json()}\n"
    yield f"Begin Triggerblock {date}\n"
    yield f"{'0.' + '0' * decimals:>12} Start of measurement\n"
    channels = {bus: number for number, bus in enumerate(head.buses, 1)}
    step = 10 ** (9 - decimals)
    started_ns = head.started_ns // step * step
    for t_ns, bus, direction, can, _ in frames:
        if isinstance(can, Can):
            seconds, rest = divmod(t_ns - started_ns, NS)
            time = f"{seconds}.{rest // step:0{decimals}d}"
            yield f"{time:>12} {_content(channels[bus], direction, can)}\n"
    yield "End TriggerBlock\n"


def _started_at_step(head: Head, decimals: int) -> Head:
    step = 10 ** (9 - decimals)
    return Head(head.started_ns // step * step, head.buses, head.bit_rates)


def _content(channel: int, direction: Direction, can: Can) -> str:
    if can.error:
        return f"{channel}  ErrorFrame"
    identifier = f"{can.can_id:X}{'x' if can.extended else ''}"
    way = "Rx" if direction is Direction.RX else "Tx"
    kind = f"r {can.length:x}" if can.remote else f"d {can.length:x} {can.data.hex(' ').upper()}"
    return f"{channel}  {identifier:<15} {way:<4} {kind}".rstrip()


def _date_text(t_ns: int) -> str:
    """Local time, in English whatever the language of the system is."""
    at = datetime.fromtimestamp(t_ns // NS).astimezone()
    ms = t_ns % NS // MS
    return f"{_DAYS[at.weekday()]} {_MONTHS[at.month - 1]} {at.day:02d} {at:%H:%M:%S}.{ms:03d} {at.year}"
