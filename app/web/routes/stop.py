"""STOP and FEATHER: always live, for every role. They are no safety function."""

from __future__ import annotations

from fastapi import APIRouter

from app.service.stop import AxisOutcome, Command, command_all
from app.web.deps import DEVICE, ConnectionOf, JournalOf, TargetOf
from app.web.models import AxisDone, Nothing, StopDone
from app.web.routes.jobs import failure

router = APIRouter()


@router.post("/live/stop")
async def stop(connection: ConnectionOf, journal: JournalOf, _request: Nothing) -> StopDone:
    """STOP to every axis. This is no safety function."""
    return _stop_done(await command_all(connection.axes(), Command.STOP, journal, connection.stamper))


@router.post("/live/feather")
async def feather(connection: ConnectionOf, journal: JournalOf, _request: Nothing) -> StopDone:
    """FEATHER to every axis. This is no safety function."""
    return _stop_done(await command_all(connection.axes(), Command.FEATHER, journal, connection.stamper))


@router.post(DEVICE + "/stop")
async def stop_one(connection: ConnectionOf, journal: JournalOf, target: TargetOf, _request: Nothing) -> StopDone:
    """STOP to one axis: its quick stop, on the same path. A device that is no axis is none of those stopped."""
    axes = [axis for axis in connection.axes() if axis.target is target]
    return _stop_done(await command_all(axes, Command.STOP, journal, connection.stamper))


def _stop_done(outcomes: list[AxisOutcome]) -> StopDone:
    return StopDone(
        axes=[
            AxisDone(
                device=one.device,
                sent_t_ns=one.sent_t_ns,
                confirmed_t_ns=one.confirmed_t_ns,
                how=one.how.value,
                error=None if one.error is None else failure("", one.error),
            )
            for one in outcomes
        ]
    )
