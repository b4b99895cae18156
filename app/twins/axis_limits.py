"""How fast an axis may drive and stop by its parameters (manual, 5.10 to 5.13). Position units and seconds."""

from __future__ import annotations

from typing import Final

from app.twins.axis_scaling import motor_scaling
from app.twins.object_store import ObjectStore
from app.twins.plant import AxisConstants

_CURRENT_LIMIT_SHARE: Final = 0.8
"""Share of the current limit that a stop plans with, so that the controller can follow."""
_LEAST_STOP_SHARE: Final = 0.1
"""A stop is planned with at least this share of the rated torque, however low 6073h is."""
_MOST_PERMILLE: Final = 2000
"""6073h: never beyond double nominal current."""


class AxisLimits:
    """Limits in force. ``refresh`` after a parameter of scaling or current was written; all else is read when asked."""

    def __init__(self, store: ObjectStore, constants: AxisConstants) -> None:
        self._store = store
        self._constants = constants
        self.refresh()

    def refresh(self) -> None:
        """Take scaling and current limit in force."""
        share = min(self._store.number(0x6073), _MOST_PERMILLE) / 1000
        torque_nm = max(share, _LEAST_STOP_SHARE) * self._constants.rated_torque_nm
        units_per_rad = abs(motor_scaling(self._store).units_per_rad)
        self.current_limit = torque_nm * _CURRENT_LIMIT_SHARE / self._constants.inertia_kgm2 * units_per_rad
        """Deceleration that the current limit allows."""

    def motion(self) -> tuple[float, float, float]:
        """Velocity, acceleration and deceleration in force, each within its maximum (607Fh, 60C5h, 60C6h).

        A velocity or acceleration of 0 (their default) means no motion. OPEN what a maximum deceleration of 0 (its
        default) means; no limit, for an axis must be able to stop.
        """
        store = self._store
        velocity = min(store.number(0x6081), store.number(0x607F))
        acceleration = min(store.number(0x6083), store.number(0x60C5))
        return velocity, acceleration, self.stopping()

    def stopping(self) -> float:
        """Deceleration of a stop by the ramp: 6084h, or 6083h where that is 0, within 60C6h."""
        store = self._store
        deceleration = store.number(0x6084) or store.number(0x6083)
        highest = store.number(0x60C6)
        if highest:
            deceleration = min(deceleration, highest)
        return deceleration or self.current_limit

    def velocity_target(self, cyclic: bool) -> float:
        """60FFh within +-607Fh; in mode 9 (``cyclic``) with 60B1h, and within +-6081h where that is given."""
        store = self._store
        wanted = store.number(0x60FF)
        limit = store.number(0x607F)
        if cyclic:
            wanted += store.number(0x60B1)
            limit = min(limit, store.number(0x6081) or limit)
        return min(max(wanted, -limit), limit)
