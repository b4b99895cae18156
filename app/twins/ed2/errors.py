"""Errors of the device: codes and reactions as the description has them (ED2 manual, 4.8.1), and which are active."""

from __future__ import annotations

from typing import Final, NamedTuple

from app.model.description import Description
from app.twins.ed2.states import Reaction

SUPPLY: Final = "ed2_supply"
LIMIT_NEGATIVE: Final = "ed2_limit_negative"
LIMIT_POSITIVE: Final = "ed2_limit_positive"
JOYSTICK: Final = "ed2_joystick"
MAGNET_A: Final = "ed2_magnet_a"
MAGNET_B: Final = "ed2_magnet_b"
FOLLOWING: Final = "ed2_following"


class Known(NamedTuple):
    """One error of the description."""

    code: int
    reaction: Reaction


class Catalogue:
    """Errors by their family and axis."""

    def __init__(self, description: Description) -> None:
        self._known = {
            (error.aid or error.name, error.number): Known(error.code, Reaction(error.reaction))
            for error in description.errors.values()
            if error.reaction
        }

    def of(self, family: str, axis: int) -> Known:
        """The error of a family on an axis (1 or 2). Raises KeyError."""
        return self._known.get((family, axis)) or self._known[family, None]


class Active:
    """Errors of one axis that were not reset, the first one first."""

    def __init__(self, catalogue: Catalogue, axis: int) -> None:
        self._catalogue = catalogue
        self._axis = axis
        self._codes: list[int] = []

    @property
    def code(self) -> int:
        """0/36: the error that came first; 0 where there is none."""
        return self._codes[0] if self._codes else 0

    def raised(self, family: str) -> Reaction | None:
        """Something is wrong: its reaction where it is new."""
        known = self._catalogue.of(family, self._axis)
        if known.code in self._codes:
            return None
        self._codes.append(known.code)
        return known.reaction

    def has(self, family: str) -> bool:
        """Whether this error was raised and not reset."""
        return self._catalogue.of(family, self._axis).code in self._codes

    def clear(self) -> None:
        """Reset."""
        self._codes.clear()
