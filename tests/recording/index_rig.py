"""What the tests of indexes share: the index of each scenario, and what reading it from its beginning tells."""

from __future__ import annotations

import random
import shutil
import tempfile
from atexit import register
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from app.recording.index import Course, RecordingIndex, build_index, steps
from app.recording.index.course import Descriptions
from app.recording.reader import open_recording
from app.wire.events import Event
from app.wire.records import ValueSeen
from app.wire.signs import Sign, SignFinder, folded

FOLDER = Path(__file__).resolve().parents[2] / "recordings" / "scenarios"
SCENARIOS = sorted(FOLDER.glob("[0-9]-*.mcap"))
TIMES = 6


def descriptions_of(path: Path) -> Descriptions:
    with open_recording(path) as recording:
        return recording.descriptions


def built(path: Path, **more: Any) -> RecordingIndex:
    return build_index(path, descriptions_of(path), **more)


def plain(state: Mapping[str, Any]) -> dict[str, Any]:
    """A state without what depends on the way to it: the versions of events."""
    live = {**state["live"], "events": [{**event, "version": 0} for event in state["live"]["events"]]}
    return {"live": live, "decoders": state["decoders"]}


class Told:
    """All that a file tells when it is read from its beginning, with the states at some random times."""

    def __init__(self, path: Path, index: RecordingIndex) -> None:
        self.values: dict[tuple[Any, ...], list[ValueSeen]] = defaultdict(list)
        self.states: dict[int, dict[str, Any]] = {}
        descriptions = descriptions_of(path)
        course, finder = Course((), descriptions, 1_000_000), SignFinder(descriptions)
        signs: list[Sign] = []
        (at_ns, end_ns), chance = index.span_ns, random.Random(path.name)
        at_ns -= 1
        with open_recording(path) as recording:
            for t_ns in sorted([*(chance.randrange(at_ns, end_ns) for _ in range(TIMES)), end_ns]):
                frames = recording.frames(at_ns + 1, t_ns + 1)
                for step in steps(frames, index.marks(at_ns + 1, t_ns + 1), course.heard_ns, at_ns, t_ns):
                    for record in course.take(step):
                        signs += finder.feed(record)
                        if isinstance(record, ValueSeen):
                            self.values[record[1:4]].append(record)
                    if step.tick:
                        signs += finder.tick(step.t_ns)
                self.states[t_ns] = plain(course.snapshot())
                at_ns = t_ns
        self.signs = folded([*signs, *finder.finish(end_ns)])
        self.events: list[Event] = [event._replace(version=0) for event in course.live.events()]


@cache
def _folder() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="hubside-index-"))
    register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@cache
def indexed(path: Path) -> RecordingIndex:
    """The index of a scenario, made once."""
    copy = _folder() / path.name
    shutil.copy(path, copy)
    return built(copy)


@cache
def told(path: Path) -> Told:
    return Told(path, indexed(path))
