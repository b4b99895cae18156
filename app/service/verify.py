"""Hold a description against the device itself: what the device has otherwise than we say of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Protocol, runtime_checkable

from app.drivers.contract import Driver
from app.errors import UsageError
from app.model.address import Address
from app.service.connection import Connection
from app.service.devices import Target
from app.service.journal import Journal, Kind
from app.service.stage import Stage


class Finding(Protocol):
    """One difference, as a driver tells it. ``expected`` and ``found`` count what the deviation is about."""

    @property
    def address(self) -> Address:
        """The object."""

    @property
    def deviation(self) -> Enum:
        """How it differs; its value is the end of a text key."""

    @property
    def expected(self) -> int | None:
        """What the description says; None: nothing."""

    @property
    def found(self) -> int | None:
        """What the device has; None: nothing."""


@runtime_checkable
class Verifies(Protocol):
    """A driver whose bus gives the whole dictionary of a device, so that a description can be held against it."""

    async def verify(self, node: int) -> tuple[Finding, ...]:
        """See ``app.drivers.modbus``."""


@dataclass(frozen=True, slots=True)
class Verified:
    """What a look at the whole dictionary gave; ``t_ns`` is when it ended."""

    t_ns: int
    objects: int
    findings: tuple[Finding, ...]


def verifiable(stage: Stage) -> frozenset[str]:
    """Slugs of the devices that can be verified: over a bus that gives their dictionary; in a recording none."""
    if not isinstance(stage, Connection):
        return frozenset()
    return frozenset(target.slug for target in stage.targets if isinstance(stage.driver(target), Verifies))


async def verify(driver: Driver, target: Target, journal: Journal, now_ns: Callable[[], int]) -> Verified:
    """Read the whole dictionary and compare; noted in the journal.

    Raises UsageError where the bus gives no whole dictionary, and what reading raises.
    """
    if not isinstance(driver, Verifies):
        raise UsageError(reason=f"the bus of {target.slug} does not give the list of a device's objects")
    findings = await driver.verify(target.node)
    done = Verified(now_ns(), len(target.description.entries), findings)
    journal.note(Kind.VERIFIED, target.slug, count=len(findings), objects=done.objects)
    return done
