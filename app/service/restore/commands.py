"""STOP and FEATHER as a restore sees them: how many there were when a person decided, and how many there are now."""

from __future__ import annotations

from collections.abc import Mapping

from app.service.connection import Connection
from app.service.stop import machine_of

Counts = Mapping[str, int]
"""How many commands each axis of a connection has got, by slug."""


def commands_of(connection: Connection) -> Counts:
    """Those of now. All axes count, also those that a restore is not about: people stop the machine, not a device."""
    return {
        axis.target.slug: axis.driver.commanded(axis.target.node, machine_of(axis.target).controlword)
        for axis in connection.axes()
    }
