"""What a device has otherwise than its description says."""

from __future__ import annotations

from fastapi import APIRouter

from app.model.roles import Role
from app.service.verify import verify
from app.web.deps import DEVICE, ConnectionOf, JournalOf, TargetOf, needs
from app.web.models import Nothing
from app.web.models.verify import VerifyDone

router = APIRouter(dependencies=[needs(Role.TECHNICIAN)])


@router.post(f"{DEVICE}/verify")
async def verify_device(
    connection: ConnectionOf, journal: JournalOf, target: TargetOf, _request: Nothing
) -> VerifyDone:
    """Read the whole dictionary of the device and hold its description against it. Writes nothing."""
    return VerifyDone.of(await verify(connection.driver(target), target, journal, connection.stamper))
