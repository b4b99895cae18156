"""Passwords: argon2id with the default profile of argon2-cffi (RFC 9106, low memory), hashed off the event loop."""

from __future__ import annotations

import asyncio
import unicodedata
from typing import Final

from argon2 import PasswordHasher
from argon2.exceptions import InvalidHashError, VerificationError, VerifyMismatchError

from app.errors import UserRuleError

SHORTEST: Final = 10
LONGEST: Final = 200
AT_ONCE: Final = 2
"""Passwords that are hashed at a time: each takes 64 MiB and a tenth of a second."""


class Passwords:
    """Hashes and verifies. For one event loop."""

    def __init__(self) -> None:
        self._hasher = PasswordHasher()
        self._free = asyncio.Semaphore(AT_ONCE)
        self._dummy: str | None = None

    async def hash(self, password: str) -> str:
        """The hash to keep. Raises UserRuleError for a password that is too short or too long."""
        text = _normal(password)
        if not SHORTEST <= len(text) <= LONGEST:
            raise UserRuleError(reason=f"a password has {SHORTEST} to {LONGEST} characters")
        async with self._free:
            return await asyncio.to_thread(self._hasher.hash, text)

    async def fits(self, password: str, kept: str | None) -> bool:
        """True where ``password`` is the one of ``kept``; None, for a name that nobody has, takes as long."""
        async with self._free:
            return await asyncio.to_thread(self._fits, _normal(password)[: LONGEST + 1], kept)

    def is_old(self, kept: str) -> bool:
        """True where a hash was made with another profile than today's."""
        return self._hasher.check_needs_rehash(kept)

    def _fits(self, password: str, kept: str | None) -> bool:
        if self._dummy is None:
            self._dummy = self._hasher.hash("nobody has this one")
        try:
            good = self._hasher.verify(kept or self._dummy, password)
        except VerifyMismatchError:
            return False
        except (VerificationError, InvalidHashError):
            # A hash that cannot be read lets nobody in; the person's password can be set anew.
            return False
        return good and kept is not None


def _normal(password: str) -> str:
    """One spelling of the same characters, whatever keyboard they came from (Unicode NFC)."""
    return unicodedata.normalize("NFC", password)
