"""The physical layer of PROFIBUS on a file descriptor: a serial port, or a pseudo-terminal.

What the system says is translated: whoever uses a line sees ``LineError`` and nothing else. A real port checks the
parity of each byte; one that fails is marked, and told apart from data.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import struct
import sys
import termios
import time
import tty
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

_PTY_MAJORS: Final = range(136, 144)
"""Device numbers of pseudo-terminals (Linux, Documentation/admin-guide/devices.txt): they have no parity."""
_WRITE_S: Final = 1.0
_CHUNK: Final = 4096
_MARK: Final = 0xFF
_TCGETS2: Final = 0x802C542A
_TCSETS2: Final = 0x402C542B
_TERMIOS2_SIZE: Final = 44
"""``struct termios2`` (Linux, asm-generic/termbits.h): input flags first, the rates as numbers at the end."""
_FLAGS: Final = struct.Struct("@I")


class LineError(Exception):
    """The port cannot be opened, or is gone; its text says why."""


class Received(NamedTuple):
    """Bytes that came, and how many of them had a wrong parity (which are left out)."""

    data: bytes
    broken: int = 0


NOTHING: Final = Received(b"")


class Line(Protocol):
    """What the master needs of a line. ``now_s`` is its own monotonic clock. Raises LineError everywhere."""

    def now_s(self) -> float:
        """Seconds on the clock by which waits are measured."""

    def send(self, data: bytes) -> None:
        """Hand all of it to the line; it may still be on its way when this returns."""

    def receive(self, timeout_s: float) -> Received:
        """What has come; waits for it at most ``timeout_s``, 0 not at all. Nothing at the end of that time."""

    def close(self) -> None:
        """End it. Calling it again does nothing."""


class SerialLine:
    """The port at ``path``, with ``baud`` bit/s, 8 bits, even parity and one stop bit. Raises LineError."""

    def __init__(self, path: str, baud: int) -> None:
        self._marks = Unmarking()
        self._held: Any = None
        try:
            major = os.major(Path(path).stat().st_rdev)
            self._file = _open_pty(path) if major in _PTY_MAJORS else self._open_port(path, baud)
        except (OSError, termios.error, ValueError) as error:
            raise LineError(_reason(error)) from error
        self.checks_parity = self._held is not None

    def _open_port(self, path: str, baud: int) -> int:
        """PySerial knows how each system sets rates that POSIX does not name; the rest goes by the descriptor."""
        import serial

        try:
            self._held = serial.Serial(path, baud, parity=serial.PARITY_EVEN, timeout=0, exclusive=True)
        except serial.SerialException as error:
            raise OSError(_reason(error)) from error
        file: int = self._held.fileno()
        mark_parity(file)
        return file

    def now_s(self) -> float:
        """See Line."""
        return time.monotonic()

    def send(self, data: bytes) -> None:
        """See Line."""
        left, end_s = data, time.monotonic() + _WRITE_S
        try:
            while left:
                if not select.select((), (self._file,), (), max(0.0, end_s - time.monotonic()))[1]:
                    raise LineError("the port takes no more bytes")
                left = left[os.write(self._file, left) :]
        except (OSError, ValueError) as error:
            raise LineError(_reason(error)) from error

    def receive(self, timeout_s: float) -> Received:
        """See Line."""
        try:
            if not select.select((self._file,), (), (), timeout_s)[0]:
                return NOTHING
            data = os.read(self._file, _CHUNK)
        except BlockingIOError:
            return NOTHING
        except (OSError, ValueError) as error:
            raise LineError(_reason(error)) from error
        if not data:
            raise LineError("the port has ended")
        return self._marks.feed(data) if self.checks_parity else Received(data)

    def close(self) -> None:
        """See Line."""
        file, self._file = self._file, -1
        with contextlib.suppress(OSError, termios.error):
            if self._held is not None:
                self._held.close()
            elif file >= 0:
                os.close(file)


class Unmarking:
    """Undoes PARMRK (termios(3)): FFh 00h X is X with a wrong parity, FFh FFh is one FFh."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> Received:
        """What the bytes mean; a mark that is not whole yet is kept."""
        data, good, broken, at = self._rest + data, bytearray(), 0, 0
        self._rest = b""
        while at < len(data):
            if data[at] != _MARK:
                good.append(data[at])
                at += 1
            elif data[at : at + 2] == b"\xff\xff":
                good.append(_MARK)
                at += 2
            elif len(data) - at < 3:
                self._rest = data[at:]
                break
            else:
                broken += 1
                at += 3
        return Received(bytes(good), broken)


def mark_parity(file: int) -> None:
    """Have bytes with a wrong parity marked (INPCK, PARMRK). Raises OSError, termios.error.

    Linux keeps rates that POSIX does not name in a structure of its own; ``tcsetattr`` would lose them.
    """
    wanted, unwanted = termios.INPCK | termios.PARMRK, termios.IGNPAR | termios.ISTRIP
    if sys.platform != "linux":
        settings = termios.tcgetattr(file)
        settings[0] = (settings[0] | wanted) & ~unwanted
        termios.tcsetattr(file, termios.TCSANOW, settings)
        return
    held = bytearray(_TERMIOS2_SIZE)
    fcntl.ioctl(file, _TCGETS2, held)
    (flags,) = _FLAGS.unpack_from(held)
    _FLAGS.pack_into(held, 0, (flags | wanted) & ~unwanted)
    fcntl.ioctl(file, _TCSETS2, bytes(held))


def _open_pty(path: str) -> int:
    file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        tty.setraw(file, termios.TCSANOW)
        termios.tcflush(file, termios.TCIFLUSH)  # an answer to whoever was killed here before us is for nobody now
    except BaseException:
        os.close(file)
        raise
    return file


def _reason(error: BaseException) -> str:
    """``termios.error`` is no OSError, and has its text in second place."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, termios.error) and len(error.args) > 1:
        return str(error.args[1])
    return str(error) or type(error).__name__
