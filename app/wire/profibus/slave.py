"""What is known of one slave from the line: its state, its PKW jobs, and the meaning of what it exchanges."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from app.model.description import Bus, Description
from app.wire.fault_watch import DSP408, FaultWatch
from app.wire.frame import Direction
from app.wire.profibus import pkw
from app.wire.profibus.order_proof import OrderProof
from app.wire.profibus.pkw import AskKind, ReplyKind
from app.wire.profibus.pkw_follower import Ended, PkwFollower
from app.wire.profibus.pzd import Order, decode_pzd
from app.wire.profibus.telegrams import Signal, TelegramType, Words, telegram_of
from app.wire.records import (
    FaultSeen,
    Outcome,
    Protocol,
    Record,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    SlaveSeen,
    SlaveState,
    Source,
    ValueSeen,
)

LOST_AFTER: Final = 3
"""Requests in a row without an answer; a master repeats each of them once or more."""


class Slave:
    """The slave at ``node``. Its data have a meaning where its description is known."""

    def __init__(self, bus: str, node: int) -> None:
        self.bus = bus
        self.node = node
        self.state: SlaveState | None = None
        self.description: Description | None = None
        self.proof = OrderProof()
        """Of its process data, which tell nothing while their order is not proven."""
        self.outputs = b""
        """What it was sent in its latest exchange; empty where there was none."""
        self.inputs = b""
        """What it answered then."""
        self._missed = 0
        self._pkw = PkwFollower()
        self._faults = FaultWatch(DSP408)

    @property
    def order(self) -> Order | None:
        """That of its process data; None while it is not proven."""
        return self.proof.order

    @property
    def telegram(self) -> TelegramType | None:
        """The type that it exchanges; None where it is not told."""
        described = self.description is not None and self.description.bus is Bus.PROFIBUS_DP
        return telegram_of(len(self.outputs), len(self.inputs)) if described else None

    def answered(self, t_ns: int, state: SlaveState | None) -> list[Record]:
        """It said something, which shows it in ``state`` (None: whatever it was, it is there)."""
        self._missed = 0
        if state is None:
            state = self.state if self.state not in (None, SlaveState.ABSENT) else SlaveState.PRESENT
        return self._become(t_ns, state)

    def missed(self, t_ns: int) -> list[Record]:
        """It left a request without an answer. One that never gave any is not told."""
        self._missed += 1
        if self._missed < LOST_AFTER or self.state in (None, SlaveState.ABSENT):
            return []
        return [*self.forget(t_ns), *self._become(t_ns, SlaveState.ABSENT)]

    def exchanged(self, t_ns: int, outputs: bytes, inputs: bytes, client: Direction, base: int) -> list[Record]:
        """One Data_Exchange, with the inputs at ``base`` of their telegram. Raises FormatError on no PKW."""
        self.outputs, self.inputs = outputs, inputs
        telegram = self.telegram
        if telegram is None:
            return []
        if not telegram.has_pkw:
            told = self._process_data(t_ns, telegram, outputs, inputs)
            return [*told, *self._faults_of(told)]
        ends = self._pkw.exchange(t_ns, outputs[: pkw.SIZE], inputs[: pkw.SIZE], client, base)
        for ended in ends:
            self._prove(telegram, ended, inputs)
        records = self._process_data(t_ns, telegram, outputs, inputs)
        for ended in ends:
            records += self._told(t_ns, ended)
        return [*records, *self._faults_of(records)]

    def _faults_of(self, records: Sequence[Record]) -> Iterator[FaultSeen]:
        """What the values that it gave tell of a fault, where that is new."""
        for record in records:
            if isinstance(record, ValueSeen) and record.source in (Source.SDO_READ, Source.PDO_TX):
                fault = self._faults.see(record)
                if fault is not None:
                    yield fault

    def _prove(self, telegram: TelegramType, ended: Ended, inputs: bytes) -> None:
        """What was read stands in the process data of the same telegram too, where they have it."""
        job, answer = ended.job, ended.answer
        if job.request.kind is AskKind.READ and answer is not None and answer.data is not None:
            self.proof.take(telegram, job.request.address, answer.data, inputs[pkw.SIZE :])

    def forget(self, t_ns: int) -> list[Record]:
        """It is gone, or frames are missing: what is open will not be answered."""
        self._faults.forget()
        return [record for ended in self._pkw.forget() for record in self._told(t_ns, ended)]

    def _become(self, t_ns: int, state: SlaveState | None) -> list[Record]:
        if state is None or state is self.state:
            return []
        self.state = state
        return [SlaveSeen(t_ns, self.bus, self.node, state)]

    def _process_data(self, t_ns: int, telegram: TelegramType, outputs: bytes, inputs: bytes) -> list[Record]:
        head = pkw.SIZE if telegram.has_pkw else 0
        return [
            *self._values(t_ns, telegram.received, outputs[head:], Source.PDO_RX),
            *self._values(t_ns, telegram.sent, inputs[head:], Source.PDO_TX),
        ]

    def _values(self, t_ns: int, words: Words, data: bytes, source: Source) -> Iterator[Record]:
        for signal, value in self.signals(words, data).items():
            known = None if self.description is None else self.description.entries
            entry = None if signal.address is None or known is None else known.get(signal.address)
            if entry is not None and entry.type.size is not None:
                raw = value.to_bytes(entry.type.size, "little", signed=signal.signed)
                yield ValueSeen(t_ns, self.bus, self.node, entry.address, raw, source)

    def signals(self, words: Words, data: bytes) -> dict[Signal, int]:
        """Process data as numbers, as far as their order is proven. Raises FormatError on another length."""
        if self.proof.order is not None:
            return decode_pzd(words, data, self.proof.order)
        found: dict[Signal, int] = {}
        for signal in (signal for word in words for signal in word):
            order = self.proof.tells(signal)
            if order is not None:
                found[signal] = decode_pzd(words, data, order)[signal]
        return found

    def _told(self, t_ns: int, ended: Ended) -> Iterator[Record]:
        job, answer = ended.job, ended.answer
        address, written = job.request.address, job.request.data
        is_read = job.request.kind is AskKind.READ
        refused = answer is not None and answer.kind is ReplyKind.REFUSED
        outcome = Outcome.LOST if answer is None else Outcome.ABORTED if refused else Outcome.DONE
        data = None if answer is None else answer.data if is_read else written
        if not ended.again:
            yield SdoSeen(
                t_ns, self.bus, self.node, SdoAccess.READ if is_read else SdoAccess.WRITE, address, outcome,
                data if outcome is Outcome.DONE else None, answer.value if answer is not None and refused else None,
                Side.SERVER if refused else None, Protocol.PKW, t_ns - job.t_ns, job.client,
            )  # fmt: skip
        if outcome is Outcome.DONE and data is not None:
            source = Source.SDO_READ if is_read else Source.SDO_WRITE
            yield ValueSeen(t_ns, self.bus, self.node, address, data, source)
        saves = () if self.description is None else self.description.save
        if not is_read and any((one.address, one.signature) == (address, job.request.value) for one in saves):
            yield SaveSeen(t_ns, self.bus, self.node, address, outcome is Outcome.DONE)

    def snapshot(self) -> dict[str, Any]:
        """JSON-able. The description is not in it."""
        return {
            "state": None if self.state is None else self.state.value,
            "proof": self.proof.snapshot(),
            "outputs": self.outputs.hex(),
            "inputs": self.inputs.hex(),
            "missed": self._missed,
            "pkw": self._pkw.snapshot(),
            "faults": self._faults.snapshot(),
        }

    def restore(self, kept: Mapping[str, Any]) -> None:
        """Go on from ``snapshot()``. Raises KeyError or ValueError on another state."""
        self.state = None if kept["state"] is None else SlaveState(kept["state"])
        self.proof.restore(kept["proof"])
        self.outputs, self.inputs = bytes.fromhex(kept["outputs"]), bytes.fromhex(kept["inputs"])
        self._missed = kept["missed"]
        self._pkw.restore(kept["pkw"])
        self._faults.restore(kept["faults"])
