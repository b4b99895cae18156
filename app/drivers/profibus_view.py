"""What is known of a station at this moment: for the diagnosis of the bus, and for whoever shows its process data."""

from __future__ import annotations

import asyncio
from typing import NamedTuple

from app.drivers.profibus_bus import ProfibusBus
from app.drivers.profibus_device import tell
from app.drivers.profibus_station import Station, StationState
from app.errors import HubsideError
from app.wire.profibus.diagnosis import Diagnosis
from app.wire.profibus.pzd import Order, Values, decode_pzd
from app.wire.profibus.telegrams import TelegramType


class StationView(NamedTuple):
    """One station. ``received`` is what it is sent and ``sent`` what it sends, by signal; outputs and inputs as bytes.

    ``setting`` is the order of bytes by the site, ``order`` the one that is proven. ``received`` and ``sent`` are None
    while there is none: then nobody knows what the bytes tell. ``outputs`` and ``inputs`` are empty while nothing is
    exchanged. ``age_s`` is how long ago ``sent`` was surely of now, None where it never was since the station is there.
    """

    node: int
    state: StationState
    problem: HubsideError | None
    telegram: TelegramType
    diagnosis: Diagnosis | None
    setting: Order | None
    order: Order | None
    received: Values | None
    sent: Values | None
    outputs: bytes
    inputs: bytes
    starts: int
    age_s: float | None


def view_of(station: Station, now_s: float, proven: Order | None = None) -> StationView:
    """What ``station`` shows at ``now_s`` on the clock of its line. On the thread of the bus.

    ``proven``: the order that a check has proven since it is there; it is not in force before process data are filled.
    """
    image, inputs = station.image, station.inputs
    order = image.order or proven
    outputs = image.standing if inputs else b""
    known = order is not None and bool(inputs)
    return StationView(
        station.node, station.state, station.problem, station.telegram, station.diagnosis,
        station.config.order, order,
        decode_pzd(station.telegram.received, outputs, order) if known and order is not None else None,
        decode_pzd(station.telegram.sent, inputs, order) if known and order is not None else None,
        outputs, inputs, station.starts,
        None if station.inputs_s is None else now_s - station.inputs_s,
    )  # fmt: skip


async def look_at(line: ProfibusBus, node: int, proven: Order | None = None) -> StationView | None:
    """Have the thread of the line look between two turns; None where the line is gone."""
    done: asyncio.Future[StationView | None] = asyncio.get_running_loop().create_future()

    def look(bus: ProfibusBus) -> None:
        port = bus.port
        tell(done, None if port is None else view_of(bus.station(node), port.line.now_s(), proven))

    line.post(look)
    return await done
