"""Login and logout, one's own password, and the users."""

from __future__ import annotations

from fastapi import APIRouter, Depends, Request, Response

from app.errors import LoginNeededError, RoleError
from app.model.roles import Role
from app.service.office.sessions import Session
from app.web.access import Access
from app.web.deps import BenchOf, PersonOf, needs
from app.web.guard import SESSION
from app.web.models import Nothing
from app.web.models.users import LoginDone, LoginRequest, NewUser, OwnPassword, UserChange, UserDoc

router = APIRouter()


@router.post("/login")
async def login(bench: BenchOf, request: Request, response: Response, given: LoginRequest) -> LoginDone:
    """Open a session by name and password. After a few failures each further one must wait longer."""
    access: Access = request.app.state.access
    address = request.client.host if request.client is not None else ""
    secret, person = await bench.office.sessions.login(given.name, given.password, address)
    response.headers["set-cookie"] = access.cookie(secret)
    return LoginDone(person=person.person, role=person.role.value, user=person.user_id or "")


@router.post("/logout")
async def logout(bench: BenchOf, request: Request, response: Response, _request: Nothing) -> Nothing:
    """End the session; its sockets close."""
    access: Access = request.app.state.access
    session: Session | None = request.scope.get(SESSION)
    if session is not None:
        await bench.office.sessions.logout(session)
    response.headers["set-cookie"] = access.no_cookie()
    return Nothing()


@router.post("/password")
async def change_own_password(bench: BenchOf, person: PersonOf, given: OwnPassword) -> Nothing:
    """Change one's own password. All of one's sessions end."""
    if person.user_id is None:
        raise LoginNeededError
    await bench.office.users.change_own_password(person.user_id, given.old, given.new)
    return Nothing()


def _may_add(bench: BenchOf, person: PersonOf) -> None:
    """An expert adds users; the first one may be made by any technician. Raises RoleError."""
    needed = Role.EXPERT if bench.office.users else Role.TECHNICIAN
    if not person.role.covers(needed):
        raise RoleError(needs=needed.value, has=person.role.value)


@router.get("/users", dependencies=[needs(Role.EXPERT)])
async def users(bench: BenchOf, person: PersonOf) -> list[UserDoc]:
    """All users, disabled ones too."""
    return [UserDoc.of(user, person.user_id) for user in bench.office.users.all]


@router.post("/users", dependencies=[Depends(_may_add)])
async def add_user(bench: BenchOf, person: PersonOf, given: NewUser) -> UserDoc:
    """Add a user. The first one is an expert, and ends what launch tokens opened: from then on one logs in."""
    user = await bench.office.users.add(given.name, given.password, Role(given.role), person.person)
    return UserDoc.of(user, person.user_id)


@router.patch("/users/{user_id}", dependencies=[needs(Role.EXPERT)])
async def change_user(bench: BenchOf, person: PersonOf, user_id: str, given: UserChange) -> UserDoc:
    """Change a user's role or password, shut the user out or let them in again. One expert must remain."""
    everybody = bench.office.users
    user = everybody.require(user_id)
    if given.role is not None:
        user = await everybody.set_role(user.id, Role(given.role), person.person)
    if given.disabled is not None:
        user = await everybody.set_disabled(user.id, given.disabled, person.person)
    if given.password is not None:
        user = await everybody.set_password(user.id, given.password, person.person)
    return UserDoc.of(user, person.user_id)
