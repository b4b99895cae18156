"""The stage of a replay: decoders and live state as they were at the cursor, made by the frames up to there.

The same decoders, trace and live state as of a connection; only the frames come from a file, in the order of
``recording.index.steps``. A stage goes forwards only: for an earlier time another one is made.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from threading import Lock
from typing import Any, Final

from app.errors import RecordingError
from app.recording.content import Keyframe
from app.recording.index import Step, steps
from app.service.bus_feed import BusFeed
from app.service.devices import Target
from app.service.replay.source import Source
from app.wire.frame import Frame
from app.wire.live import LiveState

log = logging.getLogger(__name__)

BATCH: Final = 256
"""Frames decoded under one lock."""


class ReplayStage:
    """The state at ``t_ns``. ``advance`` for one thread; all else as of a connection. ``stamper`` is the cursor.

    Raises RecordingError where ``keyframe`` is none of ours.
    """

    def __init__(self, source: Source, keyframe: Keyframe | None, stamper: Callable[[], int]) -> None:
        self.turbine = source.turbine
        self.live = LiveState()
        self.stamper = stamper
        self.t_ns = source.from_ns - 1 if keyframe is None else keyframe.t_ns
        self._files = (source.path,)
        self._lock = Lock()
        self.targets = tuple(
            Target(device, source.descriptions[device.bus, device.node], self.live)
            for device in source.turbine.devices
            if (device.bus, device.node) in source.descriptions
        )
        self.buses = {bus.name: self._feed(source, bus.name, bus.bitrate) for bus in source.turbine.buses}
        if keyframe is not None:
            self._restore(keyframe.state, source)
        self._heard_ns = self.live.t_ns if keyframe is None else keyframe.state.get("heard_ns", self.live.t_ns)
        self._source = source
        frames = source.frames(self.t_ns + 1)
        self._steps = steps(frames, source.marks, self._heard_ns, self.t_ns, source.to_ns)
        self._step: Step | None = None
        self._frames: deque[Frame] = deque()
        self._go_on()

    def recorded_files(self) -> Sequence[Path]:
        """The recording itself."""
        return self._files

    def advance(self, to_ns: int, stop: Callable[[], bool]) -> int:
        """Take all up to and with ``to_ns``, or until ``stop`` says so between two batches; gives how far it came."""
        while self._step is not None and (self._step.t_ns <= to_ns or (self._frames and self._frames[0].t_ns <= to_ns)):
            batch = list(self._batch(to_ns))
            if batch:
                self._take(batch)
                self.t_ns = max(self.t_ns, batch[-1].t_ns)
            elif not self._frames:
                self._end_step(self._step)
            if stop():
                return self.t_ns
        self.t_ns = max(self.t_ns, to_ns)
        return self.t_ns

    def _batch(self, until_ns: int) -> Iterator[Frame]:
        """The next frames of the step, in no case beyond its end."""
        for _ in range(BATCH):
            if not self._frames or self._frames[0].t_ns > until_ns:
                return
            yield self._frames.popleft()

    def _end_step(self, step: Step) -> None:
        """What acts behind the frames of a step: frames are missing, the file tells the state, or the clock."""
        self.t_ns = max(self.t_ns, step.t_ns)
        if step.mark is not None and step.mark.state is not None:
            self._restore(step.mark.state, self._source)
        elif step.mark is not None:
            for name, feed in self.buses.items():
                if step.mark.bus in ("", name):
                    feed.gap(step.mark.t_ns, step.mark.reason)
        if step.tick:
            with self._lock:
                self.live.tick(step.t_ns)
        self._go_on()

    def _go_on(self) -> None:
        self._step = next(self._steps, None)
        self._frames.extend(() if self._step is None else self._step.frames)

    def _take(self, frames: Sequence[Frame]) -> None:
        for bus, of_bus in groupby(frames, key=attrgetter("bus")):
            feed = self.buses.get(bus)
            if feed is not None:
                feed.take(list(of_bus))

    def _feed(self, source: Source, name: str, bitrate: int) -> BusFeed:
        described = {target.node: target.description for target in self.targets if target.device.bus == name}
        servers = {node: server.text for node, server in self.turbine.servers(name).items()} or None
        orders = {node: order for (bus, node), order in source.orders.items() if bus == name}
        feed = BusFeed(name, bitrate, described, self.live, self._lock, servers, source.kinds.get(name), orders)
        for node, description in described.items():
            feed.describe(node, description)
        return feed

    def _restore(self, state: Mapping[str, Any], source: Source) -> None:
        try:
            self.live.restore(state["live"])
            for name, decoder in state["decoders"].items():
                if name in self.buses:
                    self.buses[name].decoder.restore(decoder)
        except (KeyError, ValueError, TypeError, AttributeError, IndexError) as error:
            reason = f"the state at {self.t_ns} cannot be read: {error!r}"
            raise RecordingError(file=source.path.name, offset=0, reason=reason) from error


def stage_near(source: Source, wanted_ns: int, t_ns: int, stamper: Callable[[], int]) -> ReplayStage:
    """A stage from the last state of the recording at or before ``wanted_ns``, where there is one, else ``t_ns``.

    A state that makes no sense is passed over for the one before, down to the beginning of the recording.
    """
    keyframe = source.keyframe(wanted_ns) or source.keyframe(t_ns)
    while keyframe is not None:
        try:
            return ReplayStage(source, keyframe, stamper)
        except RecordingError as error:
            log.warning("%s", error)
            keyframe = source.keyframe(keyframe.t_ns - 1)
    return ReplayStage(source, None, stamper)
