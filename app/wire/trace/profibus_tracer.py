"""What each PROFIBUS telegram means, a row each, made of the decoder's own records."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from app.model.description import Description
from app.wire.frame import Fdl, Frame
from app.wire.profibus import dp, pkw
from app.wire.profibus.control import Request
from app.wire.profibus.decoder import ProfibusDecoder
from app.wire.profibus.fdl import BROADCAST, AnyTelegram, ShortAck, Telegram, Token, decode
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pkw import AskKind, PkwAnswer, PkwRequest
from app.wire.profibus.pzd import Order
from app.wire.profibus.slave import Slave
from app.wire.records import SdoSeen
from app.wire.trace.fdl_told import FdlTold
from app.wire.trace.service import Service, Speaker
from app.wire.trace.tracer import GAP_SPEAKER, Gap, Item, Step, TraceRow, Tracing

_STEPS: Final[Mapping[type, Step]] = {
    dp.FdlStatus: Step.FDL_STATUS,
    dp.SlaveDiag: Step.SLAVE_DIAG,
    dp.GetCfg: Step.GET_CFG,
    dp.SetPrm: Step.SET_PRM,
    dp.ChkCfg: Step.CHK_CFG,
    dp.DataExchange: Step.DATA_EXCHANGE,
    dp.GlobalControl: Step.GLOBAL_CONTROL,
    dp.Other: Step.FDL_OTHER,
}


class _Read(NamedTuple):
    """A telegram with the request that it is or answers, and what the line knew of its station before it."""

    telegram: AnyTelegram
    asked: Telegram | None
    service: dp.Service | None
    answer: dp.ServiceAnswer | None
    slave: Slave | None

    @property
    def is_request(self) -> bool:
        return isinstance(self.telegram, Telegram) and isinstance(self.telegram.control, Request)

    @property
    def node(self) -> int:
        """Whose it is; 0 is nobody's."""
        if self.asked is not None:
            return 0 if self.asked.destination == BROADCAST else self.asked.destination
        return self.telegram.source if isinstance(self.telegram, Telegram) else 0

    @property
    def carried(self) -> bytes | None:
        """Outputs or inputs; None where it carries neither."""
        if isinstance(self.service, dp.DataExchange) and self.is_request:
            return self.service.outputs
        return self.answer.data if isinstance(self.answer, dp.Inputs) else None

    @property
    def is_same(self) -> bool:
        """It carries what the one before it carried, and has nothing else to tell."""
        carried = self.carried
        if not carried or self.slave is None:
            return False
        if isinstance(self.answer, dp.Inputs) and self.answer.diagnosis:
            return False
        return carried == (self.slave.outputs if self.is_request else self.slave.inputs)


class ProfibusTracer(Tracing):
    """Of a PROFIBUS line. ``orders`` are what a site says of the process data of its stations."""

    def __init__(
        self,
        bus: str,
        descriptions: Mapping[int, Description],
        orders: Mapping[int, Order] | None = None,
        snapshot: Mapping[str, Any] | None = None,
    ) -> None:
        self._decoder = ProfibusDecoder(bus, descriptions, orders)
        super().__init__(self._decoder, snapshot)

    def speaker(self, item: Item) -> Speaker:
        """Whose item it is, by what is known before it is taken."""
        if isinstance(item, Gap):
            return GAP_SPEAKER
        return _speaker(self._read(item))

    def _taken(self, frame: Frame) -> TraceRow:
        read = self._read(frame)
        speaker = _speaker(read)
        row = TraceRow(frame, speaker, None, None, None, None, tuple(self._decoder.feed(frame)))
        if read is None:
            return row._replace(step=Step.UNKNOWN)  # the decoder's record says what is wrong
        if isinstance(read.telegram, Token):
            return row._replace(step=Step.TOKEN, fdl=FdlTold(read.telegram.source, read.telegram.destination))
        told = _told(read)
        row = row._replace(step=None if read.service is None else _STEPS[type(read.service)], fdl=told)
        carried = read.carried
        if carried is None or speaker.service is Service.FDL_SAME:
            return row
        slave = self._decoder.slave(read.node)
        return row if slave is None else _exchanged(row, told, slave, carried, read.is_request)

    def _read(self, frame: Frame) -> _Read | None:
        """None where it is no telegram. Before the decoder is fed with it."""
        if not isinstance(frame.payload, Fdl):
            return None
        try:
            telegram = decode(frame.payload.data)
        except FormatError:
            return None
        if isinstance(telegram, Telegram) and isinstance(telegram.control, Request):
            return _Read(telegram, telegram, _service(telegram), None, self._decoder.slave(telegram.destination))
        asked = self._decoder.asked
        if asked is None or isinstance(telegram, Token) or not dp.belongs(asked, telegram):
            return _Read(telegram, None, None, None, None)
        service = _service(asked)
        return _Read(telegram, asked, service, _answer(service, telegram), self._decoder.slave(asked.destination))


def _service(request: Telegram) -> dp.Service | None:
    try:
        return dp.decode_request(request)
    except FormatError:
        return None


def _answer(service: dp.Service | None, telegram: Telegram | ShortAck) -> dp.ServiceAnswer | None:
    try:
        return None if service is None else dp.decode_answer(service, telegram)
    except FormatError:
        return None


def _speaker(read: _Read | None) -> Speaker:
    if read is None:
        return Speaker(Service.UNKNOWN)
    if isinstance(read.telegram, Token):
        return Speaker(Service.FDL_TOKEN)
    if read.is_same:
        return Speaker(Service.FDL_SAME, read.node)
    return Speaker(Service.FDL_REQUEST if read.is_request else Service.FDL_RESPONSE, read.node)


def _told(read: _Read) -> FdlTold:
    telegram, asked = read.telegram, read.asked
    told = FdlTold(service=read.service, answer=read.answer)
    if isinstance(telegram, Telegram):
        return told._replace(
            source=telegram.source, destination=telegram.destination, dsap=telegram.dsap, ssap=telegram.ssap
        )
    return told if asked is None else told._replace(source=asked.destination, destination=asked.source)


def _exchanged(row: TraceRow, told: FdlTold, slave: Slave, data: bytes, is_request: bool) -> TraceRow:
    """A row of Data_Exchange with its PKW and its process data, where it is known what it carries."""
    telegram = slave.telegram
    size = None if telegram is None else (telegram.output_size if is_request else telegram.input_size)
    if telegram is None or len(data) != size:
        return row._replace(fdl=told._replace(process_data=data))
    head = pkw.SIZE if telegram.has_pkw else 0
    words = telegram.received if is_request else telegram.sent
    signals = tuple(slave.signals(words, data[head:]).items())
    told = told._replace(has_pkw=telegram.has_pkw, signals=signals, process_data=data[head:])
    row = row._replace(fdl=told)
    if not head or (is_request and data[:head] == slave.outputs[:head]):
        return row  # a job that stands there already
    try:
        return (
            _asked(row, pkw.decode_request(data[:head]))
            if is_request
            else _answered(row, pkw.decode_answer(data[:head]))
        )
    except FormatError:
        return row  # the decoder's record says what is wrong


def _asked(row: TraceRow, job: PkwRequest) -> TraceRow:
    if row.fdl is None or job.kind is AskKind.NOTHING:
        return row
    return row._replace(address=job.address, value=job.data, fdl=row.fdl._replace(pkw=job))


def _answered(row: TraceRow, answer: PkwAnswer) -> TraceRow:
    """The parameter, where this very answer ended its job."""
    ended = any(isinstance(record, SdoSeen) and record.address == answer.address for record in row.records)
    if row.fdl is None or not ended:
        return row
    return row._replace(address=answer.address, value=answer.data, fdl=row.fdl._replace(pkw=answer))
