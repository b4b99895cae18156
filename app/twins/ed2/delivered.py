"""What stands in the memory of a twin that nobody has saved to yet: an axis as commissioned on the twin's own bench.

The manual prints no default for enumerations, and its printed defaults belong to no machine (a resolution of 10 mm, no
speed to speak of). What is not listed here has its default.
"""

from __future__ import annotations

from typing import Final

from app.model.address import Address, Addressing
from app.model.datatypes import Raw, encode_raw
from app.model.description import Description


def pkw(ind: int, pnu: int) -> Address:
    """The address of a parameter."""
    return Address(ind, pnu, Addressing.PKW)


INCREMENTAL: Final = 64
SSI_BINARY: Final = 65
SSI_GRAY: Final = 66
ANALOG: Final = 67

_ALL: Final[dict[Address, Raw]] = {
    pkw(0, 39): 1,  # setpoint from the bus
    pkw(0, 40): 9,
    pkw(0, 41): 0,  # control by the bus
    pkw(0, 53): 0,  # synchronous
    pkw(1, 84): 1,  # millimetres
    pkw(1, 104): 1,
    pkw(3, 133): 0,
    pkw(12, 42): 5,
    pkw(12, 61): 1_000,  # 100.0 mm/s
    pkw(12, 64): 2_000,  # 200.0 mm/s²
    pkw(12, 163): 10_000,
    pkw(12, 164): 20,  # 0.20 s
    pkw(12, 216): 500,
    pkw(12, 217): 100,
    pkw(12, 218): 1_000,
    pkw(12, 219): 2,
    pkw(12, 220): 5,
    pkw(12, 221): 0,
    pkw(12, 224): 0x0102,
    pkw(12, 225): 0x0102,
}
_DIGITAL_RESOLUTION: Final = 5_000
"""5 µm a step."""
_SSI_OFFSET: Final = -5_000
"""-50.00 mm: the zero of the sensor lies so far before the retracted end."""
_ANALOG_RESOLUTION: Final = 500_000_000
"""500 mm over the whole range of the signal."""
SIGNALS: Final = {INCREMENTAL: 0, SSI_BINARY: 2, SSI_GRAY: 2, ANALOG: 3}
"""1/97 by the kind of sensor: 25 bits, and 4 to 20 mA, with which a broken wire shows."""


def delivered(description: Description, transducer: int, axis: int) -> dict[Address, bytes]:
    """Saved values of one axis (1 or 2) with a kind of transducer (1/22)."""
    analog = transducer == ANALOG
    raws = {
        **_ALL,
        pkw(1, 22): transducer,
        pkw(1, 20): axis - 1 if analog else 7 + axis,
        pkw(1, 98): 0 if analog or transducer == INCREMENTAL else _SSI_OFFSET,
        pkw(1, 99): _ANALOG_RESOLUTION if analog else _DIGITAL_RESOLUTION,
    }
    return {address: encode_raw(description.entry(address).type, raw) for address, raw in raws.items()}
