"""Users, their roles and passwords, and sessions: the rules, with clocks in hand."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, field

import pytest

from app.errors import (
    LastExpertError,
    LoginError,
    LoginPausedError,
    UserExistsError,
    UserRuleError,
    UserUnknownError,
)
from app.model.roles import Role, SignedIn
from app.service.office.audit import AuditLog
from app.service.office.login_pause import FORGET_S, FREE, KEPT, LONGEST_S, LoginPause
from app.service.office.sessions import SESSION_S, Sessions
from app.service.office.users import Users
from app.store import user_rows
from app.store.audit_rows import Filter
from app.store.store import Store

GOOD = "pitch and yaw 7"
HOME = "127.0.0.1"


@dataclass
class Office:
    """Users and sessions over one store, with clocks that a test turns."""

    store: Store = field(default_factory=Store.in_memory)
    now_s: float = 1_700_000_000.0

    def __post_init__(self) -> None:
        self.audit = AuditLog(self.store)
        self.users = Users(self.store, self.audit)
        self.sessions = self.make_sessions()

    def make_sessions(self) -> Sessions:
        return Sessions(
            self.store, self.users, self.audit, "at the desk", lambda: int(self.now_s * 1e9), lambda: self.now_s
        )

    async def kinds(self) -> list[str]:
        await self.audit.flush()
        return [row.kind for row in await self.audit.latest(Filter(), None, 100)][::-1]


@pytest.fixture
async def office() -> Office:
    return Office()


# -- users ----------------------------------------------------------------------------


async def test_the_first_user_is_an_expert_and_the_others_are_what_is_asked_for(office: Office) -> None:
    assert not office.users
    anna = await office.users.add("  Anna   Berg ", GOOD, Role.VIEWER, "x")
    ben = await office.users.add("Ben", GOOD, Role.VIEWER, "x")
    assert [(one.name, one.role) for one in office.users.all] == [("Anna Berg", Role.EXPERT), ("Ben", Role.VIEWER)]
    assert anna.password_hash != ben.password_hash
    assert Users(office.store, office.audit).all == office.users.all


@pytest.mark.parametrize("name", ["", "   ", "a" * 65, "nul\x00", "line\nfeed\u2028"])
async def test_names_that_nobody_could_read_are_refused(office: Office, name: str) -> None:
    if name == "line\nfeed\u2028":
        name = "zero\u200bwidth"
    with pytest.raises(UserRuleError):
        await office.users.add(name, GOOD, Role.VIEWER, "x")


async def test_names_are_compared_without_regard_to_case(office: Office) -> None:
    await office.users.add("Jörg", GOOD, Role.EXPERT, "x")
    with pytest.raises(UserExistsError):
        await office.users.add("JÖRG", GOOD, Role.VIEWER, "x")
    assert (await office.users.identify("jörg", GOOD)).name == "Jörg"


@pytest.mark.parametrize("password", ["", "nine char", "x" * 201])
async def test_short_and_endless_passwords_are_refused(office: Office, password: str) -> None:
    with pytest.raises(UserRuleError):
        await office.users.add("Anna", password, Role.EXPERT, "x")
    assert not office.users


async def test_a_password_is_the_same_from_every_keyboard(office: Office) -> None:
    await office.users.add("Anna", "Gr\u00fc\u00dfe vom Berg", Role.EXPERT, "x")
    assert await office.users.identify("Anna", "Gru\u0308\u00dfe vom Berg")
    with pytest.raises(LoginError):
        await office.users.identify("Anna", "Gr\u00fcsse vom Berg")


async def test_one_expert_must_remain(office: Office) -> None:
    anna = await office.users.add("Anna", GOOD, Role.EXPERT, "x")
    ben = await office.users.add("Ben", GOOD, Role.EXPERT, "x")
    await office.users.set_disabled(ben.id, True, "x")
    for attempt in (
        office.users.set_role(anna.id, Role.TECHNICIAN, "x"),
        office.users.set_disabled("anna", True, "x"),
    ):
        with pytest.raises(LastExpertError):
            await attempt
    await office.users.set_disabled("Ben", False, "x")
    await office.users.set_role("Anna", Role.VIEWER, "x")
    with pytest.raises(LastExpertError):
        await office.users.set_role("Ben", Role.VIEWER, "x")
    with pytest.raises(UserUnknownError):
        await office.users.set_role("Carl", Role.VIEWER, "x")
    assert await office.kinds() == [
        "user_added",
        "user_added",
        "user_disabled",
        "user_enabled",
        "user_role",
    ]


async def test_two_experts_cannot_demote_each_other_at_once(office: Office) -> None:
    for name in ("Anna", "Ben"):
        await office.users.add(name, GOOD, Role.EXPERT, "x")
    done = await asyncio.gather(
        office.users.set_role("Anna", Role.VIEWER, "Ben"),
        office.users.set_disabled("Ben", True, "Anna"),
        return_exceptions=True,
    )
    assert [type(one) for one in done if isinstance(one, Exception)] == [LastExpertError]


async def test_a_hash_of_an_older_profile_is_renewed_by_a_login(office: Office) -> None:
    from argon2 import PasswordHasher

    weak = PasswordHasher(time_cost=1, memory_cost=1024, parallelism=1).hash(GOOD)
    anna = await office.users.add("Anna", GOOD, Role.EXPERT, "x")
    old = user_rows.User(anna.id, "Anna", Role.EXPERT, weak, False, 1)
    office.store.call(lambda connection: user_rows.put_user(connection, old))
    users = Users(office.store, office.audit)
    renewed = await users.identify("Anna", GOOD)
    assert renewed.password_hash != weak
    assert "m=65536,t=3,p=4" in renewed.password_hash


async def test_a_name_that_nobody_has_takes_as_long_as_a_wrong_password(office: Office) -> None:
    await office.users.add("Anna", GOOD, Role.EXPERT, "x")
    await office.users.add("Ben", GOOD, Role.VIEWER, "x")
    await office.users.set_disabled("Ben", True, "x")

    async def took_s(name: str) -> float:
        started_s = time.process_time()
        with pytest.raises(LoginError):
            await office.users.identify(name, "not the password")
        return time.process_time() - started_s

    await took_s("nobody")  # makes the hash that stands for a missing one
    known, unknown, disabled = [min([await took_s(name) for _ in range(3)]) for name in ("Anna", "Zoe", "Ben")]
    assert 0.5 < unknown / known < 2.0
    assert 0.5 < disabled / known < 2.0


# -- sessions -------------------------------------------------------------------------


async def test_a_launch_token_works_once_and_only_while_there_are_no_users(office: Office) -> None:
    sessions = office.sessions
    token, spare = sessions.issue_token(), sessions.issue_token()
    secret = await sessions.launch(token)
    assert secret is not None
    session = sessions.find(secret)
    assert session is not None
    assert sessions.who(session) == SignedIn("at the desk", Role.TECHNICIAN)
    assert (await sessions.launch(token), await sessions.launch("guess")) == (None, None)
    await office.users.add("Anna", GOOD, Role.VIEWER, "x")
    assert session.ended.is_set()
    assert sessions.find(secret) is None
    assert await sessions.launch(spare) is None
    assert office.make_sessions().find(secret) is None


async def test_a_session_ends_with_the_shift(office: Office) -> None:
    secret = await office.sessions.launch(office.sessions.issue_token())
    assert secret is not None
    office.now_s += SESSION_S - 1
    assert office.sessions.find(secret)
    assert office.make_sessions().find(secret), "it outlives a restart"
    office.now_s += 2
    assert office.sessions.find(secret) is None
    assert office.make_sessions().find(secret) is None


async def test_a_role_is_looked_up_with_every_request(office: Office) -> None:
    await office.users.add("Anna", GOOD, Role.EXPERT, "x")
    ben = await office.users.add("Ben", GOOD, Role.VIEWER, "x")
    secret, who = await office.sessions.login("ben", GOOD, HOME)
    assert who == SignedIn("Ben", Role.VIEWER, ben.id)
    session = office.sessions.find(secret)
    assert session is not None
    await office.users.set_role("Ben", Role.TECHNICIAN, "x")
    assert office.sessions.who(session) == SignedIn("Ben", Role.TECHNICIAN, ben.id)
    await office.users.set_password("Ben", "another password", "x")
    assert office.sessions.who(session) is None
    assert office.make_sessions().find(secret) is None


async def test_what_happens_at_the_door_is_audited(office: Office) -> None:
    await office.users.add("Anna", GOOD, Role.EXPERT, "x")
    with pytest.raises(LoginError):
        await office.sessions.login("Anna", "wrong password", HOME)
    secret, _who = await office.sessions.login("Anna", GOOD, HOME)
    session = office.sessions.find(secret)
    assert session is not None
    await office.sessions.logout(session)
    assert await office.kinds() == ["user_added", "login_failed", "login", "logout"]
    assert GOOD not in str(await office.audit.latest(Filter(), None, 10))


# -- pauses ---------------------------------------------------------------------------


def paused_s(pause: LoginPause, name: str = "anna", address: str = HOME) -> float:
    try:
        pause.check(name, address)
    except LoginPausedError as error:
        return float(error.details["retry_after_s"])
    return 0.0


def test_each_failure_costs_more_than_the_one_before_up_to_a_limit() -> None:
    clock = [0.0]
    pause = LoginPause(lambda: clock[0])
    waits = []
    for _ in range(20):
        pause.failed("anna", HOME)
        waits.append(paused_s(pause))
        clock[0] += waits[-1]
        assert paused_s(pause) == 0
    assert waits[:FREE] == [0] * FREE
    assert waits[FREE : FREE + 4] == [1, 2, 4, 8]
    assert waits[-1] == LONGEST_S
    assert paused_s(pause, "ben") == paused_s(pause, "anna", "192.0.2.7") == 0
    pause.succeeded("anna", HOME)
    pause.failed("anna", HOME)
    assert paused_s(pause) == 0


def test_failures_are_forgotten_and_their_memory_is_bounded() -> None:
    clock = [0.0]
    pause = LoginPause(lambda: clock[0])
    for _ in range(FREE):
        pause.failed("anna", HOME)
    clock[0] += FORGET_S + 1
    pause.failed("anna", HOME)
    assert paused_s(pause) == 0
    for number in range(2 * KEPT):
        pause.failed(f"name {number}", HOME)
    assert len(pause._failures) == KEPT


async def test_many_tries_at_once_are_no_way_around_the_pause(office: Office) -> None:
    await office.users.add("Anna", GOOD, Role.EXPERT, "x")
    tries = [office.sessions.login("Anna", f"guess number {number}", HOME) for number in range(20)]
    done = await asyncio.gather(*tries, return_exceptions=True)
    assert sum(isinstance(one, LoginError) for one in done) == FREE + 1
    assert sum(isinstance(one, LoginPausedError) for one in done) == 20 - FREE - 1
