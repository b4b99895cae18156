"""Sessions: who is signed in. Opened by a launch token while there is no user, by a login from then on.

Kept in the store by the hash of their secret, so that they outlive a restart of the server and a stolen store opens
nothing. A role is looked up with every request, so that a change of it counts at once.
"""

from __future__ import annotations

import asyncio
import hmac
import logging
import secrets
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Final

from app.errors import LoginError
from app.model.roles import Role, SignedIn
from app.service.office.audit import Action, AuditLog
from app.service.office.login_pause import LoginPause
from app.service.office.users import Users
from app.store import user_rows
from app.store.store import Store
from app.store.user_rows import SessionRow, name_key
from app.store.uuid7 import Uuid7

log = logging.getLogger(__name__)

SECRET_BYTES: Final = 32
SESSION_S: Final = 12 * 3600
"""A session ends this long after it was opened: a shift."""
LONGEST_TOKENS: Final = 100


@dataclass(eq=False, slots=True)
class Session:
    """One open session. ``ended`` is set when it ends before its time."""

    row: SessionRow
    ended: asyncio.Event = field(default_factory=asyncio.Event)


class Sessions:
    """The sessions of one store. Lives in the event loop; ``launch_person`` is who a launch token lets in."""

    def __init__(
        self,
        store: Store,
        users: Users,
        audit: AuditLog,
        launch_person: str,
        now_ns: Callable[[], int] = time.time_ns,
        monotonic_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._store = store
        self._users = users
        self._audit = audit
        self._launched = SignedIn(launch_person, Role.TECHNICIAN)
        self._now_ns = now_ns
        self._new_id = Uuid7(now_ns)
        self._pause = LoginPause(monotonic_s)
        self._tokens: list[str] = []
        rows = store.call(lambda connection: user_rows.open_sessions(connection, now_ns()))
        self._open = {row.secret_hash: Session(row) for row in rows}
        users.on_shut_out = self._shut_out

    @property
    def login_needed(self) -> bool:
        """True from the first user on."""
        return bool(self._users)

    # -- opening -------------------------------------------------------------------

    def issue_token(self) -> str:
        """A new token for a launch address; it works once."""
        token = secrets.token_urlsafe(SECRET_BYTES)
        self._tokens = [*self._tokens[-LONGEST_TOKENS:], token]
        return token

    async def launch(self, token: str) -> str | None:
        """Use up ``token``: the new session's secret; None where it is unknown, was used, or users exist."""
        given = token.encode("utf-8", "replace")
        found = [one for one in self._tokens if hmac.compare_digest(one.encode(), given)]
        if not found or self.login_needed:
            return None
        self._tokens.remove(found[0])
        secret = await self._begin(None)
        self._audit.note(Action.LAUNCHED, self._launched.person)
        return secret

    async def login(self, name: str, password: str, address: str) -> tuple[str, SignedIn]:
        """Open a session: its secret, and who it is. Raises LoginError, LoginPausedError, StoreError.

        ``address`` is where the request comes from.
        """
        key = name_key(name.strip())
        self._pause.check(key, address)
        # Counted before it is known, so that many tries at once are no way around the pause.
        self._pause.failed(key, address)
        try:
            user = await self._users.identify(name, password)
        except LoginError:
            self._pause.begin(key, address)
            self._audit.note(Action.LOGIN_FAILED, name.strip()[:64], None, at=address)
            raise
        self._pause.succeeded(key, address)
        secret = await self._begin(user.id)
        self._audit.note(Action.LOGIN, user.name, None, at=address)
        return secret, SignedIn(user.name, user.role, user.id)

    async def _begin(self, user_id: str | None) -> str:
        secret = secrets.token_urlsafe(SECRET_BYTES)
        now_ns = self._now_ns()
        row = SessionRow(self._new_id(), _hash(secret), user_id, now_ns, now_ns + SESSION_S * 1_000_000_000)
        await self._store.run(lambda connection: user_rows.add_session(connection, row))
        self._open[row.secret_hash] = Session(row)
        return secret

    # -- asking --------------------------------------------------------------------

    def find(self, secret: str) -> Session | None:
        """The open session with this secret."""
        session = self._open.get(_hash(secret))
        if session is None:
            return None
        if self.left_s(session) <= 0:
            self._end([session])
            return None
        return None if self.who(session) is None else session

    def who(self, session: Session) -> SignedIn | None:
        """Who a session belongs to now; None where it ended."""
        if session.ended.is_set():
            return None
        user_id = session.row.user_id
        if user_id is None:
            return None if self.login_needed else self._launched
        user = self._users.get(user_id)
        return None if user is None or user.disabled else SignedIn(user.name, user.role, user.id)

    def left_s(self, session: Session) -> float:
        """How long a session lasts yet, in s."""
        return (session.row.expires_ns - self._now_ns()) / 1e9

    # -- ending --------------------------------------------------------------------

    async def logout(self, session: Session) -> None:
        """End one session. Raises StoreError where it could not be forgotten on the disk too."""
        person = self.who(session)
        await self._forget(self._end([session]))
        if person is not None:
            self._audit.note(Action.LOGOUT, person.person)

    def _shut_out(self, user_id: str | None) -> None:
        ids = self._end([one for one in self._open.values() if one.row.user_id == user_id])
        if ids:
            dropping = self._store.submit(lambda connection: user_rows.drop_sessions(connection, ids))
            dropping.add_done_callback(_log_failure)

    def _end(self, sessions: list[Session]) -> list[str]:
        """End sessions at once, in memory."""
        for session in sessions:
            self._open.pop(session.row.secret_hash, None)
            session.ended.set()
        return [session.row.id for session in sessions]

    async def _forget(self, ids: list[str]) -> None:
        if ids:
            await self._store.run(lambda connection: user_rows.drop_sessions(connection, ids))


def _log_failure(done: Future[None]) -> None:
    """They are ended here all the same; after a restart they must not be open again without a word."""
    error = done.exception()
    if error is not None:
        log.error("ended sessions could not be forgotten on the disk: %s", error)


def _hash(secret: str) -> str:
    """Secrets are random and long: a plain hash is enough, and looking one up tells nothing of another."""
    return sha256(secret.encode("utf-8", "replace")).hexdigest()
