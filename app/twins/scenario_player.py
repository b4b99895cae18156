"""Plays a scenario on twins: sets what was changed before, then lets its events happen at their times on the line."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Final, Protocol

from app.errors import UsageError
from app.model.datatypes import encode_raw
from app.model.fault import ActiveFault, FaultOrder
from app.twins.canopen_device import CanopenDevice, Power
from app.twins.controller import TurbineController
from app.twins.line import CanLine
from app.twins.object_store import RefusedAccessError
from app.twins.ports import Line
from app.twins.rotor import Rotor
from app.twins.scenario import Clear, Control, Event, MasterDo, MasterOrder, Preset, Scenario, Unit
from app.twins.service_master import ServiceMaster
from app.twins.surroundings import Surroundings
from app.twins.turbine import Turbine
from app.wire.nmt import NmtCommand

_LOG: Final = logging.getLogger(__name__)
_LOOK_NS: Final = 10_000_000
"""How often it is looked whether all units have booted."""


class Faults(Protocol):
    """Who puts faults in."""

    @property
    def active(self) -> tuple[ActiveFault, ...]:
        """What acts."""

    def check(self, order: FaultOrder) -> FaultOrder:
        """Raise UsageError where an order is none."""

    def inject(self, order: FaultOrder) -> ActiveFault:
        """Put a fault in."""

    def clear(self, fault: int) -> None:
        """Take it out."""


@dataclass(frozen=True, slots=True)
class Stage:
    """What a scenario is played on."""

    line: CanLine
    turbine: Turbine
    surroundings: Surroundings | None
    faults: Faults


class ScenarioPlayer:
    """One scenario, which plays from ``begin`` on until its time is over or ``stop`` is called.

    What cannot be done on these twins is told before: UsageError, and nothing has happened.
    """

    def __init__(self, scenario: Scenario, stage: Stage) -> None:
        self.scenario = scenario
        self.since_ns = stage.line.now_ns
        self.playing = False
        self.controller: TurbineController | None = None
        self._stage = stage
        self.master = ServiceMaster(stage.line, stage.turbine.devices)
        self._places = self._presets()
        try:
            self._check()
        except UsageError:
            self.master.close()
            raise

    def begin(self) -> None:
        """Play from now on. Raises UsageError where a unit refuses a value of before; nothing plays then."""
        self.since_ns = self._stage.line.now_ns
        try:
            self._preset()
        except UsageError:
            self.master.close()
            raise
        self.playing = True
        self._begin()

    def stop(self) -> None:
        """End it: its faults are cleared, its controller and master leave. What was written stays."""
        if not self.playing:
            return
        self.playing = False
        for fault in self._stage.faults.active:
            self._stage.faults.clear(fault.id)
        if self.controller is not None:
            self.controller.stop()
            self._stage.turbine.chain.closed = True  # as it was, without a controller
        self.master.close()

    # -- before ------------------------------------------------------------------------

    def _check(self) -> None:
        start, stage = self.scenario.start, self._stage
        if stage.surroundings is None and (start.wind_mps is not None or start.controller):
            raise UsageError(reason="these twins have no wind and no rotor", field="start")
        for preset, device in self._places:
            _preset_bytes(preset, device)
        rehearsal = TurbineController(CanLine(stage.line.bitrate), Rotor(seed=0))
        for event in self.scenario.events:
            if isinstance(event.action, FaultOrder):
                stage.faults.check(event.action)
            elif isinstance(event.action, MasterOrder):
                self.master.check(event.action)
            elif isinstance(event.action, Control):
                rehearsal.command(event.action.table)

    def _presets(self) -> list[tuple[Preset, CanopenDevice]]:
        return [
            (preset, blade.pmc.device if preset.unit is Unit.PMC else blade.pmm.device)
            for preset in self.scenario.presets
            for blade in self._stage.turbine.blades
            if preset.blade in (None, blade.number)
        ]

    def _preset(self) -> None:
        for preset, device in self._places:
            data = _preset_bytes(preset, device)
            try:
                device.store.write(preset.address, data)
            except RefusedAccessError as error:
                raise _wrong(preset, f"is refused: {error}") from error
            if preset.save:
                device.memory.preset(preset.address, data)

    # -- while it plays ------------------------------------------------------------------

    def _begin(self) -> None:
        start, stage = self.scenario.start, self._stage
        if start.wind_mps is not None and stage.surroundings is not None:
            stage.surroundings.set_wind(start.wind_mps)
        if start.operational:
            self._start_nodes(self.since_ns)
        if start.controller and stage.surroundings is not None:
            self.controller = _controller(stage.line, stage.turbine, stage.surroundings)
            self.controller.start(self.since_ns)
        for event in self.scenario.events:
            self._at(event)
        stage.line.call_at(self.since_ns + self.scenario.duration_ns, lambda _t_ns: self.stop())

    def _start_nodes(self, t_ns: int) -> None:
        if not self.playing:
            return
        if all(device.power is Power.ON for device in self._stage.turbine.devices.values()):
            self.master.do(MasterOrder(MasterDo.NMT, 0, command=NmtCommand.START))
        else:
            self._stage.line.call_at(t_ns + _LOOK_NS, self._start_nodes)

    def _at(self, event: Event) -> None:
        def ring(_t_ns: int) -> None:
            if self.playing:
                self._do(event)

        self._stage.line.call_at(self.since_ns + event.at_ns, ring)

    def _do(self, event: Event) -> None:
        action, faults = event.action, self._stage.faults
        if isinstance(action, FaultOrder):
            faults.inject(action)
        elif isinstance(action, Clear):
            for fault in faults.active:
                if action.covers(fault.order):
                    faults.clear(fault.id)
        elif isinstance(action, MasterOrder):
            self.master.do(action)
        elif self.controller is not None:
            self.controller.command(action.table)


def _controller(line: Line, turbine: Turbine, surroundings: Surroundings) -> TurbineController:
    def contact(closed: bool) -> None:
        turbine.chain.closed = closed

    return TurbineController(line, surroundings.rotor, contact=contact)


def _preset_bytes(preset: Preset, device: CanopenDevice) -> bytes:
    cell = device.store.find(preset.address.major, preset.address.minor)
    if cell is None:
        raise _wrong(preset, "does not exist")
    try:
        return encode_raw(cell.entry.type, preset.raw)
    except ValueError as error:
        raise _wrong(preset, str(error)) from error


def _wrong(preset: Preset, reason: str) -> UsageError:
    return UsageError(reason=f"parameters: {preset.address} of the {preset.unit.name} {reason}", field="parameters")
