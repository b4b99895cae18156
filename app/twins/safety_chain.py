"""The safety chain of a turbine: what opens it, and the emergency feather command (EFC) of all blades that follows.

In series: the safety relay of each PMM (X13.11/X13.12, 30FEh/3 bit 16), the watchdog contact of each PMC (X2.1/X2.2,
60FEh/3 bit 16) and a contact of the turbine. Its end feeds X13.10, X13.8 and X13.7 of every PMM; a PMM that has seen
them at 0 for 50 ms takes the voltage off X2.3 of its PMC, and the blade drives to feather (manual, 4.7.1.3, 5.7.1.3
and 5.15). OPEN how the chain is wired; the manual only says "with suitable wiring", and this one feathers all blades.

Nothing latches in it: it closes as soon as every contact is closed again. While it is open, a PMC does not listen to
its controlword (5.15), so an error that opened it is reset by X2.4, by 5040h bit 7 or by a restart.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Final, Protocol

from app.twins.canopen_device import MS
from app.twins.oat_pmc import OatPmc
from app.twins.oat_pmm import OatPmm
from app.twins.ports import Alarm, Line

TICK_NS: Final = 5 * MS
"""How often contacts are looked at, so that the 50 ms of the inputs are kept by a tenth."""


class Units(Protocol):
    """The two units of a blade."""

    pmm: OatPmm
    pmc: OatPmc


class Contact(Enum):
    """What may hold the chain open."""

    TURBINE = "contact of the turbine"
    PMM = "safety relay of a PMM"
    PMC = "watchdog contact of a PMC"


class SafetyChain:
    """The chain through the units of ``blades``. ``closed``: the contact of the turbine, which anyone may open."""

    def __init__(self, line: Line, blades: Sequence[Units]) -> None:
        self.closed = True
        self._units = tuple((blade.pmm, blade.pmc) for blade in blades)
        self._levels = [True for _ in self._units]
        self._alarm = Alarm(line)

    def start(self, t_ns: int) -> None:
        """Voltage is on the chain from ``t_ns`` on."""
        self._tick(t_ns)

    def stop(self) -> None:
        """All is switched off."""
        self._alarm.clear()

    @property
    def open_contacts(self) -> tuple[tuple[Contact, int], ...]:
        """What holds it open, with the node of the unit (0: the turbine)."""
        found = [] if self.closed else [(Contact.TURBINE, 0)]
        for pmm, pmc in self._units:
            if not pmm.safety_relay:
                found.append((Contact.PMM, pmm.device.node_id))
            if not pmc.watchdog_closed:
                found.append((Contact.PMC, pmc.device.node_id))
        return tuple(found)

    def _tick(self, t_ns: int) -> None:
        self._alarm.set(t_ns + TICK_NS, self._tick)
        closed = self.closed
        for pmm, pmc in self._units:
            closed = closed and pmm.safety_relay and pmc.watchdog_closed
        for place, (pmm, pmc) in enumerate(self._units):
            pmm.inputs.chain(closed)
            level = pmm.lets_axis_run
            if level is not self._levels[place]:
                self._levels[place] = level
                pmc.inputs.efc = level
