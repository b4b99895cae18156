"""Types of users and logins."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from app.model.roles import Role
from app.store.user_rows import User
from app.web.models import RoleName

Name = Annotated[str, Field(min_length=1, max_length=64, examples=["Jo Berg"])]
Password = Annotated[str, Field(max_length=200, examples=["correct horse battery"])]


class LoginRequest(BaseModel):
    """Who wants to be let in."""

    model_config = ConfigDict(extra="forbid")

    name: Name
    password: Password


class LoginDone(BaseModel):
    """Who is signed in now; the session is the cookie's."""

    person: str
    role: RoleName
    user: str


class UserDoc(BaseModel):
    """A user. ``you``: the one who asks."""

    id: str
    name: str
    role: RoleName
    disabled: bool
    created_ns: int
    you: bool

    @classmethod
    def of(cls, user: User, asking: str | None) -> UserDoc:
        """As the page gets it."""
        return cls(
            id=user.id,
            name=user.name,
            role=user.role.value,
            disabled=user.disabled,
            created_ns=user.created_ns,
            you=user.id == asking,
        )


class NewUser(BaseModel):
    """A user to be made. The first one is an expert, whatever role is named."""

    model_config = ConfigDict(extra="forbid")

    name: Name
    password: Password
    role: RoleName = Role.VIEWER.value


class UserChange(BaseModel):
    """What is to change; null stays as it is. Another password or ``disabled`` ends the user's sessions."""

    model_config = ConfigDict(extra="forbid")

    role: RoleName | None = None
    disabled: bool | None = None
    password: Password | None = None


class OwnPassword(BaseModel):
    """The password of who asks; all their sessions end, this one too."""

    model_config = ConfigDict(extra="forbid")

    old: Password
    new: Password
