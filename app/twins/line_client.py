"""A CANopen client on a simulated line: SDO reads and writes of up to 4 bytes, one after the other, and NMT commands.

Bytes in, bytes out; time is the line's. What is asked for waits in a queue, so that a write, a save and a restart that
were ordered at once come one after the other.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from app.model.address import Address
from app.twins.ports import Alarm, Line
from app.wire import nmt, sdo
from app.wire.frame import Can
from app.wire.sdo import Abort, Command

ANSWER_NS: Final = 10_000_000_000
"""How long an answer is waited for: a save may take seconds."""
_SHORT: Final = 4
"""Bytes that one frame carries."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What became of a transfer: data of a read, or the code of an abort (``TIMED_OUT`` where nothing came)."""

    data: bytes = b""
    abort: int | None = None


Then = Callable[[Answer], None]


@dataclass(slots=True)
class _Job:
    node: int
    frame: Can
    address: Address | None = None
    then: Then = lambda _answer: None
    collected: bytearray = field(default_factory=bytearray)
    toggle: bool = False


class LineClient:
    """The client. ``close`` takes it off the line."""

    def __init__(self, line: Line, answer_ns: int = ANSWER_NS) -> None:
        self._line = line
        self._answer_ns = answer_ns
        self._port = line.attach(self._on_frame)
        self._port.accept(())
        self._alarm = Alarm(line)
        self._jobs: deque[_Job] = deque()
        self.on_send: Callable[[Can], None] = lambda _can: None
        """Is told every frame that it sends, as it is queued."""

    def read(self, node: int, address: Address, then: Then = lambda _answer: None) -> None:
        """Read an object; ``then`` gets what came."""
        self._add(_Job(node, _request(node, sdo.upload_request(address)), address, then))

    def write(self, node: int, address: Address, data: bytes, then: Then = lambda _answer: None) -> None:
        """Write 1 to 4 bytes; ``then`` gets what came. Raises ValueError on another number."""
        if not 0 < len(data) <= _SHORT:
            raise ValueError(f"{len(data)} bytes do not fit into one frame")
        self._add(_Job(node, _request(node, sdo.download_request(address, data)), address, then))

    def nmt(self, command: int, node: int) -> None:
        """Send an NMT command, sensible or not, to a node (0: all)."""
        self._add(_Job(node, Can(nmt.NMT_COB_ID, bytes((command, node)))))

    def close(self) -> None:
        """Send no more and hear no more."""
        self._jobs.clear()
        self._alarm.clear()
        self._port.accept(())
        self._port.clear()
        self._port.detach()

    # -- inside ------------------------------------------------------------------------

    def _add(self, job: _Job) -> None:
        self._jobs.append(job)
        if len(self._jobs) == 1:
            self._begin()

    def _begin(self) -> None:
        while self._jobs:
            job = self._jobs[0]
            self._send(job.frame)
            if job.address is not None:
                self._port.accept((sdo.RESPONSE_BASE + job.node,))
                self._alarm.set(self._line.now_ns + self._answer_ns, self._given_up)
                return
            self._jobs.popleft()

    def _send(self, can: Can) -> None:
        self.on_send(can)
        self._port.send(can)

    def _given_up(self, _t_ns: int) -> None:
        self._finish(Answer(abort=Abort.TIMED_OUT))

    def _finish(self, answer: Answer) -> None:
        job = self._jobs.popleft()
        self._alarm.clear()
        self._port.accept(())
        self._begin()
        job.then(answer)

    def _on_frame(self, can: Can, _t_ns: int) -> None:
        if can.remote or len(can.data) != 8 or not self._jobs:
            return
        job = self._jobs[0]
        if can.data[0] >> 5 == Command.SCS_UPLOAD_SEGMENT:
            self._segment(job, can.data)
            return
        frame = sdo.multiplexed(can.data)
        if frame.address != job.address:
            return  # an answer to somebody else
        if frame.command == Command.ABORT:
            self._finish(Answer(abort=sdo.abort_code(frame)))
        elif frame.command == Command.SCS_DOWNLOAD:
            self._finish(Answer())
        elif frame.command == Command.SCS_UPLOAD:
            data = sdo.expedited_data(frame)
            if data is not None:
                self._finish(Answer(data))
            else:
                self._send(_request(job.node, sdo.upload_segment_request(job.toggle)))

    def _segment(self, job: _Job, data: bytes) -> None:
        piece = sdo.segment(data)
        job.collected += piece.data
        job.toggle = not job.toggle
        if piece.last:
            self._finish(Answer(bytes(job.collected)))
        else:
            self._send(_request(job.node, sdo.upload_segment_request(job.toggle)))


def _request(node: int, data: bytes) -> Can:
    return Can(sdo.REQUEST_BASE + node, data)
