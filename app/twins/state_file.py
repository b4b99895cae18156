"""The non-volatile memory of one twin, as a readable JSON file that survives a kill at any moment.

Replaced as a whole: written beside, flushed to the disk, renamed over the old one. A damaged file is never a crash: its
content is set aside, the reason told, and the device starts with its defaults, as a drive with a lost EEPROM would.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from app.errors import UsageError
from app.model.address import Address, parse_address

FORMAT: Final = "hubside-twin-state/1"


@dataclass(slots=True)
class Memory:
    """What a device keeps without power: saved parameters, and remanent values that it counts itself."""

    saved: dict[Address, bytes] = field(default_factory=dict)
    remanent: dict[Address, bytes] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Loaded:
    """A memory as found: ``memory`` is None where there is none yet, ``problem`` says why one could not be used."""

    memory: Memory | None
    problem: str | None = None


class StateFile:
    """The file of one device. ``description_id`` must be that of the file, or the file is not used."""

    def __init__(self, path: Path, description_id: str) -> None:
        self._path = path
        self._description_id = description_id

    def load(self) -> Loaded:
        """Read the memory. A damaged file is renamed to ``*.damaged`` and reported."""
        try:
            text = self._path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return Loaded(None)
        except (OSError, UnicodeDecodeError) as error:
            return self._damaged(str(error))
        try:
            return Loaded(self._parse(json.loads(text)))
        except (ValueError, KeyError, TypeError, AttributeError, UsageError) as error:
            return self._damaged(str(error) or type(error).__name__)

    def store(self, memory: Memory) -> None:
        """Replace the file; when this returns, the memory is on the disk. Raises OSError."""
        document = {
            "format": FORMAT,
            "description": self._description_id,
            "saved": _texts(memory.saved),
            "remanent": _texts(memory.remanent),
        }
        self._path.parent.mkdir(parents=True, exist_ok=True)
        beside = self._path.with_suffix(".new")
        with beside.open("w", encoding="utf-8") as file:
            json.dump(document, file, indent=1, sort_keys=True)
            file.write("\n")
            file.flush()
            os.fsync(file.fileno())
        beside.replace(self._path)
        _sync_folder(self._path.parent)

    def _parse(self, document: Mapping[str, Any]) -> Memory:
        if document["format"] != FORMAT:
            raise ValueError(f"format is {document['format']!r}, not {FORMAT!r}")
        if document["description"] != self._description_id:
            raise ValueError(f"it belongs to {document['description']!r}, not to {self._description_id!r}")
        return Memory(_values(document["saved"]), _values(document["remanent"]))

    def _damaged(self, reason: str) -> Loaded:
        aside = self._path.with_suffix(".damaged")
        problem = f"{self._path}: {reason}; starting with defaults"
        try:
            self._path.replace(aside)
        except OSError as error:
            return Loaded(None, f"{problem} (and it could not be set aside: {error})")
        return Loaded(None, f"{problem}, the damaged file is kept as {aside.name}")


def _texts(values: Mapping[Address, bytes]) -> dict[str, str]:
    return {str(address): data.hex() for address, data in values.items()}


def _values(texts: Mapping[str, str]) -> dict[Address, bytes]:
    return {parse_address(address): bytes.fromhex(text) for address, text in texts.items()}


def _sync_folder(folder: Path) -> None:
    """Make a rename durable where the system can (Windows cannot open folders)."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
