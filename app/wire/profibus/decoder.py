"""The passive PROFIBUS decoder: telegrams of one bus in, records out, whoever sent them.

It sends nothing, reads no clock and never raises on any bytes: what makes no sense gives a record that says so. Masters
and slaves are told apart by the telegrams alone. A PKW job is told as an SDO transfer, process data as PDOs. One thread
feeds it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from app.model.description import Description
from app.wire.frame import Direction, Fdl, Frame
from app.wire.pdo_follower import PdoRoute
from app.wire.profibus import dp
from app.wire.profibus.control import Reply, Request
from app.wire.profibus.diagnosis import Status
from app.wire.profibus.fdl import BROADCAST, ShortAck, Telegram, Token, decode
from app.wire.profibus.fields import FormatError
from app.wire.profibus.pzd import Order
from app.wire.profibus.slave import Slave
from app.wire.records import (
    DiagnosisSeen,
    GapSeen,
    MalformedAduSeen,
    OrphanSeen,
    Record,
    Side,
    SlaveState,
)

_NOTHING: Final[tuple[Record, ...]] = ()


class _Open(NamedTuple):
    """The request on the line, which has one at a time. ``service`` None: it makes no sense."""

    telegram: Telegram
    service: dp.Service | None
    client: Direction


class ProfibusDecoder:
    """Decoder of the bus ``bus``; node numbers are addresses of stations."""

    PROTOCOL: Final = "profibus-dp"
    """Names the protocol in a kept state."""

    def __init__(
        self,
        bus: str,
        descriptions: Mapping[int, Description] | None = None,
        orders: Mapping[int, Order] | None = None,
    ) -> None:
        """``orders`` are what a site says of the process data of its stations; the line proves them, or not."""
        self.bus = bus
        self._slaves: dict[int, Slave] = {}
        self._open: _Open | None = None
        for node, description in (descriptions or {}).items():
            self.set_description(node, description)
        for node, order in (orders or {}).items():
            self._slave(node).proof.setting = order

    def set_description(self, node: int, description: Description | None) -> None:
        """Tell what stands at ``node``: without it exchanged data tell nothing."""
        self._slave(node).description = description

    def set_order(self, node: int, order: Order | None) -> None:
        """Somebody has proven the order of the process data of ``node``; None: nothing is proven any more."""
        self._slave(node).proof.know(order)

    def slave(self, node: int) -> Slave | None:
        """All that is known of ``node``; None where it was never seen, nor described."""
        return self._slaves.get(node)

    @property
    def asked(self) -> Telegram | None:
        """The request that waits for its answer: the line has one at a time."""
        return None if self._open is None else self._open.telegram

    def state(self, node: int) -> SlaveState | None:
        """The state in which ``node`` was seen, None where it was not."""
        return self._slaves[node].state if node in self._slaves else None

    def pdos(self, node: int) -> tuple[PdoRoute, ...]:
        """None: nothing is sent unasked."""
        return ()

    def feed(self, frame: Frame) -> Sequence[Record]:
        """Decode one frame. Frames of other buses say nothing."""
        t_ns, bus, direction, fdl, _ = frame
        if type(fdl) is not Fdl or bus != self.bus:
            return _NOTHING
        try:
            telegram = decode(fdl.data)
        except FormatError as error:
            # Most often the answer that was waited for, damaged: nobody can say whose it was.
            asked, self._open = self._open, None
            return (self._malformed(t_ns, 0 if asked is None else asked.telegram.destination, fdl, error),)
        if isinstance(telegram, Token):
            return self._unanswered(t_ns)
        if isinstance(telegram, Telegram) and isinstance(telegram.control, Request):
            return self._on_request(t_ns, direction, telegram, fdl)
        return self._on_answer(t_ns, telegram, fdl)

    def feed_all(self, frames: Iterable[Frame]) -> list[Record]:
        """Decode many frames in their order."""
        records: list[Record] = []
        for frame in frames:
            records += self.feed(frame)
        return records

    def gap(self, t_ns: int, reason: str) -> Sequence[Record]:
        """Frames are missing before ``t_ns``: what is open is given up. ``reason`` is a text key."""
        self._open = None
        lost = [record for slave in self._slaves.values() for record in slave.forget(t_ns)]
        return (*lost, GapSeen(t_ns, self.bus, 0, reason))

    # -- both directions -----------------------------------------------------------

    def _on_request(self, t_ns: int, direction: Direction, telegram: Telegram, fdl: Fdl) -> Sequence[Record]:
        records = list(self._unanswered(t_ns))
        assert isinstance(telegram.control, Request)  # the caller has looked
        service = None
        try:
            service = dp.decode_request(telegram)
        except FormatError as error:
            records.append(self._malformed(t_ns, _node(telegram.destination), fdl, error))
        if telegram.control.ask.answered and telegram.destination != BROADCAST:
            self._open = _Open(telegram, service, direction)
        return records

    def _on_answer(self, t_ns: int, answer: Telegram | ShortAck, fdl: Fdl) -> Sequence[Record]:
        asked, self._open = self._open, None
        if asked is None or not dp.belongs(asked.telegram, answer):
            self._open = asked
            node = answer.source if isinstance(answer, Telegram) else 0
            return (OrphanSeen(t_ns, self.bus, node, None, Side.SERVER, fdl.data),)
        slave = self._slave(asked.telegram.destination)
        if asked.service is None:
            return slave.answered(t_ns, None)
        try:
            told = dp.decode_answer(asked.service, answer)
        except FormatError as error:
            return (*slave.answered(t_ns, None), self._malformed(t_ns, slave.node, fdl, error))
        records = slave.answered(t_ns, _state(asked.service, told))
        if isinstance(told, dp.DiagnosisAnswer):
            status, master, ident, extended = told.diagnosis
            records.append(DiagnosisSeen(t_ns, self.bus, slave.node, int(status), master, ident, extended))
        if isinstance(asked.service, dp.DataExchange) and isinstance(told, dp.Inputs):
            base = answer.data_offset if isinstance(answer, Telegram) else 0
            try:
                records += slave.exchanged(t_ns, asked.service.outputs, told.data, asked.client, base)
            except FormatError as error:
                records.append(self._malformed(t_ns, slave.node, fdl, error))
        return records

    def _unanswered(self, t_ns: int) -> Sequence[Record]:
        """Somebody else speaks: the request that was open gets no answer."""
        asked, self._open = self._open, None
        return _NOTHING if asked is None else self._slave(asked.telegram.destination).missed(t_ns)

    def _malformed(self, t_ns: int, node: int, fdl: Fdl, error: FormatError) -> MalformedAduSeen:
        return MalformedAduSeen(t_ns, self.bus, node, "", error.fault, error.offset, fdl.data)

    def _slave(self, node: int) -> Slave:
        found = self._slaves.get(node)
        if found is None:
            found = self._slaves[node] = Slave(self.bus, node)
        return found

    # -- keyframes ---------------------------------------------------------------------

    def snapshot(self) -> dict[str, Any]:
        """JSON-able state for a keyframe. Descriptions are not in it."""
        asked = self._open
        return {
            "bus": self.bus,
            "protocol": self.PROTOCOL,
            "slaves": {str(node): slave.snapshot() for node, slave in self._slaves.items()},
            "open": None if asked is None else [asked.telegram.encode().hex(), asked.client.value],
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()`` with the descriptions set here. Raises KeyError or ValueError on another state."""
        slaves = {}
        for number, kept in state["slaves"].items():
            slave = slaves[int(number)] = Slave(self.bus, int(number))
            slave.restore(kept)
        for node, known in self._slaves.items():
            slave = slaves.setdefault(node, Slave(self.bus, node))
            slave.description, slave.proof.setting = known.description, known.proof.setting
        asked = None
        if state["open"] is not None:
            data, client = state["open"]
            telegram = decode(bytes.fromhex(data))
            if not isinstance(telegram, Telegram):
                raise ValueError("no request is open in this state")
            asked = _Open(telegram, _service(telegram), Direction(client))
        self._slaves, self._open = slaves, asked


def _service(telegram: Telegram) -> dp.Service | None:
    try:
        return dp.decode_request(telegram)
    except FormatError:
        return None


def _state(service: dp.Service, told: dp.ServiceAnswer) -> SlaveState | None:
    """What an answer shows of its slave; None where it does not say."""
    if isinstance(told, dp.Inputs):
        return SlaveState.EXCHANGING
    if isinstance(told, dp.StatusAnswer):
        return None
    if isinstance(told, dp.Refused) and isinstance(service, dp.DataExchange) and told.reply is Reply.NO_SERVICE:
        return SlaveState.WAITING
    if isinstance(told, dp.DiagnosisAnswer) and told.diagnosis.status & (Status.PARAMETERS_REQUIRED | Status.NOT_READY):
        return SlaveState.WAITING
    if isinstance(service, dp.SetPrm) and isinstance(told, dp.Done) and service.unlock:
        return SlaveState.WAITING
    return None


def _node(address: int) -> int:
    return 0 if address == BROADCAST else address
