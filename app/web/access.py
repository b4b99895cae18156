"""Who may use the bench: one-time launch tokens, and the sessions that they open. In memory only."""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Callable
from threading import Lock
from typing import Final

TOKEN_BYTES: Final = 32
SESSION_S: Final = 12 * 3600
"""A session ends this long after it was opened: a shift."""


class Access:
    """Tokens and sessions of one server. ``monotonic_s`` is the clock. Safe from any thread.

    A token works once. The session that it opens belongs to the browser, by a cookie: reload, further tabs and a
    restarted browser stay in; another browser needs a token of its own.
    """

    def __init__(self, monotonic_s: Callable[[], float]) -> None:
        self._monotonic_s = monotonic_s
        self._tokens: set[str] = set()
        self._sessions: dict[str, float] = {}
        self._lock = Lock()

    def issue_token(self) -> str:
        """A new token for a launch address."""
        token = secrets.token_urlsafe(TOKEN_BYTES)
        with self._lock:
            self._tokens.add(token)
        return token

    def open_session(self, token: str) -> str | None:
        """Use up ``token``: the new session's secret, or None where the token is unknown or was used."""
        with self._lock:
            found = _find(self._tokens, token)
            if found is None:
                return None
            self._tokens.remove(found)
            session = secrets.token_urlsafe(TOKEN_BYTES)
            self._sessions[session] = self._monotonic_s() + SESSION_S
            return session

    def holds(self, session: str) -> bool:
        """True where ``session`` is open."""
        now_s = self._monotonic_s()
        with self._lock:
            self._sessions = {key: until_s for key, until_s in self._sessions.items() if until_s > now_s}
            return _find(self._sessions, session) is not None


def _find(known: set[str] | dict[str, float], given: str) -> str | None:
    """The known secret that equals ``given``, in a time that does not tell how much of it fits."""
    found = None
    for secret in known:
        if hmac.compare_digest(secret.encode(), given.encode("utf-8", "replace")):
            found = secret
    return found
