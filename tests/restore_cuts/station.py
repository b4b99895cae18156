"""One blade's twins on a served line: what stands in them is looked at here, never asked for over the bus."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

from app.model.address import Address
from app.model.datatypes import Raw, decode_raw
from app.model.description_file import load_builtin
from app.model.station import Place
from app.twins.canopen_device import CanopenDevice, Power
from app.twins.line import CanLine
from app.twins.line_thread import LineThread
from app.twins.object_store import initial
from app.twins.safety_chain import SafetyChain
from app.twins.socketcand_server import SocketcandServer
from app.twins.state_file import Memory, StateFile
from app.twins.turbine import Blade, Settings
from tests.drivers.wire import until

T = TypeVar("T")
MS: Final = 1_000_000
TURBINE: Final = "wtg-07"
STATION: Final = f"{TURBINE}/blade-1"
PMM: Final = f"{STATION}/pmm"
PMC: Final = f"{STATION}/pmc"
NODES: Final = {PMM: 1, PMC: 11}
_CONTROLWORD: Final = 0x6040
_MODE: Final = 0x6060
_REMOTE: Final = 1 << 9
_ENABLED: Final = 1 << 2
"""Statusword (manual table 54): the controlword counts; operation is enabled."""
SITE: Final = """schema = 1
[turbine.wtg-07]
name = "WTG-07"
[turbine.wtg-07.bus.can0]
connection = "{address}"
bitrate = 1000000
[turbine.wtg-07.station.blade-1]
blade = 1
device.pmm = {{ description = "oat-pmm", node = 1 }}
device.pmc = {{ description = "oat-pmc", node = 11 }}
"""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All that a station's devices hold: RAM and non-volatile memory, by slug."""

    ram: Mapping[str, Mapping[Address, Raw]]
    memory: Mapping[str, Memory]


class Station:
    """Twins of one blade, in feather where nothing else is said, quick to boot and to save.

    A context manager; methods are for any thread.
    """

    def __init__(self, state: Path, angle_deg: float = 90.0) -> None:
        self.line = CanLine(1_000_000)
        settings = Settings(
            state_dir=state, turnaround_ns=MS // 20, boot_ns=10 * MS, save_ns=4 * MS, angle_deg=angle_deg
        )
        state.mkdir(parents=True, exist_ok=True)
        self._state = state
        self.blade = Blade(self.line, 1, load_builtin("oat-pmm"), load_builtin("oat-pmc"), settings)
        self._chain = SafetyChain(self.line, (self.blade,))
        self.blade.power_on(self.line.now_ns)
        self._chain.start(self.line.now_ns)
        self.thread = LineThread(self.line)
        self.server = SocketcandServer(self.thread)

    def __enter__(self) -> Station:
        self.thread.start()
        self.server.start()
        return self

    def __exit__(self, *_exc: object) -> None:
        self.server.stop()
        self.thread.stop()
        assert self.thread.handler_errors == 0

    @property
    def site(self) -> str:
        """Text of its site file."""
        return SITE.format(address=f"socketcand:127.0.0.1:{self.server.port}")

    @property
    def devices(self) -> dict[str, CanopenDevice]:
        """By slug."""
        return dict(zip((PMM, PMC), self.blade.devices, strict=True))

    # -- looking into them ---------------------------------------------------------------

    def do(self, work: Callable[[], T], timeout_s: float = 5.0) -> T:
        """``work`` done on the line's thread."""
        done: Future[T] = Future()

        def run() -> None:
            try:
                done.set_result(work())
            except BaseException as error:  # noqa: BLE001 - it is raised where it is waited for
                done.set_exception(error)

        self.thread.call_soon(run)
        return done.result(timeout_s)

    def ram(self, places: Iterable[Place]) -> dict[Place, Raw]:
        """What stands in RAM."""
        return self.do(lambda: {place: self.devices[place.slug].store.at(place.address).now for place in places})

    def memory(self, places: Iterable[Place]) -> dict[Place, Raw]:
        """What the files of the non-volatile memories hold; what is not in them starts with its default."""
        files = {slug: self._file(slug).load().memory or Memory() for slug in NODES}
        found = {}
        for place in places:
            entry = self.devices[place.slug].description.entries[place.address]
            data = files[place.slug].saved.get(place.address)
            found[place] = initial(entry, NODES[place.slug]) if data is None else decode_raw(entry.type, data)
        return found

    def _file(self, slug: str) -> StateFile:
        device = self.devices[slug]
        return StateFile(self._state / f"{device.description.id}-node-{device.node_id:03}.json", device.description.id)

    # -- what happens to them -------------------------------------------------------------

    def cut_power(self) -> None:
        """Both units lose their supply at this instant. On the line's thread."""
        for device in self.devices.values():
            device.cut_power()

    def supply(self) -> None:
        """The supply is back, where it was gone. On the line's thread."""
        for device in self.devices.values():
            if device.power is Power.OFF:
                device.power_on(self.line.now_ns)

    def pull_cable(self) -> None:
        """Every client loses its connection; it may connect again at once. On the line's thread."""
        for client in tuple(self.server._clients):
            client.close("cut")

    def settled(self) -> bool:
        """True where both have booted, the safety chain is closed again, and the axis stands without current."""
        status = self.blade.pmc.device.store.number(0x6041)
        booted = all(device.power is Power.ON for device in self.devices.values())
        return booted and bool(status & _REMOTE) and not status & _ENABLED

    def settle(self, timeout_s: float = 10.0) -> None:
        """Wait for that."""
        until(lambda: self.do(self.settled), timeout_s)

    def snapshot(self) -> Snapshot:
        """Take down what they hold."""

        def take() -> Snapshot:
            ram = {slug: {cell.entry.address: cell.raw for cell in one.store} for slug, one in self.devices.items()}
            kept = {slug: one.memory.memory for slug, one in self.devices.items()}
            return Snapshot(ram, {slug: Memory(dict(one.saved), dict(one.remanent)) for slug, one in kept.items()})

        return self.do(take)

    def put_back(self, snapshot: Snapshot) -> None:
        """Have them hold what was taken down."""

        def put() -> None:
            for slug, device in self.devices.items():
                for cell in device.store:
                    cell.raw = snapshot.ram[slug][cell.entry.address]
                device.memory._write(snapshot.memory[slug])
            for index in (_MODE, _CONTROLWORD):  # the axis is told, as by a write
                cell = self.devices[PMC].store.cell(index)
                assert cell.effect is not None
                cell.effect(cell.raw)

        self.do(put)
