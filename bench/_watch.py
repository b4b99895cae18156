"""Another client of the bus, which sees when STOP or FEATHER went to the last axis."""

from __future__ import annotations

import asyncio
import time
from typing import Final

from app.drivers.canopen import CanOpenDriver
from app.model.address import Address
from app.model.axis_state import AxisState
from app.model.description import Verify
from app.service.stop import CONTROLWORD, STATUSWORD, Command
from app.wire.frame import Can, Frame
from app.wire.nmt import NmtCommand

AXES: Final = (11, 12, 13)
REST_S: Final = 20.0
LOOK_S: Final = 0.05
_AT_REST: Final = (AxisState.SWITCH_ON_DISABLED, AxisState.READY, AxisState.SWITCHED_ON)
_ENABLE: Final = (
    (CONTROLWORD, b"\x06\x00"),  # first: the mode is not changed while bit 3 is set, as it is after STOP
    (Address(0x6060), b"\x03"),
    (Address(0x60FF), bytes(4)),
    (CONTROLWORD, b"\x07\x00"),
    (CONTROLWORD, b"\x0f\x00"),
)
_RPDO1: Final = 0x200
_SDO: Final = 0x600


class Watch:
    """When a controlword went to each axis, by PDO or SDO. ``expect`` begins anew."""

    def __init__(self, driver: CanOpenDriver) -> None:
        self._driver = driver
        self._wanted = word_of(Command.STOP)
        self._seen: dict[int, float] = {}
        self._all = asyncio.Event()
        self._loop = asyncio.get_running_loop()

    def hear(self, frames: list[Frame]) -> None:
        """Called on the receive thread."""
        now_s = time.monotonic()
        for frame in frames:
            can = frame.payload
            if isinstance(can, Can) and (node := _commanded(can, self._wanted)) is not None:
                self._loop.call_soon_threadsafe(self._note, node, now_s)

    def _note(self, node: int, now_s: float) -> None:
        self._seen.setdefault(node, now_s)
        if len(self._seen) == len(AXES):
            self._all.set()

    async def last(self, timeout_s: float) -> float:
        """When the last axis was told, by the monotonic clock."""
        async with asyncio.timeout(timeout_s):
            await self._all.wait()
        return max(self._seen.values())

    def start(self, nodes: tuple[int, ...]) -> None:
        """Have them operational, so that their RPDO is in force."""
        for node in nodes:
            self._driver.nmt(NmtCommand.START, node)

    async def enable(self) -> None:
        """Give an axis that has come to rest power, as another tool would: nothing moves, but it could."""
        end_s = time.monotonic() + REST_S
        while (state := await self._state()) not in _AT_REST:
            if time.monotonic() > end_s:
                raise RuntimeError(f"node {AXES[0]} does not come to rest: {state}")
            await asyncio.sleep(LOOK_S)
        for address, data in _ENABLE:
            await self._driver.write(AXES[0], address, data, verify=Verify.ACK)

    async def _state(self) -> AxisState | None:
        return AxisState.of(int.from_bytes(await self._driver.read(AXES[0], STATUSWORD), "little"))

    def expect(self, command: Command) -> None:
        """Begin anew: what counts from now on is this command."""
        self._wanted = word_of(command)
        self._seen.clear()
        self._all.clear()


def word_of(command: Command) -> bytes:
    """The controlword on the wire."""
    return command.value.to_bytes(2, "little")


def _commanded(can: Can, wanted: bytes) -> int | None:
    for node in AXES:
        if can.can_id == _RPDO1 + node and can.data[:2] == wanted:
            return node
        if can.can_id == _SDO + node and can.data[1:4] == b"\x40\x60\x00" and can.data[4:6] == wanted:
            return node
    return None
