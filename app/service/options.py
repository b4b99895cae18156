"""How a connection is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Options:
    """``recordings`` None records nothing; ``consent`` allows active access beside another master on the bus.

    ``listen_s`` is how long is listened before anything is sent. ``data`` is the folder of what is kept; None keeps
    nothing. ``site`` is the folder of the site file, where paths in it begin. ``part_closed`` hears of every file of
    the recording that is complete, on some thread.
    """

    person: str
    recordings: Path | None
    consent: bool = False
    listen_s: float = 0.5
    data: Path | None = None
    more_recordings: tuple[Path, ...] = ()
    site: Path | None = None
    part_closed: Callable[[Path], object] | None = None
