"""What a twin tells of what surrounds its axes: rotor and wind. One extended CAN frame of our own, sent by twins only.

No drive of a real turbine sends it, so that rotor and wind stay unknown there. It crosses the wire like everything that
is shown: it is recorded, replayed and decoded as any other frame.

Data, little-endian: azimuth of blade 1 in 0.01 degrees (u16), rotor speed in 0.01 rpm (i16), wind speed in 0.01 m/s
(u16), wind direction in 0.01 degrees (i16).
"""

from __future__ import annotations

import struct
from typing import Final, NamedTuple

CAN_ID: Final = 0x1F485342
"""29 bit, so outside the connection set of CiA 301, and of the lowest priority: it delays nobody. The bits that J1939
calls extended data page and data page are both set, which it does not use; the rest spells HSB."""
_FORMAT: Final = struct.Struct("<HhHh")
_TURN_CDEG: Final = 36_000
_HUNDREDTHS: Final = 100


class TwinEnvironment(NamedTuple):
    """Rotor and wind. Azimuth 0..360 degrees: 0 is blade 1 upwards, rising clockwise seen from upwind.

    ``wind_deg`` is where the wind comes from, from the nacelle's direction, positive clockwise seen from above.
    """

    azimuth_deg: float
    rotor_rpm: float
    wind_mps: float
    wind_deg: float


def pack_environment(environment: TwinEnvironment) -> bytes:
    """The data field. Raises ValueError where a quantity does not fit."""
    azimuth = round(environment.azimuth_deg * _HUNDREDTHS) % _TURN_CDEG
    rest = (round(number * _HUNDREDTHS) for number in environment[1:])
    try:
        return _FORMAT.pack(azimuth, *rest)
    except struct.error as error:
        raise ValueError(f"{environment} does not fit its frame") from error


def parse_environment(data: bytes) -> TwinEnvironment:
    """The environment in a data field. Raises ValueError on any other length and on an azimuth beyond a turn."""
    if len(data) != _FORMAT.size:
        raise ValueError(f"{data.hex()} has no {_FORMAT.size} bytes")
    azimuth, *rest = _FORMAT.unpack(data)
    if azimuth >= _TURN_CDEG:
        raise ValueError(f"azimuth of {azimuth / _HUNDREDTHS} degrees")
    return TwinEnvironment(azimuth / _HUNDREDTHS, *(number / _HUNDREDTHS for number in rest))
