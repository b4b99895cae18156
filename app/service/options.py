"""How a connection is made."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Options:
    """``recordings`` None records nothing; ``consent`` allows active access beside another master on the bus.

    ``listen_s`` is how long is listened before anything is sent.
    """

    person: str
    recordings: Path | None
    consent: bool = False
    listen_s: float = 0.5
