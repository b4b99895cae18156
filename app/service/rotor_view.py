"""What the page and the 3D view are told of rotor and wind. Pure: live state in, a small view out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.service.views import STALE_NS
from app.wire.live import LiveState


@dataclass(frozen=True, slots=True)
class RotorLine:
    """Rotor and wind as a twin told them last, at ``t_ns``; all None where nobody tells them.

    Azimuth of blade 1 in degrees, 0 upwards, clockwise seen from upwind. ``wind_deg`` is where the wind comes from,
    from the nacelle's direction, positive clockwise seen from above. ``stale``: older than a second.
    """

    azimuth_deg: float | None
    rotor_rpm: float | None
    wind_mps: float | None
    wind_deg: float | None
    t_ns: int | None
    stale: bool


NOBODY: Final = RotorLine(None, None, None, None, None, False)


def rotor_line(live: LiveState, now_ns: int) -> RotorLine:
    """Rotor and wind at ``now_ns``."""
    seen = live.environment
    if seen is None:
        return NOBODY
    return RotorLine(*seen.environment, t_ns=seen.t_ns, stale=now_ns - seen.t_ns > STALE_NS)
