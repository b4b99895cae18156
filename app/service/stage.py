"""What screens show: a turbine's live state with its buses, of a connection or of a recording at its cursor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

from app.model.site import Turbine
from app.service.bus_feed import BusFeed
from app.service.devices import Target
from app.wire.live import LiveState


class Stage(Protocol):
    """Devices, and what is known of them now. Holds no way to reach a device."""

    @property
    def turbine(self) -> Turbine:
        """The turbine with its stations and devices."""

    @property
    def targets(self) -> Iterable[Target]:
        """All devices, station by station."""

    @property
    def live(self) -> LiveState:
        """What was seen on the wire until now."""

    @property
    def buses(self) -> Mapping[str, BusFeed]:
        """Its buses by name."""

    @property
    def stamper(self) -> Callable[[], int]:
        """The time now, in ns."""

    def recorded_files(self) -> Sequence[Path]:
        """The recording that holds what the traces no longer keep, part by part; empty where there is none."""
