"""What a Modbus request and its answer mean: the records of a transaction that has ended, one way or another."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from app.model.address import Address
from app.wire.modbus.answers import (
    AbortAnswer,
    Answer,
    ExceptionAnswer,
    FramesRead,
    ObjectRead,
    RegistersRead,
)
from app.wire.modbus.device import DeviceWatch
from app.wire.modbus.effects import objects_of, registers_written
from app.wire.modbus.functions import ModbusException
from app.wire.modbus.requests import (
    ReadObject,
    ReadRegisters,
    ReadWriteRegisters,
    Request,
    WriteArray,
    WriteObject,
)
from app.wire.modbus.transactions import Open
from app.wire.records import (
    LoadSeen,
    Outcome,
    Protocol,
    Record,
    SaveSeen,
    SdoAccess,
    SdoSeen,
    Side,
    Source,
    TransactionSeen,
    ValueSeen,
)
from app.wire.sdo_follower import LOAD_INDEX, SAVE_INDEX

_NOTHING: Final[tuple[Record, ...]] = ()
_NOTHING_DONE: Final = frozenset({ModbusException.ILLEGAL_FUNCTION, ModbusException.ILLEGAL_ADDRESS})
"""After these a device has not begun."""


class Teller:
    """Makes the records of the bus ``bus``; ``device`` gives what is known of a node."""

    def __init__(self, bus: str, device: Callable[[int], DeviceWatch]) -> None:
        self.bus = bus
        self._device = device

    # -- ends of requests ------------------------------------------------------------

    def answered(self, node: int, t_ns: int, asked: Open, request: Request, answer: Answer) -> list[Record]:
        """The request had this answer."""
        if isinstance(answer, ExceptionAnswer | AbortAnswer):
            return self._refused(node, t_ns, asked, request, answer)
        if isinstance(request, ReadObject) and isinstance(answer, ObjectRead):
            seen = self._transfer(node, t_ns, asked, request.address, Outcome.DONE, answer.data)
            value = ValueSeen(t_ns, self.bus, node, request.address, answer.data, Source.SDO_READ)
            return [seen] if request.start else [seen, value]
        if isinstance(request, WriteObject):
            return self._written(node, t_ns, asked, request, request.address, request.data, whole=request.start == 0)
        if isinstance(request, WriteArray):
            frames = request.frames
            return [r for f in frames for r in self._written(node, t_ns, asked, request, f.address, f.data, whole=True)]
        return [self._transaction(node, t_ns, asked, Outcome.DONE), *self._values(node, t_ns, asked, request, answer)]

    def _values(self, node: int, t_ns: int, asked: Open, request: Request, answer: Answer) -> list[Record]:
        """What FC 101 and 102, and registers, tell of objects."""
        device, bus = self._device(node), self.bus
        if isinstance(answer, FramesRead):
            return [ValueSeen(t_ns, bus, node, f.address, f.data, Source.SDO_READ) for f in answer.frames]
        records: list[Record] = []
        for start, registers in registers_written(request):
            image = device.received.image
            if image is not None:
                written = dict(image.values(start, registers))
                records += [
                    ValueSeen(t_ns, bus, node, address, data, Source.PDO_RX) for address, data in written.items()
                ]
                others = [address for address in image.touched(start, len(registers)) if address not in written]
                records += [self._transfer(node, t_ns, asked, address, Outcome.BROKEN) for address in others]
        if isinstance(request, ReadRegisters | ReadWriteRegisters) and isinstance(answer, RegistersRead):
            device.registers_read(t_ns, request.start, answer.registers)
            for image in (device.sent.image, device.received.image):
                if image is not None:
                    whole = image.values(request.start, answer.registers)
                    records += [ValueSeen(t_ns, bus, node, address, data, Source.PDO_TX) for address, data in whole]
        return records

    def _written(
        self, node: int, t_ns: int, asked: Open, request: Request, address: Address, data: bytes, whole: bool
    ) -> list[Record]:
        """``whole``: all of the object. Of one that was written in part nobody knows what it is now."""
        seen = self._transfer(node, t_ns, asked, address, Outcome.DONE if whole else Outcome.BROKEN, data)
        if not whole:
            self._device(node).unsure(request)
            return [seen]
        value = ValueSeen(t_ns, self.bus, node, address, data, Source.SDO_WRITE)
        return [seen, value, *self._commanded(node, t_ns, address, data, done=True)]

    def _refused(
        self, node: int, t_ns: int, asked: Open, request: Request, answer: ExceptionAnswer | AbortAnswer
    ) -> list[Record]:
        """Of many objects in one request some may have been written before the one that was refused."""
        self._device(node).refused(request)
        exception = answer.exception if isinstance(answer, ExceptionAnswer) else None
        abort_code = answer.abort_code if isinstance(answer, AbortAnswer) else None
        objects, records = objects_of(request), self._not_commanded(node, t_ns, request)
        if abort_code is not None and len(objects) == 1:
            address = objects[0][0]
            transfer = self._transfer(node, t_ns, asked, address, Outcome.ABORTED, abort_code=abort_code)
            return [transfer, *records]
        nothing_done = exception in _NOTHING_DONE or isinstance(request, ReadObject)
        partly = [] if nothing_done else self._unsure(node, t_ns, asked, request, Outcome.BROKEN)
        transaction = self._transaction(node, t_ns, asked, Outcome.ABORTED, exception, abort_code)
        return [transaction, *partly, *records]

    def unanswered(self, node: int, t_ns: int, asked: Open, outcome: Outcome) -> Sequence[Record]:
        """LOST or BROKEN: of what was to be written nothing is known."""
        request = asked.request
        if request is None:
            return _NOTHING
        records = self._unsure(node, t_ns, asked, request, outcome)
        if not objects_of(request):
            records.insert(0, self._transaction(node, t_ns, asked, outcome))
        return (*records, *self._not_commanded(node, t_ns, request))

    def _unsure(self, node: int, t_ns: int, asked: Open, request: Request, outcome: Outcome) -> list[Record]:
        """Every object that the request may have read or written, whatever became of it."""
        device = self._device(node)
        addresses, image = [address for address, _ in objects_of(request)], device.received.image
        if image is not None:
            for start, registers in registers_written(request):
                addresses += image.touched(start, len(registers))
        device.unsure(request)
        return [self._transfer(node, t_ns, asked, address, outcome) for address in addresses]

    # -- records -----------------------------------------------------------------------

    def _transfer(
        self, node: int, t_ns: int, asked: Open, address: Address, outcome: Outcome,
        data: bytes | None = None, abort_code: int | None = None,
    ) -> SdoSeen:  # fmt: skip
        request = asked.request
        access = SdoAccess.READ if isinstance(request, ReadObject) else SdoAccess.WRITE
        protocol = Protocol.OBJECT if isinstance(request, ReadObject | WriteObject) else Protocol.REGISTERS
        if isinstance(request, WriteArray):
            protocol = Protocol.FRAMES
        side = Side.SERVER if outcome is Outcome.ABORTED else None
        data = data if outcome is Outcome.DONE else None
        return SdoSeen(
            t_ns, self.bus, node, access, address, outcome, data, abort_code, side, protocol, t_ns - asked.t_ns,
            asked.direction,
        )  # fmt: skip

    def _transaction(
        self, node: int, t_ns: int, asked: Open, outcome: Outcome,
        exception: int | None = None, abort_code: int | None = None,
    ) -> TransactionSeen:  # fmt: skip
        function, dt_ns = asked.message.function, t_ns - asked.t_ns
        return TransactionSeen(
            t_ns, self.bus, node, function, outcome, exception, abort_code, dt_ns, asked.direction
        )  # fmt: skip

    def _commanded(self, node: int, t_ns: int, address: Address, data: bytes, done: bool) -> tuple[Record, ...]:
        if address.major == SAVE_INDEX and data == b"save":
            return (SaveSeen(t_ns, self.bus, node, address, done),)
        if address.major == LOAD_INDEX and data == b"load":
            return (LoadSeen(t_ns, self.bus, node, address, done),)
        return _NOTHING

    def _not_commanded(self, node: int, t_ns: int, request: Request) -> list[Record]:
        if isinstance(request, ReadObject):
            return []
        return [r for a, data in objects_of(request) for r in self._commanded(node, t_ns, a, data, done=False)]
