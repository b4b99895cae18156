"""A recording as analysis looks at it: its index, its places, its signs and trips. Read only, one thread at a time."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

from app.errors import IndexMissingError
from app.model.address import Address
from app.model.datatypes import Raw, decode_raw
from app.model.description import Entry, Quantity
from app.model.values import quantity_of
from app.recording.content import RecordingInfo
from app.recording.index import RecordingIndex, build_index, open_index
from app.recording.node_table import NodeKey
from app.recording.reader import open_recording
from app.service.analysis.places import Places, places_of
from app.service.analysis.trips import Trip, find_trips, tripped_before
from app.wire.signs import Sign, folded

Progress = Callable[[float], None]


class Look:
    """An indexed recording. Use as a context manager.

    ``cache`` is where an index may lie whose recording is in a folder that cannot be written. Raises RecordingError
    where the file cannot be read, and IndexMissingError where it has no index, or one of another state of the file.
    ``check`` is called now and then by what takes long, and raises where it is to end.
    """

    def __init__(self, path: Path, cache: Path | None = None, check: Callable[[], None] | None = None) -> None:
        self.path = path
        self.check = check or _go_on
        index = open_index(path, cache)
        if index is None:
            with open_recording(path):  # a broken file is told as such
                raise IndexMissingError(recording=path.name)
        self.index: RecordingIndex = index
        try:
            with open_recording(path) as recording:
                self.info: RecordingInfo = recording.info
        except BaseException:
            index.close()
            raise

    def __enter__(self) -> Look:
        return self

    def __exit__(self, *_: object) -> None:
        self.index.close()

    @property
    def name(self) -> str:
        """The file's name."""
        return self.path.name

    @property
    def span_ns(self) -> tuple[int, int]:
        """Times of the first and the last frame."""
        return self.index.span_ns

    @cached_property
    def places(self) -> Places:
        """The devices by bus and node."""
        return places_of(self.info)

    @cached_property
    def signs(self) -> list[Sign]:
        """All signs by time, chatter folded."""
        return folded(self.index.signs())

    @cached_property
    def trips(self) -> list[Trip]:
        """All trips by time."""
        return find_trips(self.signs, self.places)

    @cached_property
    def tripped_before(self) -> tuple[NodeKey, ...]:
        """The nodes that were tripped when the recording began."""
        return tripped_before(self.signs)

    def entry(self, key: NodeKey, address: Address) -> Entry | None:
        """The description's entry of an object of a node; None where nothing describes it."""
        description = self.index.descriptions.get(key)
        return None if description is None else description.entries.get(address)

    def quantity(self, key: NodeKey, entry: Entry) -> Quantity:
        """Unit and factor of a node's object, by the values of other objects that the recording shows."""
        return quantity_of(entry, lambda address: self._latest(key, address))

    def _latest(self, key: NodeKey, address: Address) -> Raw | None:
        entry = self.entry(key, address)
        if entry is None:
            return None
        for change in reversed(self.index.history(*key, address)):
            if change.data is not None:
                try:
                    return decode_raw(entry.type, change.data)
                except ValueError:
                    return None
        return entry.default


def _go_on() -> None:
    """Nobody wants it to end."""


def make_index(
    path: Path,
    cache: Path | None = None,
    on_progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> None:
    """Make the index of a recording by the descriptions that it names. Raises RecordingError."""
    with open_recording(path) as recording:
        descriptions = recording.descriptions
    build_index(path, descriptions, on_progress, cancelled, cache).close()


def look_at(path: Path, cache: Path | None = None, on_progress: Progress | None = None) -> Look:
    """The recording, indexed first where it is not. Raises RecordingError."""
    try:
        return Look(path, cache)
    except IndexMissingError:
        make_index(path, cache, on_progress)
    return Look(path, cache)
