"""PEAK's TRC: written as version 2.1, read as 1.0, 1.1, 1.3, 2.0 and 2.1.

Times are milliseconds since the start, with three decimals in the common style; the start is a number of days, in UTC
as python-can has it. Comments of our files keep the exact start and the names of the buses.

What python-can does otherwise: its writer leaves remote and error frames out and only logs that, its reader gives up at
a line that has no number where one belongs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from decimal import Decimal, InvalidOperation
from typing import Final

from app.recording.cdr import MAX_DATA, MAX_DLC, MAX_ID, NS, make_can
from app.recording.exchange.formats import HEAD_MARK, Head, Style
from app.recording.exchange.lines import BadLineError, Notes, Other, checked_id, decimal_ns, hex_bytes, number_of
from app.wire.frame import Can, Direction, Frame

MS: Final = 1_000_000
_DAY_NS: Final = 86_400 * NS
_EPOCH_DAYS: Final = 25_569  # from 30 December 1899 to 1 January 1970
_MAX_DAYS: Final = 100_000
_VERSIONS: Final = ("1.0", "1.1", "1.3", "2.0", "2.1")
_COLUMNS: Final = {  # N number, O time, T type, B bus, I identifier, d direction, R reserved, L DLC, l length, D data
    "1.0": "N,O,I,L,D",
    "1.1": "N,O,d,I,L,D",
    "1.3": "N,O,B,d,I,R,L,D",
    "2.0": "N,O,T,I,d,l,D",
    "2.1": "N,O,T,B,I,d,R,L,D",
}
_DIRECTIONS: Final = {"rx": Direction.RX, "tx": Direction.TX}
_FD: Final = frozenset({"FD", "FB", "FE", "BI"})
_FRAMES: Final = frozenset({"DT", "RR", "ER"})


class TrcParser:
    """Reads the lines of a TRC file, its head included."""

    expects = "exchange.expects.trc"

    def __init__(self, notes: Notes) -> None:
        self._notes = notes
        notes.wall_known = False
        self._start_ns = 0
        self._use("1.0", _COLUMNS["1.0"])

    def _use(self, version: str, columns: str) -> None:
        self._version = version
        names = [name.strip() for name in columns.split(",")]
        if not {"O", "I", "D"} <= set(names) or not {"L", "l"} & set(names) or names[-1] != "D":
            raise BadLineError("columns without time, identifier, length or data")
        self._places = {name: place for place, name in enumerate(names)}
        self._size = len(names)

    def parse(self, line: str) -> Frame | None:
        """The frame of a line, if it is one. Raises BadLineError."""
        if line.startswith(";"):
            self._head_line(line[1:].strip())
            return None
        words = line.split(maxsplit=self._size - 1)
        if len(words) < self._size - 1:
            raise BadLineError("too few columns")
        words += [""] * (self._size - len(words))
        kind = self._kind(words)
        return None if kind is None else self._frame(words, kind)

    def _head_line(self, text: str) -> None:
        key, _, value = text.partition("=")
        if key == "$FILEVERSION":
            if value.strip() not in _VERSIONS:
                raise BadLineError(f"version {value[:20]} (read are {', '.join(_VERSIONS)})")
            self._use(value.strip(), _COLUMNS[value.strip()])
        elif key == "$STARTTIME" and self._notes.head is None:
            self._start_ns = _start_ns(value.strip())
            self._notes.wall_known = True
        elif key == "$COLUMNS":
            self._use(self._version, value)
        elif text.startswith(HEAD_MARK):
            head = self._notes.head = Head.from_json(text[len(HEAD_MARK) :])
            if head is not None:
                self._start_ns, self._notes.wall_known = head.started_ns, True

    def _kind(self, words: list[str]) -> str | None:
        """``DT``, ``RR`` or ``ER``; None for a line that is no frame of classic CAN."""
        if "T" in self._places:
            kind = words[self._places["T"]].upper()
            if kind in _FRAMES:
                return kind
            self._notes.other[Other.CAN_FD if kind in _FD else Other.STATUS] += 1
            return None
        direction = words[self._places["d"]].lower() if "d" in self._places else "rx"
        if direction not in _DIRECTIONS or words[self._places["I"]].upper() == "FFFFFFFF":
            self._notes.other[Other.STATUS] += 1
            return None
        return "RR" if words[self._places["D"]].upper().startswith("RTR") else "DT"

    def _frame(self, words: list[str], kind: str) -> Frame:
        place = self._places
        t_ns = self._start_ns + decimal_ns(words[place["O"]], MS)
        channel = number_of(words[place["B"]], 10, 255, "bus") if "B" in place else 1
        direction = _DIRECTIONS.get(words[place["d"]].lower()) if "d" in place else Direction.RX
        if direction is None:
            raise BadLineError("neither Rx nor Tx")
        dlc = number_of(words[place["L" if "L" in place else "l"]], 10, MAX_DLC, "length")
        data = b"" if kind == "RR" else self._data(words[place["D"]], dlc)
        if kind == "ER":
            return Frame(t_ns, self._bus(channel), direction, make_can(0, data, False, False, True, len(data)))
        identifier = words[place["I"]]
        extended = len(identifier) > 4
        can_id = checked_id(number_of(identifier, 16, MAX_ID, "identifier"), extended)
        return Frame(t_ns, self._bus(channel), direction, make_can(can_id, data, extended, kind == "RR", False, dlc))

    def _bus(self, channel: int) -> str:
        head = self._notes.head
        if head is not None and 1 <= channel <= len(head.buses):
            return head.buses[channel - 1]
        return f"can{channel - 1 if channel else 0}"

    @staticmethod
    def _data(text: str, dlc: int) -> bytes:
        data = hex_bytes(text)
        if len(data) != min(dlc, MAX_DATA):
            raise BadLineError("another number of bytes than the length says")
        return data


def _start_ns(text: str) -> int:
    """Days since 30 December 1899 as ns since 1970."""
    try:
        days = Decimal(text.replace(",", "."))
    except InvalidOperation:
        raise BadLineError(f"{text[:30]!r} is no start time") from None
    if not days.is_finite() or not _EPOCH_DAYS <= days < _MAX_DAYS:
        raise BadLineError(f"{text[:30]!r} is no start time")
    return int((days - _EPOCH_DAYS) * _DAY_NS)


def trc_lines(head: Head, frames: Iterable[Frame], style: Style) -> Iterator[str]:
    """The lines of frames that are ``held``, each with its end, with a head."""
    step = 1 if style is Style.EXACT else 1_000
    started_ns = head.started_ns // step * step
    yield from _head_lines(Head(started_ns, head.buses, head.bit_rates))
    channels = {bus: number for number, bus in enumerate(head.buses, 1)}
    number = 0
    for t_ns, bus, direction, can, _ in frames:
        if isinstance(can, Can):
            number += 1
            ms, rest = divmod(t_ns - started_ns, MS)
            time = f"{ms}.{rest // step:0{6 if step == 1 else 3}d}"
            yield f"{number:>7} {time:>13} {_content(channels[bus], direction, can)}\r\n"


def _head_lines(head: Head) -> Iterator[str]:
    days = Decimal(head.started_ns) / _DAY_NS + _EPOCH_DAYS
    yield ";$FILEVERSION=2.1\r\n"
    yield f";$STARTTIME={days:.15f}\r\n"
    yield f";$COLUMNS={_COLUMNS['2.1']}\r\n"
    yield ";\r\n"
    yield f"; {HEAD_MARK}{head.to_json()}\r\n"
    yield ";-------------------------------------------------------------------------------\r\n"
    for channel, bus in enumerate(head.buses, 1):
        name = "".join(c if c.isprintable() else "?" for c in bus)
        yield f";   Bus {channel}: {name}\r\n"
    yield ";   Number, time offset [ms], type, bus, ID [hex], Rx/Tx, reserved, DLC, data [hex]\r\n"
    yield ";-------------------------------------------------------------------------------\r\n"


def _content(channel: int, direction: Direction, can: Can) -> str:
    way = "Rx" if direction is Direction.RX else "Tx"
    kind = "ER" if can.error else "RR" if can.remote else "DT"
    identifier = "-" if can.error else f"{can.can_id:08X}" if can.extended else f"{can.can_id:04X}"
    text = f"{kind} {channel:>2} {identifier:>8} {way} -  {can.length:<4} {can.data.hex(' ').upper()}"
    return text.rstrip()
