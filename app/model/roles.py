"""Who may do what: three roles, each of which may do all that the one below may."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Role(Enum):
    """A viewer reads; a technician connects, writes and saves; an expert also does what the maker does, and users."""

    VIEWER = "viewer"
    TECHNICIAN = "technician"
    EXPERT = "expert"

    def covers(self, needed: Role) -> bool:
        """True where this role may do what ``needed`` may."""
        return _RANK[self] >= _RANK[needed]

    @property
    def text_key(self) -> str:
        """Text key of its name."""
        return f"role.{self.value}"


_RANK = {Role.VIEWER: 0, Role.TECHNICIAN: 1, Role.EXPERT: 2}


@dataclass(frozen=True, slots=True)
class SignedIn:
    """Who is at work. ``user_id`` is None for a session that a launch token opened: nobody has given a name there."""

    person: str
    role: Role
    user_id: str | None = None
