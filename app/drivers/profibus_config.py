"""What ``--profibus`` says: which port, at which rate, and which stations; and how long they take on the wire."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Final, NamedTuple

from app.errors import UsageError
from app.model.slaves import MASTER, RATES
from app.wire.profibus.dp import DataExchange, encode_request
from app.wire.profibus.fdl import MAX_ADDRESS
from app.wire.profibus.pzd import Order
from app.wire.profibus.telegrams import TELEGRAM_TYPES, TelegramType

BITS_PER_BYTE: Final = 11
"""Start, eight of data, parity, stop."""
MAX_CYCLE_S: Final = 0.09
"""The master gives up a Data_Exchange after 100 ms: all stations together have to be done before that."""
DELIVERED_TELEGRAM: Final = 1
"""As the ED2 is delivered (manual, 5.4)."""


class ProfibusStation(NamedTuple):
    """One slave. ``telegram`` None: the type that it is set to.

    ``gsd`` is the device's own file and ``modules`` the names in it that make its configuration, exactly as they stand
    there; without it the slave is asked for its configuration. ``order`` is what the site knows of the order of bytes
    of its process data; it is checked all the same.
    """

    node: int
    telegram: int | None = None
    gsd: Path | None = None
    modules: tuple[str, ...] = ()
    order: Order | None = None


class ProfibusConfig(NamedTuple):
    """A line: its port, bit rate in bit/s, the stations that are spoken to from the start, and our own address."""

    port: str
    baud: int
    stations: tuple[ProfibusStation, ...] = ()
    master: int = MASTER

    def __str__(self) -> str:
        """As ``parse_profibus`` reads it."""
        return f"{self.port}@{self.baud}" + "".join(f",{_text(station)}" for station in self.stations)


def wire_s(size: int, baud: int) -> float:
    """Seconds that ``size`` bytes take at ``baud`` bit/s."""
    return size * BITS_PER_BYTE / baud


def exchange_s(telegram: TelegramType, baud: int) -> float:
    """Seconds on the wire of one Data_Exchange there and back, without the pause between them."""
    both = (telegram.output_size, telegram.input_size)
    return sum(wire_s(len(encode_request(DataExchange(bytes(size)), MASTER, 6).encode()), baud) for size in both)


def require_fits(telegrams: Iterable[TelegramType], baud: int) -> None:
    """Raises UsageError where the stations' telegrams together take too long at ``baud`` bit/s."""
    telegrams = tuple(telegrams)
    cycle_s = sum(exchange_s(telegram, baud) for telegram in telegrams)
    if cycle_s > MAX_CYCLE_S:
        numbers = ", ".join(str(telegram.number) for telegram in telegrams)
        reason = (
            f"telegrams {numbers} take {cycle_s * 1000:.0f} ms at {baud} bit/s, more than {MAX_CYCLE_S * 1000:g} ms"
        )
        raise UsageError(reason=f"{reason}: choose a higher bit rate, or shorter telegrams")


_CONFIG: Final = re.compile(r"(?P<port>[^@,]+)@(?P<baud>[0-9]{4,8})(?P<stations>(,[^,]*)*)")
_STATION: Final = re.compile(r"(?P<node>[0-9]{1,3})(/(?P<telegram>[0-9]{1,3}))?")


def parse_profibus(text: str) -> ProfibusConfig:
    """Read ``PORT@BAUD[,NODE[/TELEGRAM]]…``. Raises UsageError."""
    match = _CONFIG.fullmatch(text.strip())
    if match is None:
        raise _wrong(text, "it is not PORT@BAUD[,NODE[/TELEGRAM]]…")
    stations = tuple(_station(text, part.strip()) for part in match["stations"].split(",")[1:])
    return checked(ProfibusConfig(match["port"], int(match["baud"]), stations))


def checked(config: ProfibusConfig) -> ProfibusConfig:
    """``config`` where it makes sense. Raises UsageError."""
    if config.baud not in RATES:
        rates = ", ".join(map(str, RATES))
        raise _wrong(str(config), f"{config.baud} is no bit rate of PROFIBUS ({rates})")
    nodes = [station.node for station in config.stations]
    if len(set(nodes)) < len(nodes):
        raise _wrong(str(config), "two stations have the same address")
    for station in config.stations:
        require_node(station.node, config.master)
        if station.telegram is not None and station.telegram not in TELEGRAM_TYPES:
            known = ", ".join(map(str, TELEGRAM_TYPES))
            raise _wrong(str(config), f"{station.telegram} is no telegram type ({known})")
    telegrams = [TELEGRAM_TYPES[station.telegram or DELIVERED_TELEGRAM] for station in config.stations]
    require_fits(telegrams, config.baud)
    return config


def require_node(node: int, master: int) -> None:
    """Raises UsageError where ``node`` cannot be the address of a slave."""
    if not 0 <= node <= MAX_ADDRESS:
        raise UsageError(reason=f"address {node} is not within 0 to {MAX_ADDRESS}")
    if node == master:
        raise UsageError(reason=f"{node} is our own address on the line")


def _station(text: str, part: str) -> ProfibusStation:
    match = _STATION.fullmatch(part)
    if match is None:
        raise _wrong(text, f"'{part}' is not NODE[/TELEGRAM]")
    return ProfibusStation(int(match["node"]), None if match["telegram"] is None else int(match["telegram"]))


def _text(station: ProfibusStation) -> str:
    return f"{station.node}" if station.telegram is None else f"{station.node}/{station.telegram}"


def _wrong(text: str, reason: str) -> UsageError:
    return UsageError(reason=f"PROFIBUS connection '{text}': {reason}")
