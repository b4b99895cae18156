"""How a connection is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Options:
    """``recordings`` None records nothing; ``consent`` allows active access beside another master on the bus.

    ``listen_s`` is how long is listened before anything is sent. ``data`` is the folder of what is kept; None keeps
    nothing.
    """

    person: str
    recordings: Path | None
    consent: bool = False
    listen_s: float = 0.5
    data: Path | None = None
