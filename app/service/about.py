"""What the program is: its version, where it keeps things, and the libraries that it is made of, and their licences."""

from __future__ import annotations

import platform
import re
import shutil
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Final

from app import __version__

PACKAGE: Final = "hubside"
_NAME: Final = re.compile(r"^[A-Za-z0-9._-]+")
_LONGEST: Final = 60
"""Some packages give the whole text of their licence where its name belongs."""


@dataclass(frozen=True, slots=True)
class Library:
    """A library; ``licence`` as it names it itself, empty where it does not."""

    name: str
    version: str
    licence: str


@dataclass(frozen=True, slots=True)
class Program:
    """``data`` is the data folder, None where nothing is kept."""

    version: str
    python: str
    system: str
    data: Path | None
    free_bytes: int | None
    libraries: tuple[Library, ...]


def describe(site_home: Path | None) -> Program:
    """The running program; ``site_home`` is a file of its data folder. Reads files."""
    data = None if site_home is None else site_home.parent
    free = None if data is None or not data.exists() else shutil.disk_usage(data).free
    system = f"{platform.system()} {platform.release()} ({platform.machine()})"
    return Program(__version__, platform.python_version(), system, data, free, libraries())


def libraries() -> tuple[Library, ...]:
    """What this program needs itself, by name; empty where it is not installed as a package."""
    try:
        wanted = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        return ()
    names = {match[0] for line in wanted if "extra ==" not in line and (match := _NAME.match(line))}
    found = []
    for name in sorted(names, key=str.lower):
        try:
            found.append(_library(metadata.distribution(name)))
        except metadata.PackageNotFoundError:  # a requirement of another platform
            continue
    return tuple(found)


def _library(distribution: metadata.Distribution) -> Library:
    about = distribution.metadata
    licence = next((about[key] for key in ("License-Expression", "License") if key in about), "")
    if not licence or len(licence) > _LONGEST or "\n" in licence:
        classifiers = [one for one in about.get_all("Classifier") or [] if one.startswith("License ::")]
        licence = classifiers[0].rsplit(" :: ", 1)[-1] if classifiers else ""
    return Library(about["Name"], distribution.version, licence)
