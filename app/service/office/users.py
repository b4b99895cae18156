"""Users: who there is, in which role, and the rules that keep the bench from being locked.

The store's only process keeps them in memory as well, so that every request can be judged without asking the disk.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from app.errors import LastExpertError, LoginError, UserExistsError, UserRuleError, UserUnknownError
from app.model.roles import Role
from app.service.office.audit import Action, AuditLog
from app.service.office.passwords import Passwords
from app.store import user_rows
from app.store.store import Store
from app.store.user_rows import User, name_key
from app.store.uuid7 import Uuid7

LONGEST_NAME: Final = 64


class Users:
    """The users of one store. ``on_shut_out`` hears whose sessions must end (None: those of launch tokens)."""

    def __init__(self, store: Store, audit: AuditLog, now_ns: Callable[[], int] = time.time_ns) -> None:
        self._store = store
        self._audit = audit
        self._now_ns = now_ns
        self._new_id = Uuid7(now_ns)
        self.passwords = Passwords()
        self._users = {user.id: user for user in store.call(user_rows.all_users)}
        self._changing = asyncio.Lock()
        self.on_shut_out: Callable[[str | None], None] = lambda _user_id: None

    def __bool__(self) -> bool:
        return bool(self._users)

    @property
    def all(self) -> list[User]:
        """All users, in the order in which they were made."""
        return list(self._users.values())

    def get(self, user_id: str) -> User | None:
        """The user with this id."""
        return self._users.get(user_id)

    def named(self, name: str) -> User | None:
        """The user of this name, without regard to case."""
        key = name_key(name.strip())
        return next((user for user in self._users.values() if user.key == key), None)

    def require(self, name_or_id: str) -> User:
        """The user of this id or name. Raises UserUnknownError."""
        user = self.get(name_or_id) or self.named(name_or_id)
        if user is None:
            raise UserUnknownError(name=name_or_id)
        return user

    async def add(self, name: str, password: str, role: Role, by: str) -> User:
        """Add a user; the first one is always an expert. Raises UserRuleError, UserExistsError, StoreError."""
        name = _checked_name(name)
        password_hash = await self.passwords.hash(password)
        async with self._changing:
            if self.named(name) is not None:
                raise UserExistsError(name=name)
            first = not self._users
            given = Role.EXPERT if first else role
            user = User(self._new_id(), name, given, password_hash, False, self._now_ns())
            await self._put(user)
        self._audit.note(Action.USER_ADDED, by, name=name, role=given.value)
        if first:
            self.on_shut_out(None)
        return user

    async def set_role(self, name_or_id: str, role: Role, by: str) -> User:
        """Give a user another role, from the next request on. Raises UserUnknownError, LastExpertError, StoreError."""
        async with self._changing:
            user = self.require(name_or_id)
            if role is not Role.EXPERT:
                self._keep_an_expert(user)
            changed = replace(user, role=role)
            await self._put(changed)
        if user.role is not role:
            self._audit.note(Action.USER_ROLE, by, name=user.name, was=user.role.value, now=role.value)
        return changed

    async def set_password(self, name_or_id: str, password: str, by: str) -> User:
        """Give a user another password; all their sessions end. Raises UserRuleError, UserUnknownError, StoreError."""
        self.require(name_or_id)
        password_hash = await self.passwords.hash(password)
        async with self._changing:
            changed = replace(self.require(name_or_id), password_hash=password_hash)
            await self._put(changed)
        self._audit.note(Action.USER_PASSWORD, by, name=changed.name)
        self.on_shut_out(changed.id)
        return changed

    async def change_own_password(self, user_id: str, old: str, new: str) -> None:
        """As ``set_password``, by who knows the old one. Raises LoginError too."""
        user = self.require(user_id)
        if not await self.passwords.fits(old, user.password_hash):
            raise LoginError
        await self.set_password(user.id, new, user.name)

    async def set_disabled(self, name_or_id: str, disabled: bool, by: str) -> User:
        """Shut a user out, or let them in again. Raises UserUnknownError, LastExpertError, StoreError."""
        async with self._changing:
            user = self.require(name_or_id)
            if disabled:
                self._keep_an_expert(user)
            changed = replace(user, disabled=disabled)
            await self._put(changed)
        if user.disabled is not disabled:
            self._audit.note(Action.USER_DISABLED if disabled else Action.USER_ENABLED, by, name=user.name)
        if disabled:
            self.on_shut_out(user.id)
        return changed

    async def identify(self, name: str, password: str) -> User:
        """The user of this name and password. Raises LoginError; a name that nobody has takes as long."""
        user = self.named(name)
        kept = None if user is None or user.disabled else user.password_hash
        if not await self.passwords.fits(password, kept) or user is None:
            raise LoginError
        if self.passwords.is_old(user.password_hash):
            renewed = await self.passwords.hash(password)
            async with self._changing:
                await self._put(replace(self.require(user.id), password_hash=renewed))
        return self.require(user.id)

    def _keep_an_expert(self, user: User) -> None:
        others = [one for one in self._users.values() if one.id != user.id]
        if not any(one.role is Role.EXPERT and not one.disabled for one in others):
            raise LastExpertError(name=user.name)

    async def _put(self, user: User) -> None:
        """On the disk first: what is in memory is never more than what is kept."""
        await self._store.run(lambda connection: user_rows.put_user(connection, user))
        self._users[user.id] = user


def _checked_name(name: str) -> str:
    name = " ".join(name.split())
    if not name or len(name) > LONGEST_NAME or not name.isprintable():
        raise UserRuleError(reason=f"a name has 1 to {LONGEST_NAME} printable characters")
    return name
