"""What the tests of the Modbus driver share: a twin in real time, and a small device that can be made to misbehave."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from datetime import datetime, timedelta, timezone

from app.drivers.contract import LinkState
from app.drivers.modbus import ModbusDriver
from app.drivers.modbus_config import ModbusConfig, ModbusPeer
from app.model.address import Address
from app.twins.paced_thread import PacedThread
from app.twins.pd4e.device import BOOT_NS, Pd4e, Settings
from app.twins.pd4e.server import Pd4eServer
from app.wire.modbus.adu import Message
from app.wire.modbus.image import WordOrder
from app.wire.modbus.requests import decode_request
from tests.drivers.modbus_server import PD4E, Dictionary, Server, reply, serving
from tests.drivers.wire import stamper

CONTROLWORD, STATUSWORD, MODE = Address(0x6040), Address(0x6041), Address(0x6060)
UPTIME, WINDOW = Address(0x230F), Address(0x6065)
TARGET, POSITION = Address(0x607A), Address(0x6064)
ERROR_HISTORY = 0x1003
READY_TO_SWITCH_ON = 0x0231
PATIENCE_S = 10.0
FOUR = (4).to_bytes(4, "little")
STOP, GO = (2).to_bytes(2, "little"), (15).to_bytes(2, "little")
MOMENT = datetime(2026, 11, 23, 10, 30, 15, 250_000, timezone(timedelta(hours=1)))
SAVE_TUNING = Address(0x1010, 6)
VALUES = {CONTROLWORD: b"\x06\0", MODE: b"\1", TARGET: (0x00020001).to_bytes(4, "little")}


@contextmanager
def twin(variant: str = "pd4-e591") -> Iterator[ModbusPeer]:
    """A twin in real time, that has booted."""
    device = Pd4e(PD4E, Settings(variant=variant))
    device.run_until(BOOT_NS)
    thread = PacedThread(device, time.monotonic_ns)
    with thread, Pd4eServer(thread, device, port=0) as server:
        yield ModbusPeer(1, "127.0.0.1", server.port)
    assert thread.handler_errors == 0


@asynccontextmanager
async def connected(*peers: ModbusPeer, now: datetime | None = None) -> AsyncIterator[ModbusDriver]:
    config = ModbusConfig(peers)
    if now is None:
        driver = ModbusDriver(config, stamper(), descriptions=(PD4E,))
    else:
        driver = ModbusDriver(config, stamper(), descriptions=(PD4E,), now=lambda: now)
    await driver.connect()
    try:
        yield driver
    finally:
        await driver.close()


async def turns_of_the_loop() -> None:
    """Let everything happen that needs no answer."""
    for _ in range(20):
        await asyncio.sleep(0)


async def no_answer(message: Message, writer: asyncio.StreamWriter) -> None:
    """A device that takes everything and says nothing."""


class Bad:
    """A dictionary whose answers can be held back or changed: ``instead`` gives the bytes to send, None for its own."""

    def __init__(self, dictionary: Dictionary | None = None) -> None:
        self.dictionary = dictionary or Dictionary(values={STATUSWORD: READY_TO_SWITCH_ON})
        self.seen: list[object] = []

    async def __call__(self, message: Message, writer: asyncio.StreamWriter) -> None:
        request = decode_request(message.pdu)
        self.seen.append(request)
        data = await self.instead(message, request)
        writer.write(reply(message, self.dictionary.answer(message)) if data is None else data)

    async def instead(self, message: Message, request: object) -> bytes | None:
        return None

    def count(self, kind: type) -> int:
        return sum(isinstance(request, kind) for request in self.seen)


@asynccontextmanager
async def small(bad: Bad, now: datetime | None = None) -> AsyncIterator[tuple[ModbusDriver, Server]]:
    async with serving(bad) as server, connected(server.peer, now=now) as driver:
        yield driver, server


async def becomes(driver: ModbusDriver, state: LinkState) -> LinkState:
    """Wait for the state of device 1; returns the driver's."""
    await driver._device(1).wait_for(state, PATIENCE_S)
    return driver.status.state


def mapped(order: WordOrder = WordOrder.HIGH_FIRST, position: int = 0x00010203) -> Bad:
    """Controlword, dummy, mode, target; statusword, dummy, mode, position: another mapping than the default one."""
    values = {STATUSWORD: READY_TO_SWITCH_ON, POSITION: position, Address(0x3502, 0): 4, Address(0x3602, 0): 4}
    received = (0x60400010, 0x00050008, 0x60600008, 0x607A0020)
    sent = (0x60410010, 0x00050008, 0x60610008, 0x60640020)
    entries = {Address(0x3502, sub): raw for sub, raw in enumerate(received, 1)}
    entries |= {Address(0x3602, sub): raw for sub, raw in enumerate(sent, 1)}
    return Bad(Dictionary(values={**values, **entries}, order=order))
