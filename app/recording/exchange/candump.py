"""The log format of can-utils: ``(1750000000.123456) can0 181#0102``.

In the common style just what every tool reads: tshark 4.0 takes nothing behind the data and misreads nine decimals, and
can-utils 2020.11 count nine decimals as microseconds. The exact style has nine decimals, ``R`` or ``T`` behind the
data (as python-can) and the raw DLC behind an underscore (as can-utils do). An error frame has bit 29 of its identifier
set, as in SocketCAN; python-can reads only those of class 80h as such, and drops their bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

from app.recording.cdr import MAX_DATA, MAX_DLC, MAX_ID, make_can
from app.recording.exchange.formats import Head, Style
from app.recording.exchange.lines import BadLineError, Notes, Other, checked_id, decimal_ns, hex_bytes, seconds_text
from app.wire.frame import Can, Direction, Frame

_ERROR: Final = 0x2000_0000
_EXTENDED: Final = 0x8000_0000
_LINE: Final = re.compile(
    r"\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(#?)"
    r"(?:([Rr])([0-9A-Fa-f]?)|([0-9A-Fa-f.]*))(?:_([9A-Fa-f]))?(?:\s+([RTrt]))?$",
    re.ASCII,
)
_DIRECTIONS: Final = {None: Direction.RX, "R": Direction.RX, "T": Direction.TX}
_LETTERS: Final = {Direction.RX: " R", Direction.TX: " T"}


class CandumpParser:
    """Reads the lines of ``candump -l`` and ``-L``."""

    expects = "exchange.expects.candump"

    def __init__(self, notes: Notes) -> None:
        self._notes = notes

    def parse(self, line: str) -> Frame | None:
        """The frame of a line; None for a CAN FD frame. Raises BadLineError."""
        match = _LINE.match(line)
        if match is None:
            raise BadLineError("no line of candump")
        time, bus, identifier, fd, remote, remote_dlc, data, raw_dlc, letter = match.groups()
        if fd:
            self._notes.other[Other.CAN_FD] += 1
            return None
        t_ns = decimal_ns(time)
        direction = _DIRECTIONS[letter.upper() if letter else None]
        return Frame(t_ns, bus, direction, _can(identifier, remote, remote_dlc, data, raw_dlc))


def _can(identifier: str, remote: str | None, remote_dlc: str, digits: str | None, raw_dlc: str | None) -> Can:
    number, extended = int(identifier, 16), len(identifier) > 3
    error = extended and bool(number & _ERROR)
    data = hex_bytes((digits or "").replace(".", ""))
    dlc = int(raw_dlc, 16) if raw_dlc else int(remote_dlc or "0", 16) if remote else len(data)
    if not remote and dlc > MAX_DATA and len(data) != MAX_DATA:
        raise BadLineError("a raw DLC stands behind eight bytes only")
    if remote and not raw_dlc and dlc > MAX_DATA:
        raise BadLineError("a remote frame asks for eight bytes at most")
    if error:
        return make_can(number & MAX_ID, data, bool(number & _EXTENDED), False, True, len(data))
    return make_can(checked_id(number, extended), data, extended, bool(remote), False, dlc)


def candump_lines(_head: Head, frames: Iterable[Frame], style: Style) -> Iterator[str]:
    """The lines of frames that are ``held``, each with its end."""
    exact = style is Style.EXACT
    decimals = 9 if exact else 6
    for t_ns, bus, direction, can, _ in frames:
        if isinstance(can, Can):
            letter = _LETTERS[direction] if exact else ""
            yield f"({seconds_text(t_ns, decimals)}) {bus} {_content(can)}{letter}\n"


def _content(can: Can) -> str:
    if can.error:
        return f"{_ERROR | can.can_id:08X}#{can.data.hex().upper()}"
    identifier = f"{can.can_id:08X}" if can.extended else f"{can.can_id:03X}"
    dlc = can.length
    raw_dlc = f"_{min(dlc, MAX_DLC):X}" if dlc > MAX_DATA else ""
    if can.remote:
        return f"{identifier}#R{min(dlc, MAX_DATA)}{raw_dlc}"
    return f"{identifier}#{can.data.hex().upper()}{raw_dlc}"
