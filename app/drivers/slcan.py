"""Serial adapters that speak slcan (the text protocol of LAWICEL), read and written in bulk.

python-can opens and sets up the adapter; its own reader asks the system for every single byte, and its writer waits
until each frame has left the port, which a loaded bus at 500 kbit/s does not allow.
"""

from __future__ import annotations

import re
from typing import Any, Final

import can

from app.drivers.can_link import LinkBusyError, LinkError, PythonCanLink, error_text
from app.drivers.socketcand import Received
from app.wire.frame import Can

_END: Final = re.compile(rb"[\r\a]")
_REST_MAX: Final = 64


class SlcanLink(PythonCanLink):
    """A serial adapter; ``bus`` is python-can's, already open."""

    def __init__(self, bus: can.BusABC) -> None:
        super().__init__(bus)
        self._serial: Any = bus.serialPortOrig  # type: ignore[attr-defined]
        self._serial.write_timeout = 1.0
        self._rest = b""
        self.malformed = 0
        """Lines that could not be read so far."""

    def recv_many(self, timeout_s: float) -> list[Received]:
        """See CanLink; slcan has no time stamps. Where ``select`` cannot wait, the port's own time-out holds."""
        try:
            data = self._serial.read(max(1, self._serial.in_waiting))
        except Exception as error:
            # pyserial raises OSError, its own SerialException, TypeError and termios.error for a port that is gone.
            raise LinkError(error_text(error)) from error
        *lines, self._rest = _END.split(self._rest + data)
        if len(self._rest) > _REST_MAX:
            self._rest = b""
            self.malformed += 1
        received: list[Received] = []
        for line in lines:
            try:
                frame = parse_line(line)
            except (ValueError, IndexError):
                self.malformed += 1
                continue
            if frame is not None:
                received.append((frame, None))
        return received

    def send(self, frame: Can) -> None:
        """See CanLink."""
        try:
            self._serial.write(format_line(frame))
        except Exception as error:
            if type(error).__name__ == "SerialTimeoutException":
                raise LinkBusyError(error_text(error)) from error
            raise LinkError(error_text(error)) from error


def parse_line(line: bytes) -> Can | None:
    """A frame of one line; None for the adapter's answers. Raises ValueError, IndexError for a damaged one."""
    kind = line[:1]
    if kind not in (b"t", b"T", b"r", b"R"):
        return None
    extended, remote = kind in b"TR", kind in b"rR"
    place = 9 if extended else 4
    can_id, length = int(line[1:place], 16), int(line[place : place + 1])
    if length > 8 or can_id > (0x1FFFFFFF if extended else 0x7FF):
        raise ValueError(f"no classic frame: {line!r}")
    if remote:
        return Can(can_id, b"", extended, remote=True, dlc=length)
    data = bytes.fromhex(line[place + 1 : place + 1 + 2 * length].decode("ascii"))
    if len(data) != length:
        raise ValueError(f"data is missing: {line!r}")
    return Can(can_id, data, extended)


def format_line(frame: Can) -> bytes:
    """The line that sends ``frame``."""
    kind = "r" if frame.remote else "t"
    head = f"{kind.upper()}{frame.can_id:08X}" if frame.extended else f"{kind}{frame.can_id:03X}"
    return f"{head}{frame.length}{'' if frame.remote else frame.data.hex().upper()}\r".encode()
