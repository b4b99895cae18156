"""What a site says of a PROFIBUS-DP line and of each of its slaves."""

from __future__ import annotations

from itertools import product
from typing import Final, NamedTuple

PROFIBUS: Final = "profibus:"
"""How the connection of such a line begins; the serial port follows."""
RATES: Final = (9600, 19200, 45450, 93750, 187500, 500000, 1500000, 3000000, 6000000, 12000000)
"""Bit rates that the ED2 finds by itself (manual, 2.3)."""
RATE: Final = 500_000
MASTER: Final = 2
"""Our own address where nothing else is said."""
MAX_SLAVE: Final = 126
"""127 is everybody."""
TELEGRAMS: Final = (1, 2, 100, 101, 102, 103)
"""Types of telegrams of the ED2 (manual, 5.4)."""
ORDERS: Final = tuple("-".join(ends) for ends in product(("low", "high"), repeat=2))
"""Which byte of a word, and which word of a double word, comes first in the process data."""


class SlaveSetup(NamedTuple):
    """What is known of a slave beside its address.

    ``telegram`` is its type, None: the one that it is set to. ``pzd_order`` is one of ``ORDERS``, or empty where nobody
    knows; it is proven before a controlword is sent all the same. ``gsd`` is the path of the device's own GSD file and
    ``modules`` the names in it that make its configuration; without it the slave is asked for its configuration.
    """

    telegram: int | None = None
    pzd_order: str = ""
    gsd: str = ""
    modules: tuple[str, ...] = ()


UNKNOWN: Final = SlaveSetup()


def port_of(connection: str) -> str:
    """The serial port of a line. Raises ValueError with the reason."""
    port = connection.removeprefix(PROFIBUS)
    if not port.strip():
        raise ValueError(f"names no serial port: {PROFIBUS}/dev/ttyUSB0")
    if "@" in port or "," in port:
        raise ValueError(f"is {PROFIBUS}PORT; the bit rate is a key of its own")
    return port


def check_setup(setup: SlaveSetup) -> tuple[str, str] | None:
    """The first key of ``setup`` that makes no sense, and why; None where all is well."""
    if setup.telegram is not None and setup.telegram not in TELEGRAMS:
        return "telegram", f"is {setup.telegram}; there are {', '.join(map(str, TELEGRAMS))}"
    if setup.pzd_order and setup.pzd_order not in ORDERS:
        return "pzd_order", f"is '{setup.pzd_order}'; there are {', '.join(ORDERS)}"
    if bool(setup.gsd) != bool(setup.modules):
        return ("modules" if setup.gsd else "gsd"), "is missing: a GSD file and the names of its modules go together"
    return None
