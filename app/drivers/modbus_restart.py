"""Restarting a device that has no boot-up message (PD4-E manual, pages 92 and 188), and knowing that it did.

The proof is its uptime (230Fh): connections may end and come back for other reasons.
"""

from __future__ import annotations

import asyncio
import logging
import time
from typing import Final

from app.drivers.contract import LinkState
from app.drivers.modbus_device import ModbusDevice
from app.errors import DeviceError, NoAnswerError, ProtocolError, UnverifiedError
from app.model.address import Address
from app.model.description import Verify
from app.wire.modbus.device import BOOT, REBOOT, UPTIME

_LOG: Final = logging.getLogger(__name__)
COMMAND: Final = Address(REBOOT, 1)
GOING_S: Final = 1.0
"""So long a device that was told to restart may keep its connection; then we end it."""
ASK_TIMEOUT_S: Final = 0.5
_POLL_S: Final = 0.05


async def restart(device: ModbusDevice, timeout_s: float) -> None:
    """Write "boot" and wait until the device answers with an uptime that began after it.

    A device without an uptime is back when it answers on a new connection. Raises NoAnswerError where it is not back in
    time, SdoAbortError where it refuses.
    """
    try:
        async with asyncio.timeout(timeout_s):
            await _uptime_s(device, timeout_s)  # a device that is not there is not told to restart
            start_s = time.monotonic()
            try:
                await device.write(COMMAND, BOOT, ASK_TIMEOUT_S, verify=Verify.ACK)
            except (NoAnswerError, UnverifiedError) as error:
                _LOG.info("%s did not acknowledge its restart: %s", device.peer.server, error)
            await _gone(device)
            await _back(device, start_s)
    except TimeoutError:
        what = f"restart of {device.peer.server}"
        raise NoAnswerError(node=device.peer.node, address=what, timeout_s=timeout_s) from None


async def _gone(device: ModbusDevice) -> None:
    """A connection does not outlive the restart, whether or not the device closes it."""
    try:
        await device.wait_for(LinkState.LOST, GOING_S)
    except TimeoutError:
        if device.state is LinkState.CONNECTED:
            await device.renew()


async def _back(device: ModbusDevice, start_s: float) -> None:
    while True:
        await device.wait_for(LinkState.CONNECTED)
        try:
            uptime_s = await _uptime_s(device, ASK_TIMEOUT_S)
            if uptime_s is None or uptime_s <= time.monotonic() - start_s + 1:
                return
        except (NoAnswerError, ProtocolError) as error:
            _LOG.debug("not back yet: %s", error)
        await asyncio.sleep(_POLL_S)


async def _uptime_s(device: ModbusDevice, timeout_s: float) -> int | None:
    """Seconds since the start; None where the device does not count them."""
    try:
        return int.from_bytes(await device.read(UPTIME, timeout_s), "little")
    except DeviceError:
        return None
