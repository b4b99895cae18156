"""Rows of users and of their sessions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, delete, insert, select, update

from app.model.roles import Role
from app.store.schema import sessions, users


@dataclass(frozen=True, slots=True)
class User:
    """A person who may log in, unless disabled. Users are never deleted: the audit log speaks of them."""

    id: str
    name: str
    role: Role
    password_hash: str
    disabled: bool
    created_ns: int

    @property
    def key(self) -> str:
        """The name as it is compared."""
        return name_key(self.name)


@dataclass(frozen=True, slots=True)
class SessionRow:
    """An open session; only the SHA-256 of its secret is kept. ``user_id`` None: opened by a launch token."""

    id: str
    secret_hash: str
    user_id: str | None
    created_ns: int
    expires_ns: int


def name_key(name: str) -> str:
    """A name as it is compared: without regard to case."""
    return name.casefold()


def all_users(connection: Connection) -> list[User]:
    """All users, in the order in which they were made."""
    return [_user(row._mapping) for row in connection.execute(select(users).order_by(users.c.id))]


def put_user(connection: Connection, user: User) -> None:
    """Add a user, or replace the one with this id."""
    values = {
        "id": user.id,
        "name": user.name,
        "name_key": user.key,
        "role": user.role.value,
        "password_hash": user.password_hash,
        "disabled": int(user.disabled),
        "created_ns": user.created_ns,
    }
    if not connection.execute(update(users).where(users.c.id == user.id).values(values)).rowcount:
        connection.execute(insert(users), values)


def open_sessions(connection: Connection, now_ns: int) -> list[SessionRow]:
    """The sessions that have not expired; the others are forgotten."""
    connection.execute(delete(sessions).where(sessions.c.expires_ns <= now_ns))
    return [SessionRow(**row._mapping) for row in connection.execute(select(sessions))]


def add_session(connection: Connection, session: SessionRow) -> None:
    """Keep a session."""
    connection.execute(
        insert(sessions),
        {
            "id": session.id,
            "secret_hash": session.secret_hash,
            "user_id": session.user_id,
            "created_ns": session.created_ns,
            "expires_ns": session.expires_ns,
        },
    )


def drop_sessions(connection: Connection, ids: list[str]) -> None:
    """Forget sessions."""
    connection.execute(delete(sessions).where(sessions.c.id.in_(ids)))


def _user(row: Any) -> User:
    return User(
        id=row["id"],
        name=row["name"],
        role=Role(row["role"]),
        password_hash=row["password_hash"],
        disabled=bool(row["disabled"]),
        created_ns=row["created_ns"],
    )
