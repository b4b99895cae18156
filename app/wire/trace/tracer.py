"""What each frame means, a row a frame, made of the decoder's own records: a trace never contradicts a screen.

A ``Tracer`` takes frames in their order. It starts from nothing, or from a decoder's snapshot in the middle of the
traffic: then it knows which transfers are open and which mappings are in force.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from enum import Enum
from typing import Any, Final, NamedTuple

from app.model.address import Address
from app.model.description import Description
from app.wire import sdo
from app.wire.decoder import CanOpenDecoder
from app.wire.decoders import BusDecoder
from app.wire.emcy import NO_ERROR
from app.wire.frame import Can, Direction, Frame
from app.wire.records import (
    EmcySeen,
    GapSeen,
    MalformedAduSeen,
    MalformedSeen,
    OrphanSeen,
    Outcome,
    Record,
    SdoSeen,
    SlaveSeen,
    SlaveState,
    TransactionSeen,
)
from app.wire.trace.fdl_told import FdlTold
from app.wire.trace.service import Service, Speaker

_SDO: Final = (Service.SDO_REQUEST, Service.SDO_RESPONSE)
GAP_SPEAKER: Final = Speaker(Service.GAP)
_ERROR_SPEAKER: Final = Speaker(Service.ERROR)


class Gap(NamedTuple):
    """Frames are missing before ``t_ns`` on the bus; ``reason`` is a text key. It stands in a trace like a frame."""

    t_ns: int
    bus: str
    reason: str


Item = Frame | Gap
"""What a trace is made of."""


class Step(Enum):
    """Protocol step of an SDO frame (CiA 301, 7.2.4.3), or what a Modbus message or a PROFIBUS telegram is about."""

    READ = "read"
    READ_ANSWER = "read-answer"
    WRITE = "write"
    WRITE_ANSWER = "write-answer"
    SEGMENT_ASKED = "segment-asked"
    SEGMENT = "segment"
    SEGMENT_TAKEN = "segment-taken"
    BLOCK_READ = "block-read"
    BLOCK_READ_ANSWER = "block-read-answer"
    BLOCK_WRITE = "block-write"
    BLOCK_WRITE_ANSWER = "block-write-answer"
    BLOCK_START = "block-start"
    BLOCK_SEGMENT = "block-segment"
    BLOCK_TAKEN = "block-taken"
    BLOCK_END = "block-end"
    BLOCK_END_TAKEN = "block-end-taken"
    REGISTERS_READ = "registers-read"
    REGISTERS_WRITE = "registers-write"
    REGISTERS_BOTH = "registers-both"
    DICTIONARY = "dictionary"
    ARRAY_READ = "array-read"
    ARRAY_WRITE = "array-write"
    FDL_STATUS = "fdl-status"
    SLAVE_DIAG = "slave-diag"
    SET_PRM = "set-prm"
    CHK_CFG = "chk-cfg"
    GET_CFG = "get-cfg"
    DATA_EXCHANGE = "data-exchange"
    GLOBAL_CONTROL = "global-control"
    FDL_OTHER = "fdl-other"
    TOKEN = "token"
    EXCEPTION = "exception"
    ABORT = "abort"
    UNKNOWN = "unknown"

    @property
    def text_key(self) -> str:
        """Text key of the step."""
        return f"trace.step.{self.value}"


_WITH_ADDRESS: Final = frozenset(
    {
        Step.READ, Step.READ_ANSWER, Step.WRITE, Step.WRITE_ANSWER, Step.BLOCK_READ, Step.BLOCK_READ_ANSWER,
        Step.BLOCK_WRITE, Step.BLOCK_WRITE_ANSWER, Step.ABORT,
    }
)  # fmt: skip
_REQUESTS: Final[Mapping[int, Step]] = {
    sdo.Command.CCS_DOWNLOAD_SEGMENT: Step.SEGMENT,
    sdo.Command.CCS_DOWNLOAD: Step.WRITE,
    sdo.Command.CCS_UPLOAD: Step.READ,
    sdo.Command.CCS_UPLOAD_SEGMENT: Step.SEGMENT_ASKED,
    sdo.Command.ABORT: Step.ABORT,
}
_RESPONSES: Final[Mapping[int, Step]] = {
    sdo.Command.SCS_UPLOAD_SEGMENT: Step.SEGMENT,
    sdo.Command.SCS_DOWNLOAD_SEGMENT: Step.SEGMENT_TAKEN,
    sdo.Command.SCS_UPLOAD: Step.READ_ANSWER,
    sdo.Command.SCS_DOWNLOAD: Step.WRITE_ANSWER,
    sdo.Command.ABORT: Step.ABORT,
}
_BLOCK_REQUESTS: Final[Mapping[tuple[int, int], Step]] = {
    (sdo.Command.CCS_BLOCK_UPLOAD, sdo.BlockStep.INITIATE): Step.BLOCK_READ,
    (sdo.Command.CCS_BLOCK_UPLOAD, sdo.BlockStep.START): Step.BLOCK_START,
    (sdo.Command.CCS_BLOCK_UPLOAD, sdo.BlockStep.ACKNOWLEDGE): Step.BLOCK_TAKEN,
    (sdo.Command.CCS_BLOCK_UPLOAD, sdo.BlockStep.END): Step.BLOCK_END_TAKEN,
    (sdo.Command.CCS_BLOCK_DOWNLOAD, sdo.BlockStep.INITIATE): Step.BLOCK_WRITE,
    (sdo.Command.CCS_BLOCK_DOWNLOAD, sdo.BlockStep.END): Step.BLOCK_END,
}
_BLOCK_RESPONSES: Final[Mapping[tuple[int, int], Step]] = {
    (sdo.Command.SCS_BLOCK_UPLOAD, sdo.BlockStep.INITIATE): Step.BLOCK_READ_ANSWER,
    (sdo.Command.SCS_BLOCK_UPLOAD, sdo.BlockStep.END): Step.BLOCK_END,
    (sdo.Command.SCS_BLOCK_DOWNLOAD, sdo.BlockStep.INITIATE): Step.BLOCK_WRITE_ANSWER,
    (sdo.Command.SCS_BLOCK_DOWNLOAD, sdo.BlockStep.ACKNOWLEDGE): Step.BLOCK_TAKEN,
    (sdo.Command.SCS_BLOCK_DOWNLOAD, sdo.BlockStep.END): Step.BLOCK_END_TAKEN,
}


def step_of(data: bytes, client: bool) -> Step:
    """The step that 8 bytes are by themselves; a segment of a block transfer cannot be told without its context."""
    command = data[0] >> 5
    plain = (_REQUESTS if client else _RESPONSES).get(command)
    if plain is not None:
        return plain
    blocks = _BLOCK_REQUESTS if client else _BLOCK_RESPONSES
    return blocks.get((command, sdo.block_step(data)), Step.UNKNOWN)


class Tone(Enum):
    """How a row is marked."""

    PLAIN = "plain"
    WARNING = "warning"
    ERROR = "error"


class TraceRow(NamedTuple):
    """One frame and what it means.

    ``step``, ``address``, ``value`` and ``abort_code`` are of SDO frames and of Modbus, None where there is none.
    ``value`` is what an expedited write asks for, or what a transfer brought that this very frame completed.
    ``records`` are those that this frame made known. ``read`` and ``written`` are the first register and how many of a
    Modbus request, ``exception`` is the code of a refusal. ``fdl`` is what a PROFIBUS telegram says.
    """

    item: Item
    speaker: Speaker
    step: Step | None
    address: Address | None
    value: bytes | None
    abort_code: int | None
    records: tuple[Record, ...]
    read: tuple[int, int] | None = None
    written: tuple[int, int] | None = None
    exception: int | None = None
    fdl: FdlTold | None = None

    @property
    def t_ns(self) -> int:
        """Time of the frame."""
        return self.item[0]

    @property
    def tone(self) -> Tone:
        """Red what failed, amber what nobody ended or asked for."""
        if self.step in (Step.ABORT, Step.EXCEPTION) or self.speaker.service in (Service.ERROR, Service.GAP):
            return Tone.ERROR
        tones = {_tone(record) for record in self.records}
        if self.fdl is not None and self.fdl.is_refusal:
            tones.add(Tone.WARNING)
        return next((tone for tone in (Tone.ERROR, Tone.WARNING) if tone in tones), Tone.PLAIN)

    @property
    def took_ns(self) -> int | None:
        """Since the first request of the transfer, or transaction, that ended here."""
        for record in self.records:
            if isinstance(record, SdoSeen | TransactionSeen) and record.outcome is not Outcome.LOST:
                return record.dt_ns
        return None

    @property
    def done(self) -> SdoSeen | None:
        """The transfer of this very object that ended here; not one that this frame replaced."""
        for record in self.records:
            if type(record) is SdoSeen and record.outcome is not Outcome.LOST:
                return record
        return None


def _tone(record: Record) -> Tone:
    if isinstance(record, SdoSeen | TransactionSeen):
        if isinstance(record, TransactionSeen) and record.abort_code == sdo.Abort.NO_DATA:
            return Tone.PLAIN  # the end of a list
        if record.outcome is Outcome.DONE:
            return Tone.PLAIN
        return Tone.WARNING if record.outcome is Outcome.LOST else Tone.ERROR
    if isinstance(record, EmcySeen):
        return Tone.PLAIN if record.code == NO_ERROR else Tone.ERROR
    if isinstance(record, MalformedSeen | MalformedAduSeen | GapSeen):
        return Tone.ERROR
    if isinstance(record, SlaveSeen):
        return Tone.WARNING if record.state is SlaveState.ABSENT else Tone.PLAIN
    return Tone.WARNING if isinstance(record, OrphanSeen) else Tone.PLAIN


class Tracing(ABC):
    """Makes rows of the frames of one bus, which ``decoder`` follows. ``snapshot``: its state before the first."""

    def __init__(self, decoder: BusDecoder, snapshot: Mapping[str, Any] | None = None) -> None:
        self._follower = decoder
        if snapshot is not None:
            decoder.restore(snapshot)

    def restart(self, snapshot: Mapping[str, Any]) -> None:
        """Go on from another place in the traffic."""
        self._follower.restore(snapshot)

    def skip(self, items: Iterable[Item]) -> None:
        """Take items of which no rows are wanted."""
        for item in items:
            if isinstance(item, Gap):
                self._follower.gap(item.t_ns, item.reason)
            else:
                self._follower.feed(item)

    def rows(self, items: Iterable[Item]) -> Iterator[TraceRow]:
        """A row for each item."""
        return map(self.take, items)

    def take(self, item: Item) -> TraceRow:
        """The row of one item."""
        if isinstance(item, Gap):
            records = tuple(self._follower.gap(item.t_ns, item.reason))
            return TraceRow(item, GAP_SPEAKER, None, None, None, None, records)
        return self._taken(item)

    @abstractmethod
    def speaker(self, item: Item) -> Speaker:
        """Whose item it is, by what is known before it is taken."""

    @abstractmethod
    def _taken(self, frame: Frame) -> TraceRow: ...


class Tracer(Tracing):
    """Of a CAN bus."""

    def __init__(
        self, bus: str, descriptions: Mapping[int, Description], snapshot: Mapping[str, Any] | None = None
    ) -> None:
        self._decoder = CanOpenDecoder(bus, descriptions)
        super().__init__(self._decoder, snapshot)

    def speaker(self, item: Item) -> Speaker:
        """Whose item it is, by what is known before it is taken."""
        if isinstance(item, Gap):
            return GAP_SPEAKER
        can = item.payload
        if not isinstance(can, Can):
            return Speaker(Service.UNKNOWN)
        return _ERROR_SPEAKER if can.error else self._decoder.speaker(can.can_id, can.extended)

    def _taken(self, item: Frame) -> TraceRow:
        speaker = self.speaker(item)
        can = item.payload
        if speaker.service in _SDO and isinstance(can, Can) and len(can.data) == 8 and not can.remote:
            return self._sdo(item, can.data, speaker)
        return TraceRow(item, speaker, None, None, None, None, tuple(self._decoder.feed(item)))

    def _sdo(self, frame: Frame, data: bytes, speaker: Speaker) -> TraceRow:
        client = speaker.service is Service.SDO_REQUEST
        follower = self._decoder.sdo(speaker.node)
        step = Step.BLOCK_SEGMENT if follower.is_block_segment(client, data) else step_of(data, client)
        before = follower.address
        records = tuple(self._decoder.feed(frame))
        row = TraceRow(frame, speaker, step, before, None, None, records)
        if step in _WITH_ADDRESS:
            head = sdo.multiplexed(data)
            row = row._replace(address=head.address)
            if step is Step.ABORT:
                return row._replace(abort_code=sdo.abort_code(head))
            if step is Step.WRITE:
                row = row._replace(value=sdo.expedited_data(head))
        done = row.done
        return row if done is None or done.data is None else row._replace(value=done.data)


def direction_of(item: Item) -> Direction:
    """Which way an item went; a gap is what we did not receive."""
    return item.direction if isinstance(item, Frame) else Direction.RX
