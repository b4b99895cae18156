"""Moments of recordings: what was known of the devices at a time, without moving anybody's cursor."""

from __future__ import annotations

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app import __version__
from app.errors import MomentError
from app.model.sets import Origin, ParameterSet, identity_of, iso_time
from app.model.site import Turbine
from app.service.compare.known import ram_of
from app.service.devices import Target
from app.service.recording_list import Recordings
from app.service.replay.source import Source
from app.service.replay.stage import stage_near

KEPT: Final = 8
"""Moments that are kept: who compares one asks for it again and again."""
SUFFIX: Final = ".mcap"


@dataclass(frozen=True, slots=True)
class Moment:
    """The devices at ``t_ns`` of a recording, whose name is without its ending."""

    recording: str
    t_ns: int
    targets: tuple[Target, ...]

    def target(self, slug: str) -> Target:
        """One device. Raises MomentError."""
        found = next((one for one in self.targets if one.slug == slug), None)
        if found is None:
            raise MomentError(recording=self.recording, reason=f"no device '{slug}' in it")
        return found

    def parameters(self, slug: str, person: str, reason: str) -> ParameterSet:
        """The set of a device as of the moment; what was never seen until then is unread. Raises MomentError."""
        target = self.target(slug)
        values, unread = ram_of(target)
        origin = Origin(
            turbine=slug.partition("/")[0],
            device=slug,
            node=target.node,
            time=iso_time(self.t_ns),
            person=person,
            reason=reason or f"{self.recording}{SUFFIX}",
            tool=f"hubside {__version__}",
        )
        description = target.description
        return ParameterSet(description.id, description.version, identity_of(values), origin, values, unread)


class Moments:
    """Of the recordings in ``files``. ``known`` gives turbines of which names are known; ``cache`` may hold indexes."""

    def __init__(
        self, files: Recordings, known: Callable[[], Mapping[str, Turbine]], cache: Path | None = None
    ) -> None:
        self._files = files
        self._known = known
        self._cache = cache
        self._kept: OrderedDict[tuple[str, int, int, int], Moment] = OrderedDict()

    async def at(self, recording: str, t_ns: int) -> Moment:
        """A moment; outside the recording that of its nearest end. Raises MomentError, RecordingError."""
        path = self._files.path(recording + SUFFIX)
        if path is None:
            raise MomentError(recording=recording, reason="no such recording")
        stat = await asyncio.to_thread(path.stat)
        key = recording, stat.st_size, stat.st_mtime_ns, t_ns  # another file may have taken its name
        if key not in self._kept:
            self._kept[key] = await asyncio.to_thread(self._read, path, recording, t_ns)
        self._kept.move_to_end(key)
        while len(self._kept) > KEPT:
            self._kept.popitem(last=False)
        return self._kept[key]

    def _read(self, path: Path, recording: str, t_ns: int) -> Moment:
        source = Source(path, self._known(), self._cache)
        try:
            at_ns = min(max(t_ns, source.from_ns), source.to_ns)
            stage = stage_near(source, at_ns, at_ns, lambda: at_ns)
            stage.advance(at_ns, lambda: False)
            return Moment(recording, at_ns, stage.targets)
        finally:
            source.close()
