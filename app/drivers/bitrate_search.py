"""Finds the bit rate of a bus by listening at one rate after the other; nothing is ever sent.

Only with adapters that have a silent mode (ISO 11898-1: bus monitoring mode): any other answers what it hears at a
wrong bit rate with error frames, and destroys the traffic.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final

from app.drivers.can_config import BITRATES_OF, CanConfig
from app.drivers.can_port import CanPort, PortState
from app.errors import BusLostError, BusOpenError, UsageError
from app.wire.frame import Can, Direction, Frame, Stamper

SEARCH_LISTEN_S: Final = 0.6
"""How long is listened at each bit rate for the first frame; a heartbeat of 500 ms is heard once."""
USUAL_RATES: Final = (500_000, 250_000, 125_000, 1_000_000, 800_000, 50_000, 20_000, 10_000)
"""Bit rates of CiA 301, in bit/s, the most frequent ones first."""
_NEEDED: Final = 2
"""Valid frames that prove a bit rate: noise hardly ever passes the CRC once."""
_LONGER: Final = 4
"""After the first frame so many times as long is waited for the second."""
_SETTLE_S: Final = 0.1
"""What an adapter still hands over when it was left open at another bit rate proves nothing."""
_OPEN_TIMEOUT_S: Final = 3.0


async def search_bitrate(
    config: CanConfig,
    listen_s: float = SEARCH_LISTEN_S,
    on_try: Callable[[int], None] | None = None,
    monotonic_ns: Callable[[], int] = time.monotonic_ns,
    on_heard: Callable[[int, int, int], None] | None = None,
) -> int:
    """The first bit rate, in bit/s, at which valid frames come and no error frame.

    ``on_try`` is told each one before it is tried, ``on_heard`` afterwards, with the frames and the error frames heard.

    Raises UsageError where it cannot be searched without disturbing the bus, BusOpenError where the adapter cannot be
    opened or no bit rate fits, BusLostError where the adapter goes meanwhile.
    """
    _require_silent(config)
    name = f"{config.interface.value}:{config.channel}"
    heard: list[str] = []
    for bitrate in rates_to_try(config):
        if on_try is not None:
            on_try(bitrate)
        silent = replace(config, bitrate=bitrate, search=False, listen_only=True)
        try:
            ear = await _listen(CanPort(silent, name, Stamper(time.time_ns(), monotonic_ns)), listen_s)
        except BusOpenError as error:
            if not heard:
                raise
            # The adapter is there: it does not know this bit rate.
            heard.append(f"{bitrate}: {error.details['reason']}")
            continue
        if on_heard is not None:
            on_heard(bitrate, ear.frames, ear.errors)
        if ear.fits:
            return bitrate
        heard.append(f"{bitrate}: {ear}")
    raise BusOpenError(
        bus=name,
        reason=f"no bit rate fits; heard for {listen_s:g} s each, in bit/s: {'; '.join(heard)}. A silent adapter "
        "acknowledges nothing, so two nodes at least must be on the bus, and one of them must send",
    )


def rates_to_try(config: CanConfig) -> tuple[int, ...]:
    """The bit rates that the adapter offers, the usual ones first; where that is not known, the usual ones."""
    offered = BITRATES_OF.get(config.interface)
    if offered is None:
        return USUAL_RATES
    usual = tuple(rate for rate in USUAL_RATES if rate in offered)
    return usual + tuple(sorted(offered.difference(usual), reverse=True))


class Ear:
    """Counts what comes at one bit rate. ``on_frames`` runs on the receive thread, the rest in the loop."""

    def __init__(self) -> None:
        self.frames = 0
        self.errors = 0
        self._loop = asyncio.get_running_loop()
        self._begun = asyncio.Event()
        self._decided = asyncio.Event()

    def __str__(self) -> str:
        """For people."""
        return f"{self.frames} frames, {self.errors} error frames" if self.frames or self.errors else "nothing"

    @property
    def fits(self) -> bool:
        """Whether this is the bit rate of the bus."""
        return self.frames >= _NEEDED and not self.errors

    def on_frames(self, frames: Sequence[Frame]) -> None:
        """Count received frames."""
        for _, _, direction, can, _ in frames:
            if direction is Direction.RX and isinstance(can, Can):
                self.errors += can.error
                self.frames += not can.error
        if self.frames or self.errors:
            self._loop.call_soon_threadsafe(self._begun.set)
        if self.errors or self.frames >= _NEEDED:
            self._loop.call_soon_threadsafe(self._decided.set)

    async def listen(self, listen_s: float) -> None:
        """Until it is decided, or nothing comes for ``listen_s``; after a first frame longer."""
        with suppress(TimeoutError):
            await asyncio.wait_for(self._begun.wait(), listen_s)
            await asyncio.wait_for(self._decided.wait(), _LONGER * listen_s)


async def _listen(port: CanPort, listen_s: float) -> Ear:
    ear = Ear()
    try:
        await asyncio.to_thread(port.open, _OPEN_TIMEOUT_S)
        await asyncio.sleep(_SETTLE_S)
        port.add_listener(ear.on_frames)
        await ear.listen(listen_s)
        status = port.status
        if status.state is not PortState.CONNECTED:
            raise BusLostError(bus=port.bus, reason=status.reason or status.state.value)
        return ear
    finally:
        await asyncio.to_thread(port.close)


def _require_silent(config: CanConfig) -> None:
    name = config.interface.value
    if not config.sets_bitrate:
        why = f"{name} does not set it, so the bus has the one that it is set to"
    elif not config.has_silent_mode:
        why = f"{name} has no silent mode here, and listening at a wrong bit rate would disturb the bus"
    else:
        return
    raise UsageError(reason=f"CAN connection '{config}': the bit rate cannot be searched: {why}; name the bit rate")
