"""Opens the adapter of a ``CanConfig``."""

from __future__ import annotations

import os
from typing import Final

import can

from app.drivers.can_config import CanConfig, CanInterface
from app.drivers.can_link import CanLink, LinkError, PythonCanLink, SocketcandLink, error_text
from app.drivers.slcan import SlcanLink
from app.drivers.socketcan import SocketcanLink

_SLCAN_SETTLE_S: Final = 0.1
"""python-can waits 2 s for boards that restart when opened; adapters for CAN do not."""
_SLCAN_READ_S: Final = 0.0 if os.name == "posix" else 0.002
"""``select`` waits for the port where it can; elsewhere the port itself has to."""
_LINKS: Final[dict[CanInterface, type[PythonCanLink]]] = {
    CanInterface.SOCKETCAN: SocketcanLink,
    CanInterface.SLCAN: SlcanLink,
}


def open_link(config: CanConfig, timeout_s: float) -> CanLink:
    """Open the adapter. Raises LinkError.

    ``timeout_s`` holds for socketcand; other interfaces take the time that their drivers take.
    """
    if config.search:
        # Going active at a guessed bit rate would stop the whole bus.
        raise LinkError("its bit rate has not been found yet")
    try:
        if config.interface is CanInterface.SOCKETCAND:
            return SocketcandLink(config, timeout_s)
        arguments = config.bus_arguments()
        if config.interface is CanInterface.SLCAN:
            arguments = {"sleep_after_open": _SLCAN_SETTLE_S, "timeout": _SLCAN_READ_S} | arguments
        if config.interface is CanInterface.PCAN and config.listen_only:
            arguments["state"] = can.BusState.PASSIVE
        bus = can.Bus(ignore_config=True, **arguments)
        try:
            return _LINKS.get(config.interface, PythonCanLink)(bus)
        except Exception:
            bus.shutdown()
            raise
    except Exception as error:
        raise LinkError(error_text(error)) from error
