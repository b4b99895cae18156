"""Who is at work at which device: what must come to its end whole excludes what would cut it in two.

A change of PDOs and a restore want a device for themselves: neither begins while anything else is under way there, and
while one is, nothing else is written, saved or restarted (``service.gate``). A batch of writes and a battery test only
keep these two away. A single write, a save or a restart holds no claim: it only asks whether somebody has the device
for himself. STOP, FEATHER and reading never ask. Claims are taken and given back in the event loop without waiting in
between, so that of two that begin at once one is refused before it has sent anything.

Axes are held by their desk (``Axes``): while one is under way nothing of its device is written, saved or restarted by
anybody else; while it is prepared it is neither saved nor restarted, and what it rests on is not written.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from app.errors import DeviceBusyError
from app.model.address import Address


class Work(Enum):
    """What is under way; the value is the end of its text key ``device_work.…``."""

    PDOS = "pdos"
    RESTORE = "restore"
    WRITES = "writes"
    BATTERY = "battery"
    MOTION = "motion"

    @property
    def alone(self) -> bool:
        """True for what suffers nothing else at its devices."""
        return self in (Work.PDOS, Work.RESTORE)

    @property
    def text_key(self) -> str:
        """Key of its name in the catalogue."""
        return f"device_work.{self.value}"


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """Somebody's work at some devices (slugs)."""

    work: Work
    person: str
    devices: frozenset[str]

    def refusal(self, device: str) -> DeviceBusyError:
        """What keeps others from the device."""
        return DeviceBusyError(device=device, work_key=self.work.text_key, person=self.person)


class Axes(Protocol):
    """What the desk of a connection keeps others from."""

    def keeper(self, device: str, address: Address | None) -> str | None:
        """Who keeps an object of the device from being written; None: the device from being restarted or restored."""

    def changed(self, device: str) -> Mapping[Address, tuple[bytes, bytes]]:
        """What is changed there for motion: what each object held, and what was written."""


class Claims:
    """The claims on the devices of one connection. Belongs to the event loop. ``axes``: its desk, where it has one."""

    def __init__(self) -> None:
        self._now: list[Claim] = []
        self.axes: Axes | None = None

    @contextmanager
    def held(self, work: Work, person: str, devices: Iterable[str]) -> Iterator[None]:
        """Have all these devices for ``work`` meanwhile. Raises DeviceBusyError; then none is claimed."""
        claim = Claim(work, person, frozenset(devices))
        for other in self._now:
            if work.alone or other.work.alone:
                for device in sorted(claim.devices & other.devices):
                    raise other.refusal(device)
        if work.alone:
            for device in sorted(claim.devices):
                self._require_no_motion(device, None)
        self._now.append(claim)
        try:
            yield
        finally:
            self._now.remove(claim)

    def require_free(self, device: str, address: Address | None = None) -> None:
        """Raises DeviceBusyError where somebody has the device for himself, or moves it.

        ``address`` is about to be written, 1010h of a save; None: the device is about to be restarted.
        """
        self.require_unclaimed(device)
        self._require_no_motion(device, address)

    def require_unclaimed(self, device: str) -> None:
        """Raises DeviceBusyError where somebody has the device for himself; whether it moves is not asked."""
        for claim in self._now:
            if claim.work.alone and device in claim.devices:
                raise claim.refusal(device)

    def _require_no_motion(self, device: str, address: Address | None) -> None:
        person = None if self.axes is None else self.axes.keeper(device, address)
        if person is not None:
            raise DeviceBusyError(device=device, work_key=Work.MOTION.text_key, person=person)
