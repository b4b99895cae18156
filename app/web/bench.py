"""What the web needs of the bench: a narrow view of ``app.service.connection.Connection``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

from app.drivers.contract import Driver
from app.model.site import Turbine
from app.recording.writer import RecorderStatus
from app.service.devices import Target
from app.service.journal import Journal
from app.service.link import Bus
from app.service.stop import Axis
from app.wire.live import LiveState


class Records(Protocol):
    """What is needed of a recording."""

    def status(self) -> RecorderStatus:
        """What the recorder does, as of now."""


class Bench(Protocol):
    """A connected turbine."""

    @property
    def turbine(self) -> Turbine:
        """Its stations and devices."""

    @property
    def live(self) -> LiveState:
        """What is known from the wire."""

    @property
    def journal(self) -> Journal:
        """What was done and what happened."""

    @property
    def stamper(self) -> Callable[[], int]:
        """Gives the time in ns, strictly increasing."""

    @property
    def buses(self) -> Mapping[str, Bus]:
        """Its buses by name."""

    @property
    def recording(self) -> Records | None:
        """The recording, or None where nothing is recorded."""

    @property
    def targets(self) -> Iterable[Target]:
        """All devices, station by station."""

    def target(self, slug: str) -> Target:
        """The device with this slug. Raises UsageError."""

    def driver(self, target: Target) -> Driver | Any:
        """The driver of the device's bus."""

    def axes(self) -> list[Axis]:
        """Every axis, and how its controlword is reached."""
