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
    """One station. ``received`` is what it is sent and ``sent`` what it sends, by signal.

    Both are None while the order of their bytes is not proven: then nobody knows what they tell. ``age_s`` is how long
    ago ``sent`` was surely of now, None where it never was since the station is there.
    """

    node: int
    state: StationState
    problem: HubsideError | None
    telegram: TelegramType
    diagnosis: Diagnosis | None
    order: Order | None
    received: Values | None
    sent: Values | None
    age_s: float | None


def view_of(station: Station, now_s: float) -> StationView:
    """What ``station`` shows at ``now_s`` on the clock of its line. On the thread of the bus."""
    image, order = station.image, station.image.order
    known = order is not None and bool(station.inputs)
    return StationView(
        station.node, station.state, station.problem, station.telegram, station.diagnosis, order,
        dict(image.values) if known else None,
        decode_pzd(station.telegram.sent, station.inputs, order) if known and order is not None else None,
        None if station.inputs_s is None else now_s - station.inputs_s,
    )  # fmt: skip


async def look_at(line: ProfibusBus, node: int) -> StationView | None:
    """Have the thread of the line look between two turns; None where the line is gone."""
    done: asyncio.Future[StationView | None] = asyncio.get_running_loop().create_future()

    def look(bus: ProfibusBus) -> None:
        port = bus.port
        tell(done, None if port is None else view_of(bus.station(node), port.line.now_s()))

    line.post(look)
    return await done
