"""Who drives a hydraulic axis, and whether its cylinders go together: changed in the order that the device wants.

Bus before device mode, control mode before both, axes last: what a step needs is what the one before it sets (ED2
manual, 5.1.4, whose printed order contradicts its own conditions after local operation).
"""

from __future__ import annotations

from app.errors import InterlockError
from app.model.address import Address
from app.service.journal import Journal
from app.service.motion.desk import MotionDesk
from app.service.motion.hydraulic import AXIS_OPERATION, LOCAL, HydraulicControl, HydraulicMode, hydraulic
from app.service.motion.running import Doing, Running
from app.service.write import write_raw

FROM_BUS = 0
SYNCHRONOUS, SINGLE = 0, 1


async def take_over(desk: MotionDesk, slug: str, fence: int, single: bool, aligned: bool, journal: Journal) -> None:
    """Have the bus drive the axis, its cylinders ``single`` or synchronous. Nothing moves by it, and nothing is saved.

    ``aligned``: a person says that both cylinders stand at the same place; synchronous axes would else be drawn
    together at once, and the second one is on no telegram of ours. Raises InterlockError, AxisStateError (it has power
    or moves), UnverifiedError, what a write raises.
    """
    if not single and not aligned:
        raise InterlockError(device=slug, interlock="aligned", reason_key="hydraulic.not_aligned")

    async def work(running: Running) -> None:
        control = hydraulic(running.control)
        await control.require_off()
        await control.require_still()
        await _write(control, LOCAL, FROM_BUS, journal)
        await control.set_mode(HydraulicMode.PROFILE)
        await _write(control, AXIS_OPERATION, SINGLE if single else SYNCHRONOUS, journal)

    await desk.without_proof(slug, fence, Doing.OPERATION, work)


async def _write(control: HydraulicControl, address: Address, raw: int, journal: Journal) -> None:
    """Where it is not so already."""
    control.require_own()
    if await control.number(address) != raw:
        await write_raw(control.driver, control.target, address, raw, journal)
