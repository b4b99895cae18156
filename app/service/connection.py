"""A connected turbine: its buses, the live state that their frames make, the journal and the recording."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from threading import Lock
from typing import Any, Final

from app.drivers.contract import DriverStatus, LinkState, MasterSign
from app.errors import RecordingError, UsageError
from app.model.description import Bus, Description
from app.model.site import Device, Turbine
from app.recording.content import RecorderClock
from app.recording.writer import RecorderStatus
from app.service.bus_link import BusLink
from app.service.devices import Target
from app.service.gate import Blocks, Gate
from app.service.journal import Journal, Kind
from app.service.office.foreign_writes import ForeignWrites
from app.service.options import Options
from app.service.recording import Recording, Subject
from app.service.stop import Axis, is_axis, machine_of
from app.wire.frame import Stamper
from app.wire.live import LiveState

TICK_S: Final = 0.1


class Connection:
    """From ``open`` to ``close``. Use cases take a driver and a target from here; screens read ``live``.

    ``descriptions`` by id must hold every description that the turbine's devices name. ``stamper`` and ``journal`` are
    those of the bench where connections follow one another: then time and journal go on. ``gate.blocks``
    are the restores that are not finished.
    """

    def __init__(
        self,
        turbine: Turbine,
        descriptions: Mapping[str, Description],
        options: Options,
        wall_ns: Callable[[], int] = time.time_ns,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
        stamper: Stamper | None = None,
        journal: Journal | None = None,
    ) -> None:
        self.turbine = turbine
        self.gate = Gate({bus.name: bus.connection for bus in turbine.buses}, Blocks())
        self.live = LiveState()
        self.stamper = stamper or Stamper(wall_ns(), monotonic_ns)
        self.journal = journal or Journal(self.stamper, options.person)
        self._options = options
        self._clock = RecorderClock(monotonic_ns, wall_ns, self.stamper)
        self._targets = {device.slug: self._target(device, descriptions) for device in turbine.devices}
        self._lock = Lock()
        known = tuple(descriptions.values())
        self.buses = {
            bus.name: BusLink(
                bus,
                turbine,
                self._by_node(bus.name),
                tuple(one for one in known if one.bus is bus.kind),
                self.live,
                self._lock,
                self.stamper,
                options,
            )
            for bus in turbine.buses
        }
        self.foreign = ForeignWrites(self._targets.values(), self.journal)
        for link in self.buses.values():
            link.foreign = self.foreign
        self.recording: Recording | None = None
        self._states: dict[str, DriverStatus] = {}
        self._masters: set[tuple[str, MasterSign]] = set()
        self._watcher: asyncio.Task[None] | None = None

    # -- the link -------------------------------------------------------------

    async def open(self, timeout_s: float = 5.0) -> None:
        """Start recording, then open every bus and listen. Raises BusOpenError; then nothing is left open."""
        try:
            if self._options.recordings is not None:
                folder, closed = self._options.recordings, self._options.part_closed
                self.recording = Recording(folder, self._subject(), self.journal, self._clock, closed)
                for link in self.buses.values():
                    link.sink = self.recording.recorder
            await asyncio.gather(*(link.driver.connect(timeout_s) for link in self.buses.values()))
        except BaseException:
            await self.close()
            raise
        self._watch(self.stamper())
        self._watcher = asyncio.create_task(self._watch_forever())

    async def close(self) -> None:
        """Close every bus, then the recording."""
        if self._watcher is not None:
            self._watcher.cancel()
            await asyncio.gather(self._watcher, return_exceptions=True)
            self._watcher = None
        await asyncio.gather(*(link.driver.close() for link in self.buses.values()))
        self.foreign.flush()
        if self.recording is not None:
            await asyncio.to_thread(self.recording.stop)

    async def __aenter__(self) -> Connection:
        await self.open()
        return self

    async def __aexit__(self, *_exc: object) -> None:
        await self.close()

    @property
    def recorded(self) -> RecorderStatus:
        """What the recorder has done. Raises RecordingError where nothing was to be recorded."""
        if self.recording is None:
            raise RecordingError(file="", offset=0, reason="nothing is recorded")
        return self.recording.status()

    def recorded_files(self) -> Sequence[Path]:
        """The files of the running recording, oldest first."""
        file = None if self.recording is None else self.recording.status().file
        if file is None:
            return []
        series = file.name.rsplit("-", 1)[0]
        return sorted(file.parent.glob(f"{series}-[0-9][0-9][0-9].mcap"))

    # -- devices ----------------------------------------------------------------

    def target(self, slug: str) -> Target:
        """The device with this slug. Raises UsageError."""
        found = self._targets.get(slug)
        if found is None:
            raise UsageError(reason=f"no device '{slug}'")
        return found

    @property
    def targets(self) -> Iterable[Target]:
        """All devices, station by station."""
        return self._targets.values()

    def driver(self, target: Target) -> Any:
        """The driver of the device's bus."""
        return self.buses[target.device.bus].driver

    def axes(self) -> list[Axis]:
        """Every axis, and how its controlword is reached."""
        return [self._axis(target) for target in self._targets.values() if is_axis(target)]

    def _axis(self, target: Target) -> Axis:
        link = self.buses[target.device.bus]
        controlword = machine_of(target).controlword
        return Axis(link.driver, target, lambda data: link.send_pdo(target.node, controlword, data))

    def _target(self, device: Device, descriptions: Mapping[str, Description]) -> Target:
        description = descriptions.get(device.description_id)
        if description is None:
            raise UsageError(reason=f"{device.slug}: no description '{device.description_id}'")
        bus = next(one for one in self.turbine.buses if one.name == device.bus)
        if description.bus is not bus.kind:
            raise UsageError(reason=f"{device.slug}: {description.id} is no device of a bus with {bus.kind.value}")
        return Target(device, description, self.live, self.gate)

    def _by_node(self, bus: str) -> dict[int, Description]:
        return {t.node: t.description for t in self._targets.values() if t.device.bus == bus}

    # -- watching -----------------------------------------------------------------

    async def _watch_forever(self) -> None:
        while True:
            now_ns = self.stamper()
            self._watch(now_ns)
            with self._lock:
                self.live.tick(now_ns)
            self.foreign.tick(now_ns)
            if self.recording is not None:
                self.recording.watch(self.keyframe)
            await asyncio.sleep(TICK_S)

    def keyframe(self) -> tuple[int, dict[str, Any]]:
        """All that a reader needs to go on from a time: live state and what the decoders know of open transfers."""
        with self._lock:
            return self.live.t_ns, {
                "live": self.live.snapshot(),
                "decoders": {name: link.decoder.snapshot() for name, link in self.buses.items()},
            }

    def _subject(self) -> Subject:
        return Subject(
            turbine=self.turbine.slug,
            person=self._options.person,
            bit_rates={name: link.bitrate for name, link in self.buses.items() if link.bitrate},
            servers={
                f"{bus.name}/{node}": server.text
                for bus in self.turbine.buses
                for node, server in self.turbine.servers(bus.name).items()
            },
            orders={f"{d.bus}/{d.node}": d.slave.pzd_order for d in self.turbine.devices if d.slave.pzd_order},
            protocols={bus.name: bus.kind.value for bus in self.turbine.buses if bus.kind is Bus.PROFIBUS_DP},
            nodes={f"{t.device.bus}/{t.node}": f"{t.slug} {t.description.id}" for t in self._targets.values()},
            descriptions={t.description.id: t.description for t in self._targets.values()}.values(),
        )

    def _watch(self, now_ns: int) -> None:
        for name, link in self.buses.items():
            status = link.status
            before = self._states.get(name)
            self._states[name] = status
            was_up = before is not None and before.state in (LinkState.CONNECTED, LinkState.LISTENING)
            if status.state is LinkState.CONNECTED and before is None:
                self.journal.note(Kind.CONNECTED, None, bus=name, adapter=link.adapter)
            elif status.state is LinkState.LOST and (was_up or before is None):
                link.was_away(now_ns)
                self.journal.note(Kind.BUS_LOST, None, bus=name, reason=status.reason)
            elif before is not None and status.reconnects > before.reconnects:
                link.was_away(now_ns)
                self.journal.note(Kind.BUS_BACK, None, bus=name, gap_s=f"{(status.t_ns - before.t_ns) / 1e9:.1f}")
            for master in status.masters:
                if (name, master.sign) not in self._masters:
                    self._masters.add((name, master.sign))
                    self.journal.note(Kind.OTHER_MASTER, None, bus=name, seen=f"{master.sign.value} {master.can_id:X}h")
