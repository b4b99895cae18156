"""The instructor of a twin turbine: puts faults in, takes them out, and plays scenarios.

Line time is the only clock, and every fault draws from a ``Random`` of its own, made of the seed and its number, so
that the same orders at the same times make the same frames, however the line is driven. All calls belong to the thread
of the line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random
from typing import Final

from app.errors import UsageError
from app.model.fault import ActiveFault, FaultLevel, FaultOrder, FaultTarget, check_order, kind_of
from app.twins.canopen_device import CanopenDevice, Power
from app.twins.device_faults import OF_BLADE, OF_DEVICE, Holds, holds_of_blade, holds_of_device
from app.twins.line import CanLine
from app.twins.ports import Alarm
from app.twins.scenario import Scenario
from app.twins.scenario_player import ScenarioPlayer, Stage
from app.twins.surroundings import Surroundings
from app.twins.turbine import Blade, Turbine
from app.twins.wire_faults import (
    Babbler,
    BusOff,
    FrameFault,
    FramesDelayed,
    FramesDoubled,
    FramesLost,
    FramesReordered,
    NodeGone,
    SecondMaster,
)

_SECOND: Final = 1_000_000_000
_GUST_SHAPE: Final = (0.3, 0.2, 0.5)
"""Shares of a gust's time in which it rises, holds and falls."""
MAX_ACTIVE: Final = 64
"""More faults at a time are refused: nobody oversees them."""
End = Callable[[], None]
"""Takes a fault out."""

_FRAME_FAULTS: Final[dict[str, type[FrameFault]]] = {
    "frames_lost": FramesLost,
    "frames_delayed": FramesDelayed,
    "frames_doubled": FramesDoubled,
    "frames_reordered": FramesReordered,
}


@dataclass(slots=True)
class _Acting:
    """A fault that acts, how it ends, and the timer that ends it."""

    fault: ActiveFault
    end: End
    alarm: Alarm


class Instructor:
    """Faults and scenarios of one turbine. ``surroundings`` None: there is no wind, so no gust and no controller."""

    def __init__(
        self, turbine: Turbine, line: CanLine, surroundings: Surroundings | None = None, seed: int = 0
    ) -> None:
        self._turbine = turbine
        self._line = line
        self._surroundings = surroundings
        self._seed = seed
        self._draws = 0
        self._last_id = 0
        self._holds = Holds()
        self._acting: dict[int, _Acting] = {}
        self._player: ScenarioPlayer | None = None

    # -- faults ------------------------------------------------------------------------

    @property
    def active(self) -> tuple[ActiveFault, ...]:
        """What acts now, the oldest first."""
        return tuple(acting.fault for acting in self._acting.values())

    def check(self, order: FaultOrder) -> FaultOrder:
        """The order with all its values. Raises UsageError that names the field; node and wind must be there."""
        checked = check_order(order)
        if checked.node is not None and checked.node not in self._turbine.devices:
            raise UsageError(reason=f"fault: field 'node': there is no node {checked.node} here", field="node")
        if checked.kind == "gust" and self._surroundings is None:
            raise UsageError(reason="fault: field 'kind': these twins have no wind", field="kind")
        return checked

    def inject(self, order: FaultOrder) -> ActiveFault:
        """Put a fault in now. Raises UsageError as ``check`` does, or where too many act."""
        checked = self.check(order)
        if len(self._acting) >= MAX_ACTIVE:
            raise UsageError(reason=f"{MAX_ACTIVE} faults act already", field="kind")
        self._last_id += 1
        number, now_ns = self._last_id, self._line.now_ns
        for blade in self._touched(checked):
            blade.advance(now_ns)
        fault = ActiveFault(number, checked, now_ns)
        # Noted first: a fault of one frame may end while it begins.
        acting = self._acting[number] = _Acting(fault, lambda: None, Alarm(self._line))
        acting.end = self._begin(number, checked)
        if number in self._acting:
            self._end_in(acting, checked.seconds)
        return fault

    def clear(self, fault: int) -> None:
        """Take a fault out. Raises UsageError where it does not act."""
        acting = self._acting.get(fault)
        if acting is None:
            raise UsageError(reason=f"there is no fault {fault}", field="fault")
        for blade in self._touched(acting.fault.order):
            blade.advance(self._line.now_ns)
        del self._acting[fault]
        acting.alarm.clear()
        acting.end()

    def clear_all(self) -> None:
        """Take all faults out."""
        for number in tuple(self._acting):
            self.clear(number)

    # -- scenarios ---------------------------------------------------------------------

    @property
    def playing(self) -> ScenarioPlayer | None:
        """The scenario that plays."""
        return self._player if self._player is not None and self._player.playing else None

    def play(self, scenario: Scenario) -> ScenarioPlayer:
        """Play a scenario from now on, in place of one that plays; faults that act end.

        Raises UsageError where these twins cannot; all is as before then.
        """
        player = ScenarioPlayer(scenario, Stage(self._line, self._turbine, self._surroundings, self))
        self.stop()
        self.clear_all()
        self._seed, self._draws = scenario.seed, 0
        player.begin()
        self._player = player
        return player

    def stop(self) -> None:
        """End the scenario that plays, if one does."""
        if self._player is not None:
            self._player.stop()
            self._player = None

    # -- inside ------------------------------------------------------------------------

    def _end_in(self, acting: _Acting, seconds: float | None) -> None:
        if seconds is not None:
            number = acting.fault.id
            acting.alarm.set(self._line.now_ns + round(seconds * _SECOND), lambda _t_ns: self._finished(number))

    def _finished(self, number: int) -> None:
        """A fault has ended by itself."""
        if number in self._acting:
            self.clear(number)

    def _random(self) -> Random:
        """Of the next fault that needs one."""
        self._draws += 1
        return Random(f"{self._seed}/{self._draws}")

    def _touched(self, order: FaultOrder) -> tuple[Blade, ...]:
        """Blades whose plant or units a fault changes: their time must have come to now."""
        kind, blades = kind_of(order), self._turbine.blades
        if kind.target is FaultTarget.NODE:
            return tuple(blade for blade in blades if order.node in {device.node_id for device in blade.devices})
        if kind.level is FaultLevel.WIRE:
            return ()
        return tuple(blade for blade in blades if order.blade in (None, blade.number))

    def _begin(self, number: int, order: FaultOrder) -> End:
        kind, line, values = order.kind, self._line, order.values
        if kind in OF_BLADE:
            for blade in self._touched(order):
                self._holds.take(number, holds_of_blade(order, blade))
            return lambda: self._holds.release(number)
        if kind == "gust":
            return self._gust(number, values["rise_mps"], values["duration_s"])
        if kind in _FRAME_FAULTS:
            port = None if order.node is None else self._turbine.devices[order.node].port
            frames = _FRAME_FAULTS[kind](line, values, self._random(), port, lambda: self._finished(number))
            return frames.end
        if kind == "babbling_node":
            return Babbler(line, values, self._random()).end
        return self._begin_at_node(number, order)

    def _begin_at_node(self, number: int, order: FaultOrder) -> End:
        node = order.node or 0
        device = self._turbine.devices[node]
        if order.kind in OF_DEVICE:
            self._holds.take(number, holds_of_device(order, device))
            return lambda: self._holds.release(number)
        if order.kind == "power_cut":
            return self._cut_power(number, device, order.values["off_s"])
        if order.kind == "bus_off":
            return BusOff(self._line, device).end
        if order.kind == "second_master":
            return SecondMaster(self._line, node, order.values, self._random()).end
        return NodeGone(device).end

    def _cut_power(self, number: int, device: CanopenDevice, off_s: float) -> End:
        def on() -> None:
            others = (fault.order for fault in self.active if fault.id != number)
            still = any(order.kind == "power_cut" and order.node == device.node_id for order in others)
            if device.power is Power.OFF and not still:
                device.power_on(self._line.now_ns)

        device.cut_power()
        self._end_in(self._acting[number], off_s)
        return on

    def _gust(self, number: int, rise_mps: float, duration_s: float) -> End:
        assert self._surroundings is not None  # checked
        wind = self._surroundings.rotor.wind
        gust = wind.gust(rise_mps, *(share * duration_s for share in _GUST_SHAPE))
        self._end_in(self._acting[number], duration_s)
        return lambda: wind.calm(gust)
