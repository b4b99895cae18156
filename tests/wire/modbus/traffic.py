"""Traffic of Modbus clients with one device, as frames."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from app.model.address import Address
from app.wire.frame import Adu, Direction, Frame
from app.wire.modbus.adu import Message
from app.wire.modbus.answers import Answer, FramesRead
from app.wire.modbus.frames import ObjectFrame
from app.wire.modbus.functions import Phase
from app.wire.modbus.requests import ReadDictionary, Request

BUS: Final = "modbus0"
SERVER: Final = "10.0.0.5:502"
NODE: Final = 5
US: Final = "10.0.0.1:40000"
OTHER: Final = "10.0.0.9:41000"
MS: Final = 1_000_000

RX_ENTRIES: Final = (0x60400010, 0x00050008, 0x60600008, 0x607A0020)
TX_ENTRIES: Final = (0x60410010, 0x00050008, 0x60610008, 0x60640020, 0x60440010)


class Client:
    """One client; its frames come ``MS`` after each other, beginning at ``clock``."""

    def __init__(self, name: str = US, ours: bool = True) -> None:
        self.name = name
        self.ours = ours
        self.t_ns = 0
        self.transaction = 0

    def at(self, t_ns: int) -> Client:
        """Go on at this time."""
        self.t_ns = t_ns
        return self

    def ask(self, request: Request | bytes, transaction: int | None = None, unit: int = 0) -> Frame:
        """A request; with a new transaction unless one is given."""
        self.transaction = self.transaction + 1 if transaction is None else transaction
        return self._frame(request, f"{self.name}>{SERVER}", Direction.TX if self.ours else Direction.RX, unit)

    def answer(self, answer: Answer | bytes, transaction: int | None = None, unit: int = 0) -> Frame:
        """An answer; to the latest request unless a transaction is given."""
        self.transaction = self.transaction if transaction is None else transaction
        return self._frame(answer, f"{SERVER}>{self.name}", Direction.RX, unit)

    def exchange(self, request: Request, answer: Answer) -> list[Frame]:
        return [self.ask(request), self.answer(answer)]

    def dictionary(self, *batches: tuple[ObjectFrame, ...]) -> Iterator[Frame]:
        """FC 101, as many answers as batches; the refusal at its end is left out."""
        for number, batch in enumerate(batches):
            phase = Phase.CONTINUE if number else Phase.START
            yield from self.exchange(ReadDictionary(phase), FramesRead(phase, batch))

    def _frame(self, message: Request | Answer | bytes, link: str, direction: Direction, unit: int) -> Frame:
        self.t_ns += MS
        pdu = message if isinstance(message, bytes) else message.pdu()
        adu = Message(self.transaction, unit, pdu).encode()
        return Frame(self.t_ns, BUS, direction, Adu(adu, link))


def mapping_frames(index: int, entries: tuple[int, ...]) -> tuple[ObjectFrame, ...]:
    """A mapping object as FC 101 gives it."""
    count = ObjectFrame(Address(index, 0), bytes((len(entries),)))
    return (
        count,
        *(ObjectFrame(Address(index, sub), raw.to_bytes(4, "little")) for sub, raw in enumerate(entries, 1)),
    )
