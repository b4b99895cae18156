"""The change of a battery: the old one is noted; once the new one is in, its charge counter (3050h) begins at 0.

3050h adds up what the battery was charged with in its life. It goes on counting while it is written, so that it is not
compared for being equal: it must not hold more than it can have gained meanwhile.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from app.errors import BatteryCounterError, BatteryUnsavedError, HubsideError, RefusedError, because
from app.service.battery.objects import CHARGED_TOTAL, read_number
from app.service.devices import Target
from app.service.journal import Journal
from app.service.save import save
from app.service.write import write_raw

GAINED_MAH: Final = 5
"""What a battery may gain until its counter is read back: seconds at the greatest charge current."""
_UNKNOWN: Final = "–"


async def reset_counter(driver: Any, target: Target, journal: Journal, now_ns: Callable[[], int]) -> int:
    """Set 3050h to 0, read it back, save; what it holds then, in mAh.

    Raises RefusedError (nothing was sent), BatteryCounterError (it is not known to be 0), BatteryUnsavedError (it is,
    and was not saved).
    """
    try:
        await write_raw(driver, target, CHARGED_TOTAL, 0, journal)
        counter = await read_number(driver, target, CHARGED_TOTAL)
    except RefusedError:
        raise
    except HubsideError as error:
        own = {"device": target.slug, "counter": await _counter(driver, target)}
        raise BatteryCounterError(**(because(error) | own)) from error
    if counter > GAINED_MAH:
        raise BatteryCounterError(device=target.slug, counter=counter, reason_key="unverified.other_value")
    try:
        await save(driver, target, journal, now_ns)
    except HubsideError as error:
        raise BatteryUnsavedError(**(because(error) | {"device": target.slug})) from error
    return counter


async def _counter(driver: Any, target: Target) -> int | str:
    """What it reads after a write that failed; a dash where even that is not known."""
    try:
        return await read_number(driver, target, CHARGED_TOTAL)
    except HubsideError:
        return _UNKNOWN
