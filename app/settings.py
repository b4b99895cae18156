"""Settings of a run: environment and command line become one frozen object that is passed in, never global."""

from __future__ import annotations

import getpass
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

DEFAULT_PORT = 8600
TWIN_PORT = 29536


@dataclass(frozen=True, slots=True)
class Settings:
    """What a run needs to know of its surroundings."""

    data: Path
    language: str
    person: str

    @property
    def recordings(self) -> Path:
        """Where recordings are kept."""
        return self.data / "recordings"

    @property
    def sets(self) -> Path:
        """Where set files are written."""
        return self.data / "sets"


def settings_from(environment: Mapping[str, str], data: Path | None = None) -> Settings:
    """Settings of this run; ``data`` of the command line goes before ``HUBSIDE_DATA`` and the system's usual place."""
    folder = data or (Path(environment["HUBSIDE_DATA"]) if environment.get("HUBSIDE_DATA") else _usual(environment))
    language = environment.get("HUBSIDE_LANGUAGE") or environment.get("LANG", "en")[:2].lower()
    return Settings(
        data=folder.expanduser().absolute(),
        language=language if language in ("en", "de") else "en",
        person=environment.get("HUBSIDE_PERSON") or _user(),
    )


def _usual(environment: Mapping[str, str]) -> Path:
    if sys.platform == "win32":
        return Path(environment.get("LOCALAPPDATA", str(Path.home() / "AppData" / "Local"))) / "Hubside"
    return Path(environment.get("XDG_DATA_HOME", str(Path.home() / ".local" / "share"))) / "hubside"


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):  # no such user in the system's table
        return f"uid {os.getuid()}" if hasattr(os, "getuid") else "unknown"
