"""The whole dictionary of a device by FC 101: so many objects in a message as fit, twenty times as fast as one by one.

The connection is held to the end: whether a device keeps its place while others ask is not known. It is begun anew at
55h after a time-out, and after an urgent request went in between. Indices must rise: a frame that goes back, or stands
still, shows that messages are lost or that two sweeps have mixed. Only "no data available" (08000024h) ends it; that
this is the end is what sibling manuals of the maker say, the PD4-E's own just says "an error". Any other one fails.
As nothing else says that it was all, an object that is described behind the last one is asked for: if the device gives
it, the sweep has ended early.
"""

from __future__ import annotations

from typing import Final

from app.drivers.modbus_device import DEFAULT_TIMEOUT_S, ModbusDevice
from app.drivers.modbus_link import InterruptedRequest, ModbusLink
from app.errors import BusLostError, DeviceError, NoAnswerError, ProtocolError
from app.model.address import Address
from app.wire.modbus.answers import AbortAnswer, FramesRead
from app.wire.modbus.functions import Phase
from app.wire.modbus.requests import ReadDictionary
from app.wire.sdo import Abort

MAX_TIMEOUTS: Final = 3
"""After so many it fails; urgent requests may interrupt it as often as they come."""
WHAT: Final = "dictionary"


async def read_dictionary(device: ModbusDevice, timeout_s: float = DEFAULT_TIMEOUT_S) -> dict[Address, bytes]:
    """Every object that the device gives, in its order; ``timeout_s`` is for each message.

    Raises SdoAbortError, ModbusExceptionError, NoAnswerError, BusLostError, ProtocolError (indices do not rise, or the
    device has an object behind the last one; then the details have ``ended_early``).
    """
    timeouts = 0
    while True:
        link = device.link
        try:
            async with link.turn():
                return await _sweep(device, link, timeout_s)
        except InterruptedRequest:
            continue
        except BusLostError:
            raise
        except NoAnswerError:
            timeouts += 1
            if timeouts == MAX_TIMEOUTS:
                raise


async def _sweep(device: ModbusDevice, link: ModbusLink, timeout_s: float) -> dict[Address, bytes]:
    """One sweep from the begin. Raises InterruptedRequest where somebody urgent wants the connection."""
    found: dict[Address, bytes] = {}
    phase, last = Phase.START, (-1, -1)
    while True:
        if link.wanted_urgently:
            raise InterruptedRequest
        answer = await link.finish(link.send(ReadDictionary(phase)), timeout_s, what=WHAT)
        if not isinstance(answer, FramesRead):
            if phase is Phase.CONTINUE and isinstance(answer, AbortAnswer) and answer.abort_code == Abort.NO_DATA:
                await _require_end(device, link, last)
                return found
            raise device.refusal(answer, WHAT)
        for address, data in answer.frames:
            place = (address.major, address.minor)
            if place <= last:
                raise _out_of_order(device, f"{address} comes after {last[0]:04X}:{last[1]:02X}")
            last = place
            found[address] = data
        if not answer.frames:
            raise _out_of_order(device, "a message without an object does not end it")
        phase = Phase.CONTINUE


async def _require_end(device: ModbusDevice, link: ModbusLink, last: tuple[int, int]) -> None:
    """Of what is described behind the last object, the first and the last are asked for; the device has neither."""
    entries = () if device.description is None else device.description.entries.values()
    behind = [one.address for one in entries if one.access.readable and (one.address.major, one.address.minor) > last]
    for address in dict.fromkeys((*behind[:1], *behind[-1:])):
        try:
            await device.read(address, held=link)
        except DeviceError:
            continue  # it has none, or nothing to tell
        error = _out_of_order(device, f"ended early, behind {last[0]:04X}:{last[1]:02X}: the device has {address}")
        error.details["ended_early"] = True
        raise error


def _out_of_order(device: ModbusDevice, reason: str) -> ProtocolError:
    return ProtocolError(bus=device.peer.server, node=device.peer.node, reason=f"FC 101: {reason}")
