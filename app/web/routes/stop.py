"""STOP and FEATHER: always live, for every role. They are no safety function."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Request

from app.service.stop import Command
from app.web.deps import DEVICE, ConnectionOf, JournalOf, TargetOf
from app.web.models import Press, StopDone
from app.web.urgent import Presses

router = APIRouter()


def get_presses(request: Request) -> Presses:
    """What the pages of this server have commanded."""
    presses: Presses = request.app.state.presses
    return presses


PressesOf = Annotated[Presses, Depends(get_presses)]


@router.post("/live/stop")
async def stop(connection: ConnectionOf, journal: JournalOf, presses: PressesOf, press: Press) -> StopDone:
    """STOP to every axis. This is no safety function."""
    return await presses.command(connection, journal, Command.STOP, press)


@router.post("/live/feather")
async def feather(connection: ConnectionOf, journal: JournalOf, presses: PressesOf, press: Press) -> StopDone:
    """FEATHER to every axis. This is no safety function."""
    return await presses.command(connection, journal, Command.FEATHER, press)


@router.post(DEVICE + "/stop")
async def stop_one(
    connection: ConnectionOf, journal: JournalOf, presses: PressesOf, target: TargetOf, press: Press
) -> StopDone:
    """STOP to one axis: its quick stop, on the same path. A device that is no axis is none of those stopped."""
    return await presses.command(connection, journal, Command.STOP, press, target.slug)
