"""Where both encoders of an axis say that the blade is, asked now: the witnesses of a slow move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from app.errors import UsageError
from app.model.address import Address
from app.model.values import to_scaled
from app.service.devices import Target, decode
from app.service.motion.interlocks import POSITION
from app.service.stop import is_axis
from app.service.write import know_what_it_rests_on

BLADE_POSITION: Final = Address(0x6864)


@dataclass(frozen=True, slots=True)
class Positions:
    """Position (6064h) and position of the blade encoder (6864h) in degrees; None where the axis has none."""

    position_deg: float | None
    blade_deg: float | None


async def positions(driver: Any, target: Target) -> Positions:
    """Both positions as the axis says now. Raises UsageError, NoAnswerError, DeviceError."""
    if not is_axis(target):
        raise UsageError(reason=f"{target.slug} is no axis")
    return Positions(await _degrees(driver, target, POSITION), await _degrees(driver, target, BLADE_POSITION))


async def _degrees(driver: Any, target: Target, address: Address) -> float | None:
    if address not in target.description.entries:
        return None
    entry = target.entry(address)
    await know_what_it_rests_on(driver, target, entry)
    scaled = to_scaled(entry, decode(entry, await driver.read(target.node, address)), target.lookup)
    return None if scaled is None else float(scaled.number)
