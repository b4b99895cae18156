"""What a turbine controller wants of pitch and generator, from the speed of the rotor. Pure.

Below rated power the pitch is fine and the generator takes the torque at which the rotor works best; at rated power the
generator takes its rated torque, and a proportional-integral controller holds the speed by the pitch, collectively. No
part of it is of a certain maker; it is the plain variable-speed scheme of every textbook.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.twins.rotor import RATED_RPM, RPM


@dataclass(frozen=True, slots=True)
class LawConstants:
    """Of the controller; made for the rotor of ``app.twins.rotor``."""

    rated_rpm: float = RATED_RPM
    rated_nm: float = 1.061e6
    """2 MW at 18 rpm, at the rotor."""
    best_nms2: float = 105e3
    """Torque over squared speed at a tip-speed ratio of 7.5 with a power coefficient of 0.44."""
    connect_rpm: float = 8.0
    """From here on the generator takes torque."""
    fine_deg: float = 1.0
    """Smallest pitch, clear of the 0 degree switch."""
    start_deg: float = 15.0
    """Smallest pitch until the generator takes torque."""
    feather_deg: float = 88.0
    """Largest pitch, clear of the 90 degree switch."""
    gain_deg_s: float = 40.0
    """Pitch over deviation of the speed, degrees per rad/s."""
    integral_deg: float = 12.5
    """Pitch per second over deviation of the speed, degrees/s per rad/s: 0.5 rad/s of bandwidth, well damped."""
    rate_dps: float = 6.0
    """Fastest change of the pitch that is asked for, degrees/s."""


_SOFT_SHARE: Final = 0.95
"""From this share of the rated speed on the torque goes up to its rated value."""


class PitchLaw:
    """Pitch and torque from the speed; ``step`` every cycle. ``pitch_deg`` goes on from where it is set."""

    def __init__(self, constants: LawConstants | None = None) -> None:
        self.constants = LawConstants() if constants is None else constants
        self.pitch_deg = self.constants.feather_deg
        self.generator_nm = 0.0
        self._integral_deg = 0.0

    def start(self, pitch_deg: float, rotor_rpm: float = 0.0) -> None:
        """Begin at a pitch, without a bump where the rotor turns near its rated speed already."""
        constants = self.constants
        self.pitch_deg = min(max(pitch_deg, constants.fine_deg), constants.feather_deg)
        bump_deg = constants.gain_deg_s * (rotor_rpm - constants.rated_rpm) / RPM
        self._integral_deg = min(max(self.pitch_deg - bump_deg, constants.fine_deg), constants.feather_deg)
        self.generator_nm = 0.0

    def step(self, dt_s: float, rotor_rpm: float) -> None:
        """Move on by ``dt_s``."""
        constants = self.constants
        self.generator_nm = self._torque_nm(rotor_rpm)
        low_deg = constants.fine_deg if self.generator_nm else constants.start_deg
        off_rad_s = (rotor_rpm - constants.rated_rpm) / RPM
        wanted_deg = self._integral_deg + constants.integral_deg * off_rad_s * dt_s
        self._integral_deg = min(max(wanted_deg, low_deg), constants.feather_deg)
        wanted_deg = min(max(self._integral_deg + constants.gain_deg_s * off_rad_s, low_deg), constants.feather_deg)
        most_deg = constants.rate_dps * dt_s
        self.pitch_deg += min(max(wanted_deg - self.pitch_deg, -most_deg), most_deg)

    def _torque_nm(self, rotor_rpm: float) -> float:
        constants = self.constants
        if rotor_rpm < constants.connect_rpm:
            return 0.0
        best_nm = constants.best_nms2 * (rotor_rpm / RPM) ** 2
        soft_rpm = _SOFT_SHARE * constants.rated_rpm
        share = min(max((rotor_rpm - soft_rpm) / (constants.rated_rpm - soft_rpm), 0.0), 1.0)
        return best_nm + (constants.rated_nm - best_nm) * share
