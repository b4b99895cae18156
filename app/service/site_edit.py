"""Changes the site file: turbines are added, changed and taken out while the bench runs.

The file may be written by hand as well: each change starts from what it holds now, and is refused where that is not
what the person saw. A bench that was started on a bare bus has no site file; the first change makes one in the data
folder.
"""

from __future__ import annotations

import asyncio
import hashlib
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from app.drivers.contract import FoundNode
from app.errors import SettingsError, SiteError
from app.model.description import Bus
from app.model.description_file import BUILTIN
from app.model.site import BusConfig, Device, Station, Turbine, read_site
from app.service.journal import Journal, Kind
from app.service.polling import changes_text
from app.service.site_check import check_kinds, check_turbine
from app.service.sites import Sites

_BLADES: Final = (1, 2, 3)
_BLADE_NODES: Final[Mapping[str, int]] = {"oat-pmm": 0, "oat-pmc": 10}
"""Node of blade 0 by description: the devices of blade n stand at this plus n."""
_SHORT: Final[Mapping[str, str]] = {"oat-pmm": "pmm", "oat-pmc": "pmc"}
_BENCH: Final = "bench"
_UNFIT: Final = re.compile(r"[^\w-]+", re.ASCII)


@dataclass(frozen=True, slots=True)
class SiteState:
    """The site file as it is now. ``revision`` names this very content; ``file`` is where changes go.

    ``made`` False: it is not there yet. ``problem`` is a text key that says why nothing can be changed.
    """

    file: Path | None
    made: bool
    problem: str | None
    revision: str
    turbines: tuple[Turbine, ...]


@dataclass(frozen=True, slots=True)
class Proposal:
    """Where a found device might belong. ``blade`` None: no place is usual for it."""

    found: FoundNode
    station: str
    blade: int | None
    device: str


class SiteEditor:
    """Changes the file of ``sites``, one change at a time. For one event loop."""

    def __init__(self, sites: Sites) -> None:
        self._sites = sites
        self._lock = asyncio.Lock()

    def state(self) -> SiteState:
        """What the file holds now. Raises SiteError where it was damaged by hand."""
        path, text = self._path(), self._text()
        turbines = tuple(self._sites.turbines.values()) if text is None else read_site(text, str(path))
        return SiteState(path, text is not None, _problem(path), _revision(text), turbines)

    async def add(self, turbine: Turbine, revision: str, journal: Journal) -> None:
        """Add a turbine. Raises SettingsError, SiteError, UsageError; then nothing has changed."""
        async with self._lock:
            if turbine.slug in self._start(revision):
                raise SettingsError(reason_key="settings.refused.slug_taken", slug=turbine.slug)
            await self._put(turbine, None, journal)

    async def change(self, slug: str, turbine: Turbine, revision: str, journal: Journal) -> None:
        """Have ``turbine`` in place of ``slug``; its slugs stay. Raises as ``add``."""
        async with self._lock:
            before = self._start(revision).get(slug)
            if before is None:
                raise SettingsError(reason_key="settings.refused.no_turbine", slug=slug)
            _same_slugs(before, turbine)
            await self._put(turbine, before, journal)

    async def remove(self, slug: str, revision: str, connected: Turbine | None, journal: Journal) -> None:
        """Take a turbine out. Raises as ``add``, also for the one that is connected and for the last one."""
        from app.model.site_write import without_turbine

        async with self._lock:
            known = self._start(revision)
            if slug not in known:
                raise SettingsError(reason_key="settings.refused.no_turbine", slug=slug)
            if connected is not None and connected.slug == slug:
                raise SettingsError(reason_key="settings.refused.turbine_connected", slug=slug)
            if len(known) == 1:
                raise SettingsError(reason_key="settings.refused.last_turbine", slug=slug)
            path = self._writable()
            await self._write(path, without_turbine(self._begun(), slug, str(path)))
            _note(journal, slug, known[slug], None)

    # -- inside ---------------------------------------------------------------------

    def _path(self) -> Path | None:
        return self._sites.file or self._sites.home

    def _text(self) -> str | None:
        """What the file holds; None where there is none yet. Raises SiteError."""
        path = self._path()
        if path is None or not path.exists():
            return None
        try:
            return path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise SiteError(file=str(path), key="*", reason=f"cannot be read: {error}") from error

    def _start(self, revision: str) -> dict[str, Turbine]:
        """The turbines that the change starts from. Raises SettingsError where the person saw another file."""
        state = self.state()
        if state.revision != revision:
            raise SettingsError(reason_key="settings.refused.site_changed", file=str(state.file))
        return {turbine.slug: turbine for turbine in state.turbines}

    def _writable(self) -> Path:
        path = self._path()
        problem = _problem(path)
        if path is None or problem is not None:
            raise SettingsError(reason_key=problem or "settings.refused.no_site_file", file=str(path))
        return path

    def _begun(self) -> str:
        """The text that is changed: that of the file, or of a new one with the turbines that are known so far."""
        from app.model.site_write import empty_site, with_turbine

        text = self._text()
        if text is None:
            text = empty_site()
            for turbine in self._sites.turbines.values():
                text = with_turbine(text, turbine, str(self._path()))
        return text

    async def _put(self, turbine: Turbine, before: Turbine | None, journal: Journal) -> None:
        from app.model.site_write import with_turbine

        path = self._writable()
        check_kinds(turbine, str(path))
        text = with_turbine(self._begun(), turbine, str(path))
        check_turbine(turbine, self._sites.describe, str(path))
        await self._write(path, text)
        _note(journal, turbine.slug, before, turbine)

    async def _write(self, path: Path, text: str) -> None:
        from app.model.site_write import write_site

        try:
            await asyncio.to_thread(write_site, path, text)
        except OSError as error:
            raise SiteError(file=str(path), key="*", reason=f"cannot be written: {error}") from error
        self._sites.file = path
        self._sites.reload()


def _problem(path: Path | None) -> str | None:
    if path is None:
        return "settings.refused.no_site_file"
    folder = path.resolve().parent
    while not folder.exists():
        folder = folder.parent
    may = os.access(folder, os.W_OK) and (not path.exists() or os.access(path, os.W_OK))
    return None if may else "settings.refused.site_read_only"


def _revision(text: str | None) -> str:
    return "" if text is None else hashlib.sha256(text.encode()).hexdigest()[:16]


def _same_slugs(before: Turbine, after: Turbine) -> None:
    """Slugs are permanent: sets, recordings and the audit name devices by them. Raises SettingsError."""
    if after.slug != before.slug:
        raise SettingsError(reason_key="settings.refused.slug_permanent", slug=before.slug)
    kept = {device.slug for device in after.devices}
    places = {(device.bus, device.node): device.slug for device in after.devices}
    for device in before.devices:
        now = places.get((device.bus, device.node))
        if device.slug not in kept and now is not None:
            raise SettingsError(reason_key="settings.refused.slug_permanent", slug=device.slug, now=now)


# -- what changed -----------------------------------------------------------------------


def _note(journal: Journal, slug: str, before: Turbine | None, after: Turbine | None) -> None:
    what = "settings.turbine_changed"
    if before is None:
        what = "settings.turbine_added"
    elif after is None:
        what = "settings.turbine_removed"
    changes = changes_text(_document(before), _document(after))
    if changes:
        journal.note(Kind.SETTINGS_CHANGED, None, what_key=what, subject=slug, changes=changes)


def _document(turbine: Turbine | None) -> dict[str, Any]:
    if turbine is None:
        return {}
    stations = {
        station.slug.split("/", 1)[1]: {
            "name": station.name,
            "blade": station.blade,
            **{device.slug.rsplit("/", 1)[1]: _device_text(device) for device in station.devices},
        }
        for station in turbine.stations
    }
    buses = {bus.name: _bus_text(bus) for bus in turbine.buses}
    return {"name": turbine.name, "bus": buses, "station": stations}


def _bus_text(bus: BusConfig) -> str:
    if bus.kind is Bus.MODBUS_TCP:
        return f"{bus.connection} {', '.join(bus.ranges)}"
    master = f", master {bus.master}" if bus.kind is Bus.PROFIBUS_DP else ""
    return f"{bus.connection}@{bus.bitrate}{master}"


def _device_text(device: Device) -> str:
    text = f"{device.name}, {device.description_id}, {device.bus} node {device.node}"
    address = f" at {device.address}" if device.address else ""
    return (
        text + address + _slave_text(device) + (f", stopped by {device.external_stop}" if device.external_stop else "")
    )


def _slave_text(device: Device) -> str:
    slave = device.slave
    telegram = "" if slave.telegram is None else f", telegram {slave.telegram}"
    order = f", order {slave.pzd_order}" if slave.pzd_order else ""
    gsd = f", {slave.gsd}: {', '.join(slave.modules)}" if slave.gsd else ""
    return telegram + order + gsd


# -- found devices ------------------------------------------------------------------------


def propose(found: list[FoundNode]) -> list[Proposal]:
    """A place for each found device: the usual one by its node, else a station of its own on the bench."""
    return [_proposal(node) for node in found]


def _proposal(found: FoundNode) -> Proposal:
    base = _BLADE_NODES.get(found.description_id or "")
    blade = None if base is None else found.node - base
    if blade in _BLADES:
        return Proposal(found, f"blade-{blade}", blade, _SHORT[found.description_id or ""])
    kind = _UNFIT.sub("-", _SHORT.get(found.description_id or "", found.description_id or "node")).strip("-").lower()
    return Proposal(found, _BENCH, None, f"{kind}-{found.node}")


def built_in() -> tuple[str, ...]:
    """Ids of the descriptions that come with the program."""
    return tuple(BUILTIN)


def turbine_of(
    slug: str, name: str, buses: list[BusConfig], stations: list[tuple[str, str, int | None, list[Device]]]
) -> Turbine:
    """A turbine of parts whose slugs are their own part of the path only."""
    made = tuple(
        Station(
            f"{slug}/{at}",
            title,
            blade,
            tuple(replace(one, slug=f"{slug}/{at}/{one.slug}") for one in devices),
        )
        for at, title, blade, devices in stations
    )
    return Turbine(slug, name, tuple(buses), made)
