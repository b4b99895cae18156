"""The homing methods (6098h) that the description of an axis knows. Pure."""

from __future__ import annotations

from typing import Final

from app.model.address import Address
from app.service.devices import Target

METHOD: Final = Address(0x6098)
HERE: Final = 35
"""Takes the position where it stands."""


def methods_of(target: Target) -> tuple[int, ...]:
    """The methods by number; none where the description names none."""
    entry = target.description.entries.get(METHOD)
    if entry is None or entry.enumeration is None:
        return ()
    return tuple(value.value for value in target.description.enumerations[entry.enumeration].values)


def searches(target: Target) -> bool:
    """The drive has methods by which it looks for its home."""
    return any(method != HERE for method in methods_of(target))
