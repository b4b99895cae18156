"""STOP and FEATHER: always live, for every role. They are no safety function."""

from __future__ import annotations

from fastapi import APIRouter

from app.service.stop import Command
from app.web.deps import DEVICE, ConnectionOf, JournalOf, TargetOf
from app.web.models import Nothing, StopDone
from app.web.urgent import command

router = APIRouter()


@router.post("/live/stop")
async def stop(connection: ConnectionOf, journal: JournalOf, _request: Nothing) -> StopDone:
    """STOP to every axis. This is no safety function."""
    return await command(connection, journal, Command.STOP)


@router.post("/live/feather")
async def feather(connection: ConnectionOf, journal: JournalOf, _request: Nothing) -> StopDone:
    """FEATHER to every axis. This is no safety function."""
    return await command(connection, journal, Command.FEATHER)


@router.post(DEVICE + "/stop")
async def stop_one(connection: ConnectionOf, journal: JournalOf, target: TargetOf, _request: Nothing) -> StopDone:
    """STOP to one axis: its quick stop, on the same path. A device that is no axis is none of those stopped."""
    return await command(connection, journal, Command.STOP, target.slug)
