"""A bench with the twin of a hydraulic axis on PROFIBUS, on a pseudo-terminal and in the time that the wire takes."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path

from app.model.site import read_site
from app.service.connection import Connection
from app.service.options import Options
from app.twins.ed2.device import Settings
from app.twins.ed2.states import State
from tests.drivers.profibus_rig import ED2, LISTEN_S, Wire, wire

AXIS = "bench-ed2/bench/cylinders"
SITE = """schema = 1
[turbine.bench-ed2]
[turbine.bench-ed2.bus.dp0]
connection = "profibus:{port}"
bitrate = {baud}
[turbine.bench-ed2.station.bench.device]
cylinders = {{ description = "wandfluh-ed2", node = 6{more} }}
"""
ORDER = ', pzd_order = "high-high"'


class Cylinders:
    """What the twin itself knows: nothing of it goes over the bus."""

    def __init__(self, wired: Wire) -> None:
        self.wired = wired

    def ask(self, what: Callable[[], object]) -> object:
        """Ask on the twin's own thread."""
        found: list[object] = []
        self.wired.do(lambda: found.append(what()))
        return found[0]

    @property
    def state(self) -> State:
        """Of axis 1."""
        return self.wired.device.kernel.axes[0].state

    @property
    def places_mm(self) -> tuple[float, float]:
        """Where both cylinders are."""
        first, second = self.wired.device.kernel.axes
        return first.cylinder.position_mm, second.cylinder.position_mm

    @property
    def speed_mm_s(self) -> float:
        """Of the faster one."""
        return max(abs(axis.cylinder.velocity_mm_s) for axis in self.wired.device.kernel.axes)

    def number(self, ind: int, pnu: int) -> int:
        """What a parameter of axis 1 holds."""
        return self.wired.device.channels[0].number(ind, pnu)


@contextmanager
def cylinders(settings: Settings | None = None) -> Iterator[Cylinders]:
    """A twin in real time that has booted."""
    with wire(500_000, settings) as wired:
        yield Cylinders(wired)


@asynccontextmanager
async def ed2_connection(one: Cylinders, folder: Path, more: str = ORDER) -> AsyncIterator[Connection]:
    """Connected to it, recording."""
    text = SITE.format(port=one.wired.line.path, baud=one.wired.baud, more=more)
    (turbine,) = read_site(text, "site.toml")
    options = Options("tester", folder, listen_s=LISTEN_S)
    async with Connection(turbine, {"wandfluh-ed2": ED2}, options) as connection:
        yield connection
