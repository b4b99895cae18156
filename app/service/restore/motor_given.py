"""A motor as what a restore is given: its parameters for one drive, and nothing else of that drive.

In an order it stands among the sets as ``motor:ID@VERSION:SLUG``, SLUG being the drive; a restore keeps that text where
it keeps a set's id, so that it can say years later which motor it was.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterable, Mapping
from typing import Any, Final

from app.errors import UsageError
from app.service.connection import Connection
from app.service.motors import Motors, motor_set, read_identity
from app.service.restore.order import Given

_SPEC: Final = re.compile(r"motor:([0-9a-f-]{36})@([0-9]{1,6}):(.+)", re.ASCII)


def is_motor(spec: str) -> bool:
    """True for what names a motor, not a set."""
    return spec.startswith("motor:")


async def given_motor(motors: Motors, connection: Connection, spec: str, person: str) -> Given:
    """What the motor puts into its drive, which is asked who it is.

    Raises UsageError, MotorUnknownError, MotorInventedError, StoreError, BusLostError.
    """
    found = _SPEC.fullmatch(spec)
    if found is None:
        raise UsageError(reason=f"'{spec}' is not motor:ID@VERSION:TURBINE/STATION/DEVICE")
    motor = await motors.get(found[1], int(found[2]))
    target = connection.target(found[3])
    identity = await read_identity(connection.driver(target), target)
    return Given(motor_set(motor, target, identity, connection.turbine.slug, person, time.time_ns()), spec)


async def note_motors(motors: Motors, devices: Iterable[Mapping[str, Any]], person: str) -> None:
    """After a restore that ended with the new values: which of ``devices`` (of its details) drives which motor now.

    Raises MotorUnknownError, StoreError.
    """
    for device in devices:
        found = _SPEC.fullmatch((device["set"] or {}).get("record", ""))
        if found is not None and found[3] == device["slug"]:
            await motors.assign(device["slug"], await motors.get(found[1], int(found[2])), person)
