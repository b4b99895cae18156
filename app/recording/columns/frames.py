"""The CAN frames of a recording as columns."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from app.recording.can_table import CanColumns
from app.recording.columns.blocks import Span, can_blocks
from app.recording.reader import Recording, open_recording


def can_columns(
    recording: Path | Recording,
    buses: Collection[str] | None = None,
    start_ns: int | None = None,
    end_ns: int | None = None,
    workers: int | None = None,
) -> Iterator[CanColumns]:
    """The CAN frames of ``buses`` (None: all) from ``start_ns`` on and before ``end_ns``, some chunks at a time.

    Those of each bus come in the order of time; of several buses, stretches of some seconds take turns. ``workers``
    threads unpack ahead; by default as many as the machine has cores. What cannot be read is listed in the recording's
    ``damages``. Raises ``RecordingError`` as ``open_recording`` does.
    """
    with opened(recording) as source:
        for block in can_blocks(source, buses, Span(start_ns, end_ns), workers):
            yield block.gather(slice(None))


@contextmanager
def opened(recording: Path | Recording) -> Iterator[Recording]:
    """The recording itself, or that of a path, which is closed in the end."""
    if isinstance(recording, Recording):
        yield recording
        return
    with open_recording(recording) as source:
        yield source
